"""`flagdata declare-cloths`: films of measured cloths become recordings whose clips know the
cloth."""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import flagdata
from flagdata.cli import root
from flagdata.lake import Lake
from flagdata.record import Record
from tests.flagdata.conftest import write_video
from tests.program import Run, invoke


@dataclass(frozen=True, kw_only=True)
class Declared:
    """A table of a film in a wind that nobody knows and one in a steady wind, two fabrics; a lake
    after the command."""

    table: Path
    lake: Lake
    said: dict[str, Any]


@pytest.fixture(scope="module")
def declared(tmp_path_factory: pytest.TempPathFactory) -> Declared:
    folder = tmp_path_factory.mktemp("cloths")
    write_video(folder / "felt.mp4", frames=80, creation_time=None)
    write_video(folder / "silk.mp4", frames=90, creation_time=None)
    table = folder / "cloths.csv"
    table.write_text(
        "film,fabric,area_weight,bending_stiffness,wind_level,wind_speed,wind_sigma\n"
        "felt.mp4,felt,0.24,3e-5,W2,,\nsilk.mp4,silk,0.06,,,2.4,0.3\n"
    )
    lake = Lake.create(folder / "lake")
    done = CliRunner().invoke(
        root, ["declare-cloths", str(table), "--lake", str(lake.path), "--json"]
    )
    assert done.exit_code == 0, done.output
    return Declared(table=table, lake=lake, said=json.loads(done.stdout))


@pytest.fixture
def lake(declared: Declared, tmp_path: Path) -> Lake:
    """A copy of that lake, to be written to."""
    return Lake.open(shutil.copytree(declared.lake.path, tmp_path / "lake"))


@pytest.fixture
def run(lake: Lake) -> Run:
    return lambda *arguments: invoke("declare-cloths", *arguments, "--lake", lake.path)


def clips(lake: Lake) -> dict[str, dict[str, Any]]:
    """The clips by their recordings' names; both films have one."""
    return {row["name"]: row for row in lake.rows("kind = 'clip'").to_pylist()}


def test_clips_know_their_cloth_and_the_wind_where_it_is_stated(declared: Declared) -> None:
    assert [one["parameters"]["area_weight"] for one in declared.said["recordings"]] == [0.24, 0.06]
    felt, silk = clips(declared.lake)["felt"], clips(declared.lake)["silk"]
    assert json.loads(felt["parameters"]) == {
        "fabric": "felt",
        "area_weight": 0.24,
        "bending_stiffness": 3e-5,
        "wind_level": "W2",
    }
    assert felt["wind"] is None
    assert felt["wind_sigma"] is None
    assert "wind-missing" in felt["quality"]
    assert silk["wind"] == pytest.approx(2.4)
    assert silk["wind_sigma"] == pytest.approx(0.3, rel=1e-6)
    assert (felt["session"], silk["session"]) == ("felt", "silk")


def test_pairs_have_the_measured_area_weight_as_simulated_ones_have_theirs(
    declared: Declared,
) -> None:
    pairs = flagdata.open(declared.lake.path).pairs(where="wind > 0")
    assert pairs.table.parameters_of(0) == {"area_weight": 0.06}


def test_the_recording_without_wind_has_the_cameras_frames(declared: Declared) -> None:
    lake = declared.lake
    (camera,) = lake.rows("kind = 'camera' and name = 'felt'").to_pylist()
    (recording,) = lake.rows("kind = 'recording' and name = 'felt'").to_pylist()
    source, copied = (Record.open(lake.object_path(row["object"])) for row in (camera, recording))
    assert recording["parents"] == [camera["artifact"]]
    assert (
        copied.frame_count == source.frame_count == 40
    )  # 80 frames at 50 Hz are 1.6 s, at 25 Hz 40
    np.testing.assert_array_equal(copied.frames(0, 40), source.frames(0, 40))
    np.testing.assert_array_equal(copied.frame_times, source.frame_times)


def test_the_same_table_again_adds_nothing_and_another_area_weight_is_another_recording(
    run: Run, lake: Lake, declared: Declared
) -> None:
    before = lake.rows(columns=["artifact"]).num_rows
    ended = run(declared.table, "--json")
    assert ended.code == 0
    assert [one["created"] for one in ended.document["recordings"]] == [False, False]
    assert lake.rows(columns=["artifact"]).num_rows == before
    other = declared.table.with_name("other.csv")
    other.write_text(declared.table.read_text().replace("0.24", "0.25"))
    assert run(other)[0] == 0
    rows = lake.rows("kind = 'recording' and name = 'felt'", columns=["parameters"]).to_pylist()
    assert sorted(json.loads(row["parameters"])["area_weight"] for row in rows) == [0.24, 0.25]


def test_a_wrong_row_leaves_the_lake_as_it_was(run: Run, lake: Lake, declared: Declared) -> None:
    before = lake.rows(columns=["artifact"]).num_rows
    wrong = declared.table.with_name("wrong.csv")
    wrong.write_text(
        declared.table.read_text().replace("0.24", "0.23") + "gone.mp4,linen,0.2,,,,\n"
    )
    code, _, err = run(wrong)
    assert code == 1
    assert "gone.mp4" in err
    assert lake.rows(columns=["artifact"]).num_rows == before


@pytest.fixture
def table(declared: Declared, tmp_path: Path) -> Path:
    """A copy of the table beside copies of its films, in a lake without any of them."""
    Lake.create(tmp_path / "fresh")
    copied = shutil.copytree(
        declared.table.parent, tmp_path / "cloths", ignore=shutil.ignore_patterns("lake")
    )
    return Path(copied) / "cloths.csv"


def test_an_error_midway_says_what_stays_published_and_a_repeat_makes_the_rest(
    table: Path, tmp_path: Path
) -> None:
    lake, silk = Lake.open(tmp_path / "fresh"), table.with_name("silk.mp4")
    whole = silk.read_bytes()
    silk.write_bytes(whole[:100])
    code, _, err = invoke("declare-cloths", table, "--lake", lake.path)
    assert code == 1
    assert (
        "on branch main: camera 1, clip 1, recording 1; give the same command again for the rest"
        in err
    )
    silk.write_bytes(whole)
    code, _, err = invoke("declare-cloths", table, "--lake", lake.path)
    assert code == 0, err
    assert [row["name"] for row in lake.rows("kind = 'recording'").to_pylist()] == ["felt", "silk"]


def test_an_error_before_anything_is_published_promises_nothing(
    table: Path, tmp_path: Path
) -> None:
    table.with_name("felt.mp4").write_bytes(b"no film")
    code, _, err = invoke("declare-cloths", table, "--lake", tmp_path / "fresh")
    assert code == 1
    assert "Published" not in err
    assert not len(Lake.open(tmp_path / "fresh").rows())
