"""Measurement files of LabVIEW (.lvm), whose rows count seconds from the date and time above them.

    LabVIEW Measurement
    Separator   Tab
    Decimal_Separator   .
    X_Columns   One
    ***End_of_Header***
    Channels    1
    Date    2026/05/01
    Time    12:00:00.5
    Y_Unit_Label    m/s
    X0  0.0
    Delta_X 0.1
    ***End_of_Header***
    X_Value Wind speed  Comment
    0.0     5.1

Source: National Instruments, "Specification for the LabVIEW Measurement File (.lvm)", 1.0: the first header is of the
file, each further one of the segment of data below it. X_Columns is One where the first column holds x, No where x is
X0 + i Delta_X; each channel with an x of its own (Multi) is not read. No zone is stated.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation

from flagdata.ingest.anemometer.restating.restate import table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_END = "***End_of_Header***"
_CLOCK = re.compile(r"(\d{1,2}):(\d{2}):(\d{2})(?:[.,](\d+))?")
_MICROSECONDS = 1_000_000
_LONGEST = 3_200_000_000
"""Seconds, a hundred years, beyond which a row's x is none."""


def matches(lines: Sequence[str]) -> bool:
    """The first line is the format's signature, and x stands in one column at most."""
    if not lines or not lines[0].lstrip("\ufeff").startswith("LabVIEW Measurement"):
        return False
    return _stated(lines, "X_Columns") != "Multi"


def as_table(source: TextFile) -> TableText | None:
    """The instant of each row and the channels with their units; `None` where segments differ or have no date."""
    reader = _Segments(delimiter="," if _stated(source.head(), "Separator") == "Comma" else "\t")
    rows = [row for _, lines in source.blocks() for line in lines for row in reader.rows_of(line)]
    if reader.failed or not reader.names:
        return None
    names = ["time", *reader.names]
    return table(source, names, rows, kind="lvm", what="LabVIEW's measurement format", left_out=reader.left_out)


def _stated(lines: Sequence[str], key: str) -> str:
    """What stands behind a key of the header."""
    for line in lines:
        cells = re.split(r"[\t,]", line.lstrip("\ufeff"))
        if cells[0].strip() == key and len(cells) > 1:
            return cells[1].strip()
    return ""


@dataclass
class _Segments:
    """Reads the lines of a file in order.

    Attributes:
        names: headings of the channels with their units, of the first segment.
        left_out: lines that are neither header nor row.
        failed: whether the segments do not go together.
    """

    delimiter: str
    names: list[str] = field(default_factory=list)
    left_out: int = 0
    failed: bool = False
    _file: dict[str, list[str]] = field(default_factory=dict)
    _own: dict[str, list[str]] = field(default_factory=dict)
    _headers: int = 0
    _within: bool = True
    _heading: bool = False
    _row: int = 0

    def rows_of(self, line: str) -> Iterator[list[str]]:
        """The row of a line; none of a line of a header."""
        cells = [cell.strip() for cell in line.split(self.delimiter)]
        if not any(cells) or self.failed:
            return
        if cells[0] == _END:
            self._headers += 1
            self._within, self._heading, self._row = self._headers == 1, self._headers > 1, 0
            self._own = {} if self._headers == 1 else self._own
        elif self._headers == 0:
            self._file[cells[0]] = cells[1:]
        elif self._heading:
            self._name(cells)
        elif self._within:
            self._own[cells[0]] = cells[1:]
        elif re.match(r"[A-Z]", cells[0]):  # the header of the next segment
            self._within, self._own = True, {cells[0]: cells[1:]}
        elif (stamp := self._stamp(cells[0])) is not None:
            yield [stamp, *(self._number(cell) for cell in cells[1 : 1 + len(self.names)])]
            self._row += 1
        else:
            self.left_out += 1

    def _name(self, cells: list[str]) -> None:
        """The line of headings: x, the channels and a comment."""
        units = self._own.get("Y_Unit_Label", [])
        named = [
            f"{name} [{units[at]}]" if at < len(units) and units[at] else name
            for at, name in enumerate(cells[1:]) if name and name != "Comment"
        ]  # fmt: skip
        self.failed = bool(self.names) and named != self.names
        self.names, self._heading = named, False

    def _number(self, cell: str) -> str:
        return cell.replace(",", ".") if self._file.get("Decimal_Separator", ["."])[0] == "," else cell

    def _stamp(self, x: str) -> str | None:
        """The instant of a row in ISO 8601 without a zone; `None` where it cannot be told."""
        said = {**self._file, **self._own}
        try:
            if said.get("X_Columns", ["One"])[0] == "No":
                first, step = (Decimal(self._number(said[key][0])) for key in ("X0", "Delta_X"))
                after = first + step * self._row
            else:
                after = Decimal(self._number(x))
            day = dt.datetime.fromisoformat(said["Date"][0].replace("/", "-"))
            clock = _CLOCK.match(said["Time"][0])
        except (InvalidOperation, KeyError, IndexError, ValueError):
            return None
        if clock is None or not after.is_finite() or abs(after) > _LONGEST:
            return None
        hour, minute, second = (int(part) for part in clock.groups()[:3])
        micro = int(f"{clock[4] or '':0<6}"[:6]) + round(after * _MICROSECONDS)
        return (day + dt.timedelta(hours=hour, minutes=minute, seconds=second, microseconds=micro)).isoformat()
