"""Zarr for xarray: frames, wind and its means of each artifact as one group, with units and
instants to the nanosecond.

Mesh sequences need no export: a store of the lake is a Zarr group that xarray opens where it lies.
Names of channels that the CF conventions have a standard name for carry it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import xarray

from flagdata.core.arrays import AnyArray, IntArray, UInt8Array
from flagdata.core.schema import CHANNELS, Kind
from flagdata.export.export_source import IDENTITY, TRUTH, Entry, ExportRows, label_units

_STANDARD = {
    "wind_speed": "wind_speed",
    "wind_direction": "wind_from_direction",
    "wind_z": "upward_air_velocity",
    "air_temperature": "air_temperature",
    "air_pressure": "air_pressure",
    "relative_humidity": "relative_humidity",
}
_AT_ONCE = 64
_TIME = {
    "units": "nanoseconds since 1970-01-01",
    "dtype": "int64",
    "calendar": "proleptic_gregorian",
}


@dataclass(frozen=True, kw_only=True)
class ZarrGroups:
    """Groups <artifact>.zarr, opened by `xarray.open_zarr`: whichever of frames, samples and means
    there are."""

    kinds: ClassVar[frozenset[Kind]] = frozenset(
        {Kind.CLIP, Kind.RECORDING, Kind.CAMERA, Kind.WIND}
    )

    def write(
        self, source: ExportRows, folder: Path, advance: Callable[[int], None]
    ) -> Mapping[str, Any]:
        for entry in source.entries():
            target = folder / f"{entry.key}.zarr"
            data = _numbers(entry)
            encoding = {name: _TIME for name in data.variables if data[name].dtype.kind == "M"}
            data.to_zarr(target, mode="w-", encoding=encoding, consolidated=False)
            for first, images in zip(
                range(0, entry.count, _AT_ONCE), entry.images(_AT_ONCE), strict=True
            ):
                part = _frames(images, data.attrs)
                if first:
                    part.to_zarr(target, append_dim="frame", consolidated=False)
                else:
                    size = (min(_AT_ONCE, entry.count), *images.shape[1:])
                    part.to_zarr(
                        target, mode="a", encoding={"image": {"chunks": size}}, consolidated=False
                    )
            advance(1)
        return {"groups": len(source), "units": label_units()}


def _numbers(entry: Entry) -> xarray.Dataset:
    """Collects all but the pictures: samples along `time`, means over 1 s along `second`, instants
    along `frame_time`."""
    begin, end = entry.wind_span
    variables: dict[str, Any] = {}
    wind = entry.record.wind()
    if wind is not None:
        inside = (wind.time >= begin) & (wind.time <= end)
        variables["time"] = _instants(
            "time", wind.time[inside], "instant of a sample, common clock, UTC"
        )
        for name, values in wind.channels.items():
            about = CHANNELS[name]
            attributes = {"units": about.unit, "long_name": about.about, "comment": about.frame}
            attributes |= {"standard_name": _STANDARD[name]} if name in _STANDARD else {}
            variables[name] = ("time", values[inside], attributes)
        about_flags = {"long_name": "bits of flagdata.core.schema.SampleFlag"}
        variables["flags"] = ("time", wind.flags[inside], about_flags)
    means = entry.record.wind_1hz()
    if means is not None:
        inside = (means.time >= begin) & (means.time <= end)
        variables["second"] = _instants(
            "second", means.time[inside], "end of a second, common clock, UTC"
        )
        for name, unit in (("speed", "m/s"), ("sigma", "m/s"), ("direction", "rad")):
            values = getattr(means, name)[inside]
            variables[f"mean_{name}"] = (
                "second",
                values,
                {"units": unit, "long_name": f"{name} of the mean over 1 s"},
            )
    if entry.count:
        variables["frame_time"] = _instants(
            "frame_time", entry.frame_times, "instant of a frame, common clock, UTC"
        )
        about_device = "instant of a frame, the camera's own clock, UTC"
        variables["device_time"] = _instants("frame_time", entry.device_frame_times, about_device)
    label = entry.label()
    plain_values = {
        name: label[name]
        for name in (*IDENTITY, *TRUTH)
        if isinstance(label[name], str | int | float)
    }
    text = json.dumps(label, sort_keys=True, allow_nan=False, ensure_ascii=False)
    return xarray.Dataset(
        variables,
        attrs={**plain_values, "units": json.dumps(label_units()), "flagdata_label": text},
    )


def _frames(images: UInt8Array, attributes: Mapping[Any, Any]) -> xarray.Dataset:
    about = {"units": "1", "long_name": CHANNELS["image"].about, "comment": CHANNELS["image"].frame}
    return xarray.Dataset(
        {"image": (("frame", "height", "width"), images, about)}, attrs=attributes
    )


def _instants(dimension: str, times: IntArray, about: str) -> tuple[str, AnyArray, dict[str, str]]:
    return dimension, times.astype("datetime64[ns]"), {"long_name": about}
