"""Flat shapes with smooth edges: a pixel takes a colour in proportion to the share of it that a shape covers."""

from __future__ import annotations

import math
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
        fine: (rows · 4, columns · 4) index of each sub-sample's colour, painted on in place.
        colours: "#rrggbb" of the indices so far.
    """

    fine: NDArray[np.uint8] = field(repr=False)
    colours: list[str]

    @classmethod
    def blank(cls, *, rows: int, columns: int, colour: str) -> Sheet:
        """A sheet of one colour."""
        return cls(fine=np.zeros((rows * _FINE, columns * _FINE), dtype=np.uint8), colours=[colour])

    @cached_property
    def _grid(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        rows, columns = self.fine.shape
        x, y = (np.arange(columns) + 0.5) / rows, (np.arange(rows) + 0.5) / rows
        return x.astype(np.float32)[None, :], y.astype(np.float32)[:, None]

    def fill(self, colour: str) -> None:
        self.fine[:] = self._index(colour)

    def box(self, x: float, y: float, width: float, height: float, colour: str) -> None:
        px, py = self._grid
        columns, rows = (px[0] >= x) & (px[0] < x + width), (py[:, 0] >= y) & (py[:, 0] < y + height)
        self.fine[np.ix_(rows, columns)] = self._index(colour)

    def disc(self, x: float, y: float, radius: float, colour: str) -> None:
        self.where(self.in_disc(x, y, radius), colour)

    def in_disc(self, x: float, y: float, radius: float) -> NDArray[np.bool_]:
        """(sub-rows, sub-columns) which samples a disc covers."""
        px, py = self._grid
        return (px - np.float32(x)) ** 2 + (py - np.float32(y)) ** 2 <= np.float32(radius**2)

    def polygon(self, corners: Sequence[tuple[float, float]], colour: str) -> None:
        """A polygon, by the non-zero winding rule: a pentagram is filled."""
        self.where(self.inside(corners), colour)

    def star(self, x: float, y: float, radius: float, colour: str, *, points_to: float = -math.pi / 2) -> None:
        """A five-pointed star on a circle.

        Args:
            points_to: direction of one point from the middle, from +x towards +y, so clockwise as seen [rad].
        """
        turns = [points_to + 4 * math.pi / 5 * k for k in range(5)]
        self.polygon([(x + radius * math.cos(t), y + radius * math.sin(t)) for t in turns], colour)

    def turned(self, x: float, y: float, direction: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Coordinates of all samples about (x, y): the first in a direction from +x towards +y [rad], the second a
        quarter turn on, clockwise as seen."""
        px, py = self._grid
        dx, dy = px - np.float32(x), py - np.float32(y)
        c, s = np.float32(math.cos(direction)), np.float32(math.sin(direction))
        return np.asarray(dx * c + dy * s, dtype=np.float32), np.asarray(dy * c - dx * s, dtype=np.float32)

    def inside(self, corners: Sequence[tuple[float, float]]) -> NDArray[np.bool_]:
        """(sub-rows, sub-columns) which samples a polygon covers, by the non-zero winding rule."""
        px, py = self._grid
        winding = np.zeros(self.fine.shape, dtype=np.int8)
        for (ax, ay), (bx, by) in zip(corners, [*corners[1:], corners[0]], strict=True):
            if ay == by:
                continue
            rows = (py[:, 0] >= min(ay, by)) & (py[:, 0] < max(ay, by))
            edge = np.float32(ax) + (py[rows] - np.float32(ay)) * np.float32((bx - ax) / (by - ay))
            winding[rows] += np.where(px < edge, np.int8(1 if by > ay else -1), np.int8(0))
        return winding != 0

    def where(self, mask: NDArray[np.bool_], colour: str) -> None:
        self.fine[mask] = self._index(colour)

    def bytes(self) -> NDArray[np.uint8]:
        """(rows, columns, 3) sRGB, sub-samples averaged in linear light."""
        rows, columns = (n // _FINE for n in self.fine.shape)
        blocks = self.fine.reshape(rows, _FINE, columns, _FINE)
        mean = np.zeros((rows, columns, 3))
        for index, colour in enumerate(self.colours):
            share = (blocks == index).sum(axis=(1, 3)) / _FINE**2
            mean += share[:, :, None] * decoded(of_hex(colour))
        return np.rint(encoded(mean) * 255).astype(np.uint8)

    def _index(self, colour: str) -> int:
        if colour not in self.colours:
            self.colours.append(colour)
        return self.colours.index(colour)
