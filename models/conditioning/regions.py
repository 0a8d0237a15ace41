"""Where cloth moves: regions of registered pictures, the most like a flag first.

A flag changes the picture at the scale of its folds, leaves and water at that of their texture. So
regions are sought in differences of strongly shrunk frames, in which a fine texture averages out,
and each is then outlined in the pictures themselves by all places that it visits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from flagdata.core.arrays import BoolArray, Float32Array, FloatArray, UInt8Array

Side = Literal["left", "right", "top"]
_COARSE = 120
"""Longer side [px] of the shrunk frames."""
_SEED = 0.15
"""Share of the strongest change from which on a region is sought."""
MOMENT = 0.2
"""Time [s] between pictures that are compared, where there are pictures so near: a part of a
flutter's period."""
_FAINTEST = 0.5
"""Gray levels of change that shrunk noise and coding leave at most."""
_BRIDGE = 0.02
"""Gap between parts of one cloth, as a share of the longer side."""
_NUMBERED = 0.1
"""Share of the first region's motion that another has to have to be numbered."""
_MOST = 6
_VISITED = 0.12
"""Share of the region's strongest deviation from which on a place counts as visited, beyond the
noise."""
_NOISES = 5.0
_DEVIATION = 48
"""Pictures of which the deviation is taken."""
_REACH = 0.35
"""How far a cloth may reach beyond the region of its strong motion, in sizes of the region."""
_CLOSED = 0.08
"""Width of folds and plain parts that are closed to an outline, in sizes of the region."""

_END, _HOIST = 0.12, 0.25
"""Width of the ends whose motion is compared, and of the one over which the height at the hoist is
taken, in widths."""
_ALIKE = 0.8
"""Ratio of motions from which on two ends move alike."""
_THIN = 0.05
"""Half the width of a pole at most, in sizes of the region."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Region:
    """A part of the picture in which cloth moves.

    Attributes:
        mask: (height, width) all places that it visits, in pictures of `camera.WORK` px.
        share: of the motion of all regions, 0 to 1.
        hoist: the side at which it hangs: where it moves least.
        aspect: width over height of the outline across the hoist, for a flag that flies to the
            side.
    """

    mask: BoolArray
    share: float
    hoist: Side
    aspect: float

    @property
    def box(self) -> tuple[int, int, int, int]:
        """Left, top, right and bottom of the places [px], the last two beyond them."""
        rows, columns = np.flatnonzero(self.mask.any(axis=1)), np.flatnonzero(self.mask.any(axis=0))
        return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1

    @property
    def droop(self) -> float:
        """Angle below the level of the line from the middle of the places at the hoist to that of
        the places at the free end [rad]; negative where the free end is higher, 0 where the cloth
        hangs from its top."""
        if self.hoist == "top":
            return 0.0
        left, _, right, _ = self.box
        columns = np.flatnonzero(self.mask.any(axis=0))
        middles = np.array([np.flatnonzero(self.mask[:, column]).mean() for column in columns])
        away = (columns + 0.5 - left) / (right - left)
        away = away if self.hoist == "left" else 1 - away
        at_hoist, at_end = away < _HOIST, away > 1 - _HOIST
        across = (away[at_end].mean() - away[at_hoist].mean()) * (right - left)
        return float(np.arctan2(middles[at_end].mean() - middles[at_hoist].mean(), across))


def regions_of(
    pictures: UInt8Array, times: FloatArray, *, within: BoolArray | None = None
) -> tuple[Region, ...]:
    """Finds the regions of a film that move like cloth, the strongest motion first; none where
    nothing moves.

    Args:
        pictures: (n, height, width) gray, registered, in order; n of 3 or more.
        times: (n,) of them [s]: between pictures far apart clouds move as well, and the light
            changes.
        within: (height, width) where to look; everywhere by default.
    """
    height, width = pictures.shape[1:]
    coarse = _shrunk(pictures)
    adjacent = nearby(times)
    change = np.abs(coarse[1:][adjacent] - coarse[:-1][adjacent]).mean(axis=0)
    change = cv2.GaussianBlur(change, (0, 0), 1.0)
    floor = float(np.median(change))
    change = np.maximum(change - floor, 0.0)
    change = np.asarray(
        cv2.resize(change, (width, height), interpolation=cv2.INTER_LINEAR), np.float32
    )
    if within is not None:
        change[~within] = 0.0
    peak = float(np.quantile(change, 0.998)) if within is None else float(change.max())
    if peak < _FAINTEST:
        return ()
    seeds = (change > max(_SEED * peak, _FAINTEST / 2)).astype(np.uint8)
    joined = cv2.morphologyEx(seeds, cv2.MORPH_CLOSE, _disc(_BRIDGE * max(height, width)))
    count, labels = cv2.connectedComponents(joined)
    weights = np.bincount(
        labels.ravel(), weights=np.square(change.ravel()) * seeds.ravel(), minlength=count
    )[1:]
    if not weights.any():
        return ()
    order = [
        int(k)
        for k in np.argsort(-weights, kind="stable")[:_MOST]
        if weights[k] >= _NUMBERED * weights.max()
    ]
    deviation = _deviation(pictures)
    chosen = np.isin(labels, [k + 1 for k in order])
    regions = []
    for k in order:
        region = labels == k + 1
        mask = _outline(region, chosen & ~region, deviation, within)
        hoist, aspect = _hoist(mask, deviation)
        regions.append(
            Region(mask=mask, share=float(weights[k] / weights.sum()), hoist=hoist, aspect=aspect)
        )
    return tuple(regions)


def nearby(times: FloatArray) -> BoolArray:
    """Returns (n − 1,) whether each picture follows the one before so soon that they are
    compared."""
    intervals = np.diff(times)
    return intervals <= max(MOMENT, float(intervals.min()) * 1.5)


def _shrunk(pictures: UInt8Array) -> Float32Array:
    height, width = pictures.shape[1:]
    scale = min(1.0, _COARSE / max(height, width))
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    shrunk = [
        cv2.resize(picture.astype(np.float32), size, interpolation=cv2.INTER_AREA)
        for picture in pictures
    ]
    return np.stack(shrunk).astype(np.float32)


def _deviation(pictures: UInt8Array) -> Float32Array:
    """Computes the 95 % quantile (height, width) of the distance from the median in time: a rare
    visit counts."""
    subset = pictures[:: -(-len(pictures) // _DEVIATION)]
    middle = np.median(subset, axis=0).astype(np.int16)
    away = np.sort(np.abs(subset.astype(np.int16) - middle), axis=0)
    rank = min(len(away) - 1, int(np.ceil(0.95 * len(away))))
    return np.asarray(cv2.GaussianBlur(away[rank].astype(np.float32), (0, 0), 1.0), np.float32)


def _outline(
    region: BoolArray,
    other_regions: BoolArray,
    deviation: Float32Array,
    within: BoolArray | None,
) -> BoolArray:
    """Outlines all places that the cloth visits, its plain parts and the gaps between folds
    filled."""
    size = _size(region)
    noise = float(np.median(deviation))
    moving = deviation > max(
        _NOISES * noise, _VISITED * float(np.quantile(deviation[region], 0.99)), 2.0
    )
    reachable = (
        cv2.dilate(region.astype(np.uint8), _disc(_REACH * size)).astype(bool) & ~other_regions
    )
    if within is not None:
        reachable &= within
    moving = (moving & reachable) | region
    moving = (
        cv2.morphologyEx(moving.astype(np.uint8), cv2.MORPH_OPEN, _disc(1.5)).astype(bool) | region
    )
    _, labels = cv2.connectedComponents(moving.astype(np.uint8))
    connected = np.isin(labels, np.unique(labels[region])) & moving
    pad = int(np.ceil(_CLOSED * size)) + 1
    padded = np.pad(connected.astype(np.uint8), pad)
    closed = cv2.morphologyEx(padded, cv2.MORPH_CLOSE, _disc(_CLOSED * size))[pad:-pad, pad:-pad]
    contours, _ = cv2.findContours(
        np.ascontiguousarray(closed), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    filled = np.zeros_like(closed)
    cv2.drawContours(filled, contours, -1, 1, thickness=cv2.FILLED)
    return _without_pole(np.asarray(filled, dtype=np.uint8), size).astype(bool)


def _without_pole(mask: UInt8Array, size: float) -> UInt8Array:
    """Removes long strips as thin as a pole that sways from the mask; a tip stays, as it is
    short."""
    body = cv2.morphologyEx(mask, cv2.MORPH_OPEN, _disc(_THIN * size))
    return (
        mask & np.asarray(cv2.dilate(body, _disc(2 * _THIN * size)), np.uint8)
        if body.any()
        else mask
    )


def _hoist(mask: BoolArray, deviation: Float32Array) -> tuple[Side, float]:
    """Finds the side at which the cloth moves least, and its width over its height there."""
    rows, columns = np.nonzero(mask)
    moves = deviation[rows, columns]
    left, right, top, bottom = columns.min(), columns.max(), rows.min(), rows.max()
    wide, high = right - left + 1, bottom - top + 1
    at_left, at_right = columns < left + _END * wide, columns > right - _END * wide
    at_top, at_bottom = rows < top + _END * high, rows > bottom - _END * high
    of_left, of_right, of_top, of_bottom = (
        float(moves[at].mean()) for at in (at_left, at_right, at_top, at_bottom)
    )
    if min(of_left, of_right) > _ALIKE * max(of_left, of_right) and of_top < of_bottom * _ALIKE:
        return "top", float(wide / high)
    at_hoist = (
        columns < left + _HOIST * wide if of_left <= of_right else columns > right - _HOIST * wide
    )
    return ("left" if of_left <= of_right else "right"), float(wide / (np.ptp(rows[at_hoist]) + 1))


def _size(mask: BoolArray) -> float:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return float(max(rows[-1] - rows[0], columns[-1] - columns[0]) + 1)


def _disc(radius: float) -> UInt8Array:
    side = 2 * max(1, round(radius)) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)).astype(np.uint8)
