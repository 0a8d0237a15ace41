"""A film with transparency: the picture below it is read, and that it was left aside is
reported."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from tests.flagdata.ingest.camera.conftest import PLAIN, number_of, numbered
from tests.flagdata.ingest.camera.reading import read

FRAMES = 8


@pytest.mark.parametrize(
    ("name", "codec", "pixels"),
    [
        ("a.mov", "prores_ks", "yuva444p10le"),
        ("a.mov", "qtrle", "argb"),
        ("a.mov", "png", "rgba"),
        ("a.mov", "png", "ya8"),
        ("a.mkv", "ffv1", "yuva420p"),
        ("a.avi", "utvideo", "gbrap"),
        ("a.apng", "apng", "rgba"),
        ("a.webm", "libvpx-vp9", "yuva420p"),
        ("a.webm", "libvpx", "yuva420p"),
        ("a.mkv", "libvpx-vp9", "yuva420p"),
        ("a.mkv", "ffv1", "yuv420p"),
        ("a.webm", "libvpx-vp9", "yuv420p"),
        ("a.mov", "png", "rgb24"),
    ],
)
def test_a_film_with_transparency_is_read_below_it_and_says_so(
    name: str, codec: str, pixels: str, tmp_path: Path
) -> None:
    path, clear = tmp_path / name, "a" in pixels
    with av.open(str(path), "w") as out:
        stream = out.add_stream(codec, rate=25)
        stream.width, stream.height, stream.pix_fmt = 96, 96, pixels
        stream.codec_context.time_base = Fraction(1, 25)
        if codec.startswith("libvpx"):
            stream.options = {"b": "2M", "auto-alt-ref": "0"}
            if clear:
                stream.metadata["alpha_mode"] = "1"
        for k in range(FRAMES):
            gray, alpha = numbered(k), np.full((96, 96), 255, dtype=np.uint8)
            alpha[:, 48:] = 0
            frame = av.VideoFrame.from_ndarray(np.dstack([gray, gray, gray, alpha]), format="rgba")
            frame = frame.reformat(format=pixels, threads=1)
            frame.pts, frame.time_base = k, Fraction(1, 25)
            out.mux(stream.encode(frame))
        out.mux(stream.encode())
    _, frames, found = read(path, replace(PLAIN, rate="native"))
    assert [number_of(frame.image) for frame in frames] == list(range(FRAMES))
    assert ("alpha-ignored" in found) == clear


def test_a_palettes_transparency_is_transparency(tmp_path: Path) -> None:
    for transparent in (False, True):
        path = tmp_path / f"{transparent}.avi"
        pictures = tmp_path / f"{transparent}.png"
        image = Image.fromarray(numbered(5)).convert("P")
        image.save(pictures, **({"transparency": bytes([0] + [255] * 254)} if transparent else {}))
        with av.open(str(path), "w") as out:
            stream = out.add_stream("png", rate=25)
            stream.width, stream.height, stream.pix_fmt = 96, 96, "pal8"
            for k in range(3):
                packet = av.Packet(pictures.read_bytes())
                packet.pts = packet.dts = k
                packet.time_base, packet.stream, packet.is_keyframe = Fraction(1, 25), stream, True
                out.mux(packet)
        found = read(path, replace(PLAIN, rate="native"))[2]
        assert ("alpha-ignored" in found) == transparent
