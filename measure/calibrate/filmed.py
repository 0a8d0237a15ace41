"""A film of a flag and the log beside it, as a calibration takes them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from flagdata.errors import InputError, RefusedError, UsageError
from flagdata.findings import Finding
from flagdata.lake import Lake
from flagdata.stated import Stated
from measure.calibrate.beside import joined
from measure.calibrate.observed import LONGEST, Excerpt, Observed, check_duration, cut, first_part
from measure.calibrate.simulation import OBSERVED
from measure.calibrate.tables import of_table
from measure.calibrate.wind import Log
from measure.estimate.conditioned import ConditionedFilm
from measure.estimate.similarity import FlagSize
from measure.estimate.source import Reading, Subject, subjects
from measure.observables import OBSERVABLES
from measure.observables.observable import WINDOW
from measure.observables.watching import watched

_TABLES = (".csv", ".parquet")
_LOST = 0.2
"""Share of the frames that could not be registered from which on a film is refused."""


def is_table(source: str) -> bool:
    """Whether a source is a file of a table of observables, not a recording."""
    path = Path(source)
    return path.suffix.lower() in _TABLES and path.is_file()


def of_source(
    source: str, size: FlagSize, reading: Reading, *, lake: Lake | None, at: str, first: float, last: float | None,
    log: str | None = None, offset: Stated | None = None, advance: Callable[[int], object] | None = None,
) -> tuple[tuple[Observed, ...], str | None]:  # fmt: skip
    """What a table or a recording of a lake shows from `first` to `last` [s], and the id of the recording, or of
    the log beside a table.

    A table of rows against wind is a recording a row, everything else is one.

    Args:
        reading: how a film is read.
        log: a wind artifact of the lake, beside a table that has no wind of its own.
        offset: seconds added to the table's clock to reach the log's; None to estimate it.
        advance: called with the number of a film's windows that were read.

    Raises:
        UsageError: a table, and a crop or a flag's number; a film, and a log or an offset; no lake that a log is in.
        InputError: a film without a log, or a log that does not cover it.
        FlagdataError: nothing of that name; a film in which no flag is found.
    """
    if is_table(source):
        if reading.crop is not None or reading.flag is not None:
            raise UsageError(
                "a table of observables has no pictures", where="--crop, --flag", fix="give them to flagdata observe"
            )
        return _of_table(Path(source), size, lake=lake, at=at, first=first, last=last, log=log, offset=offset)
    if log is not None or offset is not None:
        raise UsageError(
            "a recording has its log and its clock",
            where="--log, --offset",
            fix="give them with a table of observables",
        )
    (subject,) = subjects(source, query=None, lake=lake, at=at, reading=reading)
    found = of_film(subject, size, first=first, last=last, advance=advance)
    return (found,), None if subject.artifact is None else subject.artifact.id


def of_sources(
    sources: Sequence[str], size: FlagSize, reading: Reading, *, lake: Lake | None, at: str, first: float,
    last: float | None, log: str | None, offset: Stated | None, advance: Callable[[int], object] | None = None,
) -> tuple[list[Observed], tuple[str, ...]]:  # fmt: skip
    """The recordings of several sources, and the artifacts that they were read from; as `of_source`."""
    read = [
        of_source(
            source, size, reading, lake=lake, at=at, first=first, last=last, log=log, offset=offset, advance=advance
        )
        for source in sources
    ]
    parents = tuple(dict.fromkeys(parent for _, parent in read if parent is not None))
    return [one for own, _ in read for one in own], parents


def _of_table(
    path: Path, size: FlagSize, *, lake: Lake | None, at: str, first: float, last: float | None, log: str | None,
    offset: Stated | None,
) -> tuple[tuple[Observed, ...], str | None]:  # fmt: skip
    beside, parent = None, None
    if log is not None:
        if lake is None:
            raise UsageError("a log of no lake", where="--log", fix="name the lake that it was ingested into: --lake")
        beside, parent = joined(path, size, lake=lake, log=log, at=at, offset=offset)
    elif offset is not None:
        raise UsageError("an offset without a log", where="--offset", fix="name the log: --log ARTIFACT --lake LAKE")
    found = of_table(path, size, beside=beside)
    if found[0].place is None:
        return tuple(cut(one, first, last) for one in found), parent
    if first > 0 or last is not None:
        raise UsageError("rows against wind have no times", where="--start, --end", fix="leave out the rows themselves")
    return found, parent


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
    clock = None if subject.artifact is None else subject.artifact.clock_sigma
    log = Log.of(wind, start=film.start, clock=clock or 0.0)
    return with_log(film, log, size, source=subject.identity, first=first, last=last, advance=advance)


def with_log(
    film: ConditionedFilm, log: Log, size: FlagSize, *, source: str, first: float = 0.0, last: float | None = None,
    advance: Callable[[int], object] | None = None,
) -> Observed:  # fmt: skip
    """The windows of a film beside a log on its clock; the other parameters as for `of_source`.

    Args:
        source: identity of the film.

    Raises:
        InputError: a log that does not cover it.
        RefusedError: no flag is found, or the camera moves and cannot be steadied.
    """
    end = min(film.duration, math.inf if last is None else last)
    findings: tuple[Finding, ...] = ()
    if end - first > LONGEST + WINDOW:
        findings, end = (first_part(end - first),), first + LONGEST
    check_duration(end - first, where=film.name)
    log.cut(first, end)  # refuses before the film is read
    seen = watched(film, size, first=first, last=end, advance=advance)
    findings += film.findings()
    if lost := [one for one in findings if one.kind == "camera-lost" and (one.value or 0.0) > _LOST]:
        raise RefusedError(
            f"the camera may move, and cannot be followed: {lost[0].what}", where=film.name,
            fix="film from a tripod, or choose a part with --start and --end",
        )  # fmt: skip
    nothing = [math.nan] * len(OBSERVED)
    readings = [
        nothing if window is None else [OBSERVABLES[name].of_film(window).value for name in OBSERVED]
        for window in seen.windows
    ]
    return Observed(
        name=film.name, source=source, first=first, readings=np.array(readings),
        log=log.cut(first, first + len(readings) * seen.seconds),
        sigma=np.array([OBSERVABLES[name].sigma for name in OBSERVED]), findings=findings,
        excerpt=Excerpt.of(seen.windows),
    )  # fmt: skip
