"""Clips in which there is nothing to measure: nothing moves, or nothing is visible.

A network gives numbers for every clip, for these as well. They say nothing of a flag, so that none of them is shown,
not even where the gate is overruled.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from measure.gate.clip_statistics import LEAST_DEVIATION, ClipStatistics
from measure.gate.reasons import REASONS
from measure.gate.verdict import Reason

_FLAT = 1.0
"""Standard deviation of all gray levels of a clip below which nothing is visible: one step of the camera's."""


def blank(frames: NDArray[np.uint8]) -> Reason | None:
    """What a clip lacks; None where there is something to measure.

    Args:
        frames: (n, height, width) gray.

    Raises:
        InputError: see `ClipStatistics.of`.
    """
    contrast = float(frames.std())
    if contrast < _FLAT:
        what = f"{REASONS['too-dark'].sentence}: all gray levels lie within {contrast:.2g} of each other"
        return _lacking("too-dark", what, check="contrast", value=contrast)
    most = float(ClipStatistics.of(frames).deviation.max())
    if most > LEAST_DEVIATION:
        return None
    what = (
        f"no motion is found in the picture: its gray levels change by {most:.1f} at most (standard deviation in "
        f"time), and up to {LEAST_DEVIATION:g} comes of rounding and coding"
    )
    return _lacking("no-motion", what, check="strength", value=most)


def _lacking(kind: str, what: str, *, check: str, value: float) -> Reason:
    return Reason(kind=kind, what=what, p=None, fix=REASONS[kind].fix, blank=True, check=check, value=value)
