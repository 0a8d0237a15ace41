"""SYNOP reports of land stations (FM 12), one after the stamp of when it is of: archives of stations' weather.

    03772,2023,07,01,00,00,AAXX 01004 03772 11458 72405 10158 20113 40113 333 91019==
    202307010000 AAXX 01004 03772 11458 72405 10158
                      20113 40113=

Source: WMO, Manual on Codes (WMO-No. 306), FM 12: AAXX YYGGiw states the day of the month, the hour in UTC and the unit
of all speeds (iw: 0 and 1 m/s, 3 and 4 knots); a report is IIiii (the station), iRixhVV, Nddff (dd the direction in
tens of degrees, 00 calm, 99 variable; ff the mean over ten minutes), 00fff where ff is 99, and further groups, of which
1sTTT is the temperature of the air in tenths of a degree (s: 0 above, 1 below zero), 3PPPP the pressure at the station
in tenths of hPa without its thousands, 9GGgg the time of observation where it is not the hour, and 910ff of section 3
the highest gust in ten minutes. 4PPPP is the pressure reduced to the level of the sea, which is not read. The month is
only in the stamp before the report, whose day must be that of the report.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from flagdata.ingest.anemometer.restating import metar
from flagdata.ingest.anemometer.text.source import TableText, TextFile

HEADING = re.compile(r"AAXX\s+(?P<day>[0-3]\d)(?P<hour>[0-2]\d)(?P<iw>[0134/])(?=\s|$)")
"""What stands before the reports of one hour."""
_UNITS = {"0": "m/s", "1": "m/s", "3": "kn", "4": "kn"}
_REPORT = re.compile(
    r"(?P<station>\d{5}) [0-4/][1-7/][\d/]{3} [\d/](?P<dir>\d\d|//)(?P<speed>\d\d|//)"
    r"(?: 00(?P<above>\d{3}))?(?P<rest>(?: \S+)*)"
)
_SECTION = re.compile(r" (?:222\S\S|333|444|555)(?= |$)")
_TIME = re.compile(r" 9([01]\d|2[0-3])([0-5]\d)(?= |$)")
_GUST = re.compile(r" 333 (?:(?!444|555)\S+ )*?910(\d\d)(?: 00(\d{3}))?(?= |$)")
_TEMPERATURE = re.compile(r" 1([01])(\d{3})(?= |$)")
_PRESSURE = re.compile(r" 3(\d{4})(?= |$)")
_THOUSANDS, _LOWEST = 1000, 4500
"""A pressure below the first [0.1 hPa] lacks its thousands; none between the two is measured at a station."""
_MOST, _VARIABLE = 36, 99
"""Tens of degrees of the north, and what stands for no one direction."""
_ABOVE = "99"
"""The speed that says that the next group has it."""
_STAMPED = re.compile(
    r"(?:\w+[\s,;]+)?(?P<year>(?:19|20)\d\d)[-/,]?(?P<month>\d\d)[-/,]?(?P<day>\d\d)"
    r"[T ,;]?(?P<hour>\d\d)[:,]?(?P<minute>\d\d)(?::\d\d)?Z?[\s,;]+(?:\d{5}[\s,;]+)?\"?(?P<report>AAXX\s.*)"
)
_NEAR = dt.timedelta(hours=1)
"""How far the stamp before a report may be from the report's own hour to stand for its time."""


@dataclass(frozen=True, kw_only=True)
class Synop:
    """A report of a land station.

    Attributes:
        day: of the month, two digits.
        hour: to which the report belongs [UTC].
        time: of the observation, hour and minute [UTC]; `None` where it is the hour.
        row: station, speed, direction, gust, unit, temperature and pressure as `metar.tabled` takes them; "" for what
            is missing.
    """

    day: str
    hour: int
    time: tuple[int, int] | None
    row: tuple[str, ...]

    def at(self, date: dt.date, stamp: dt.datetime | None = None) -> list[str]:
        """The report's row of a table of `metar.tabled`.

        Args:
            date: of its hour [UTC].
            stamp: that stands before it [UTC]; counts where it is near the hour and the report has no time of its own.
        """
        hour = dt.datetime.combine(date, dt.time(self.hour), tzinfo=dt.UTC)
        when = stamp if stamp is not None and abs(stamp - hour) <= _NEAR else hour
        if self.time is not None:
            same = hour.replace(hour=self.time[0], minute=self.time[1])
            when = min((same + dt.timedelta(days=days) for days in (-1, 0, 1)), key=lambda other: abs(other - hour))
        return [f"{when:%Y-%m-%dT%H:%M:%SZ}", *self.row]


def read(heading: re.Match[str], text: str) -> Synop | None:
    """The report of a text below a heading (a match of `HEADING`); `None` for what is none, or of an unknown unit."""
    match = _REPORT.fullmatch(" ".join(text.split()))
    named, hour = _UNITS.get(heading["iw"]), int(heading["hour"])
    if match is None or hour > 23 or (named is None and match["speed"] != "//"):
        return None
    tens = int(match["dir"]) if match["dir"].isdigit() else _VARIABLE
    if _MOST < tens < _VARIABLE:
        return None
    speed = _speed(match["speed"], match["above"])
    away = f"{10 * tens}" if 0 < tens <= _MOST and speed.strip("0") else ""
    end = _SECTION.search(match["rest"])
    first = match["rest"][: end.start()] if end is not None else match["rest"]
    time = _TIME.search(first)
    gust = _GUST.search(match["rest"])
    return Synop(
        day=heading["day"], hour=hour, time=None if time is None else (int(time[1]), int(time[2])),
        row=(
            match["station"], speed, away, "" if gust is None else _speed(gust[1], gust[2]), named or "m/s",
            _temperature(first), _pressure(first),
        ),
    )  # fmt: skip


def _temperature(groups: str) -> str:
    """The temperature of the air [°C] of the groups of section 1; "" where it is missing."""
    found = _TEMPERATURE.search(groups)
    return "" if found is None else f"{'-' if found[1] == '1' else ''}{int(found[2]) / 10:.1f}"


def _pressure(groups: str) -> str:
    """The pressure at the station [hPa] of the groups of section 1; "" where it is missing."""
    found = _PRESSURE.search(groups)
    tenths = _THOUSANDS if found is None else int(found[1])
    if _THOUSANDS <= tenths < _LOWEST:
        return ""
    return f"{tenths / 10 + (1000 if tenths < _THOUSANDS else 0):.1f}"


def _speed(two: str, three: str | None) -> str:
    """A speed of two digits, or of three where the two say so; "" where it is missing."""
    if two == _ABOVE:
        return f"{int(three)}" if three else ""
    return f"{int(two)}" if two.isdigit() else ""


def matches(lines: Sequence[str]) -> bool:
    """Whether most reports of the first lines stand after a stamp of their day."""
    rows = list(_rows(lines))
    return sum(row is not None for row in rows) > len(rows) / 2


def as_table(source: TextFile) -> TableText | None:
    """The wind of each report."""
    rows = list(_rows(line for _, lines in source.blocks() for line in lines))
    found = [row for row in rows if row is not None]
    return metar.tabled(source, found, left_out=len(rows) - len(found), what="SYNOP reports")


def _rows(lines: Iterable[str]) -> Iterator[list[str] | None]:
    """The row of each report, `None` for what is no report of the day of its stamp; lines without a digit are none."""
    for text in _joined(lines):
        if re.search(r"\d", text) and not re.search(r"\bNIL\b", text):
            yield _row(text)


def _joined(lines: Iterable[str]) -> Iterator[str]:
    """Each report in one line: lines without a stamp go on with the report above that "=" has not ended."""
    report = ""
    for line in lines:
        text = line.strip()
        if report and not report.endswith("=") and text and not text.startswith("#") and not _STAMPED.match(text):
            report += f" {text}"
            continue
        if report:
            yield report
        report = text if _STAMPED.match(text) else ""
        if text and not report and not text.startswith("#"):
            yield text
    if report:
        yield report


def _row(text: str) -> list[str] | None:
    stamped = _STAMPED.match(text)
    heading = None if stamped is None else HEADING.match(stamped["report"])
    if stamped is None or heading is None or heading["day"] != stamped["day"]:
        return None
    report = read(heading, stamped["report"][heading.end() :].rstrip('=" '))
    numbers = [int(stamped[part]) for part in ("year", "month", "day", "hour", "minute")]
    try:
        stamp = dt.datetime(*numbers, tzinfo=dt.UTC)  # type: ignore[arg-type]
    except ValueError:
        return None
    return None if report is None else report.at(stamp.date(), stamp)
