"""The image statistics that the gate looks at, and in which direction each is suspicious, by an explicit table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from measure.gate import camera, exposure, motion, timing
from measure.gate.clip_statistics import ClipStatistics

Measure = Callable[[ClipStatistics], float]


@dataclass(frozen=True, kw_only=True)
class Check:
    """One statistic of a clip's picture.

    Attributes:
        measure: it.
        what: its name in words, with its unit.
        high, low: kinds of `measure.gate.reasons` for values that are too high and too low; None where that direction
            is no fault.
        resolution: difference below which two clips are called alike.
        logarithm: whether the figure shown is ten to the power of the statistic.
    """

    measure: Measure
    what: str
    high: str | None = None
    low: str | None = None
    resolution: float
    logarithm: bool = False

    def shown(self, value: float) -> float:
        """The figure in the message."""
        return float(10**value) if self.logarithm else value


CHECKS: dict[str, Check] = {
    "level": Check(measure=exposure.level, what="mean gray level of 255", low="too-dark", resolution=5.0),
    "highlights": Check(
        measure=exposure.highlights, what="gray level of the brightest 1 %", low="too-dark", resolution=5.0
    ),
    "contrast": Check(
        measure=exposure.contrast, what="contrast [gray levels]", low="too-dark", resolution=0.03, logarithm=True
    ),
    "noise": Check(
        measure=exposure.noise, what="noise over contrast", high="too-dark", resolution=0.05, logarithm=True
    ),
    "area": Check(
        measure=motion.area, what="share of the picture that moves", low="no-motion", resolution=0.05, logarithm=True
    ),
    "energy": Check(
        measure=motion.energy, what="power of motion over contrast", low="no-motion", resolution=0.05, logarithm=True
    ),
    "strength": Check(
        measure=motion.strength, what="strongest motion over noise", low="no-motion", resolution=0.05, logarithm=True
    ),
    "at-edge": Check(
        measure=motion.at_edge, what="motion at the picture's edge over motion inside", high="cut-off", resolution=0.05
    ),
    "around": Check(
        measure=motion.around, what="share of the picture's rim that moves", high="moving-camera", resolution=0.05
    ),
    "off-centre": Check(
        measure=motion.off_centre, what="distance of the motion from the middle", high="cut-off", resolution=0.02
    ),
    "width": Check(
        measure=motion.width, what="width of what moves [sides]", high="scale", low="scale", resolution=0.03
    ),
    "height": Check(
        measure=motion.height, what="height of what moves [sides]", high="scale", low="scale", resolution=0.03
    ),
    "second-region": Check(
        measure=motion.second_region,
        what="motion of a second region over the first's",
        high="several-flags",
        resolution=0.05,
    ),
    "scatter": Check(
        measure=motion.scatter,
        what="share of the motion apart from its largest region",
        high="unlike-cloth",
        resolution=0.03,
    ),
    "edges-moving": Check(
        measure=motion.edges_moving, what="share of edges that move", high="moving-camera", resolution=0.03
    ),
    "shift": Check(
        measure=camera.shift,
        what="shift of the picture's rim [1/112 of its side]",
        high="moving-camera",
        resolution=0.1,
        logarithm=True,
    ),
    "sway": Check(
        measure=camera.sway,
        what="sway of the picture's rim [1/112 of its side a frame]",
        high="moving-camera",
        resolution=0.1,
        logarithm=True,
    ),
    "held": Check(
        measure=timing.held,
        what="smallest changes of frames over the largest",
        low="low-frame-rate",
        resolution=0.05,
        logarithm=True,
    ),
    "uneven": Check(
        measure=timing.uneven,
        what="unevenness of the changes from frame to frame",
        high="low-frame-rate",
        resolution=0.03,
    ),
    "stopped": Check(
        measure=timing.stopped,
        what="change in the last third of the clip over all of it",
        low="repeated-frames",
        resolution=0.05,
        logarithm=True,
    ),
    "loop": Check(
        measure=timing.loop,
        what="difference of the most alike frames over the median",
        low="repeated-frames",
        resolution=0.05,
        logarithm=True,
    ),
}


def measured(frames: NDArray[np.uint8]) -> NDArray[np.float64]:
    """(len(CHECKS),) statistics of frames (n, height, width) in the order of the table.

    Raises:
        InputError: see `ClipStatistics.of`.
    """
    statistics = ClipStatistics.of(frames)
    return np.array([check.measure(statistics) for check in CHECKS.values()])
