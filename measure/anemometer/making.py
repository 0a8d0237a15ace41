"""From the recordings that a user names to a reading model in the lake.

A reading model in the lake: a measurement of its recordings, whose object is a Zarr folder of plain
arrays.

Its identity is a hash of what went in: the recordings and their parts, the network, the flag's size
and how films were read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from flagdata.core.findings import quality_flags
from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical
from flagdata.core.schema import Kind
from flagdata.core.workload import one_thread
from flagdata.errors import InputError
from flagdata.lake import Artifact, Lake, results
from flagdata.lake.results import Placed
from measure.anemometer.reading_calibration import (
    ANSWER,
    ENOUGH,
    LEAST,
    ReadingCalibration,
    Recording,
    calibrate_reading,
    windows_of_recording,
)
from measure.cloth.observed_recording import usable
from measure.film.film_source import FilmReading, Subject, subjects
from measure.film.similarity import FlagSize
from measure.measuring_model.networks import CALIBRATED, network
from measure.measuring_model.reading_model_folder import write
from measure.measuring_model.window_features import VERSION
from models.conditioning.conditioning import VERSION as CONDITIONED


def artifact(result: ReadingCalibration, name: str, reading: FilmReading) -> Artifact:
    """Builds the row of a reading model, without its object.

    Args:
        name: under which `flagdata measure --model` finds it.
        reading: how films were read.
    """
    model = result.model
    spans = [
        [float(recording.features.starts[0]), len(recording.features.starts) * model.step]
        for recording in result.recordings
    ]
    return Artifact(
        kind=Kind.MEASUREMENT,
        name=name,
        parents=[recording.artifact for recording in result.recordings],
        recipe={
            CALIBRATED: ANSWER,
            "features": VERSION,
            "conditioned": CONDITIONED,
            "network": model.identity,
            "flag_size": [model.size.length, model.size.height],
            "spans": spans,
            "level": result.level,
            **reading.recipe(),
        },
        quality=quality_flags(result.findings),
        report=canonical({"schema": "flagdata.anemometer-report/1", **json_values(result)}),
    )


def keep(
    lake: Lake, result: ReadingCalibration, name: str, reading: FilmReading, *, branch: str
) -> Placed:
    """Commits a reading model where it is new, see `flagdata.lake.results`.

    Raises:
        FlagdataError: as `Lake.transaction`.
    """
    return results.keep(
        lake,
        artifact(result, name, reading),
        lambda staged: write(staged, result.model, json_values(result)),
        f"calibrate {name}",
        branch=branch,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Made:
    """A reading model that was made.

    Attributes:
        name: by which `flagdata measure --model` finds it.
        result: what it is.
        placed: its place among its versions in the lake; None where it is not to be there.
    """

    name: str
    result: ReadingCalibration
    placed: Placed | None

    @property
    def artifact(self) -> str | None:
        """Its id in the lake; None where it is not to be there."""
        return None if self.placed is None else self.placed.artifact.id

    @property
    def document(self) -> dict[str, Any]:
        """Everything as JSON values."""
        return {"name": self.name, "artifact": self.artifact, **json_values(self.result)}


@one_thread()
def made(
    sources: Sequence[str],
    size: FlagSize,
    reading: FilmReading,
    *,
    name: str | None,
    model: str | None,
    lake: Lake | None,
    at: str,
    branch: str | None,
    first: float,
    last: float | None,
    level: float,
    advance: Callable[[int], object] | None = None,
) -> Made:
    """Makes a reading model from recordings of one flag at one place.

    Args:
        name: of the model; None for the first recording's with "-anemometer".
        model: network whose summary is used.
        at: tag, branch or version of the lake to look at.
        branch: of the lake on which the model is committed; None to keep it nowhere.
        first, last: part of the films [s].
        advance: called with the number of windows that were looked at.

    Raises:
        InputError, RefusedError: see `recorded` and `calibrated`.
        UsageError, UnknownNameError: nothing of these names.
    """

    def open_subject(source: str) -> Subject:
        return subjects(source, query=None, lake=lake, at=at, reading=reading)[0]

    opened_subjects, unopened = usable(sources, open_subject, name=str)
    reader = network(model, lake=lake, at=at)
    seconds = sum(
        min(subject.film.duration, math.inf if last is None else last) - first
        for subject in opened_subjects
    )
    if seconds < LEAST:
        raise InputError(
            f"only {max(seconds, 0.0):.0f} s of film have a log beside them",
            where=opened_subjects[0].film.name,
            fix=f"give {LEAST:.0f} s or more; {ENOUGH / 60:.0f} minutes are better",
        )

    def step(_: int, count: int) -> None:
        if advance is not None:
            advance(count)

    def look(subject: Subject) -> Recording:
        part = {"first": first, "last": last}
        return windows_of_recording(subject, reader, size, **part, lake=lake, advance=step)

    recordings, unread = usable(opened_subjects, look, name=lambda recording: recording.film.name)
    result = calibrate_reading(recordings, network=reader, size=size, level=level)
    result = replace(result, findings=(*unopened, *unread, *result.findings))
    title = name if name is not None else f"{recordings[0].name}-anemometer"
    if lake is None or branch is None:
        return Made(name=title, result=result, placed=None)
    return Made(name=title, result=result, placed=keep(lake, result, title, reading, branch=branch))
