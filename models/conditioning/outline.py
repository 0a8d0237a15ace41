"""The cloth's mask in every picture of a film that was made fit, and where its hoist is.

A place that the cloth leaves bare shows the same value again and again, so the narrowest fifth of a pixel's values is
taken for what is behind, the *still picture*. Where cloth always covers a place, the still picture shows cloth. The two
differ in what surrounds them: background that is bare is joined to the outside of the cloth's region through
places that are bare at the same instant and that no edge of the still picture separates; cloth is not, since its
outline, which differs from the still picture, lies between.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from models.conditioning.conditioning import Conditioning
from models.conditioning.regions import Region, Side

HALVED = 2
"""By how much pictures are averaged down before cloth is sought in them."""
SAMPLE = 120
"""Pictures at most that the still picture is of."""
_MODE = 0.2
"""Share of a pixel's values that the still picture is of."""
_DIFFERENT = 5.0
"""Gray levels from the still picture from which on a place is not bare."""
_HALF = 0.5
"""Share of the difference beside it from which on a pixel on an outline is cloth."""
_LEFT = 0.2
"""Share of its difference from what is behind up to which a place of the core counts as left by the cloth."""
_SHADED = 4.0
"""Gray levels by which the narrowest fifth of a pixel's values is wider than of the background, where it is cloth whose
shade changes."""
_EDGE, _TEXTURED = 4.0, 1.5
"""Gradient of the still picture [gray levels a pixel] that separates two places: a part that is fixed, and one by the
background's own texture."""
_TEXTURE_NEAR = 12.0
"""Pixels over which the background's texture is averaged."""
_JOINED = 0.5
"""Share of its bare instants in which a place has to be joined to the outside to be background."""
_BAY, _SPUR = 0.12, 0.04
"""Radius of the widest bay of the core that is filled and of the widest spur that is taken off, over the square root of
the area in which cloth is sought."""
_HELD = 0.12
"""Width of the strip at the hoist through which nothing is joined, in sizes of the region."""
_CLEAR = 10.0
"""Difference from the still picture [gray levels] beside an outline that is clear."""
_BEFORE, _BEHIND = 0.08, 0.08
"""How far from where motion ends the hoist may be, towards the pole and towards the cloth, in sizes of the region."""
_UPRIGHT = 0.5
"""Strength of an upright edge there over the strongest one's from which on it may be the pole's side at the cloth."""
_BEYOND = 0.2
"""Height of the parts above and below the cloth in which the pole's edges are sought, in sizes of the region."""
_FAINT = 3.0
"""Gray levels of an upright edge below which no pole is found, and the hoist is where motion ends."""
_LEAST_MOVED = 2.0
"""Factor by which an upright edge at one side has to be stronger than at the side where motion is least."""
_NEAR_HOIST = (0.03, 0.2)
"""Part of the region, in its sizes from the hoist, whose edges are extended to the hoist."""

Masks = NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False)
class Outliner:
    """Finds the cloth in pictures of one film.

    Attributes:
        still: (rows, columns) the still picture.
        core: (rows, columns) places that cloth covers most of the time, of which the still picture shows cloth.
        behind: (rows, columns) what is behind the core, continued from around it.
        within: (rows, columns) uint8, 1 where cloth is sought.
        edge: (rows, columns) edges of the still picture.
        hoist: the side at which the cloth hangs.
    """

    still: NDArray[np.float32]
    core: Masks
    behind: NDArray[np.float32]
    within: NDArray[np.uint8]
    edge: Masks
    hoist: Literal["left", "right"]

    @classmethod
    def of(cls, pictures: Sequence[NDArray[np.uint8]] | NDArray[np.uint8], found: Conditioning) -> Outliner | None:
        """From pictures as `Conditioning.show` gives them, spread over the film or a part of it in one light; None
        where nothing moves, or a cloth that moves least at its top and has no pole at either side.

        Args:
            pictures: (size, size) each; `SAMPLE` of them are taken.
            found: of the film.
        """
        region = found.region
        if region is None or len(pictures) < 10:
            return None
        small = np.stack([halved(picture) for picture in pictures[:: -(-len(pictures) // SAMPLE)]])
        still, width = _still(small)
        within, hoist = _within(found, still, region)
        if hoist is None or not within.any():
            return None
        outside = within == 0
        texture = _blurred(np.where(outside, np.abs(still - cv2.GaussianBlur(still, (0, 0), 2)), 0.0), _TEXTURE_NEAR)
        texture = texture / np.maximum(_blurred(outside, _TEXTURE_NEAR), 1e-3)
        across, down = (cv2.Sobel(still, cv2.CV_32F, *axis, ksize=3) / 8 for axis in ((1, 0), (0, 1)))
        edge = np.hypot(across, down) > _EDGE + _TEXTURED * texture
        shaded = width > float(np.median(width[outside])) + _SHADED
        entrances = _entrances(within, hoist)
        bare = np.stack([~_differs(picture, still) for picture in small])
        joined = np.stack([_joined((within > 0) & one & ~edge & ~shaded, entrances) for one in bare])
        always = joined.sum(axis=0) < _JOINED * np.maximum(bare.sum(axis=0), 1)
        core = cv2.morphologyEx((always & (within > 0)).astype(np.uint8), cv2.MORPH_OPEN, _disc(2))
        core = cv2.erode(core, _disc(1), borderType=cv2.BORDER_REPLICATE) > 0  # a gradient is as wide on either side
        core = _hanging(core, within, hoist) | (always & (within > 0) & _strip(within, hoist, 2))
        around = np.clip(np.rint(still), 0, 255).astype(np.uint8)
        behind = cv2.inpaint(around, cv2.dilate(core.astype(np.uint8), _disc(2)), 3, cv2.INPAINT_TELEA)
        return cls(
            still=still, core=core, behind=behind.astype(np.float32), within=within, edge=edge, hoist=hoist
        )  # fmt: skip

    def mask(self, picture: NDArray[np.uint8]) -> tuple[Masks, float]:
        """The cloth in a picture (size, size), at half its size, and the share of its free outline that is clear."""
        small = halved(picture)
        differs, inside = _differs(small, self.still), self.within > 0
        apart, near = np.abs(self.still - self.behind), np.abs(small - self.behind)
        left = self.core & (apart > 2 * _DIFFERENT) & (near < np.maximum(_DIFFERENT, _LEFT * apart))
        left &= _joined(inside & (left | ~(differs | self.core)), _entrances(self.within, self.hoist))
        cloth = (inside & np.where(self.core, ~left, differs)).astype(np.uint8)
        cloth = cv2.morphologyEx(cloth, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        cloth = np.asarray(cv2.morphologyEx(cloth, cv2.MORPH_CLOSE, _disc(2)), np.uint8)
        count, labels, statistics, _ = cv2.connectedComponentsWithStats(cloth)
        if count < 2:
            return np.zeros(cloth.shape, bool), 0.0
        cloth = (labels == 1 + int(statistics[1:, cv2.CC_STAT_AREA].argmax())).astype(np.uint8)
        contours, _ = cv2.findContours(cloth, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(cloth, contours, -1, 1, thickness=cv2.FILLED)
        return cloth > 0, self._clear(cloth, small)

    def ends(self, masks: Masks) -> NDArray[np.float64] | None:
        """(2, 2) upper and lower end of the hoist: column and row [px], the first pixel's middle at 0.5; None where the
        masks do not show it.

        Args:
            masks: (n, rows, columns) of pictures of the film.
        """
        columns = np.flatnonzero(self.within.any(axis=0))
        size = float(np.ptp(columns) + 1)
        at, away = (columns[0], 1) if self.hoist == "left" else (columns[-1], -1)
        low, high = (max(1, round(share * size)) for share in _NEAR_HOIST)
        chosen = at + away * np.arange(low, high + 1)
        mean = masks[:, :, chosen].mean(axis=0)
        shown = mean > 0.5
        if not shown.any(axis=0).all():
            return None
        upper = shown.argmax(axis=0).astype(np.float64)
        lower = shown.shape[0] - shown[::-1].argmax(axis=0).astype(np.float64)
        line = at + 0.5 - 0.5 * away
        return np.array([[line, np.polyfit(chosen + 0.5 - line, rows, 1)[1]] for rows in (upper, lower)])

    def _clear(self, cloth: NDArray[np.uint8], small: NDArray[np.float32]) -> float:
        outline = (cloth > 0) & (cv2.erode(cloth, np.ones((3, 3), np.uint8)) == 0)
        outline &= ~_strip(self.within, self.hoist)
        if not outline.any():
            return 0.0
        beside = cv2.dilate(np.abs(small - self.still), np.ones((3, 3), np.uint8)) > _CLEAR
        near = cv2.dilate(self.edge.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
        return float((beside | (near & self.core))[outline].mean())


def halved(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    """A picture averaged down by `HALVED`."""
    size = (picture.shape[1] // HALVED, picture.shape[0] // HALVED)
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.float32)


def _within(
    found: Conditioning, still: NDArray[np.float32], region: Region
) -> tuple[NDArray[np.uint8], Literal["left", "right"] | None]:
    """The hull of the weighted part of the pictures, as far as the hoist, and the hoist's side: where motion is least,
    unless an upright edge at the other side is much stronger, as a pole's. A flag in strong wind may move least at its
    top: then the stronger upright edge decides, and None is the side of a cloth without any."""
    shown = (found.weight >= 1).astype(np.uint8)
    shown = np.asarray(cv2.resize(shown, still.shape[::-1], interpolation=cv2.INTER_NEAREST), np.uint8)
    contours, _ = cv2.findContours(shown, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    hull = np.zeros(still.shape, np.uint8)
    if not contours:
        return hull, "left"
    cv2.fillConvexPoly(hull, cv2.convexHull(np.concatenate(contours)), 1)
    scale = still.shape[1] / found.square.side
    left, top, right, bottom = (edge / found.scale * scale for edge in region.box)
    x = found.square.x * scale
    size = max(right - left, bottom - top)
    begins, at_left = _upright(still, hull, place=left - x, size=size, away=1)
    ends, at_right = _upright(still, hull, place=right - x, size=size, away=-1)
    at_left, at_right = (s * (_LEAST_MOVED if region.hoist == side else 1) for s, side in
                         ((at_left, "left"), (at_right, "right")))  # fmt: skip
    if region.hoist == "top" and max(at_left, at_right) < _FAINT:
        return hull, None
    if at_left >= at_right:
        hull[:, :begins] = 0
        return hull, "left"
    hull[:, ends:] = 0
    return hull, "right"


def _upright(
    still: NDArray[np.float32], hull: NDArray[np.uint8], *, place: float, size: float, away: int
) -> tuple[int, float]:
    """The column at which the cloth would begin: of the strong upright edges above and below it the one nearest to the
    cloth, a pole's; and the strength of the strongest [gray levels].

    Args:
        place: column at which motion ends.
        size: of the region [px].
        away: 1 where the cloth flies to the right, −1 to the left.
    """
    begin, end = sorted((place - away * _BEFORE * size, place + away * _BEHIND * size))
    columns = np.arange(max(1, round(begin)), min(still.shape[1] - 1, round(end) + 1))
    rows = np.flatnonzero(hull[:, columns].any(axis=1)) if len(columns) > 2 else np.zeros(0)
    fallback = round(min(max(place, 0), still.shape[1]))
    if len(rows) < 5:
        return fallback, 0.0
    far = max(3, round(_BEYOND * size))
    steps = [
        np.abs((still[part][:, columns] - still[part][:, columns - 1]).mean(axis=0))
        for part in (slice(max(0, rows[0] - far), rows[0]), slice(rows[-1] + 1, rows[-1] + 1 + far))
        if len(still[part])
    ]
    step = np.max(steps, axis=0) if steps else np.zeros(len(columns))
    if step.max() < _FAINT:
        return fallback, float(step.max())
    strong = columns[step >= _UPRIGHT * step.max()]
    return int(strong[-1] if away > 0 else strong[0]), float(step.max())


def _still(small: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The middle of the narrowest `_MODE` of each pixel's values, and its width."""
    ordered = np.sort(small, axis=0)
    some = max(3, int(_MODE * len(ordered)))
    width = ordered[some:] - ordered[:-some]
    place = width.argmin(axis=0)[None]
    middle = np.take_along_axis(ordered, place + some // 2, axis=0)[0]
    return middle, np.take_along_axis(width, place, axis=0)[0]


def _differs(small: NDArray[np.float32], still: NDArray[np.float32]) -> Masks:
    """Where a picture is not the still picture; of a pixel that an outline crosses, where it is more than half so."""
    away = np.abs(small - still)
    return away > np.maximum(_DIFFERENT, _HALF * cv2.dilate(away, np.ones((3, 3), np.uint8)))


def _joined(passable: Masks, entrances: Masks) -> Masks:
    """Passable places that are joined to an entrance."""
    _, labels = cv2.connectedComponents(passable.astype(np.uint8), connectivity=4)
    return np.isin(labels, np.unique(labels[entrances & passable])) & passable


def _hanging(core: Masks, within: NDArray[np.uint8], hoist: Side) -> Masks:
    """The part of a core that reaches the hoist, without spurs, and with its bays, which are left by cloth that looks
    like what is beside it. The rest are details of the background whose edges enclose them, as a window's, so that
    nothing joins them to the outside."""
    size = float(np.sqrt(within.sum()))
    bay, spur = max(1, round(_BAY * size)), _disc(max(1, round(_SPUR * size)))
    wide = np.pad(core.astype(np.uint8), bay, mode="edge")
    opened = cv2.morphologyEx(wide, cv2.MORPH_OPEN, spur)[bay:-bay, bay:-bay]
    _, labels = cv2.connectedComponents(opened, connectivity=8)
    own = np.isin(labels, np.unique(labels[(opened > 0) & _strip(within, hoist)])) & (opened > 0)
    closed = cv2.morphologyEx(np.pad(own.astype(np.uint8), bay), cv2.MORPH_CLOSE, _disc(bay))[bay:-bay, bay:-bay]
    return (closed > 0) & (within > 0)


def _entrances(within: NDArray[np.uint8], hoist: Side) -> Masks:
    """The border of where cloth is sought, away from the hoist."""
    padded = np.pad(within, 1)
    border = (within > 0) & (cv2.erode(padded, _disc(1))[1:-1, 1:-1] == 0)
    return border & ~_strip(within, hoist)


def _strip(within: NDArray[np.uint8], hoist: Side, width: int | None = None) -> Masks:
    """The strip at the hoist, of a width [px] or of `_HELD`."""
    columns = np.flatnonzero(within.any(axis=0))
    width = round(_HELD * (np.ptp(columns) + 1)) if width is None else width
    strip = np.zeros(within.shape, bool)
    at = slice(None, columns[0] + width) if hoist == "left" else slice(columns[-1] + 1 - width, None)
    strip[:, at] = True
    return strip


def _blurred(values: NDArray[np.generic], sigma: float) -> NDArray[np.float32]:
    return np.asarray(cv2.GaussianBlur(values.astype(np.float32), (0, 0), sigma), np.float32)


def _disc(radius: int) -> NDArray[np.uint8]:
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1)), np.uint8)
