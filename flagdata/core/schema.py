"""The one table of channels and the one schema of the catalog. Everything that names a column reads
it here.

A channel is a measured or simulated quantity with one name and one unit. A catalog row is an
artifact: an immutable object, or a slice of one (a clip of a recording). Changing this file changes
`FORMAT_VERSION`; data written by older versions stays readable (tests/compat).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag, StrEnum
from typing import Any

import pyarrow as pa

FORMAT_VERSION = 3


@dataclass(frozen=True, kw_only=True)
class Channel:
    """A quantity: dimensions in order, SI unit, and the frame or convention it is expressed in."""

    dims: tuple[str, ...]
    unit: str
    frame: str
    about: str


CHANNELS: dict[str, Channel] = {
    "wind_speed": Channel(
        dims=("time",), unit="m/s", frame="horizontal", about="speed of the air over ground"
    ),
    "wind_direction": Channel(
        dims=("time",),
        unit="rad",
        frame="from, clockwise from true north",
        about="where the wind blows from",
    ),
    "wind_direction_magnetic": Channel(
        dims=("time",),
        unit="rad",
        frame="from, clockwise from magnetic north",
        about="where the wind blows from",
    ),
    "apparent_wind_speed": Channel(
        dims=("time",),
        unit="m/s",
        frame="moving platform",
        about="speed of the air past a moving platform",
    ),
    "apparent_wind_direction": Channel(
        dims=("time",),
        unit="rad",
        frame="from, clockwise from the platform's bow",
        about="apparent wind angle",
    ),
    "theoretical_wind_speed": Channel(
        dims=("time",),
        unit="m/s",
        frame="moving platform",
        about="wind speed an instrument computed as if its moving platform stood still (NMEA "
        "MWV,T)",
    ),
    "theoretical_wind_direction": Channel(
        dims=("time",),
        unit="rad",
        frame="from, clockwise from the platform's bow",
        about="its direction",
    ),
    "wind_x": Channel(
        dims=("time",), unit="m/s", frame="sensor, towards +x", about="wind component of a sonic"
    ),
    "wind_y": Channel(
        dims=("time",), unit="m/s", frame="sensor, towards +y", about="wind component of a sonic"
    ),
    "wind_z": Channel(dims=("time",), unit="m/s", frame="sensor, upwards", about="vertical wind"),
    "sonic_temperature": Channel(
        dims=("time",),
        unit="K",
        frame="",
        about="temperature from the speed of sound; above the air's where it is moist",
    ),
    "air_temperature": Channel(dims=("time",), unit="K", frame="", about="air temperature"),
    "air_pressure": Channel(
        dims=("time",), unit="Pa", frame="station", about="static pressure at the sensor"
    ),
    "relative_humidity": Channel(
        dims=("time",), unit="1", frame="", about="relative humidity, 0 to 1"
    ),
    "platform_speed": Channel(
        dims=("time",), unit="m/s", frame="over ground", about="speed of a moving platform"
    ),
    "platform_heading": Channel(
        dims=("time",),
        unit="rad",
        frame="clockwise from true north",
        about="heading of a moving platform",
    ),
    "wind_speed_estimate": Channel(
        dims=("time",),
        unit="m/s",
        frame="horizontal",
        about="wind speed someone derived from a tracked flag: no reading",
    ),
    "tracked_rms": Channel(
        dims=("time",), unit="px", frame="image", about="RMS displacement of tracked points"
    ),
    "tracked_points": Channel(
        dims=("time",), unit="1", frame="image", about="number of points tracked"
    ),
    "tracking_quality": Channel(
        dims=("time",), unit="1", frame="image", about="the tracker's own confidence, 0 to 1"
    ),
    "flutter_frequency": Channel(
        dims=("time",), unit="Hz", frame="", about="main frequency of a tracked flag's motion"
    ),
    "deflection_angle": Channel(
        dims=("time",), unit="rad", frame="image", about="mean angle of a tracked flag"
    ),
    "image": Channel(
        dims=("time", "height", "width"),
        unit="1",
        frame="y down, x right",
        about="8-bit gray frames",
    ),
    "positions": Channel(
        dims=("time", "vertex", "xyz"), unit="m", frame="right-handed, z up", about="mesh vertices"
    ),
    "faces": Channel(
        dims=("face", "corner"), unit="1", frame="counter-clockwise front", about="vertex indices"
    ),
    "rest": Channel(
        dims=("vertex", "uv"),
        unit="m",
        frame="material",
        about="rest shape in material coordinates",
    ),
}

# Instants are int64 UTC nanoseconds on the axis "time"; everywhere, without suffix.
FRAME_SIZE = 300
FRAME_RATE = 25.0
CLIP_FRAMES = 30
TRUTH_WINDOW = 60.0  # s, the mean before a clip's end that is its ground truth


class SampleFlag(IntFlag):
    """What is known to be wrong with one wind sample. Flagged samples are kept; averages leave out
    `UNUSABLE`."""

    OK = 0
    STALE = 1
    """An exact repeat, longer than the sensor's resolution explains."""
    DEAD_ZONE = 2
    """Below the speed at which the sensor starts to turn or to resolve."""
    OUT_OF_RANGE = 4
    """Outside the sensor's declared range, or physically impossible (negative speed)."""
    MISSING = 8
    """The row was there, the value was not (empty, NaN, a missing-data code)."""
    SENSOR_FAULT = 16
    """The instrument's own diagnostic says so."""
    TIME_UNSURE = 32
    """The time stamp was repaired or interpolated (see the report)."""
    ALIASED = 64
    """A frequency at the Nyquist limit of the frames it was found in: it may be another one."""

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """Count as a plain integer beside an array, which then keeps its type of 16 bits.

        NumPy 2 takes a subclass of int for a 64-bit value, and refuses to put the result back into
        the array.
        """
        plain = [int(value) if isinstance(value, SampleFlag) else value for value in inputs]
        return getattr(ufunc, method)(*plain, **options)


UNUSABLE = SampleFlag.STALE | SampleFlag.OUT_OF_RANGE | SampleFlag.MISSING | SampleFlag.SENSOR_FAULT


class Kind(StrEnum):
    """What a catalog row is."""

    CAMERA = "camera"
    """One camera file on its own clock, resampled and cropped; an MCAP object."""
    WIND = "wind"
    """One anemometer log on its own clock; an MCAP object."""
    RECORDING = "recording"
    """Frames and wind on one clock; an MCAP object whose parents are a camera and a wind
    artifact."""
    CLIP = "clip"
    """Consecutive frames of a recording with their ground truth; a slice of the recording's
    object."""
    MESHES = "meshes"
    """A mesh sequence; a Zarr object."""
    MARKERS = "markers"
    """Tracked points of a cloth; a Zarr object."""
    MODEL = "model"
    """A recipe of a simulation that a closed loop left."""
    NETWORK = "network"
    """A trained network: weights and card; a folder of the store of models. Since format 2."""
    MEASUREMENT = "measurement"


@dataclass(frozen=True, kw_only=True)
class Field:
    """One column of the catalog."""

    type: pa.DataType
    about: str
    unit: str = ""
    nullable: bool = True
    since: int = 1
    """The format version that introduced the column; older rows read as null."""


CATALOG: dict[str, Field] = {
    "artifact": Field(
        type=pa.string(),
        nullable=False,
        about="identity: a hash of what went in, see lake.Artifact",
    ),
    "kind": Field(type=pa.string(), nullable=False, about="one of schema.Kind"),
    "name": Field(type=pa.string(), nullable=False, about="what people call it; not unique"),
    "branch": Field(type=pa.string(), nullable=False, about="the branch the row was committed on"),
    "object": Field(type=pa.string(), about="mcap/<sha256> or zarr/<treehash>"),
    "object_bytes": Field(type=pa.int64(), unit="B", about="size of the object"),
    "source_hash": Field(type=pa.string(), about="SHA-256 of the file that was ingested"),
    "source_name": Field(type=pa.string(), about="base name of the file that was ingested"),
    "parents": Field(
        type=pa.list_(pa.string()), nullable=False, about="artifacts this one was made from"
    ),
    "recipe": Field(type=pa.string(), about="all options that shaped it, canonical JSON"),
    "recipe_hash": Field(type=pa.string(), nullable=False, about="SHA-256 of the recipe"),
    "code_version": Field(type=pa.string(), nullable=False, about="package version and commit"),
    "format_version": Field(type=pa.int32(), nullable=False, about="FORMAT_VERSION at writing"),
    "seed": Field(type=pa.int64(), about="root seed of a simulated artifact"),
    "created": Field(
        type=pa.timestamp("us", tz="UTC"), nullable=False, about="when it was committed"
    ),
    "recording": Field(type=pa.string(), about="artifact of the recording a clip belongs to"),
    "session": Field(
        type=pa.string(), about="one set-up at one place; never on two sides of a split"
    ),
    "dataset": Field(
        type=pa.string(), since=3, about="data set that a film and its clips were built for"
    ),
    "side": Field(
        type=pa.string(), since=3, about="side of that data set: train, validation or test"
    ),
    "day": Field(
        type=pa.string(),
        about="calendar day (ISO, UTC) of the start; never on two sides of a split",
    ),
    "start": Field(type=pa.int64(), unit="ns", about="first instant, UTC"),
    "end": Field(type=pa.int64(), unit="ns", about="last instant, UTC"),
    "frame_first": Field(type=pa.int64(), about="index of the first frame in the object"),
    "frame_count": Field(type=pa.int64(), about="number of frames"),
    "rate": Field(type=pa.float64(), unit="Hz", about="frame rate, or median sample rate"),
    "wind": Field(
        type=pa.float64(), unit="m/s", about="mean wind speed over the minute before the end"
    ),
    "wind_sigma": Field(type=pa.float64(), unit="m/s", about="standard uncertainty of that mean"),
    "wind_coverage": Field(
        type=pa.float64(), unit="1", about="share of the minute that usable samples cover"
    ),
    "wind_staleness": Field(
        type=pa.float64(), unit="s", about="age of the newest usable sample at the end"
    ),
    "clock_method": Field(type=pa.string(), about="stamps, given or estimated"),
    "clock_offset": Field(
        type=pa.float64(), unit="s", about="added to the camera's clock to reach the wind's"
    ),
    "clock_drift": Field(type=pa.float64(), unit="s/s", about="rate difference of the two clocks"),
    "clock_sigma": Field(
        type=pa.float64(), unit="s", about="standard uncertainty of the offset at mid-recording"
    ),
    "clock_model": Field(type=pa.string(), about="the whole clock model, JSON"),
    "parameters": Field(
        type=pa.string(), about="simulation or render parameters, canonical JSON object"
    ),
    "quality": Field(
        type=pa.list_(pa.string()),
        nullable=False,
        about="flags: machine-readable names of what is off",
    ),
    "report": Field(type=pa.string(), about="what was found, a JSON object with a list 'findings'"),
}


def catalog_schema() -> pa.Schema:
    """Builds the Arrow schema of the catalog, with units and descriptions as field metadata."""
    fields = [
        pa.field(name, f.type, nullable=f.nullable, metadata={"unit": f.unit, "about": f.about})
        for name, f in CATALOG.items()
    ]
    return pa.schema(fields, metadata={"flagdata.format_version": str(FORMAT_VERSION)})


# MCAP topics of a record; see flagdata/record.
TOPIC_IMAGE = "/camera/image"
TOPIC_WIND = "/wind/samples"
TOPIC_WIND_1HZ = "/wind/1hz"
TOPIC_TRUTH = "/truth/parameters"
