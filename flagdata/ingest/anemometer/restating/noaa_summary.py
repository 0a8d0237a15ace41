"""Monthly summaries in the form of NOAA's, as WeeWX, WeatherLink and Cumulus print them: a day a line.

                   MONTHLY CLIMATOLOGICAL SUMMARY for Jan 2026
                   TEMPERATURE (C), RAIN (cm), WIND SPEED (kph)
                                         HEAT   COOL         AVG
      MEAN                               DEG    DEG          WIND                   DOM
    DAY   TEMP   HIGH   TIME    LOW   TIME   DAYS   DAYS   RAIN  SPEED   HIGH   TIME    DIR
    ---------------------------------------------------------------------------------------
     01   12.9   16.2  12:15   10.3  02:38    5.4    0.0   0.00    1.8   17.7  14:05    235

Sources: WeeWX, "Customization guide", NOAA reports; Davis, WeatherLink, NOAA reports. The tenth column is the mean
speed of the day, the thirteenth the prevailing direction, in degrees or as a point of the compass; units stand in the
line of the quantities, the month in the title. Days are of the station's local time.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.instants.month_names import ENGLISH
from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_TITLE = re.compile(
    r"MONTHLY CLIMATOLOGICAL SUMMARY\s+for\s+(?P<month>[A-Z]{3})[A-Z]*\.?,?\s+(?P<year>\d{4})", re.IGNORECASE
)
_UNIT = re.compile(r"WIND SPEED\s*\((?P<unit>[^)]{1,12})\)", re.IGNORECASE)
_DAY = re.compile(r"\s*(?P<day>\d{1,2})\s+\S")
_SPEED, _HIGH, _DIRECTION, _CELLS = 9, 10, 12, 13
_MISSING = re.compile(r"-{1,3}|N/A|None", re.IGNORECASE)


def matches(lines: Sequence[str]) -> bool:
    """A title with the month, and the unit of the wind."""
    return _found(lines, _TITLE) is not None and _found(lines, _UNIT) is not None


def as_table(source: TextFile) -> TableText | None:
    """The day, its mean speed and its prevailing direction; `None` where the month is none or no day is told."""
    title, stated = _found(source.head(), _TITLE), _found(source.head(), _UNIT)
    if title is None or stated is None or title["month"].lower() not in ENGLISH:
        return None
    month = ENGLISH.index(title["month"].lower()) + 1

    def row(line: str) -> list[str] | None:
        cells = line.split()
        match = _DAY.match(line)
        if match is None or len(cells) != _CELLS:
            return None
        try:
            day = dt.date(int(title["year"]), month, int(match["day"]))
        except ValueError:
            return None
        kept = ("" if _MISSING.fullmatch(cells[at]) else cells[at] for at in (_SPEED, _HIGH, _DIRECTION))
        return [day.isoformat(), *kept]

    rows, _ = rows_of(source, row)
    unit = stated["unit"].strip()
    names = ["date", f"wind speed average [{unit}]", f"gust [{unit}]", "wind direction"]
    return table(source, names, rows, kind="noaa-summary", what="a monthly summary in the form of NOAA's")


def _found(lines: Sequence[str], pattern: re.Pattern[str]) -> re.Match[str] | None:
    return next((found for line in lines if (found := pattern.search(line)) is not None), None)
