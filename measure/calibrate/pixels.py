"""What errors of pixels add to a film's summaries: draws of them.

A part of an observable's error lasts: it is the same in all windows of a film. How large that part is differs by
observable: an area is off by the same amount in every window, a frequency by another one in each. Of what lasts in a
film a part is the flag's look, its colours, background and view, and the same in all recordings of it; the rest is the
film's, whose wind bends the flag otherwise and whose light is another. Errors of observables that are read from the
same outline are correlated. All is from films whose geometry is known (`python -m tests.validation looks`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flagdata.rng import stream
from measure.calibrate.prior import Floats
from measure.calibrate.simulation import OBSERVED
from measure.calibrate.summary import Projection

LASTING = np.array([0.70, 0.93, 0.79, 0.31, 0.57, 0.31, 0.56, 0.97])
"""(observable of `simulation.OBSERVED`) share of the variance that lasts: of 118 windows of 64 films by VTK, whose
deviation is `Observable.sigma` (docs/results/validate-looks.md)."""
COMMON = 0.63
"""Share of what lasts in a film that is the same in all recordings of the flag: 0.37 to 0.77, of two films each of
twelve looks by the raster renderer, of all observables together."""
LASTING_TOGETHER = {
    ("extension", "area"): 0.77,
    ("frequency", "bandwidth"): 0.85,
    ("middle-speed", "amplitude-across"): 0.56,
    ("amplitude-up", "amplitude-across"): 0.56,
}
"""Correlations of these films' mean errors. All others are within three standard errors of none."""
PASSING_TOGETHER = {("frequency", "bandwidth"): 0.75, ("bandwidth", "amplitude-up"): -0.44}
"""The same of the differences of their two windows."""


def drawn(projection: Projection, windows: int, count: int, *, name: str, seed: int) -> Floats:
    """(count, 1 or 2, observable) errors of summaries of films whose windows err by a standard deviation of one.

    Args:
        projection: of the film's windows.
        windows: how many they are.
        name: of the recording.
    """
    size = len(OBSERVED)
    passing = stream(seed, "pixels", "passing", name).standard_normal((count, windows, size)) @ _PASSING.T
    look, film = (stream(seed, "pixels", "lasting", *own).standard_normal((count, size)) for own in ((), (name,)))
    lasting = (np.sqrt(COMMON) * look + np.sqrt(1 - COMMON) * film) @ _LASTING.T
    found = projection.of(np.sqrt(1 - LASTING) * passing)
    found[:, 0] += np.sqrt(LASTING) * lasting
    return found


def correlations(together: Mapping[tuple[str, str], float]) -> Floats:
    """(observable, observable) of pairs of names."""
    found = np.eye(len(OBSERVED))
    for (one, other), value in together.items():
        a, b = OBSERVED.index(one), OBSERVED.index(other)
        found[a, b] = found[b, a] = value
    return found


_LASTING, _PASSING = (np.linalg.cholesky(correlations(one)) for one in (LASTING_TOGETHER, PASSING_TOGETHER))
