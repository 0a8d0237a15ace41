"""How a table is cut: its delimiter, the line that names its columns, and its first rows.

DuckDB's sniffer finds the delimiter in the last lines of the head, which are rows; runs of blanks
and decimal commas, which it does not know, are found here.
"""

from __future__ import annotations

import re
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flagdata.core.units import name_of_unit
from flagdata.ingest.anemometer.sensor_recipe import MISSING, MISSING_SIGNS
from flagdata.ingest.anemometer.text.cut_lines import cells_of_lines

DELIMITERS = (";", "\t", ",", "|")
_TAIL = 200
"""Lines at the end of the head that the delimiter is found in."""
_AGREE = 0.9
"""Share of the lines that must agree."""
_NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")
_COMMA = re.compile(r"[-+]?\d*,\d+")
_SIGNS = re.compile(MISSING_SIGNS)


@dataclass(frozen=True, kw_only=True)
class TableShape:
    """A table as its first lines show it.

    Attributes:
        delimiter: between cells; " " stands for any run of blanks.
        decimal: "." or ",".
        preamble: lines before the one that names the columns, or before the first row where none
            does.
        header: lines from the one that names the columns to the last one before the rows; 0 where
            none does.
        names: of the columns, as many as a row has cells; "" where there is none.
        units: below the names, as many, "" where there is none.
        rows: the first rows, each of as many cells, trimmed.
        lines: of `rows`, counted from 1.
    """

    delimiter: str
    decimal: str
    preamble: int
    header: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]

    def column(self, index: int) -> list[str]:
        """Returns the cells of a column."""
        return [row[index] for row in self.rows]

    def label(self, index: int) -> str:
        """Returns what the user calls a column: its heading, with its number where others have the
        same or it has none."""
        name, number = self.names[index], f"column {index + 1}"
        return number if not name else name if self.names.count(name) == 1 else f"{name} ({number})"

    def shown(self, index: int) -> str:
        """Returns what messages call a column."""
        name = self.names[index]
        if not name:
            return f"number {index + 1}"
        return repr(name) if self.names.count(name) == 1 else f"{name!r} (number {index + 1})"

    def reference(self, index: int) -> str | int:
        """Returns what a recipe calls a column: its heading where that is its own, else its
        number."""
        name = self.names[index]
        return name if self.header and name and self.names.count(name) == 1 else index + 1


def is_number(cell: str) -> bool:
    return _NUMBER.fullmatch(cell) is not None


def is_missing(cell: str) -> bool:
    """Checks whether a cell spells "no value" as every recipe knows it."""
    return cell.lower() in MISSING or _SIGNS.fullmatch(cell) is not None


def shape_of(lines: Sequence[str]) -> TableShape | None:
    """Finds the table that the first lines of a file hold; `None` where they hold none of two
    columns."""
    filled = [
        (number, line) for number, line in enumerate(lines, start=1) if line.strip(" \t\x00\x1a")
    ]
    tail = [line for _, line in filled[len(filled) // 2 :]][-_TAIL:]
    delimiter = _delimiter(tail)
    if delimiter is None:
        return None
    cut = [
        [cell.strip() for cell in row]
        for row in cells_of_lines([line for _, line in filled], delimiter)
    ]
    width = Counter(map(len, cut[len(cut) // 2 :])).most_common(1)[0][0]
    numeric = _numeric(cut[len(cut) // 2 :], width)
    is_row = [len(row) == width and _is_row(row, numeric) for row in cut]
    if width < 2 or not numeric or not any(is_row):
        return None
    first = is_row.index(True)
    rows = [tuple(row) for row, is_data in zip(cut[first:], is_row[first:], strict=True) if is_data]
    numbers = [
        number
        for (number, _), is_data in zip(filled[first:], is_row[first:], strict=True)
        if is_data
    ]
    names, units, preamble = _heading([line for line, _ in filled[:first]], cut[:first], width)
    header = numbers[0] - 1 - preamble if names else 0
    return TableShape(
        delimiter=delimiter,
        decimal=_decimal(rows, numeric, delimiter),
        header=header,
        preamble=preamble if names else numbers[0] - 1,
        names=tuple(names or [""] * width),
        units=tuple(units or [""] * width),
        rows=tuple(rows),
        lines=tuple(numbers),
    )


def _delimiter(lines: Sequence[str]) -> str | None:
    for sign in (";", "\t"):
        counts = Counter(line.count(sign) for line in lines)
        count, often = counts.most_common(1)[0] if counts else (0, 0)
        if count and often >= _AGREE * len(lines):
            return sign
    delimiter = _sniff_delimiter(lines)
    if delimiter is not None:
        return delimiter
    count, often = (
        Counter(len(line.split()) for line in lines).most_common(1)[0] if lines else (0, 0)
    )
    return " " if count > 1 and often >= _AGREE * len(lines) else None


def _sniff_delimiter(lines: Sequence[str]) -> str | None:
    """Asks DuckDB for the delimiter, and takes it where it cuts most lines into equally many
    cells."""
    import duckdb  # costs a tenth of a second, and readers of records need none

    with tempfile.NamedTemporaryFile("w", suffix=".csv", encoding="utf-8") as file:
        file.write("\n".join([*lines, ""]))
        file.flush()
        try:
            query = (
                "select Delimiter from sniff_csv(?, header = false, all_varchar = true, "
                "null_padding = true)"
            )
            row = duckdb.execute(query, [str(Path(file.name))]).fetchone()
        except duckdb.Error:
            return None
    sign = str(row[0]) if row else ""
    counts = (
        Counter(map(len, cells_of_lines(list(lines), sign)))
        if sign in DELIMITERS
        else Counter[int]()
    )
    count, often = counts.most_common(1)[0] if counts else (0, 0)
    return sign if count > 1 and often >= _AGREE * len(lines) else None


def _numeric(rows: Sequence[Sequence[str]], width: int) -> frozenset[int]:
    """Columns that hold numbers in most rows."""
    full = [row for row in rows if len(row) == width]
    columns = (
        index
        for index in range(width)
        if sum(is_number(row[index]) or is_missing(row[index]) for row in full)
        >= _AGREE * len(full)
        and any(is_number(row[index]) for row in full)
    )
    return frozenset(columns)


def _is_row(row: Sequence[str], numeric: frozenset[int]) -> bool:
    fits = sum(is_number(row[index]) or is_missing(row[index]) for index in numeric)
    return fits > len(numeric) / 2 and any(is_number(cell) for cell in row)


def _heading(
    numbers: Sequence[int], above: Sequence[Sequence[str]], width: int
) -> tuple[list[str], list[str], int]:
    """Names and units of the columns, and how many lines stand before the names; no names where
    there are none."""
    for at in range(len(above) - 1, -1, -1):
        row = above[at]
        units = _is_units(row) and len(row) in (width, width - 1)
        if not units and (
            len(row) not in (width, width - 1) or sum(bool(cell) for cell in row) < 2
        ):
            continue
        full = [*row, *[""] * (width - len(row))]
        if units and at and len(above[at - 1]) in (width, width - 1):
            names = above[at - 1]
            return [*names, *[""] * (width - len(names))], full, numbers[at - 1] - 1
        return full, [], numbers[at] - 1
    return [], [], 0


def _is_units(row: Sequence[str]) -> bool:
    filled = [cell.strip("[]() ") for cell in row if cell]
    return sum(name_of_unit(cell) is not None for cell in filled) >= max(1, len(filled) / 3)


def _decimal(rows: Sequence[Sequence[str]], numeric: frozenset[int], delimiter: str) -> str:
    cells = [row[index] for row in rows for index in numeric]
    commas = sum(_COMMA.fullmatch(cell) is not None for cell in cells)
    return (
        ","
        if delimiter != "," and commas and not any("." in cell for cell in cells if is_number(cell))
        else "."
    )
