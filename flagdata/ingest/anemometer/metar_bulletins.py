"""METAR and SPECI reports in bulletins, as they come over the WMO's network: the month is nowhere in them.

    SAXX31 KABC 021200
    METAR KAAA 021153Z 24005KT 10SM FEW040 21/12 A3001 RMK
         AO2=
    METAR
    KBBB 021150Z VRB03KT CAVOK 20/11 Q1015=

Source: WMO, Manual on the Global Telecommunication System (WMO-No. 386): the abbreviated heading TTAAii CCCC YYGGgg of
a bulletin, SA for METAR and SP for SPECI, YY the day of the month; Manual on Codes (WMO-No. 306), FM 15: "=" ends a
report, and a report may go on in the next line. The user gives the date of the first report. Each further one is of the
nearest day that has its number; the reports are put in order, since bulletins come late and are repeated.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Iterator, Sequence

from flagdata.errors import TimeError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer import metar
from flagdata.ingest.anemometer.source import TableText, TextFile

_HEADING = re.compile(r"(?P<kind>[A-Z]{2})[A-Z]{2}\d{1,2}\s+[A-Z]{4}\s+\d{6}(?:\s+[A-Z]{3})?")
_REPORTS = frozenset({"SA", "SP"})
_LIKE = re.compile(r"(?:(?:METAR|SPECI)\s+)?(?:COR\s+)?[A-Z][A-Z0-9]{2,3}\s+\S")
_DATE = re.compile(r"(?<!\d)(?P<year>20\d\d|19\d\d)[-_.]?(?P<month>\d\d)[-_.]?(?P<day>\d\d)(?!\d{3})")
_HALF = 15
"""Days before and after a report within which the next one lies."""


def matches(lines: Sequence[str]) -> bool:
    """Whether the first lines hold the heading of a bulletin of reports, and one of its reports."""
    return any(metar.REPORT.search(text) for text in _texts(lines))


def dated(source: TextFile, date: dt.date | None) -> TextFile:
    """The wind of each report as a table with a row a report, in the order of time.

    Args:
        date: day of the first report [UTC]; the bulletins have its number alone.

    Raises:
        TimeError: nobody gave the day, or it has another number than the first report's.
    """
    where = str(source.path)
    texts = list(_texts(line for _, lines in source.blocks() for line in lines))
    found = [match for text in texts if (match := metar.REPORT.search(text)) is not None]
    if not found or not 1 <= int(found[0]["day"]) <= 31:
        raise TimeError("no report of a known day", where=where, fix="check that the file holds METAR reports")
    day = found[0]["day"]
    if date is None:
        what = f"the bulletins have no month and no year; the first report is of day {day}"
        raise TimeError(what, where=where, fix=f"give its day in UTC: --date {_named(source, day)}")
    if f"{date:%d}" != day:
        what = f"the first report is of day {day} of its month, and not of {date.isoformat()}"
        raise TimeError(what, where=where, fix=f"give its day in UTC: --date {_named(source, day)}")
    rows: dict[tuple[str, str], list[str]] = {}
    last, known = date, 0
    for match in found:
        near = _near(last, match["day"])
        if near is not None:
            row = metar.row_of(match, near.isoformat())
            last, known = near, known + 1
            rows[row[0], row[1]] = row
    stated = metar.tabled(source, sorted(rows.values(), key=lambda row: row[0]), left_out=len(texts) - known)
    if stated is None or len(rows) == known:
        return source if stated is None else stated
    what = f"{known - len(rows)} reports are sent again, of the same airfield and time: the last of each stands"
    again = Finding(kind="repeated-messages", severity=Severity.NOTE, count=known - len(rows), what=what)
    return TableText.of(stated, stated.text, [again])


def first_day(source: TextFile) -> str:
    """The number of the day of the first report, two digits."""
    match = next(filter(None, map(metar.REPORT.search, _texts(source.head()))))
    return match["day"]


def _near(date: dt.date, day: str) -> dt.date | None:
    """The nearest date that has this number in its month."""
    others = (date + dt.timedelta(days=sign * days) for days in range(_HALF + 1) for sign in (1, -1))
    return next((other for other in others if f"{other:%d}" == day), None)


def _named(source: TextFile, day: str) -> str:
    """A date of this day for an example, that of the file's name where it has one."""
    said = next((match for match in _DATE.finditer(source.path.name) if match["day"] == day), None)
    if said is None or not 1 <= int(said["month"]) <= 12:
        return f"YYYY-MM-{day}, with its year and month"
    return f"{said['year']}-{said['month']}-{day} (after the name of the file, {said[0]!r})"


def _texts(lines: Iterator[str] | Sequence[str]) -> Iterator[str]:
    """The reports below headings of bulletins, each in one line; what is no report but stands there, too."""
    inside, parts = False, list[str]()
    for line in lines:
        text = line.strip(" \t\r\n\x01\x03")
        heading = _HEADING.fullmatch(text)
        if heading is not None or re.fullmatch(r"\d{1,5}", text):
            yield from _whole(parts)
            parts = []
            inside = heading["kind"] in _REPORTS if heading is not None else False
            continue
        if not inside or not text:
            continue
        pieces = text.split("=")
        for piece in pieces[:-1]:
            yield from _whole([*parts, piece])
            parts = []
        parts = [*parts, pieces[-1]] if pieces[-1].strip() else parts
    yield from _whole(parts)


def _whole(parts: Sequence[str]) -> Iterator[str]:
    """The report of these lines, if there is one: the word before all reports of a bulletin alone is none."""
    text = re.sub(r"^(?:METAR|SPECI)\b", "", " ".join(" ".join(parts).split())).strip()
    if text and _LIKE.match(text) and not re.search(r"\bNIL\b", text):
        yield text
