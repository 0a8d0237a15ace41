"""Whether the whole cloth is in the picture: how much of it moves at the picture's own edge, frame
by frame."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray, UInt8Array
from models.conditioning.camera_motion import STILL, Transform
from models.conditioning.regions import nearby

SIDES = ("left", "upper", "right", "lower")
CUT = 0.12
"""Length along the edge that moves, in sizes of the cloth, above which the edge cuts it off: of six
films of whole flags none has more than 0.08, of two that are cut off none less than 0.17."""
_CHANGE = 6.0
"""Gray levels of change from one picture of the sample to the next from which on a pixel moves."""
_STRIP = 2
"""Width [px] of the strip along the edge."""
_NEAR = 5
"""Pixels about the places of the cloth that belong to it."""


def at_edges(
    registered: UInt8Array, times: FloatArray, transforms: Sequence[Transform], mask: BoolArray
) -> FloatArray:
    """Measures how much of the cloth moves at the picture's edges: (n, 4) length along each of
    `SIDES`, in sizes of the cloth.

    Args:
        registered: (n, height, width) gray, in order.
        times: (n,) of them [s]; a picture far from the one before is judged as the next one.
        transforms: of each picture, from the reference to it.
        mask: (height, width) all places that the cloth visits.
    """
    count, height, width = registered.shape
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    size = max(np.ptp(rows), np.ptp(columns)) + 1
    cloth = cv2.dilate(mask.astype(np.uint8), np.ones((_NEAR, _NEAR), np.uint8)) > 0
    y, x = np.indices((height, width))
    nearest = np.argmin([x, y, width - 1 - x, height - 1 - y], axis=0)
    pictures = registered.astype(np.int16)
    inside = [_inside(transform, (height, width)) for transform in transforms]
    lengths = np.zeros((count, len(SIDES)))
    near_before = np.concatenate([[False], nearby(times)])
    for k in np.flatnonzero(near_before).tolist():
        overlap = inside[k] & inside[k - 1]
        ring = overlap & ~_erode_mask(overlap, _STRIP) & cloth
        moving = nearest[ring & (np.abs(pictures[k] - pictures[k - 1]) > _CHANGE)]
        lengths[k] = np.bincount(moving, minlength=len(SIDES)) / _STRIP / size
    for k in np.flatnonzero(~near_before)[::-1].tolist():
        lengths[k] = lengths[min(k + 1, count - 1)]
    return lengths


def _inside(transform: Transform, shape: tuple[int, int]) -> BoolArray:
    """Masks the pixels of the reference picture that lie in a picture, without its outermost
    pixels."""
    ones = np.ones(shape, np.uint8)
    if transform is not STILL:
        moved = cv2.warpAffine(
            ones, transform, shape[::-1], flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
        )
        ones = np.asarray(moved, dtype=np.uint8)
    return _erode_mask(ones > 0, 1)


def _erode_mask(mask: BoolArray, width: int) -> BoolArray:
    square = np.ones((2 * width + 1, 2 * width + 1), np.uint8)
    eroded = cv2.erode(mask.astype(np.uint8), square, borderType=cv2.BORDER_CONSTANT, borderValue=0)
    return np.asarray(eroded, dtype=np.bool_)
