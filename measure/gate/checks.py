"""The image statistics that the gate looks at, and in which direction each is suspicious, by an
explicit table.

Light: how bright a clip is, what contrast it has, and how much of it is noise.

Frames in time: repeated ones, loops, and a motion that stops.

Whether the camera moves: shifts of the picture's rim, where the trained clips show background that
stands still.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import Float32Array, FloatArray, UInt8Array
from measure.gate import clip_motion
from measure.gate.clip_statistics import SIDE, ClipStatistics

_TILE = 28
"""Side of a tile of the rim [px]; the picture has four by four, twelve of which are its rim."""
_STEPS = (3, 8, 15, 29)
"""Frames, after the first, whose shift from it is measured."""


def shift(clip: ClipStatistics) -> float:
    """Computes the common logarithm of the shift of the rim [px]: the largest over frames of the
    tiles' median.

    A tile's shift is the peak of its phase correlation with the first frame (Kuglin and Hines,
    1975). The spectrum is divided by its modulus plus the noise's, so that a tile without texture
    gives no shift; the peak is refined by a parabola.
    """
    shifts = [_median_shift(clip, frame) for frame in _STEPS if frame < len(clip.gray)]
    return float(np.log10(max(max(shifts), 0.01)))


def sway(clip: ClipStatistics) -> float:
    """Computes the common logarithm of the root mean square translation of the rim from one frame
    to the next [px/frame].

    The translation is that of least squares between slopes and changes (Lucas and Kanade, 1981)
    over the rim's pixels.
    """
    mask = np.ones((SIDE, SIDE), dtype=np.bool_)
    rim = SIDE // 6
    mask[rim:-rim, rim:-rim] = False
    change = np.diff(clip.gray, axis=0)[:, mask]
    slopes = np.stack([np.asarray(np.gradient(clip.mean, axis=axis))[mask] for axis in (0, 1)])
    square = slopes @ slopes.T + np.eye(2) * mask.sum() * 0.25
    moved = np.linalg.solve(square, slopes @ change.T)
    return float(np.log10(max(float(np.sqrt(np.square(moved).sum(axis=0).mean())), 1e-3)))


def _median_shift(clip: ClipStatistics, frame: int) -> float:
    shifts = []
    for top in range(0, SIDE, _TILE):
        for left in range(0, SIDE, _TILE):
            if top in (0, SIDE - _TILE) or left in (0, SIDE - _TILE):
                part = (slice(top, top + _TILE), slice(left, left + _TILE))
                shifts.append(_phase_shift(clip.gray[0][part], clip.gray[frame][part], clip.still))
    return float(np.hypot(*np.median(shifts, axis=0)))


def _phase_shift(
    first_tile: Float32Array, second_tile: Float32Array, noise: float
) -> tuple[float, float]:
    """Estimates how far the second picture lies below and right of the first [px]."""
    hann = np.hanning(_TILE)
    window = np.outer(hann, hann)
    first, second = (
        np.fft.rfft2((picture - picture.mean()) * window) for picture in (first_tile, second_tile)
    )
    cross = second * np.conj(first)
    floor = (1.0 + noise**2) * np.square(window).sum()
    surface = np.fft.irfft2(cross / (np.abs(cross) + floor), s=(_TILE, _TILE))
    y, x = (int(index) for index in np.unravel_index(surface.argmax(), surface.shape))
    return _refined_peak(surface[:, x], y), _refined_peak(surface[y], x)


def _refined_peak(line: FloatArray, index: int) -> float:
    """Refines a periodic line's peak by the parabola through three values; returns it as a signed
    shift."""
    before, peak, after = line[index - 1], line[index], line[(index + 1) % len(line)]
    bend = before - 2 * peak + after
    fine = index + (0.5 * (before - after) / bend if bend < 0 else 0.0)
    return fine - len(line) if fine > len(line) / 2 else fine


_LEAST = 0.02
"""Gray levels of mean change that count as none."""
_SHORTEST_LOOP = 4


def held(clip: ClipStatistics) -> float:
    """Computes the common logarithm of the lower quartile of the changes from frame to frame over
    their 90 % quantile.

    Near 0 where each frame differs from the last; very low where at least a quarter of them repeat
    it.
    """
    low, high = np.quantile(_changes(clip), (0.25, 0.9))
    return float(np.log10((low + _LEAST) / (high + _LEAST)))


def uneven(clip: ClipStatistics) -> float:
    """Computes how far each change is from the mean of its neighbours, over the mean change: 0 for
    smooth motion."""
    change = _changes(clip)
    if len(change) < 3:
        return 0.0
    middle = 0.5 * (change[2:] + change[:-2])
    return float(np.abs(change[1:-1] - middle).mean() / (change.mean() + _LEAST))


def stopping_ratio(clip: ClipStatistics) -> float:
    """Computes the common logarithm of the mean change over the last third of the clip over that of
    the whole clip."""
    change = _changes(clip)
    return float(
        np.log10((change[-(len(change) // 3) :].mean() + _LEAST) / (change.mean() + _LEAST))
    )


def loop(clip: ClipStatistics) -> float:
    """Computes the common logarithm of the smallest mean difference of frames a lag apart over the
    median lag's.

    Lags are 4 frames to two thirds of the clip. Flutter comes near its shape of a period ago, a
    loop repeats it.
    """
    lags = range(_SHORTEST_LOOP, 2 * len(clip.gray) // 3)
    pixels = (
        clip.gray[:, clip.moving] if clip.moving.any() else clip.gray.reshape(len(clip.gray), -1)
    )
    if not lags:
        return 0.0
    differences = np.array([np.abs(pixels[lag:] - pixels[:-lag]).mean() for lag in lags])
    return float(np.log10((differences.min() + _LEAST) / (np.median(differences) + _LEAST)))


def _changes(clip: ClipStatistics) -> FloatArray:
    """Computes mean absolute changes from frame to frame over the moving pixels, or over all if
    none moves, (n − 1,)."""
    pixels = (
        clip.gray[:, clip.moving] if clip.moving.any() else clip.gray.reshape(len(clip.gray), -1)
    )
    return np.abs(np.diff(pixels, axis=0)).mean(axis=1).astype(np.float64)


def level(clip: ClipStatistics) -> float:
    """Computes the mean gray level, 0 to 255."""
    return float(clip.mean.mean())


def highlights(clip: ClipStatistics) -> float:
    """Computes the gray level below which 99 % of the mean picture lies."""
    return float(np.quantile(clip.mean, 0.99))


def contrast(clip: ClipStatistics) -> float:
    """Computes the common logarithm of the standard deviation of the mean picture [gray levels]."""
    return float(np.log10(max(clip.contrast, 1e-2)))


def noise(clip: ClipStatistics) -> float:
    """Computes the common logarithm of the noise's deviation over the contrast of the mean
    picture."""
    return float(np.log10(max(clip.still, 1e-2) / max(clip.contrast, 1e-2)))


Measure = Callable[[ClipStatistics], float]


@dataclass(frozen=True, kw_only=True)
class Check:
    """One statistic of a clip's picture.

    Attributes:
        measure: it.
        what: its name in words, with its unit.
        high, low: kinds of `measure.gate.reasons` for values that are too high and too low; None
            where that direction is no fault.
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
        """Returns the figure in the message."""
        return float(10**value) if self.logarithm else value


CHECKS: dict[str, Check] = {
    "level": Check(measure=level, what="mean gray level of 255", low="too-dark", resolution=5.0),
    "highlights": Check(
        measure=highlights, what="gray level of the brightest 1 %", low="too-dark", resolution=5.0
    ),
    "contrast": Check(
        measure=contrast,
        what="contrast [gray levels]",
        low="too-dark",
        resolution=0.03,
        logarithm=True,
    ),
    "noise": Check(
        measure=noise, what="noise over contrast", high="too-dark", resolution=0.05, logarithm=True
    ),
    "area": Check(
        measure=clip_motion.area,
        what="share of the picture that moves",
        low="no-motion",
        resolution=0.05,
        logarithm=True,
    ),
    "energy": Check(
        measure=clip_motion.energy,
        what="power of motion over contrast",
        low="no-motion",
        resolution=0.05,
        logarithm=True,
    ),
    "strength": Check(
        measure=clip_motion.strength,
        what="strongest motion over noise",
        low="no-motion",
        resolution=0.05,
        logarithm=True,
    ),
    "at-edge": Check(
        measure=clip_motion.at_edge,
        what="motion at the picture's edge over motion inside",
        high="cut-off",
        resolution=0.05,
    ),
    "around": Check(
        measure=clip_motion.around,
        what="share of the picture's rim that moves",
        high="moving-camera",
        resolution=0.05,
    ),
    "off-centre": Check(
        measure=clip_motion.off_centre,
        what="distance of the motion from the middle",
        high="cut-off",
        resolution=0.02,
    ),
    "width": Check(
        measure=clip_motion.width,
        what="width of what moves [sides]",
        high="scale",
        low="scale",
        resolution=0.03,
    ),
    "height": Check(
        measure=clip_motion.height,
        what="height of what moves [sides]",
        high="scale",
        low="scale",
        resolution=0.03,
    ),
    "second-region": Check(
        measure=clip_motion.second_region,
        what="motion of a second region over the first's",
        high="several-flags",
        resolution=0.05,
    ),
    "scatter": Check(
        measure=clip_motion.scatter,
        what="share of the motion apart from its largest region",
        high="unlike-cloth",
        resolution=0.03,
    ),
    "edges-moving": Check(
        measure=clip_motion.edges_moving,
        what="share of edges that move",
        high="moving-camera",
        resolution=0.03,
    ),
    "shift": Check(
        measure=shift,
        what="shift of the picture's rim [1/112 of its side]",
        high="moving-camera",
        resolution=0.1,
        logarithm=True,
    ),
    "sway": Check(
        measure=sway,
        what="sway of the picture's rim [1/112 of its side a frame]",
        high="moving-camera",
        resolution=0.1,
        logarithm=True,
    ),
    "held": Check(
        measure=held,
        what="smallest changes of frames over the largest",
        low="low-frame-rate",
        resolution=0.05,
        logarithm=True,
    ),
    "uneven": Check(
        measure=uneven,
        what="unevenness of the changes from frame to frame",
        high="low-frame-rate",
        resolution=0.03,
    ),
    "stopped": Check(
        measure=stopping_ratio,
        what="change in the last third of the clip over all of it",
        low="repeated-frames",
        resolution=0.05,
        logarithm=True,
    ),
    "loop": Check(
        measure=loop,
        what="difference of the most alike frames over the median",
        low="repeated-frames",
        resolution=0.05,
        logarithm=True,
    ),
}


def measure_statistics(frames: UInt8Array) -> FloatArray:
    """Computes the statistics (len(CHECKS),) of frames (n, height, width) in the order of the
    table.

    Raises:
        InputError: see `ClipStatistics.of`.
    """
    statistics = ClipStatistics.of(frames)
    return np.array([check.measure(statistics) for check in CHECKS.values()])
