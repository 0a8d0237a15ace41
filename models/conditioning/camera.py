"""The camera's motion, from features of the background, as one similarity transform a frame.

Corners (Shi and Tomasi, Good Features to Track, CVPR 1994) of one reference picture are followed to each frame by
pyramidal Lucas–Kanade (Bouguet 2001). Those that most frames move by one similarity transform are the background's:
cloth bends, so that its corners follow no such transform over a whole film. Where the corners stay in their places, the
camera is still, and no frame is resampled. Of a background without corners its edges are followed
(`models.conditioning.edges`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from models.conditioning.edges import Edges

WORK = 480
"""Longer side [px] of the pictures in which features are followed."""
Transform = NDArray[np.float64]
"""(2, 3) similarity from places in the reference picture to places in a frame, both [px]."""
STILL = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])

_CORNERS = 240
_QUALITY = 0.005
_APART = 0.02
"""Least distance of two corners, as a share of the picture's diagonal: those of a flag are few of all."""
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
"""Share of the misfit of shifts across edges to which shifts along them have to bring it, to be believed."""
_MOST_TURN, _MOST_ZOOM = 0.35, 1.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Camera:
    """The reference picture and the features that are followed.

    Attributes:
        reference: (height, width) gray, its longer side `WORK` px at most.
        corners: (n, 2) float32 places of the background's features in it; none where it has none.
        edges: of the background, which are followed where it has no corners; None where it has none either.
        moves: whether frames are moved back; of a camera that is still, and of one whose motion no feature shows, none.
    """

    reference: NDArray[np.uint8]
    corners: NDArray[np.float32]
    moves: bool
    edges: Edges | None = None

    @property
    def known(self) -> bool:
        """Whether the background shows how the camera moves."""
        return self.support > 0

    @property
    def support(self) -> int:
        """How many corners, or pixels of edges where there are none, show how the camera moves."""
        return len(self.corners) if self.edges is None else len(self.edges.places)

    @property
    def evidence(self) -> str:
        """The same in words."""
        return f"{self.support} {'corners' if self.edges is None else 'pixels at edges'} of the background"

    def follow(self, picture: NDArray[np.uint8], guess: Transform) -> Transform | None:
        """Where the reference picture is in another one; None where too few features are found.

        Args:
            picture: (height, width) gray, as large as the reference.
            guess: the transform of a frame nearby.
        """
        if not self.moves:
            return STILL
        if self.edges is not None:
            shift = self.edges.shift(picture, (float(guess[0, 2]), float(guess[1, 2])))
            return None if shift is None else np.array([[1.0, 0.0, shift[0]], [0.0, 1.0, shift[1]]])
        places, found = _followed(self.reference, picture, self.corners, guess)
        return _similarity(self.corners[found], places[found])


def camera_of(
    pictures: Sequence[NDArray[np.uint8]], *, outside: NDArray[np.bool_] | None = None, least: float = 0.0
) -> tuple[Camera, list[Transform]]:
    """The camera of a film, from a sample of its frames in order, and the transform of each of them.

    Args:
        pictures: (height, width) gray, of one size, `WORK` px at most; the middle one becomes the reference.
        outside: (height, width) where features may lie; everywhere by default.
        least: root mean square motion [px] from which on frames are moved back.
    """
    middle = len(pictures) // 2
    reference = pictures[middle]
    height, width = reference.shape
    found = cv2.goodFeaturesToTrack(
        reference,
        _CORNERS,
        _QUALITY,
        max(4.0, _APART * float(np.hypot(height, width))),
        mask=None if outside is None else outside.astype(np.uint8),
    )
    corners = np.zeros((0, 2), np.float32) if found is None else np.asarray(found, np.float32).reshape(-1, 2)
    still = Camera(reference=reference, corners=corners[:0], moves=False)
    unmoved = [STILL] * len(pictures)
    if len(corners) < _FEWEST:
        return still, unmoved
    places, follows, transforms = _sampled(pictures, corners)
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
    pictures: Sequence[NDArray[np.uint8]], *, outside: NDArray[np.bool_], least: float = 0.0
) -> tuple[Camera, list[Transform]]:
    """The same from the background's edges.

    Args:
        outside: (height, width) where they may lie.
    """
    middle = len(pictures) // 2
    edges = Edges.of(pictures[middle], outside)
    still = Camera(reference=pictures[middle], corners=np.zeros((0, 2), np.float32), moves=False)
    unmoved = [STILL] * len(pictures)
    if edges is None:
        return still, unmoved
    both, across = (_aligned(pictures, replace(still, edges=one, moves=True)) for one in (edges, edges.across))
    found = both if both.misfit < _BETTER * across.misfit else across
    if found.lost > _LOST * len(pictures):
        return still, unmoved
    height, width = pictures[middle].shape
    if motion(found.transforms, (width / 2, height / 2)) < least:
        return replace(found.camera, moves=False), unmoved
    return found.camera, found.transforms


@dataclass(frozen=True, kw_only=True, eq=False)
class _Aligned:
    """Transforms of a sample by edges, in how many frames they do not fit, and their mean misfit."""

    camera: Camera
    transforms: list[Transform]
    lost: int
    misfit: float


def _aligned(pictures: Sequence[NDArray[np.uint8]], camera: Camera) -> _Aligned:
    middle, lost = len(pictures) // 2, 0
    transforms = [STILL] * len(pictures)
    for order in (range(middle + 1, len(pictures)), range(middle - 1, -1, -1)):
        guess = STILL
        for k in order:
            found = camera.follow(pictures[k], guess)
            lost += found is None
            guess = transforms[k] = found if found is not None else guess
    misfit = 0.0
    if camera.edges is not None:
        pairs = zip(pictures, transforms, strict=True)
        misfit = float(np.mean([camera.edges.misfit(one, (at[0, 2], at[1, 2])) for one, at in pairs]))
    return _Aligned(camera=camera, transforms=transforms, lost=lost, misfit=misfit)


def motion(transforms: Sequence[Transform], place: tuple[float, float]) -> float:
    """Root mean square distance [px] of a place's image from its mean."""
    at = path(transforms, place)
    return float(np.sqrt(np.square(at - at.mean(axis=0)).sum(axis=1).mean()))


def path(transforms: Sequence[Transform], place: tuple[float, float]) -> NDArray[np.float64]:
    """(n, 2) where a place of the reference picture is in each frame [px]."""
    return np.stack([transform @ np.array([*place, 1.0]) for transform in transforms])


def _sampled(
    pictures: Sequence[NDArray[np.uint8]], corners: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.bool_], list[Transform]]:
    """(frame, corner, 2) places, (frame, corner) whether a corner follows its frame's transform, and those."""
    count, middle = len(pictures), len(pictures) // 2
    places = np.repeat(corners[None], count, axis=0)
    follows = np.zeros((count, len(corners)), bool)
    follows[middle] = True
    transforms = [STILL] * count
    for order in (range(middle + 1, count), range(middle - 1, -1, -1)):
        guess = STILL
        for k in order:
            places[k], found = _followed(pictures[middle], pictures[k], corners, guess)
            transform = _similarity(corners[found], places[k][found])
            if transform is not None:
                guess = transform
                away = np.linalg.norm(places[k] - _moved(corners, transform), axis=1)
                follows[k] = found & (away < _INLIER)
            transforms[k] = guess
    return places, follows, transforms


def _again(camera: Camera, pictures: Sequence[NDArray[np.uint8]], guesses: Sequence[Transform]) -> list[Transform]:
    found = []
    for picture, guess in zip(pictures, guesses, strict=True):
        transform = camera.follow(picture, guess)
        found.append(transform if transform is not None else guess)
    return found


def _followed(
    reference: NDArray[np.uint8], picture: NDArray[np.uint8], corners: NDArray[np.float32], guess: Transform
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    start = _moved(corners, guess)
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


def _moved(places: NDArray[np.float32], transform: Transform) -> NDArray[np.float32]:
    return (places @ transform[:, :2].T + transform[:, 2]).astype(np.float32)


def _similarity(before: NDArray[np.float32], after: NDArray[np.float32]) -> Transform | None:
    """The similarity that most pairs of places agree on; None where too few do or no camera turns and zooms so."""
    if len(before) < _FEWEST:
        return None
    transform, inside = cv2.estimateAffinePartial2D(
        before, after, method=cv2.RANSAC, ransacReprojThreshold=_INLIER, maxIters=500, confidence=0.999, refineIters=10
    )  # its random numbers have a fixed seed
    if transform is None or int(inside.sum()) < _FEWEST:
        return None
    zoom = float(np.hypot(transform[0, 0], transform[1, 0]))
    turn = abs(float(np.arctan2(transform[1, 0], transform[0, 0])))
    if turn > _MOST_TURN or not 1 / _MOST_ZOOM < zoom < _MOST_ZOOM:
        return None
    return np.asarray(transform, dtype=np.float64)


def _spread(corners: NDArray[np.float32], shape: tuple[int, int]) -> bool:
    if len(corners) < _FEWEST:
        return False
    extent = np.ptp(corners, axis=0)
    return bool((extent >= _SPREAD * np.array(shape[::-1])).all())
