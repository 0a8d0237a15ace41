"""Tables of observables, as trackers and papers give them: rows against time, or rows against wind,
in any unit.

Rows against time, `time` and `wind` or a log beside it, are of one recording. A row is of the span
about its time that reaches halfway to its neighbours, and no farther than half of the usual
spacing; a window is the mean of the spans in it, by their lengths, and of root mean squares and
deviations the quadratic mean. So rows may come faster or more slowly than windows, with gaps or
without.

Rows against wind, `wind` and `duration` or `count` (of windows), are each of a steady wind of its
own: a recording a row, all from one place and with one anemometer.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from flagdata.answer.circumstances import Circumstances
from flagdata.core.arrays import FloatArray
from flagdata.core.clock_model import ClockModel
from flagdata.core.files.bounded_parquet import read_parquet
from flagdata.core.files.plain_text import plain_text
from flagdata.core.files.regular_files import check_input
from flagdata.core.findings import Finding
from flagdata.core.provenance import file_hash
from flagdata.core.units import name_of_unit, unit
from flagdata.errors import InputError, TimeError
from flagdata.ingest.named_columns import small_table, small_table_head
from flagdata.record.signals import Instants, WindSeries
from flagdata.timebase import NANOSECONDS, parse
from measure.cloth.blown_wind import Log
from measure.cloth.flag_simulation import OBSERVED
from measure.cloth.observed_recording import LEAST_WINDOWS, LONGEST, Observed
from measure.film.similarity import FlagSize
from measure.observables import OBSERVABLES
from measure.observables.observable import WINDOW

TIME, WIND, DURATION, COUNT = "time", "wind", "duration", "count"
SIGMA, _REASON = "-sigma", "-reason"
_Value = TypeVar("_Value", int, float)
_LIMIT = 1 << 26  # B
_UNITS = {TIME: "s", WIND: "m/s", DURATION: "s", COUNT: "1"}
_HEADING = re.compile(
    r"(?P<name>[^\[\](),/]+?)\s*(?:[\[(](?P<bracketed>[^\])]*)[\])]|[,/]\s*(?P<after>\S.*))?\s*"
)


@dataclass(frozen=True, kw_only=True)
class Columns:
    """A table.

    Attributes:
        where: the file.
        values: name → (n,) in its unit: `time`, `wind`, `duration`, `count`, observables and
            NAME-sigma; NaN where a cell is blank. Times are seconds since `origin`.
        origin: instant of the first row's time where that is a UTC stamp or seconds since 1970 [UTC
            ns].
        lines: (n,) where in the file each row stands.
    """

    where: str
    values: Mapping[str, FloatArray]
    origin: int = 0
    lines: tuple[int, ...] = ()

    def __contains__(self, name: str) -> bool:
        return name in self.values

    def __getitem__(self, name: str) -> FloatArray:
        return self.values[name]

    def of(self, name: str) -> FloatArray:
        """Returns (n,) of a column, NaN throughout where the table has none."""
        return self.values.get(name, np.full(len(self.lines), math.nan))


def read_table(path: Path, size: FlagSize) -> Columns:
    """Reads a table, Parquet or text with a heading, its columns separated by commas, semicolons or
    tabs.

    A heading is a name, perhaps with a unit behind it: `droop`, `droop [deg]`, `droop (°)`. The
    unit is the observable's own where none is stated. What is counted in lengths or heights of the
    flag may be stated in a length.

    Args:
        size: of the flag.

    Raises:
        InputError: no such table, a column that is not known, a unit of something else, or a cell
            that is no number.
        FlagdataError: a file that cannot be read.
    """
    check_input(path, limit=_LIMIT)
    where = str(path)
    headings, rows = _cells(path)
    wanted = [
        (column, *_parse_heading(text))
        for column, text in enumerate(headings)
        if not _name_of_heading(text).endswith(_REASON)
    ]
    names = [name for _, name, _ in wanted]
    known_columns(names, where=where)
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(
            f"columns {', '.join(twice)} stand twice", where=where, fix="keep one of each"
        )
    lines = tuple(number for number, _ in rows)
    values: dict[str, FloatArray] = {}
    origin = 0
    for column, name, unit_text in wanted:
        scale = _scale(name, unit_text, size, where=where)
        cells = [row[column].strip() if column < len(row) else "" for _, row in rows]
        if name == TIME:
            instants = _convert_cells(cells, lines, name, where, partial(_instant, scale=scale))
            if None in instants or not instants:
                raise InputError(
                    "rows without a time", where=where, fix="leave them out, or fill their times in"
                )
            origin = instants[0] or 0
            values[name] = np.array(
                [((instant or 0) - origin) / NANOSECONDS for instant in instants]
            )
        else:
            numbers = _convert_cells(cells, lines, name, where, float)
            values[name] = np.array(
                [math.nan if cell_value is None else cell_value * scale for cell_value in numbers]
            )
    return Columns(where=where, values=values, origin=origin, lines=lines)


def known_columns(names: Sequence[str], *, where: str) -> None:
    """Raises:
    InputError: a name that no column of a table of observables has.
    """
    allowed = [*_UNITS, *OBSERVABLES, *(f"{name}{SIGMA}" for name in OBSERVABLES)]
    if unknown := [name for name in names if name not in allowed]:
        raise InputError(
            f"columns {', '.join(unknown)} are not known",
            where=where,
            fix=f"keep, and name, these: {', '.join(allowed)}; a unit stands behind a name, as in "
            "droop [deg]",
        )


def column_names(path: Path) -> set[str]:
    """Names of a table's columns, without its rows being read; none where it has no heading that
    can be read."""
    if path.suffix.lower() == ".parquet":
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            return {_name_of_heading(name) for name in pq.read_schema(path).names}
        except pa.ArrowException:
            return set()
    try:
        return {_name_of_heading(cell) for cell in small_table_head(path).names}
    except InputError:
        return set()


def _name_of_heading(heading: str) -> str:
    """Returns the name in a heading, as the table of observables spells names."""
    match = _HEADING.fullmatch(heading.strip())
    return re.sub(r"[\s_]+", "-", (match["name"] if match else heading).strip().lower())


def _parse_heading(heading: str) -> tuple[str, str | None]:
    """Name and unit of a heading."""
    match = _HEADING.fullmatch(heading.strip())
    unit_text = None if match is None else match["bracketed"] or match["after"]
    return _name_of_heading(heading), unit_text.strip() if unit_text else None


def _scale(name: str, stated_unit: str | None, size: FlagSize, *, where: str) -> float:
    """Returns what a column's numbers are multiplied by.

    Raises:
        InputError: a unit of something else than the column is of.
        UnknownNameError: no unit.
    """
    about = None if name in _UNITS else OBSERVABLES[name.removesuffix(SIGMA)]
    own_unit = _UNITS[name] if about is None else about.unit
    if stated_unit is None or stated_unit == own_unit:
        return 1.0
    parsed = unit(stated_unit, where=f"{where}, column {name}")
    if parsed.si == own_unit:
        return parsed.scale
    if about is not None and parsed.si == about.measured_in:
        return parsed.scale / (size.length if about.counted_in == "length" else size.height)
    also = "" if about is None or about.measured_in is None else f" or {about.measured_in}"
    raise InputError(
        f"the unit {name_of_unit(stated_unit) or stated_unit} of {name}, which is in {own_unit}",
        where=where,
        fix=f"give {own_unit}{also}",
    )


def _cells(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Headings of a table, and the line and cells of its rows; of Parquet, with the units that its
    fields state.

    Raises:
        InputError: no table of that format.
    """
    if path.suffix.lower() == ".parquet":
        import pyarrow as pa

        try:
            table = read_parquet(path)
        except pa.ArrowException as error:
            raise InputError(
                f"this is no Parquet table: {error}", where=str(path), fix="name a table"
            ) from None
        headings = []
        for field in table.schema:
            unit_text = (field.metadata or {}).get(b"unit", b"").decode()
            headings.append(
                f"{field.name} [{unit_text}]"
                if unit_text and _parse_heading(field.name)[1] is None
                else field.name
            )
        columns = [
            ["" if cell is None else str(cell) for cell in column.to_pylist()]
            for column in table.columns
        ]
        rows = enumerate(map(list, zip(*columns, strict=True)), start=2)
        return headings, [(line, row) for line, row in rows if any(cell.strip() for cell in row)]
    table = small_table(
        plain_text(path.read_bytes(), noun="table", where=str(path)), where=str(path)
    )
    return list(table.names), [
        (line, [table.number(cell) for cell in row]) for line, row in table.rows
    ]


def _convert_cells(
    cells: Sequence[str],
    lines: Sequence[int],
    name: str,
    where: str,
    convert: Callable[[str], _Value],
) -> list[_Value | None]:
    """Converts each cell, `None` where it is blank.

    Raises:
        InputError: a cell that is no number.
    """
    converted: list[_Value | None] = []
    for line, cell in zip(lines, cells, strict=True):
        try:
            converted.append(convert(cell) if cell else None)
        except ValueError:
            raise InputError(
                f"{cell!r} is no number",
                where=f"{where}, line {line}, column {name}",
                fix="correct the cell",
            ) from None
    return converted


def _instant(cell: str, *, scale: float) -> int:
    """Returns the instant of a UTC stamp, or so many times `scale` seconds [ns].

    Raises:
        ValueError: neither.
    """
    try:
        return round(float(cell) * scale * NANOSECONDS)
    except ValueError:
        try:
            return parse(cell, default=UTC)
        except TimeError as error:
            raise ValueError from error


_FEWEST_ROWS = 4
_COVERED = 0.5
"""Share of a window that rows are to cover for it to have a value."""
_SHORT = 1.0
"""s of a row below which a spectrum or a deviation of its own span means nothing."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Beside:
    """A log of the wind that was kept beside a table.

    Attributes:
        series: its samples, on its own clock.
        clock: of the table, on the log's.
    """

    series: WindSeries
    clock: ClockModel


def of_table(path: Path, size: FlagSize, *, wind_log: Beside | None = None) -> tuple[Observed, ...]:
    """Returns the recordings of a table: one of rows against time, one a row of rows against wind.

    Args:
        size: of the flag.
        wind_log: the log, where the table has no wind.

    Raises:
        InputError: no such table, or one whose columns do not say what its rows are of.
        FlagdataError: a file that cannot be read.
    """
    return of_columns(
        read_table(path, size), name=path.stem, identity=file_hash(path), wind_log=wind_log
    )


def of_columns(
    table: Columns, *, name: str, identity: str, wind_log: Beside | None
) -> tuple[Observed, ...]:
    """Returns the recordings of a table whose columns were read; as `of_table`.

    Args:
        name: of the table.
        identity: hash of its content.

    Raises:
        InputError: as `of_table`.
    """
    if not any(column in table for column in OBSERVED):
        raise InputError(
            "no column is an observable",
            where=table.where,
            fix=f"name one of {', '.join(OBSERVED)}",
        )
    if (WIND in table) == (wind_log is not None):
        problem = (
            "no column wind"
            if wind_log is None
            else "a column wind, and a log of the wind beside it"
        )
        raise InputError(
            problem,
            where=table.where,
            fix="give the wind in the table or as a log (--log), in one of them",
        )
    if TIME not in table:
        if wind_log is not None:
            raise InputError(
                "the table has no column time to join the log by",
                where=table.where,
                fix="add the rows' times",
            )
        return _against_wind(table, name=name, identity=identity)
    if extra := [column for column in (DURATION, COUNT) if column in table]:
        raise InputError(
            f"the table has columns {TIME} and {', '.join(extra)}",
            where=table.where,
            fix="keep one of them",
        )
    return (_against_time(table, name=name, identity=identity, wind_log=wind_log),)


def rows_of(path: Path, size: FlagSize) -> Columns:
    """Reads a table of rows against time, for what joins it to a log.

    Raises:
        InputError: as `of_table`; no times, or times that do not ascend.
    """
    table = read_table(path, size)
    if TIME not in table:
        raise InputError(
            "the table has no column time", where=table.where, fix="add the rows' times"
        )
    spacing(table)
    return table


def spacing(table: Columns) -> float:
    """Returns the usual time between rows [s].

    Raises:
        InputError: fewer than four rows, or times that do not ascend.
    """
    times = table[TIME]
    if len(times) < _FEWEST_ROWS:
        raise InputError(
            f"{len(times)} rows", where=table.where, fix=f"give {_FEWEST_ROWS} or more"
        )
    steps = np.diff(times)
    if not (steps > 0).all():
        line = table.lines[int(np.flatnonzero(steps <= 0)[0]) + 1]
        raise InputError(
            "a time that is not after the one before it",
            where=f"{table.where}, line {line}",
            fix="sort the rows",
        )
    return float(np.median(steps))


def instants(table: Columns) -> Instants:
    """Returns (n,) of its rows on its own clock [UTC ns]."""
    return table.origin + np.round(table[TIME] * NANOSECONDS).astype(np.int64)


def _against_time(table: Columns, *, name: str, identity: str, wind_log: Beside | None) -> Observed:
    step = spacing(table)
    times = table[TIME]
    begin = float(times[0]) - step / 2
    middles = (times[1:] + times[:-1]) / 2
    low = np.maximum(times - step / 2, np.concatenate([[begin], middles]))
    high = np.minimum(times + step / 2, np.concatenate([middles, [times[-1] + step / 2]]))
    edges: FloatArray = begin + WINDOW * np.arange(
        int((float(high[-1]) - begin) / WINDOW + 1e-6) + 1, dtype=np.float64
    )
    if wind_log is None:
        finite = np.isfinite(table[WIND])
        if finite.sum() < _FEWEST_ROWS:
            raise InputError(
                "the table has no wind",
                where=table.where,
                fix="fill the column in, or give a log beside the table",
            )
        log = Log(times=times[finite] - begin, speed=table[WIND][finite], averaging=step)
        stated = Circumstances()
    else:
        start = instants(table)[:1] - round(step / 2 * NANOSECONDS)
        common, sigma = (
            int(wind_log.clock.to_common(start)[0]),
            float(wind_log.clock.sigma(start)[0]),
        )
        log = Log.of(wind_log.series, start=common, clock=sigma)
        seconds, sensor = WINDOW * (len(edges) - 1), wind_log.series.sensor.words
        stated = Circumstances(start=common, seconds=seconds, sensor=sensor, clock=sigma)
        identity = (
            f"{identity}, its clock {(common - int(start[0])) / NANOSECONDS:+.3f} ± {sigma:.3f} s"
        )
    readings = np.stack(
        [
            _windows(
                edges, low, high, table.of(observable), quadratic=OBSERVABLES[observable].quadratic
            )
            for observable in OBSERVED
        ],
        axis=1,
    )
    return Observed(
        name=name,
        source=identity,
        readings=readings,
        log=log,
        findings=_of_rows(table, step),
        circumstances=stated,
        sigma=np.array([_mean(table.of(f"{observable}{SIGMA}")) for observable in OBSERVED]),
    )


def _windows(
    edges: FloatArray, low: FloatArray, high: FloatArray, values: FloatArray, *, quadratic: bool
) -> FloatArray:
    """Averages to (window,) means of values (n,) that hold from `low` to `high`; NaN where they
    cover too little."""
    finite = np.isfinite(values)
    if not finite.any():
        return np.full(len(edges) - 1, np.nan)
    low, high, heights = (
        low[finite],
        high[finite],
        np.square(values[finite]) if quadratic else values[finite],
    )
    places = np.stack([low, high], axis=1).ravel()

    def between(height: FloatArray) -> FloatArray:
        """Integrates a step function over each window."""
        total = np.concatenate([[0.0], np.cumsum(height * (high - low))])
        return np.diff(np.interp(edges, places, np.repeat(total, 2)[1:-1]))

    covered, totals = between(np.ones_like(heights)), between(heights)
    mean = np.where(covered >= _COVERED * WINDOW, totals / np.maximum(covered, 1e-9), np.nan)
    return np.sqrt(np.maximum(mean, 0.0)) if quadratic else mean


def _against_wind(table: Columns, *, name: str, identity: str) -> tuple[Observed, ...]:
    lengths = [column for column in (DURATION, COUNT) if column in table]
    if len(lengths) != 1:
        raise InputError(
            f"rows against wind with {'both columns' if lengths else 'no column'} {DURATION} and "
            f"{COUNT}",
            where=table.where,
            fix=f"give how long each was observed: {DURATION} [s], or {COUNT}, of windows of "
            f"{WINDOW:g} s; rows "
            f"against time have a column {TIME}",
        )
    windows = table[lengths[0]] / (WINDOW if lengths[0] == DURATION else 1.0)
    for line, wind, window in zip(table.lines, table[WIND].tolist(), windows.tolist(), strict=True):
        if not (wind > 0 and window >= LEAST_WINDOWS - 1e-6):
            raise InputError(
                f"a row lasts {window * WINDOW:g} s in a wind of {wind:g} m/s",
                where=f"{table.where}, line {line}",
                fix=f"leave out rows in still air or of less than {LEAST_WINDOWS * WINDOW:g} s",
            )
    most = max(LEAST_WINDOWS, round(LONGEST / WINDOW) // len(windows))
    recordings = []
    for row, (line, wind) in enumerate(zip(table.lines, table[WIND].tolist(), strict=True)):
        count = min(int(windows[row] + 1e-6), most)
        steady: FloatArray = WINDOW * np.arange(count + 1, dtype=np.float64)
        recordings.append(
            Observed(
                name=f"{name}, {wind:g} m/s (line {line})",
                source=f"{identity}, line {line}",
                place=identity,
                readings=np.tile([table.of(column)[row] for column in OBSERVED], (count, 1)),
                log=Log(
                    times=steady, speed=np.full(len(steady), wind), distance=0.0, averaging=WINDOW
                ),
                sigma=np.array(
                    [_mean(table.of(f"{column}{SIGMA}")[row : row + 1]) for column in OBSERVED]
                ),
            )
        )
    return tuple(recordings)


def _mean(values: FloatArray) -> float:
    """Averages what is stated; 0 where nothing is."""
    return float(np.nanmean(values)) if np.isfinite(values).any() else 0.0


def _of_rows(table: Columns, step: float) -> tuple[Finding, ...]:
    """Reports rows that come faster than a spectrum takes."""
    fast = [
        name
        for name in OBSERVED
        if name in table and (OBSERVABLES[name].quadratic or name == "frequency")
    ]
    if step >= _SHORT or not fast:
        return ()
    text = (
        f"its rows come every {step:.2g} s: their {', '.join(fast)} are taken as of spans of "
        f"{WINDOW:g} s, over which "
        "the tracker has to have formed them"
    )
    fix = "check the length of the tracker's own window; give rows of 2.5 s where it is shorter"
    return (Finding.of("short-rows", text, fix=fix),)
