"""From the stored picture to the upright square that comes out: rotation, pixel shape, crop, scale,
padding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from PIL import Image

from flagdata.core.arrays import UInt8Array
from flagdata.errors import UsageError
from flagdata.ingest.camera.camera_options import Crop, CropBox


@dataclass(frozen=True, kw_only=True)
class Orientation:
    """How the stored picture becomes upright: transposed first, then mirrored left-right, then
    top-bottom.

    Attributes:
        exact: false when the file asked for an angle that is not a multiple of 90° and the nearest
            was taken.
    """

    transpose: bool = False
    flip_x: bool = False
    flip_y: bool = False
    exact: bool = True

    @property
    def mirrored(self) -> bool:
        return (self.transpose + self.flip_x + self.flip_y) % 2 == 1

    @property
    def clockwise(self) -> int:
        """Degrees clockwise that turn the stored picture upright; of a mirrored one, after
        mirroring left-right."""
        if self.transpose:
            return 90 if self.flip_x else 270
        return 180 if self.flip_y else 0

    def apply(self, image: UInt8Array) -> UInt8Array:
        """Turns a stored picture upright, (height, width) → (height, width) or (width, height)."""
        upright = image.T if self.transpose else image
        if self.flip_x:
            upright = upright[:, ::-1]
        return upright[::-1] if self.flip_y else upright

    def upright(self, image: Image.Image) -> Image.Image:
        """As `apply`, of a Pillow image."""
        return _turn_image(image, self._steps)

    def stored(self, image: Image.Image) -> Image.Image:
        """Turns an upright picture back to the stored one: undoes `upright`."""
        return _turn_image(image, self._steps[::-1])

    @property
    def _steps(self) -> tuple[Image.Transpose, ...]:
        chosen = (self.transpose, self.flip_x, self.flip_y)
        steps = (
            Image.Transpose.TRANSPOSE,
            Image.Transpose.FLIP_LEFT_RIGHT,
            Image.Transpose.FLIP_TOP_BOTTOM,
        )
        return tuple(step for step, is_chosen in zip(steps, chosen, strict=True) if is_chosen)

    @classmethod
    def of_display_matrix(cls, matrix: Sequence[int]) -> Orientation:
        """Reads the orientation from the nine numbers a, b, u, c, d, v, x, y, w of a container's
        display matrix.

        A stored pixel (p, q) is shown at (a p + c q, b p + d q), y down (ISO/IEC 14496-12, 8.3.2
        and 6.2.2).
        """
        a, b, c, d = matrix[0], matrix[1], matrix[3], matrix[4]
        exact = (b == c == 0) if abs(a) > abs(b) else (a == d == 0)
        if abs(a) > abs(b):
            return cls(flip_x=a < 0, flip_y=d < 0, exact=exact)
        return cls(transpose=True, flip_x=c < 0, flip_y=b < 0, exact=exact)

    @classmethod
    def of_exif(cls, value: int) -> Orientation:
        """Reads the orientation from the Exif tag Orientation, 1 to 8 (CIPA DC-008, 4.6.4 A); other
        values are upright."""
        table = {
            2: (0, 1, 0),
            3: (0, 1, 1),
            4: (0, 0, 1),
            5: (1, 0, 0),
            6: (1, 1, 0),
            7: (1, 1, 1),
            8: (1, 0, 1),
        }
        transpose, flip_x, flip_y = table.get(value, (0, 0, 0))
        return cls(transpose=bool(transpose), flip_x=bool(flip_x), flip_y=bool(flip_y))


@dataclass(frozen=True, kw_only=True)
class Geometry:
    """The way from a stored picture to a square of `size` pixels.

    The upright image is the stored one with square pixels (its width multiplied by `aspect`) and
    turned. The crop is a box of it. The crop's longer side fills the output; the rest is black,
    half on either side.

    Attributes:
        width, height: of the stored picture [px].
        aspect: width / height of a stored pixel.
        crop: box of the upright image.
        size: side of the output [px].
    """

    width: int
    height: int
    aspect: Fraction
    orientation: Orientation
    crop: CropBox
    size: int

    @cached_property
    def _content(self) -> tuple[int, int]:
        """Width and height of the crop in the output."""
        longest = max(self.crop.width, self.crop.height)
        return (
            max(1, round(Fraction(self.size * self.crop.width, longest))),
            max(1, round(Fraction(self.size * self.crop.height, longest))),
        )

    @property
    def placement(self) -> tuple[int, int, int, int]:
        """Top, left, height and width of the crop in the output; black around it."""
        wide, high = self._content
        return ((self.size - high) // 2, (self.size - wide) // 2, high, wide)

    @property
    def padded(self) -> bool:
        return self._content != (self.size, self.size)

    @cached_property
    def _stored_box(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom of the crop in the stored picture, in fractions of its
        pixels."""
        wide, high = upright_size(self.width, self.height, self.aspect, self.orientation)
        left, right = self.crop.x / wide, (self.crop.x + self.crop.width) / wide
        top, bottom = self.crop.y / high, (self.crop.y + self.crop.height) / high
        if self.orientation.flip_x:
            left, right = 1 - right, 1 - left
        if self.orientation.flip_y:
            top, bottom = 1 - bottom, 1 - top
        if self.orientation.transpose:
            left, top, right, bottom = top, left, bottom, right
        return (
            left * self.width,
            top * self.height,
            min(right, 1.0) * self.width,
            min(bottom, 1.0) * self.height,
        )

    def render(self, luma: Image.Image, *, black: float, white: float) -> UInt8Array:
        """Renders the output square of one stored luma picture; (size, size) uint8.

        Scaling is a separable convolution with the Hamming-windowed kernel, widened when it
        shrinks: it averages over the area an output pixel covers, so nothing aliases, and it has no
        negative lobes, so a flag's edge does not ring. Then `black` … `white` is stretched to 0 …
        255.

        Args:
            luma: mode L or F, `width` × `height`.
            black, white: luma values of reference black and white.
        """
        gray = self.content(luma, black=black, white=white)
        if not self.padded:
            return np.ascontiguousarray(gray)
        square = np.zeros((self.size, self.size), dtype=np.uint8)
        top, left, high, wide = self.placement
        square[top : top + high, left : left + wide] = gray
        return square

    def content(self, luma: Image.Image, *, black: float, white: float) -> UInt8Array:
        """Renders as `render`, without the padding; (height, width) uint8, the longer side
        `size`."""
        wide, high = self._content
        target, box = (high, wide) if self.orientation.transpose else (wide, high), self._stored_box
        is_whole = luma.size == target and box == (0, 0, *target)
        scaled = luma if is_whole else luma.resize(target, Image.Resampling.HAMMING, box=box)
        return self.orientation.apply(_stretch(scaled, black=black, white=white))


def _stretch(image: Image.Image, *, black: float, white: float) -> UInt8Array:
    """Stretches `black` … `white` of an image of mode L or F to 0 … 255."""
    if image.mode == "L" and (black, white) == (0, 255):
        return np.asarray(image)
    factor = 255 / (white - black)
    if image.mode == "L":
        table = np.clip(np.rint((np.arange(256) - black) * factor), 0, 255)
        return np.asarray(image.point(table.astype(int).tolist()))
    values = np.asarray(image, dtype=np.float64)
    return np.clip(np.rint((values - black) * factor), 0, 255).astype(np.uint8)


def _turn_image(image: Image.Image, steps: Sequence[Image.Transpose]) -> Image.Image:
    for step in steps:
        image = image.transpose(step)
    return image


def upright_size(
    width: int, height: int, aspect: Fraction, orientation: Orientation
) -> tuple[int, int]:
    """Computes width and height of the upright image with square pixels; the stored height is
    kept."""
    wide = max(1, round(width * aspect))
    return (height, wide) if orientation.transpose else (wide, height)


def settle_crop(crop: Crop, *, width: int, height: int) -> CropBox:
    """Computes the box that `crop` means in an upright image of `width` × `height`; "auto" must
    have been resolved before.

    Raises:
        UsageError: the box reaches beyond the image.
    """
    if crop == "whole" or crop == "auto":
        return CropBox(x=0, y=0, width=width, height=height)
    if crop == "square":
        side = min(width, height)
        return CropBox(x=(width - side) // 2, y=(height - side) // 2, width=side, height=side)
    if crop.x + crop.width > width or crop.y + crop.height > height:
        raise UsageError(
            f"crop {crop} reaches beyond the image of {width} × {height}",
            where="--crop",
            fix="give a box inside the upright image, after rotation and with square pixels",
        )
    return crop
