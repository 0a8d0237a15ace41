"""Tables with a row a day and a column an hour, turned into a row an hour.

date, 00, 01 … 23        or 1 … 24, H01 … H24, 00:00 … 23:00, 1h … 24h, as networks of air quality publish them
fecha, H01, V01, H02 …   with a column beside each hour that says whether its value is valid: V, or N

The other columns are kept and repeated; the hour's number and its value become the columns "hour" and "value". What the
values are, no heading says: the user names them (--wind value --unit m/s). Where a column says it, as WIND_SPEED and
CH4 do in the rows of a day (Taiwan's network of air quality), each becomes a column.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.text.signs import SIGNS
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.words.headings import understand

_HOUR = re.compile(
    r"(?:h|hr|hour|hora|heure|ora|stunde|uur)?[ _]?(\d{1,2})(?::00(?::00)?|\s?h|\s?hrs?)?", re.IGNORECASE
)
_VALID = re.compile(r"v[ _]?(\d{1,2})", re.IGNORECASE)
_HOURS = 24
_MOST = 100
"""Quantities of one station."""
_HEAD = 30
"""Lines among which the heading stands."""


@dataclass(frozen=True, kw_only=True)
class _Heading:
    """The line of the heading.

    Attributes:
        line: its index from 0.
        delimiter: between cells.
        hours: the number of each hour → its column.
        valid: likewise, of what says whether it is valid; empty where nothing does.
        kept: the other columns.
        names: of all columns.
    """

    line: int
    delimiter: str
    hours: dict[int, int]
    valid: dict[int, int]
    kept: tuple[int, ...]
    names: tuple[str, ...]


def matches(lines: Sequence[str]) -> bool:
    """Whether one of the first lines names a column for each hour of a day."""
    return _heading(lines[:_HEAD]) is not None


def as_table(source: TextFile) -> TableText | None:
    """A row an hour; `None` where the heading has no rows below it."""
    heading = _heading(source.head(_HEAD))
    if heading is None:
        return None
    rows: list[list[str]] = []
    days = short = invalid = 0
    for number, lines in source.blocks():
        for line in lines[max(0, heading.line + 2 - number) :]:
            cells = _cells(line, heading.delimiter)
            if len(cells) != len(heading.names):
                short += bool(line.strip())
                continue
            days += 1
            for hour, at in heading.hours.items():
                good = hour not in heading.valid or cells[heading.valid[hour]].upper() in ("V", "")
                invalid += not good
                rows.append([*(cells[k] for k in heading.kept), str(hour), cells[at] if good else ""])
    if not days:
        return None
    what = f"{days} rows of 24 hours side by side, read as a row an hour"
    names = [*(heading.names[at] for at in heading.kept), "hour", "value"]
    item = _of_items(rows, len(heading.kept))
    if item is not None:
        said = names[item]
        names, rows = _by_item(names, rows, item)
        what += f", with a column for each of the {len(names) - len(heading.kept)} quantities in column {said!r}"
    else:
        what += "; nothing says what their values are"
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([names, *rows])
    notes = [Finding(kind="hours-across", severity=Severity.NOTE, what=what, count=days)]
    if invalid:
        what = f"{invalid} values that the file says are not valid; left out"
        notes.append(Finding(kind="invalid-by-file", severity=Severity.WARNING, count=invalid, what=what))
    if short:
        what = f"{short} lines have another number of columns than the heading; left out"
        notes.append(Finding(kind="malformed-lines", severity=Severity.ERROR, count=short, what=what))
    return TableText.of(source, out.getvalue().splitlines(), notes)


def _of_items(rows: Sequence[Sequence[str]], kept: int) -> int | None:
    """The column whose cells say what the values are, among them a wind, each once a day; `None` where none does."""
    for at in range(kept):
        items = {row[at] for row in rows}
        if not 1 < len(items) <= _MOST or not any(map(_is_wind, items)):
            continue
        others = {tuple(cell for place, cell in enumerate(row[:-1]) if place != at) for row in rows}
        if len(others) < len(rows) == len({tuple(row[:-1]) for row in rows}):
            return at
    return None


def _is_wind(item: str) -> bool:
    heading = understand(item)
    return heading.sure and "wind" in heading.quantity


def _by_item(names: Sequence[str], rows: Sequence[Sequence[str]], item: int) -> tuple[list[str], list[list[str]]]:
    """The heading and the rows with a column for each item in place of that of the items and of the values."""
    items = list(dict.fromkeys(row[item] for row in rows))
    found: dict[tuple[str, ...], dict[str, str]] = {}
    for row in rows:
        key = tuple(cell for at, cell in enumerate(row[:-1]) if at != item)
        found.setdefault(key, {})[row[item]] = row[-1]
    heading = [name for at, name in enumerate(names[:-1]) if at != item] + items
    return heading, [[*key, *(values.get(name, "") for name in items)] for key, values in found.items()]


def _heading(lines: Sequence[str]) -> _Heading | None:
    """The heading with a column for each hour; `None` where no line is one."""
    for number, line in enumerate(lines):
        for delimiter in SIGNS:
            names = _cells(line, delimiter)
            hours = {int(match[1]): at for at, name in enumerate(names) if (match := _HOUR.fullmatch(name))}
            if sorted(hours) not in (list(range(_HOURS)), list(range(1, _HOURS + 1))):
                continue
            valid = {int(match[1]): at for at, name in enumerate(names) if (match := _VALID.fullmatch(name))}
            valid = valid if valid.keys() == hours.keys() else {}
            kept = tuple(at for at in range(len(names)) if at not in {*hours.values(), *valid.values()})
            if kept and all(names[at] for at in kept):
                return _Heading(
                    line=number, delimiter=delimiter, hours=dict(sorted(hours.items())), valid=valid, kept=kept,
                    names=tuple(names),
                )  # fmt: skip
    return None


def _cells(line: str, delimiter: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
