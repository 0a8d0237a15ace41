"""A square about a flag may reach beyond the picture on any side: the picture's edge goes on
there."""

from __future__ import annotations

import numpy as np

from flagdata.core.rng import stream
from models.conditioning.framing import Square, cut


def test_a_square_beyond_the_picture_repeats_its_nearest_pixels() -> None:
    rng = stream(1, "squares")
    for height, width, side, x, y in rng.integers(
        [1, 1, 1, -90, -90], [60, 60, 60, 90, 90], (300, 5)
    ).tolist():
        picture = rng.integers(0, 256, (height, width), dtype=np.uint8)
        nearest = picture[
            np.ix_(
                np.arange(y, y + side).clip(0, height - 1),
                np.arange(x, x + side).clip(0, width - 1),
            )
        ]
        np.testing.assert_array_equal(cut(picture, Square(x=x, y=y, side=side), side), nearest)
