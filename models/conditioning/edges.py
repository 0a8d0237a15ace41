"""The camera's motion where the background has no corners: by its edges, as of a pole before a plain sky.

The shift of a frame is that at which the edges of the reference picture fit it best: least squares between slopes and
differences (Lucas and Kanade, IJCAI 1981) over the edges' pixels, with Huber's weights, from coarse to fine. Along an
edge a shift does not show; there it stays near that of the frame before.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

_BLURS = (4.0, 1.5)
"""Widths of the Gaussians [px] by which pictures are smoothed, coarse to fine."""
_STEPS = 8
_STEEP = 4.0
"""Slope [gray levels/px] from which on a pixel belongs to an edge."""
_FEWEST = 60
_MOST = 4000
_HUBER = 6.0
"""Gray levels up to which a difference counts in full."""
_STIFF = 0.001
"""Weight of staying at the guess, in that of the steeper direction's slopes."""
_JERK, _GRID = 48, 3
"""Reach and step [px] of the search for a frame that is not near the one before."""
_LOOKED = 400
_FITS = 0.6
"""Share of the edges' pixels that differ by less than twice `_HUBER` where a shift fits."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Edges:
    """Pixels of the background's edges in a reference picture, at each blur.

    Attributes:
        places: (n, 2) x and y [px].
        values: (blur, n) gray levels.
        slopes: (blur, n, 2) along x and y [gray levels/px].
        axes: (a, 2) unit vectors along which the picture may shift: both, or the one across a single straight edge.
    """

    places: NDArray[np.float32]
    values: NDArray[np.float32]
    slopes: NDArray[np.float32]
    axes: NDArray[np.float64]

    @classmethod
    def of(cls, reference: NDArray[np.uint8], outside: NDArray[np.bool_]) -> Edges | None:
        """Those of a picture (height, width) in places that may be the background's; None where there are too few."""
        smoothed = [_smoothed(reference, blur) for blur in _BLURS]
        slopes = [
            np.stack([cv2.Sobel(picture, cv2.CV_32F, x, 1 - x, ksize=3) / 8 for x in (1, 0)], axis=-1)
            for picture in smoothed
        ]
        steep = np.linalg.norm(slopes[-1], axis=-1)
        steep[~outside] = 0.0
        chosen = np.flatnonzero(steep >= _STEEP)
        if len(chosen) < _FEWEST:
            return None
        chosen = chosen[:: -(-len(chosen) // _MOST)]
        rows, columns = np.unravel_index(chosen, reference.shape)
        return cls(
            places=np.stack([columns, rows], axis=1).astype(np.float32),
            values=np.stack([picture[rows, columns] for picture in smoothed]).astype(np.float32),
            slopes=np.stack([slope[rows, columns] for slope in slopes]).astype(np.float32),
            axes=np.eye(2),
        )

    @property
    def across(self) -> Edges:
        """The same, shifting only across the edges, where a shift shows best."""
        slopes = self.slopes[-1].astype(np.float64)
        return replace(self, axes=np.linalg.eigh(slopes.T @ slopes)[1][:, 1:].T)

    def misfit(self, picture: NDArray[np.uint8], shift: tuple[float, float]) -> float:
        """Mean difference of a picture from the reference at a shift [gray levels], each up to twice `_HUBER`."""
        away = self._difference(_smoothed(picture, _BLURS[-1]), -1, np.array(shift))
        return float(np.minimum(np.abs(away), 2 * _HUBER).mean())

    def shift(self, picture: NDArray[np.uint8], guess: tuple[float, float]) -> tuple[float, float] | None:
        """Along x and y [px], from the reference picture to this one; None where none fits.

        Args:
            guess: of a frame nearby.
        """
        smoothed = [_smoothed(picture, blur) for blur in _BLURS]
        near = np.array(guess, dtype=np.float64)
        shift = self._refined(smoothed, near)
        if shift is None:
            shift = self._refined(smoothed, self._searched(smoothed[0], near))
        return None if shift is None else (float(shift[0]), float(shift[1]))

    def _refined(self, smoothed: list[NDArray[np.float32]], guess: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """The shift near a guess; None where it does not fit."""
        shift, difference = guess.copy(), np.zeros(len(self.places))
        for level, picture in enumerate(smoothed):
            slopes = self.slopes[level].astype(np.float64)
            for _ in range(_STEPS):
                difference = self._difference(picture, level, shift)
                weight = np.minimum(1.0, _HUBER / np.maximum(np.abs(difference), 1e-6))
                square = (slopes * weight[:, None]).T @ slopes
                stiff = _STIFF * float(np.linalg.eigvalsh(square)[-1])
                wanted = (slopes * weight[:, None]).T @ -difference - stiff * (shift - guess)
                inside = self.axes @ (square + stiff * np.eye(2)) @ self.axes.T
                step = self.axes.T @ np.linalg.solve(inside, self.axes @ wanted)
                shift = shift + step
                if np.abs(step).max() < 0.01:
                    break
            difference = self._difference(picture, level, shift)
        fits = (np.abs(difference) < 2 * _HUBER).mean() >= _FITS
        return shift if fits else None

    def _searched(self, smoothed: NDArray[np.float32], guess: NDArray[np.float64]) -> NDArray[np.float64]:
        """The best of all shifts on a grid about a guess: after a jerk of the camera."""
        steps = np.arange(-_JERK, _JERK + 1, _GRID, dtype=np.float64)
        shifts = (
            guess + np.stack(np.meshgrid(*[steps] * len(self.axes)), axis=-1).reshape(-1, len(self.axes)) @ self.axes
        )
        some = slice(None, None, max(1, len(self.places) // _LOOKED))
        at = (self.places[some][None] + shifts[:, None]).astype(np.float32)
        seen = cv2.remap(smoothed, at[..., 0], at[..., 1], cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
        misfit = np.minimum(np.abs(seen - self.values[0][some]), 2 * _HUBER).mean(axis=1)
        away = np.linalg.norm(shifts - guess, axis=1) / _JERK
        return shifts[int(np.argmin(misfit + 0.1 * _HUBER * away))]

    def _difference(self, smoothed: NDArray[np.float32], level: int, shift: NDArray[np.float64]) -> NDArray[np.float64]:
        at = (self.places + shift).astype(np.float32)
        seen = cv2.remap(smoothed, at[:, :1], at[:, 1:], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(seen, dtype=np.float64)[:, 0] - self.values[level]


def _smoothed(picture: NDArray[np.uint8], blur: float) -> NDArray[np.float32]:
    return np.asarray(cv2.GaussianBlur(picture.astype(np.float32), (0, 0), blur), dtype=np.float32)
