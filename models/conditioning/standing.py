"""Edges that stand still about the cloth: of the pole beside a flag, of a second one in it, or of a
bar along its side.

An edge stands still where the slope of the picture keeps its direction and strength for most of the
film. A straight line of such edges is looked for in each direction near the upright, and near the
level: pixels count whose slope is across the line, so that foliage and other textures, whose slopes
point everywhere, make none.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from flagdata.core.arrays import BoolArray, Float32Array, IntArray, UInt8Array

_PICTURES = 24
"""Pictures at most that are looked at."""
_BLUR = 1.2
"""Width of the Gaussian by which they are smoothed [px]."""
_ABSENT, _LEFT = 0.5, 0.5
"""Share of the time in which the slope of an edge at rest may be below this share of its mean:
cloth flies before it, and frames of a camera that moves are registered to a pixel. Higher takes
what comes again for what stands."""
_FAINT, _CLEAR = 1.0, 2.5
"""Slopes [gray levels/px] of the mean picture at which an edge ends, and from which on there is one
(Canny)."""
_ACROSS = 25.0
"""Degrees by which the slope at an edge may differ from that across a line."""
_TILT = 20
"""Degrees by which a line may differ from the upright, or the level, in steps of one."""
_GAP = 0.03
"""Gaps in a line, in lengths of what it is compared with: where cloth or a rope is before it."""
_OUTSIDE, _INSIDE = 0.25, 0.1
"""How far outside and inside a box's side a line is looked for, in sizes of the box: plain cloth at
its hoist moves too little to be found, and a slack rope keeps it from the pole. More takes what
stands in the background for a pole."""
_BESIDE = 0.22
"""Distance from the sides of a box from which on a line stands inside it, in widths: nearer, it may
be the hoist."""
_STEEP = 8
"""Degrees by which a second pole may differ from the upright."""
_BELOW, _GOES_ON = 0.25, 0.8
"""A line goes on below the cloth where it is seen on this share of so long a stretch, in heights of
the box: a pole does, a stripe of the cloth ends with it."""
_UNITS = 64
"""Steps of a slope of one gray level a pixel, as whole numbers."""

Box = tuple[float, float, float, float]
"""Left, top, right and bottom [px]."""


@dataclass(frozen=True, kw_only=True)
class Line:
    """A line of edges.

    Attributes:
        length: from its first row to its last, in heights of the box that it is compared with; 0
            where there is none.
        above, below: how far it reaches beyond the upper and the lower side of that box, in heights
            of it; negative where it ends inside.
    """

    length: float
    above: float
    below: float


@dataclass(frozen=True, kw_only=True)
class Inside:
    """Upright lines inside what moves.

    Attributes:
        height: of what moves along which the longest one stands, in heights of the box; 0 where
            there is none.
        going_on: the same of the longest one that goes on below what moves, as a pole does.
    """

    height: float
    going_on: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Standing:
    """Edges that stand still in a film.

    Attributes:
        upright: (height, width) those of lines near the upright.
        level: (height, width) those of lines near the level.
    """

    upright: BoolArray
    level: BoolArray

    @classmethod
    def of(cls, pictures: UInt8Array, inside: BoolArray, *, enlarged: float = 1.0) -> Standing:
        """Finds them.

        Args:
            pictures: (n, height, width) gray, registered, of the whole film.
            inside: (height, width) what the film shows: beyond its edge the picture is padded by
                stripes.
            enlarged: by how much the film was, which makes its edges less steep.
        """
        slopes = np.stack(
            [_slopes(picture) for picture in pictures[:: -(-len(pictures) // _PICTURES)]]
        )
        slopes *= max(enlarged, 1.0)
        mean = slopes.mean(axis=0)  # (2, height, width): along x and y
        steep = np.hypot(*mean)
        along = (slopes * (mean / np.maximum(steep, 1e-6))).sum(axis=1)
        rests = np.sort(along, axis=0)[int(_ABSENT * len(along))] > _LEFT * steep
        across, down = np.rint((mean * (rests & inside) * _UNITS).clip(-32_000, 32_000)).astype(
            np.int16
        )
        edges = cv2.Canny(across, down, _FAINT * _UNITS, _CLEAR * _UNITS, L2gradient=True) > 0
        angle = np.degrees(np.arctan2(np.abs(mean[1]), np.abs(mean[0])))
        return cls(upright=edges & (angle < _ACROSS), level=edges & (angle > 90 - _ACROSS))

    def beside(self, box: Box, sides: tuple[str, ...] = ("left", "right")) -> Line:
        """Finds the longest upright line at the left or right side of a box that reaches its rows.

        Args:
            sides: at which of them, of "left" and "right".
        """
        left, top, right, bottom = box
        out, within = (share * max(right - left, bottom - top) for share in (_OUTSIDE, _INSIDE))
        places = {"left": (left - out, left + within), "right": (right - within, right + out)}
        return _longest(self.upright, (top, bottom), tuple(places[side] for side in sides))

    def above(self, box: Box) -> Line:
        """Finds the longest level line at the top of a box, compared with its width; see
        `beside`."""
        return self._level(box, box[1])

    def below(self, box: Box) -> Line:
        """Finds the longest level line at the bottom of a box, compared with its width; see
        `beside`."""
        return self._level(box, box[3])

    def inside(self, box: Box, places: BoolArray) -> Inside:
        """Finds upright lines inside what moves, away from the left and right side of a box.

        Args:
            box: of what moves.
            places: (height, width) all places that it visits.
        """
        left, top, right, bottom = box
        columns = np.arange(
            round(left + _BESIDE * (right - left)), round(right - _BESIDE * (right - left)) + 1
        )
        columns = columns[(columns >= 0) & (columns < places.shape[1])]
        high, middle = bottom - top, (top + bottom) / 2
        within = np.asarray(cv2.erode(places.astype(np.uint8), np.ones((3, 3), np.uint8)), np.uint8)
        lines = _lines(_widen_edges(self.upright), middle, columns, _STEEP) > 0
        moving = _lines(within, middle, columns, _STEEP) > 0
        heights = (lines & moving).sum(axis=1) / high
        if not heights.size:
            return Inside(height=0.0, going_on=0.0)
        rows = np.arange(len(places))[:, None]
        last = np.where(moving, rows, -1).max(axis=1, keepdims=True)
        beneath = (rows > last) & (rows <= last + _BELOW * high)
        seen = (lines & beneath).sum(axis=1) >= _GOES_ON * _BELOW * high
        return Inside(height=float(heights.max()), going_on=float((heights * seen).max()))

    def _level(self, box: Box, row: float) -> Line:
        left, top, right, bottom = box
        near = _INSIDE * max(right - left, bottom - top)
        return _longest(self.level.T, (left, right), ((row - near, row + near),))


def _slopes(picture: UInt8Array) -> Float32Array:
    """Computes the slopes (2, height, width) of a smoothed picture along x and y [gray
    levels/px]."""
    smooth = cv2.GaussianBlur(picture.astype(np.float32), (0, 0), _BLUR)
    return np.stack([cv2.Sobel(smooth, cv2.CV_32F, x, 1 - x, ksize=3) / 8 for x in (1, 0)]).astype(
        np.float32
    )


def _widen_edges(edges: BoolArray) -> UInt8Array:
    """Widens edges (height, width) by a pixel to each side."""
    return np.asarray(cv2.dilate(edges.astype(np.uint8), np.ones((1, 3), np.uint8)), np.uint8)


def _lines(picture: UInt8Array, middle: float, columns: IntArray, tilt: int) -> UInt8Array:
    """Returns what a picture (height, width) shows along lines: (tilt, row, column), 0 beyond its
    sides.

    Args:
        middle: row at which a line has its column.
        columns: (n,) of the lines.
        tilt: up to which lines differ from the upright [degrees].
    """
    height, width = picture.shape
    rows = np.arange(height)
    tilts = np.tan(np.radians(np.arange(-tilt, tilt + 1)))
    moved = np.rint(tilts[:, None] * (rows - middle)).astype(int)[..., None] + columns
    shown = picture[rows[:, None], moved.clip(0, width - 1)]
    return np.where((moved >= 0) & (moved < width), shown, 0).astype(np.uint8)


def _longest(
    edges: BoolArray, ends: tuple[float, float], places: tuple[tuple[float, float], ...]
) -> Line:
    """Finds the longest line down the rows of edges (height, width), and compares it with the
    distance of `ends`.

    Args:
        ends: rows between which a part of the line is.
        places: ranges of columns in one of which it lies at the middle of `ends`.
    """
    height, width = edges.shape
    extent = ends[1] - ends[0]
    columns = np.arange(width)
    wanted = np.any([(columns >= low) & (columns <= high) for low, high in places], axis=0)
    if not wanted.any():
        return Line(length=0.0, above=0.0, below=0.0)
    lines = _lines(_widen_edges(edges), (ends[0] + ends[1]) / 2, columns[wanted], _TILT)
    gap = 2 * round(_GAP * extent / 2) + 1
    longest, last = 0, 0
    run, reaches = np.zeros(lines.shape[::2], int), np.zeros(lines.shape[::2], bool)
    absent = np.full(lines.shape[::2], gap + 1)
    for row in range(height):
        present = lines[:, row] > 0
        absent = np.where(present, 0, absent + 1)
        ended = absent > gap
        run = np.where(ended, 0, run + 1)
        reaches = ~ended & (reaches | (present & (ends[0] <= row <= ends[1])))
        if (now := int(np.where(present & reaches, run, 0).max())) > longest:
            longest, last = now, row
    if not longest:
        return Line(length=0.0, above=0.0, below=0.0)
    first = last - longest + 1
    return Line(
        length=longest / extent,
        above=(ends[0] - first) / extent,
        below=(last + 1 - ends[1]) / extent,
    )
