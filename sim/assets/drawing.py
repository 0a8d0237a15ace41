"""Flat shapes with smooth edges: a pixel takes a colour in proportion to the share of it that a shape covers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sim.assets.colour import decoded, encoded, of_hex

_FINE = 4  # sub-samples of a pixel in each direction


@dataclass(frozen=True, kw_only=True, eq=False)
class Sheet:
    """A drawing of height 1: x to the right and y downwards from the upper left corner.

    Attributes:
        fine: (rows · 4, columns · 4, 3) linear colours of sub-samples, painted on in place.
    """

    fine: NDArray[np.float32] = field(repr=False)

    @classmethod
    def blank(cls, *, rows: int, columns: int) -> Sheet:
        """A black sheet."""
        return cls(fine=np.zeros((rows * _FINE, columns * _FINE, 3), dtype=np.float32))

    @property
    def width(self) -> float:
        return self.fine.shape[1] / self.fine.shape[0]

    @cached_property
    def _grid(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        rows, columns = self.fine.shape[:2]
        return (np.arange(columns) + 0.5)[None, :] / rows, (np.arange(rows) + 0.5)[:, None] / rows

    def fill(self, colour: str) -> None:
        self.fine[:] = decoded(of_hex(colour))

    def disc(self, x: float, y: float, radius: float, colour: str) -> None:
        px, py = self._grid
        self.where((px - x) ** 2 + (py - y) ** 2 <= radius**2, colour)

    def box(self, x: float, y: float, width: float, height: float, colour: str) -> None:
        px, py = self._grid
        self.where((px >= x) & (px < x + width) & (py >= y) & (py < y + height), colour)

    def polygon(self, corners: Sequence[tuple[float, float]], colour: str) -> None:
        """A polygon, by the non-zero winding rule (a pentagram drawn corner by corner is filled)."""
        self.where(self.inside(corners), colour)

    def inside(self, corners: Sequence[tuple[float, float]]) -> NDArray[np.bool_]:
        """(sub-rows, sub-columns) which samples a polygon covers, by the non-zero winding rule."""
        px, py = self._grid
        winding = np.zeros(self.fine.shape[:2], dtype=np.int32)
        for (ax, ay), (bx, by) in zip(corners, [*corners[1:], corners[0]], strict=True):
            left = (bx - ax) * (py - ay) - (px - ax) * (by - ay)
            winding += ((ay <= py) & (by > py) & (left > 0)).astype(np.int32)
            winding -= ((ay > py) & (by <= py) & (left < 0)).astype(np.int32)
        return winding != 0

    def where(self, mask: NDArray[np.bool_], colour: str) -> None:
        self.fine[mask] = decoded(of_hex(colour))

    def bytes(self) -> NDArray[np.uint8]:
        """(rows, columns, 3) sRGB, sub-samples averaged in linear light."""
        rows, columns = (n // _FINE for n in self.fine.shape[:2])
        mean = self.fine.reshape(rows, _FINE, columns, _FINE, 3).mean(axis=(1, 3), dtype=np.float64)
        return np.rint(encoded(mean) * 255).astype(np.uint8)
