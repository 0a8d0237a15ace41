"""The metadata records of an MCAP record: names, and how a sensor is written into one and read
back."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from flagdata.errors import CorruptError
from flagdata.record.signals import CameraInfo, Sensor

SENSOR = "sensor"
CAMERA = "camera"
CLOCK = "clock"
PROVENANCE = "provenance"
UNITS = "units"
SALVAGE = "salvage"
SAMPLE = "sample"
"""Metadata record of a subset: the artifact it is, the object it was cut from, the frames before
the clip's own that H.264 needs, and its label as JSON."""
ROWS = "artifacts.parquet"
"""File beside exported records with the catalog's rows of what they hold, by which `flagdata
ingest` restores them."""


def sensor_metadata(sensor: Sensor) -> dict[str, str]:
    """Writes a sensor's known properties as text; numbers in SI, so that they read back exactly."""
    values = {field.name: getattr(sensor, field.name) for field in dataclasses.fields(sensor)}
    return {
        name: value if isinstance(value, str) else repr(value)
        for name, value in values.items()
        if value is not None
    }


def sensor_of(metadata: Mapping[str, Mapping[str, str]], *, where: str) -> Sensor:
    """Reads the sensor that `sensor_metadata` wrote.

    Raises:
        CorruptError: no such metadata, or a property that is not a number.
    """
    written = dict(metadata.get(SENSOR, {}))
    if "name" not in written:
        raise CorruptError(
            "the record has a wind without its sensor", where=where, fix="ingest the log again"
        )
    name = written.pop("name")
    names = {field.name for field in dataclasses.fields(Sensor)}
    try:
        numbers = {key: float(value) for key, value in written.items() if key in names}
    except ValueError as error:
        raise CorruptError(
            f"the sensor's metadata cannot be read: {error}",
            where=where,
            fix="ingest the log again",
        ) from None
    return Sensor(
        name=name,
        height=numbers.get("height"),
        distance_constant=numbers.get("distance_constant"),
        averaging=numbers.get("averaging"),
        threshold=numbers.get("threshold"),
        resolution=numbers.get("resolution"),
        accuracy=numbers.get("accuracy"),
        accuracy_relative=numbers.get("accuracy_relative"),
    )


def camera_metadata(info: CameraInfo) -> dict[str, str]:
    """Writes a camera's settled options as text; rates in Hz, sizes in pixels, `start` in UTC
    nanoseconds."""
    values = {field.name: getattr(info, field.name) for field in dataclasses.fields(info)}
    return {
        name: ",".join(map(str, value)) if isinstance(value, tuple) else str(value)
        for name, value in values.items()
        if value is not None
    }
