"""Abbreviations of time zones: those that mean one offset, and those that mean several."""

from __future__ import annotations

import re
from collections.abc import Sequence

ABBREVIATED = {
    "WEST": 1, "CET": 1, "CEST": 2, "MEZ": 1, "MESZ": 2, "EET": 2, "EEST": 3, "MSK": 3, "JST": 9, "KST": 9, "AEST": 10,
    "AEDT": 11, "AWST": 8, "NZST": 12, "NZDT": 13, "SAST": 2, "HKT": 8, "EST": -5, "EDT": -4, "CDT": -5, "MDT": -6,
    "PST": -8, "PDT": -7, "AKST": -9, "AKDT": -8, "HST": -10, "BRT": -3,
}  # fmt: skip
"""Hours east of UTC (tz database)."""
SEVERAL = {
    "MST": (("-07:00", "Mountain Standard Time of North America"), ("+08:00", "Malaysia")),
    "CST": (("-06:00", "Central Standard Time of North America"), ("+08:00", "China"), ("-05:00", "Cuba")),
    "AST": (("-04:00", "Atlantic Standard Time"), ("+03:00", "Arabia")),
    "IST": (("+05:30", "India"), ("+01:00", "Irish summer time"), ("+02:00", "Israel")),
    "BST": (("+01:00", "British summer time"), ("+06:00", "Bangladesh")),
    "GST": (("+04:00", "the Gulf"), ("-02:00", "South Georgia")),
}
"""What abbreviations may mean, as `--zone` takes it, the likeliest first."""
_IN_HEADING = re.compile(rf"(?:^|[^A-Za-z])({'|'.join(SEVERAL)})(?![A-Za-z])")
_CELL, _WORD = re.compile(r"[^,;\t|]+"), re.compile(r"\S+")
_HEADINGS = 5
"""Cells of a line from which on it names columns, of which an abbreviation alone may be one of another quantity."""
_SENTENCE = re.compile(r"(?<!\w)(?:in|is|are|was|were|the|all|of|to|as|at|by|from)(?!\w)", re.IGNORECASE)
_OF_TIME = re.compile(
    r"time|zone|date|stamp|clock|zeit|heure|fecha|(?<![a-z])(?:hours?|utc|gmt|local|uhr|datum|stunde|hora|ora|tid|tijd|"
    r"uur|czas|tz|hr|hh|hhmm|hrmn|mm|ss|min|sec)(?![a-z])",
    re.IGNORECASE,
)
_STAMP = re.compile(r"\d[-/.]\d{1,2}[-/.]\d|\d:\d\d")
_QUANTITIES = frozenset({"GST"})
"""Abbreviations that stand for a quantity as well: the gust."""


def advice(lines: Sequence[str]) -> str:
    """What an abbreviation of several meanings above the first stamp may say of the zone; "" where there is none."""
    for number, line in enumerate(lines, start=1):
        if _STAMP.search(line):
            return ""
        found = next((found for found in _IN_HEADING.finditer(line) if not _is_column(line, found)), None)
        if found is not None:
            means = ", ".join(f"--zone {name} if it is {place}" for name, place in SEVERAL[found[1]])
            return f"line {number} says {found[1]!r}, which has several meanings: {means}"
    return ""


def _is_column(line: str, found: re.Match[str]) -> bool:
    """Whether an abbreviation of a quantity, too, is the whole heading of a column and no time stands before it.

    GST is also the gust of tables of buoys, "... WDIR WSPD GST PRES"; in "Date Time GST Speed Direction" it is a zone.
    """
    if found[1] not in _QUANTITIES:
        return False
    cells = list(_CELL.finditer(line))
    if len(cells) < _HEADINGS:
        cells = list(_WORD.finditer(line)) if len(cells) == 1 and _SENTENCE.search(line) is None else []
    at = next((at for at, cell in enumerate(cells) if cell.end() > found.start(1)), 0)
    if len(cells) < _HEADINGS or cells[at][0].strip(" \r\n#\"'") != found[1]:
        return False
    return at == 0 or _OF_TIME.search(cells[at - 1][0]) is None
