"""Weather reports of amateur radio (APRS), as receivers and servers write them down.

    2024-05-17 22:00:09 UTC: FW0001>APRS,TCPIP*:@172200z5112.34N/00456.78E_231/009g014t058r000h71b10123
    @172200z5112.34N/00456.78E_231/009g014t-04r000p000P000h71b10123
    _05172200c231s009g014t058r000p000P000h71b10123

Source: APRS Protocol Reference 1.0.1, chapter 12: direction in degrees with 000 unknown, sustained speed over a minute
and gust of 5 minutes in mph, °F, humidity with 00 for 100 %, pressure in 0.1 hPa; dots or blanks for no value. A
position's own stamp is the day and time (z: UTC), a report without position has month, day and time in UTC; neither has
a year, so where no receiver's stamp stands before it, the day of the first report is asked for.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.restating.restate import LOOKED_AT, rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_VALUE = r"(?:\d{3}|\.{3}|\s{3})"
_REPORT = re.compile(
    rf"(?:_(?P<dir>{_VALUE})/(?P<speed>{_VALUE})|c(?P<dir2>{_VALUE})s(?P<speed2>{_VALUE}))"
    rf"g(?P<gust>{_VALUE})t(?P<warm>-\d{{2}}|{_VALUE})(?P<rest>.*)"
)
_BEFORE = re.compile(
    r"^\W*(?P<stamp>\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?)\s*(?P<zone>Z|UTC|GMT|[+-]\d\d:?\d\d)?(?!\d)"
)
_OWN = re.compile(r"[@/](?P<day>\d\d)(?P<hour>\d\d)(?P<minute>\d\d)z|[@/](?P<clock>\d{6})h")
_WITHOUT = re.compile(r"_(?:\d{4})(?P<hour>\d\d)(?P<minute>\d\d)c")
_SHARE = 0.5


def matches(lines: Sequence[str]) -> bool:
    """Half of the lines hold a report."""
    filled = [line for line in lines if line.strip()]
    return bool(filled) and sum(_REPORT.search(line) is not None for line in filled) > _SHARE * len(filled)


def as_table(source: TextFile) -> TableText | None:
    """The wind and the weather of each report, after the receiver's stamp or else after its own time of day."""
    lines = [line for line in source.head(LOOKED_AT) if _REPORT.search(line)]
    stamped = sum(_BEFORE.match(line) is not None for line in lines) > len(lines) / 2
    found, other = rows_of(source, lambda line: _row(line, stamped=stamped))
    zoned = not stamped or any("Z" in row[0] or "+" in row[0] for row in found)
    names = [
        "time [UTC]" if zoned else "time", "wind speed [mph]", "wind direction [deg]", "gust [mph]",
        "air temperature [degF]", "relative humidity [%]",
    ]  # fmt: skip
    return table(source, names, found, kind="aprs-reports", what="weather reports of APRS", left_out=other)


def _row(line: str, *, stamped: bool) -> list[str] | None:
    report = _REPORT.search(line)
    if report is None:
        return None
    if stamped:
        before = _BEFORE.match(line)
        zone = "" if before is None else (before["zone"] or "")
        stamp = "" if before is None else before["stamp"] + ("Z" if zone in ("Z", "UTC", "GMT") else zone)
    else:
        own = _WITHOUT.search(line) or _OWN.search(line)
        parts = {} if own is None else own.groupdict()
        clock = parts.get("clock") or ""
        stamp = f"{clock[:2]}:{clock[2:4]}:{clock[4:]}" if clock else f"{parts.get('hour')}:{parts.get('minute')}:00"
        stamp = "" if own is None else stamp
    if not stamp:
        return None
    cells = [report["speed"] or report["speed2"], report["dir"] or report["dir2"], report["gust"], report["warm"]]
    speed, away, gust, warm = (cell.strip(". ") and f"{int(cell)}" for cell in cells)
    damp = re.search(r"h(\d\d)", report["rest"])
    humidity = "" if damp is None else "100" if damp[1] == "00" else f"{int(damp[1])}"
    return [stamp, speed, "" if away == "0" else away, gust, warm, humidity]
