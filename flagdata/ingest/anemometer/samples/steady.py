"""Speeds that vary less than any wind outdoors: of a wind tunnel, or of another quantity under a wind's name.

The turbulence intensity, the standard deviation of the speed by its mean, is some hundredths over a calm sea and a
tenth or more over land; means of ten minutes and more vary by as much with the weather. A wind tunnel's is below one
hundredth. A pressure, a temperature in K or a humidity of some hours varies as little.
"""

from __future__ import annotations

import numpy as np

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.reading import Reading
from flagdata.schema import UNUSABLE
from flagdata.timebase import NANOSECONDS

_INTENSITY = 0.02
"""Standard deviation by the mean, below which no wind outdoors is over `_SPAN`."""
_ROWS, _SPAN, _SLOWEST = 20, 600.0, 1.0
"""Readings, seconds and mean speed [m/s] from which on a speed is judged."""


def report(reading: Reading) -> tuple[Finding, ...]:
    """A note of a speed that is too steady for a wind outdoors; nothing where it is calm, short or varies."""
    speed = reading.channels.get("wind_speed")
    if speed is None:
        return ()
    known = np.isfinite(speed) & ((reading.flags & UNUSABLE) == 0)
    values, time = speed[known], reading.time[known]
    if len(values) < _ROWS or float(np.ptp(time)) < _SPAN * NANOSECONDS or float(values.mean()) < _SLOWEST:
        return ()
    intensity = float(values.std() / values.mean())
    if intensity >= _INTENSITY:
        return ()
    what = (
        f"the speed varies by {100 * intensity:.2g} % about its mean of {values.mean():.3g} m/s: as steady as in a "
        "wind tunnel, and steadier than wind outdoors; if it was outdoors, the column is likely another quantity"
    )
    return (Finding(kind="steady-wind", severity=Severity.NOTE, value=intensity, what=what),)
