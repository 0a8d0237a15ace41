"""A film made fit before anything is judged: camera, flag, crop and freezing, in this order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from flagdata.core.arrays import BoolArray, Float32Array, FloatArray, UInt8Array
from flagdata.errors import InputError, UsageError
from models.conditioning import camera_noise, framing
from models.conditioning.camera_motion import (
    STILL,
    WORK,
    Camera,
    Transform,
    by_edges,
    camera_of,
    path,
)
from models.conditioning.framing import Square
from models.conditioning.outline import FEWEST, Hoist, hoist_of
from models.conditioning.regions import Region, regions_of
from models.conditioning.standing import Box, Standing
from models.conditioning.stills import halve_picture
from models.conditioning.whole import CUT, SIDES, at_edges

VERSION = 2
"""Raised whenever the same film gives other pictures: what networks are trained on is then made
anew."""
SAMPLE = 96
"""Frames of a film that are looked at to find camera and flag."""
LEAST = 3
"""Frames without which neither can be found."""
_LEAST_MOTION = 0.15
"""Root mean square motion of the camera [px of the square that is judged] below which no frame is
moved: resampling would blur more than it steadies."""
_AROUND = 0.08
"""Width of the band about the places that the cloth visits, within which nothing is frozen, in
sizes of the region."""
_FEATHER = 0.04
"""Width over which freezing sets in, in sizes of the region."""
_BACKGROUND = 48
"""Frames of the sample whose median is the frozen background."""
_NOISES = 3.0
"""Deviations of the camera's noise that a frozen place may be off its median."""
_USUAL = 1.5
"""Deviation of a place that is noise and no more, in deviations of the noise: coding leaves more at
edges."""
_ROUNDING = 0.7
"""Least deviation [gray levels] that counts as noise, of rounding and coding."""
_DRIFT = 10
"""Frames over which the camera's place is smoothed for its drift."""
_NEARBY = 6
"""Frames of the sample about the middle one over which a camera without known motion counts as
still."""
_BORDER = 2
"""Pixels at the picture's edge in which no edge is looked for: what is padded beyond begins
there."""
_LEAST_SIZE = 150
"""Size of the pictures from which on a hoist is sought, half of the 300 px of the network that
places it [px]."""
_PART, _PARTS = 5.0, 4
"""Length of the parts of a film in which a hoist is sought at least [s], and their number at
most."""
_AHEAD = 0.1
"""Width of the band about cloth in which no feature of the background is sought, in sizes of the
region."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Conditioning:
    """What was found in a film, and how each of its frames becomes a square picture of the flag.

    Attributes:
        size: of the pictures [px].
        scale: of the pictures in which features and regions are sought, over the film's.
        camera: its background features.
        regions: of moving cloth, the first the most like a flag; none where nothing moves.
        chosen: place of the flag among them.
        square: that is judged, in the reference picture [px of the film].
        weight: (size, size) float32, 1 where the film is shown, 0 where it is frozen.
        framed: (n, size, size) the frames of the sample whose median the background is, nothing
            frozen in them.
        background: (size, size) what is shown there, the median in time.
        noise: deviation of the camera's [gray levels], which is left where the film is frozen.
        kept: (size, size) float32 share of each pixel's changes that is noise, 0 to 1.
        path: (n, 2) of the square's centre over the sample [px of the film].
        cut: (n, 4) length at which the cloth moves along each of `whole.SIDES` of the picture, in
            sizes of the cloth.
        seconds: between the first and the last frame of the sample; 0 where their times are not
            known.
        standing: edges that stand still in the square.
        places: (size, size) all places in the square that the cloth visits.
    """

    size: int
    scale: float
    camera: Camera
    regions: tuple[Region, ...]
    chosen: int
    square: Square
    weight: Float32Array
    framed: UInt8Array
    background: UInt8Array
    noise: float
    kept: Float32Array
    path: FloatArray
    cut: FloatArray
    seconds: float
    standing: Standing
    places: BoolArray

    @property
    def region(self) -> Region | None:
        """The flag's; None where nothing moves."""
        return self.regions[self.chosen] if self.regions else None

    def framed_box(self, region: Region) -> Box:
        """Returns left, top, right and bottom of a region's places in the pictures that come out
        [px]."""
        begins, step = (self.square.x, self.square.y) * 2, self.square.side / self.size
        left, top, right, bottom = (
            (edge / self.scale - begin) / step
            for edge, begin in zip(region.box, begins, strict=True)
        )
        return left, top, right, bottom

    @property
    def cut_share(self) -> dict[str, float]:
        """Share of the sample in which the edge on each of `whole.SIDES` cuts the cloth off, 0 to
        1."""
        return dict(zip(SIDES, (self.cut > CUT).mean(axis=0).tolist(), strict=True))

    def follow(self, frame: UInt8Array, guess: Transform) -> Transform | None:
        """Registers a frame: the transform from the reference picture to it; None where the
        background's features are not found.

        Args:
            frame: (height, width) of the film.
            guess: transform of a frame nearby, as this gives it.
        """
        return self.camera.follow(shrunk(frame, self.scale), guess) if self.camera.moves else STILL

    def show(self, frame: UInt8Array, transform: Transform) -> UInt8Array:
        """Returns the (size, size) picture of the flag: registered, cropped, scaled, all else
        frozen."""
        return self._frozen(
            _frame_square(
                frame, self.square, self.size, transform, scale=self.scale, moves=self.camera.moves
            )
        )

    def hoists(self) -> Iterator[Hoist]:
        """Places the edge that the cloth is attached to: in the whole film, and then in each of its
        parts of `_PART` or more, four at most. None in a film of fewer than ten frames, and in
        pictures too small for the network that places it. Light, camera and the wind's direction
        may change in a long film."""
        if self.size < _LEAST_SIZE:
            return
        pictures = np.stack([halve_picture(self._frozen(picture)) for picture in self.framed])
        parts = min(int(self.seconds / _PART), _PARTS, len(pictures) // FEWEST)
        for part in (pictures, *(np.array_split(pictures, parts) if parts > 1 else ())):
            if (hoist := hoist_of(part)) is not None:
                yield hoist

    def _frozen(self, drawn: UInt8Array) -> UInt8Array:
        """Freezes a framed picture (size, size) away from the flag."""
        away = drawn - self._still
        residual = np.clip(self.kept * away, -_NOISES * self.noise, _NOISES * self.noise)
        return np.rint(self._still + residual + self.weight * (away - residual)).astype(np.uint8)

    @cached_property
    def _still(self) -> Float32Array:
        return self.background.astype(np.float32)


@dataclass(frozen=True, kw_only=True, eq=False)
class Conditioned:
    """A film that was made fit.

    Attributes:
        frames: (n, size, size) gray.
        found: what was found in it.
        path: (n, 2) of the square's centre in each frame [px of the film].
        lost: frames in which the background's features were not found; the transform of the frame
            before is used.
    """

    frames: UInt8Array
    found: Conditioning
    path: FloatArray
    lost: int


def condition_film(
    frames: UInt8Array, times: FloatArray, *, size: int = 300, flag: int | None = None
) -> Conditioned:
    """Conditions a short film in memory.

    Args:
        frames: (n, height, width) gray.
        times: (n,) of them, ascending [s].
        size: of the pictures that come out [px].
        flag: number of the flag, from 1, the first the most like one; None for the first.

    Raises:
        InputError: fewer than three frames, or times that do not fit them.
        UsageError: a flag of a number that the film does not have.
    """
    if len(frames) < LEAST or len(times) != len(frames):
        raise InputError(
            f"{len(frames)} frames have {len(times)} instants",
            fix="give three frames or more, each a time",
        )
    stride = -(-len(frames) // SAMPLE)
    conditioning = conditioning_of(frames[::stride], times=times[::stride], size=size, flag=flag)
    follower = Follower(conditioning)
    pictures = np.stack([follower.show(frame) for frame in frames])
    return Conditioned(frames=pictures, found=conditioning, path=follower.path, lost=follower.lost)


class Follower:
    """Shows the frames of a film in order, each from the transform of the one before.

    Attributes:
        lost: frames in which the background's features were not found.
    """

    def __init__(self, conditioning: Conditioning) -> None:
        self._found, self._last = conditioning, STILL
        self._path: list[FloatArray] = []
        self.lost = 0

    @property
    def path(self) -> FloatArray:
        """(n, 2) of the square's centre in each frame so far [px of the film]."""
        return np.array(self._path).reshape(-1, 2)

    def motion(self) -> dict[str, float]:
        """Returns drift, the largest distance between positions of the square's centre, smoothed
        over `_DRIFT` frames, and shake, the root mean square of its steps from frame to frame [px
        of the film]."""
        at = self.path
        if len(at) < 2:
            return {"drift": 0.0, "shake": 0.0}
        ones = np.ones(min(_DRIFT, len(at)))
        smooth = np.stack(
            [np.convolve(axis, ones / len(ones), mode="valid") for axis in at.T], axis=1
        )
        steps = np.diff(at, axis=0)
        return {
            "drift": float(np.hypot(*np.ptp(smooth, axis=0))),
            "shake": float(np.sqrt(np.square(steps).sum(axis=1).mean())),
        }

    def show(self, frame: UInt8Array) -> UInt8Array:
        """Returns the (size, size) picture of the next frame (height, width)."""
        conditioning = self._found
        transform = conditioning.follow(frame, self._last)
        if transform is None:
            self.lost += 1
        else:
            self._last = transform
        self._path.append(_centre(conditioning.square, self._last, conditioning.scale))
        return conditioning.show(frame, self._last)


def conditioning_of(
    sample: Sequence[UInt8Array] | UInt8Array,
    *,
    size: int,
    times: FloatArray | None = None,
    flag: int | None = None,
    within: tuple[int, int, int, int] | None = None,
) -> Conditioning:
    """Finds camera, moving cloth and the square to crop to in a sample of a film's frames.

    Args:
        sample: (height, width) gray, spread over the film, in order; three or more.
        size: of the pictures that are to come out [px].
        times: (n,) of the sample [s], where it is uneven: cloth is sought between those
            `regions.MOMENT` apart at most.
        flag: number of the flag, from 1; None for the first.
        within: x, y, width and height of the part of the middle frame in which the flag is [px];
            None for all.

    Raises:
        UsageError: a flag of a number that the film does not have.
    """
    cv2.setNumThreads(1)
    height, width = sample[0].shape
    scale = min(1.0, WORK / max(height, width))
    small = [shrunk(frame, scale) for frame in sample]
    inside = None if within is None else _inside(within, small[0].shape, scale)
    instants = np.arange(len(small), dtype=np.float64) if times is None else times
    camera, transforms, registered, regions = _camera_and_regions(
        small, instants, inside, scale * max(width, height) / size
    )
    if flag is not None and not 1 <= flag <= len(regions):
        raise UsageError(
            f"there is no flag {flag}: {len(regions)} regions of the film move like cloth",
            where="--flag",
            fix="give a number from the page's picture"
            if regions
            else "give --crop around the flag",
        )
    chosen = 0 if flag is None else flag - 1
    box = (0.0, 0.0, float(width), float(height))
    if regions:
        left, top, right, bottom = regions[chosen].box
        box = (left / scale, top / scale, right / scale, bottom / scale)
    square = framing.square_about(
        box, width=width, height=height, allow_centred=not camera.moves or not regions
    )
    step = -(-len(sample) // _BACKGROUND)
    framed = [
        _frame_square(frame, square, size, transform, scale=scale, moves=camera.moves)
        for frame, transform in zip(sample[::step], transforms[::step], strict=True)
    ]
    weight, cut = np.ones((size, size), np.float32), np.zeros((len(small), len(SIDES)))
    places = np.zeros((size, size), np.bool_)
    if regions:
        cut = at_edges(registered, instants, transforms, regions[chosen].mask)
        weight = _weight(regions[chosen].mask, square, size, scale)
        places = _in_square(regions[chosen].mask.astype(np.uint8), square, size, scale) > 0
    stack = np.stack(framed)
    level = _noise(stack, weight)
    spread = np.maximum(stack.std(axis=0, dtype=np.float32), 1e-3)
    return Conditioning(
        size=size,
        scale=scale,
        camera=camera,
        regions=regions,
        chosen=chosen,
        square=square,
        weight=weight,
        framed=stack,
        background=np.median(stack, axis=0).astype(np.uint8),
        noise=level,
        kept=np.minimum(_USUAL * level / spread, 1.0).astype(np.float32),
        path=np.stack([_centre(square, transform, scale) for transform in transforms]),
        cut=cut,
        seconds=0.0 if times is None else float(times[-1] - times[0]),
        standing=Standing.of(
            stack, _shown(square, size, width=width, height=height), enlarged=size / square.side
        ),
        places=places,
    )


def shrunk(frame: UInt8Array, scale: float) -> UInt8Array:
    """Averages a frame (height, width) down."""
    if scale >= 1:
        return np.ascontiguousarray(frame)
    size = (max(1, round(frame.shape[1] * scale)), max(1, round(frame.shape[0] * scale)))
    return np.asarray(cv2.resize(frame, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _camera_and_regions(
    small: list[UInt8Array], times: FloatArray, inside: BoolArray | None, unit: float
) -> tuple[Camera, list[Transform], UInt8Array, tuple[Region, ...]]:
    """Estimates the camera and the cloth in turns, each with the other's last estimate, and
    registers the pictures.

    Args:
        unit: pixels of `small` in one of the pictures that come out, of a film that is shown whole.
    """
    least = _LEAST_MOTION * unit
    camera, transforms = camera_of(small, least=least)
    if camera.known:
        regions = regions_of(_register_pictures(small, transforms), times, within=inside)
        again, moved = (
            camera_of(small, outside=_outside(regions, small[0].shape), least=least)
            if regions
            else (camera, [])
        )
    else:  # while the camera moves little, what moves is cloth
        middle = len(small) // 2
        nearby = slice(max(0, middle - _NEARBY), middle + _NEARBY + 1)
        regions = regions_of(np.stack(small[nearby]), times[nearby], within=inside)
        again, moved = (
            by_edges(small, outside=_outside(regions, small[0].shape), least=least)
            if regions
            else (camera, [])
        )
    if regions and again.known:
        camera, transforms = again, moved
    registered = _register_pictures(small, transforms)
    return camera, transforms, registered, regions_of(registered, times, within=inside)


def _outside(regions: Sequence[Region], shape: tuple[int, ...]) -> BoolArray:
    """Masks the background: away from all moving cloth."""
    outside = np.ones(shape, bool)
    for region in regions:
        outside &= ~_widen_mask(region.mask, _AHEAD).astype(bool)
    return outside


def _register_pictures(small: list[UInt8Array], transforms: list[Transform]) -> UInt8Array:
    height, width = small[0].shape
    moved = [
        picture
        if transform is STILL
        else cv2.warpAffine(
            picture,
            transform,
            (width, height),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )
        for picture, transform in zip(small, transforms, strict=True)
    ]
    return np.stack(moved).astype(np.uint8)


def _frame_square(
    frame: UInt8Array, square: Square, size: int, transform: Transform, *, scale: float, moves: bool
) -> UInt8Array:
    if not moves:
        return framing.cut(frame, square, size)
    return framing.warp(frame, square, size, framing.rescale_transform(transform, scale))


def _centre(square: Square, transform: Transform, scale: float) -> FloatArray:
    middle = (square.x + square.side / 2, square.y + square.side / 2)
    return path([framing.rescale_transform(transform, scale)], middle)[0]


def _widen_mask(mask: BoolArray, share: float) -> UInt8Array:
    """Widens the mask by a share of its size."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    radius = max(1, round(share * max(np.ptp(rows), np.ptp(columns))))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    return np.asarray(cv2.dilate(mask.astype(np.uint8), disc), dtype=np.uint8)


def _weight(mask: BoolArray, square: Square, size: int, scale: float) -> Float32Array:
    """Weighs pixels (size, size): 1 on and about the cloth, falling to 0 across the feather."""
    extent = (
        max(np.ptp(np.flatnonzero(mask.any(axis=1))), np.ptp(np.flatnonzero(mask.any(axis=0)))) + 1
    )
    near = _in_square(_widen_mask(mask, _AROUND + _FEATHER), square, size, scale)
    feather = max(_FEATHER * extent / scale / (square.side / size), 1.0)
    away = cv2.distanceTransform(near, cv2.DIST_L2, 5)
    return np.clip(away / feather, 0.0, 1.0).astype(np.float32)


def _in_square(mask: UInt8Array, square: Square, size: int, scale: float) -> UInt8Array:
    """Brings a mask of the pictures in which regions are sought into the square (size, size)."""
    step = square.side / size
    to_reference = np.array(
        [[step, 0.0, square.x + step / 2 - 0.5], [0.0, step, square.y + step / 2 - 0.5]]
    )
    to_reference = np.column_stack(
        [to_reference[:, :2] * scale, (to_reference[:, 2] + 0.5) * scale - 0.5]
    )
    out = cv2.warpAffine(
        mask, to_reference, (size, size), flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    )
    return np.asarray(out, dtype=np.uint8)


def _noise(stack: UInt8Array, weight: Float32Array) -> float:
    """Estimates the deviation of the camera's noise where the film (n, size, size) is frozen [gray
    levels].

    By the differences of frames, which have √2 times the noise of one.
    """
    frozen = weight == 0
    if not frozen.any():
        return _ROUNDING
    change = np.diff(stack.astype(np.float32), axis=0)
    rough = np.stack([camera_noise.rough(picture)[frozen] for picture in change])
    return max(camera_noise.deviation(rough) / np.sqrt(2), _ROUNDING)


def _shown(square: Square, size: int, *, width: int, height: int) -> BoolArray:
    """Masks the pixels (size, size) of the square that lie in a picture of this size, without its
    outermost ones."""
    step = square.side / size
    columns, rows = (begin + step * (np.arange(size) + 0.5) for begin in (square.x, square.y))
    edge = _BORDER * step
    across, down = (
        (at > edge) & (at < length - edge) for at, length in ((columns, width), (rows, height))
    )
    return np.asarray(down[:, None] & across[None], dtype=np.bool_)


def _inside(within: tuple[int, int, int, int], shape: tuple[int, ...], scale: float) -> BoolArray:
    x, y, width, height = (round(value * scale) for value in within)
    inside = np.zeros(shape[:2], bool)
    inside[max(y, 0) : y + height, max(x, 0) : x + width] = True
    return inside
