"""netCDF files that keep the CF conventions, read through xarray: wind by its standard names, as a table of text.

Source: CF standard name table (wind_speed, wind_from_direction, wind_to_direction, eastward_wind, northward_wind).
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.errors import InputError, LimitError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.containers.cf_time import NOT_A_TIME, instants, is_time
from flagdata.ingest.anemometer.options import Limits
from flagdata.ingest.anemometer.text.source import TableText
from flagdata.timebase import iso
from flagdata.units import UNITS, spelled

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
    """The variables of one point over time that have standard names of wind.

    Raises:
        InputError: no time, no wind, several points, or a file that xarray cannot read.
        LimitError: more instants than `limits` allow.
    """
    where = str(path)
    xarray: Any = importlib.import_module("xarray")
    with path.open("rb") as stream:  # opened here: scipy leaves a damaged file open
        if stream.read(4) == _HDF and not {"h5netcdf", "netcdf4"} & set(xarray.backends.list_engines()):
            what = "this is netCDF-4 or another HDF5 file, and no library that reads it is installed"
            fix = "pip install h5netcdf; or convert it, nccopy -k classic FILE OTHER.nc; or export it as CSV"
            raise InputError(what, where=where, fix=fix)
        stream.seek(0)
        try:
            raw = xarray.open_dataset(stream, decode_cf=False)
            data = xarray.decode_cf(raw, decode_times=False).squeeze()
        except Exception as error:  # noqa: BLE001 - a damaged file makes its libraries raise anything
            what = f"this netCDF or HDF5 file cannot be read: {type(error).__name__}"
            raise InputError(what, where=where, fix="copy it again, or export it as CSV") from None
        with raw:
            return _table(data, raw, path, limits)


def _table(data: Any, raw: Any, path: Path, limits: Limits) -> TableText:
    """The lines of a data set; the times of `raw`, as they are stored."""
    where = str(path)
    time = next((name for name, axis in data.coords.items() if axis.ndim == 1 and is_time(raw[name].attrs)), None)
    if time is None:
        raise InputError("no axis of time by the CF conventions", where=where, fix="export the readings as CSV")
    if data.sizes[time] > limits.rows:
        raise LimitError(f"more than {limits.rows} instants", where=where, fix="split the file")
    columns: dict[str, Any] = {}
    left: list[str] = []
    for variable in data.data_vars.values():
        standard = variable.attrs.get("standard_name", "")
        channel, unit = _STANDARD.get(standard), spelled(variable.attrs.get("units", ""))
        if channel is None or unit is None or variable.dims != (time,):
            left.append(repr(variable.name))
            continue
        heading = f"{channel} ({unit})"
        if heading in columns:
            fix = "select one height or place (xarray, ncks), and ingest that"
            raise InputError(f"several variables are {channel}", where=where, fix=fix)
        values = np.asarray(variable.values, dtype=np.float64)
        half = float(UNITS[unit].from_si(np.pi)) if standard == "wind_to_direction" else 0.0
        columns[heading] = (values + half) % (2 * half) if half else values
    if not any("wind" in heading for heading in columns):
        fix = "give the variables of wind their standard names and one dimension, time; or export them as CSV"
        raise InputError("no variable of wind along time alone", where=where, fix=fix)
    stamps, found = instants(raw[time].squeeze().values, raw[time].attrs, where=f"{where}, variable {time}")
    rows = zip(stamps.tolist(), *(values.tolist() for values in columns.values()), strict=True)
    lines = [",".join(["time", *columns])]
    lines += [
        ",".join(["" if stamp == NOT_A_TIME else iso(stamp), *("" if value != value else repr(value) for value in row)])
        for stamp, *row in rows
    ]
    what = f"variables that are not read: {', '.join(left)}"
    found = (*found, Finding(kind="columns-not-read", severity=Severity.NOTE, what=what)) if left else found
    return TableText(path=path, encoding="utf-8", lines=len(lines), findings=found, text=tuple(lines))
