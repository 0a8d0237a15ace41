"""From linear light to bytes: sRGB, the background behind the scene, the exposure. One way for all
renderers."""

from __future__ import annotations

import functools
import math

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from flagdata.core.arrays import Float32Array, UInt8Array
from flagdata.core.schema import FRAME_SIZE
from sim.assets.colour import decode_values
from sim.render.parameters import RenderParameters

_WHOLE = 0.6  # the background scale at which an image's shorter side just fills the frame


@functools.cache
def _decoding() -> Float32Array:
    return decode_values(np.arange(256) / 255).astype(np.float32)


def to_linear(image: UInt8Array) -> Float32Array:
    """Converts sRGB bytes of any shape to linear values in [0, 1] (IEC 61966-2-1)."""
    return _decoding()[image]


def to_bytes(linear: Tensor) -> Tensor:
    """Converts linear values of any shape, clipped to [0, 1], to sRGB bytes (IEC 61966-2-1),
    rounded to nearest."""
    value = linear.clamp(0.0, 1.0)
    code = torch.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return (code * 255 + 0.5).to(torch.uint8)


def plate(image: UInt8Array, parameters: RenderParameters) -> Float32Array:
    """Resamples the background as it appears in the frame.

    At `background_scale` 0.6 the image's shorter side is as long as the frame's longer one; larger
    scales enlarge it about its middle. What lies outside of the image is its reflection.

    Args:
        image: (height, width, 3) sRGB bytes of any size.

    Returns:
        (height, width, 3) linear, in [0, 1].
    """
    zeta = parameters
    rows, columns = image.shape[:2]
    longer = max(zeta.width, zeta.height)
    pixel = (
        min(rows, columns) * _WHOLE / (longer * zeta.background_scale)
    )  # px of the image a px of the frame
    moved = longer / FRAME_SIZE
    left = columns / 2 - (zeta.width / 2 + zeta.background_offset_x * moved) * pixel
    top = rows / 2 - (zeta.height / 2 + zeta.background_offset_y * moved) * pixel
    right, bottom = left + zeta.width * pixel, top + zeta.height * pixel
    margin = max(0, *(math.ceil(v) + 1 for v in (-left, -top, right - columns, bottom - rows)))
    padded = np.pad(image, ((margin, margin), (margin, margin), (0, 0)), mode="symmetric")
    box = (left + margin, top + margin, right + margin, bottom + margin)
    resized = Image.fromarray(padded).resize(
        (zeta.width, zeta.height), Image.Resampling.BICUBIC, box=box
    )
    return to_linear(np.asarray(resized))


def develop(scene: Tensor, behind: Tensor, *, gain: float) -> Tensor:
    """Composes the scene over its background, as bytes.

    Args:
        scene: (frame, height, width, 4) linear radiance times coverage [W/(m² sr)], and coverage in
            [0, 1].
        behind: (height, width, 3) linear image values of the background.
        gain: image value of a radiance of 1 W/(m² sr), see `RenderParameters.gain`.

    Returns:
        (frame, height, width, 3) uint8 sRGB.
    """
    return to_bytes(scene[..., :3] * gain + (1 - scene[..., 3:]) * behind)
