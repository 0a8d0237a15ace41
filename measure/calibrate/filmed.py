"""A film of a flag and the log beside it, as a calibration takes them."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from flagdata.errors import InputError, RefusedError, UsageError
from flagdata.findings import Finding
from flagdata.lake import Lake
from measure.calibrate.observed import LONGEST, Observed, cut, first_part, of_table
from measure.calibrate.simulation import OBSERVED
from measure.calibrate.wind import Log
from measure.estimate.similarity import FlagSize
from measure.estimate.source import Reading, Subject, subjects
from measure.observables import OBSERVABLES
from measure.observables.observable import WINDOW
from measure.observables.watching import watched

_TABLES = (".csv", ".parquet")
_LOST = 0.2
"""Share of the frames that could not be registered from which on a film is refused."""


def of_source(
    source: str, size: FlagSize, reading: Reading, *, lake: Lake | None, at: str, first: float, last: float | None,
    advance: Callable[[int], object] | None = None,
) -> tuple[Observed, str | None]:  # fmt: skip
    """What a table or a recording of a lake shows from `first` to `last` [s], and the recording's id.

    Args:
        reading: how a film is read.
        advance: called with the number of its windows that were read.

    Raises:
        UsageError: a table, and a crop or a flag's number.
        InputError: a film without a log, or a log that does not cover it.
        FlagdataError: nothing of that name; a film in which no flag is found.
    """
    path = Path(source)
    if path.suffix.lower() in _TABLES and path.is_file():
        if reading.crop is not None or reading.flag is not None:
            raise UsageError(
                "a table of observables has no pictures", where="--crop, --flag", fix="give them to flagdata observe"
            )
        return cut(of_table(path), first, last), None
    (subject,) = subjects(source, query=None, lake=lake, at=at, reading=reading)
    found = of_film(subject, size, first=first, last=last, advance=advance)
    return found, None if subject.artifact is None else subject.artifact.id


def of_film(
    subject: Subject, size: FlagSize, *, first: float, last: float | None,
    advance: Callable[[int], object] | None = None,
) -> Observed:  # fmt: skip
    """The windows of a film whose recording holds a log; the other parameters as for `of_source`.

    Raises:
        InputError: no log beside it, or one that does not cover the film.
        RefusedError: no flag is found, or the camera moves and cannot be steadied.
    """
    film, wind = subject.film, None if subject.record is None else subject.record.wind()
    if wind is None or film.start is None:
        raise InputError(
            "no log of the wind is beside the film", where=film.name,
            fix="align a film and a log (flagdata align), and name the recording that comes out",
        )  # fmt: skip
    log = Log.of(wind, start=film.start)
    end = min(film.duration, math.inf if last is None else last)
    findings: tuple[Finding, ...] = ()
    if end - first > LONGEST + WINDOW:
        findings, end = (first_part(end - first),), first + LONGEST
    log.cut(first, end)  # refuses before the film is read
    seen = watched(film, size, first=first, last=end, advance=advance)
    findings += film.findings()
    if lost := [one for one in findings if one.kind == "camera-lost" and (one.value or 0.0) > _LOST]:
        raise RefusedError(
            f"the camera moves and cannot be steadied: {lost[0].what}", where=film.name,
            fix="film from a tripod, or choose a part with --start and --end",
        )  # fmt: skip
    nothing = [math.nan] * len(OBSERVED)
    readings = [
        nothing if window is None else [OBSERVABLES[name].of_film(window).value for name in OBSERVED]
        for window in seen.windows
    ]
    return Observed(
        name=film.name, source=subject.identity, first=first, readings=np.array(readings),
        log=log.cut(first, first + len(readings) * seen.seconds),
        sigma=np.array([OBSERVABLES[name].sigma for name in OBSERVED]), findings=findings,
    )  # fmt: skip
