"""Real recordings. The figures are those of the files' own description (README of the reference
data)."""

from __future__ import annotations

from pathlib import Path

import pytest

from flagdata.core.findings import Severity
from flagdata.ingest import CameraOptions, open_camera, probe

pytestmark = pytest.mark.reference

# Frames by the containers' own tables (ffprobe -show_entries stream=nb_frames).
TUNNEL = {
    "fullVeloc_10.05": 1001,
    "fullVeloc_10.95": 1001,
    "fullVeloc_12.30": 1002,
    "fullVeloc_7.64": 1001,
    "fullVeloc_8.09": 1006,
    "fullVeloc_9.30": 1001,
    "rectVeloc_10.80": 302,
    "rectVeloc_12.30": 1024,
    "triangVeloc_10.05": 1001,
    "triangVeloc_12.30": 1002,
    "triangVeloc_7.04": 1003,
    "triangVeloc_8.54": 1005,
}


def tunnel(reference_data: Path, name: str) -> Path:
    return reference_data / "video" / "dadamo-2024" / f"{name}_60fps_rv.mp4"


def test_every_tunnel_clip_is_a_second_of_1000_hz(reference_data: Path) -> None:
    for name, frames in TUNNEL.items():
        seen = probe(tunnel(reference_data, name))
        assert (seen.frames, seen.rate, seen.variable_rate) == (frames, 60.0, False), name
        assert (seen.width, seen.height, seen.rotation, seen.start) == (1080, 1920, 0, None), name
        assert not [f for f in seen.findings if f.severity is not Severity.NOTE], name


def test_a_tunnel_clip_at_its_true_rate(reference_data: Path) -> None:
    options = CameraOptions(start=0, true_fps=1000.0, crop="square")
    with open_camera(tunnel(reference_data, "rectVeloc_10.80"), options) as stream:
        times = [f.time for f in stream]
        info = stream.info
    # 302 frames at 1000 Hz: 0 … 301 ms, so the instants 0, 40, …, 280 ms.
    assert times == [k * 40_000_000 for k in range(8)]
    assert (info.container_rate, info.true_rate, info.duration) == (
        60.0,
        1000.0,
        pytest.approx(0.301),
    )


def test_the_phones_rate_varies_between_23_and_43_ms(reference_data: Path) -> None:
    with open_camera(
        reference_data / "video" / "dadamo-2024" / "phone_vfr.mp4", CameraOptions(start=0)
    ) as stream:
        frames = list(stream)
        info, found = stream.info, {f.kind: f for f in stream.findings}
    assert info.variable_rate
    assert "23.4 to 43.3 ms" in found["variable-rate"].what
    assert info.duration == pytest.approx(6.803, abs=1e-3)
    # No instant can be farther from a frame than half the longest step, 21.7 ms.
    assert max(f.stamp_error for f in frames) <= 0.0217
    assert len(frames) == 171
    assert "frames-missing" not in found


def test_the_dyntex_flag_has_wide_pixels_and_all_its_frames(reference_data: Path) -> None:
    path = reference_data / "video" / "dyntex_flag_571c110.avi"
    with open_camera(path, CameraOptions(start=0, crop="auto")) as stream:
        frames = list(stream)
        info = stream.info
    # 352 × 288 with pixels of 12:11 is 384 × 288.
    assert (info.width, info.height, info.container_rate) == (384, 288, 25.0)
    assert [f.time for f in frames] == [k * 40_000_000 for k in range(250)]
    # Measured by eye in the upright image, the large flag spans columns 86 to 335 and rows 45 to
    # 180.
    x, y, width, height = info.crop
    assert x <= 86
    assert x + width >= 335
    assert y <= 45
    assert y + height >= 180
