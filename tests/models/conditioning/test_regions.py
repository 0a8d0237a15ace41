"""Which of the things that move in a film are regions of cloth, and how they are outlined."""

from __future__ import annotations

import cv2
import numpy as np

from flagdata.core.arrays import Float32Array, FloatArray, UInt8Array
from flagdata.core.rng import stream
from models.conditioning.regions import regions_of

HEIGHT, WIDTH = 120, 200
BOX = (30, 30, 90, 70)
"""Left, top, right and bottom of the flag [px]."""


def flag(picture: Float32Array, time: float) -> None:
    """Shades that travel along a flag within `BOX`."""
    left, top, right, bottom = BOX
    along = np.arange(right - left)
    picture[top:bottom, left:right] = 90 + 60 * np.sin(2 * np.pi * (along / 30 - 2.1 * time))


def cloudy(times: FloatArray) -> UInt8Array:
    """A flag, and a cloud that drifts by 4 px a second."""
    rows, columns = np.indices((HEIGHT, WIDTH), dtype=np.float32)
    out = []
    for time in times:
        cloud = np.exp(-((((columns - 125 - 4 * time) / 14) ** 2 + ((rows - 80) / 14) ** 2) ** 2))
        picture = (120 + 110 * cloud).astype(np.float32)
        flag(picture, float(time))
        out.append(picture)
    return np.stack(out).astype(np.uint8)


def test_a_cloud_that_drifts_is_no_cloth_where_frames_near_each_other_are_compared() -> None:
    times = (np.arange(0.0, 12.0, 1.0)[:, None] + [0.0, 0.16]).ravel()
    (found,) = regions_of(cloudy(times), times)
    assert np.abs(np.array(found.box) - BOX).max() <= 6
    # A second apart, the cloud changes the picture as much as the flag does.
    apart = np.arange(0.0, 12.0, 1.0)
    assert max(region.box[2] for region in regions_of(cloudy(apart), apart)) > 130


def test_a_pole_that_sways_is_taken_off_a_flag() -> None:
    times = np.arange(40) / 25
    pictures = []
    for time in times:
        picture = np.full((HEIGHT, WIDTH), 150, np.float32)
        flag(picture, float(time))
        x = round(27 + 1.5 * np.sin(9 * time))
        cv2.rectangle(picture, (x, 20), (x + 1, HEIGHT - 1), 20, -1)
        pictures.append(picture)
    (found,) = regions_of(np.stack(pictures).astype(np.uint8), times)
    assert found.box[3] < BOX[3] + 20  # the pole reaches 50 px below the flag


def test_nothing_but_noise_is_no_region() -> None:
    noise = stream(3, "noise").normal(120, 3, (30, HEIGHT, WIDTH))
    assert regions_of(noise.astype(np.uint8), np.arange(30) / 25) == ()


def test_cloth_outside_of_where_it_is_sought_is_no_region() -> None:
    times = np.arange(30) / 25
    within = np.zeros((HEIGHT, WIDTH), bool)
    within[:, 120:] = True
    still = cloudy(np.zeros(30))
    for picture, time in zip(still, times, strict=True):
        part = picture.astype(np.float32)
        flag(part, float(time))
        picture[:] = part.astype(np.uint8)
    assert len(regions_of(still, times)) == 1
    assert regions_of(still, times, within=within) == ()
