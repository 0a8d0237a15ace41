"""A long video takes no more memory than a short one."""

from __future__ import annotations

import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np

from tests.flagdata.ingest.camera.conftest import write_video

SCRIPT = """
import resource, sys
from flagdata.ingest.camera import CameraOptions, open_camera
with open_camera(sys.argv[1], CameraOptions(start=0)) as stream:
    count = sum(1 for _ in stream)
print(count, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def test_memory_does_not_grow_with_the_length(tmp_path: Path) -> None:
    noise = np.random.default_rng(2).integers(0, 256, (480, 640), dtype=np.uint8)

    def peak(frames: int) -> tuple[int, int]:
        path = write_video(
            tmp_path / f"{frames}.mp4",
            range(frames),
            tick=Fraction(1, 50),
            rate=50,
            picture=lambda _: noise,
            encoder={"preset": "ultrafast", "crf": "30", "bf": "0"},
        )
        result = subprocess.run(
            [sys.executable, "-c", SCRIPT, str(path)],
            capture_output=True,
            text=True,
            check=True,
            timeout=500,
        )
        count, kilobytes = result.stdout.split()
        return int(count), int(kilobytes)

    short, long = peak(60), peak(660)
    assert (short[0], long[0]) == (30, 330)
    # 600 more frames of 640 × 480 would be 184 MB decoded, 27 MB as output squares; stamps and an
    # index are 0.1 MB.
    assert long[1] - short[1] < 15_000
