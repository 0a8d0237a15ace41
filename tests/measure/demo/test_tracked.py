"""The demonstration's tracked flag: files a user could have brought, which do not state what acted
on the cloth."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from flagdata.errors import InputError
from measure.demo import TrackedRecipe, make_tracks
from measure.demo.tracked import Tracks
from measure.trajectories import load, read
from sim.effects import EFFECTS

RECIPE = TrackedRecipe(seed=5, speeds=(4.0, 6.0), duration=5.0, settle=0.4)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Tracks:
    return make_tracks(RECIPE, tmp_path_factory.mktemp("tracked"), advance=lambda count: None)


def test_the_files_are_an_experiment_without_findings_that_matter(made: Tracks) -> None:
    observed = read(load(made.recipe))
    assert not [f for f in observed.findings if f.severity != "note"]
    experiment = observed.experiment
    assert [r.wind.speed for r in experiment.recordings] == [4.0, 6.0]
    assert experiment.recordings[0].positions.shape == (125, 70, 3)
    np.testing.assert_allclose(np.ptp(experiment.specimen.mesh.rest, axis=0), [0.9, 0.6])


def test_neither_file_states_what_acted(made: Tracks) -> None:
    recipe = made.recipe.read_text(encoding="utf-8")
    assert not [effect for effect in EFFECTS if effect in recipe]
    assert set(tomllib.loads(recipe)) == {"title", "cloth", "material", "attachment", "recording"}
    assert made.table.read_text(encoding="utf-8").startswith("recording,frame,marker,u,v,x,y,z\n")


def test_what_acted_is_an_effect_that_the_library_weighs(made: Tracks) -> None:
    described = EFFECTS[made.effect].parameters()[made.parameter]
    assert made.unit == described.unit
    low, high = described.prior
    assert low <= made.strength <= high


def test_recordings_too_short_to_judge_are_refused() -> None:
    with pytest.raises(InputError, match="at least 5 s"):
        TrackedRecipe(seed=1, duration=2.0)
