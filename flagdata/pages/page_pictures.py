"""Pictures inside a page, as URLs that hold them: frames, clips in motion."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence

import numpy as np
from PIL import Image

from flagdata.core.arrays import UInt8Array


def data_url(data: bytes, media_type: str) -> str:
    """Writes the bytes as a URL that holds them."""
    return f"data:{media_type};base64,{base64.b64encode(data).decode('ascii')}"


def still(frame: UInt8Array | Image.Image, *, side: int | None = None) -> str:
    """Writes a frame (height, width) as a JPEG in a data URL, at its own size or `side` pixels wide
    and high."""
    return _url([_shrink_picture(frame, side)], "jpeg", quality=85)


def moving(clip: Sequence[UInt8Array] | UInt8Array, *, rate: float, side: int) -> str:
    """Writes the largest centred square of a clip (frame, height, width), gray or in colour,
    endless at `rate` [Hz], as a WebP in a data URL."""
    frames = np.asarray(clip)
    square = min(frames.shape[1:3])
    top, left_edge = (frames.shape[1] - square) // 2, (frames.shape[2] - square) // 2
    cut = frames[:, top : top + square, left_edge : left_edge + square]
    return _url(
        [_shrink_picture(frame, side) for frame in cut],
        "webp",
        quality=60,
        duration=round(1000 / rate),
        loop=0,
    )


def _shrink_picture(frame: UInt8Array | Image.Image, side: int | None) -> Image.Image:
    image = frame if isinstance(frame, Image.Image) else Image.fromarray(frame)
    return image if side is None else image.resize((side, side), Image.Resampling.LANCZOS)


def _url(images: Sequence[Image.Image], kind: str, **options: int) -> str:
    buffer = io.BytesIO()
    if len(images) > 1:
        options["save_all"] = True
        images[0].save(buffer, kind, append_images=images[1:], **options)
    else:
        images[0].save(buffer, kind, **options)
    return data_url(buffer.getvalue(), f"image/{kind}")
