"""The input of the checks: a clip's central square, averaged down, with moving and still parts
separated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from scipy import ndimage
from torch.nn import functional

from flagdata.core.arrays import BoolArray, Float32Array, UInt8Array
from flagdata.errors import InputError

SIDE = 112
"""Height and width [px] that pictures are averaged down to; in px of this grid all lengths are
given."""
LEAST_FRAMES = 3
_NOISES = 4.0
"""Deviations of the noise that a pixel's must have to be called moving. Higher misses faint motion;
lower calls noise motion."""
LEAST_DEVIATION = 1.5
"""Gray levels below which no deviation is called motion: rounding and coding leave up to one."""
_ROUGH = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], dtype=np.float32)
"""The difference of two Laplacians; white noise of deviation σ leaves 6 σ."""
_MEDIAN = 0.6745
"""Median of the absolute value of a standard normal variable."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ClipStatistics:
    """Statistics of the central square of a clip, the input of all checks.

    Attributes:
        gray: (n, SIDE, SIDE) float32 gray levels, 0 to 255.
    """

    gray: Float32Array

    @classmethod
    def of(cls, frames: UInt8Array) -> ClipStatistics:
        """Reduces frames (n, height, width).

        Raises:
            InputError: frames of another shape or type, or fewer than `LEAST_FRAMES`.
        """
        if (
            frames.ndim != 3
            or frames.dtype != np.uint8
            or len(frames) < LEAST_FRAMES
            or min(frames.shape[1:]) < 16
        ):
            raise InputError(
                f"frames of shape {frames.shape} and type {frames.dtype}",
                fix=f"give uint8 (frame, height, width), at least {LEAST_FRAMES} frames of 16 px",
            )
        side = min(frames.shape[1:])
        top, left = (frames.shape[1] - side) // 2, (frames.shape[2] - side) // 2
        square = torch.from_numpy(frames[:, top : top + side, left : left + side].copy())
        small = functional.interpolate(
            square[None].float(), (SIDE, SIDE), mode="bilinear", antialias=True, align_corners=False
        )
        return cls(gray=small[0].numpy())

    @cached_property
    def mean(self) -> Float32Array:
        """(SIDE, SIDE), of all frames."""
        return self.gray.mean(axis=0)

    @cached_property
    def deviation(self) -> Float32Array:
        """(SIDE, SIDE), standard deviation in time [gray levels]."""
        return self.gray.std(axis=0)

    @cached_property
    def still(self) -> float:
        """Standard deviation of the noise [gray levels].

        Immerkær's filter (Computer Vision and Image Understanding 64, 1996), which smooth pictures
        pass not, over the changes from frame to frame, by the median: neither texture nor what
        moves counts as noise.
        """
        rough = ndimage.convolve(np.diff(self.gray, axis=0), _ROUGH[None], mode="nearest")
        return float(np.median(np.abs(rough[:, 1:-1, 1:-1]))) / (_MEDIAN * 6 * np.sqrt(2))

    @cached_property
    def excess(self) -> Float32Array:
        """(SIDE, SIDE), variance in time beyond the noise, 0 where a pixel is still."""
        return np.where(self.moving, self.deviation**2 - self.still**2, 0).astype(np.float32)

    @cached_property
    def moving(self) -> BoolArray:
        """(SIDE, SIDE)."""
        return self.deviation > max(_NOISES * self.still, LEAST_DEVIATION)

    @cached_property
    def contrast(self) -> float:
        """Standard deviation of the mean picture [gray levels]."""
        return float(self.mean.std())

    @cached_property
    def slope(self) -> Float32Array:
        """(SIDE, SIDE), length of the mean picture's gradient [gray levels/px]."""
        down, right = np.gradient(self.mean)
        return np.hypot(down, right)
