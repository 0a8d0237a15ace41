"""Columns below a heading of the wind that only grow: the distance that the wind has run, which is no speed.

Stations of agriculture and of fire services count the air's way past the instrument from midnight on ("wind run"). A
speed falls about as often as it rises: that m changes in a row are all rises has a probability of the order of 2⁻ᵐ.

Other tables sum the wind until its direction changes, hours or rows, and begin anew with the next reading: then too
most changes are rises, and each fall ends at once among the numbers that are added.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flagdata.findings import Finding, Severity

_LEAST = 20
"""Values that change, below which nothing is said."""
_FALLS = 0.05
"""Largest share of falls among the changes, those to the beginning of a new count."""
_NEW = 0.2
"""A new count begins at this share of where the last one ended, at most."""
_GROWN = 4.0
"""A count ends at so many times its median rise or more; a speed that is raised step by step does not get there."""
_RISES = 0.7
"""Least share of rises among the changes of a sum."""
_HIGH = 6.0
"""Times the median rise that a sum has reached before one fall at least."""
WHAT = "its values only grow, but for falls to near 0: the distance that the wind has run, or another count"


def grows(values: NDArray[np.float64]) -> bool:
    """Whether values only grow, from 0 or after falls to near 0.

    Args:
        values: (n,) as written, NaN where missing.
    """
    known = values[np.isfinite(values)]
    steps = np.diff(known)
    changed = np.flatnonzero(steps)
    falls = changed[steps[changed] < 0]
    if len(changed) < _LEAST or len(falls) > _FALLS * len(changed) or bool((known < 0).any()):
        return False
    if len(falls) and bool((known[falls + 1] > _NEW * known[falls]).any()):
        return False
    return bool(known.max() > _GROWN * _LEAST / 2 * np.median(steps[steps > 0]))


def sums(values: NDArray[np.float64]) -> bool:
    """Whether values are summed up, and begin anew now and then at what is added next.

    Args:
        values: (n,) as written, NaN where missing.
    """
    known = values[np.isfinite(values)]
    steps = np.diff(known)
    rises, falls = steps[steps > 0], np.flatnonzero(steps < 0)
    if len(rises) + len(falls) < _LEAST or len(falls) < 2 or bool((known < 0).any()):
        return False
    if len(rises) < _RISES * (len(rises) + len(falls)):
        return False
    added = float(np.quantile(rises, 0.9))
    high = known[falls] > _HIGH * np.median(rises)
    return bool(high.any()) and bool((known[falls + 1] <= added).mean() >= 0.9)


def report(channel: str, values: NDArray[np.float64], line: NDArray[np.int64]) -> tuple[Finding, ...]:
    """The finding about a speed that only grows; none where it does not.

    Args:
        channel: of the values.
        values: (n,), NaN where missing.
        line: (n,) of all rows.
    """
    if not grows(values):
        return _summed(channel, values, line) if sums(values) else ()
    return (Finding(
        kind="speed-only-grows", severity=Severity.WARNING, count=int(np.isfinite(values).sum()),
        where=f"line {line[0]}", what=f"{channel} may be no speed: {WHAT}",
        fix="name the column of the speed by --wind, or leave this log out: a speed that is made of a count's "
        "differences is the mean between rows, to be computed before",
    ),)  # fmt: skip


def _summed(channel: str, values: NDArray[np.float64], line: NDArray[np.int64]) -> tuple[Finding, ...]:
    what = (
        f"{channel} looks like a running sum and no speed: its values rise in most rows by amounts like the smallest "
        "of them, and fall back to these at once, as sums do that begin anew with each direction"
    )
    return (Finding(
        kind="speed-may-be-sum", severity=Severity.WARNING, count=int(np.isfinite(values).sum()),
        where=f"line {line[0]}", what=what,
        fix="check the file's description; the differences between rows of such a sum are the readings, to be computed "
        "before",
    ),)  # fmt: skip
