"""METAR, SPECI and SYNOP reports in bulletins, as they come over the WMO's network: the month is nowhere in them.

    SAXX31 KABC 021200
    METAR KAAA 021153Z 24005KT 10SM FEW040 21/12 A3001 RMK
         AO2=
    SMXX01 EABC 021200
    AAXX 02121
    03772 11458 72405 10158 20113=
    03740 NIL=

Source: WMO, Manual on the Global Telecommunication System (WMO-No. 386): the abbreviated heading TTAAii CCCC YYGGgg of
a bulletin, SA for METAR and SP for SPECI, YY the day of the month; Manual on Codes (WMO-No. 306), FM 15 and FM 12: "="
ends a report, and a report may go on in the next line; reports below AAXX YYGGiw are SYNOP of that day and hour. The
user gives the date of the first report. Each further one is of the nearest day that has its number; the reports are put
in order, since bulletins come late and are repeated.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from flagdata.errors import TimeError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.restating import metar, synop
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_HEADING = re.compile(r"(?P<kind>[A-Z]{2})[A-Z]{2}\d{1,2}\s+[A-Z]{4}\s+\d{6}(?:\s+[A-Z]{3})?")
_REPORTS = frozenset({"SA", "SP"})
_OTHER = re.compile(r"(?:BBXX|OOXX|TTAA|TTBB|PPBB|CLIMAT)\b")
"""Reports of ships, of the upper air and of the climate, which may stand below the heading of a bulletin."""
_LIKE = re.compile(r"(?:(?:METAR|SPECI)\s+)?(?:COR\s+)?[A-Z][A-Z0-9]{2,3}\s+\S")
_DATE = re.compile(r"(?<!\d)(?P<year>20\d\d|19\d\d)[-_.]?(?P<month>\d\d)[-_.]?(?P<day>\d\d)(?!\d{3})")
_HALF = 15
"""Days before and after a report within which the next one lies."""
_LAST = 31
"""Days of the longest month."""


@dataclass(frozen=True, kw_only=True)
class _Report:
    """A report of a day without its month.

    Attributes:
        day: of the month, two digits.
        row: of a table of `metar.tabled`, by the date.
    """

    day: str
    row: Callable[[dt.date], list[str]]


@dataclass(frozen=True, kw_only=True)
class _Bulletin:
    """Lines below one heading.

    Attributes:
        heading: of SYNOP reports; `None` for METAR reports and for bulletins of another kind.
        known: whether its reports can be read.
        lines: below the heading.
    """

    heading: re.Match[str] | None
    known: bool
    lines: tuple[str, ...]


def matches(lines: Sequence[str]) -> bool:
    """Whether the first lines hold the heading of a bulletin of reports, and one of its reports."""
    return any(found is not None for bulletin in _bulletins(lines) for found in _reports(bulletin))


def dated(source: TextFile, date: dt.date | None) -> TextFile:
    """The wind of each report as a table with a row a report, in the order of time.

    Args:
        date: day of the first report [UTC]; the bulletins have its number alone.

    Raises:
        TimeError: nobody gave the day, or it has another number than the first report's.
    """
    where = str(source.path)
    bulletins = list(_bulletins(line for _, lines in source.blocks() for line in lines))
    reports = [report for bulletin in bulletins for report in _reports(bulletin)]
    found = [report for report in reports if report is not None]
    if not found:
        raise TimeError("no report of a known day", where=where, fix="check that the file holds METAR or SYNOP reports")
    day = found[0].day
    if date is None:
        what = f"the bulletins have no month and no year; the first report is of day {day}"
        raise TimeError(what, where=where, fix=f"give its day in UTC: --date {_named(source, day)}")
    if f"{date:%d}" != day:
        what = f"the first report is of day {day} of its month, and not of {date.isoformat()}"
        raise TimeError(what, where=where, fix=f"give its day in UTC: --date {_named(source, day)}")
    rows: dict[tuple[str, str], list[str]] = {}
    last, known = date, 0
    for report in found:
        near = _near(last, report.day)
        if near is not None:
            row = report.row(near)
            last, known = near, known + 1
            rows[row[0], row[1]] = row
    kinds = [name for name, held in (("METAR", False), ("SYNOP", True)) if _holds(bulletins, synoptic=held)]
    in_order = sorted(rows.values(), key=lambda row: row[0])
    what = f"{' and '.join(kinds)} reports"
    stated = metar.tabled(source, in_order, left_out=len(reports) - known, what=what)
    if stated is None:
        return source
    return TableText.of(stated, stated.text, _told(bulletins, repeated=known - len(rows)))


def first_day(source: TextFile) -> str:
    """The number of the day of the first report, two digits."""
    reports = (report for bulletin in _bulletins(source.head()) for report in _reports(bulletin))
    return next(report.day for report in reports if report is not None)


def _told(bulletins: Sequence[_Bulletin], *, repeated: int) -> list[Finding]:
    """What is said of reports that were sent again, and of bulletins of other kinds."""
    found: list[Finding] = []
    if repeated:
        what = f"{repeated} reports are sent again, of the same station and time: the last of each stands"
        found.append(Finding(kind="repeated-messages", severity=Severity.NOTE, count=repeated, what=what))
    others = sum(bool(line) for bulletin in bulletins if not bulletin.known for line in bulletin.lines)
    if others:
        what = f"{others} lines are of bulletins of another kind (forecasts, ships, the upper air); left out"
        found.append(Finding(kind="other-messages", severity=Severity.NOTE, count=others, what=what))
    return found


def _holds(bulletins: Sequence[_Bulletin], *, synoptic: bool) -> bool:
    """Whether bulletins hold SYNOP reports, or METAR reports."""
    kind = (bulletin for bulletin in bulletins if bulletin.known and (bulletin.heading is not None) == synoptic)
    return any(report is not None for bulletin in kind for report in _reports(bulletin))


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


def _bulletins(lines: Iterable[str]) -> Iterator[_Bulletin]:
    """The bulletins of a file; lines before the first heading are of none."""
    heading: re.Match[str] | None = None
    known, held = False, list[str]()
    begun = False
    for line in lines:
        text = line.strip(" \t\r\n\x01\x03")
        above = _HEADING.fullmatch(text)
        synoptic = synop.HEADING.match(text)
        if above is None and synoptic is None and not re.fullmatch(r"\d{1,5}", text) and not _OTHER.match(text):
            held += [text] if begun else []
            continue
        yield _Bulletin(heading=heading, known=known, lines=tuple(held))
        begun, heading = above is not None or synoptic is not None or bool(_OTHER.match(text)), synoptic
        known = synoptic is not None or (above is not None and above["kind"] in _REPORTS)
        held = [text[synoptic.end() :].strip()] if synoptic is not None else [text] if _OTHER.match(text) else []
    yield _Bulletin(heading=heading, known=known, lines=tuple(held))


def _reports(bulletin: _Bulletin) -> Iterator[_Report | None]:
    """The reports of a bulletin; `None` for what is no report but stands there."""
    if not bulletin.known:
        return
    for text in _texts(bulletin):
        found = _weather(text) if bulletin.heading is None else _synoptic(bulletin.heading, text)
        yield found if found is not None and 1 <= int(found.day) <= _LAST else None


def _weather(text: str) -> _Report | None:
    match = metar.REPORT.search(text)
    return None if match is None else _Report(day=match["day"], row=lambda date: metar.row_of(match, date.isoformat()))


def _synoptic(heading: re.Match[str], text: str) -> _Report | None:
    report = synop.read(heading, text)
    return None if report is None else _Report(day=report.day, row=report.at)


def _texts(bulletin: _Bulletin) -> Iterator[str]:
    """The reports of a bulletin, each in one line; those that say that there is none (NIL) are left out.

    A SYNOP report ends with its line in a bulletin where nothing else ends it.
    """
    synoptic = bulletin.heading is not None
    by_line = synoptic and not any("=" in line for line in bulletin.lines)
    whole = "=".join(bulletin.lines) if by_line else "\n".join(bulletin.lines)
    for part in whole.split("="):
        text = re.sub(r"^(?:METAR|SPECI)\b", "", " ".join(part.split())).strip()
        if text and (synoptic or _LIKE.match(text)) and not re.search(r"\bNIL\b", text):
            yield text
