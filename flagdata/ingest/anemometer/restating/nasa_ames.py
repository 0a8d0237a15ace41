"""Files of one independent variable in NASA Ames format: file format index 1001, EBAS and ICARTT files included.

    19 1001                                   number of header lines, file format index
    Ruiz, Ana                                 four lines: originator, organisation, source, mission
    …
    1 1                                       volumes
    2019 01 01 2020 03 05                     first day of the data, day of this revision
    0.041667                                  interval of the independent variable, 0 if uneven
    days from the file reference point        the independent variable
    2                                         number of dependent variables
    1 1                                       by what to multiply each
    99.99 999.9                               what stands for a missing value of each
    wind_speed, m/s                           a line for each name, then comments, each kind with their number
    wind_direction, deg
    …
    0.000000 3.21 184.0                       rows

Source: Gaines and Hipskind, "Format Specification for Data Exchange", NASA Ames, version 1.3, 1998; NILU, EBAS data
format (time in days from the first line's date); Aknan et al., "ICARTT File Format Standards" V2.0, NASA ESDS-RFC-029
(fields are separated by commas, and times are in UTC).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.restating.restate import table
from flagdata.ingest.anemometer.text.layout import cut
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_SIGNATURE = re.compile(r"\ufeff?\s*(?P<count>\d{1,4})\s*(?P<sign>,?)\s*1001\b.*")
_UNITS = {"second": 1.0, "sec": 1.0, "s": 1.0, "minute": 60.0, "min": 60.0, "hour": 3600.0, "hr": 3600.0, "h": 3600.0,
          "day": 86400.0}  # fmt: skip
_UNIT = re.compile(r"\b(?P<unit>second|sec|s|minute|min|hour|hr|h|day)s?\b", re.IGNORECASE)
_UTC = re.compile(r"(?<![A-Za-z])(?:UTC?|GMT|Z)(?![A-Za-z])")
_ZONE_LINE = re.compile(r"\s*time\s*zone\s*:\s*(?:UTC?|GMT|Z)\s*", re.IGNORECASE)
_STATISTICS = re.compile(r"Statistics\s*=\s*(?P<which>[^,]+)", re.IGNORECASE)
_FLAGS = re.compile(r"num\s*flag\s+(?P<of>.+)", re.IGNORECASE)
_FLAG = "quality flag"
_ABOVE = 12
"""Lines above the names where the scales and missing values take a line each."""


@dataclass(frozen=True)
class _Header:
    """What stands above the rows.

    Attributes:
        count: lines, comments included.
        behind: number of the line behind the names.
        sign: delimiter of the rows.
        day: from whose midnight the independent variable counts.
        unit: of it [s].
        zone: as stamps write it; "" where the header has none.
        scales, missing: of each dependent variable.
        names: its headings.
    """

    count: int
    behind: int
    sign: str
    day: datetime
    unit: float
    zone: str
    scales: Sequence[float]
    missing: Sequence[float]
    names: Sequence[str]

    @property
    def flags(self) -> list[int]:
        """Dependent variables that are flags of quality."""
        return [place for place, name in enumerate(self.names) if name.startswith(_FLAG)]


def matches(lines: Sequence[str]) -> bool:
    """The first line holds a number of lines and the index of the format."""
    return bool(lines) and _SIGNATURE.fullmatch(lines[0].rstrip()) is not None


def as_table(source: TextFile) -> TableText | None:
    """Instants and every variable under its name; `None` where the header is not as the format has it, or its
    independent variable is no time since midnight of the first day."""
    match = _SIGNATURE.fullmatch(source.head(1)[0].rstrip())
    header = None if match is None else _header(source.head(int(match["count"])), int(match["count"]), match["sign"])
    if header is None:
        return None
    rows: list[list[str]] = []
    flagged = other = 0
    for first, lines in source.blocks():
        for number, line in enumerate(lines, start=first):
            if number < header.behind:
                continue
            cells = cut(line, header.sign)
            made = _row(header, cells)
            if made is not None:
                rows.append(made)
                flagged += any(float(cells[1 + place]) for place in header.flags)
            elif number > header.count and line.strip():
                other += 1
    what = "the ICARTT format" if header.sign == "," else "NASA Ames format 1001"
    stated = table(source, ["time", *header.names], rows, kind="nasa-ames", what=what, left_out=other)
    if stated is None or not flagged:
        return stated
    text = f"{flagged} rows have a numflag other than 0, which may say that they are invalid: all are read"
    found = Finding(kind="flags-not-heeded", severity=Severity.WARNING, count=flagged, what=text)
    return replace(stated, findings=(*stated.findings, found))


def _row(header: _Header, cells: Sequence[str]) -> list[str] | None:
    """Stamp and values; `None` where there are not as many as in the header, or one is no number."""
    if len(cells) != 1 + len(header.names):
        return None
    try:
        return [_instant(header, cells[0]), *map(_value, cells[1:], header.scales, header.missing)]
    except (ValueError, OverflowError):
        return None


def _header(lines: Sequence[str], count: int, comma: str) -> _Header | None:
    sign = "," if comma else " "
    try:
        year, month, day = (int(part) for part in re.split(r"[\s,]+", lines[6].strip())[:3])
        number = int(lines[9])
        scales, at = _numbers(lines, 10, number)
        missing, at = _numbers(lines, at, number)
        start = datetime(year, month, day, tzinfo=UTC)
    except (ValueError, IndexError):
        return None
    names, unit = [line.strip() for line in lines[at : at + number]], _UNIT.search(lines[8])
    if unit is None or len(names) != number or len(lines) < count or count < _ABOVE + number:
        return None
    told = comma or _UTC.search(lines[8]) or any(_ZONE_LINE.fullmatch(line) for line in lines[at + number :])
    return _Header(
        count=count, behind=at + number + 1, sign=sign, day=start, unit=_UNITS[unit["unit"].lower()],
        zone="Z" if told else "", scales=scales, missing=missing, names=[_heading(name) for name in names],
    )  # fmt: skip


def _numbers(lines: Sequence[str], at: int, number: int) -> tuple[list[float], int]:
    """As many numbers from a line on, over several lines where one does not hold them, and the line behind them."""
    found: list[float] = []
    while len(found) < number:
        found += [float(part) for part in re.split(r"[\s,]+", lines[at].strip())]
        at += 1
    if len(found) != number:
        raise ValueError(f"{len(found)} numbers in place of {number}")
    return found, at


def _heading(name: str) -> str:
    """The name and unit of EBAS or ICARTT, `wind_speed, m/s, Location=…`, as a heading; others as they stand."""
    parts = [part.strip() for part in name.split(",")]
    flag = _FLAGS.fullmatch(parts[0])
    if flag is not None:
        return f"{_FLAG} {flag['of']}"
    if len(parts) < 2 or not parts[1] or "=" in parts[1]:
        return name
    statistic = _STATISTICS.search(name)
    which = "" if statistic is None or statistic["which"].strip() == "arithmetic mean" else statistic["which"].strip()
    unit = "" if parts[1].lower() in {"no unit", "unitless", "none", "1"} else f" [{parts[1]}]"
    return f"{parts[0]} {which}".strip() + unit


def _instant(header: _Header, cell: str) -> str:
    """A stamp; whole seconds where the cell's last digit is no finer (a day's sixth decimal is 0.09 s)."""
    seconds = float(cell) * header.unit
    digits = len(cell.partition(".")[2])
    if abs(seconds - round(seconds)) <= header.unit * 10.0**-digits:
        seconds = round(seconds)
    return (header.day + timedelta(seconds=seconds)).replace(tzinfo=None).isoformat() + header.zone


def _value(cell: str, scale: float, missing: float) -> str:
    number = float(cell)
    if number == missing:
        return ""
    return cell if scale == 1.0 else f"{number * scale:.10g}"
