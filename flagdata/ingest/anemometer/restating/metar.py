"""METAR and SPECI reports, one in a line after the stamp of when it was of: archives of airports' weather.

    202307010025 METAR EHAM 010025Z 23008KT 9999 FEW020 18/12 Q1013=
    2023-07-01 00:25,EHAM,EHAM 010025Z VRB02KT CAVOK 18/12 Q1013

Source: WMO, Manual on Codes (WMO-No. 306), FM 15: dddff(Gfmfm) with KT, MPS or KMH is the mean wind over ten minutes,
its direction true and rounded to ten degrees, VRB for a variable one; 00000KT is calm; the group YYGGggZ is the day of
the month and the time in UTC. The month is only in the stamp before the report, which must agree with that group.
"""

from __future__ import annotations

import csv
import datetime as dt
import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.units import unit

_STAMP = re.compile(
    r"\D*(?P<year>\d{4})[-/]?(?P<month>\d{2})[-/]?(?P<day>\d{2})[T ,]?(?P<hour>\d{2}):?(?P<minute>\d{2})"
)
REPORT = re.compile(
    r"\b(?P<station>[A-Z][A-Z0-9]{3})\s+(?P<day>\d{2})(?P<hour>\d{2})(?P<minute>\d{2})Z\s+(?:AUTO\s+|COR\s+)?"
    r"(?P<dir>\d{3}|VRB|///)(?P<speed>P?\d{2,3}|//)(?:G(?P<gust>P?\d{2,3}))?(?P<unit>KT|MPS|KMH)\b"
)
_OF_ASOS = re.compile(r"\d{5}[A-Z0-9]{4} [A-Z0-9]{3}(?P<day>\d{8})\d{4}.*\s5-MIN\s")
"""What stands before a report in NCEI's ASOS of 5 minutes (DSI-6401): the local date, at most a day from UTC's."""
_WEATHER = ("air temperature [degC]", "air pressure [hPa]")
_UNITS = {"KT": "kn", "MPS": "m/s", "KMH": "km/h"}


def matches(lines: Sequence[str]) -> bool:
    """Most lines are a stamp and a report whose day agrees, and no table already states the wind beside it."""
    filled = [line for line in lines if line.strip()]
    rows = [_row(line) for line in filled]
    if sum(row is not None for row in rows) <= len(filled) / 2:
        return False
    heads = next(csv.reader(filled[:1]), [])
    return not any(name.strip().lower() in ("sknt", "drct", "wind_speed", "speed", "wspd") for name in heads)


def as_table(source: TextFile) -> TableText | None:
    """The wind of each report."""
    found, other = rows_of(source, _row)
    return tabled(source, found, left_out=other)


def tabled(
    source: TextFile, found: Sequence[Sequence[str]], *, left_out: int, what: str = "METAR reports"
) -> TableText | None:
    """Rows as `row_of` makes them as a table; `None` where there is none.

    Args:
        found: rows; behind the unit may stand the temperature [°C] and the pressure [hPa] at the station, "" for none.
        left_out: reports that cannot be read.
        what: the reports are.
    """
    units = sorted({row[5] for row in found})
    named = units[0] if len(units) == 1 else "m/s"
    winds = [list(row[:5]) if row[5] == named else _in_si(row) for row in found]
    weather = [[*row[6:], *[""] * (len(_WEATHER) - len(row[6:]))] for row in found]
    told = [at for at in range(len(_WEATHER)) if any(row[at] for row in weather)]
    # The last column is filled in every row: most reports have no gust, and a table ends where its rows do.
    rows = [
        [when, *wind, *(beside[at] for at in told), station]
        for (when, station, *wind), beside in zip(winds, weather, strict=True)
    ]
    kind = "metar-reports" if "METAR" in what else "synop-reports"
    names = ["time [UTC]", f"wind speed [{named}]", "wind direction [deg]", f"gust [{named}]"]
    names += [*(_WEATHER[at] for at in told), "station"]
    what = f"the wind of {what}" if len(units) == 1 else f"the wind of {what} in {' and '.join(units)}, all put in m/s"
    return table(source, names, rows, kind=kind, what=what, left_out=left_out)


def _in_si(row: Sequence[str]) -> list[str]:
    """A row with its speed and gust in m/s."""
    scale = unit(row[5]).scale
    speed, gust = (f"{float(cell) * scale:.9g}" if cell else "" for cell in (row[2], row[4]))
    return [row[0], row[1], speed, row[3], gust]


def _row(line: str) -> list[str] | None:
    """Stamp, station, speed, direction, gust and unit of a line; `None` where it is no report of a known day."""
    report = REPORT.search(line)
    date = None if report is None else _date(line, report["day"])
    if report is None or date is None:
        return None
    return row_of(report, date)


def row_of(report: re.Match[str], date: str) -> list[str]:
    """Stamp, station, speed, direction, gust and unit of a report (a match of `REPORT`) of a date [UTC, ISO 8601]."""
    when = f"{date}T{report['hour']}:{report['minute']}:00Z"
    speed = "" if "/" in report["speed"] else report["speed"].lstrip("P")
    away = report["dir"] if report["dir"].isdigit() and speed.strip("0") else ""
    gust = (report["gust"] or "").lstrip("P")
    return [when, report["station"], speed, away, gust, _UNITS[report["unit"]]]


def _date(line: str, day: str) -> str | None:
    """The date of a report of this day of the month, by the stamp before it; `None` where that is of another day."""
    asos = _OF_ASOS.match(line)
    if asos is not None:
        try:
            local = dt.date.fromisoformat(asos["day"])
        except ValueError:
            return None
        near = (local + dt.timedelta(days=days) for days in (0, 1, -1))
        return next((date.isoformat() for date in near if f"{date:%d}" == day), None)
    stamp = _STAMP.match(line)
    return None if stamp is None or stamp["day"] != day else f"{stamp['year']}-{stamp['month']}-{day}"
