"""Pictures of 16 bits show what is in them, or are refused as what they are; none comes out
black."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from flagdata.errors import InputError
from flagdata.ingest import CameraOptions, open_camera
from tests.flagdata.ingest.mcap.conftest import NOON, STEP
from tests.flagdata.ingest.mcap.ros import COMPRESSED, PLAIN, Cdr, bag, channel, gray, plain
from tests.flagdata.ingest.mcap.test_mcap_layout import grays


def png(image: NDArray[np.uint16]) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, "PNG")
    return buffer.getvalue()


def stills(path: Path, *, scale: int, said: str, white: int = 255) -> Path:
    """Twenty PNG pictures of 16 bits: a gray, and one pixel of white."""
    with bag(path) as writer:
        camera = channel(writer, "/cam", "sensor_msgs/msg/CompressedImage", COMPRESSED)
        for k in range(20):
            at = NOON + k * STEP
            image = gray(k).astype(np.uint16) * scale
            image[0, 0] = white * scale
            data = Cdr().stamp(at).text("cam").text(said).data(png(image)).done()
            writer.add_message(camera, at, data, at)
    return path


@pytest.mark.parametrize(("scale", "reported"), [(257, False), (16, True), (4, True)])
def test_grays_of_16_bits_that_fill_fewer_are_shown_and_reported(
    tmp_path: Path, scale: int, reported: bool
) -> None:
    found, kinds = grays(stills(tmp_path / "a.mcap", scale=scale, said="mono16; png compressed "))
    assert found == list(range(20))
    assert ("depth-by-content" in kinds) is reported


@pytest.mark.parametrize("white", [100, 187, 255])
@pytest.mark.parametrize("scale", [4, 16, 64, 257])
def test_a_topic_and_a_folder_of_the_same_pictures_are_read_alike(
    tmp_path: Path, scale: int, white: int
) -> None:
    path = stills(tmp_path / "a.mcap", scale=scale, said="mono16; png compressed ", white=white)
    (tmp_path / "images").mkdir()
    for k in range(20):
        image = gray(k).astype(np.uint16) * scale
        image[0, 0] = white * scale
        Image.fromarray(image).save(tmp_path / "images" / f"{k}.png")
    options = CameraOptions(rate="native", start=NOON, crop="whole")
    read = []
    for source, rate in ((path, None), (tmp_path / "images", 25.0)):
        with open_camera(source, replace(options, sequence_fps=rate)) as stream:
            frames = [frame.image for frame in stream]
            found = {one.kind: one.value for one in stream.findings}
        read.append((frames, found.get("depth-by-content")))
    (of_topic, bits_of_topic), (of_folder, bits_of_folder) = read
    assert bits_of_topic == bits_of_folder == {4: 10, 16: 12, 64: 14, 257: None}[scale]
    np.testing.assert_array_equal(of_topic, of_folder)


@pytest.mark.parametrize(
    "said", ["16UC1; png compressed ", "16UC1; compressedDepth png", "32FC1; compressedDepth rvl"]
)
def test_depths_are_refused_by_the_name_of_their_format(tmp_path: Path, said: str) -> None:
    with pytest.raises(InputError, match=said.strip().split(";")[0]):
        grays(stills(tmp_path / "a.mcap", scale=20, said=said))


@pytest.mark.parametrize("encoding", ["mono16", "16UC1", "32FC1", "bayer_rggb8", "nv12"])
def test_plain_pixels_that_are_not_read_are_refused_by_their_encoding(
    tmp_path: Path, encoding: str
) -> None:
    path = tmp_path / "a.mcap"
    with bag(path) as writer:
        camera = channel(writer, "/cam", "sensor_msgs/msg/Image", PLAIN)
        for k in range(5):
            at = NOON + k * STEP
            writer.add_message(camera, at, plain(at, gray(k).astype(np.uint16) * 20, encoding), at)
    with pytest.raises(InputError, match=encoding.lower()):
        grays(path)
