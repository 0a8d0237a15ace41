"""Clips in which there is nothing to measure: nothing moves, or nothing is visible.

A network gives numbers for every clip, for these as well. They say nothing of a flag, so that none of them is shown,
not even where the gate is overruled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from measure.gate.clip_statistics import LEAST_DEVIATION, ClipStatistics
from measure.gate.reasons import REASONS

_FLAT = 1.0
"""Standard deviation of all gray levels of a clip below which nothing is visible: one step of the camera's."""


@dataclass(frozen=True, kw_only=True)
class Blank:
    """Why there is nothing to measure.

    Attributes:
        kind: of `measure.gate.reasons`.
        sentence: what is missing, with the figure.
        fix: what can be done.
        check: name of the statistic that shows it, of `measure.gate.checks`.
        value: its figure.
    """

    kind: str
    sentence: str
    fix: str
    check: str
    value: float


def blank(frames: NDArray[np.uint8]) -> Blank | None:
    """What a clip lacks; None where there is something to measure.

    Args:
        frames: (n, height, width) gray.

    Raises:
        InputError: see `ClipStatistics.of`.
    """
    contrast = float(frames.std())
    if contrast < _FLAT:
        reason = REASONS["too-dark"]
        what = f"{reason.sentence}: all gray levels lie within {contrast:.2g} of each other"
        return Blank(kind="too-dark", sentence=what, fix=reason.fix, check="contrast", value=contrast)
    most = float(ClipStatistics.of(frames).deviation.max())
    if most > LEAST_DEVIATION:
        return None
    what = (
        f"no motion is found in the picture: its gray levels change by {most:.1f} at most (standard deviation in "
        f"time), and up to {LEAST_DEVIATION:g} comes of rounding and coding"
    )
    return Blank(kind="no-motion", sentence=what, fix=REASONS["no-motion"].fix, check="strength", value=most)
