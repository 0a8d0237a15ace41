"""What a camera and its tracker do to the nodes of a cloth that they follow: three effects, each
with a null value.

A node at x(t) is reported in frame i, stamped t_i, as

    y_i = o + x + s + A (x − x̄),   x = x(t_i − lag − τ_i),

with o an offset of each node (the tracker's idea of the outline and of the rest shape), A a linear
map about the mean place x̄ with a shift s (the camera's pose and its scale of depth) and τ_i the
latency of the frame beyond the usual lag (stamps are given when a frame has been worked on).
Offsets and map are fitted on some recordings and kept for others. A latency is a frame's own: it is
fitted to the upper half of the nodes, which the attachments determine best, and judged by the lower
one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from flagdata.core.arrays import BoolArray, FloatArray
from tests.studies.validation.robot_cloth.reading import Swing

OFFSETS, CAMERA, LATENCY = "node offsets", "camera pose and depth scale", "latency of single frames"
TRACKER = (OFFSETS, CAMERA, LATENCY)
"""Effects of the tracker by name."""
_LONGEST = 0.2  # s: two frames of a camera of 10 Hz
_RESOLUTION = 5e-3  # s, of latencies
_FAR = 0.1  # m: a node that is farther off was lost by the tracker


@dataclass(frozen=True, kw_only=True, eq=False)
class Tracker:
    """How nodes are measured; the null values are a tracker that errs in nothing.

    Attributes:
        offsets: (node, 3) o [m].
        camera: (3, 3) A.
        shift: (3,) s [m].
        about: (3,) x̄ [m].
        stiffness: what a latency costs in the fit of a frame, as the place that a node moves in it
            [m/s]: the ratio of the nodes' usual error to the usual latency. None: all frames have
            the usual lag.
    """

    offsets: FloatArray
    camera: FloatArray
    shift: FloatArray
    about: FloatArray
    stiffness: float | None = None

    @classmethod
    def faultless(cls, swings: Sequence[Swing]) -> Tracker:
        """One that errs in nothing."""
        places = np.concatenate([swing.positions.reshape(-1, 3) for swing in swings])
        nodes = swings[0].positions.shape[1]
        return cls(
            offsets=np.zeros((nodes, 3)),
            camera=np.zeros((3, 3)),
            shift=np.zeros(3),
            about=np.nanmean(places, axis=0),
        )

    def seen(self, places: FloatArray) -> FloatArray:
        """(frame, node, 3) where the tracker reports nodes that are at `places` [m]."""
        return self.offsets + self.shift + places + (places - self.about) @ self.camera.T


def upper(side: int) -> BoolArray:
    """(node,) whether a node is in the upper half of the cloth: columns from left to right, each
    from top to bottom."""
    return np.arange(side * side) % side < side // 2


def errors(
    swing: Swing, run: CubicSpline, tracker: Tracker, lag: float, late: FloatArray | None = None
) -> FloatArray:
    """(frame, node, 3) observed less predicted [m]; NaN where a node was not tracked, or before the
    first pose.

    Args:
        run: the nodes' places over the tool's time, by a model.
        lag: of all frames [s].
        late: (frame,) latencies beyond it [s]; None for none.
    """
    own = swing.times - lag - (0.0 if late is None else late)
    within = (own >= 0) & (own <= swing.tool_times[-1])
    predicted = tracker.seen(run(instants(swing, lag, late)))
    return np.where(within[:, None, None], swing.positions - predicted, np.nan)


def instants(swing: Swing, lag: float, late: FloatArray | float | None = None) -> FloatArray:
    """(frame,) when frames were taken, on the tool's clock and within its time [s]."""
    return np.clip(swing.times - lag - (0.0 if late is None else late), 0.0, swing.tool_times[-1])


def left(
    swings: Sequence[Swing], runs: Sequence[CubicSpline], tracker: Tracker, lag: float
) -> list[FloatArray]:
    """(frame, node, 3) errors on each recording [m], with its own latencies where the tracker has
    any."""
    return [
        errors(swing, run, tracker, lag, latencies(swing, run, tracker, lag))
        for swing, run in zip(swings, runs, strict=True)
    ]


def latencies(swing: Swing, run: CubicSpline, tracker: Tracker, lag: float) -> FloatArray:
    """(frame,) τ [s]: that which brings the upper half of the nodes nearest to their run, within
    0.2 s; 0 without latencies, and where no node was tracked."""
    if tracker.stiffness is None:
        return np.zeros(len(swing.times))
    above = upper(swing.side)
    tried = np.arange(-_LONGEST, _LONGEST + _RESOLUTION / 2, _RESOLUTION)
    order = np.argsort(np.abs(tried), kind="stable")  # of equal ones the least
    tried = tried[order]
    costs = []
    for late in tried:
        squares = (
            (swing.positions - tracker.seen(run(instants(swing, lag, late))))[:, above] ** 2
        ).sum(axis=2)
        seen = ~np.isnan(squares)
        mean = np.where(seen, np.minimum(squares, _FAR**2), 0.0).sum(axis=1) / np.maximum(
            seen.sum(axis=1), 1
        )
        costs.append(mean + (tracker.stiffness * late) ** 2)
    return tried[np.argmin(costs, axis=0)]


def shifts(swing: Swing, run: CubicSpline, tracker: Tracker, lag: float) -> FloatArray:
    """(frame,) a vertical shift of each frame [m], sought by the upper half of the nodes as a
    latency is: as free, and what no clock does. The control of `latencies`."""
    above = errors(swing, run, tracker, lag)[:, upper(swing.side), 2]
    with np.errstate(all="ignore"):
        found = np.nanmedian(np.where(np.isnan(above), np.nan, above), axis=1)
    return np.nan_to_num(found)  # a frame that is not judged is not shifted
