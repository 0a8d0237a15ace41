"""What `close-loop` is given on its command line, as observations: sources, and winds beside
them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from flagdata.core.files.addresses import local_path
from flagdata.core.shell import command_line
from flagdata.errors import UsageError
from flagdata.ingest.anemometer import WindOptions
from flagdata.ingest.anemometer.log_confirmation import UNASKED, Confirm
from flagdata.lake import Lake
from measure.trajectories import Observation, Up
from measure.trajectories.experiment_recipe import (
    RecordingSource,
    WindSource,
    blown,
    open_recordings,
)
from measure.trajectories.wind_tracks import LogPlacement

Recorded = TypeVar("Recorded", bound="_Recording")
_HERE = Path()


class _Recording(Protocol):
    """A frozen dataclass with a name."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def name(self) -> str: ...


@dataclass(frozen=True, kw_only=True)
class SourceOptions:
    """How sources are to be read.

    Attributes:
        rate: frames a second [Hz]; None for what the source says.
        unit: of positions.
        noise: standard deviation of a coordinate [m]; None to estimate it.
        up: axis of the recordings that points up; all other options use z up.
        axis: along which the air goes; None for what a log's directions and `north` say.
        north: where north lies, from +x towards +y [rad].
        offset: added to the recordings' clock to reach the log's [s]; None if not given.
        sensor, zone: how a log's file is read, where it does not say so itself: see `WindOptions`.
        confirm: asks whether a drafted reading of a log is right.
    """

    rate: float | None = None
    unit: str = "m"
    noise: float | None = None
    up: Up = Up.Z
    axis: tuple[float, float, float] | None = (1.0, 0.0, 0.0)
    north: float | None = None
    offset: float | None = None
    sensor: str | None = None
    zone: str | None = None
    confirm: Confirm = UNASKED


def read(
    sources: Sequence[str], winds: Sequence[str], reading: SourceOptions, lake: Lake | None
) -> list[Observation]:
    """Reads the recordings of some sources.

    Args:
        winds: one for all recordings, one each, or none where the sources know theirs: a speed
            [m/s], a log, or an artifact.

    Raises:
        NotFoundError: a source that is neither a file nor an artifact.
        UsageError: winds that do not fit the recordings.
        FlagdataError: as the readers.
    """
    observations = [
        (observation.turned(reading.up), source, wind)
        for observation, source, wind in _beside(sources, winds, reading, lake)
    ]
    return distinct(
        [blown(observation, wind, _HERE, lake) for observation, _, wind in observations]
    )


def _beside(
    sources: Sequence[str], winds: Sequence[str], reading: SourceOptions, lake: Lake | None
) -> list[tuple[Observation, RecordingSource, WindSource | None]]:
    """Returns the recordings of some sources as they are, each with its source and its wind; as
    `read`."""
    observations: list[tuple[Observation, RecordingSource]] = []
    for text in sources:
        source = RecordingSource(
            source=text, rate=reading.rate, unit=reading.unit, noise=reading.noise
        )
        several = open_recordings(source, _HERE, lake)
        observations += [
            (observation, replace(source, take=observation.name if len(several) > 1 else ""))
            for observation in several
        ]
    if len(winds) not in (0, 1, len(observations)):
        raise UsageError(
            f"there are {len(winds)} winds for {len(observations)} recordings",
            where="--wind",
            fix="give one, or one for each recording",
        )
    if not any(map(_is_log, winds)):
        options = {
            "clock-offset": reading.offset,
            "sensor": reading.sensor,
            "zone": reading.zone,
            "accept": reading.confirm.accept,
        }
        for name in options:
            if options[name] is not None:
                raise UsageError(
                    "no wind is a log",
                    where=f"--{name}",
                    fix="leave it out, or name a log by --wind",
                )
    wind_sources = [
        _wind(wind, reading)
        for wind in (winds if len(winds) == len(observations) else [*winds[:1]] * len(observations))
    ]
    return [
        (observation, source, wind)
        for (observation, source), wind in zip(
            observations, wind_sources or [None] * len(observations), strict=True
        )
    ]


def draft_recordings(
    sources: Sequence[str],
    winds: Sequence[str],
    reading: SourceOptions,
    lake: Lake | None,
    *,
    folder: Path,
) -> dict[str, Any]:
    """Returns what a recipe says of the recordings of some sources, see
    `measure.trajectories.experiment_recipe`.

    Args:
        folder: of the recipe, which its paths are relative to.

    Raises:
        FlagdataError: as `read`.
    """

    def place_source(text: str) -> str:
        path = local_path(text)
        return os.path.relpath(path, folder) if path.exists() else text

    def blowing(wind: WindSource) -> dict[str, Any]:
        if wind.velocity is not None:
            return {"velocity": list(wind.velocity)}
        log = {
            "log": place_source(wind.log),
            "axis": reading.axis,
            "north": reading.north,
            "clock_offset": reading.offset,
        }
        sensor = None if reading.sensor is None else place_source(reading.sensor)
        return log | {"sensor": sensor, "zone": reading.zone, "accept": reading.confirm.accept}

    tables = []
    for _, source, wind in _beside(sources, winds, reading, lake):
        table = {
            **vars(source),
            "source": place_source(source.source),
            "wind": None if wind is None else blowing(wind),
        }
        tables.append(table)
    return filled_entries({"up": reading.up.value, "recording": tables})


def filled_entries(table: Mapping[str, Any]) -> dict[str, Any]:
    """Returns a table of a recipe without what it says nothing of."""
    stated_entries: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            value = filled_entries(value)
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            value = [filled_entries(entry) for entry in value]
        if value not in (None, "", {}, "m"):
            stated_entries[key.replace("_", "-")] = value
    return stated_entries


def _is_log(text: str) -> bool:
    """Returns whether a wind is something other than a speed."""
    try:
        float(text)
    except ValueError:
        return True
    return False


def _wind(text: str, reading: SourceOptions) -> WindSource:
    if _is_log(text):
        placement = LogPlacement(axis=reading.axis, north=reading.north, offset=reading.offset)
        options = WindOptions(recipe=reading.sensor, zone=reading.zone)
        return WindSource(log=text, placement=placement, options=options, confirm=reading.confirm)
    speed = float(text)
    if reading.axis is None:
        raise UsageError(
            "the speed has no direction",
            where=command_line("--wind", text),
            fix="give --axis, not --north",
        )
    x, y, z = (speed * np.array(reading.axis) / float(np.linalg.norm(reading.axis))).tolist()
    return WindSource(velocity=(x, y, z))


def distinct(recordings: Sequence[Recorded]) -> list[Recorded]:
    """Makes recordings' names different where two are the same."""
    names = [recording.name for recording in recordings]
    return [
        replace(recording, name=f"{recording.name} ({number})")
        if names.count(recording.name) > 1
        else recording
        for number, recording in enumerate(recordings, start=1)
    ]
