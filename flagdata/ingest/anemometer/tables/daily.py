"""Rows of whole days: dates without a time of day, and stamps that are all of midnight."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants.stamps import DAY
from flagdata.ingest.anemometer.words.hours import minute_of
from flagdata.timebase import NANOSECONDS

_LEAST = 3
"""Rows from which stamps that are all of midnight are those of days."""


def placed(
    wall: NDArray[np.int64], *, dates: bool, heading: str
) -> tuple[NDArray[np.int64], tuple[Finding, ...]]:  # fmt: skip
    """The stamps, put at the time of day that the heading gives, and what is said of rows of whole days.

    Args:
        wall: (n,) nanoseconds of the wall clock, or of UTC.
        dates: whether the stamps are dates without a time of day.
        heading: of the wind.
    """
    minute = minute_of(heading) if dates else None
    if minute is not None:
        what = (
            f"the stamps are dates without a time of day, and the heading {heading!r} gives one: each row is put at "
            f"{minute // 60:02d}:{minute % 60:02d}"
        )
        found = Finding(
            kind="time-of-heading", severity=Severity.WARNING, count=len(wall), what=what,
            fix="where the rows are means of days all the same, leave this log out: they are no wind at a flag",
        )  # fmt: skip
        return wall + minute * 60 * NANOSECONDS, (found,)
    if not dates and not _of_days(wall):
        return wall, ()
    days = round(float(np.median(np.abs(np.diff(wall)))) / DAY) if len(wall) > 1 else 1
    whole = "a whole day" if days <= 1 else f"the {days} days to the next"
    what = (
        f"the stamps are dates without a time of day: each row stands for {whole}, put at its midnight"
        if dates
        else f"the stamps are all of midnight, a day or more apart: each row likely stands for {whole}"
    )
    fix = "a mean of a day or more is no wind at a flag: if the logger keeps readings, export those with their times"
    return wall, (Finding(kind="dates-alone", severity=Severity.WARNING, count=len(wall), what=what, fix=fix),)


def _of_days(wall: NDArray[np.int64]) -> bool:
    """Whether stamps are all of midnight, and no two of a day."""
    return len(wall) >= _LEAST and not np.any(wall % DAY) and bool(np.all(np.abs(np.diff(wall)) >= DAY))
