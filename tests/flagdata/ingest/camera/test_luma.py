"""The gray of every pixel format."""

from __future__ import annotations

import av
import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.camera.luma import luma_of_frame


def levels(frame: av.VideoFrame, codec: str = "h264") -> np.ndarray:
    """Gray of black … white as 0 … 255, not rounded."""
    luma = luma_of_frame(frame, codec=codec)
    return (np.asarray(luma.image).astype(float) - luma.black) * 255 / (luma.white - luma.black)


def frame(pixel_format: str, value: int, *, width: int = 34, height: int = 18) -> av.VideoFrame:
    """A frame of one luma value, chroma in the middle, in the format's own units."""
    gray = av.VideoFrame(width, height, "yuv444p16le")
    for index, plane in enumerate(gray.planes):
        words = np.full(
            plane.buffer_size // 2, value * 256 if index == 0 else 128 * 256, dtype="<u2"
        )
        plane.update(words.tobytes())
    return gray.reformat(format=pixel_format, threads=1)


@pytest.mark.parametrize(
    "pixel_format",
    [
        "yuv420p",
        "yuv422p",
        "yuv444p",
        "yuv411p",
        "nv12",
        "nv21",
        "yuyv422",
        "uyvy422",
        "yuv420p10le",
        "yuv422p10le",
        "yuv444p12le",
        "yuv420p16le",
        "yuv420p10be",
        "p010le",
        "p016le",
        "y210le",
        "yuva420p",
    ],
)
def test_limited_luma_means_the_same_in_every_layout(pixel_format: str) -> None:
    # 16 is black, 235 white, 126 at (126 - 16) / 219 between.
    for value, expected in ((16, 0.0), (235, 255.0), (126, 110 / 219 * 255)):
        gray = levels(frame(pixel_format, value))
        assert gray.shape == (18, 34)
        # Layout changes round, and dither by one step at 8 bits: 255 / 219.
        assert np.abs(gray - expected).max() <= 1.2, value


def test_the_full_range_of_jpeg_formats_is_not_stretched() -> None:
    gray = av.VideoFrame(32, 16, "yuvj420p")
    for plane, value in zip(gray.planes, (200, 128, 128), strict=True):
        plane.update(np.full(plane.buffer_size, value, dtype=np.uint8).tobytes())
    assert (levels(gray) == 200).all()


def test_a_gray_plane_is_full_in_a_picture_codec_and_limited_in_a_video_codec_unless_it_says() -> (
    None
):
    gray = av.VideoFrame.from_ndarray(np.full((16, 32), 235, dtype=np.uint8), format="gray")
    assert (levels(gray, "png") == 235).all()
    assert (levels(gray, "h264") == 255).all()
    gray.color_range = 2
    assert (levels(gray, "h264") == 235).all()


@pytest.mark.parametrize(
    ("rgb", "expected"),
    # Rec. 601 weights, as in JPEG (ITU-T T.871): 0.299, 0.587, 0.114.
    [
        ((255, 0, 0), 76.2),
        ((0, 255, 0), 149.7),
        ((0, 0, 255), 29.1),
        ((255, 255, 255), 255.0),
        ((10, 200, 90), 130.65),
    ],
)
def test_rgb_becomes_luma_by_rec_601(rgb: tuple[int, int, int], expected: float) -> None:
    image = np.tile(np.array(rgb, dtype=np.uint8), (16, 32, 1))
    for pixel_format in ("rgb24", "bgr24", "rgba", "gbrp"):
        source = av.VideoFrame.from_ndarray(image, format="rgb24").reformat(
            format=pixel_format, threads=1
        )
        # One step of rounding.
        assert np.abs(levels(source, "png") - expected).max() <= 0.6, pixel_format


def test_rows_padded_by_the_decoder_do_not_show() -> None:
    # 34 pixels a row are stored in rows of 64 bytes or more.
    ramp = np.tile(np.arange(34, dtype=np.uint8) + 16, (18, 1))
    source = av.VideoFrame.from_ndarray(ramp, format="gray").reformat(format="gray", threads=1)
    luma = luma_of_frame(source, codec="png")
    assert np.array_equal(np.asarray(luma.image), ramp)


def test_a_sensor_mosaic_is_refused() -> None:
    with pytest.raises(InputError, match="bayer"):
        luma_of_frame(av.VideoFrame(32, 16, "bayer_rggb8"), codec="rawvideo")


def test_a_conversion_gives_the_same_gray_every_time() -> None:
    # swscale with several threads mixed up bands of rows in about one conversion of a hundred.
    grays = [levels(frame("p010le", 126, width=64, height=96)) for _ in range(200)]
    assert all(np.array_equal(gray, grays[0]) for gray in grays)
