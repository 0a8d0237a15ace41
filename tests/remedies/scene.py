"""A folder with films, logs and meshes, and with a lake of some of them, a branch, a tag and what a
crash leaves."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np

from flagdata.ingest import ingest_camera, ingest_wind
from flagdata.lake import Lake


def write_film(
    path: Path,
    *,
    frames: int = 40,
    begin: str = "2026-05-01T10:00:00Z",
    size: tuple[int, int] = (48, 64),
) -> Path:
    """Write a bright bar that sways, at 50 Hz, in a file that states when it began."""
    row, column = np.mgrid[0 : size[0], 0 : size[1]]
    with av.open(str(path), "w") as container:
        container.metadata["creation_time"] = begin
        stream = container.add_stream("libx264", rate=50, options={"threads": "1"})
        (stream.height, stream.width), stream.pix_fmt = size, "yuv420p"
        for k in range(frames):
            bar = np.abs(column - 32 - 12 * np.sin(row / 9 + 0.25 * k)) < 4
            image = (40 + row + 150 * bar).astype(np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="gray")))
        container.mux(stream.encode(None))
    return path


def write_log(path: Path, *, speed: int) -> Path:
    """Write two minutes of wind at 1 Hz, whose stamps name their zone."""
    head = "time,wind_speed (m/s),wind_direction (deg)"
    rows = [
        f"2026-05-01T12:{k // 60:02d}:{k % 60:02d}+02:00,{speed}.{k % 10},{200 + k % 9}"
        for k in range(120)
    ]
    path.write_text("\n".join([head, *rows, ""]))
    return path


def write_meshes(folder: Path) -> None:
    """Write two frames of a square cloth as OBJ."""
    folder.mkdir()
    flat = ["vt 0 0", "vt 0.5 0", "vt 0 0.5", "vt 0.5 0.5", "f 1/1 2/2 3/3", "f 2/2 4/4 3/3", ""]
    for frame in range(2):
        corners = [f"v {x} {y} {0.1 * frame}" for y in (0, 0.5) for x in (0, 0.5)]
        (folder / f"{frame:04d}_00.obj").write_text("\n".join([*corners, *flat]))


def make_scene(folder: Path) -> Path:
    """Make it in an empty folder.

    The lake has the film `first` and the log `mast` on main, the film `third` on the branch side,
    the tag v0, a film that was withdrawn, and an abandoned folder in staging; `cut.mcap` is a
    record that was cut off.
    """
    (folder / "frames.csv").write_text(
        "frame,marker,u,v,x,y,z\n0,a,0,0,0,0,0\n0,b,1,0,1,0,0\n1,a,0,0,0,0,0\n1,b,1,0,1,0,0\n"
    )
    lake = Lake.create(folder / "lake")
    ingest_camera(lake, write_film(folder / "first.mp4", frames=30))
    ingest_wind(lake, write_log(folder / "mast.csv", speed=5))
    lake.branch("side")
    lake.tag("v0")
    third = ingest_camera(lake, write_film(folder / "third.mp4", frames=28), branch="side").artifact
    spare = ingest_camera(lake, write_film(folder / "spare.mp4", frames=5)).artifact
    lake.withdraw([spare.id], "spare")
    (lake.staging / "left").mkdir()
    (folder / "cut.mcap").write_bytes(lake.object_path(str(third.object)).read_bytes()[:-200])
    write_film(folder / "second.mp4")
    write_log(folder / "second.csv", speed=6)
    write_meshes(folder / "meshes")
    return folder
