"""Horizontal wind from the components of a sonic anemometer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flagdata.errors import UsageError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.reading import Reading


def with_horizontal(reading: Reading, azimuth: float | None, *, where: str) -> Reading:
    """Add `wind_speed` = √(x² + y²), and with the azimuth `wind_direction`, where a log has components alone.

    The azimuth is the compass direction the array points to, against +x: wind along +x comes from there. With +z up, +y
    is 90° to the left of +x, so that the wind comes from azimuth - atan2(y, x) (Campbell Scientific, CSAT3 manual,
    appendix "Orientation").

    Args:
        azimuth: [rad, clockwise from true north]; `None` where nobody knows: no direction then.

    Raises:
        UsageError: an azimuth for a log without components.
    """
    channels = reading.channels
    if not {"wind_x", "wind_y"} <= set(channels) or "wind_speed" in channels:
        if azimuth is not None:
            raise UsageError(
                "an azimuth was given, but the log has no wind components", where=where,
                fix="leave out --azimuth; a turned vane is a rotation in the recipe",
            )  # fmt: skip
        return reading
    x, y = channels["wind_x"], channels["wind_y"]
    added = {"wind_speed": np.hypot(x, y)}
    text = "wind_speed is √(wind_x² + wind_y²)"
    fix = None
    if azimuth is None:
        text += "; no direction, since the sensor's azimuth is not known"
        fix = "give the sensor's azimuth for a direction: --azimuth DEG (270 for x to the east, y to the north)"
    else:
        towards = np.mod(azimuth - np.arctan2(y, x), 2 * np.pi)
        added["wind_direction"] = np.where(added["wind_speed"] == 0, np.nan, towards)  # calm air comes from nowhere
        text += f", wind_direction is from the azimuth {np.degrees(azimuth):.1f}° given"
    finding = Finding(kind="speed-from-components", severity=Severity.NOTE, count=len(x), what=text, fix=fix)
    return replace(reading, channels={**channels, **added}, findings=(*reading.findings, finding))
