"""The scene of the verbs of the core, small enough to try every call of each, and what commands
change in it."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import av
import numpy as np

from flagdata.cli import main
from flagdata.ingest import ingest_camera, ingest_wind
from flagdata.lake import Lake
from tests.small import SCENE

CLOTHS = "film,fabric,area_weight,wind_speed,wind_sigma\nthird.mp4,felt,0.3,2.0,0.2\nfourth.mp4,silk,0.1,,\n"


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A folder that commands work on copies of, and ids by name."""

    folder: Path
    ids: dict[str, str] = field(default_factory=dict)


def core_scene(
    folder: Path, *, video: Path, wind_log: Path, write_video: Callable[..., Path]
) -> Scene:
    """A lake with films, a log, a branch, a tag and garbage, the same with damage, and one that is
    ahead of it; beside
    them what commands read: films, logs, markers, meshes, records, of which one is cut off, and
    recipes."""
    lake = Lake.create(folder / "lake")
    camera = ingest_camera(lake, write_video(folder / "first.mp4", frames=30)).artifact
    wind = ingest_wind(lake, wind_log).artifact
    lake.branch("side")
    lake.tag("v0")
    (folder / "second.mp4").write_bytes(video.read_bytes())
    (folder / "second.csv").write_text(wind_log.read_text().replace("+02:00,5.", "+02:00,6."))
    third = ingest_camera(
        lake, write_video(folder / "third.mp4", frames=28), branch="side"
    ).artifact
    write_video(folder / "fourth.mp4", frames=26)
    fifth = ingest_camera(lake, write_video(folder / "fifth.mp4", frames=32)).artifact
    aligned = [
        "align",
        fifth.id,
        wind.id,
        "--by",
        "given",
        "--clock-offset",
        "0",
        "--offset-sigma",
        "0.1",
    ]
    with suppress(SystemExit):
        main([*aligned, "--lake", str(lake.path)])
    (recording,) = lake.rows("kind = 'recording'")["artifact"].to_pylist()
    single = ingest_camera(lake, write_video(folder / "single.mp4", frames=12)).artifact
    spare = ingest_camera(lake, write_video(folder / "spare.mp4", frames=5)).artifact
    lake.withdraw([spare.id], "spare")
    (lake.staging / "left").mkdir()
    (folder / "cut.mcap").write_bytes(lake.object_path(str(third.object)).read_bytes()[:-200])
    (folder / "small.toml").write_text(SCENE)
    (folder / "cloths.csv").write_text(CLOTHS)
    (folder / "meshes").mkdir()
    for frame in range(2):
        corners = [
            "v 0 0 {z}",
            "v 0.5 0 {z}",
            "v 0 0.5 {z}",
            "v 0.5 0.5 {z}",
            "vt 0 0",
            "vt 0.5 0",
            "vt 0 0.5",
            "vt 0.5 0.5",
        ]
        text = "\n".join([*corners, "f 1/1 2/2 3/3", "f 2/2 4/4 3/3", ""]).format(z=0.1 * frame)
        (folder / "meshes" / f"{frame:04d}_00.obj").write_text(text)
    (folder / "markers.csv").write_text(
        "time,marker,u,v,x,y,z\n"
        + "".join(f"{k / 25},m{m},{m},0,{m},{k / 100},0\n" for k in range(30) for m in range(3))
    )
    damage(shutil.copytree(folder / "lake", folder / "hurt"), missing=str(single.object))
    shutil.copytree(folder / "lake", folder / "ahead")
    ahead = Lake.open(folder / "ahead")
    film = ingest_camera(ahead, write_video(folder / "film.mp4", frames=34)).artifact
    (folder / "record.mcap").write_bytes(ahead.object_path(str(film.object)).read_bytes())
    ahead.tag("later")
    ids = {"camera": camera.id, "wind": wind.id, "recording": recording, "single": single.id}
    return Scene(folder=folder, ids=ids)


def damage(lake: Path, *, missing: str) -> None:
    """Take an object, the end of a log entry and the folder of refs from a lake."""
    Lake.open(lake).object_path(missing).unlink()
    *_, entry, _ = sorted((lake / "catalog" / "_delta_log").glob("*.json"))
    entry.write_bytes(entry.read_bytes()[:-40])
    shutil.rmtree(lake / "refs")


def core(folder: Path) -> Scene:
    """The same of films and a log that are made for it."""

    def write_video(path: Path, *, frames: int = 40) -> Path:
        row, column = np.mgrid[0:48, 0:64]
        with av.open(str(path), "w") as container:
            container.metadata["creation_time"] = "2026-05-01T10:00:00Z"
            stream = container.add_stream("libx264", rate=50, options={"threads": "1"})
            stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
            for k in range(frames):
                bar = np.abs(column - 32 - 12 * np.sin(row / 9 + 0.25 * k)) < 4
                image = (40 + row + 150 * bar).astype(np.uint8)
                container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="gray")))
            container.mux(stream.encode(None))
        return path

    log = folder / "mast.csv"
    lines = [
        f"2026-05-01T12:{k // 60:02d}:{k % 60:02d}+02:00,5.{k % 10},{200 + k % 9}"
        for k in range(120)
    ]
    log.write_text("\n".join(["time,wind_speed (m/s),wind_direction (deg)", *lines, ""]))
    return core_scene(
        folder, video=write_video(folder / "video.mp4"), wind_log=log, write_video=write_video
    )


def rows(folder: Path) -> frozenset[object]:
    """Every artifact of the lake with its object, by branch."""
    lake = Lake.open(folder / "lake")
    columns = ["artifact", "kind", "name", "branch", "object"]
    return frozenset(tuple(row.values()) for row in lake.rows(columns=columns).to_pylist())


def artifacts(folder: Path) -> frozenset[object]:
    """Every artifact of the lake, of commands whose objects note how long something took."""
    return frozenset(Lake.open(folder / "lake").rows(columns=["artifact"])["artifact"].to_pylist())


def files(*places: str) -> Callable[[Path], frozenset[object]]:
    """What is at these places of the folder and under them: folders, and files with their hashes;
    no scratch files."""

    def found(folder: Path) -> frozenset[object]:
        every = [
            entry for place in places for entry in ((folder / place), *(folder / place).rglob("*"))
        ]
        return frozenset(
            (
                str(path.relative_to(folder)),
                path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest(),
            )
            for path in every
            if path.exists() and not path.name.startswith(".")
        )

    return found
