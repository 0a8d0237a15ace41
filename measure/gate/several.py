"""How many strange windows a recording may have, and from which p on a window counts as strange.

A recording of K windows is refused if more than a `SHARE` of them, and two at least where there are two, are strange:
with p at or below a level that is the same for all. So windows that are left out of the answer count toward the
verdict, and a recording of which half the windows just pass is no familiar one.

Windows of one recording are alike, how much is not known. Let each have the probability a of being strange, and let
their normal scores be jointly Gaussian with one correlation ρ from 0 to 1. With Φ the normal distribution, the share of
the familiar recordings that are refused is

    r(a, ρ) = ∫ P(Binomial(K, q(z)) ≥ m) φ(z) dz,   q(z) = Φ((Φ⁻¹(a) − √ρ z)/√(1 − ρ)),

with m the number of windows that refuse. The level is that of the largest a at which r is at most the stated rate for
every ρ. It is below the rate, since windows that are nearly but not quite alike gather more often than they would if
they were independent or the same: for many windows the largest r is Φ(−√(z² − c²)) with z and c the normal scores of a
and of the share m/K, at ρ = 1 − c²/z². A quarter costs little: a = 0.038 for a rate of 0.05. A tenth would cost more
(0.019), and a half, which is free of charge, lets a recording pass of which 48 in 100 windows are strange.

Neighbouring windows are more alike than distant ones. If the correlation falls as e^(−t/τ), the rate is largest for τ
about the length of the recording, and up to 1.14 times the largest r above (simulated for 3 to 100 windows and rates of
0.01 to 0.2); the level leaves room for that.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.special import bdtrc, ndtr, ndtri

from flagdata.errors import InputError

SHARE = 0.25
"""Share of strange windows above which a recording is refused, fixed on 2026-11-27 by the text above, before any film
was judged by it. A choice of this project, from no publication."""
_MOST = 3
"""Windows of which one, or most, have to be strange: r is then at most a, at ρ = 1."""
_FADING = 1.15
"""By how much likeness that fades with time may raise the rate of more windows: see above."""
_CORRELATIONS = np.concatenate([np.linspace(0.0, 0.95, 39), [0.97, 0.985]])
_NORMAL = np.linspace(-8.0, 8.0, 801)
_DENSITY = np.exp(-np.square(_NORMAL) / 2) / np.exp(-np.square(_NORMAL) / 2).sum()


def refusing(windows: int) -> int:
    """How many strange windows refuse a recording of so many."""
    return max(int(SHARE * windows) + 1, min(windows, 2))


def refused_share(strange: float, windows: int) -> float:
    """Share of the familiar recordings that are refused, at the correlation at which it is largest.

    Args:
        strange: probability of a familiar window being strange.
        windows: of a recording.
    """
    score = (ndtri(strange) - np.sqrt(_CORRELATIONS)[:, None] * _NORMAL) / np.sqrt(1 - _CORRELATIONS)[:, None]
    return max(strange, float((bdtrc(refusing(windows) - 1, windows, ndtr(score)) @ _DENSITY).max()))


@lru_cache(maxsize=64)
def window_rate(windows: int, false_alarm: float) -> float:
    """Largest probability of a familiar window being strange that keeps to the stated rate of recordings.

    Args:
        windows: of a recording.
        false_alarm: share of familiar recordings that may be refused.

    Raises:
        InputError: no window, or a rate that is not between 0 and 1.
    """
    if windows < 1 or not 0 < false_alarm < 1:
        raise InputError(
            f"a false-alarm rate of {false_alarm:g} of {windows} windows",
            where="--false-alarm",
            fix="give a share between 0 and 1, as in 0.05",
        )
    if windows <= _MOST:
        return false_alarm
    low, high = 0.0, false_alarm / _FADING
    while high - low > 1e-4 * high:
        middle = (low + high) / 2
        low, high = (middle, high) if refused_share(middle, windows) <= false_alarm / _FADING else (low, middle)
    return low
