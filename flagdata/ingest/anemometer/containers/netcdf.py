"""netCDF files that keep the CF conventions, read through xarray: wind by its standard names, as a
table of text.

Source: CF standard name table (wind_speed, wind_from_direction, wind_to_direction, eastward_wind,
northward_wind).

Times of a netCDF file by the CF conventions: numbers of a unit since a date, as UTC nanoseconds.

Source: CF conventions 1.12, section 4.4; UDUNITS for the writing of the date and its zone, which is
UTC where it has none. Whole numbers stay exact. Calendars of models, and units of no fixed length,
have no instants: they are refused.
"""

from __future__ import annotations

import datetime as dt
import importlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.arrays import AnyArray, IntArray
from flagdata.core.findings import Finding
from flagdata.core.units import UNITS, name_of_unit
from flagdata.errors import InputError, LimitError, TimeError
from flagdata.ingest.anemometer.instants.stamp_text import DAY, HOUR, snap_to_grid
from flagdata.ingest.anemometer.text.text_file import TableText
from flagdata.ingest.anemometer.wind_options import Limits
from flagdata.timebase import NANOSECONDS, from_datetime, iso

_UNITS = {
    "nanosecond": 1,
    "nsec": 1,
    "ns": 1,
    "microsecond": 1_000,
    "microsec": 1_000,
    "usec": 1_000,
    "us": 1_000,
    "millisecond": 1_000_000,
    "millisec": 1_000_000,
    "msec": 1_000_000,
    "ms": 1_000_000,
    "second": NANOSECONDS,
    "sec": NANOSECONDS,
    "s": NANOSECONDS,
    "minute": 60 * NANOSECONDS,
    "min": 60 * NANOSECONDS,
    "hour": HOUR,
    "hr": HOUR,
    "h": HOUR,
    "day": DAY,
    "d": DAY,
}
"""Nanoseconds of a unit; with an s behind it as well."""
_CALENDARS = ("standard", "gregorian", "proleptic_gregorian")
_SINCE = re.compile(r"\s*(?P<unit>\S+)\s+since\s+(?P<date>\S.*?)\s*", re.IGNORECASE)
_DATE = re.compile(
    r"(?P<Y>\d{1,4})-(?P<m>\d{1,2})-(?P<d>\d{1,2})"
    r"(?:(?:T|\s+)(?P<H>\d{1,2})(?::(?P<M>\d{1,2})(?::(?P<S>\d{1,2})(?:\.(?P<f>\d{0,9}))?)?)?)?"
    r"\s*(?:Z|UTC|GMT|(?P<sign>[+-]?)(?P<h>\d{1,2}):?(?P<min>\d{2})?)?",
    re.IGNORECASE,
)
_REFORM = dt.date(1582, 10, 15)
"""The first day of the Gregorian calendar; before it days of the calendar "standard" are Julian."""
_FIRST, _END = (np.datetime64(year, "ns").astype(np.int64) for year in ("1970", "2200"))
NOT_A_TIME = np.iinfo(np.int64).min


@dataclass(frozen=True, kw_only=True)
class Since:
    """The unit [ns] of a count, and the instant [UTC ns] of its zero."""

    unit: int
    zero: int


def is_time(attributes: Mapping[str, Any]) -> bool:
    """Checks whether a variable's units are those of a time since a date."""
    return _SINCE.fullmatch(str(attributes.get("units", ""))) is not None


def since(attributes: Mapping[str, Any], *, where: str) -> Since:
    """Reads the units and the calendar of a time.

    Raises:
        TimeError: a calendar that is not the one of clocks, a unit that is not known or of no fixed
            length, or a date that cannot be read.
    """
    units, calendar = str(attributes["units"]), str(attributes.get("calendar", "standard")).lower()
    if calendar not in _CALENDARS:
        message = (
            f"the times are of the calendar {calendar!r}, whose days are not those of clocks in UTC"
        )
        fix = (
            f"write them in one of the calendars {', '.join(_CALENDARS)}, or export the readings "
            "as CSV"
        )
        raise TimeError(message, where=where, fix=fix)
    match = _SINCE.fullmatch(units)
    unit = (
        _UNITS.get(name := match["unit"].lower()) or _UNITS.get(name.removesuffix("s"))
        if match
        else None
    )
    if match is None or unit is None:
        fix = "write the times in seconds, minutes, hours or days since a date"
        raise TimeError(
            f"the times are in {units!r}, whose unit is not known or has no fixed length",
            where=where,
            fix=fix,
        )
    date = _DATE.fullmatch(match["date"])
    fix = "write the date as in 'seconds since 2026-05-01 12:00:00 +00:00'"
    if date is None:
        raise TimeError(
            f"the times are in {units!r}, whose date cannot be read", where=where, fix=fix
        )
    offset = (int(date["h"] or 0) * 60 + int(date["min"] or 0)) * (-1 if date["sign"] == "-" else 1)
    try:
        parts = (int(date[name] or 0) for name in "YmdHMS")
        zone = dt.timezone(dt.timedelta(minutes=offset))
        zero = dt.datetime(*parts, tzinfo=zone)  # type: ignore[misc]
    except ValueError:
        raise TimeError(
            f"the times are in {units!r}, which is no date", where=where, fix=fix
        ) from None
    if calendar != "proleptic_gregorian" and zero.date() < _REFORM:
        message = (
            f"the times are in {units!r}: of days before {_REFORM} it does not say whether they "
            "are Julian"
        )
        raise TimeError(
            message,
            where=where,
            fix="state the calendar proleptic_gregorian, or write a later date",
        )
    return Since(
        unit=unit, zero=from_datetime(zero, nanosecond=int((date["f"] or "").ljust(9, "0")))
    )


def instants(
    values: AnyArray, attributes: Mapping[str, Any], *, where: str
) -> tuple[IntArray, tuple[Finding, ...]]:
    """Converts a variable as it is stored to (n,) UTC nanoseconds, `NOT_A_TIME` for missing ones
    and years beyond 1970 to 2199.

    Raises:
        TimeError: see `since`.
    """
    count = since(attributes, where=where)
    absent = np.zeros(len(values), dtype=bool)
    for name in ("_FillValue", "missing_value"):
        absent |= np.isin(values, np.atleast_1d(attributes[name])) if name in attributes else False
    scale, offset = (
        np.asarray(attributes.get(name, rest))
        for name, rest in (("scale_factor", 1), ("add_offset", 0))
    )
    packed = bool((scale != 1).any() or (offset != 0).any())
    numbers = values * scale.astype(np.float64) + offset.astype(np.float64) if packed else values
    with np.errstate(invalid="ignore", over="ignore"):
        about = numbers.astype(np.float64) * count.unit + count.zero
        absent |= ~((about > _FIRST) & (about < _END))
        counts = np.where(absent, 0, numbers)
        floors = np.floor(counts).astype(np.int64)
        rest = (
            np.zeros(len(values))
            if counts.dtype.kind in "iu"
            else np.round((counts - floors) * float(count.unit))
        )
        units, further = divmod(
            count.zero, count.unit
        )  # the nanoseconds from year 1 do not fit into 64 bits
        time = (floors + units) * count.unit + further + rest.astype(np.int64)
    findings: tuple[Finding, ...] = ()
    step = (
        float(np.spacing(np.abs(counts).max(initial=0))) * count.unit
        if counts.dtype.kind == "f"
        else 0.0
    )
    time = snap_to_grid(time, 1_000_000, round(step)) if step <= 1_000 else time
    if step > NANOSECONDS / 1000:
        message = (
            f"the times are numbers of {8 * counts.dtype.itemsize} bits, which are "
            f"{step / NANOSECONDS:.3g} s apart"
        )
        fix = "write them as numbers of 64 bits"
        findings = (Finding.of("coarse-stamps", message, value=step / NANOSECONDS, fix=fix),)
    return np.where(absent, NOT_A_TIME, time), findings


_HDF = b"\x89HDF"
_STANDARD = {
    "wind_speed": "wind_speed",
    "wind_from_direction": "wind_direction",
    "wind_to_direction": "wind_direction",
    "eastward_wind": "eastward wind",
    "northward_wind": "northward wind",
    "upward_air_velocity": "upward wind",
    "air_temperature": "air_temperature",
    "relative_humidity": "relative_humidity",
    "air_pressure": "air_pressure",
}


def open_dataset(path: Path, *, limits: Limits) -> TableText:
    """Reads the variables of one point over time that have standard names of wind.

    Raises:
        InputError: no time, no wind, several points, or a file that xarray cannot read.
        LimitError: more instants than `limits` allow.
    """
    where = str(path)
    xarray: Any = importlib.import_module("xarray")
    with path.open("rb") as stream:  # opened here: scipy leaves a damaged file open
        if stream.read(4) == _HDF and not {"h5netcdf", "netcdf4"} & set(
            xarray.backends.list_engines()
        ):
            message = (
                "this is netCDF-4 or another HDF5 file, and no library that reads it is installed"
            )
            fix = (
                "pip install h5netcdf; or convert it, nccopy -k classic FILE OTHER.nc; or export "
                "it as CSV"
            )
            raise InputError(message, where=where, fix=fix)
        stream.seek(0)
        try:
            raw = xarray.open_dataset(stream, decode_cf=False)
            data = xarray.decode_cf(raw, decode_times=False).squeeze()
        except Exception as error:  # noqa: BLE001 - libraries raise anything of a damaged file
            message = f"this netCDF or HDF5 file cannot be read: {type(error).__name__}"
            raise InputError(
                message, where=where, fix="copy it again, or export it as CSV"
            ) from None
        with raw:
            return _table(data, raw, path, limits)


def _table(data: Any, raw: Any, path: Path, limits: Limits) -> TableText:
    """Converts a data set to the lines of a table; the times are those of `raw`, as they are
    stored."""
    where = str(path)
    time = next(
        (name for name, axis in data.coords.items() if axis.ndim == 1 and is_time(raw[name].attrs)),
        None,
    )
    if time is None:
        raise InputError(
            "there is no axis of time by the CF conventions",
            where=where,
            fix="export the readings as CSV",
        )
    if data.sizes[time] > limits.rows:
        raise LimitError(
            f"there are more than {limits.rows} instants", where=where, fix="split the file"
        )
    columns: dict[str, Any] = {}
    unread: list[str] = []
    for variable in data.data_vars.values():
        standard = variable.attrs.get("standard_name", "")
        channel, unit = _STANDARD.get(standard), name_of_unit(variable.attrs.get("units", ""))
        if channel is None or unit is None or variable.dims != (time,):
            unread.append(repr(variable.name))
            continue
        heading = f"{channel} ({unit})"
        if heading in columns:
            fix = "select one height or place (xarray, ncks), and ingest that"
            raise InputError(f"several variables are {channel}", where=where, fix=fix)
        values = np.asarray(variable.values, dtype=np.float64)
        half = float(UNITS[unit].from_si(np.pi)) if standard == "wind_to_direction" else 0.0
        columns[heading] = (values + half) % (2 * half) if half else values
    if not any("wind" in heading for heading in columns):
        fix = (
            "give the variables of wind their CF standard names (wind_speed, wind_from_direction), "
            "units, and time as "
            "their only dimension; or export them as CSV"
        )
        raise InputError(
            "no variable of the file is a wind with a standard name, a known unit, and time as its "
            "only dimension",
            where=where,
            fix=fix,
        )
    stamps, findings = instants(
        raw[time].squeeze().values, raw[time].attrs, where=f"{where}, variable {time}"
    )
    rows = zip(stamps.tolist(), *(values.tolist() for values in columns.values()), strict=True)
    lines = [",".join(["time", *columns])]
    lines += [
        ",".join(
            [
                "" if stamp == NOT_A_TIME else iso(stamp),
                *("" if value != value else repr(value) for value in row),
            ]
        )
        for stamp, *row in rows
    ]
    message = f"variables that are not read: {', '.join(unread)}"
    findings = (*findings, Finding.of("columns-not-read", message)) if unread else findings
    return TableText(
        path=path, encoding="utf-8", lines=len(lines), findings=findings, text=tuple(lines)
    )
