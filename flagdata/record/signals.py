"""What ingest hands over: wind series and frame streams, on their devices' own clocks. Frozen,
checked, format-free."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray, IntArray, UInt8Array
from flagdata.core.findings import Finding
from flagdata.core.schema import CHANNELS
from flagdata.errors import InputError
from flagdata.recipes.typed_tables import NotNegative

Instants: TypeAlias = IntArray
Series: TypeAlias = FloatArray


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """An anemometer as its recipe (catalogs/sensors) describes it. SI; `None` where nobody knows.

    Attributes:
        height: of the sensor above ground [m].
        distance_constant: of a rotating sensor [m]; response time is distance_constant / speed.
        averaging: length of the instrument's own averaging before a sample [s].
        threshold: speed below which it reads zero or nothing [m/s].
        resolution: smallest step of the speed reading [m/s].
        accuracy: standard uncertainty of a speed reading: the larger of `accuracy` [m/s] and
            `accuracy_relative` × speed.
    """

    name: str
    height: NotNegative | None = None
    distance_constant: NotNegative | None = None
    averaging: NotNegative | None = None
    threshold: NotNegative | None = None
    resolution: NotNegative | None = None
    accuracy: NotNegative | None = None
    accuracy_relative: NotNegative | None = None

    @property
    def words(self) -> str:
        """Its name, and its height where that is known."""
        height = "" if self.height is None else f", {self.height:g} m above ground"
        return f"{self.name}{height}"


@dataclass(frozen=True, kw_only=True)
class WindSeries:
    """Samples of one anemometer at whatever rate they came, nothing filled in.

    Attributes:
        time: (n,) UTC nanoseconds on the device's clock, strictly increasing.
        channels: names of schema.CHANNELS → (n,) float64 in SI, NaN where missing.
        flags: (n,) bits of schema.SampleFlag.
        host_time: (n,) the logging computer's clock where the file has both, else `None`.
        sensor: the instrument.

    Raises:
        InputError: shapes that disagree, an unknown channel, or time that does not increase.
    """

    time: Instants
    channels: Mapping[str, Series]
    flags: NDArray[np.uint16]
    sensor: Sensor
    host_time: Instants | None = None

    def __post_init__(self) -> None:
        n = len(self.time)
        arrays = {"flags": self.flags, **self.channels}
        if self.host_time is not None:
            arrays["host_time"] = self.host_time
        for name, values in arrays.items():
            if len(values) != n:
                raise InputError(
                    f"{name} has {len(values)} values for {n} times",
                    fix="this is a defect of the reader",
                )
        for name in self.channels:
            if name not in CHANNELS:
                raise InputError(
                    f"channel {name!r} is not in schema.CHANNELS", fix="add it there with its unit"
                )
        if n > 1 and not bool(np.all(np.diff(self.time) > 0)):
            raise InputError(
                "time does not increase", fix="sort and report the disorder in the reader"
            )

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True, kw_only=True)
class WindAverage:
    """Wind speed averaged over equal bins (by default 1 s).

    Attributes:
        time: (n,) the END of each bin, UTC nanoseconds; bins with no usable sample are absent.
        speed: (n,) mean [m/s].
        sigma: (n,) standard uncertainty of the bin's mean [m/s]: scatter within the bin and the
            sensor's accuracy.
        direction: (n,) vector-mean direction [rad, from, clockwise from north], NaN where the
            source has none.
        count: (n,) usable samples in the bin.
        period: length of a bin [s].
    """

    time: Instants
    speed: Series
    sigma: Series
    direction: Series
    count: NDArray[np.int32]
    period: float


@dataclass(frozen=True, kw_only=True)
class Frame:
    """One frame.

    Attributes:
        time: mid-exposure on the camera's clock, UTC nanoseconds.
        image: (height, width) uint8 gray.
        stamp_error: distance of the source frame used from the instant asked for [s].
    """

    time: int
    image: UInt8Array
    stamp_error: float


@dataclass(frozen=True, kw_only=True)
class CameraInfo:
    """A camera file after its options are settled; all rates in Hz, sizes in pixels, `start` in UTC
    nanoseconds."""

    container: str
    codec: str
    width: int
    height: int
    container_rate: float
    true_rate: float
    variable_rate: bool
    rotation: int
    start: int
    start_from: str
    """Where the start time came from: "option", "metadata: creation_time", …"""
    duration: float
    crop: tuple[int, int, int, int]
    """x, y, width, height in the upright source image."""
    start_sigma: float | None = None
    """Standard uncertainty of reading `start` off the file [s], clock error apart; `None` where the
    user gave it."""


@dataclass(frozen=True, kw_only=True)
class LogRow:
    """A row of a log's text beside what was read of it.

    Attributes:
        line: its number in the text, from 1.
        text: as it is written.
        time: UTC nanoseconds.
        wind: for people, in m/s and degrees.
    """

    line: int
    text: str
    time: int
    wind: str


@dataclass(frozen=True, kw_only=True)
class WindLog:
    """What an anemometer reader returns: the series, what it found, and why it thinks the file is
    of this format.

    Attributes:
        plan: what was understood of the file, see `ingest.anemometer.log.understood`.
        drafted: the recipe (TOML) that was drafted from the file's own text, "" where it was read
            by another.
        stated: whether the file itself states all that a draft says, so that nothing of it is a
            guess.
        rows: of a draft that is one, some rows to judge it by.
    """

    series: WindSeries
    format: str
    findings: tuple[Finding, ...] = ()
    reasons: tuple[str, ...] = field(default=())
    plan: Mapping[str, Any] = field(default_factory=dict)
    drafted: str = ""
    stated: bool = False
    rows: tuple[LogRow, ...] = ()
