"""The camera's motion, from features of the background, as one similarity transform a frame.

Corners (Shi and Tomasi, Good Features to Track, CVPR 1994) of one reference picture are followed to
each frame by pyramidal Lucas–Kanade (Bouguet 2001). Those that most frames move by one similarity
transform are the background's: cloth bends, so that its corners follow no such transform over a
whole film. Where the corners stay in their places, the camera is still, and no frame is resampled.
Of a background without corners its edges are followed.

The camera's motion where the background has no corners: by its edges, as of a pole before a plain
sky.

The shift of a frame is that at which the edges of the reference picture fit it best: least squares
between slopes and differences (Lucas and Kanade, IJCAI 1981) over the edges' pixels, with Huber's
weights, from coarse to fine. Along an edge a shift does not show; there it stays near that of the
frame before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from flagdata.core.arrays import BoolArray, Float32Array, FloatArray, UInt8Array

_BLURS = (4.0, 1.5)
"""Widths of the Gaussians [px] by which pictures are smoothed, coarse to fine."""
_STEPS = 8
_STEEP = 4.0
"""Slope [gray levels/px] from which on a pixel belongs to an edge."""
_FEWEST_EDGES = 60
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
        axes: (a, 2) unit vectors along which the picture may shift: both, or the one across a
            single straight edge.
    """

    places: Float32Array
    values: Float32Array
    slopes: Float32Array
    axes: FloatArray

    @classmethod
    def of(cls, reference: UInt8Array, outside: BoolArray) -> Edges | None:
        """Finds the edges of a picture (height, width) within the background's mask; None where
        there are too few."""
        smoothed = [_smooth_picture(reference, blur) for blur in _BLURS]
        slopes = [
            np.stack(
                [cv2.Sobel(picture, cv2.CV_32F, x, 1 - x, ksize=3) / 8 for x in (1, 0)], axis=-1
            )
            for picture in smoothed
        ]
        steep = np.linalg.norm(slopes[-1], axis=-1)
        steep[~outside] = 0.0
        chosen = np.flatnonzero(steep >= _STEEP)
        if len(chosen) < _FEWEST_EDGES:
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

    def misfit(self, picture: UInt8Array, shift: tuple[float, float]) -> float:
        """Computes the mean difference of a picture from the reference at a shift [gray levels],
        each clipped at `2 * _HUBER`."""
        away = self._difference(_smooth_picture(picture, _BLURS[-1]), -1, np.array(shift))
        return float(np.minimum(np.abs(away), 2 * _HUBER).mean())

    def shift(self, picture: UInt8Array, guess: tuple[float, float]) -> tuple[float, float] | None:
        """Estimates the shift along x and y [px] from the reference picture to this one; None where
        none fits.

        Args:
            guess: of a frame nearby.
        """
        smoothed = [_smooth_picture(picture, blur) for blur in _BLURS]
        start = np.array(guess, dtype=np.float64)
        shift = self._refine_guess(smoothed, start)
        if shift is None:
            shift = self._refine_guess(smoothed, self._search_grid(smoothed[0], start))
        return None if shift is None else (float(shift[0]), float(shift[1]))

    def _refine_guess(self, smoothed: list[Float32Array], guess: FloatArray) -> FloatArray | None:
        """Refines a guess of the shift by Gauss–Newton steps, coarse to fine; None where it does
        not fit."""
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

    def _search_grid(self, smoothed: Float32Array, guess: FloatArray) -> FloatArray:
        """Searches a grid of shifts about a guess for the best one, as is needed after a jerk of
        the camera."""
        steps = np.arange(-_JERK, _JERK + 1, _GRID, dtype=np.float64)
        shifts = (
            guess
            + np.stack(np.meshgrid(*[steps] * len(self.axes)), axis=-1).reshape(-1, len(self.axes))
            @ self.axes
        )
        subset = slice(None, None, max(1, len(self.places) // _LOOKED))
        at = (self.places[subset][None] + shifts[:, None]).astype(np.float32)
        values = cv2.remap(
            smoothed, at[..., 0], at[..., 1], cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE
        )
        misfit = np.minimum(np.abs(values - self.values[0][subset]), 2 * _HUBER).mean(axis=1)
        away = np.linalg.norm(shifts - guess, axis=1) / _JERK
        return shifts[int(np.argmin(misfit + 0.1 * _HUBER * away))]

    def _difference(self, smoothed: Float32Array, level: int, shift: FloatArray) -> FloatArray:
        at = (self.places + shift).astype(np.float32)
        values = cv2.remap(
            smoothed, at[:, :1], at[:, 1:], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        return np.asarray(values, dtype=np.float64)[:, 0] - self.values[level]


def _smooth_picture(picture: UInt8Array, blur: float) -> Float32Array:
    return np.asarray(cv2.GaussianBlur(picture.astype(np.float32), (0, 0), blur), dtype=np.float32)


WORK = 480
"""Longer side [px] of the pictures in which features are followed."""
Transform = FloatArray
"""(2, 3) similarity from places in the reference picture to places in a frame, both [px]."""
STILL = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])

_CORNERS = 240
_QUALITY = 0.005
_APART = 0.02
"""Least distance of two corners, as a share of the picture's diagonal: those of a flag are few of
all."""
_WINDOW = (17, 17)
_LEVELS = 3
_INLIER = 0.8
"""Pixels from the common transform within which a corner follows it."""
_STAYS = 0.5
"""Pixels from its place within which a corner stays."""
_CONSISTENT = 0.7
"""Share of the frames in which a corner of the background follows the common transform."""
_FEWEST = 8
"""Corners of which a transform is made."""
_SPREAD = 0.08
"""Least extent of the background's corners along both axes, as a share of the picture's sides."""
_LOST = 0.3
"""Share of the frames to which edges that are the background's fit."""
_BETTER = 0.9
"""Share of the misfit of shifts across edges to which shifts along them have to bring it, to be
believed."""
_MOST_TURN, _MOST_ZOOM = 0.35, 1.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Camera:
    """The reference picture and the features that are followed.

    Attributes:
        reference: (height, width) gray, its longer side `WORK` px at most.
        corners: (n, 2) float32 places of the background's features in it; none where it has none.
        edges: of the background, which are followed where it has no corners; None where it has none
            either.
        moves: whether frames are moved back; of a camera that is still, and of one whose motion no
            feature shows, none.
    """

    reference: UInt8Array
    corners: Float32Array
    moves: bool
    edges: Edges | None = None

    @property
    def known(self) -> bool:
        """Returns whether the background shows how the camera moves."""
        return self.support > 0

    @property
    def support(self) -> int:
        """How many corners, or pixels of edges where there are none, show how the camera moves."""
        return len(self.corners) if self.edges is None else len(self.edges.places)

    @property
    def evidence(self) -> str:
        """The same in words."""
        return (
            f"{self.support} {'corners' if self.edges is None else 'pixels at edges'} of the "
            "background"
        )

    def follow(self, picture: UInt8Array, guess: Transform) -> Transform | None:
        """Registers a frame: the transform from the reference picture to it; None where too few
        features are matched.

        Args:
            picture: (height, width) gray, as large as the reference.
            guess: the transform of a frame nearby.
        """
        if not self.moves:
            return STILL
        if self.edges is not None:
            shift = self.edges.shift(picture, (float(guess[0, 2]), float(guess[1, 2])))
            return None if shift is None else np.array([[1.0, 0.0, shift[0]], [0.0, 1.0, shift[1]]])
        places, matched = _follow_corners(self.reference, picture, self.corners, guess)
        return _similarity(self.corners[matched], places[matched])


def camera_of(
    pictures: Sequence[UInt8Array], *, outside: BoolArray | None = None, least: float = 0.0
) -> tuple[Camera, list[Transform]]:
    """Returns the camera of a film, from a sample of its frames in order, and the transform of each
    of them.

    Args:
        pictures: (height, width) gray, of one size, `WORK` px at most; the middle one becomes the
            reference.
        outside: (height, width) where features may lie; everywhere by default.
        least: root mean square motion [px] from which on frames are moved back.
    """
    middle = len(pictures) // 2
    reference = pictures[middle]
    height, width = reference.shape
    features = cv2.goodFeaturesToTrack(
        reference,
        _CORNERS,
        _QUALITY,
        max(4.0, _APART * float(np.hypot(height, width))),
        mask=None if outside is None else outside.astype(np.uint8),
    )
    corners = (
        np.zeros((0, 2), np.float32)
        if features is None
        else np.asarray(features, np.float32).reshape(-1, 2)
    )
    still = Camera(reference=reference, corners=corners[:0], moves=False)
    unmoved = [STILL] * len(pictures)
    if len(corners) < _FEWEST:
        return still, unmoved
    places, follows, transforms = _track_corners(pictures, corners)
    consistent = corners[follows.mean(axis=0) >= _CONSISTENT]
    stays = (np.linalg.norm(places - corners, axis=2) < _STAYS).mean(axis=0) >= _CONSISTENT
    if not _spread(consistent, (height, width)):
        return still, unmoved
    if stays.sum() >= len(consistent):
        return replace(still, corners=corners[stays]), unmoved
    moving = Camera(reference=reference, corners=consistent, moves=True)
    transforms = _again(moving, pictures, transforms)
    if motion(transforms, (width / 2, height / 2)) < least:
        return replace(moving, moves=False), unmoved
    return moving, transforms


def by_edges(
    pictures: Sequence[UInt8Array], *, outside: BoolArray, least: float = 0.0
) -> tuple[Camera, list[Transform]]:
    """Estimates the camera and its transforms as `camera_of` does, from the background's edges in
    place of its corners.

    Args:
        outside: (height, width) where they may lie.
    """
    middle = len(pictures) // 2
    edges = Edges.of(pictures[middle], outside)
    still = Camera(reference=pictures[middle], corners=np.zeros((0, 2), np.float32), moves=False)
    unmoved = [STILL] * len(pictures)
    if edges is None:
        return still, unmoved
    both_axes, one_axis = (
        _align_pictures(pictures, replace(still, edges=candidate, moves=True))
        for candidate in (edges, edges.across)
    )
    aligned = both_axes if both_axes.misfit < _BETTER * one_axis.misfit else one_axis
    if aligned.lost > _LOST * len(pictures):
        return still, unmoved
    height, width = pictures[middle].shape
    if motion(aligned.transforms, (width / 2, height / 2)) < least:
        return replace(aligned.camera, moves=False), unmoved
    return aligned.camera, aligned.transforms


@dataclass(frozen=True, kw_only=True, eq=False)
class _Aligned:
    """Transforms of a sample by edges, in how many frames they do not fit, and their mean
    misfit."""

    camera: Camera
    transforms: list[Transform]
    lost: int
    misfit: float


def _align_pictures(pictures: Sequence[UInt8Array], camera: Camera) -> _Aligned:
    middle, lost = len(pictures) // 2, 0
    transforms = [STILL] * len(pictures)
    for order in (range(middle + 1, len(pictures)), range(middle - 1, -1, -1)):
        guess = STILL
        for k in order:
            transform = camera.follow(pictures[k], guess)
            lost += transform is None
            guess = transforms[k] = transform if transform is not None else guess
    misfit = 0.0
    if camera.edges is not None:
        pairs = zip(pictures, transforms, strict=True)
        misfit = float(
            np.mean([camera.edges.misfit(picture, (at[0, 2], at[1, 2])) for picture, at in pairs])
        )
    return _Aligned(camera=camera, transforms=transforms, lost=lost, misfit=misfit)


def motion(transforms: Sequence[Transform], point: tuple[float, float]) -> float:
    """Computes the root mean square distance [px] of a point's images from their mean."""
    at = path(transforms, point)
    return float(np.sqrt(np.square(at - at.mean(axis=0)).sum(axis=1).mean()))


def path(transforms: Sequence[Transform], point: tuple[float, float]) -> FloatArray:
    """Returns (n, 2) positions of a point of the reference picture in each frame [px]."""
    return np.stack([transform @ np.array([*point, 1.0]) for transform in transforms])


def _track_corners(
    pictures: Sequence[UInt8Array], corners: Float32Array
) -> tuple[Float32Array, BoolArray, list[Transform]]:
    """Tracks corners through a sample: (frame, corner, 2) positions, (frame, corner) whether each
    follows its frame's transform, and the transforms."""
    count, middle = len(pictures), len(pictures) // 2
    places = np.repeat(corners[None], count, axis=0)
    follows = np.zeros((count, len(corners)), bool)
    follows[middle] = True
    transforms = [STILL] * count
    for order in (range(middle + 1, count), range(middle - 1, -1, -1)):
        guess = STILL
        for k in order:
            places[k], tracked = _follow_corners(pictures[middle], pictures[k], corners, guess)
            transform = _similarity(corners[tracked], places[k][tracked])
            if transform is not None:
                guess = transform
                away = np.linalg.norm(places[k] - _move_places(corners, transform), axis=1)
                follows[k] = tracked & (away < _INLIER)
            transforms[k] = guess
    return places, follows, transforms


def _again(
    camera: Camera, pictures: Sequence[UInt8Array], guesses: Sequence[Transform]
) -> list[Transform]:
    transforms = []
    for picture, guess in zip(pictures, guesses, strict=True):
        transform = camera.follow(picture, guess)
        transforms.append(transform if transform is not None else guess)
    return transforms


def _follow_corners(
    reference: UInt8Array, picture: UInt8Array, corners: Float32Array, guess: Transform
) -> tuple[Float32Array, BoolArray]:
    start = _move_places(corners, guess)
    places, status, _ = cv2.calcOpticalFlowPyrLK(
        reference,
        picture,
        corners.reshape(-1, 1, 2),
        start.reshape(-1, 1, 2).copy(),
        winSize=_WINDOW,
        maxLevel=_LEVELS,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        criteria=(cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 0.01),
    )
    return np.asarray(places, dtype=np.float32).reshape(-1, 2), status.ravel().astype(bool)


def _move_places(places: Float32Array, transform: Transform) -> Float32Array:
    return (places @ transform[:, :2].T + transform[:, 2]).astype(np.float32)


def _similarity(before: Float32Array, after: Float32Array) -> Transform | None:
    """Fits the similarity that most pairs of points agree on; None where too few do or no camera
    turns and zooms so."""
    if len(before) < _FEWEST:
        return None
    transform, inside = cv2.estimateAffinePartial2D(
        before,
        after,
        method=cv2.RANSAC,
        ransacReprojThreshold=_INLIER,
        maxIters=500,
        confidence=0.999,
        refineIters=10,
    )  # its random numbers have a fixed seed
    if transform is None or int(inside.sum()) < _FEWEST:
        return None
    zoom = float(np.hypot(transform[0, 0], transform[1, 0]))
    turn = abs(float(np.arctan2(transform[1, 0], transform[0, 0])))
    if turn > _MOST_TURN or not 1 / _MOST_ZOOM < zoom < _MOST_ZOOM:
        return None
    return np.asarray(transform, dtype=np.float64)


def _spread(corners: Float32Array, shape: tuple[int, int]) -> bool:
    if len(corners) < _FEWEST:
        return False
    extent = np.ptp(corners, axis=0)
    return bool((extent >= _SPREAD * np.array(shape[::-1])).all())
