"""Where the motion is: a crop proposed from it, and a picture of the proposal for a person to
judge.

Short runs of frames are taken all over the recording. In each run the brightness of every frame is
fitted to the run's median frame (gain and offset, over the pixels that hold still), so that flicker
and exposure control are not motion. What remains is the temporal standard deviation of each pixel.
Where its mean square over the runs stands out, there are regions; the one with the most motion in
the median run is the flag's, since a passer-by is in few of the runs. A tip is thin, faint or out
in few of the runs, and so does not stand out in that mean: the region grows into all that moves in
any run, however faintly, and touches it, unless that would make it nearly twice as large, as a
passer-by does. The proposal is the square around it.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from flagdata.core.arrays import BoolArray, Float32Array, UInt8Array
from flagdata.errors import RefusedError
from flagdata.ingest.camera.camera_options import CropBox
from flagdata.ingest.camera.picture_geometry import Geometry, settle_crop, upright_size
from flagdata.ingest.camera.picture_source import Picture, PictureSource

_RUNS = 10
_PER_RUN = 8
# s between the frames of a run: a flag's motion shows, and a run stays within a tenth of its gusts
_STEP = 0.03
_WORK = 192  # px, longer side of the images that are compared
_SHOW = 960  # px, longer side of the picture
_FAINTEST = 1.0  # gray levels; less motion than one is coding noise
_BRIDGE = 8  # px of the images that are compared
_PAD = 0.15  # of the motion's extent, on each side: the hoist of a flag hardly moves
_LEAST_SHARE = 0.5
_GROWTH = 1.8  # the tip of a flag that is visible without it; a passer-by makes it larger
_EDGE = 3  # px of the images that are compared, by which blur widens what moves
_NEAR = 3  # px of the images that are compared, between what moves and the tip of it


@dataclass(frozen=True, kw_only=True)
class CropProposal:
    """A crop found from motion.

    Attributes:
        box: of the upright image; square, unless the motion is longer than the image's shorter
            side.
        moving: the part of the upright image that moves, without the padding.
        share: part of the motion's energy that lies in the region within the box, 0 to 1.
        runs: runs of frames it rests on.
        picture: PNG of the whole upright image, the motion in red, the box in yellow.
    """

    box: CropBox
    moving: CropBox
    share: float
    runs: int
    picture: bytes


def propose(source: PictureSource, *, rate: float, where: str) -> CropProposal:
    """Proposes the crop that the motion in `source` suggests.

    Args:
        rate: true frame rate of the source [Hz].

    Raises:
        RefusedError: nothing moves, or motion is all over the image.
    """
    facts = source.facts
    wide, high = upright_size(facts.width, facts.height, facts.aspect, facts.orientation)
    uncropped = settle_crop("whole", width=wide, height=high)
    maps: list[Float32Array] = []
    first_picture: UInt8Array | None = None
    stride = min(8, max(1, round(_STEP * rate)))
    for pictures in source.samples(_RUNS, _PER_RUN, stride):
        if len(pictures) < 3:
            continue
        frames = np.stack([_small(picture, source, uncropped, _WORK) for picture in pictures])
        maps.append(_deviation(frames))
        if first_picture is None:
            first_picture = _small(pictures[0], source, uncropped, _SHOW)
    if not maps or first_picture is None:
        raise RefusedError(
            "too few frames to see motion in",
            where=where,
            fix="give the crop as x,y,width,height, or take it whole",
        )
    stack = np.stack(maps)
    motion = np.sqrt(np.mean(stack**2, axis=0))
    region, share = _region(stack, motion, where=where)
    box = _box_around(region, wide=wide, high=high)
    if share < _LEAST_SHARE:
        raise RefusedError(
            f"motion is all over the image: its largest region carries {share:.0%} of it",
            where=where,
            fix="give the crop as x,y,width,height",
        )
    return CropProposal(
        box=box,
        moving=_extent_box(region, wide=wide, high=high),
        share=share,
        runs=len(maps),
        picture=_draw(first_picture, motion, box, wide=wide),
    )


def cut_off(crop: CropBox, proposal: CropProposal, *, wide: int) -> dict[str, int]:
    """Measures by how many pixels what moves reaches beyond each edge of a crop, where it is partly
    inside; none elsewhere.

    Args:
        wide: width of the upright image; the motion is known to `_EDGE` pixels of the images that
            were compared.
    """
    moving = proposal.moving
    beyond = {
        "left": crop.x - moving.x,
        "top": crop.y - moving.y,
        "right": moving.x + moving.width - crop.x - crop.width,
        "bottom": moving.y + moving.height - crop.y - crop.height,
    }
    if beyond["left"] >= moving.width or beyond["right"] >= moving.width:
        return {}
    if beyond["top"] >= moving.height or beyond["bottom"] >= moving.height:
        return {}
    least = _EDGE * wide / _WORK
    return {edge: pixels for edge, pixels in beyond.items() if pixels > least}


def _small(picture: Picture, source: PictureSource, uncropped: CropBox, size: int) -> UInt8Array:
    """Scales the whole upright picture to `size` along its longer side, without padding."""
    facts, luma = source.facts, picture.luma()
    geometry = Geometry(
        width=facts.width,
        height=facts.height,
        aspect=facts.aspect,
        orientation=facts.orientation,
        crop=uncropped,
        size=size,
    )
    top, left, high, wide = geometry.placement
    return geometry.render(luma.image, black=luma.black, white=luma.white)[
        top : top + high, left : left + wide
    ]


def _deviation(frames: UInt8Array) -> Float32Array:
    """Computes the temporal standard deviation of each pixel, global changes of gain and offset
    taken out; (n, h, w) → (h, w)."""
    stack = frames.astype(np.float32)
    reference = np.median(stack, axis=0)
    spread = stack.std(axis=0)
    still = spread <= np.median(spread)
    x = reference[still]
    centred = x - x.mean()
    power = float(centred @ centred)
    for image in stack:
        y = image[still]
        gain = float(centred @ (y - y.mean())) / power if power > 0 else 1.0
        gain = gain if gain > 0.1 else 1.0
        image -= y.mean()
        image /= gain
        image += x.mean()
    return stack.std(axis=0)


def _region(maps: Float32Array, motion: Float32Array, *, where: str) -> tuple[BoolArray, float]:
    """Finds the connected region with most of the motion's energy in the median run, and its share
    of it.

    Args:
        maps: (run, height, width) deviation in each run.
        motion: (height, width) their root mean square.
    """
    from scipy import ndimage  # only now: ingesting a log needs none of it

    smooth = ndimage.gaussian_filter(motion, 1.5)
    middle = float(np.median(smooth))
    noise = 1.4826 * float(np.median(np.abs(smooth - middle)))
    peak = float(np.percentile(smooth, 99.5))
    if peak - middle < _FAINTEST:
        raise RefusedError(
            f"no motion is found in the image: gray levels change by {peak - middle:.2g}, less "
            f"than {_FAINTEST:g}",
            where=where,
            fix="give the crop as x,y,width,height",
        )
    moving = smooth > middle + max(
        _FAINTEST / 2, min(4 * noise, 0.5 * (peak - middle)), 0.1 * (peak - middle)
    )
    # Parts of one flag that move apart by a few pixels are one region.
    labels = np.empty(moving.shape, dtype=np.int32)
    ndimage.label(ndimage.binary_dilation(moving, iterations=_BRIDGE), output=labels)
    names = np.arange(1, labels.max() + 1)
    sums = np.array(
        [ndimage.sum_labels(np.where(moving, run**2, 0.0), labels, index=names) for run in maps]
    )
    energy = np.median(sums, axis=0)
    if energy.sum() == 0:
        raise RefusedError(
            "motion comes and goes: no region moves in most of the recording",
            where=where,
            fix="give the crop as x,y,width,height",
        )
    best = int(np.argmax(energy))
    region = moving & (labels == best + 1)
    return _with_tip(region, maps), float(energy[best] / energy.sum())


def _with_tip(region: BoolArray, maps: Float32Array) -> BoolArray:
    """Adds to a region what moves in any run and touches it; without, where that is much larger
    than the region."""
    from scipy import ndimage  # only now: ingesting a log needs none of it

    moving = np.zeros_like(region)
    for run in maps:
        smooth = ndimage.gaussian_filter(run, 0.7)
        middle = float(np.median(smooth))
        noise = 1.4826 * float(np.median(np.abs(smooth - middle)))
        above = smooth - middle
        moving |= above > max(_FAINTEST, 6 * noise, 0.04 * float(np.percentile(above, 99.5)))
    labels = np.empty(moving.shape, dtype=np.int32)
    ndimage.label(ndimage.binary_dilation(moving | region, iterations=_NEAR), output=labels)
    grown = (moving | region) & np.isin(labels, np.unique(labels[region]))
    return grown if _extent(grown) <= _GROWTH * _extent(region) else region


def _extent(region: BoolArray) -> int:
    rows, columns = np.flatnonzero(region.any(axis=1)), np.flatnonzero(region.any(axis=0))
    return int(max(rows[-1] - rows[0], columns[-1] - columns[0])) + 1


def _extent_box(region: BoolArray, *, wide: int, high: int) -> CropBox:
    """Returns the box just around `region`, in pixels of the upright image."""
    rows, columns = np.flatnonzero(region.any(axis=1)), np.flatnonzero(region.any(axis=0))
    scale = wide / region.shape[1]
    x, y = round(columns[0] * scale), round(rows[0] * scale)
    right, bottom = (
        min(wide, round((columns[-1] + 1) * scale)),
        min(high, round((rows[-1] + 1) * scale)),
    )
    return CropBox(x=x, y=y, width=right - x, height=bottom - y)


def _box_around(region: BoolArray, *, wide: int, high: int) -> CropBox:
    """Returns the padded square around `region`, in pixels of the upright image, moved inside it
    and cut where it is larger."""
    rows, columns = np.flatnonzero(region.any(axis=1)), np.flatnonzero(region.any(axis=0))
    scale = wide / region.shape[1]
    left_edge, right = columns[0] * scale, (columns[-1] + 1) * scale
    top, bottom = rows[0] * scale, (rows[-1] + 1) * scale
    extent = max(right - left_edge, bottom - top)
    # The padding never makes a box oblong; only motion longer than the image's shorter side does.
    side = min(extent * (1 + 2 * _PAD), max(extent, min(wide, high)))
    width, height = min(wide, round(side)), min(high, round(side))
    x = min(max(0, round((left_edge + right - width) / 2)), wide - width)
    y = min(max(0, round((top + bottom - height) / 2)), high - height)
    return CropBox(x=x, y=y, width=width, height=height)


def _draw(image: UInt8Array, motion: NDArray[np.floating], box: CropBox, *, wide: int) -> bytes:
    heat = Image.fromarray(motion.astype(np.float32)).resize(
        (image.shape[1], image.shape[0]), Image.Resampling.BILINEAR
    )
    strength = np.clip(np.asarray(heat) / max(float(np.percentile(motion, 99.5)), 1e-6), 0.0, 1.0)
    dim = image * 0.75
    rgb = np.stack(
        [dim + (255 - dim) * strength, dim * (1 - strength), dim * (1 - strength)], axis=-1
    )
    picture = Image.fromarray(np.rint(rgb).astype(np.uint8), mode="RGB")
    scale = image.shape[1] / wide
    corners = _scale_box(box, scale)
    pen = ImageDraw.Draw(picture)
    pen.rectangle(corners, outline=(255, 220, 0), width=3)
    pen.text((corners[0] + 6, corners[1] + 6), str(box), fill=(255, 220, 0))
    stream = io.BytesIO()
    picture.save(stream, format="PNG")
    return stream.getvalue()


def _scale_box(box: CropBox, scale: float) -> Sequence[float]:
    return (
        box.x * scale,
        box.y * scale,
        (box.x + box.width) * scale - 1,
        (box.y + box.height) * scale - 1,
    )
