"""What `close-loop` is given, as observations: ArcSim folders, marker tables, artifacts of a lake; wind beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flagdata.errors import NotFoundError, UsageError
from flagdata.findings import Finding
from flagdata.ingest.markers.table import MarkerOptions, is_marker_table, read_table
from flagdata.lake import Lake
from flagdata.lake.markers import MarkerSequence
from measure.observe import Observation, WindTrack, from_arrays
from measure.observe import meshes as seen_meshes
from measure.observe import wind as seen_wind
from measure.observe.wind import LogPlacement


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How sources are to be read.

    Attributes:
        lake: where artifacts are looked up; None if only files are given.
        rate: frames a second [Hz]; None for what the source says.
        unit: of positions.
        noise: standard deviation of a coordinate [m]; None to estimate it.
        axis: along which the air goes.
        offset: from a log's first sample to the first frame [s].
    """

    lake: Path | None = None
    rate: float | None = None
    unit: str = "m"
    noise: float | None = None
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    offset: float = 0.0


def read(sources: Sequence[str], winds: Sequence[str], reading: Reading) -> list[Observation]:
    """The recordings of some sources.

    Args:
        winds: one for all recordings, one each, or none where the sources know theirs: a speed [m/s], a log, or an
            artifact.

    Raises:
        NotFoundError: a source that is neither a file nor an artifact.
        UsageError: winds that do not fit the recordings.
        FlagdataError: as the readers.
    """
    found = [observation for source in sources for observation in _recordings(source, reading)]
    if len(winds) not in (0, 1, len(found)):
        raise UsageError(
            f"{len(winds)} winds for {len(found)} recordings", where="--wind", fix="give one, or one for each recording"
        )
    if winds:
        each = winds if len(winds) == len(found) else [winds[0]] * len(found)
        found = [_blown(seen, wind, reading) for seen, wind in zip(found, each, strict=True)]
    return _distinct(found)


def _recordings(source: str, reading: Reading) -> list[Observation]:
    path = Path(source)
    if path.is_dir():
        seen = seen_meshes.from_folder(path, rate=reading.rate, unit=reading.unit)
        return [replace(seen, noise=reading.noise)]
    if path.is_file():
        if not is_marker_table(path):
            raise UsageError(
                "not a table of tracked markers", where=source,
                fix="give columns frame or time, marker, u, v, x, y, z; or the folder of an ArcSim run",
            )  # fmt: skip
        table = read_table(path, MarkerOptions(rate=reading.rate, unit=reading.unit))
        return [_tracked(name or path.stem, sequence, reading) for name, sequence in table.items()]
    if reading.lake is None:
        raise NotFoundError(
            "no such file or folder", where=source, fix="check the path, or give --lake for an artifact"
        )
    lake = Lake.open(reading.lake)
    seen = seen_meshes.from_artifact(lake, lake.artifact(source))
    return [replace(seen, noise=reading.noise)]


def _tracked(name: str, sequence: MarkerSequence, reading: Reading) -> Observation:
    times = np.asarray(sequence.time, dtype=np.float64) * 1e-9
    rate = reading.rate or float((len(times) - 1) / (times[-1] - times[0]))
    return from_arrays(
        name=name, positions=np.asarray(sequence.positions, dtype=np.float64),
        rest=np.asarray(sequence.rest, dtype=np.float64), rate=rate, noise=reading.noise,
    )  # fmt: skip


def _blown(seen: Observation, wind: str, reading: Reading) -> Observation:
    track, found = _wind(wind, reading)
    return replace(seen, wind=track, findings=(*seen.findings, *found))


def _wind(wind: str, reading: Reading) -> tuple[WindTrack, tuple[Finding, ...]]:
    axis = np.array(reading.axis) / float(np.linalg.norm(reading.axis))
    try:
        speed = float(wind)
    except ValueError:
        pass
    else:
        along = axis * speed
        return WindTrack.constant((float(along[0]), float(along[1]), float(along[2]))), ()
    placement = LogPlacement(axis=reading.axis, offset=reading.offset)
    path = Path(wind)
    if path.is_file():
        return seen_wind.from_log(path, placement)
    if reading.lake is None:
        raise NotFoundError("neither a speed nor a file", where=f"--wind {wind}", fix="give m/s, or a log's path")
    lake = Lake.open(reading.lake)
    return seen_wind.from_artifact(lake, lake.artifact(wind), placement)


def _distinct(found: Sequence[Observation]) -> list[Observation]:
    """Names made different where two are the same."""
    names = [seen.name for seen in found]
    return [
        replace(seen, name=f"{seen.name} ({index + 1})") if names.count(seen.name) > 1 else seen
        for index, seen in enumerate(found)
    ]
