"""`flagdata ingest` of a table that no recipe describes: its unit, and the anemometers it holds."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.cli import main
from flagdata.lake import Lake

Run = Callable[..., tuple[int, str, str]]
ROWS = [f"2026-05-13T12:00:{k:02d}Z,{4 + k % 7 / 10:.1f},{3 + k % 5 / 10:.1f}" for k in range(30)]


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    return Lake.create(tmp_path / "lake")


@pytest.fixture
def run(lake: Lake, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs `flagdata ingest` on the lake: exit code, stdout, stderr."""

    def run(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as exit_:
            main(["ingest", *map(str, arguments), "--lake", str(lake.path)])
        printed = capsys.readouterr()
        return int(exit_.value.code or 0), printed.out, printed.err

    return run


def test_each_anemometer_of_a_table_becomes_an_artifact(run: Run, lake: Lake, tmp_path: Path) -> None:
    path = tmp_path / "mast.csv"
    path.write_text("\n".join(["time,Spd80m (m/s),Spd40m (m/s)", *ROWS]) + "\n")
    code, out, err = run(path)
    assert code == 0, err
    assert sorted(row["name"] for row in lake.rows().to_pylist()) == ["mast:Spd40m (m/s)", "mast:Spd80m (m/s)"]
    code, out, _ = run(path)
    assert code == 0
    assert out.count("already in the lake") == 2


def test_a_unit_that_is_missing_is_asked_for_and_taken(run: Run, lake: Lake, tmp_path: Path) -> None:
    path = tmp_path / "wind.csv"
    path.write_text("\n".join(["time,wind,temp", *ROWS]) + "\n")
    code, _, err = run(path)
    assert code == 1
    assert "--unit" in err
    assert lake.rows().num_rows == 0
    code, _, err = run(path, "--unit", "km/h")
    assert code == 0, err
    code, out, _ = run("--sniff", path, "--unit", "km/h", "--json")
    assert code == 0
    best = json.loads(out)["sources"][0]["guesses"][0]
    assert best["doubts"] == []
    assert 'unit = "km/h"' in best["draft"]
