"""`flagdata ingest` of a table that no recipe describes: its unit, and the anemometers it holds."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from flagdata.lake import Lake
from tests.program import Run, invoke

pytestmark = pytest.mark.usefixtures("confirmed_drafts")
ROWS = [f"2026-05-13T12:00:{k:02d}Z,{4 + k % 7 / 10:.1f},{3 + k % 5 / 10:.1f}" for k in range(30)]


@pytest.fixture
def run(lake: Lake) -> Run:
    return lambda *arguments: invoke("ingest", *arguments, "--lake", lake.path)


def test_each_anemometer_of_a_table_becomes_an_artifact(
    run: Run, lake: Lake, tmp_path: Path
) -> None:
    path = tmp_path / "mast.csv"
    path.write_text("\n".join(["time,Spd80m (m/s),Spd40m (m/s)", *ROWS]) + "\n")
    code, out, err = run(path)
    assert code == 0, err
    assert sorted(row["name"] for row in lake.rows().to_pylist()) == [
        "mast:Spd40m (m/s)",
        "mast:Spd80m (m/s)",
    ]
    code, out, _ = run(path)
    assert code == 0
    assert out.count("already in the lake") == 2


def test_one_anemometer_of_several_keeps_its_label(run: Run, lake: Lake, tmp_path: Path) -> None:
    path = tmp_path / "mast.csv"
    path.write_text("\n".join(["time,Spd80m (m/s),Spd40m (m/s)", *ROWS]) + "\n")
    for wind in ("Spd80m (m/s)", "Spd40m (m/s)"):
        assert run(path, "--wind", wind)[0] == 0
    assert sorted(row["name"] for row in lake.rows().to_pylist()) == [
        "mast:Spd40m (m/s)",
        "mast:Spd80m (m/s)",
    ]


def test_a_unit_that_is_missing_is_asked_for_and_taken(
    run: Run, lake: Lake, tmp_path: Path
) -> None:
    path = tmp_path / "wind.csv"
    path.write_text("\n".join(["time,wind,temp", *ROWS]) + "\n")
    code, _, err = run(path)
    assert code == 3
    assert "--unit" in err
    assert lake.rows().num_rows == 0
    code, _, err = run(path, "--unit", "km/h")
    assert code == 0, err
    code, out, _ = run("--sniff", path, "--unit", "km/h", "--json")
    assert code == 0
    best = json.loads(out)["sources"][0]["guesses"][0]
    assert best["doubts"] == []
    assert 'unit = "km/h"' in best["draft"]


STORM = [f"--expect={key}" for key in ("fast", "strong", "constant")]
"""Answers to the doubts about a column that holds 400 m/s in every row."""


def test_an_anemometer_without_one_usable_value_is_left_out_and_named(
    run: Run, lake: Lake, tmp_path: Path
) -> None:
    path = tmp_path / "mast.csv"
    rows = [row.rpartition(",")[0] + ",400" for row in ROWS]
    path.write_text("\n".join(["time,Spd80m (m/s),Spd40m (m/s)", *rows]) + "\n")
    code, out, err = run(path, *STORM, "--json")
    assert code == 0, err
    results = json.loads(out)["results"]
    assert [result["name"] for result in results] == ["mast:Spd80m (m/s)"]
    left_out = [
        one for one in results[0]["report"]["findings"] if one["kind"] == "anemometer-left-out"
    ]
    assert [one["severity"] for one in left_out] == ["warning"]
    assert "'Spd40m (m/s)'" in left_out[0]["what"]


def test_a_table_none_of_whose_anemometers_measured_is_refused(
    run: Run, lake: Lake, tmp_path: Path
) -> None:
    path = tmp_path / "mast.csv"
    rows = [f"{row.partition(',')[0]},500,600" for row in ROWS]
    path.write_text("\n".join(["time,Spd80m (m/s),Spd40m (m/s)", *rows]) + "\n")
    code, _, err = run(path, *STORM)
    assert code == 1
    assert "nothing to measure" in err
    assert lake.rows().num_rows == 0


def test_the_anemometers_of_a_table_come_in_whole_or_not_at_all(
    run: Run, lake: Lake, tmp_path: Path
) -> None:
    path = tmp_path / "mast.csv"
    rows = [row.rpartition(",")[0] + ",400" for row in ROWS]
    path.write_text("\n".join(["time,Spd80m (m/s),Spd40m (m/s)", *rows]) + "\n")
    assert run(path)[0] == 3  # the second is refused, and nothing of the first is kept
    assert lake.rows().num_rows == 0
    assert run(path, *STORM)[0] == 0
    assert lake.view(None)[0].version == 1  # one commit


def test_ls_shows_the_mean_wind_of_a_log(run: Run, lake: Lake, tmp_path: Path) -> None:
    path = tmp_path / "mast.csv"
    rows = [f"2026-05-13T12:00:{k:02d}Z,{4 + k % 3}" for k in range(30)]
    path.write_text("\n".join(["time,wind speed (m/s)", *rows]) + "\n")
    assert run(path)[0] == 0
    (row,) = invoke("ls", "--lake", lake.path).out.splitlines()[1:]
    assert row.split()[2:5] == ["mast", "2026-05-13T12:00:00Z", "5.00"]
