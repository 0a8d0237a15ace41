"""Tables with a row a day and a column an hour, turned into a row an hour.

date, 00, 01 … 23        or 1 … 24, H01 … H24, 00:00 … 23:00, 1h … 24h, as networks of air quality publish them
fecha, H01, V01, H02 …   with a column beside each hour that says whether its value is valid: V, or N

The other columns are kept and repeated; the hour's number and its value become the columns "hour" and "value". What the
values are, no heading says: the user names them (--wind value --unit m/s).
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_HOUR = re.compile(
    r"(?:h|hr|hour|hora|heure|ora|stunde|uur)?[ _]?(\d{1,2})(?::00(?::00)?|\s?h|\s?hrs?)?", re.IGNORECASE
)
_VALID = re.compile(r"v[ _]?(\d{1,2})", re.IGNORECASE)
_DELIMITERS = (";", ",", "\t", "|")
_HOURS = 24
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
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*(heading.names[at] for at in heading.kept), "hour", "value"])
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
                writer.writerow([*(cells[k] for k in heading.kept), hour, cells[at] if good else ""])
    if not days:
        return None
    what = f"{days} rows of 24 hours side by side, read as a row an hour; nothing says what their values are"
    notes = [Finding(kind="hours-across", severity=Severity.NOTE, what=what, count=days)]
    if invalid:
        what = f"{invalid} values that the file says are not valid; left out"
        notes.append(Finding(kind="invalid-by-file", severity=Severity.WARNING, count=invalid, what=what))
    if short:
        what = f"{short} lines have another number of columns than the heading; left out"
        notes.append(Finding(kind="malformed-lines", severity=Severity.ERROR, count=short, what=what))
    return TableText.of(source, out.getvalue().splitlines(), notes)


def _heading(lines: Sequence[str]) -> _Heading | None:
    """The heading with a column for each hour; `None` where no line is one."""
    for number, line in enumerate(lines):
        for delimiter in _DELIMITERS:
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
