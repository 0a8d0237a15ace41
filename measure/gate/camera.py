"""Whether the camera moves: shifts of the picture's rim, where the trained clips show background that stands still."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from measure.gate.clip_statistics import SIDE, ClipStatistics

_TILE = 28
"""Side of a tile of the rim [px]; the picture has four by four, twelve of which are its rim."""
_STEPS = (3, 8, 15, 29)
"""Frames, after the first, whose shift from it is measured."""


def shift(clip: ClipStatistics) -> float:
    """Common logarithm of the shift of the rim [px]: the largest over frames of the tiles' median.

    A tile's shift is the peak of its phase correlation with the first frame (Kuglin and Hines, 1975). The spectrum is
    divided by its modulus plus the noise's, so that a tile without texture gives no shift; the peak is refined by a
    parabola.
    """
    found = [_median_shift(clip, frame) for frame in _STEPS if frame < len(clip.gray)]
    return float(np.log10(max(max(found), 0.01)))


def sway(clip: ClipStatistics) -> float:
    """Common logarithm of the root mean square translation of the rim from one frame to the next [px/frame].

    The translation is that of least squares between slopes and changes (Lucas and Kanade, 1981) over the rim's pixels.
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


def _phase_shift(one: NDArray[np.float32], other: NDArray[np.float32], noise: float) -> tuple[float, float]:
    """How far the second picture lies below and right of the first [px]."""
    hann = np.hanning(_TILE)
    window = np.outer(hann, hann)
    first, second = (np.fft.rfft2((picture - picture.mean()) * window) for picture in (one, other))
    cross = second * np.conj(first)
    floor = (1.0 + noise**2) * np.square(window).sum()
    surface = np.fft.irfft2(cross / (np.abs(cross) + floor), s=(_TILE, _TILE))
    y, x = (int(place) for place in np.unravel_index(surface.argmax(), surface.shape))
    return _refined(surface[:, x], y), _refined(surface[y], x)


def _refined(line: NDArray[np.float64], place: int) -> float:
    """Place of a periodic line's peak by the parabola through three values, as a signed shift."""
    before, peak, after = line[place - 1], line[place], line[(place + 1) % len(line)]
    bend = before - 2 * peak + after
    fine = place + (0.5 * (before - after) / bend if bend < 0 else 0.0)
    return fine - len(line) if fine > len(line) / 2 else fine
