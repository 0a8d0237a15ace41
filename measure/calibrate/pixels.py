"""What errors of pixels add to a film's summaries: draws of them.

Of the variance of an observable's error `PASSING` differs from window to window, and the rest is the flag's look and
the same in all its windows and recordings. Errors of observables that are read from the same outline are correlated.
Both are from films whose geometry is known (`python -m tests.validation observables`).
"""

from __future__ import annotations

import math

import numpy as np

from flagdata.rng import stream
from measure.calibrate.prior import Floats
from measure.calibrate.simulation import OBSERVED
from measure.calibrate.summary import Projection

PASSING = 0.4
"""Of 64 films 0.03 (area) to 0.7 (frequency), 0.36 on average."""
CORRELATED = {
    ("extension", "area"): 0.77,
    ("frequency", "bandwidth"): 0.85,
    ("middle-speed", "amplitude-across"): 0.56,
    ("amplitude-up", "amplitude-across"): 0.56,
}
"""Correlations of 63 films' errors; all others are within three standard errors of none, but for −0.38 of bandwidth and
amplitude-up, which is taken as none."""


def drawn(projection: Projection, windows: int, count: int, *, name: str, seed: int) -> Floats:
    """(count, 1 or 2, observable) errors of summaries of films whose windows err by a standard deviation of one.

    Args:
        projection: of the film's windows.
        windows: how many they are.
        name: of the recording.
    """
    size = len(OBSERVED)
    passing = stream(seed, "pixels", "passing", name).standard_normal((count, windows, size)) @ _FACTOR.T
    found = math.sqrt(PASSING) * projection.of(passing)
    found[:, 0] += math.sqrt(1 - PASSING) * stream(seed, "pixels", "lasting").standard_normal((count, size)) @ _FACTOR.T
    return found


def correlations() -> Floats:
    """(observable, observable)."""
    found = np.eye(len(OBSERVED))
    for (one, other), value in CORRELATED.items():
        a, b = OBSERVED.index(one), OBSERVED.index(other)
        found[a, b] = found[b, a] = value
    return found


_FACTOR = np.linalg.cholesky(correlations())
