"""A film of a flag and the log beside it, as a calibration takes them.

A table of observables and a log of the wind beside it on one clock: by a given offset, or estimated.

Estimated as two logs of one wind are (`flagdata.align.logs`): the observable of the table that rises with the wind
takes the place of the second log, of unknown gain. It follows the wind by the flag's response.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from flagdata.align.declared import given
from flagdata.align.lag import LagSearch
from flagdata.align.logs import clock_between
from flagdata.arrays import FloatArray
from flagdata.clock import ClockModel
from flagdata.errors import InputError, RefusedError, UsageError
from flagdata.findings import Finding
from flagdata.lake import Lake
from flagdata.record import Record
from flagdata.rng import stream
from flagdata.schema import Kind
from flagdata.signals import Sensor, WindSeries
from flagdata.stated import Stated
from measure.calibrate.columns import Columns
from measure.calibrate.leaving_out import usable
from measure.calibrate.observed import LONGEST, Excerpt, Observed, check_duration, check_in_all, cut, first_part
from measure.calibrate.simulation import OBSERVED
from measure.calibrate.tables import Beside, instants, of_table, rows_of
from measure.calibrate.wind import Log
from measure.film.conditioned import ConditionedFilm
from measure.film.similarity import FlagSize
from measure.film.source import Reading, Subject, subjects
from measure.observables import OBSERVABLES
from measure.observables.observable import WINDOW
from measure.observables.watching import watched

_FOLLOWS = (
    "outline-speed",
    "middle-speed",
    "extension",
    "amplitude-across",
    "amplitude-up",
    "droop",
    "frequency",
)
"""Observables that follow the wind, those that do so most closely first; the droop falls with it."""


def joined(
    path: Path,
    size: FlagSize,
    *,
    lake: Lake,
    log: str,
    at: str,
    offset: Stated | None = None,
    progress: Callable[[int], object] | None = None,
) -> tuple[Beside, str]:
    """The log of a lake beside a table, and its artifact's id.

    Args:
        log: a wind artifact by its id, a unique prefix or its name.
        at: branch, tag or version of the lake.
        offset: seconds added to the table's clock to reach the log's; None to estimate it.
        progress: called with 1 for each part compared.

    Raises:
        UsageError: an artifact that is no wind, or an offset without an uncertainty.
        InputError: a table without times or observables, a log without samples.
        RefusedError: no offset can be estimated.
    """
    table = rows_of(path, size)
    artifact = lake.artifact(log, at=at, kinds=(Kind.WIND,))
    if artifact.kind is not Kind.WIND or artifact.object is None:
        raise UsageError(
            f"{artifact.name!r} is a {artifact.kind}, not a wind",
            where="--log",
            fix="name a wind artifact: flagdata ls",
        )
    series = Record.open(lake.object_path(str(artifact.object))).wind()
    if series is None:
        raise InputError("the wind artifact holds no samples", where=artifact.id, fix="ingest the log anew")
    names = (artifact.name or artifact.id[:12], path.stem)
    if offset is not None:
        clock = declared(table, offset, names=names)
    else:
        clock = estimated(table, series, names=names, seed=artifact.id, progress=progress)
    return Beside(series=series, clock=clock), artifact.id


def declared(table: Columns, offset: Stated, *, names: tuple[str, str]) -> ClockModel:
    """The table's clock on the log's, by an offset that is given.

    Args:
        names: of the log and the table.

    Raises:
        UsageError: an offset without a standard uncertainty.
    """
    if offset.low < offset.high or not offset.sigma > 0:
        raise UsageError(
            f"an offset of {offset.text} s", where="--clock-offset", fix="state how well it is known, as in 0.3±0.1"
        )
    times = instants(table)
    return given(names[1], names[0], start=int(times[0]), end=int(times[-1]) + 1, offset=offset.low, sigma=offset.sigma)


def estimated(
    table: Columns,
    series: WindSeries,
    *,
    names: tuple[str, str],
    seed: str,
    search: LagSearch | None = None,
    progress: Callable[[int], object] | None = None,
) -> ClockModel:
    """The table's clock on the log's, by what follows the wind in it.

    Args:
        names: of the log and the table.
        seed: names the stream of the surrogate winds.
        search: how far, and the flag's response.

    Raises:
        InputError: no observable that follows the wind.
        RefusedError: no offset can be estimated, with the reason.
    """
    search = search or LagSearch()
    values = follows(table)
    there = np.isfinite(values)
    motion = WindSeries(
        time=instants(table)[there],
        channels={"wind_speed": values[there]},
        flags=np.zeros(int(there.sum()), dtype=np.uint16),
        # A row's time is the middle of its span: nothing precedes it.
        sensor=Sensor(name=names[1], averaging=0.0, distance_constant=0.0),
    )
    try:
        model, _, _ = clock_between(
            series,
            motion,
            names=names,
            search=search,
            generator=stream(0, "calibrate", "beside", seed),
            progress=progress,
        )
    except RefusedError as error:
        raise RefusedError(
            error.what,
            where=error.where,
            fix="check that the table and the log are of one wind, or state what is added to the table's clock to "
            "reach the log's: --clock-offset 0.3±0.1",
        ) from error
    segments = tuple(
        replace(
            one, offset=one.offset + search.response, sigma_offset=math.hypot(one.sigma_offset, search.response_sigma)
        )
        for one in model.segments
    )
    return replace(model, segments=segments)


def follows(table: Columns) -> FloatArray:
    """(n,) of the column that follows the wind most closely, from 0 up.

    Raises:
        InputError: none does.
    """
    for name in _FOLLOWS:
        if name in table and np.isfinite(table[name]).any():
            own = math.pi / 2 - table[name] if name == "droop" else table[name]
            return np.asarray(own - min(0.0, float(np.nanmin(own))), dtype=np.float64)
    raise InputError(
        f"no observable that follows the wind: {', '.join(_FOLLOWS)}",
        where=table.where,
        fix="state the offset of the clocks: --clock-offset 0.3±0.1",
    )


S = TypeVar("S")
_TABLES = (".csv", ".parquet")
_LOST = 0.2
"""Share of the frames that could not be registered from which on a film is refused."""


def is_table(source: str) -> bool:
    """Whether a source is a file of a table of observables, not a recording."""
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
    """

    film: ConditionedFilm
    log: Log
    source: str
    first: float
    end: float
    findings: tuple[Finding, ...] = ()

    @classmethod
    def of(cls, film: ConditionedFilm, log: Log, *, source: str, first: float = 0.0, last: float | None = None) -> Part:
        """From `first` to `last` [s], `LONGEST` at most.

        Raises:
            InputError: it is too short, or the log does not cover it.
        """
        end = min(film.duration, math.inf if last is None else last)
        findings: tuple[Finding, ...] = ()
        if end - first > LONGEST + WINDOW:
            findings, end = (first_part(end - first),), first + LONGEST
        check_duration(end - first, where=film.name)
        log.cut(first, end)
        return cls(film=film, log=log, source=source, first=first, end=end, findings=findings)

    @property
    def duration(self) -> float:
        """[s]."""
        return self.end - self.first

    def read(self, size: FlagSize, *, advance: Callable[[int], object] | None = None) -> Observed:
        """What its windows show.

        Args:
            advance: called with the number of windows that were read.

        Raises:
            RefusedError: no flag is found, or the camera moves and cannot be steadied.
        """
        film, first = self.film, self.first
        seen = watched(film, size, first=first, last=self.end, advance=advance)
        findings = (*self.findings, *film.findings())
        if lost := [one for one in findings if one.kind == "camera-lost" and (one.value or 0.0) > _LOST]:
            raise RefusedError(
                f"the camera may move, and cannot be followed: {lost[0].what}",
                where=film.name,
                fix="film from a tripod, or choose a part with --start and --end",
            )
        nothing = [math.nan] * len(OBSERVED)
        readings = [
            nothing if window is None else [OBSERVABLES[name].of_film(window).value for name in OBSERVED]
            for window in seen.windows
        ]
        return Observed(
            name=film.name,
            source=self.source,
            first=first,
            readings=np.array(readings),
            log=self.log.cut(first, first + len(readings) * seen.seconds),
            sigma=np.array([OBSERVABLES[name].sigma for name in OBSERVED]),
            findings=findings,
            excerpt=Excerpt.of(seen.windows),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Opened:
    """A source before any of its pictures is read.

    Attributes:
        name: by which it was asked for.
        parent: the recording of a lake, or the log beside a table; None where it is neither.
        part: of a film; None of a table.
        rows: what a table shows: a recording a row of rows against wind, everything else is one; empty for a film.
    """

    name: str
    parent: str | None
    part: Part | None = None
    rows: tuple[Observed, ...] = ()

    @property
    def duration(self) -> float:
        """[s]."""
        return sum(one.duration for one in self.rows) if self.part is None else self.part.duration

    def read(self, size: FlagSize, *, advance: Callable[[int], object] | None = None) -> tuple[Observed, ...]:
        """Its recordings; as `Part.read`."""
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
    def of(cls, sources: Sequence[S], opening: Callable[[S], Opened], *, name: Callable[[S], str]) -> Sources:
        """Open sources and add up how long they are; as `usable`.

        Raises:
            InputError: all of them together are too short.
            RefusedError: none of several can be used.
        """
        found, left_out = usable(sources, opening, name=name)
        check_in_all(sum(own.duration for own in found), where=", ".join(own.name for own in found), left_out=left_out)
        return cls(opened=tuple(found), left_out=left_out)

    def read(self, size: FlagSize, *, advance: Callable[[int], object] | None = None) -> Gathered:
        """Read them, and leave out what cannot be used; as `Opened.read`."""

        def one(source: Opened) -> tuple[Opened, tuple[Observed, ...]]:
            return source, source.read(size, advance=advance)

        found, unread = usable(self.opened, one, name=lambda own: own.name)
        recordings, left_out = tuple(each for _, own in found for each in own), (*self.left_out, *unread)
        check_in_all(
            sum(one.duration for one in recordings), where=", ".join(one.name for one in recordings), left_out=left_out
        )
        parents = dict.fromkeys(source.parent for source, _ in found if source.parent is not None)
        return Gathered(recordings=recordings, parents=tuple(parents), left_out=left_out)


def opened(
    source: str,
    size: FlagSize,
    reading: Reading,
    *,
    lake: Lake | None,
    at: str,
    first: float,
    last: float | None,
    log: str | None = None,
    offset: Stated | None = None,
) -> Opened:
    """A table or a recording of a lake from `first` to `last` [s], before pictures are read.

    Args:
        reading: how a film is read.
        log: a wind artifact of the lake, beside a table that has no wind of its own.
        offset: seconds added to the table's clock to reach the log's; None to estimate it.

    Raises:
        UsageError: a table, and a crop or a flag's number; a film, and a log or an offset; no lake that a log is in.
        InputError: a film without a log, or a log that does not cover it; too short a part.
        FlagdataError: nothing of that name.
    """
    if is_table(source):
        if reading.crop is not None or reading.flag is not None:
            raise UsageError(
                "a table of observables has no pictures", where="--crop, --flag", fix="give them to flagdata observe"
            )
        rows, parent = _of_table(Path(source), size, lake=lake, at=at, first=first, last=last, log=log, offset=offset)
        return Opened(name=source, parent=parent, rows=rows)
    if log is not None or offset is not None:
        raise UsageError(
            "a recording has its log and its clock",
            where="--log, --clock-offset",
            fix="give them with a table of observables",
        )
    (subject,) = subjects(source, query=None, lake=lake, at=at, reading=reading)
    part = part_of(subject, first=first, last=last)
    return Opened(name=source, parent=None if subject.artifact is None else subject.artifact.id, part=part)


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
    beside, parent = None, None
    if log is not None:
        if lake is None:
            raise UsageError("a log of no lake", where="--log", fix="name the lake that it was ingested into: --lake")
        beside, parent = joined(path, size, lake=lake, log=log, at=at, offset=offset)
    elif offset is not None:
        raise UsageError(
            "an offset without a log", where="--clock-offset", fix="name the log: --log ARTIFACT --lake LAKE"
        )
    found = of_table(path, size, beside=beside)
    if found[0].place is None:
        return tuple(cut(one, first, last) for one in found), parent
    if first > 0 or last is not None:
        raise UsageError("rows against wind have no times", where="--start, --end", fix="leave out the rows themselves")
    return found, parent


def part_of(subject: Subject, *, first: float, last: float | None) -> Part:
    """The part of a film whose recording holds a log, from `first` to `last` [s].

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
    return Part.of(film, log, source=subject.identity, first=first, last=last)
