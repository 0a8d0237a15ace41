"""The columns of a table of observables, in SI and in the observables' units, whatever unit its heading states."""

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

from flagdata.arrays import FloatArray
from flagdata.errors import InputError, TimeError
from flagdata.files import check_input
from flagdata.ingest.headings import small_table, small_table_head
from flagdata.parquet import read_parquet
from flagdata.plain_text import plain_text
from flagdata.timebase import NANOSECONDS, parse
from flagdata.units import spelled, unit
from measure.film.similarity import FlagSize
from measure.observables import OBSERVABLES

TIME, WIND, DURATION, COUNT = "time", "wind", "duration", "count"
SIGMA, _REASON = "-sigma", "-reason"
_Value = TypeVar("_Value", int, float)
_LIMIT = 1 << 26  # B
_UNITS = {TIME: "s", WIND: "m/s", DURATION: "s", COUNT: "1"}
_HEADING = re.compile(r"(?P<name>[^\[\](),/]+?)\s*(?:[\[(](?P<bracketed>[^\])]*)[\])]|[,/]\s*(?P<after>\S.*))?\s*")


@dataclass(frozen=True, kw_only=True)
class Columns:
    """A table.

    Attributes:
        where: the file.
        values: name → (n,) in its unit: `time`, `wind`, `duration`, `count`, observables and NAME-sigma; NaN where a
            cell is blank. Times are seconds since `origin`.
        origin: instant of the first row's time where that is a UTC stamp or seconds since 1970 [UTC ns].
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
        """(n,) of a column, NaN throughout where the table has none."""
        return self.values.get(name, np.full(len(self.lines), math.nan))


def read(path: Path, size: FlagSize) -> Columns:
    """A table, Parquet or text with a heading, its columns separated by commas, semicolons or tabs.

    A heading is a name, perhaps with a unit behind it: `droop`, `droop [deg]`, `droop (°)`. The unit is the
    observable's own where none is stated. What is counted in lengths or heights of the flag may be stated in a length.

    Args:
        size: of the flag.

    Raises:
        InputError: no such table, a column that is not known, a unit of something else, or a cell that is no number.
        FlagdataError: a file that cannot be read.
    """
    check_input(path, limit=_LIMIT)
    where = str(path)
    headings, rows = _cells(path)
    wanted = [(place, *_parsed(text)) for place, text in enumerate(headings) if not _named(text).endswith(_REASON)]
    names = [name for _, name, _ in wanted]
    known_columns(names, where=where)
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(f"columns {', '.join(twice)} stand twice", where=where, fix="keep one of each")
    lines = tuple(number for number, _ in rows)
    values: dict[str, FloatArray] = {}
    origin = 0
    for place, name, stated in wanted:
        scale = _scale(name, stated, size, where=where)
        cells = [row[place].strip() if place < len(row) else "" for _, row in rows]
        if name == TIME:
            instants = _converted(cells, lines, name, where, partial(_instant, scale=scale))
            if None in instants or not instants:
                raise InputError("rows without a time", where=where, fix="leave them out, or fill their times in")
            origin = instants[0] or 0
            values[name] = np.array([((one or 0) - origin) / NANOSECONDS for one in instants])
        else:
            numbers = _converted(cells, lines, name, where, float)
            values[name] = np.array([math.nan if one is None else one * scale for one in numbers])
    return Columns(where=where, values=values, origin=origin, lines=lines)


def known_columns(names: Sequence[str], *, where: str) -> None:
    """Raises:
    InputError: a name that no column of a table of observables has.
    """
    known = [*_UNITS, *OBSERVABLES, *(f"{name}{SIGMA}" for name in OBSERVABLES)]
    if unknown := [name for name in names if name not in known]:
        raise InputError(
            f"columns {', '.join(unknown)} are not known",
            where=where,
            fix=f"keep, and name, these: {', '.join(known)}; a unit stands behind a name, as in droop [deg]",
        )


def names(path: Path) -> set[str]:
    """Names of a table's columns, without its rows being read; none where it has no heading that can be read."""
    if path.suffix.lower() == ".parquet":
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            return {_named(one) for one in pq.read_schema(path).names}
        except pa.ArrowException:
            return set()
    try:
        return {_named(cell) for cell in small_table_head(path).names}
    except InputError:
        return set()


def _named(heading: str) -> str:
    """The name in a heading, as the table of observables spells names."""
    match = _HEADING.fullmatch(heading.strip())
    return re.sub(r"[\s_]+", "-", (match["name"] if match else heading).strip().lower())


def _parsed(heading: str) -> tuple[str, str | None]:
    """Name and unit of a heading."""
    match = _HEADING.fullmatch(heading.strip())
    stated = None if match is None else match["bracketed"] or match["after"]
    return _named(heading), stated.strip() if stated else None


def _scale(name: str, stated: str | None, size: FlagSize, *, where: str) -> float:
    """What a column's numbers are multiplied by.

    Raises:
        InputError: a unit of something else than the column is of.
        UnknownNameError: no unit.
    """
    about = None if name in _UNITS else OBSERVABLES[name.removesuffix(SIGMA)]
    own = _UNITS[name] if about is None else about.unit
    if stated is None or stated == own:
        return 1.0
    found = unit(stated, where=f"{where}, column {name}")
    if found.si == own:
        return found.scale
    if about is not None and found.si == about.measured_in:
        return found.scale / (size.length if about.counted_in == "length" else size.height)
    also = "" if about is None or about.measured_in is None else f" or {about.measured_in}"
    raise InputError(
        f"the unit {spelled(stated) or stated} of {name}, which is in {own}", where=where, fix=f"give {own}{also}"
    )


def _cells(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Headings of a table, and the line and cells of its rows; of Parquet, with the units that its fields state.

    Raises:
        InputError: no table of that format.
    """
    if path.suffix.lower() == ".parquet":
        import pyarrow as pa

        try:
            table = read_parquet(path)
        except pa.ArrowException as error:
            raise InputError(f"no Parquet table: {error}", where=str(path), fix="name a table") from None
        headings = []
        for field in table.schema:
            stated = (field.metadata or {}).get(b"unit", b"").decode()
            headings.append(f"{field.name} [{stated}]" if stated and _parsed(field.name)[1] is None else field.name)
        columns = [["" if cell is None else str(cell) for cell in column.to_pylist()] for column in table.columns]
        rows = enumerate(map(list, zip(*columns, strict=True)), start=2)
        return headings, [(line, row) for line, row in rows if any(cell.strip() for cell in row)]
    table = small_table(plain_text(path.read_bytes(), noun="table", where=str(path)), where=str(path))
    return list(table.names), [(line, [table.number(cell) for cell in row]) for line, row in table.rows]


def _converted(
    cells: Sequence[str], lines: Sequence[int], name: str, where: str, convert: Callable[[str], _Value]
) -> list[_Value | None]:
    """Each cell, `None` where it is blank.

    Raises:
        InputError: a cell that is no number.
    """
    found: list[_Value | None] = []
    for line, cell in zip(lines, cells, strict=True):
        try:
            found.append(convert(cell) if cell else None)
        except ValueError:
            raise InputError(
                f"{cell!r} is no number", where=f"{where}, line {line}, column {name}", fix="correct the cell"
            ) from None
    return found


def _instant(cell: str, *, scale: float) -> int:
    """The instant of a UTC stamp, or so many times `scale` seconds [ns].

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
