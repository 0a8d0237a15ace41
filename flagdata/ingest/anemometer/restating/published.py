"""Tables of weather services and station programs whose headings state neither unit nor zone, as descriptions do.

Each is told by headings that no other table has together, and stated again with unit and zone in its headings. Sources:
NOAA NDBC, "Measurement Descriptions and Units" (UTC, m/s; 99, 999 and MM missing; of supplemental data the wind is the
highest of one minute); DWD, descriptions of the hourly and 10-minute wind (m/s, -999 missing; UTC, of 10 minutes before
2000 CET); KNMI, headings of its files (0.1 m/s, hour 24 ends the day, UT; direction 0 calm, 990 variable);
Météo-France, descriptions of SYNOP (UTC, m/s, K, Pa; mq missing) and of hourly and daily data (m/s, FFM the daily mean;
no zone is stated); AEMET OpenData, metadata (m/s; daily directions in tens of degrees, 99 variable, 88 none);
MeteoSwiss, "Open Data: automatic weather stations", parameters, and legends of IDAweb and VQHA80 (UTC; fkl, fk1 in m/s,
fu3 in km/h, of 10 minutes (z), an hour (h) or a day (d); "-" missing); Meteostat, "Hourly Data" (km/h); Iowa
Environmental Mesonet, "ASOS download" (sped in mph, M or null missing; the zone is chosen there); WeeWX, "Units"
(usUnits 1: mph, °F and inHg; 16: km/h, °C, mbar; 17: m/s, °C, mbar), which wview's archive shares.
"""

from __future__ import annotations

import csv
import datetime as dt
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.restating.restate import LOOKED_AT, table
from flagdata.ingest.anemometer.text.signs import BLANKS, SIGNS
from flagdata.ingest.anemometer.text.source import TableText, TextFile

Row = Mapping[str, str]


@dataclass(frozen=True, kw_only=True)
class _Published:
    """One kind of table.

    Attributes:
        about: what it is.
        needs: sets of headings, each of which tells it.
        columns: heading in the file → heading that states the unit; others are kept under their own where `whole`.
        stamp: the instant of a row with its zone, "" for a damaged one; `None` keeps the stamps of the file.
        missing: heading in the file → texts for no value.
        whole: whether other columns are kept.
        zoned: whether `stamp` tells the zone.
        clean: of a cell.
        warning: of what its wind is, where that is no mean wind.
    """

    about: str
    needs: tuple[frozenset[str], ...]
    columns: Mapping[str, str]
    stamp: Callable[[Row], str] | None = None
    missing: Mapping[str, frozenset[str]] = field(default_factory=dict)
    whole: bool = False
    zoned: bool = True
    clean: Callable[[str], str] = str.strip
    warning: str = ""


def _digits(*names: str, zone: str = "Z") -> Callable[[Row], str]:
    """A stamp of digits with nothing between, year first, in the first column of `names` that a row has."""

    def read(row: Row) -> str:
        text = next((row[name] for name in names if name in row), "").strip()
        if not re.fullmatch(r"\d{8}(?:\d\d){0,3}", text):
            return ""
        parts = f"{text:0<14}"
        return f"{parts[:4]}-{parts[4:6]}-{parts[6:8]}T{parts[8:10]}:{parts[10:12]}:{parts[12:14]}{zone}"

    return read


def _pointed(cell: str) -> str:
    """A number with a decimal point."""
    return cell.strip().replace(",", ".")


def _dwd_ten_minutes(row: Row) -> str:
    zone = "+00:00" if row.get("MESS_DATUM", "") >= "2000" else "+01:00"
    return _digits("MESS_DATUM", zone=zone)(row)


def _buoy(row: Row) -> str:
    year, month, day, hour = (
        next((row[name] for name in names if name in row), "").strip()
        for names in (("#YY", "YY", "YYYY", "#YYYY"), ("MM",), ("DD",), ("hh",))
    )
    minute = row.get("mm", "00").strip()
    if re.fullmatch(r"\d{4}", clock := row.get("hhmm", "").strip()):
        hour, minute = clock[:2], clock[2:]
    if not all(part.isdigit() for part in (year, month, day, hour, minute)):
        return ""
    whole = int(year) + (0 if len(year) == 4 else 1900 if int(year) >= 70 else 2000)
    return f"{whole:04d}-{int(month):02d}-{int(day):02d}T{int(hour):02d}:{int(minute):02d}:00Z"


def _knmi(row: Row) -> str:
    """The end of the hour that a row is of; of daily values their day."""
    day, hour = row.get("YYYYMMDD", "").strip(), row.get("HH", row.get("H", "0")).strip()
    day = re.sub(r"^(\d{4})-(\d\d)-(\d\d)$", r"\1\2\3", day)  # as tables that were read and written anew have it
    if not re.fullmatch(r"\d{8}", day) or not hour.isdigit() or int(hour) > 24:
        return ""
    try:
        instant = dt.datetime.strptime(day, "%Y%m%d").replace(tzinfo=dt.UTC) + dt.timedelta(hours=int(hour))
    except ValueError:
        return ""
    return f"{instant:%Y-%m-%dT%H:%M:%S}Z"


def _swiss(row: Row) -> str:
    """The instant of a row of MeteoSwiss, written as digits alone or as 01.05.2026 12:00."""
    text = next((row[name] for _, name in _SWISS_HEADS if name in row), "").strip()
    match = re.fullmatch(r"(\d\d)\.(\d\d)\.(\d{4}) (\d\d):(\d\d)", text)
    return _digits("")({"": text if match is None else "".join(match.group(3, 2, 1, 4, 5))})


def _decimal_point(cell: str) -> str:
    return re.sub(r"^(-?\d+),(\d+)$", r"\1.\2", cell.strip())


def _need(*names: str) -> frozenset[str]:
    return frozenset(names)


_WEATHER_OF_BUOYS = {"ATMP": "air temperature [degC]", "PRES": "air pressure [hPa]", "BAR": "air pressure [hPa]"}
_SWISS_HEADS = (
    ("station_abbr", "reference_timestamp"),
    ("stn", "time"),
    ("abbr", "time"),
    ("Station/Location", "Date"),
)
"""Headings of the station and of the time in tables of MeteoSwiss."""
_SWISS = tuple(
    (f"{speed}{span}0", f"{away}{span}0", f"{speed}{span}1", unit)
    for speed, away, unit in (
        ("fkl010", "dkl010", "m/s"), ("fk1tow", "dv1tow", "m/s"),
        ("fu3010", "dkl010", "km/h"), ("fu3tow", "dv1tow", "km/h"),
    )
    for span in "zhd"
)  # fmt: skip
"""Headings of the wind's speed, its direction and its gust, and the unit of the speeds; m/s goes first."""
_NO_BUOY = frozenset({"99", "99.0", "99.00", "999", "999.0", "999.00", "9999", "9999.0", "MM"})
_BUOY = {
    "WSPD": "wind speed [m/s]", "WDIR": "wind direction [deg]", "WD": "wind direction [deg]", "GST": "gust [m/s]",
    "GDR": "gust direction [deg]", **_WEATHER_OF_BUOYS,
}  # fmt: skip
_MISSING_OF_BUOYS = {
    name: frozenset(code for code in _NO_BUOY if not heading.endswith("[deg]") or code.partition(".")[0] != "99")
    for name, heading in _BUOY.items()
}
"""99 is a direction as others are; a missing one is 999."""
_PUBLISHED = (
    _Published(
        about="NOAA NDBC's supplemental table of a buoy", needs=(_need("#YY", "MM", "DD", "hh", "WSPD", "WTIME"),),
        columns=_BUOY, stamp=_buoy, missing=_MISSING_OF_BUOYS,
        warning="WSPD of NDBC's supplemental table is not the mean wind: it is the highest wind of one minute, at the "
        "time of its column WTIME, and stands at the time of its row here",
    ),
    _Published(
        about="NOAA NDBC's table of a drifting buoy", needs=(_need("#YY", "MM", "DD", "hhmm", "WSPD", "WDIR"),),
        columns={**_BUOY, "LAT": "latitude", "LON": "longitude"}, stamp=_buoy,
        missing={**_MISSING_OF_BUOYS, **dict.fromkeys(("LAT", "LON"), frozenset({"MM"}))},
    ),
    _Published(
        about="NOAA NDBC's table of a buoy",
        needs=tuple(
            _need(year, "MM", "DD", "hh", "WSPD", away) for year in ("#YY", "YY", "YYYY") for away in ("WDIR", "WD")
        ),
        columns={"#STN": "station", **_BUOY}, stamp=_buoy, missing=_MISSING_OF_BUOYS,
    ),
    _Published(
        about="the Iowa Environmental Mesonet's table of airports",
        needs=(_need("station", "valid", "sped"),),
        columns={
            "station": "station", "valid": "time", "sped": "wind speed [mph]", "drct": "wind direction [deg]",
            "gust_mph": "gust [mph]", "tmpc": "air temperature [degC]", "relh": "relative humidity [%]",
        },
        missing=dict.fromkeys(("sped", "drct", "gust_mph", "tmpc", "relh"), frozenset({"M", "null", "None"})),
    ),
    _Published(
        about="DWD's hourly wind",
        needs=(_need("STATIONS_ID", "MESS_DATUM", "F", "D"),),
        columns={"STATIONS_ID": "station", "F": "wind speed [m/s]", "D": "wind direction [deg]"},
        stamp=_digits("MESS_DATUM"),
    ),
    _Published(
        about="DWD's wind of 10 minutes",
        needs=(_need("STATIONS_ID", "MESS_DATUM", "FF_10", "DD_10"),),
        columns={"STATIONS_ID": "station", "FF_10": "wind speed [m/s]", "DD_10": "wind direction [deg]"},
        stamp=_dwd_ten_minutes,
    ),
    _Published(
        about="KNMI's hourly values",
        needs=(_need("YYYYMMDD", "HH", "DD", "FF"), _need("YYYYMMDD", "HH", "DD", "FH"),
               _need("STN", "YYYYMMDD", "H", "FH")),
        columns={
            "STN": "station", "FF": "wind speed [0.1 m/s]", "FH": "hourly mean wind speed [0.1 m/s]",
            "FX": "gust [0.1 m/s]", "DD": "wind direction [deg]",
        },
        stamp=_knmi, missing={"DD": frozenset({"0", "990"})},
    ),
    _Published(
        about="KNMI's daily values",
        needs=(_need("YYYYMMDD", "DDVEC", "FG"),),
        columns={
            "STN": "station", "FG": "daily mean wind speed [0.1 m/s]", "FXX": "gust [0.1 m/s]",
            "DDVEC": "wind direction [deg]",
        },
        stamp=_knmi, missing={"DDVEC": frozenset({"0", "990"})},
    ),
    _Published(
        about="Météo-France's SYNOP",
        needs=(_need("numer_sta", "date", "dd", "ff"),),
        columns={
            "numer_sta": "station", "ff": "wind speed [m/s]", "dd": "wind direction [deg]", "raf10": "gust [m/s]",
            "t": "air temperature [K]", "u": "relative humidity [%]", "pres": "air pressure [Pa]",
        },
        stamp=_digits("date"), missing=dict.fromkeys(("ff", "dd", "raf10", "t", "u", "pres"), frozenset({"mq"})),
    ),
    _Published(
        about="Météo-France's hourly data",
        needs=(_need("NUM_POSTE", "AAAAMMJJHH", "FF", "DD"), _need("POSTE", "DATE", "FF", "DD", "FXI")),
        columns={
            "POSTE": "station", "NUM_POSTE": "station", "FF": "wind speed [m/s]", "DD": "wind direction [deg]",
            "FXI": "gust [m/s]", "T": "air temperature [degC]", "U": "relative humidity [%]",
        },
        stamp=_digits("AAAAMMJJHH", "DATE", zone=""), zoned=False, clean=_pointed,
    ),
    _Published(
        about="Météo-France's daily values",
        needs=(_need("POSTE", "DATE", "FFM", "FXI"), _need("NUM_POSTE", "AAAAMMJJ", "FFM", "QFFM")),
        columns={
            "POSTE": "station", "NUM_POSTE": "station", "FFM": "wind speed [m/s]", "FXI": "gust [m/s]",
            "TM": "air temperature [degC]",
        },
        stamp=_digits("DATE", "AAAAMMJJ", zone=""), zoned=False, clean=_pointed,
    ),
    _Published(
        about="AEMET's observations",
        needs=(_need("idema", "fint", "vv", "dv"),),
        columns={
            "idema": "station", "vv": "wind speed [m/s]", "dv": "wind direction [deg]", "vmax": "gust [m/s]",
            "ta": "air temperature [degC]", "hr": "relative humidity [%]", "pres": "air pressure [hPa]",
            "fint": "time [UTC]",
        },
    ),
    _Published(
        about="AEMET's daily values",
        needs=(_need("fecha", "indicativo", "dir", "velmedia"),),
        columns={
            "fecha": "date", "indicativo": "station", "velmedia": "wind speed [m/s]", "racha": "gust [m/s]",
            "dir": "direction of the gust [10 deg]",
        },
        missing={"dir": frozenset({"99", "88"})}, clean=_decimal_point,
    ),
    *(
        _Published(
            about="MeteoSwiss's table of stations",
            needs=tuple(_need(station, time, speed) for station, time in _SWISS_HEADS),
            columns={
                **{station: "station" for station, _ in _SWISS_HEADS}, speed: f"wind speed [{unit}]",
                away: "wind direction [deg]", gust: f"gust [{unit}]", "tre200s0": "air temperature [degC]",
                "ure200s0": "relative humidity [%]", "prestas0": "air pressure [hPa]",
            },
            stamp=_swiss,
        )
        for speed, away, gust, unit in _SWISS
    ),
    _Published(
        about="Meteostat's hourly data",
        needs=(_need("temp", "dwpt", "rhum", "wdir", "wspd", "pres"),),
        columns={
            "wspd": "wind speed [km/h]", "wpgt": "gust [km/h]", "wdir": "wind direction [deg]",
            "temp": "air temperature [degC]", "rhum": "relative humidity [%]",
        },
        whole=True,
    ),
)  # fmt: skip
_DATES = frozenset(
    {
        "#YY", "YY", "YYYY", "MM", "DD", "hh", "mm", "hhmm", "MESS_DATUM", "YYYYMMDD", "HH", "H", "date", "AAAAMMJJHH",
        "AAAAMMJJ", "DATE", "eor", "reference_timestamp", "time", "Date",
    }
)  # fmt: skip
_NAMED = 40
"""Columns that are named where they are left out."""
_US_UNITS = {"1": ("mph", "degF", "inHg"), "16": ("km/h", "degC", "hPa"), "17": ("m/s", "degC", "hPa")}
_WEEWX = _need("dateTime", "usUnits", "windSpeed")


@dataclass(frozen=True, kw_only=True)
class _Found:
    kind: _Published
    names: tuple[str, ...]
    delimiter: str
    line: int


def matches(lines: Sequence[str]) -> bool:
    """A line of headings that only one of these tables has."""
    return _find(lines) is not None


def as_table(source: TextFile) -> TableText | None:
    """The table with unit and zone in its headings; `None` for rows whose own column states different units."""
    found = _find(source.head(LOOKED_AT))
    if found is None:
        return None
    kind = found.kind
    taken = [name for name in found.names if name and (name in kind.columns or kind.whole)]
    heading = [] if kind.stamp is None else ["time [UTC]" if kind.zoned else "time"]
    heading += [kind.columns.get(name, name) for name in taken]
    other = [0]
    rows = list(_rows(source, found, taken, other))
    left = [name for name in found.names if name and name not in taken and name not in _DATES]
    what = (
        f"{kind.about}; {len(left)} of its columns are left out, among them {', '.join(left[:_NAMED])}"
        if left
        else kind.about
    )
    stated = table(source, heading, rows, kind="published-table", what=what, left_out=other[0])
    if stated is None or not kind.warning:
        return stated
    warning = Finding(kind="highest-wind", severity=Severity.WARNING, what=kind.warning)
    return TableText.of(stated, stated.text, [warning])


def _rows(source: TextFile, found: _Found, taken: Sequence[str], other: list[int]) -> Iterator[list[str]]:
    kind = found.kind
    for first, lines in source.blocks():
        for cells in _cells(lines[max(0, found.line + 1 - first + 1) :], found.delimiter):
            row = dict(zip(found.names, cells, strict=False))
            stamp = kind.stamp(row) if kind.stamp is not None else ""
            if (kind.stamp is not None and not stamp) or any(name not in row for name in taken[:1]):
                other[0] += bool(cells) and not cells[0].lstrip().startswith("#")
                continue
            own = [
                "" if row.get(name, "").strip() in kind.missing.get(name, ()) else kind.clean(row.get(name, ""))
                for name in taken
            ]
            yield [*([stamp] if kind.stamp is not None else []), *own]


def _cells(lines: Sequence[str], delimiter: str) -> Iterator[list[str]]:
    if delimiter == " ":
        yield from (line.split() for line in lines)
    else:
        yield from csv.reader(lines, delimiter=delimiter)


def _find(lines: Sequence[str]) -> _Found | None:
    for number, line in enumerate(lines):
        for delimiter in (*SIGNS, BLANKS):
            cells = next(_cells([line.lstrip("\ufeff")], delimiter), [])
            names = tuple(cell.strip().strip('"') for cell in cells)
            if names and names[0].startswith("# "):
                names = (names[0][2:].strip(), *names[1:])
            if len(names) < 3 or len(set(names)) < len(names) - names.count("") - 3:
                continue
            held = set(names)
            if held >= _WEEWX:
                return _weewx(lines, number, names, delimiter)
            kind = next((kind for kind in _PUBLISHED if any(need <= held for need in kind.needs)), None)
            if kind is not None:
                return _Found(kind=kind, names=names, delimiter=delimiter, line=number)
    return None


def _weewx(lines: Sequence[str], number: int, names: tuple[str, ...], delimiter: str) -> _Found | None:
    """An archive of WeeWX or wview in the units that its own column states, if all rows looked at state the same."""
    at = names.index("usUnits")
    stated = {cells[at].strip() for cells in _cells(lines[number + 1 :], delimiter) if len(cells) > at}
    units = _US_UNITS.get(next(iter(stated))) if len(stated) == 1 else None
    if units is None:
        return None
    speed, warm, pressed = units
    kind = _Published(
        about=f"an archive of WeeWX or wview with usUnits {next(iter(stated))}", needs=(_WEEWX,), whole=True,
        columns={
            "windSpeed": f"windSpeed [{speed}]", "windGust": f"windGust [{speed}]", "windDir": "windDir [deg]",
            "windGustDir": "windGustDir [deg]", "outTemp": f"outTemp [{warm}]", "pressure": f"pressure [{pressed}]",
            "outHumidity": "outHumidity [%]", "barometer": f"sea level pressure [{pressed}]",
            "altimeter": f"sea level altimeter [{pressed}]", "dateTime": "dateTime [UTC]",
        },
    )  # fmt: skip
    return _Found(kind=kind, names=names, delimiter=delimiter, line=number)
