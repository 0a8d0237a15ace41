"""The luma of a decoded frame, as a Pillow image over the decoder's own memory where the format
allows."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import cast

import av
import numpy as np
from PIL import Image

from flagdata.errors import InputError

_FULL = 2  # AVCOL_RANGE_JPEG
_LIMITED = 1  # AVCOL_RANGE_MPEG
_STILL_CODECS = frozenset(
    {"mjpeg", "png", "apng", "gif", "bmp", "tiff", "webp", "jpeg2000", "ljpeg", "jpegls", "ffv1"}
)
BROKEN = (
    OSError,
    ValueError,
    SyntaxError,
    EOFError,
    TypeError,
    LookupError,
    ArithmeticError,
    struct.error,
    Image.DecompressionBombError,
)
"""What Pillow raises on a picture that is damaged."""
DEEP = "I;16"
"""How Pillow's names of modes of 16 bits begin."""
STILLS = ("JPEG", "PNG", "WEBP")
"""Formats in which other programs' data sets hold single pictures."""


@dataclass(frozen=True, kw_only=True)
class Luma:
    """One stored picture's luma.

    Attributes:
        image: mode L (8 bits) or F (more).
        black, white: its values of reference black and white.
    """

    image: Image.Image
    black: float
    white: float


def luma_of_frame(frame: av.VideoFrame, *, codec: str) -> Luma:
    """Extracts the luma of a frame: a Y'CbCr stream's own Y', whatever matrix (Rec. 601, 709, 2020)
    it was made with.

    A stream of RGB has none: Rec. 601 weights make it (0.299, 0.587, 0.114), as JPEG (ITU-T T.871)
    does, so that the same picture as PNG and as JPEG gives the same gray. The range is what the
    stream says; where it says nothing, limited for Y'CbCr (the default of H.264, E.2.1) and full
    for still-picture codecs. Alpha is left aside.

    Raises:
        InputError: a pixel format that has no luma (Bayer mosaics, XYZ).
    """
    name = frame.format.name
    if name.startswith(("xyz", "bayer", "vaapi", "cuda")):
        raise InputError(
            f"pixel format {name} is neither gray, YUV nor RGB",
            fix="convert the file to H.264 first",
        )
    if frame.format.is_rgb or frame.format.has_palette or name.startswith("mono"):
        rgb = _convert(frame, "rgb24")
        plane = rgb.planes[0]
        colour = Image.frombuffer(
            "RGB", (rgb.width, rgb.height), bytes(plane), "raw", "RGB", plane.line_size, 1
        )
        return Luma(image=colour.convert("L"), black=0.0, white=255.0)
    first = frame.format.components[0]
    bits = first.bits
    alone = sum(component.plane == 0 for component in frame.format.components) == 1
    if not (alone and (bits == 8 or (name.startswith(("yuv", "gray")) and name.endswith("le")))):
        bits = 8 if bits == 8 else 16
        frame = _convert(frame, "yuv444p" if bits == 8 else "yuv444p16le")
    plane = frame.planes[0]
    if bits == 8:
        memory = cast(bytes, plane)  # Pillow takes any buffer, and keeps it alive
        image = Image.frombuffer(
            "L", (frame.width, frame.height), memory, "raw", "L", plane.line_size, 1
        )
    else:
        words = np.frombuffer(memoryview(plane), dtype="<u2").reshape(-1, plane.line_size // 2)[
            : frame.height, : frame.width
        ]
        image = Image.fromarray(words.astype(np.float32))
    if _is_full(frame, name, codec):
        return Luma(image=image, black=0.0, white=float(2**bits - 1))
    return Luma(image=image, black=float(16 << (bits - 8)), white=float(235 << (bits - 8)))


def luma_of_image(image: Image.Image) -> Luma:
    """Loads the pixels. A JPEG's own Y' is taken as it is; RGB is weighted by Rec. 601, see
    `luma_of_frame`."""
    image.draft("L", image.size)
    if image.mode.startswith(DEEP):
        words = np.asarray(image).astype(np.float32)
        return Luma(image=Image.fromarray(words), black=0.0, white=65535.0)
    if image.mode in ("I", "F"):
        raise InputError(
            f"an image of mode {image.mode} states no range of gray",
            fix="use images of 8 or 16 bits",
        )
    gray = (
        image.convert("RGB").convert("L") if image.mode not in ("L", "LA") else image.convert("L")
    )
    gray.load()
    return Luma(image=gray, black=0.0, white=255.0)


def _convert(frame: av.VideoFrame, pixel_format: str) -> av.VideoFrame:
    """Converts a picture to another layout, by one thread: with several, swscale mixed up bands of
    rows."""
    return frame.reformat(format=pixel_format, threads=1)


def _is_full(frame: av.VideoFrame, name: str, codec: str) -> bool:
    if name.startswith("yuvj"):
        return True
    color_range = int(frame.color_range)
    if color_range in (_FULL, _LIMITED):
        return color_range == _FULL
    return codec in _STILL_CODECS
