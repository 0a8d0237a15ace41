"""What a channel can hold in this world: values beyond are no measurement, whatever the instrument's own range.

Bounds lie outside the records of the World Meteorological Organization (World Weather and Climate Extremes Archive:
gust 113 m/s, air -89.2 to 56.7 °C) and of station pressure on land (about 31 kPa on the highest summit, 108 kPa at the
lowest shore), with room for wind tunnels, sensors in the sun and humidity sensors that overshoot. A recipe's `range`
narrows them. That a speed cannot be negative is a check of its own, since a zero offset may explain it
(`quality.negative`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.reading import WIND_CHANNELS, Reading
from flagdata.schema import CHANNELS, SampleFlag

FASTEST = 150.0
"""Largest speed, or component, of air near the ground [m/s]."""
TURNS = (-math.pi, 2 * math.pi)
"""Directions as instruments write them, signed or not [rad]; beyond, the cell is a code or another quantity."""
POSSIBLE: Mapping[str, tuple[float, float]] = {
    **dict.fromkeys(sorted(WIND_CHANNELS), (-FASTEST, FASTEST)),
    "sonic_temperature": (170.0, 370.0),
    "air_temperature": (170.0, 350.0),
    "air_pressure": (30_000.0, 115_000.0),
    "relative_humidity": (-0.05, 1.1),
}
"""Smallest and largest possible value [SI]."""


def impossible(reading: Reading) -> Reading:
    """Flag impossible winds OUT_OF_RANGE and report them; impossible values of other channels are left out (NaN).

    The flags of a sample speak of its wind: one absurd temperature does not make the wind beside it unusable.
    """
    flags = reading.flags.copy()
    channels = dict(reading.channels)
    found: list[Finding] = []
    for name, (low, high) in POSSIBLE.items():
        if name not in channels:
            continue
        beyond = (channels[name] < low) | (channels[name] > high)
        if name in WIND_CHANNELS:
            known = beyond & ((flags & SampleFlag.OUT_OF_RANGE) != 0)
            flags[beyond] |= SampleFlag.OUT_OF_RANGE
            beyond &= ~known
        else:
            channels[name] = np.where(beyond, np.nan, channels[name])
        found.extend(report(name, beyond, reading.line, bounds=f"{low:g} to {high:g} {CHANNELS[name].unit}"))
    return replace(reading, channels=channels).with_findings(tuple(found), flags=flags)


def direction(
    name: str, angle: NDArray[np.float64], line: NDArray[np.int64], *, offset: float = 0.0
) -> tuple[NDArray[np.float64], tuple[Finding, ...]]:
    """Angles with those left out (NaN) that no instrument writes: -180° to 360° is possible.

    Args:
        angle: (n,) as written [rad], not yet wrapped.
        line: (n,) their lines.
        offset: [rad] that a recipe added to turn the vane: the angle is possible with or without it.
    """
    slack = 1e-6  # rad, for conversion from degrees
    low, high = TURNS[0] - slack, TURNS[1] + slack
    bare = angle - offset
    beyond = ((angle < low) | (angle > high)) & ((bare < low) | (bare > high))
    return np.where(beyond, np.nan, angle), report(name, beyond, line, bounds="-180° to 360°")


def report(name: str, beyond: NDArray[np.bool_], line: NDArray[np.int64], *, bounds: str) -> tuple[Finding, ...]:
    """The finding about the values of one channel that are impossible; none where there are none."""
    count = int(beyond.sum())
    if count == 0:
        return ()
    values = "value" if count == 1 else "values"
    return (
        Finding(
            kind="out-of-range", severity=Severity.WARNING, count=count, where=f"line {line[beyond][0]}",
            what=f"{count} impossible {values} of {name}, outside {bounds}; left out of averages",
            fix="check the recipe's columns and units; a code for no value belongs into its [file] missing",
        ),
    )  # fmt: skip
