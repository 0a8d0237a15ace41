"""`flagdata build` on the command line: the plan before anything is made, and what is refused."""

from __future__ import annotations

import errno
import json
from pathlib import Path
from typing import NoReturn

import pytest

from flagdata.lake import Lake
from sim.datasets import build_jobs, build_plan, casts, load, with_counts
from sim.datasets.build import BuildReport
from sim.datasets.build_plan import Rates
from sim.datasets.shard import Shard
from tests.program import Ended, invoke


def said(*arguments: object) -> Ended:
    return invoke("build", *arguments)


def test_a_plan_states_counts_bytes_and_hours_and_makes_nothing(
    recipe_file: Path, tmp_path: Path
) -> None:
    lake = tmp_path / "lake"
    code, out, _ = said(recipe_file, "--lake", lake, "--plan", "--workers", 2, "--json")
    assert code == 0
    assert not lake.exists()
    plan = json.loads(out)
    assert plan["schema"] == "flagdata.build-plan/1"
    assert plan["sequences"] == {"train": 3, "test": 2}
    assert (
        plan["films"] == plan["clips"] == {"train": 7, "test": 3}
    )  # 30 frames a film are one clip
    assert plan["missing"] == {"sequences": 5, "films": 10}
    rates = plan["rates"]
    work = 5 * rates["sequence_seconds"] + 10 * rates["film_seconds"]
    assert plan["hours"] == pytest.approx(work / 2 / 3600)
    assert plan["bytes"] == pytest.approx(
        5 * rates["sequence_bytes"] + 10 * rates["film_bytes"], abs=1
    )
    # 30 frames of one slot each; the log, the schemas and the parameters take some 45 kB beside
    # them.
    assert 30 * 2048 <= rates["film_bytes"] < 30 * 2048 + 60_000


def test_a_plan_of_other_counts_is_of_a_data_set_that_says_them(
    recipe_file: Path, tmp_path: Path
) -> None:
    counts = "--sequences", 10, "--films", 12
    planned = said(
        recipe_file, *counts, "--lake", tmp_path / "lake", "--plan", "--workers", 1, "--json"
    ).document
    assert planned["recipe"] == "tiny-10x12"
    assert planned["sequences"] == {"train": 6, "test": 4}
    assert planned["films"] == {"train": 8, "test": 4}
    rates = Rates(sequence_seconds=1.0, film_seconds=1.0, sequence_bytes=1.0, film_bytes=1.0)
    recipe = with_counts(load(str(recipe_file)), sequences=10, films=12)
    shards = [
        build_plan.plan(recipe, None, workers=1, rates=rates, shard=Shard(number=number, of=3))
        for number in (1, 2, 3)
    ]
    assert sum(shard.missing_sequences for shard in shards) == 10
    assert sum(shard.missing_films for shard in shards) == 12
    assert all(shard.missing_sequences for shard in shards)


def test_the_planned_size_of_a_sequence_is_near_the_real_one(
    recipe_file: Path, tmp_path: Path
) -> None:
    from flagdata.lake import write_meshes

    _, out, _ = said(recipe_file, "--lake", tmp_path / "lake", "--plan", "--json")
    simulation = next(casts(load(str(recipe_file)))).simulation
    (outcome, _) = build_jobs.simulate(simulation, 0, [0, 1], "cpu").outcomes
    assert outcome.sequence is not None
    write_meshes(tmp_path / "one.zarr", outcome.sequence)
    real = sum(file.stat().st_size for file in (tmp_path / "one.zarr").rglob("*") if file.is_file())
    assert json.loads(out)["rates"]["sequence_bytes"] == pytest.approx(real, rel=0.25)


def test_a_plan_for_people_has_a_line_a_side(recipe_file: Path, tmp_path: Path) -> None:
    code, out, err = said(recipe_file, "--lake", tmp_path / "lake", "--plan", "--workers", 2)
    assert code == 0
    assert [line.split() for line in out.splitlines()] == [
        ["side", "sequences", "films", "clips"],
        ["train", "3", "7", "7"],
        ["test", "2", "3", "3"],
        ["all", "5", "10", "10"],
    ]
    assert "5 sequences and 10 films" in err
    assert "2 workers" in err


@pytest.mark.parametrize(
    ("options", "code", "says"),
    [
        (["flagsin"], 2, "did you mean 'flagsim'"),
        (["flagsim", "--renderer", "rastre"], 2, "did you mean 'raster'"),
        (["flagsim", "--shard", "5/4"], 2, "'5/4' is no shard"),
        (["flagsim", "--sequences", "2"], 2, "2 sequences cannot be on 3 sides"),
        (
            ["flagsim", "--scheduler", "tcp://127.0.0.1:1", "--workers", "2"],
            2,
            "--workers with --scheduler",
        ),
    ],
)
def test_what_cannot_be_built_is_refused(
    tmp_path: Path, options: list[str], code: int, says: str
) -> None:
    found, _, err = said(*options, "--lake", tmp_path / "lake")
    assert found == code
    assert says in err
    assert not (tmp_path / "lake").exists()


def test_a_folder_that_is_no_lake_is_left_alone(recipe_file: Path, tmp_path: Path) -> None:
    (tmp_path / "letter.txt").write_text("dear")
    code, _, err = said(recipe_file, "--lake", tmp_path)
    assert code == 1
    assert "there is no lake here" in err
    assert [entry.name for entry in tmp_path.iterdir()] == ["letter.txt"]


def test_a_data_set_that_is_built_is_reported_although_its_card_cannot_be_written(
    recipe_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    report = BuildReport(
        sequences=6,
        films=15,
        new_sequences=6,
        new_films=15,
        healed=0,
        clips=15,
        failed=(),
        seconds=1.0,
    )

    def refused(*_: object, **__: object) -> NoReturn:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr("sim.datasets.build.Build.run", lambda _: report)
    monkeypatch.setattr("sim.datasets.card.write_card", refused)
    code, out, err = said(recipe_file, "--lake", tmp_path / "lake", "--json")
    assert code == 0
    assert (json.loads(out)["films"], json.loads(out)["card"]) == (15, None)
    assert "the data set tiny is published, but writing its card failed" in err


def test_a_small_build_states_its_length_by_usual_paces_and_a_long_one_by_measured_ones(
    recipe_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe, lake = load(str(recipe_file)), Lake.create(tmp_path / "lake")
    rates = Rates(sequence_seconds=600.0, film_seconds=60.0, sequence_bytes=0.0, film_bytes=0.0)
    measured = []
    monkeypatch.setattr(
        build_plan, "measure", lambda *given, **options: measured.append(given) or rates
    )
    made = "building 5 sequences and 10 films takes"
    assert str(build_plan.length(recipe, lake, workers=2)).startswith(
        f"{made} a minute or two on 2 idle cores"
    )
    assert not measured
    monkeypatch.setattr(build_plan, "_BRIEF", 0.0)
    said = build_plan.length(recipe, lake, workers=2)
    assert str(said).startswith(
        f"{made} about 30 minutes on 2 idle cores"
    )  # (5 · 600 s + 10 · 60 s) / 2
