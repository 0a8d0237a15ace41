"""The recordings of one flag as `flagdata calibrate` and `close-loop` take them: opened, read, or
left out."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np

from flagdata.answer.circumstances import Circumstances
from flagdata.core.files.addresses import local_path
from flagdata.core.findings import Finding
from flagdata.core.stated import Stated
from flagdata.core.workload import one_thread
from flagdata.errors import InputError, RefusedError, UsageError
from flagdata.ingest.films.named_films import FILMED
from flagdata.lake import Lake
from flagdata.lake.naming import COLUMNS, meant
from measure.cloth.blown_wind import Log
from measure.cloth.flag_simulation import OBSERVED
from measure.cloth.observed_recording import (
    LONGEST,
    Excerpt,
    Observed,
    check_duration,
    check_in_all,
    cut,
    first_part,
    usable,
)
from measure.cloth.table_clock import join_log
from measure.cloth.tables_of_observables import column_names, of_table
from measure.film.conditioned_film import ConditionedFilm
from measure.film.film_source import FilmReading, Subject, subjects
from measure.film.similarity import FlagSize
from measure.observables import OBSERVABLES
from measure.observables.observable import WINDOW
from measure.observables.watching import watch_film

S = TypeVar("S")
_TABLES = (".csv", ".parquet")
_LOST = 0.2
"""Share of the frames that could not be registered from which on a film is refused."""


def is_table(source: str) -> bool:
    """Returns whether a source is a file of a table of observables, not a recording."""
    path = Path(source)
    return path.suffix.lower() in _TABLES and path.is_file()


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """A part of a film with the log beside it, before any of its pictures is read.

    Attributes:
        film: whole.
        log: on its clock.
        source: identity of the film.
        first, end: of the part [s].
        findings: on its length.
        circumstances: of the whole film.
    """

    film: ConditionedFilm
    log: Log
    source: str
    first: float
    end: float
    findings: tuple[Finding, ...] = ()
    circumstances: Circumstances = field(default_factory=Circumstances)

    @classmethod
    def of(
        cls,
        film: ConditionedFilm,
        log: Log,
        *,
        source: str,
        first: float = 0.0,
        last: float | None = None,
        circumstances: Circumstances | None = None,
    ) -> Part:
        """Chooses the part from `first` to `last` [s], `LONGEST` at most.

        Raises:
            InputError: it is too short, or the log does not cover it.
        """
        end = min(film.duration, math.inf if last is None else last)
        findings: tuple[Finding, ...] = ()
        if end - first > LONGEST + WINDOW:
            findings, end = (first_part(end - first),), first + LONGEST
        check_duration(end - first, where=film.name)
        log.cut(first, end)
        return cls(
            film=film,
            log=log,
            source=source,
            first=first,
            end=end,
            findings=findings,
            circumstances=circumstances or Circumstances(),
        )

    @property
    def duration(self) -> float:
        """Returns the duration [s]."""
        return self.end - self.first

    def read(self, size: FlagSize, *, advance: Callable[[int], object] | None = None) -> Observed:
        """Reads what its windows show.

        Args:
            advance: called with the number of windows that were read.

        Raises:
            RefusedError: no flag is found, or the camera moves and cannot be steadied.
        """
        film, first = self.film, self.first
        film_windows = watch_film(film, size, first=first, last=self.end, advance=advance)
        findings = (*self.findings, *film.findings())
        if lost := [
            finding
            for finding in findings
            if finding.kind == "camera-lost" and (finding.value or 0.0) > _LOST
        ]:
            raise RefusedError(
                f"the camera may move, and cannot be followed: {lost[0].what}",
                where=film.name,
                fix="film from a tripod, or choose a part with --start and --end",
            )
        nothing = [math.nan] * len(OBSERVED)
        readings = [
            nothing
            if window is None
            else [OBSERVABLES[name].of_film(window).value for name in OBSERVED]
            for window in film_windows.windows
        ]
        return Observed(
            name=film.name,
            source=self.source,
            first=first,
            readings=np.array(readings),
            log=self.log.cut(first, first + len(readings) * film_windows.seconds),
            sigma=np.array([OBSERVABLES[name].sigma for name in OBSERVED]),
            findings=findings,
            excerpt=Excerpt.of(film_windows.windows),
            circumstances=self.circumstances.part(first, self.duration),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Opened:
    """A source before any of its pictures is read.

    Attributes:
        name: by which it was asked for.
        parent: the recording of a lake, or the log beside a table; None where it is neither.
        part: of a film; None of a table.
        rows: what a table shows: a recording a row of rows against wind, everything else is one;
            empty for a film.
    """

    name: str
    parent: str | None
    part: Part | None = None
    rows: tuple[Observed, ...] = ()

    @property
    def duration(self) -> float:
        """Returns the duration [s]."""
        return sum(row.duration for row in self.rows) if self.part is None else self.part.duration

    def read(
        self, size: FlagSize, *, advance: Callable[[int], object] | None = None
    ) -> tuple[Observed, ...]:
        """Reads its recordings; as `Part.read`."""
        return self.rows if self.part is None else (self.part.read(size, advance=advance),)


@dataclass(frozen=True, kw_only=True, eq=False)
class Gathered:
    """The recordings of one flag that can be used.

    Attributes:
        recordings: in order.
        parents: artifacts that they were read from.
        left_out: a warning for each source that cannot be used.
    """

    recordings: tuple[Observed, ...]
    parents: tuple[str, ...]
    left_out: tuple[Finding, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Sources:
    """Sources of one flag, opened, of which there is enough to weigh it.

    Attributes:
        opened: those that can be used as far as that shows without reading pictures.
        left_out: a warning for each of the others.
    """

    opened: tuple[Opened, ...]
    left_out: tuple[Finding, ...]

    @classmethod
    def of(
        cls, sources: Sequence[S], opening: Callable[[S], Opened], *, name: Callable[[S], str]
    ) -> Sources:
        """Open sources and add up how long they are; as `usable`.

        Raises:
            InputError: all of them together are too short.
            RefusedError: none of several can be used.
        """
        usable_sources, left_out = usable(sources, opening, name=name)
        check_in_all(usable_sources, left_out=left_out)
        return cls(opened=tuple(usable_sources), left_out=left_out)

    @one_thread()
    def read(self, size: FlagSize, *, advance: Callable[[int], object] | None = None) -> Gathered:
        """Read them, and leave out what cannot be used; as `Opened.read`."""

        def source_rows(source: Opened) -> tuple[Opened, tuple[Observed, ...]]:
            return source, source.read(size, advance=advance)

        readings, unread = usable(self.opened, source_rows, name=lambda several: several.name)
        recordings, left_out = (
            tuple(recording for _, several in readings for recording in several),
            (*self.left_out, *unread),
        )
        check_in_all(recordings, left_out=left_out)
        parents = dict.fromkeys(
            source.parent for source, _ in readings if source.parent is not None
        )
        return Gathered(recordings=recordings, parents=tuple(parents), left_out=left_out)


def open_recording(
    source: str,
    size: FlagSize,
    reading: FilmReading,
    *,
    lake: Lake | None,
    at: str,
    first: float,
    last: float | None,
    log: str | None = None,
    offset: Stated | None = None,
) -> Opened:
    """Opens a table or a recording of a lake from `first` to `last` [s], before pictures are read.

    Args:
        reading: how a film is read.
        log: a wind artifact of the lake, beside a table that has no wind of its own.
        offset: seconds added to the table's clock to reach the log's; None to estimate it.

    Raises:
        UsageError: a table, and a crop or a flag's number; a film, and a log or an offset; no lake
            that a log is in.
        InputError: a film without a log, or a log that does not cover it; too short a part.
        FlagdataError: nothing of that name.
    """
    if is_table(source):
        if reading.crop is not None or reading.flag is not None:
            raise UsageError(
                "a table of observables has no pictures that could be cropped or searched for a "
                "flag",
                where="--crop, --flag",
                fix="leave both out; flagdata observe takes them when it makes the table",
            )
        rows, parent = _of_table(
            Path(source), size, lake=lake, at=at, first=first, last=last, log=log, offset=offset
        )
        return Opened(name=source, parent=parent, rows=rows)
    if log is not None or offset is not None:
        raise UsageError(
            "a recording has its log and its clock",
            where="--log, --clock-offset",
            fix="give them with a table of observables",
        )
    (subject,) = subjects(source, query=None, lake=lake, at=at, reading=reading)
    part = part_of(subject, first=first, last=last, lake=lake)
    return Opened(
        name=source, parent=None if subject.artifact is None else subject.artifact.id, part=part
    )


def _of_table(
    path: Path,
    size: FlagSize,
    *,
    lake: Lake | None,
    at: str,
    first: float,
    last: float | None,
    log: str | None,
    offset: Stated | None,
) -> tuple[tuple[Observed, ...], str | None]:
    log_beside, parent = None, None
    if log is not None:
        if lake is None:
            raise UsageError(
                "the log is of no lake",
                where="--log",
                fix="name the lake that it was ingested into: --lake",
            )
        log_beside, parent = join_log(path, size, lake=lake, log=log, at=at, offset=offset)
    elif offset is not None:
        raise UsageError(
            "an offset needs a log",
            where="--clock-offset",
            fix="name the log: --log ARTIFACT --lake LAKE",
        )
    recordings = of_table(path, size, wind_log=log_beside)
    if recordings[0].place is None:
        return tuple(cut(recording, first, last) for recording in recordings), parent
    if first > 0 or last is not None:
        raise UsageError(
            "rows against wind have no times",
            where="--start, --end",
            fix="leave out the rows themselves",
        )
    return recordings, parent


def part_of(
    subject: Subject, *, first: float, last: float | None, lake: Lake | None = None
) -> Part:
    """Returns the part of a film whose recording holds a log, from `first` to `last` [s].

    Args:
        lake: that it is of; None where the film is of no lake.

    Raises:
        InputError: no log beside it, or one that does not cover the film; too short a part.
    """
    film, wind = subject.film, None if subject.record is None else subject.record.wind()
    if wind is None or film.start is None:
        raise InputError(
            "no log of the wind is beside the film",
            where=film.name,
            fix="align a film and a log (flagdata align), and name the recording that comes out",
        )
    clock = None if subject.artifact is None else subject.artifact.clock_sigma
    log = Log.of(wind, start=film.start, clock=clock or 0.0)
    stated = subject.circumstances(lake)
    return Part.of(film, log, source=subject.identity, first=first, last=last, circumstances=stated)


_DESCRIPTIONS = (".toml", ".json")


def films_among(
    sources: Sequence[str],
    *,
    lake: Lake | None,
    at: str,
    sized: bool = False,
    tracked: bool = False,
) -> tuple[str, ...]:
    """Returns those that are films or tables of observables, not markers and meshes.

    Args:
        sized: whether a flag's size is given, which films need: then what cannot be found was meant
            as one, if nothing else was.
        tracked: whether there are recordings of markers beside the sources.

    Raises:
        FlagdataError: a table that cannot be read.
    """
    answers = {source: is_film(source, lake=lake, at=at) for source in sources}
    if sized and not tracked and not any(answers.values()):
        answers = {source: is_film(source, lake=lake, at=at, otherwise=True) for source in sources}
    return tuple(source for source, filmed in answers.items() if filmed)


def is_film(source: str, *, lake: Lake | None, at: str, otherwise: bool = False) -> bool:
    """Returns whether a source is a film, a recording or clip of a lake, or a table of observables.

    Args:
        otherwise: the answer for what is neither a file nor an artifact.
    """
    path = local_path(source)
    if path.is_dir():
        return False
    if path.is_file():
        if not is_table(source):
            return path.suffix.lower() not in _DESCRIPTIONS
        columns = column_names(path)
        return "marker" not in columns and bool(columns & set(OBSERVABLES))
    if lake is None:
        return otherwise
    rows = lake.rows({}, at=at, columns=COLUMNS).to_pylist()
    kinds = {row["kind"] for row in meant(rows, source, kinds=FILMED)}
    return bool(kinds & set(FILMED)) if kinds else otherwise and not meant(rows, source)
