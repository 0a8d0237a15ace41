"""The camera behind the picture: noise of the stated size, files whose length reveals nothing."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
import simplejpeg
from PIL import Image

from flagdata.errors import InputError
from flagdata.recipes.typed_tables import Range
from flagdata.record import Coding
from sim.datasets import CameraSpec, settings
from sim.datasets.camera_picture import jpegs, pad_jpeg

SLOT = 65536
EXACT = {"camera.jpeg_quality": 100.0, "camera.read_noise": 0.0, "camera.shot_noise": 0.0}


def decoded(jpeg: bytes) -> np.ndarray:
    return simplejpeg.decode_jpeg(jpeg, colorspace="GRAY")[..., 0]


def test_a_filled_jpeg_is_the_same_picture_for_two_decoders() -> None:
    image = np.random.default_rng(0).integers(0, 256, (40, 60), dtype=np.uint8)
    plain = simplejpeg.encode_jpeg(image[..., None], quality=80, colorspace="GRAY")
    for length in (len(plain), len(plain) + 1, 4096, 65536):
        long = pad_jpeg(plain, length)
        assert len(long) == length
        np.testing.assert_array_equal(decoded(long), decoded(plain))
        np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(long))), decoded(plain))


def test_gray_is_rec_601_luma() -> None:
    # Y = 0.299 R + 0.587 G + 0.114 B (ITU-R BT.601), within the half step of rounding and one of the JPEG.
    frames = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [200, 100, 50]], dtype=np.uint8)
    shown = np.broadcast_to(frames[:, None, None, :], (4, 16, 16, 3))
    grays = [decoded(jpeg) for jpeg in jpegs(shown, EXACT, slot=SLOT, seed=0)[0]]
    for gray, (r, g, b) in zip(grays, frames.astype(float), strict=True):
        assert np.abs(gray - (0.299 * r + 0.587 * g + 0.114 * b)).max() <= 1.5


@pytest.mark.parametrize(("level", "variance"), [(64, 4 + 9 * 64 / 255), (192, 4 + 9 * 192 / 255)])
def test_noise_has_the_variance_of_reading_and_light(level: int, variance: float) -> None:
    frames = np.full((1, 256, 256, 3), level, dtype=np.uint8)
    drawn = {**EXACT, "camera.read_noise": 2.0, "camera.shot_noise": 3.0}
    ((jpeg,), _) = jpegs(frames, drawn, slot=2 * SLOT, seed=3)
    # 1/12 of rounding and about as much of the JPEG at quality 100; 65,536 pixels: 0.6 % of the
    # variance is one σ.
    assert decoded(jpeg).astype(float).var() == pytest.approx(variance + 1 / 12, rel=0.05)


def test_frames_have_noise_of_their_own_and_the_same_seed_the_same_bytes() -> None:
    frames = np.full((2, 32, 32, 3), 128, dtype=np.uint8)
    drawn = {**EXACT, "camera.read_noise": 2.0}
    (first, second), _ = jpegs(frames, drawn, slot=SLOT, seed=3)
    assert first != second
    assert [first, second] == jpegs(frames, drawn, slot=SLOT, seed=3)[0]
    assert first != jpegs(frames, drawn, slot=SLOT, seed=4)[0][0]


def test_a_film_with_a_frame_too_long_has_the_best_quality_at_which_all_fit() -> None:
    flat = np.full((32, 32, 3), 128, dtype=np.uint8)
    busy = np.random.default_rng(0).integers(0, 256, (32, 32, 3), dtype=np.uint8)
    drawn = {**EXACT, "camera.jpeg_quality": 90.0}
    gray = np.asarray(Image.fromarray(busy).convert("L"))[..., None]
    lengths = [
        len(simplejpeg.encode_jpeg(gray, quality=quality, colorspace="GRAY"))
        for quality in range(101)
    ]
    slot = lengths[70]
    (first, second), quality = jpegs(np.stack([flat, busy]), drawn, slot=slot, seed=1)
    assert len(first) == len(second) == slot
    assert quality == max(q for q in range(1, 91) if lengths[q] <= slot)
    assert jpegs(flat[None], drawn, slot=slot, seed=1)[1] == 90
    with pytest.raises(InputError, match="at the lowest quality"):
        jpegs(busy[None], drawn, slot=lengths[1] - 1, seed=1)


def test_each_setting_has_a_stream_of_its_own() -> None:
    spec = CameraSpec(
        coding=Coding.JPEG,
        jpeg_quality=Range(low=70, high=90),
        rate_factor=20.0,
        read_noise=Range(low=0, high=2),
        shot_noise=1.0,
        frame_slot=1,
    )
    fixed = replace(spec, jpeg_quality=80)
    video = replace(spec, coding=Coding.H264, rate_factor=Range(low=18, high=24))
    assert (
        settings(video, seed=5)["camera.read_noise"] == settings(spec, seed=5)["camera.read_noise"]
    )
    assert 18 <= settings(video, seed=5)["camera.rate_factor"] <= 24
    assert (
        settings(spec, seed=5)["camera.read_noise"] == settings(fixed, seed=5)["camera.read_noise"]
    )
    drawn = [settings(spec, seed=seed)["camera.jpeg_quality"] for seed in range(40)]
    assert all(70 <= value <= 90 and value == round(value) for value in drawn)
    assert len(set(drawn)) > 10
