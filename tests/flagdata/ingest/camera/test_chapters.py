"""Later chapters of one recording begin where the earlier ones end."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.core.files.regular_files import MCAP
from flagdata.core.findings import Severity
from flagdata.errors import InputError, UsageError
from flagdata.ingest import CameraIngest, CameraOptions, ingest_camera, open_camera, probe
from flagdata.ingest.camera.joined import in_order
from flagdata.lake import Lake
from flagdata.timebase import parse
from tests.flagdata.ingest.camera.conftest import write_video

CREATED = "2026-05-01T10:00:00.000000Z"
TEN = parse(CREATED)
SECOND = 1_000_000_000


@pytest.fixture
def film(tmp_path: Path) -> Callable[..., Path]:
    """Writes a film at 25 Hz of some frames and creation time under a name."""

    def write(name: str, frames: int, created: str = CREATED) -> Path:
        return write_video(
            tmp_path / name,
            range(frames),
            tick=Fraction(1, 25),
            container="mp4",
            metadata={"creation_time": created},
        )

    return write


def started(path: Path, options: CameraOptions | None = None) -> tuple[float, dict[str, Severity]]:
    """Seconds from the creation time to the start of a file, and its findings about chapters."""
    with open_camera(path, options or CameraOptions(size=96)) as stream:
        found = {f.kind: f.severity for f in stream.findings if f.kind.startswith("chapter")}
        return (stream.info.start - TEN) / SECOND, found


# 10 and 20 frames at 25 Hz are 0.4 and 0.8 s.
@pytest.mark.parametrize(
    "names",
    [
        ("GH010042.MP4", "GH020042.MP4", "GH030042.MP4"),
        ("GX010042.mp4", "GX020042.mp4", "GX030042.mp4"),
        ("GOPR0042.MP4", "GP010042.MP4", "GP020042.MP4"),
    ],
)
def test_each_chapter_begins_where_the_earlier_ones_end(
    names: tuple[str, ...], film: Callable[..., Path]
) -> None:
    first, second, third = (
        film(name, frames) for name, frames in zip(names, (10, 20, 5), strict=True)
    )
    assert started(first) == (0.0, {})
    assert started(second) == (pytest.approx(0.4), {"chapter-placed": Severity.NOTE})
    assert started(third) == (pytest.approx(1.2), {"chapter-placed": Severity.NOTE})
    looked = probe(third).start
    assert looked is not None
    assert looked.instant - TEN == 1_200_000_000
    # Uniform from the start of the recording to the end of the chapter, 1.36 s, and over a second.
    assert looked.sigma == pytest.approx(((1 + 1.36**2) / 12) ** 0.5, rel=0.01)
    # At twice the rate that the container states, all chapters are half as long.
    assert started(third, CameraOptions(size=96, true_fps=50.0))[0] == pytest.approx(0.6)


def test_a_chapter_whose_earlier_ones_are_not_there_is_reported_and_not_moved(
    film: Callable[..., Path],
) -> None:
    film("GH010042.MP4", 10)
    assert started(film("GH030042.MP4", 5)) == (0.0, {"chapter-not-placed": Severity.WARNING})
    film("GH020042.MP4", 1).write_bytes(b"no film")
    assert started(film("GH030042.MP4", 5)) == (0.0, {"chapter-not-placed": Severity.WARNING})


def test_a_file_with_a_time_of_its_own_is_not_moved(film: Callable[..., Path]) -> None:
    film("GH010042.MP4", 10, "2026-05-01T09:59:00.000000Z")
    second = film("GH020042.MP4", 5)
    assert started(second) == (0.0, {})
    given = CameraOptions(size=96, start=TEN + 7 * SECOND)
    assert started(film("GH020042.MP4", 5, "2026-05-01T09:59:00.000000Z"), given) == (7.0, {})


def test_successive_numbers_of_one_creation_time_are_reported_and_none_is_moved(
    film: Callable[..., Path],
) -> None:
    assert started(film("DJI_0009.MP4", 10)) == (0.0, {})
    assert started(film("DJI_0010.MP4", 10)) == (0.0, {"chapter-not-placed": Severity.WARNING})
    # Cameras that record side by side.
    film("left1.mp4", 10)
    assert started(film("left2.mp4", 10)) == (0.0, {})


def test_a_chapter_is_another_artifact_once_the_earlier_one_is_there(
    tmp_path: Path, film: Callable[..., Path]
) -> None:
    lake = Lake.create(tmp_path / "lake")
    options = CameraIngest(camera=CameraOptions(size=96))
    second = film("GH020042.MP4", 5)
    alone = ingest_camera(lake, second, options)
    film("GH010042.MP4", 10)
    beside = ingest_camera(lake, second, options)
    assert (alone.artifact.start, beside.artifact.start) == (TEN, TEN + 400_000_000)
    assert "chapter-not-placed" in alone.artifact.quality
    assert "chapter-not-placed" not in beside.artifact.quality
    before = next(f for f in beside.report["findings"] if f["kind"] == "ingested-before")
    assert alone.artifact.id[:12] in before["what"]
    assert not ingest_camera(lake, second, options).created


def joined(*paths: Path, true_fps: float | None = None) -> tuple[list[int], dict[str, Severity]]:
    """Instants of the frames of chapters since the creation time [ns], and the findings about
    chapters."""
    first, *later = in_order(paths)
    with open_camera(
        first, CameraOptions(size=96, rate="native", chapters=tuple(later), true_fps=true_fps)
    ) as stream:
        times = [frame.time - TEN for frame in stream]
        return times, {f.kind: f.severity for f in stream.findings if f.kind.startswith("chapter")}


def test_chapters_are_joined_frame_after_frame_whatever_their_order(
    film: Callable[..., Path],
) -> None:
    third, first, second = (
        film(f"{n}0042.MP4", k) for n, k in (("GP02", 5), ("GOPR", 10), ("GP01", 20))
    )
    times, found = joined(third, first, second)
    assert times == [k * 40_000_000 for k in range(35)]
    assert found == {"chapters-joined": Severity.NOTE}
    # At twice the rate that the containers state.
    assert joined(first, second, true_fps=50.0)[0] == [k * 20_000_000 for k in range(30)]


def test_files_that_state_their_own_time_are_joined_where_one_begins_as_the_other_ends(
    film: Callable[..., Path],
) -> None:
    first = film("DJI_0009.MP4", 100)
    second = film("DJI_0010.MP4", 25, "2026-05-01T10:00:04.000000Z")
    assert joined(second, first)[0] == [k * 40_000_000 for k in range(125)]
    later = film("DJI_0011.MP4", 25, "2026-05-01T10:00:15.000000Z")
    with pytest.raises(UsageError, match=r"begins 10\.0 s after the end of DJI_0010"):
        joined(first, second, later)


def test_what_is_not_one_recording_is_not_joined(film: Callable[..., Path], tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="not successive chapters"):
        joined(film("GH010042.MP4", 10), film("GH030042.MP4", 10))
    with pytest.raises(UsageError, match="not successive chapters"):
        joined(film("GH010042.MP4", 10), film("GH020043.MP4", 10))
    with pytest.raises(UsageError, match="a single file cannot be joined"):
        joined(tmp_path / "GH010042.MP4")
    with pytest.raises(UsageError, match="named twice"):
        joined(tmp_path / "GH010042.MP4", tmp_path / "GH010042.MP4")


def test_joined_chapters_are_one_artifact_of_all_their_bytes(
    tmp_path: Path, film: Callable[..., Path]
) -> None:
    lake = Lake.create(tmp_path / "lake")
    first, second = film("GH010042.MP4", 10), film("GH020042.MP4", 15)
    options = CameraIngest(camera=CameraOptions(size=96, chapters=(second,)))
    made = ingest_camera(lake, first, options)
    assert (made.artifact.frame_count, made.artifact.start) == (25, TEN)
    assert made.artifact.end is not None
    assert made.artifact.end - TEN == 24 * 40_000_000
    assert not ingest_camera(lake, first, options).created
    film("GH020042.MP4", 16)
    assert ingest_camera(lake, first, options).artifact.frame_count == 26


def test_only_video_files_are_joined_whichever_comes_first(
    tmp_path: Path, film: Callable[..., Path]
) -> None:
    lake = Lake.create(tmp_path / "lake")
    bag, folder = tmp_path / "a_1.mcap", tmp_path / "a_2"
    bag.write_bytes(MCAP)
    folder.mkdir()
    video, log = film("a_3.mp4", 10), tmp_path / "a_4.csv"
    log.write_text("time,wind_speed (m/s)\n2026-05-01T10:00:00Z,3.0\n")
    for others in ((bag,), (folder,), (log,)):
        for first, *later in ((video, *others), (*others, video)):
            camera = CameraOptions(size=96, chapters=tuple(later), start=TEN)
            with pytest.raises((UsageError, InputError)) as refused:
                open_camera(first, camera)
            assert str(others[0]) in str(refused.value.where)
            with pytest.raises((UsageError, InputError)):
                ingest_camera(lake, first, CameraIngest(camera=camera))
        if others != (log,):
            with pytest.raises(UsageError, match="cannot be joined") as refused:
                in_order((video, *others))
            assert refused.value.where == str(others[0])
    assert not lake.rows().num_rows


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"rate": 50, "tick": Fraction(1, 50)}, "frame rate differs"),
        ({"pixel_format": "yuv444p"}, "pixel format differs"),
        ({"aspect": Fraction(4, 3)}, "shape of a pixel differs"),
        ({"codec": "mpeg4"}, "coding differs"),
        ({"rotation": 90}, "orientation differs"),
        (
            {"picture": lambda number: np.full((48, 64), number, np.uint8)},
            "size of the pictures differs",
        ),
    ],
)
def test_chapters_of_other_kinds_are_not_joined_and_the_difference_is_named(
    change: dict[str, Any], what: str, tmp_path: Path
) -> None:
    plain: dict[str, Any] = {"tick": Fraction(1, 25), "container": "mp4"}
    first = write_video(tmp_path / "a.mp4", range(10), **plain)
    second = write_video(tmp_path / "b.mp4", range(10), **{**plain, **change})
    with pytest.raises(UsageError, match=what) as refused:
        open_camera(first, CameraOptions(size=96, start=TEN, chapters=(second,)))
    assert refused.value.where == str(second)
    # The fix works: it is read by itself.
    with open_camera(second, CameraOptions(size=96, start=TEN, rate="native")) as stream:
        assert len(list(stream)) == 10


def test_a_file_and_its_copy_are_not_joined(tmp_path: Path, film: Callable[..., Path]) -> None:
    first, copy = film("a.mp4", 10), tmp_path / "b.mp4"
    shutil.copy(first, copy)
    camera = CameraOptions(size=96, start=TEN, chapters=(copy,))
    with pytest.raises(InputError, match=r"its bytes are those of a\.mp4"):
        ingest_camera(Lake.create(tmp_path / "lake"), first, CameraIngest(camera=camera))
