"""Whether an effect is as strong in every recording as its law says that it is in all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2, norm

from measure.loop.verdict import Estimate


def heterogeneity(strengths: Sequence[Estimate]) -> float | None:
    """p-value of one strength in all recordings, by Cochran's Q (Biometrics 10:101, 1954); None of fewer than two.

    A strength is that of a law in the wind: a wind that rises by so many metres a second, fitted as one that rises by
    an angle, has a larger angle in lighter winds.

    Args:
        strengths: of each recording alone, with normal intervals.
    """
    if len(strengths) < 2:
        return None
    values = np.array([s.value for s in strengths])
    errors = np.array([(s.high - s.low) / 2 / norm.ppf(0.5 + s.level / 2) for s in strengths])
    weights = errors**-2.0
    common = (weights * values).sum() / weights.sum()
    return float(chi2.sf((weights * (values - common) ** 2).sum(), len(strengths) - 1))
