"""The simulated clips that a clip is nearest to, and what it differs from them in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from measure.gate.checks import CHECKS
from models.outliers import Familiarity


@dataclass(frozen=True, kw_only=True)
class Contrast:
    """What may differ.

    Attributes:
        what: in words.
        more, less: what a larger and a smaller value is called.
        resolution: difference below which nothing is said.
        factor: whether the statistic is a common logarithm, so that differences are told as factors.
    """

    what: str
    more: str
    less: str
    resolution: float
    factor: bool


CONTRASTS: dict[str, Contrast] = {
    "area": Contrast(what="scale", more="takes more of the picture", less="takes less of the picture",
                     resolution=0.15, factor=True),
    "level": Contrast(what="exposure", more="is brighter", less="is darker", resolution=15.0, factor=False),
    "contrast": Contrast(what="contrast", more="has more contrast", less="has less contrast", resolution=0.1,
                         factor=True),
    "energy": Contrast(what="motion energy", more="moves more strongly", less="moves more weakly", resolution=0.2,
                       factor=True),
    "frequency": Contrast(what="dominant frequency", more="moves faster", less="moves slower", resolution=1.0,
                          factor=False),
}  # fmt: skip
"""Name of the statistic → its words; "frequency" is the dominant frequency of the motion [Hz]."""


@dataclass(frozen=True, kw_only=True)
class Neighbour:
    """A simulated clip.

    Attributes:
        index: among those that were given.
        distance: of the summaries, in standard deviations of the training clips (Mahalanobis).
        differences: what the clip differs in, in words, the largest difference first.
    """

    index: int
    distance: float
    differences: tuple[str, ...]


def nearest(
    summary: NDArray[np.floating],
    summaries: NDArray[np.floating],
    cloud: Familiarity,
    *,
    statistics: NDArray[np.floating],
    known: NDArray[np.floating],
    frequency: float,
    frequencies: NDArray[np.floating],
    count: int = 3,
) -> tuple[Neighbour, ...]:
    """The simulated clips whose summaries are nearest, the nearest first.

    Args:
        summary: (d,) of the clip.
        summaries: (n, d) of simulated clips.
        cloud: whose covariance distances are measured by.
        statistics: (len(CHECKS),) of the clip.
        known: (n, len(CHECKS)) of the simulated clips.
        frequency: dominant frequency of the clip's motion [Hz].
        frequencies: (n,) of the simulated clips [Hz].
        count: how many are wanted.

    Raises:
        InputError: lengths that do not fit, or no simulated clips.
    """
    if len(summaries) == 0 or not len(summaries) == len(known) == len(frequencies):
        raise InputError(
            f"{len(summaries)} summaries, {len(known)} statistics and {len(frequencies)} frequencies",
            where="the simulated clips", fix="give one of each for every clip, and at least one clip",
        )  # fmt: skip
    apart = np.linalg.norm((np.asarray(summaries) - np.asarray(summary)) @ cloud.whitening.T, axis=1)
    return tuple(
        Neighbour(
            index=int(place), distance=float(apart[place]),
            differences=_differences(statistics, known[place], frequency, float(frequencies[place])),
        )
        for place in np.argsort(apart, kind="stable")[:count]
    )  # fmt: skip


def _differences(
    one: NDArray[np.floating], other: NDArray[np.floating], frequency: float, usual: float
) -> tuple[str, ...]:
    order = list(CHECKS)
    found = []
    for name, contrast in CONTRASTS.items():
        mine, its = (frequency, usual) if name == "frequency" else (one[order.index(name)], other[order.index(name)])
        steps = float(mine - its) / contrast.resolution
        if abs(steps) < 1:
            continue
        figures = f"{10 ** abs(float(mine - its)):.2g} times" if contrast.factor else f"{mine:.3g} instead of {its:.3g}"
        found.append((abs(steps), f"{contrast.what}: it {contrast.more if steps > 0 else contrast.less} ({figures})"))
    return tuple(words for _, words in sorted(found, key=lambda pair: -pair[0]))
