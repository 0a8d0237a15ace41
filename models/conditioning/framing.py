"""The square of the picture that is judged: about all places that the cloth visits, resampled once.

A still camera's square is averaged down as an ingested film's is
(`flagdata.ingest.camera.picture_geometry`). A moving one's is drawn by one warp that registers,
crops and scales; where it shrinks, on a finer grid that is then averaged. Beyond the
picture its border is repeated: a square is padded, never cut.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from PIL import Image

from flagdata.core.arrays import UInt8Array
from models.conditioning.camera_motion import Transform

FILL = 0.62
"""Longer side of the places that the cloth visits, in sides of the square: the middle of what
training films show."""
LEAST_FILL, MOST_FILL = 0.4, 0.85
"""Between these the largest centred square of a still picture is left as it is, and up to the
second a square is as small as the picture is, so that it need not be padded."""
_MARGIN = 0.03
_ASIDE = 0.08
"""How far the cloth may lie from the square's middle so that the square lies in the picture, in
sides of it."""


@dataclass(frozen=True, kw_only=True)
class Square:
    """Attributes:
    x, y: of its top left corner in the reference picture, which it may lie beyond [px].
    side: of it [px].
    """

    x: int
    y: int
    side: int

    def beyond(self, width: int, height: int) -> float:
        """Computes the share of the square beyond a picture of this size."""
        across = min(self.x + self.side, width) - max(self.x, 0)
        down = min(self.y + self.side, height) - max(self.y, 0)
        return 1 - max(across, 0) * max(down, 0) / self.side**2


def square_about(
    box: tuple[float, float, float, float], *, width: int, height: int, allow_centred: bool
) -> Square:
    """Chooses the square about a box of a picture.

    Args:
        box: left, top, right and bottom [px].
        width, height: of the picture [px].
        allow_centred: whether the largest centred square may be left as it is, where the box fills
            enough of it.
    """
    left, top, right, bottom = box
    extent = max(right - left, bottom - top)
    middle = centred_square(width, height)
    side = middle.side
    margin_x, margin_y = (_MARGIN * side if longest > side else 0.0 for longest in (width, height))
    inside = (
        left - margin_x >= middle.x
        and right + margin_x <= middle.x + side
        and top - margin_y >= middle.y
        and bottom + margin_y <= middle.y + side
    )
    if allow_centred and inside and LEAST_FILL <= extent / side <= MOST_FILL:
        return middle
    side = max(16, math.ceil(max(extent / MOST_FILL, min(extent / FILL, side))))
    return Square(
        x=_begin(left, right, side, width), y=_begin(top, bottom, side, height), side=side
    )


def centred_square(width: int, height: int) -> Square:
    """Returns the largest centred square of a picture of this size [px]."""
    side = min(width, height)
    return Square(x=(width - side) // 2, y=(height - side) // 2, side=side)


def _begin(low: float, high: float, side: int, length: int) -> int:
    """Returns where a square about low to high begins, moved towards the picture of this length
    where it reaches beyond."""
    about = (low + high - side) / 2
    inside = min(max(about, 0.0), length - side) if length >= side else (length - side) / 2
    return round(about + min(max(inside - about, -_ASIDE * side), _ASIDE * side))


def cut(picture: UInt8Array, square: Square, size: int) -> UInt8Array:
    """Crops a square of an unmoved picture (height, width) to (size, size)."""
    part = _continued_square(picture, square)
    if square.side == size:
        return np.ascontiguousarray(part)
    image = Image.fromarray(np.ascontiguousarray(part))
    return np.asarray(image.resize((size, size), Image.Resampling.HAMMING))


def _continued_square(picture: UInt8Array, square: Square) -> UInt8Array:
    """Returns a square of a picture (height, width), its edges continued where the square reaches
    beyond."""
    height, width = picture.shape
    left, top = min(max(square.x, 0), width - 1), min(max(square.y, 0), height - 1)
    right, bottom = (
        min(max(begin + square.side, 1), end)
        for begin, end in ((square.x, width), (square.y, height))
    )
    part = picture[top : max(bottom, top + 1), left : max(right, left + 1)]
    above, before = (min(max(-begin, 0), square.side - 1) for begin in (square.y, square.x))
    below, after = square.side - above - part.shape[0], square.side - before - part.shape[1]
    if not any((above, below, before, after)):
        return part
    return np.asarray(
        cv2.copyMakeBorder(part, above, below, before, after, cv2.BORDER_REPLICATE), dtype=np.uint8
    )


def warp(picture: UInt8Array, square: Square, size: int, transform: Transform) -> UInt8Array:
    """Crops the square of the reference picture, as a picture (height, width) shows it, to (size,
    size).

    Args:
        transform: from the reference picture to this one [px].
    """
    finer = max(
        1, math.ceil(square.side * float(np.hypot(transform[0, 0], transform[1, 0])) / size - 1e-9)
    )
    step = square.side / (size * finer)
    to_reference = np.array(
        [
            [step, 0.0, square.x + step / 2 - 0.5],
            [0.0, step, square.y + step / 2 - 0.5],
            [0.0, 0.0, 1.0],
        ]
    )
    grid = cv2.warpAffine(
        picture,
        transform @ to_reference,
        (size * finer, size * finer),
        flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )
    if finer > 1:
        grid = cv2.resize(grid, (size, size), interpolation=cv2.INTER_AREA)
    return np.asarray(grid, dtype=np.uint8)


def rescale_transform(transform: Transform, scale: float) -> Transform:
    """Rescales a transform between pictures shrunk by `scale` (new over old) to one between the
    pictures themselves."""
    linear = transform[:, :2]
    shift = scale / 2 - 0.5
    moved = linear @ np.array([shift, shift]) + transform[:, 2] - shift
    return np.column_stack([linear, moved / scale])
