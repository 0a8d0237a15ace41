"""A verdict and its models in the lake: one commit, once; a model that is named runs with the
verdict's parameters."""

from __future__ import annotations

import json
import math
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sim.run.lake_models
from flagdata.answer import Quantity
from flagdata.core.schema import Kind
from flagdata.errors import CorruptError, InputError
from flagdata.lake import Artifact, Lake
from flagdata.recipes.documents import to_toml
from measure.closing import ClosedLoop, acting, answer_of
from measure.closing.model_recipes import models
from measure.closing.verdict_artifacts import fingerprint, keep, read
from measure.loop import LoopOptions
from measure.trajectories import Experiment, Specimen, Trajectory, WindTrack
from measure.verdict import Conclusion, Parameter, Verdict
from sim.cloth.material import named_material
from sim.cloth.mesh import Mesh
from sim.run import Crew, of_content
from tests.measure.report.verdicts import Size, verdict
from tests.program import invoke

FITTED = {"area_weight": (1.0, 1.1), "bending": (1.6, 0.7), "damping": (0.004, 0.003)}
"""Before and after the effect was added; damping in seconds, the others of nominal."""


def _about(value: float) -> Quantity:
    return Quantity.of(value=value, low=0.9 * value, high=1.1 * value, unit="1")


def concluded(conclusion: Conclusion) -> Verdict:
    """A made-up verdict with the parameters that closing the loop reports."""
    made = verdict(conclusion, Size(across=3, up=3, frames=20, stretch=2))
    parameters = tuple(
        Parameter(
            name=name,
            before=_about(before),
            shift=1.0 if made.named else None,
            after=_about(after) if made.named else None,
        )
        for name, (before, after) in FITTED.items()
    )
    return replace(made, parameters=parameters)


def experiment(
    specimen: Specimen, *, source: str = "", name: str = "a", speed: float = 4.0
) -> Experiment:
    rest = specimen.mesh.rest
    positions = np.tile(np.stack([rest[:, 0], 0 * rest[:, 0], rest[:, 1]], axis=1), (50, 1, 1))
    recording = Trajectory(
        name=name,
        markers=rest,
        positions=positions,
        rate=25.0,
        wind=WindTrack.constant((speed, 0.0, 0.0)),
        source=source,
    )
    return Experiment(specimen=specimen, recordings=(recording,))


def closed(observed: Experiment, conclusion: Conclusion = Conclusion.EFFECT) -> ClosedLoop:
    found = concluded(conclusion)
    return answer_of(
        found,
        observed,
        LoopOptions(seed=3),
        name="tracks",
        findings=(),
        models=models(found, observed, name="tracks", seed=3),
    )


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    return Lake.create(tmp_path / "lake")


@pytest.fixture
def recorded(lake: Lake) -> str:
    """The id of a recording in the lake."""
    row = Artifact(kind=Kind.MARKERS, name="recorded", source_hash="0" * 64)
    with lake.transaction("a recording") as transaction:
        transaction.add(row)
    return row.id


def test_verdict_and_both_models_are_one_commit_made_from_the_recordings(
    lake: Lake, recorded: str, specimen: Specimen
) -> None:
    before = len(list(lake.catalog.history()))
    kept = keep(lake, closed(experiment(specimen, source=recorded)))
    assert len(list(lake.catalog.history())) == before + 1
    measurement = lake.artifact(kept.measurement)
    assert measurement.kind is Kind.MEASUREMENT
    assert measurement.parents == (recorded,)
    assert measurement.seed == 3
    base, larger = (lake.artifact(model) for model in kept.models)
    assert (base.kind, larger.kind) == (Kind.MODEL, Kind.MODEL)
    assert (base.name, larger.name) == ("tracks-base", "tracks-lift")
    assert base.parents == larger.parents == (kept.measurement, recorded)


def test_what_was_kept_comes_back_as_it_was(lake: Lake, specimen: Specimen) -> None:
    given = closed(experiment(specimen))
    stored = lake.artifact(keep(lake, given).measurement).object
    assert stored is not None
    found, report = read(lake.object_path(stored))
    assert found.words == given.verdict.words
    assert found.test == given.verdict.test
    assert "<html" in report
    lake.objects.check(stored)


def test_a_loop_that_was_closed_is_kept_in_a_bucket(
    tmp_path: Path, specimen: Specimen, bucket_folder: str
) -> None:
    kept = keep(Lake.create(bucket_folder), closed(experiment(specimen)))
    shutil.rmtree(tmp_path / "cache")
    again = Lake.open(bucket_folder)
    found, report = read(again.object_path(str(again.artifact(kept.measurement).object)))
    assert found.words == concluded(Conclusion.EFFECT).words
    assert "<html" in report
    assert {again.artifact(model).name for model in kept.models} == {"tracks-base", "tracks-lift"}


def test_a_folder_that_is_no_measurement_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "other.zarr").mkdir()
    with pytest.raises(CorruptError):
        read(tmp_path / "other.zarr")


def test_closing_the_same_loop_again_adds_nothing(lake: Lake, specimen: Specimen) -> None:
    first = keep(lake, closed(experiment(specimen)))
    head = lake.resolve(None)
    again = keep(lake, closed(experiment(specimen, name="renamed")))
    assert (first.place.new, again.place.new) == (True, False)
    assert again.measurement == first.measurement
    assert set(again.models) == set(first.models)
    assert lake.resolve(None) == head


def test_newer_code_leaves_its_verdict_and_models_under_the_same_names(
    lake: Lake, recorded: str, specimen: Specimen, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As after a mistake was mended, by which the first verdict found no effect."""
    observed = experiment(specimen, source=recorded)
    first = keep(lake, closed(observed, Conclusion.SUFFICIENT))
    monkeypatch.setattr("flagdata.core.provenance.code_version", lambda: "0.1.0+mended")
    second = keep(lake, closed(observed))
    assert (second.place.version, second.measurement != first.measurement) == (2, True)
    assert json.loads(str(lake.artifact("tracks").report))["conclusion"] == Conclusion.EFFECT.value
    assert (
        json.loads(str(lake.artifact(first.measurement).report))["conclusion"]
        == Conclusion.SUFFICIENT.value
    )
    assert sim.run.lake_models.load("tracks-base", lake).model == second.models[0]
    assert lake.artifact("tracks-lift").parents == (second.measurement, recorded)


def test_the_identity_is_that_of_all_that_was_known(specimen: Specimen) -> None:
    base = fingerprint(experiment(specimen))
    heavier = replace(specimen, material=specimen.material.scaled(area_weight=1.01))
    moved = replace(specimen, anchors=specimen.anchors + 1e-3)
    others = [
        experiment(specimen, speed=4.1),
        experiment(heavier),
        experiment(moved),
        experiment(replace(specimen, stiffness=math.inf)),
        experiment(replace(specimen, area_weight_uncertainty=0.02)),
        experiment(replace(specimen, area_weight_uncertainty=None)),
    ]
    (seen,) = experiment(specimen).recordings
    otherwise = (
        replace(seen, wind=replace(seen.wind, clock=1.0)),
        replace(seen, seen=np.ones(seen.positions.shape[:2], dtype=np.bool_)),
    )
    others += [Experiment(specimen=specimen, recordings=(recording,)) for recording in otherwise]
    assert fingerprint(experiment(specimen, name="renamed", source="f" * 32)) == base
    assert len({base, *map(fingerprint, others)}) == 1 + len(others)


@pytest.mark.parametrize(
    ("conclusion", "effects"),
    [
        (Conclusion.SUFFICIENT, ()),
        (Conclusion.OUTSIDE, ()),
        (Conclusion.EFFECT, ("lift",)),
        (Conclusion.PARTLY, ("lift",)),
        (Conclusion.ONE_OF, ("lift",)),  # the best of those that fit equally well
    ],
)
def test_a_verdict_leaves_a_larger_model_where_an_effect_acts(
    specimen: Specimen, conclusion: Conclusion, effects: tuple[str, ...]
) -> None:
    found = concluded(conclusion)
    assert tuple(c.effect for c in acting(found)) == effects
    assert len(models(found, experiment(specimen), name="x", seed=0)) == 1 + bool(effects)


@pytest.mark.parametrize(("place", "stage"), [(0, 0), (1, 1)], ids=["base", "larger"])
def test_a_model_has_the_parameters_of_the_verdict(
    specimen: Specimen, place: int, stage: int
) -> None:
    model = models(concluded(Conclusion.EFFECT), experiment(specimen, speed=5.0), name="x", seed=0)[
        place
    ]
    text = to_toml(model.content)
    crew = Crew(of_content(tomllib.loads(text), name="x", folder=Path(), where="x"))
    member, nominal = crew.member(0), named_material("camel-ponte-roma")
    area_weight, bending, damping = (values[stage] for values in FITTED.values())
    assert member.scene.material.area_weight == pytest.approx(nominal.area_weight * area_weight)
    np.testing.assert_allclose(member.scene.material.bending, nominal.bending * bending)
    np.testing.assert_allclose(member.scene.material.stretching, nominal.stretching)
    assert member.scene.material.damping == pytest.approx(damping)
    assert member.wind_speed == 5.0
    assert {name: dict(values) for name, values in member.effects.items()} == (
        {}
        if place == 0
        else {"lift": {"coefficient": 0.62, "density": pytest.approx(1.225, abs=0.1)}}
    )
    np.testing.assert_allclose(crew.mesh.rest, specimen.mesh.rest)
    np.testing.assert_array_equal(crew.mesh.faces, specimen.mesh.faces)
    assert crew.handles.vertices == specimen.held


def test_a_turned_wind_turns_before_a_run_begins(specimen: Specimen) -> None:
    found = concluded(Conclusion.EFFECT)
    turned = replace(found.ranking[0], effect="direction-change", parameter="angle")
    whole = replace(found, named=("direction-change",), ranking=(turned, *found.ranking[1:]))
    larger = models(whole, experiment(specimen), name="x", seed=0)[1]
    assert larger.content["effects"]["direction-change"] == {
        "angle": pytest.approx(found.ranking[0].strength.point),
        "start": -1.0,
        "duration": 1e-3,
    }


def test_a_cloth_of_any_outline_held_anywhere_keeps_its_mesh_and_pins(specimen: Specimen) -> None:
    rest = specimen.mesh.rest.copy()
    rest[:, 1] *= 1 + 0.3 * rest[:, 0]  # a trapezium
    held = (0, 40)
    anchors = np.array([[0.0, 0.0, 0.0], [0.4, 0.1, 0.2]])
    odd = replace(
        specimen,
        mesh=Mesh(rest=rest, faces=specimen.mesh.faces),
        held=held,
        anchors=anchors,
        stiffness=math.inf,
        material=replace(
            specimen.material, name="of a mill", bending=1.5 * specimen.material.bending
        ),
    )
    (model,) = models(concluded(Conclusion.SUFFICIENT), experiment(odd), name="odd", seed=0)
    crew = Crew(
        of_content(tomllib.loads(to_toml(model.content)), name="odd", folder=Path(), where="odd")
    )
    scene = crew.member(0).scene
    np.testing.assert_array_equal(scene.mesh.rest, rest)
    np.testing.assert_array_equal(scene.position[list(held)], anchors)
    assert scene.handles.vertices == held
    assert scene.handles.rigid
    np.testing.assert_allclose(scene.material.bending, 1.6 * odd.material.bending)


def test_simulate_runs_a_model_by_its_name(lake: Lake, specimen: Specimen) -> None:
    kept = keep(lake, closed(experiment(specimen)))
    ended = invoke("simulate", "tracks-lift", "--lake", lake.path, "--json", "--workers", 1)
    assert ended.code == 0
    (added,) = ended.document["added"]
    flown = lake.artifact(added)
    assert flown.kind is Kind.MESHES
    assert flown.parents == (kept.models[1],)
    drawn = json.loads(flown.parameters or "")
    assert drawn["lift.coefficient"] == 0.62
    assert drawn["damping"] == 0.003
    assert flown.wind == 4.0


@pytest.mark.parametrize(
    ("source", "what"),
    [("tracks-lfit", "did you mean 'tracks-lift'"), ("flag-gust", "did you mean 'flag-gusts'")],
)
def test_a_name_that_is_neither_a_recipe_nor_a_model_is_refused_with_the_nearest(
    lake: Lake, specimen: Specimen, source: str, what: str
) -> None:
    keep(lake, closed(experiment(specimen)))
    ended = invoke("simulate", source, "--lake", lake.path)
    assert ended.code == 2
    assert what in ended.err


def test_toml_reads_back_as_it_was_written() -> None:
    content = {
        "text": 'quotes " and \\ and\ttabs\x7f',
        "whole": 3,
        "real": 0.1,
        "small": 1e-17,
        "yes": True,
        "list": [[1.0, 2.0], [3.0, 4.0]],
        "table": {"inner": {"odd key": "ü", "n": -1}, "empty": {}},
    }
    assert tomllib.loads(to_toml(content)) == content


def test_what_toml_has_no_form_for_is_refused() -> None:
    with pytest.raises(InputError, match="no form"):
        to_toml({"nothing": None})
