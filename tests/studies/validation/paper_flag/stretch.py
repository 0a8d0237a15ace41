"""Is a filmed sheet as long in every frame? Checks the scales of a picture with what paper cannot
do: stretch.

A sheet that is in view from its clamp to its tip has the same arc length in every frame, if rows
and columns are given their true ratio. Where its tip is smeared away the seen line is too short,
never too long: so the arc lengths of all frames pile up at their upper end, and the ratio is the
one at which they pile up most sharply. The upper end itself is the sheet's length, and gives the
scale.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from tests.studies.validation.paper_flag.edge import EdgeTrack

_SMOOTH = 15  # columns of a running parabola; the scatter of single heights would lengthen the line
_UPPER = (75.0, 98.0)  # percentiles between which the pile is measured
_RESAMPLES = 200
_BLOCKS = 20


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """What inextensibility says of a picture.

    Attributes:
        ratio: row scale over column scale.
        low, high: its interval at 90 %, by resampling blocks of frames.
        length: of the sheet at that ratio [columns].
        spread: (98 % − 75 %) of the arc lengths at that ratio, over the length.
        spread_square: the same at ratio 1.
    """

    ratio: float
    low: float
    high: float
    length: float
    spread: float
    spread_square: float


def arc_lengths(track: EdgeTrack, ratios: FloatArray, *, least: int = 50) -> FloatArray:
    """(frame, ratio) from the first to the last column seen [columns]; NaN for frames with fewer
    than `least`."""
    found = np.full((len(track.height), len(ratios)), np.nan)
    for index, height in enumerate(track.height):
        seen = np.flatnonzero(np.isfinite(height))
        if len(seen) >= least:
            whole = np.interp(np.arange(seen[0], seen[-1] + 1), seen, height[seen])
            rise = np.diff(np.asarray(savgol_filter(whole, _SMOOTH, 2)))
            found[index] = np.hypot(1.0, ratios[:, None] * rise).sum(axis=1)
    return found


def stretch(track: EdgeTrack, rng: np.random.Generator) -> Stretch:
    """The ratio of rows to columns at which the sheet keeps its length.

    Raises:
        InputError: fewer than 100 frames show a line.
    """
    ratios = np.arange(0.4, 1.2001, 0.01)
    every = EdgeTrack(
        time=track.time[::2], height=track.height[::2], width=track.width[::2], seen=track.seen[::2]
    )
    arcs = arc_lengths(every, ratios)
    arcs = arcs[np.isfinite(arcs).all(axis=1)]
    if len(arcs) < 100:
        raise InputError(
            f"a line in {len(arcs)} frames",
            where="stretch",
            fix="give a clip of 200 frames or more with the sheet",
        )
    spreads = _spread(arcs)
    best = int(spreads.argmin())
    blocks = np.array_split(np.arange(len(arcs)), _BLOCKS)
    drawn = []
    for _ in range(_RESAMPLES):
        chosen = np.concatenate([blocks[i] for i in rng.integers(_BLOCKS, size=_BLOCKS)])
        drawn.append(ratios[_spread(arcs[chosen]).argmin()])
    low, high = np.percentile(drawn, [5, 95])
    square = int(np.abs(ratios - 1).argmin())
    return Stretch(
        ratio=float(ratios[best]),
        low=float(low),
        high=float(high),
        length=float(np.percentile(arcs[:, best], _UPPER[1])),
        spread=float(spreads[best]),
        spread_square=float(spreads[square]),
    )


def _spread(arcs: FloatArray) -> FloatArray:
    low, high = np.percentile(arcs, _UPPER, axis=0)
    return (high - low) / high
