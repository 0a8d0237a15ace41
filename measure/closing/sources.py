"""What `close-loop` is given on its command line, as observations: sources, and winds beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from flagdata.errors import UsageError
from flagdata.ingest.anemometer import WindOptions
from flagdata.ingest.anemometer.confirm import UNASKED, Confirm
from flagdata.lake import Lake
from measure.calibrate.observed import Observed
from measure.observe import Observation, Up
from measure.observe.recipe import RecordingSource, WindSource, blown, opened
from measure.observe.wind import LogPlacement

Recorded = TypeVar("Recorded", Observation, Observed)
_HERE = Path()


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How sources are to be read.

    Attributes:
        rate: frames a second [Hz]; None for what the source says.
        unit: of positions.
        noise: standard deviation of a coordinate [m]; None to estimate it.
        up: axis of the recordings that points up; all other options use z up.
        axis: along which the air goes; None for what a log's directions and `north` say.
        north: where north lies, from +x towards +y [rad].
        offset: from a log's first sample to the first frame [s]; None if not given.
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


def read(sources: Sequence[str], winds: Sequence[str], reading: Reading, lake: Lake | None) -> list[Observation]:
    """The recordings of some sources.

    Args:
        winds: one for all recordings, one each, or none where the sources know theirs: a speed [m/s], a log, or an
            artifact.

    Raises:
        NotFoundError: a source that is neither a file nor an artifact.
        UsageError: winds that do not fit the recordings.
        FlagdataError: as the readers.
    """
    found = [
        seen.turned(reading.up)
        for source in sources
        for seen in opened(
            RecordingSource(source=source, rate=reading.rate, unit=reading.unit, noise=reading.noise), _HERE, lake
        )
    ]
    if len(winds) not in (0, 1, len(found)):
        raise UsageError(
            f"{len(winds)} winds for {len(found)} recordings", where="--wind", fix="give one, or one for each recording"
        )
    if not any(map(_is_log, winds)):
        given = {
            "offset": reading.offset,
            "sensor": reading.sensor,
            "zone": reading.zone,
            "accept": reading.confirm.accept,
        }
        for name in given:
            if given[name] is not None:
                raise UsageError("no wind is a log", where=f"--{name}", fix="leave it out, or name a log by --wind")
    each = [_wind(wind, reading) for wind in (winds if len(winds) == len(found) else [*winds[:1]] * len(found))]
    return distinct(
        [blown(seen, wind, _HERE, lake) for seen, wind in zip(found, each or [None] * len(found), strict=True)]
    )


def _is_log(text: str) -> bool:
    """Whether a wind is something other than a speed."""
    try:
        float(text)
    except ValueError:
        return True
    return False


def _wind(text: str, reading: Reading) -> WindSource:
    if _is_log(text):
        placement = LogPlacement(axis=reading.axis, north=reading.north, offset=reading.offset)
        options = WindOptions(recipe=reading.sensor, zone=reading.zone)
        return WindSource(log=text, placement=placement, options=options, confirm=reading.confirm)
    speed = float(text)
    if reading.axis is None:
        raise UsageError("a speed without a direction", where=f"--wind {text}", fix="give --axis, not --north")
    x, y, z = (speed * np.array(reading.axis) / float(np.linalg.norm(reading.axis))).tolist()
    return WindSource(velocity=(x, y, z))


def distinct(found: Sequence[Recorded]) -> list[Recorded]:
    """Recordings with names made different where two are the same."""
    names = [seen.name for seen in found]
    return [
        replace(seen, name=f"{seen.name} ({number})") if names.count(seen.name) > 1 else seen
        for number, seen in enumerate(found, start=1)
    ]
