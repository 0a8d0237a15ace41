"""Shares with exact bounds."""

from __future__ import annotations

from scipy.stats import beta


def clopper_pearson(hits: float, count: float, *, level: float) -> tuple[float, float]:
    """Computes the interval of a share, each side (1 − level)/2: Clopper and Pearson, Biometrika
    26:404 (1934). 0 to 1 of no cases.

    Args:
        hits, count: in so many of so many; neither has to be a whole number.
        level: of the interval, between 0 and 1.
    """
    tail = (1 - level) / 2
    low = float(beta.ppf(tail, hits, count - hits + 1)) if hits > 0 else 0.0
    high = float(beta.ppf(1 - tail, hits + 1, count - hits)) if hits < count else 1.0
    return low, high
