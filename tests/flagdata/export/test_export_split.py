"""Exports of the sides of a split: nothing leaks, nothing is lost, and pairs and exports agree."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from flagdata.core.schema import Kind
from flagdata.dataset import HashedSplit
from flagdata.dataset.sides import clips_of, divide
from flagdata.errors import NotFoundError, UnknownNameError, UsageError
from flagdata.export import Export, export
from flagdata.lake import Artifact, Lake

DAY = 86_400_000_000_000
MAY = 1_777_593_600_000_000_000  # 2026-05-01T00:00:00Z
SIDES = ("train", "validation", "test")


@pytest.fixture(scope="module")
def lake(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """Twenty days with two recordings each, of two sessions; a session of its own spans days 3 and
    4."""
    made = Lake.create(tmp_path_factory.mktemp("split") / "lake")
    with made.transaction("forty recordings") as tx:
        for number in range(40):
            day = number // 2
            session = "storm" if day in (3, 4) else f"session {number}"
            values = {"session": session, "day": f"2026-05-{day + 1:02d}"}
            recording = Artifact(
                kind=Kind.RECORDING,
                name=f"recording {number}",
                source_hash=f"{number:064x}",
                **values,
            )
            tx.add(recording)
            for first in (0, 30):
                start = MAY + day * DAY + first
                tx.add(
                    Artifact(
                        kind=Kind.CLIP,
                        name=f"clip {number}-{first}",
                        parents=(recording.id,),
                        recording=recording.id,
                        frame_first=first,
                        frame_count=30,
                        start=start,
                        end=start + 29,
                        wind=5.0,
                        **values,
                    )
                )
    return made


def read(
    lake: Lake, folder: Path, side: str, *, where: str = "kind = 'clip'", salt: str = ""
) -> pl.DataFrame:
    export(lake, Export(format="parquet", where=where, split=side, salt=salt), folder)
    return pl.read_parquet(folder / "rows" / "*.parquet")


def test_sides_share_no_recording_session_or_day_and_lose_no_clip(
    lake: Lake, tmp_path: Path
) -> None:
    sides = {side: read(lake, tmp_path / side, side) for side in SIDES}
    for column in ("artifact", "recording", "session", "day"):
        held = [set(table[column]) for table in sides.values()]
        assert sum(map(len, held)) == len(set.union(*held)), column
    assert sum(table.height for table in sides.values()) == 80


def test_two_days_of_one_session_stay_together(lake: Lake, tmp_path: Path) -> None:
    storm = [side for side in SIDES if "storm" in set(read(lake, tmp_path / side, side)["session"])]
    assert len(storm) == 1
    assert (
        read(lake, tmp_path / "again", storm[0], where="kind = 'clip' and session = 'storm'").height
        == 8
    )


def test_recordings_go_where_their_clips_go(lake: Lake, tmp_path: Path) -> None:
    for side in SIDES:
        clips = read(lake, tmp_path / f"{side}-clips", side)
        recordings = read(lake, tmp_path / f"{side}-recordings", side, where="kind = 'recording'")
        assert set(recordings["artifact"]) == set(clips["recording"])


def test_a_narrower_filter_moves_no_clip_to_another_side(lake: Lake, tmp_path: Path) -> None:
    whole = set(read(lake, tmp_path / "whole", "train")["artifact"])
    half = set(
        read(lake, tmp_path / "half", "train", where="kind = 'clip' and day < '2026-05-11'")[
            "artifact"
        ]
    )
    assert half < whole


def test_another_salt_is_another_split(lake: Lake, tmp_path: Path) -> None:
    first = set(read(lake, tmp_path / "a", "train")["artifact"])
    second = set(read(lake, tmp_path / "b", "train", salt="second")["artifact"])
    assert first != second


def test_a_split_of_rows_that_are_on_no_side_is_refused(tmp_path: Path) -> None:
    other = Lake.create(tmp_path / "lake")
    with other.transaction("a model") as tx:
        tx.add(Artifact(kind=Kind.MODEL, name="regressor"))
    with pytest.raises(UsageError, match="a split cannot hold 1 of kind model"):
        export(other, Export(format="parquet", split="train"), tmp_path / "out")


def test_an_unknown_side_is_answered_with_the_nearest(lake: Lake, tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'train'"):
        export(
            lake, Export(format="parquet", where="kind = 'clip'", split="trian"), tmp_path / "out"
        )


def test_an_empty_side_is_an_error_that_names_it(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    with lake.transaction("one recording") as tx:
        recording = Artifact(
            kind=Kind.RECORDING, name="only", source_hash="0" * 64, day="2026-05-01"
        )
        tx.add(recording)
        only = Artifact(
            kind=Kind.CLIP,
            name="only",
            parents=(recording.id,),
            recording=recording.id,
            day="2026-05-01",
        )
        tx.add(only)
    catalog = lake.table(lake.view(None))
    filled = [
        side
        for side, on in divide(
            catalog, clips_of(catalog, None), hashed=HashedSplit()
        ).artifacts.items()
        if on
    ]
    assert len(filled) == 1
    for side in set(SIDES) - set(filled):
        with pytest.raises(NotFoundError, match=side):
            export(
                lake, Export(format="parquet", where="kind = 'clip'", split=side), tmp_path / "out"
            )


def test_of_two_alignments_of_one_camera_and_wind_log_the_later_is_exported(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    aligned: list[Artifact] = []
    for offset in (0.0, 1.5):
        with lake.transaction(f"aligned with {offset} s") as tx:
            camera = Artifact(kind=Kind.CAMERA, name="camera", source_hash="c" * 64)
            wind = Artifact(kind=Kind.WIND, name="wind", source_hash="d" * 64)
            tx.add(camera)
            tx.add(wind)
            recording = Artifact(
                kind=Kind.RECORDING,
                name="pier",
                parents=(camera.id, wind.id),
                recipe={"offset": offset},
            )
            clip = Artifact(
                kind=Kind.CLIP, name="pier 0", parents=(recording.id,), recording=recording.id
            )
            tx.add(recording)
            tx.add(clip)
            aligned.append(clip)
    both = export(lake, Export(format="parquet", where="kind = 'clip'"), tmp_path / "both")
    assert pl.read_parquet(tmp_path / "both" / "rows" / "*.parquet")["artifact"].to_list() == [
        aligned[1].id
    ]
    assert both.manifest["superseded"] == {aligned[0].recording: aligned[1].recording}
    named = Export(
        format="parquet", where=f"kind = 'clip' and recording = '{aligned[0].recording}'"
    )
    export(lake, named, tmp_path / "old")
    assert pl.read_parquet(tmp_path / "old" / "rows" / "*.parquet")["artifact"].to_list() == [
        aligned[0].id
    ]


def test_a_side_that_a_filter_chose_stands_in_the_manifest(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    with lake.transaction("two films") as tx:
        for number, side in enumerate(("train", "test")):
            film = Artifact(
                kind=Kind.RECORDING, name=f"film {number}", seed=number, dataset="made", side=side
            )
            clip = Artifact(
                kind=Kind.CLIP,
                name=f"clip {number}",
                parents=(film.id,),
                recording=film.id,
                dataset="made",
                side=side,
            )
            tx.add(film)
            tx.add(clip)
    for where, side in {
        "kind = 'clip' and side = 'train'": "train",
        "kind = 'clip' and side = 'test'": "test",
        "kind = 'clip'": None,
    }.items():
        manifest = export(
            lake, Export(format="parquet", where=where), tmp_path / str(side)
        ).manifest
        assert manifest["split"] == side
        assert manifest["split_by"]["rule"] == "stated"
