"""A camera file read whole, and the grid its frames lie on."""

from __future__ import annotations

from pathlib import Path

from flagdata.core.findings import Finding
from flagdata.ingest import CameraOptions, open_camera
from flagdata.record.signals import CameraInfo, Frame

MS = 1_000_000


def read(path: Path, options: CameraOptions) -> tuple[CameraInfo, list[Frame], dict[str, Finding]]:
    """Properties of a file, its frames, and its findings by kind."""
    with open_camera(path, options) as stream:
        frames = list(stream)
        return stream.info, frames, {f.kind: f for f in stream.findings}


def grid_of(frames: list[Frame], start: int) -> list[int]:
    """Grid index of each frame at 25 Hz, refusing times off the grid."""
    assert all((f.time - start) % (40 * MS) == 0 for f in frames)
    return [(f.time - start) // (40 * MS) for f in frames]
