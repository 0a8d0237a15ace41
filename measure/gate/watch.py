"""What is counted of a film while it is read: cuts, loops, light, and what stands still.

It looks at small copies of whole frames, some 25 a second, and keeps of each a thumbnail. What it
counts can be checked by eye on the film.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import BoolArray, Float32Array, UInt8Array
from models.conditioning import camera_noise

SIDE = 240
"""Longer side [px] of the small copies."""
_RATE = 25.0
"""Frames a second that are looked at, about."""
_THUMB = 40
"""Longer side [px] of the thumbnails."""
_COMPARED = 500
"""Frames at most of which each is compared with each other, for loops: the first 20 s. More find
longer loops; memory and time grow with their square."""
_APART = 4
"""Least number of frames between two that are alike. Fewer takes slow motion for a repeated
frame."""
_CUT, _CUT_TIMES = 6.0, 3.0
"""Mean change of the thumbnail [gray levels], and its ratio to the largest change about it, from
which on it is a cut: a camera that turns changes many frames."""
_ABOUT = 5
"""Changes before and after a cut that it is compared with."""
_TWIN = 0.1
"""Distance of a frame's nearest twin, over the median distance of frames, below which it repeats
that one. Chosen on the films with defects of even number and the films without defects. Higher
takes motion that nearly repeats for a loop; lower misses loops that were coded again."""
_SAMPLED = 10
"""Every so many-th frame that is looked at is kept as it is, up to `_KEPT`."""
_KEPT = 40
_SLOPE = 3.0
"""Gray levels a pixel from which on there is an edge in a small copy."""
_RESTING = 0.6
"""An edge is at rest where its gradient, along the mean one, is never below this share of it."""
_TOGETHER = 5
"""Copies that are compared for edges at rest: two seconds."""

_SPOT_NOISES, _SPOT_CHANGE = 5.0, 3.0
"""Deviation in time, over the median one and in gray levels, from which on a pixel belongs to a
spot that changes."""

Picture = UInt8Array
_Gray = TypeVar("_Gray", np.uint8, np.float32)


@dataclass(eq=False)
class FilmWatch:
    """Looks at a film's frames, in order.

    Args:
        rate: of the film [Hz].

    Attributes:
        shape: height and width of its frames; (0, 0) before the first.
        times: of the frames that were looked at [s].
    """

    rate: float
    shape: tuple[int, int] = (0, 0)
    times: list[float] = field(default_factory=list)
    _frames: int = 0
    _last: Float32Array | None = None
    _fine: Float32Array | None = None
    _coarse: Float32Array | None = None
    _thumbs: list[Float32Array] = field(default_factory=list)
    _sample: list[Picture] = field(default_factory=list)
    _bright: list[float] = field(default_factory=list)
    _noise: list[float] = field(default_factory=list)

    def look(self, time: float, picture: Picture) -> None:
        """Takes the next frame, (height, width) gray of the whole picture."""
        step = max(1, round(self.rate / _RATE))
        self._frames += 1
        if (self._frames - 1) % step:
            return
        self.shape = (picture.shape[0], picture.shape[1])
        small = _average_down(picture, SIDE)
        self.times.append(time)
        self._thumbs.append(_average_down(small.astype(np.float32), _THUMB))
        self._change(small.astype(np.float32))
        if len(self.times) % _SAMPLED == 1 and len(self._sample) < _KEPT:
            self._sample.append(small)
            self._bright.append(float(np.quantile(picture[::4, ::4], 0.99)))
            self._noise.append(camera_noise.deviation_in(picture))

    def _change(self, small: Float32Array) -> None:
        """Add up how much the picture changes, in itself and averaged."""
        if self._last is not None:
            fine, coarse = np.abs(small - self._last), np.abs(self._thumbs[-1] - self._thumbs[-2])
            self._fine = fine if self._fine is None else self._fine + fine
            self._coarse = coarse if self._coarse is None else self._coarse + coarse
        self._last = small

    @property
    def small(self) -> tuple[int, int]:
        """Height and width of the small copies."""
        height, width = self._sample[0].shape
        return height, width

    @property
    def brightness(self) -> float:
        """Gray level of the brightest hundredth of the picture."""
        return float(np.median(self._bright)) if self._bright else 0.0

    @property
    def noise(self) -> float:
        """Standard deviation of a pixel's noise [gray levels]."""
        return float(np.median(self._noise)) if self._noise else 0.0

    @property
    def contrast(self) -> float:
        """Standard deviation of the gray levels in the mean of the small copies."""
        return float(np.stack(self._sample).mean(axis=0).std()) if self._sample else 0.0

    def cuts(self) -> list[float]:
        """Finds instants at which the picture changes to another at once [s]."""
        if len(self._thumbs) < 3:
            return []
        change = np.array(
            [np.abs(b - a).mean() for a, b in zip(self._thumbs, self._thumbs[1:], strict=False)]
        )
        instants = []
        for k, jump in enumerate(change):
            about = np.concatenate([change[max(0, k - _ABOUT) : k], change[k + 1 : k + 1 + _ABOUT]])
            if jump > _CUT and jump > _CUT_TIMES * about.max(initial=0.0):
                instants.append(self.times[k + 1])
        return instants

    def twins(self, box: tuple[float, float, float, float] | None = None) -> float:
        """Computes the share of frames that look like another one four frames away or more, 0 to 1:
        a loop, or repeated frames.

        Args:
            box: left, top, right and bottom of what moves, in shares of the picture; None for all
                of it.
        """
        thumbs = (
            np.stack(self._thumbs[:_COMPARED]) if self._thumbs else np.zeros((0, 1, 1), np.float32)
        )
        if len(thumbs) < 3 * _APART:
            return 0.0
        if box is not None:
            height, width = thumbs.shape[1:]
            left, top = int(box[0] * width), int(box[1] * height)
            thumbs = thumbs[:, top : int(box[3] * height) + 1, left : int(box[2] * width) + 1]
        flat = thumbs.reshape(len(thumbs), -1)
        flat = flat - flat.mean(axis=0)
        square = np.square(flat).sum(axis=1)
        distance = np.sqrt(np.maximum(square[:, None] + square[None] - 2 * flat @ flat.T, 0.0))
        index = np.arange(len(flat))
        distant = np.abs(index[:, None] - index[None]) >= _APART
        usual = float(np.median(distance[distant]))
        nearest = np.where(distant, distance, np.inf).min(axis=1)
        return float((nearest < _TWIN * usual).mean()) if usual > 0 else 1.0

    def grain(self, mask: BoolArray) -> float:
        """Computes the share of the change that is left when pixels are averaged over a fortieth of
        the picture's
        longer side: of cloth more than a half, of leaves less than a third.

        Args:
            mask: (height, width) where, in any scale.
        """
        if self._fine is None or self._coarse is None:
            return 1.0
        fine, coarse = (
            float(of[_resize_mask(mask, of.shape)].mean()) for of in (self._fine, self._coarse)
        )
        return coarse / fine if fine > 0 else 1.0

    def spot(self) -> float:
        """Measures the longer side of the largest spot that changes, in pixels of the film; 0 where
        none does."""
        if len(self._sample) < 3:
            return 0.0
        deviation = np.stack(self._sample).astype(np.float32).std(axis=0)
        moving = (deviation > max(_SPOT_NOISES * float(np.median(deviation)), _SPOT_CHANGE)).astype(
            np.uint8
        )
        joined = cv2.morphologyEx(moving, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
        count, _, components, _ = cv2.connectedComponentsWithStats(joined)
        if count < 2:
            return 0.0
        spot = components[1 + int(np.argmax(components[1:, cv2.CC_STAT_AREA]))]
        return float(
            max(spot[cv2.CC_STAT_WIDTH], spot[cv2.CC_STAT_HEIGHT])
            * max(self.shape)
            / max(self.small)
        )

    def resting(self) -> int:
        """Pixels of the small copies in which an edge stays where it is for two seconds, as those
        of background, pole
        and hoist do: the median over the film, of which a camera may drift."""
        counts = [
            _resting(self._sample[k : k + _TOGETHER])
            for k in range(0, len(self._sample) - 2, _TOGETHER)
        ]
        return int(np.median(counts)) if counts else 0


def _average_down(picture: NDArray[_Gray], side: int) -> NDArray[_Gray]:
    """Averages a picture (height, width) down to this longer side [px]."""
    scale = min(1.0, side / max(picture.shape))
    size = (max(1, round(picture.shape[1] * scale)), max(1, round(picture.shape[0] * scale)))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), dtype=picture.dtype)


def _resize_mask(mask: BoolArray, shape: tuple[int, ...]) -> BoolArray:
    return cv2.resize(mask.astype(np.uint8), shape[::-1], interpolation=cv2.INTER_NEAREST).astype(
        bool
    )


def _resting(sample: list[Picture]) -> int:
    """Counts pixels of pictures (height, width) in which an edge stays where it is."""
    gray = [cv2.GaussianBlur(picture.astype(np.float32), (0, 0), 1.0) for picture in sample]
    slope = np.stack(
        [[cv2.Sobel(smooth, cv2.CV_32F, x, 1 - x, ksize=3) / 8 for x in (1, 0)] for smooth in gray]
    )
    mean = slope.mean(axis=0)  # (2, height, width)
    length = np.hypot(*mean)
    along = (slope * (mean / np.maximum(length, 1e-6))).sum(axis=1)
    return int(((along.min(axis=0) > _RESTING * length) & (length > _SLOPE)).sum())
