"""Each statistic by its own tail, so that one with a heavy tail must be farther to count as much as
another.

The test's statistic is the largest of some ninety, each in standard deviations of nulls. One of
them whose nulls are now and then far off would set the critical value for all. So each is read as
Student's t of unit variance, with so many degrees of freedom as have its excess kurtosis κ over the
nulls,

    ν = 4 + 6/κ,

the normal distribution where κ ≤ 0, and is brought to the normal deviate that is as rare. It goes
on growing however far data are. A null counts in the tail of its own statistics: by all others, an
odd one's tail is the one not seen.
"""

from __future__ import annotations

import numpy as np

from flagdata.core.arrays import FloatArray

_NORMAL = 1e6
"""Degrees of freedom from which a tail is the normal's."""
_TINY = float(np.finfo(np.float64).tiny)


def freedom(values: FloatArray) -> FloatArray:
    """Estimates degrees of freedom by the kurtosis of nulls (group, statistic), from 4 on,
    (statistic,)."""
    about = values - values.mean(axis=0)
    kurtosis = (about**4).mean(axis=0) / np.maximum((about**2).mean(axis=0) ** 2, _TINY) - 3
    return np.minimum(4 + 6 / np.maximum(kurtosis, 6 / _NORMAL), _NORMAL)


def as_normal(deviations: FloatArray, degrees: FloatArray | np.float64) -> FloatArray:
    """Deviations of statistics of unit variance, brought to normal ones that are as rare, to 2 %
    (Wallace, Annals of Mathematical Statistics 30:1121, 1959); their signs are kept."""
    squared = deviations**2 * degrees / (degrees - 2)
    return (
        np.sign(deviations)
        * (8 * degrees + 1)
        / (8 * degrees + 3)
        * np.sqrt(degrees * np.log1p(squared / degrees))
    )
