"""Members in a lake: each once, whatever was interrupted; parameters, seeds and energies beside the
meshes."""

from __future__ import annotations

import json
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import UsageError
from flagdata.lake import Lake, MeshSequence, read_meshes
from sim.run import Crew, load, parse, simulate
from tests import pausing
from tests.sim.run.conftest import make_recipe, small

WORKER = Path(__file__).with_name("simulate_worker.py")


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    return Lake.create(tmp_path / "lake")


def objects(lake: Lake) -> dict[int, str]:
    """Seed → object of all members."""
    rows = lake.rows("kind = 'meshes'", columns=["seed", "object"]).to_pylist()
    assert len({row["seed"] for row in rows}) == len(rows)
    return {row["seed"]: row["object"] for row in rows}


def test_members_are_published_with_what_they_were_made_of(lake: Lake) -> None:
    recipe = make_recipe()
    report = simulate(lake, recipe)
    assert (len(report.added), report.existing, report.failed) == (6, (), ())
    crew = Crew(recipe)
    for row in lake.rows().to_pylist():
        report_of = json.loads(row["report"])
        member = crew.member(report_of["index"])
        assert row["seed"] == member.seed
        assert (row["kind"], row["frame_count"], row["rate"]) == ("meshes", 4, 25.0)
        assert row["wind"] == pytest.approx(member.parameters["wind_speed"])
        parameters = json.loads(row["parameters"])
        assert parameters["area_weight"] == member.parameters["area_weight"]
        assert len(parameters["bending"]) == 15
        assert set(report_of["mean_energies"]) >= {"kinetic", "stretching", "bending", "gravity"}
        sequence = read_meshes(lake.object_path(row["object"]))
        assert isinstance(sequence, MeshSequence)
        assert sequence.positions.shape == (4, 35, 3)
        np.testing.assert_array_equal(sequence.faces, crew.mesh.faces)
        assert len(sequence.attributes["energies"]["kinetic"]) == 4
        assert sequence.attributes["parameters"] == parameters


def test_running_again_makes_nothing_and_more_members_only_the_new_ones(lake: Lake) -> None:
    recipe = make_recipe()
    first = simulate(lake, replace(recipe, count=3))
    again = simulate(lake, replace(recipe, count=3, batch=2, name="other", title="other"))
    assert (again.added, set(again.existing)) == ((), set(first.added))
    more = simulate(lake, recipe)
    assert len(more.added) == 3
    assert set(more.existing) == set(first.added)


def test_members_of_several_materials_are_all_there(lake: Lake) -> None:
    text = small().replace(
        'name = "camel-ponte-roma"', 'names = ["camel-ponte-roma", "gray-interlock", "paper"]'
    )
    recipe = replace(parse(text, name="mixed", folder=Path(), where="r"), count=9)
    report = simulate(lake, recipe, workers=2)
    assert (len(report.added), len(report.failed)) == (9, 0)
    assert set(report.steps) == {"camel-ponte-roma", "gray-interlock", "paper"}
    crew = Crew(recipe)
    rows = {json.loads(row["report"])["index"]: row for row in lake.rows().to_pylist()}
    assert sorted(rows) == list(range(9))
    for index, row in rows.items():
        name = crew.member(index).scene.material.name
        assert json.loads(row["parameters"])["material"] == name
        assert json.loads(row["report"])["step"] == report.steps[name]


def test_a_member_is_the_same_in_any_company(tmp_path: Path) -> None:
    recipe = make_recipe()
    whole, parts = Lake.create(tmp_path / "whole"), Lake.create(tmp_path / "parts")
    simulate(whole, recipe)
    for count in (1, 2, 5, 6):
        simulate(parts, replace(recipe, count=count))
    assert objects(parts) == objects(whole)


@pytest.mark.parametrize(
    "more", ["", '[integrator]\nname = "implicit"', "[effects.hysteresis]\ncouple = 1e-3"]
)
def test_workers_side_by_side_make_the_same_members(tmp_path: Path, more: str) -> None:
    recipe = replace(make_recipe(more=more), count=8, batch=2)
    one, four = Lake.create(tmp_path / "one"), Lake.create(tmp_path / "four")
    simulate(one, recipe)
    seen: list[int] = []
    report = simulate(four, recipe, workers=4, progress=seen.append)
    assert objects(four) == objects(one)
    assert sum(seen) == len(report.added) == 8
    with pytest.raises(UsageError, match="0 workers"):
        simulate(one, recipe, workers=0)


def test_an_interrupted_run_keeps_what_was_committed(lake: Lake) -> None:
    recipe = replace(make_recipe(), count=12, batch=2)

    def interrupt(count: int) -> None:
        if len(lake.rows()) >= 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(lake, recipe, workers=2, progress=interrupt)
    kept = objects(lake)
    assert 4 <= len(kept) < 12
    simulate(lake, recipe)
    assert {seed: stored for seed, stored in objects(lake).items() if seed in kept} == kept
    assert len(objects(lake)) == 12


def test_a_killed_run_goes_on_where_it_was(tmp_path: Path) -> None:
    recipe = tmp_path / "small.toml"
    recipe.write_text(small().replace("count = 6", "count = 8").replace("batch = 4", "batch = 2"))
    killed = Lake.create(tmp_path / "killed")
    with pausing.start(WORKER, killed.path, recipe, 4) as process:
        pausing.await_pause(process)
        process.kill()
    assert process.returncode == -signal.SIGKILL
    before = objects(killed)
    assert (
        4 <= len(before) < 8
    )  # it paused in the third batch of four, or in the fourth while the third was committed
    simulate(killed, load(str(recipe)))
    assert len(objects(killed)) == 8
    assert {seed: stored for seed, stored in objects(killed).items() if seed in before} == before
    assert len(killed.rows()) == 8


def test_what_fails_is_reported_and_not_stored(lake: Lake) -> None:
    # With a hundredth of the declared damping a sheet crumples where there is wind
    # (`sim.run.member_batch.CRUMPLED`).
    recipe = make_recipe(material='damping = { low = 1e-9, high = 1e-3, scale = "log" }')
    recipe = replace(recipe, count=8, time=replace(recipe.time, settle=2.4))
    report = simulate(lake, recipe)
    assert report.failed
    assert len(report.added) + len(report.failed) == 8
    crew = Crew(recipe)
    assert {failure["kind"] for failure in report.failed} == {"crumpled"}
    assert (
        max(crew.member(failure["index"]).parameters["damping"] for failure in report.failed) < 1e-5
    )
    assert not {failure["seed"] for failure in report.failed} & set(objects(lake))


def test_another_branch_has_its_own_members(lake: Lake) -> None:
    recipe = replace(make_recipe(), count=1)
    simulate(lake, recipe)
    lake.branch("trial")
    assert simulate(lake, recipe, branch="trial").added == ()
    more = simulate(lake, replace(recipe, count=2), branch="trial")
    assert len(more.added) == 1
    assert len(lake.rows()) == 1


def test_a_device_that_is_not_there_is_refused(lake: Lake) -> None:
    with pytest.raises(UsageError, match="device 'cuda:97' is not there"):
        simulate(lake, make_recipe(), device="cuda:97")


def test_progress_counts_members_those_that_are_there_too(lake: Lake) -> None:
    simulate(lake, replace(make_recipe(), count=2))
    seen: list[int] = []
    simulate(lake, make_recipe(), progress=seen.append)
    assert seen[0] == 2
    assert sum(seen) == 6
