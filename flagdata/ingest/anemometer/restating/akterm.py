"""AKTERM, the German weather service's hourly series of dispersion classes, as the models AUSTAL and LASAT read it.

    * AKTERM-Zeitreihe, …                                      comments
    + Anemometerhoehen (0.1 m):  …                             effective heights, one for each class of roughness
    AK 10999 2009 01 01 00 00 1 1 210  34 1 3 1 -999 9

Behind AK stand station, year, month, day, hour, 0, the mark of the direction, that of the speed, direction, speed, and
what is of the classes and of precipitation. The marks tell the units: of the direction 0 is tens of degrees, 1 and 2
are degrees; of the speed 0 is knots, 1, 2 and 3 are 0.1 m/s; 9 is no value. Source: descriptions of the package readmet
of the University of Trier, in Python and in R. No zone is stated there: a comment of the file may tell it.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.instants import zones
from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_LINE = re.compile(
    r"AK\s+(?P<station>\d{1,5})\s+(?P<year>\d{4})\s+(?P<month>\d\d?)\s+(?P<day>\d\d?)\s+(?P<hour>\d\d?)\s+0+\s+"
    r"(?P<turned>\d)\s+(?P<blowing>\d)\s+(?P<direction>-?\d+)\s+(?P<speed>-?\d+)(?:\s+-?\d+){5,7}\s*"
)
_DEGREES = {"0": 10.0, "1": 1.0, "2": 1.0}
"""Degrees that one of a direction is, by its mark."""
_SPEEDS = {"0": 1852 / 3600, "1": 0.1, "2": 0.1, "3": 0.1}
"""Speed [m/s] that one of a speed is, by its mark."""
_TURN, _HOURS = 360.0, 24
_LEAST = 2


def matches(lines: Sequence[str]) -> bool:
    """Lines that begin with AK as these do, and none but comments and heights beside them."""
    filled = [line.strip() for line in lines if line.strip() and not line.lstrip("\ufeff ").startswith(("*", "+"))]
    return len(filled) >= _LEAST and all(_LINE.fullmatch(line) for line in filled)


def as_table(source: TextFile) -> TableText | None:
    """Time, station, direction and speed of each line."""
    said = zones.stated([line for line in source.head(zones.LINES) if line.lstrip("\ufeff ").startswith("*")])
    found, other = rows_of(source, _cells)
    comments = sum(line.lstrip("\ufeff ").startswith(("*", "+")) for line in source.each_line())
    names = [f"time [{said.name}]" if said is not None else "time", "station", "wind direction [deg]"]
    what = "AKTERM, a series of dispersion classes of the German weather service, its units by the marks of each value"
    return table(
        source, [*names, "wind speed [m/s]"], found, kind="published-table", what=what, left_out=other - comments
    )


def _cells(line: str) -> list[str] | None:
    """The cells of a line; `None` where it is of another kind, or no day or hour."""
    match = _LINE.fullmatch(line.strip())
    if match is None:
        return None
    try:
        day = dt.date(int(match["year"]), int(match["month"]), int(match["day"]))
        instant = dt.datetime.combine(day, dt.time()) + dt.timedelta(hours=int(match["hour"]))
    except ValueError:
        return None
    if int(match["hour"]) > _HOURS:
        return None
    turned, blowing = _DEGREES.get(match["turned"]), _SPEEDS.get(match["blowing"])
    direction = "" if turned is None else f"{int(match['direction']) * turned:g}"
    if direction and not 0 <= float(direction) <= _TURN:
        direction = ""  # 999 is a wind of changing direction
    speed = "" if blowing is None or int(match["speed"]) < 0 else f"{int(match['speed']) * blowing:.4g}"
    return [f"{instant:%Y-%m-%d %H:%M:%S}", match["station"], direction, speed]
