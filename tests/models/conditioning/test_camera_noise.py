"""A camera's noise in one picture: its deviation, counted in whole numbers as it is computed from
real ones."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.rng import stream
from models.conditioning import camera_noise


@pytest.mark.parametrize("width", [133, 134])  # an odd and an even number of pixels
def test_the_noise_of_a_picture_is_its_deviation_and_the_median_of_its_filtered_values(
    width: int,
) -> None:
    slope = np.linspace(40, 200, width)[None]
    picture = np.rint(slope + 3.0 * stream(2, "noise").standard_normal((201, width))).astype(
        np.uint8
    )
    level = camera_noise.deviation_in(picture)
    assert level == pytest.approx(3.0, rel=0.05)
    filtered = camera_noise.rough(picture.astype(np.float32))[2:-2, 2:-2]
    assert level == pytest.approx(camera_noise.deviation(filtered), rel=1e-6)
