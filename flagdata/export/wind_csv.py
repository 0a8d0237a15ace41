"""CSV of the wind: every sample of an anemometer with its instant, channels in SI units and what is
wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from flagdata.core.schema import CHANNELS, Kind, SampleFlag
from flagdata.errors import InputError
from flagdata.export.csv_text import cell, write_csv
from flagdata.export.export_source import Entry, ExportRows
from flagdata.record.signals import WindSeries
from flagdata.timebase import iso

TIME, DEVICE, FLAGS = "time", "device_time", "flags"
_NAMED = tuple(flag for flag in SampleFlag if flag)


@dataclass(frozen=True, kw_only=True)
class WindCsv:
    """Files <artifact>.csv: UTC on the common clock and on the anemometer's own, each channel with
    its unit, flags.

    Numbers read back exactly, and missing ones are empty cells. Flags are names of
    `schema.SampleFlag`, divided by semicolons; samples that have them are written as all others
    are.
    """

    kinds: ClassVar[frozenset[Kind]] = frozenset({Kind.WIND, Kind.RECORDING})

    def write(
        self, source: ExportRows, folder: Path, advance: Callable[[int], None]
    ) -> Mapping[str, Any]:
        samples = 0
        channels: dict[str, None] = {}
        for entry in source.entries():
            wind = entry.record.wind()
            if wind is None:
                fix = "leave it out by --where"
                raise InputError(
                    "a record without wind makes no table of it", where=entry.key, fix=fix
                )
            header = [TIME, DEVICE, *map(_heading, wind.channels), FLAGS]
            write_csv(folder / f"{entry.key}.csv", header, _rows(entry, wind))
            samples += len(wind.time)
            channels |= dict.fromkeys(wind.channels)
            advance(1)
        frames = {name: frame for name in channels if (frame := CHANNELS[name].frame)}
        return {
            "samples": samples,
            "units": {name: CHANNELS[name].unit for name in channels},
            "frames": frames,
        }


def _heading(channel: str) -> str:
    return f"{channel} [{CHANNELS[channel].unit}]"


def _rows(entry: Entry, wind: WindSeries) -> Iterator[Sequence[object]]:
    columns = [values.tolist() for values in wind.channels.values()]
    device_times = entry.record.device_wind_times.tolist()
    for time, device, flags, *values in zip(
        wind.time.tolist(), device_times, wind.flags.tolist(), *columns, strict=True
    ):
        yield (
            iso(time),
            iso(device),
            *map(cell, values),
            ";".join(str(flag.name) for flag in _NAMED if flags & flag),
        )
