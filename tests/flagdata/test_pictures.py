"""Pictures inside a page."""

from __future__ import annotations

import base64
import io

import numpy as np
from PIL import Image

from flagdata.pages import moving


def test_the_middle_of_a_clip_in_colour_is_shown_in_colour() -> None:
    """A red picture with a blue square in its middle, which is all that is left of it."""
    clip = np.zeros((3, 20, 40, 3), dtype=np.uint8)
    clip[..., 0] = 200
    clip[:, :, 10:30] = (0, 0, 200)
    with Image.open(
        io.BytesIO(base64.b64decode(moving(clip, rate=10, side=16).partition(",")[2]))
    ) as image:
        shown = np.asarray(image.convert("RGB")).astype(int)
    assert shown.shape == (16, 16, 3)
    assert (shown[..., 2] > 150).all()
    assert (shown[..., 0] < 60).all()
