"""Lines of fields without a heading, as weather services and station programs publish them, told by their form.

    2024 05 17 22   123    81 10123   230    42 -9999 -9999 -9999      NOAA's ISD-Lite
    17/05/24 22:00:00 14.1 71 8.9 17.3 25.6 231 … 3 km/h C hPa mm …    Cumulus, realtime.txt
    17-05-24;22:00;14,1;71;8,9;17,3;25,6;231;0,0;0,0;1012,4;210,3;…    Cumulus, monthly log
    12345 5.7 8.5 232 12.3 77 1012.4 … 22 00 00 station … !!C1!!       Weather Display, clientraw.txt
    2024-05-17,22,12.3,8.1,77,0.0,,238,17.1,25.0,1012.3,,3             Meteostat, bulk data by the hour
    94846KORD ORD2024051716002200  0.113 D   229   8   229   12 …      NCEI DSI-6405, ASOS 1-minute

Sources: NOAA NCEI, ISD-Lite format (UTC; temperature, pressure and speed times ten, -9999 missing; direction 0 calm);
Meteostat, "Hourly Data" (UTC; fields 8 direction, 9 speed and 10 gust in km/h); Cumulus Wiki, "Realtime.txt" (day
first; fields 6 average and 7 latest speed, 8 bearing, 14 the unit of the speeds, 41 the highest gust of 10 minutes) and
"Standard log files" (day first; 6 average speed, 7 gust, 8 average bearing, 15 latest speed and 25 latest bearing, as
in WeeWX's list of these fields; units are the station's settings); Weather Display's list of the fields of
clientraw.txt (1 average speed and 2 gust in knots, 3 direction, 4 °C, 5 %, 6 hPa, 29 to 31 the clock, 35 and 36 day and
month, 141 the year); NCEI, DSI-6405 (local and UTC clock; direction and speed in knots over 2 minutes and of 5
seconds).
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flagdata.ingest.anemometer.restating.restate import LOOKED_AT, rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_SHARE = 0.8
_ISD = re.compile(r"\s*(\d{4})\s+(\d\d)\s+(\d\d)\s+(\d\d)((?:\s+-?\d{1,5}){8})\s*")
_REALTIME = re.compile(r"\d{1,2}[-/.]\d{1,2}[-/.]\d{2}\s+\d{2}:\d{2}:\d{2}\s")
_MONTHLY = re.compile(r"(\d{1,2})([-/.])(\d{1,2})\2(\d{2})([;,\t])(\d{1,2}:\d{2})\5")
_DAY = re.compile(r"\d{4}-\d\d-\d\d")
_UNITS = {"m/s": "m/s", "mph": "mph", "km/h": "km/h", "kts": "kn", "knots": "kn"}
_ASOS = re.compile(r"\s*\d{5}[A-Z0-9]{4}\s+[A-Z0-9]{3}(?P<day>\d{8})(?P<local>\d{4})(?P<utc>\d{4})(?P<rest>\s.*)")
_FOUR = re.compile(r"(?:^|\s)[DN]\s+(\d{1,3})\s+(\d{1,3})\s+(\d{1,3})\s+(\d{1,3})(?:\s|$)")
_MONTHS = 12
_CUMULUS = 15
"""Fields of Cumulus' monthly log up to the latest reading of the speed; its later versions have more."""
_BEARING = 24
"""Field of the latest reading of the direction in it, counted from 0."""
_CLIENTRAW = 142
"""Fields of clientraw.txt up to the year."""


@dataclass(frozen=True, kw_only=True)
class _Lines:
    about: str
    names: tuple[str, ...]
    row: Callable[[str], list[str] | None]


def _isd(line: str) -> list[str] | None:
    match = _ISD.fullmatch(line)
    if match is None:
        return None
    values = match[5].split()
    warm, _, pressure, away, speed = values[:5]
    if not (_is(pressure, 8000, 11_000) and _is(away, 0, 360) and _is(speed, 0, 1100) and _is(warm, -950, 650)):
        return None
    calm = speed == "0" and away == "0"
    tenths = ["" if cell == "-9999" else f"{int(cell) / 10:g}" for cell in (speed, warm)]
    stamp = f"{match[1]}-{match[2]}-{match[3]}T{match[4]}:00:00Z"
    return [stamp, tenths[0], "" if away == "-9999" or calm else away, tenths[1]]


def _is(cell: str, low: int, high: int) -> bool:
    """Whether a number is missing or lies between."""
    return cell == "-9999" or low <= int(cell) <= high


def _meteostat(line: str) -> list[str] | None:
    cells = [cell.strip() for cell in line.rstrip("\r\n").split(",")]
    if len(cells) != 13 or _DAY.fullmatch(cells[0]) is None or not cells[1].isdigit() or int(cells[1]) > 23:
        return None
    ranges = ((4, 0, 100), (7, 0, 360), (8, 0, 400), (10, 850, 1100), (12, 1, 27))
    if not all(cells[at] == "" or _between(cells[at], low, high) for at, low, high in ranges):
        return None
    return [f"{cells[0]}T{int(cells[1]):02d}:00:00Z", cells[8], cells[7], cells[9], cells[2], cells[4]]


def _between(cell: str, low: float, high: float) -> bool:
    return re.fullmatch(r"\d+(?:\.\d+)?", cell) is not None and low <= float(cell) <= high


def _realtime(line: str) -> list[str] | None:
    cells = line.split()
    if len(cells) < 17 or not _REALTIME.match(line) or cells[13] not in _UNITS:
        return None
    warm = {"C": "degC", "F": "degF"}.get(cells[14], "")
    gust = cells[40] if len(cells) > 40 else ""
    bearing = "" if cells[11] == "---" else cells[7]  # calm air has a bearing of 0 and no point of the compass
    return [cells[0], cells[1], cells[5], cells[6], gust, bearing, cells[2] if warm else "", _UNITS[cells[13]], warm]


def _monthly(line: str) -> list[str] | None:
    match = _MONTHLY.match(line)
    if match is None:
        return None
    day, _, month, year, delimiter, clock = match.groups()
    cells = [cell.strip().replace(",", ".") for cell in line.rstrip("\r\n").split(delimiter)]
    if len(cells) < _CUMULUS or not all(re.fullmatch(r"-?\d+(?:\.\d+)?", cell) for cell in cells[2:_CUMULUS]):
        return None
    number = dict(enumerate(map(float, cells[2:_CUMULUS]), start=2))
    shares = all(0 <= number[at] <= 100 for at in (3, 13))
    pressed = 850 < number[10] < 1100 or 25 < number[10] < 32.5
    if not (shares and pressed and 0 <= number[5] <= number[6] and 0 <= number[7] <= 360):
        return None
    if not (1 <= int(day) <= 31 and 1 <= int(month) <= 12):
        return None
    bearing = cells[_BEARING] if len(cells) > _BEARING and _between(cells[_BEARING], 0, 360) else ""
    return [f"20{year}-{int(month):02d}-{int(day):02d} {clock}", *cells[5:8], cells[3], cells[14], bearing]


def _clientraw(line: str) -> list[str] | None:
    cells = line.split()
    if len(cells) < _CLIENTRAW or cells[0] != "12345" or not re.fullmatch(r"(?:19|20)\d\d", cells[141]):
        return None
    year, month, day, clock = cells[141], cells[36], cells[35], cells[29:32]
    if not all(part.isdigit() for part in (month, day, *clock)):
        return None
    date = f"{year}-{int(month):02d}-{int(day):02d}"
    return [f"{date} {':'.join(f'{int(part):02d}' for part in clock)}", *cells[1:7]]


def _asos(line: str) -> list[str] | None:
    match = _ASOS.fullmatch(line.rstrip())
    if match is None or re.fullmatch(r"[01]\d[0-5]\d|2[0-3][0-5]\d", match["utc"]) is None:
        return None
    try:
        local = dt.datetime.strptime(match["day"] + match["local"], "%Y%m%d%H%M").replace(tzinfo=dt.UTC)
    except ValueError:
        return None
    clock = dt.timedelta(hours=int(match["utc"][:2]), minutes=int(match["utc"][2:]))
    utc = local.replace(hour=0, minute=0) + clock
    for days in (-1, 1):
        other = utc + dt.timedelta(days=days)
        utc = other if abs(other - local) < abs(utc - local) else utc
    wind = _FOUR.search(match["rest"])
    away, speed, _, gust = wind.groups() if wind is not None else ("", "", "", "")
    return [f"{utc:%Y-%m-%dT%H:%M:00}Z", speed, "" if speed == "0" else away, gust]


_KINDS = (
    _Lines(
        about="NOAA's ISD-Lite",
        names=("time [UTC]", "wind speed [m/s]", "wind direction [deg]", "air temperature [degC]"), row=_isd,
    ),
    _Lines(
        about="Meteostat's hourly data",
        names=(
            "time [UTC]", "wind speed [km/h]", "wind direction [deg]", "gust [km/h]", "air temperature [degC]",
            "relative humidity [%]",
        ),
        row=_meteostat,
    ),
    _Lines(
        about="Cumulus' realtime.txt",
        names=(
            "date", "time", "wind speed average", "wind speed of latest samples", "gust", "wind direction [deg]",
            "air temperature",
        ),
        row=_realtime,
    ),
    _Lines(
        about="Cumulus' monthly log",
        names=(
            "time", "wind speed average", "gust", "wind direction [deg]", "relative humidity [%]",
            "wind speed of latest samples", "wind direction of latest samples [deg]",
        ),
        row=_monthly,
    ),
    _Lines(
        about="Weather Display's clientraw.txt",
        names=(
            "time", "wind speed average [kn]", "gust [kn]", "wind direction [deg]", "air temperature [degC]",
            "relative humidity [%]", "air pressure sea level [hPa]",
        ),
        row=_clientraw,
    ),
    _Lines(
        about="ASOS of one minute (DSI-6405)",
        names=("time [UTC]", "wind speed [kn]", "wind direction [deg]", "gust [kn]"), row=_asos,
    ),
)  # fmt: skip


def matches(lines: Sequence[str]) -> bool:
    """Most lines are of one of these forms."""
    return _kind(lines) is not None


def as_table(source: TextFile) -> TableText | None:
    """The wind and the weather of each line; `None` where the unit changes from line to line."""
    kind = _kind(source.head(LOOKED_AT))
    if kind is None:
        return None
    found, other = rows_of(source, kind.row)
    names = list(kind.names)
    if kind.row is _realtime:
        units = {tuple(row[-2:]) for row in found}
        if len(units) != 1:
            return None
        speed, warm = units.pop()
        names[2:5] = [f"{name} [{speed}]" for name in names[2:5]]
        names[6] = f"{names[6]} [{warm}]" if warm else names[6]
        if all(int(re.split(r"[-/.]", row[0])[1]) <= _MONTHS for row in found):
            names[0] = "date (dd/mm/yy)"  # another program may have written the month first, and then some days show it
        found = [row[:-2] for row in found]
    return table(source, names, found, kind="published-lines", what=kind.about, left_out=other)


def _kind(lines: Sequence[str]) -> _Lines | None:
    filled = [line for line in lines if line.strip()]
    if not filled:
        return None
    return next(
        (kind for kind in _KINDS if sum(kind.row(line) is not None for line in filled) >= _SHARE * len(filled)), None
    )
