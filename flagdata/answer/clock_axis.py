"""An axis of instants, with ticks at round clock times."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, tzinfo

import numpy as np

from flagdata.answer.charts import Axis
from flagdata.core.arrays import FloatArray, IntArray
from flagdata.timebase import NANOSECONDS

_STEPS = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 21600, 43200)
_DAY = 86400
_MOST = 8  # ticks


def seconds_of_day(instants: IntArray, origin: int, *, zone: tzinfo = UTC) -> FloatArray:
    """Converts instants [UTC ns] to what `clock_axis` counts: seconds since the midnight, in the
    zone, before `origin` [UTC ns]."""
    return (instants - _midnight(origin, zone)) / NANOSECONDS


def clock_axis(start: int, end: int, *, zone: tzinfo = UTC, name: str = "") -> Axis:
    """Returns an axis from one instant to another [UTC ns], in seconds since the midnight before
    the first.

    Args:
        zone: whose clock it shows.
        name: of the clock, before the date; empty where it goes without saying.
    """
    midnight = _midnight(start, zone)
    low, high = ((instant - midnight) / NANOSECONDS for instant in (start, end))
    step = next((one for one in _STEPS if (high - low) / one <= _MOST), None)
    if step is None:
        step = _DAY * max(1, round((high - low) / _DAY / _MOST))
    ticks = np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step
    day = datetime.fromtimestamp(midnight / NANOSECONDS, zone)
    pattern = "%m-%d" if step >= _DAY else "%H:%M" if step >= 60 else "%H:%M:%S"
    texts = [(day + timedelta(seconds=float(tick))).strftime(pattern) for tick in ticks]
    label = f"{name}, {day:%Y-%m-%d}" if name else f"{day:%Y-%m-%d}"
    return Axis(
        label=f"{label}, {day.tzname()}", limits=(low, high), ticks=ticks.tolist(), texts=texts
    )


def _midnight(instant: int, zone: tzinfo) -> int:
    at = datetime.fromtimestamp(instant / NANOSECONDS, zone)
    return round(at.replace(hour=0, minute=0, second=0, microsecond=0).timestamp()) * NANOSECONDS
