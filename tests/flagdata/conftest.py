"""A small camera file and an anemometer log as devices write them, made here."""

from __future__ import annotations

import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from flagdata.commands.confirm_recipe import OnCommandLine
from flagdata.lake import Lake
from tests.confirming import CONFIRMED

VIDEO_START = "2026-05-01T10:00:00Z"


def write_video(
    path: Path, *, frames: int = 100, rate: int = 50, creation_time: str | None = VIDEO_START
) -> Path:
    """Writes an MP4 of a bright bar that sways, (48, 64) pixels, constant rate."""
    column, row = np.meshgrid(np.arange(64), np.arange(48))
    with av.open(str(path), "w") as container:
        if creation_time is not None:
            container.metadata["creation_time"] = creation_time
        stream = container.add_stream("libx264", rate=rate, options={"threads": "1"})
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        stream.codec_context.time_base = Fraction(1, rate)
        for k in range(frames):
            bar = np.abs(column - 32 - 12 * np.sin(row / 9 + 2 * np.pi * 2 * k / rate)) < 4
            image = (40 + row + 150 * bar).astype(np.uint8)
            frame = av.VideoFrame.from_ndarray(image, format="gray").reformat(format="yuv420p")
            frame.pts = k
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


@pytest.fixture(scope="session")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """100 frames at 50 Hz from 2026-05-01T10:00:00Z on."""
    return write_video(tmp_path_factory.mktemp("video") / "field.mp4")


@pytest.fixture(scope="session")
def wind_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """120 s at 1 Hz, units in the heading, stamps at +02:00, one value missing in row 31."""
    rows = ["time,wind_speed (m/s),wind_direction (deg)"]
    for k in range(120):
        speed = "" if k == 30 else f"{5 + np.sin(k / 7):.2f}"
        rows.append(f"2026-05-01T12:{k // 60:02d}:{k % 60:02d}+02:00,{speed},{200 + k % 9}")
    path = tmp_path_factory.mktemp("wind") / "mast.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.fixture
def lake(tmp_path: Path, request: pytest.FixtureRequest) -> Lake:
    """An empty lake: in a folder, or with FLAGDATA_TEST_STORAGE=s3 in a bucket."""
    if os.environ.get("FLAGDATA_TEST_STORAGE") == "s3":
        if (marker := request.node.get_closest_marker("disk")) is not None:
            pytest.skip(f"of a disk: {marker.args[0]}")
        return Lake.create(request.getfixturevalue("bucket_folder"))
    return Lake.create(tmp_path / "lake")


@pytest.fixture
def remote_lake(bucket_folder: str) -> Lake:
    """An empty lake in a bucket."""
    return Lake.create(bucket_folder)


@pytest.fixture
def confirmed_drafts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drafts that the command line shows are confirmed."""
    monkeypatch.setattr(OnCommandLine, "__call__", lambda self, drafted: CONFIRMED(drafted))


@contextmanager
def small_files() -> Iterator[None]:
    """A context in which no file of this process grows beyond 64 KiB, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (64 << 10, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
