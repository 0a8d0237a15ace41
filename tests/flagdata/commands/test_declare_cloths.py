"""`flagdata declare-cloths`: films of measured cloths become recordings whose clips know the cloth."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flagdata
from flagdata.cli import main
from flagdata.lake import Lake
from flagdata.record import Record

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    return Lake.create(tmp_path / "lake")


@pytest.fixture
def table(tmp_path: Path, write_video: Callable[..., Path]) -> Path:
    """A film in a wind that nobody knows and one in a steady wind, two fabrics."""
    write_video(tmp_path / "felt.mp4", frames=80, creation_time=None)
    write_video(tmp_path / "silk.mp4", frames=90, creation_time=None)
    path = tmp_path / "cloths.csv"
    path.write_text(
        "film,fabric,area_weight,bending_stiffness,wind_level,wind_speed,wind_sigma\n"
        "felt.mp4,felt,0.24,3e-5,W2,,\nsilk.mp4,silk,0.06,,,2.4,0.3\n"
    )
    return path


@pytest.fixture
def run(lake: Lake, capsys: pytest.CaptureFixture[str]) -> Run:
    def run(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as exit_:
            main(["declare-cloths", *map(str, arguments), "--lake", str(lake.path)])
        printed = capsys.readouterr()
        return int(exit_.value.code or 0), printed.out, printed.err

    return run


def clips(lake: Lake) -> dict[str, dict[str, Any]]:
    """The clips by their recordings' names; both films have one."""
    return {row["name"]: row for row in lake.rows("kind = 'clip'").to_pylist()}


def test_clips_know_their_cloth_and_the_wind_where_it_is_stated(run: Run, lake: Lake, table: Path) -> None:
    code, out, err = run(table, "--json")
    assert code == 0, err
    assert [one["parameters"]["density"] for one in json.loads(out)["recordings"]] == [0.24, 0.06]
    felt, silk = clips(lake)["felt"], clips(lake)["silk"]
    assert json.loads(felt["parameters"]) == {
        "fabric": "felt", "density": 0.24, "bending_stiffness": 3e-5, "wind_level": "W2",
    }  # fmt: skip
    assert felt["wind"] is None
    assert felt["wind_sigma"] is None
    assert "wind-missing" in felt["quality"]
    assert silk["wind"] == pytest.approx(2.4)
    assert silk["wind_sigma"] == pytest.approx(0.3, rel=1e-6)
    assert (felt["session"], silk["session"]) == ("felt", "silk")


def test_pairs_have_the_measured_area_weight_as_simulated_ones_have_theirs(run: Run, lake: Lake, table: Path) -> None:
    assert run(table)[0] == 0
    pairs = flagdata.open(lake.path).pairs(where="wind > 0")
    assert pairs.table.parameters_of(0) == {"density": 0.06}


def test_the_recording_without_wind_has_the_cameras_frames(run: Run, lake: Lake, table: Path) -> None:
    assert run(table)[0] == 0
    (camera,) = lake.rows("kind = 'camera' and name = 'felt'").to_pylist()
    (recording,) = lake.rows("kind = 'recording' and name = 'felt'").to_pylist()
    source, copied = (Record.open(lake.object_path(row["object"])) for row in (camera, recording))
    assert recording["parents"] == [camera["artifact"]]
    assert copied.frame_count == source.frame_count == 40  # 80 frames at 50 Hz are 1.6 s, at 25 Hz 40
    np.testing.assert_array_equal(copied.frames(0, 40), source.frames(0, 40))
    np.testing.assert_array_equal(copied.frame_times, source.frame_times)


def test_the_same_table_again_adds_nothing(run: Run, lake: Lake, table: Path) -> None:
    assert run(table)[0] == 0
    before = lake.rows(columns=["artifact"]).num_rows
    code, out, _ = run(table, "--json")
    assert code == 0
    assert [one["created"] for one in json.loads(out)["recordings"]] == [False, False]
    assert lake.rows(columns=["artifact"]).num_rows == before


def test_another_area_weight_of_the_same_film_is_another_recording(run: Run, lake: Lake, table: Path) -> None:
    assert run(table)[0] == 0
    table.write_text(table.read_text().replace("0.24", "0.25"))
    assert run(table)[0] == 0
    rows = lake.rows("kind = 'recording' and name = 'felt'", columns=["parameters"]).to_pylist()
    assert sorted(json.loads(row["parameters"])["density"] for row in rows) == [0.24, 0.25]


def test_a_wrong_row_leaves_the_lake_as_it_was(run: Run, lake: Lake, table: Path) -> None:
    table.write_text(table.read_text() + "gone.mp4,linen,0.2,,,,\n")
    code, _, err = run(table)
    assert code == 1
    assert "gone.mp4" in err
    assert lake.rows(columns=["artifact"]).num_rows == 0


def test_an_error_midway_says_what_stays_published_and_a_repeat_makes_the_rest(
    run: Run, lake: Lake, table: Path
) -> None:
    silk = table.with_name("silk.mp4")
    whole = silk.read_bytes()
    silk.write_bytes(whole[:100])
    code, _, err = run(table)
    assert code == 1
    assert "on branch main: camera 1, clip 1, recording 1; give the same command again for the rest" in err
    silk.write_bytes(whole)
    code, _, err = run(table)
    assert code == 0, err
    assert [row["name"] for row in lake.rows("kind = 'recording'").to_pylist()] == ["felt", "silk"]


def test_an_error_before_anything_is_published_promises_nothing(run: Run, lake: Lake, table: Path) -> None:
    table.with_name("felt.mp4").write_bytes(b"no film")
    code, _, err = run(table)
    assert code == 1
    assert "Published" not in err
    assert not len(lake.rows())
