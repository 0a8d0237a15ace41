"""What tears a cloth apart is made weaker, until it does not; what is published is what was
simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.errors import FlagdataError
from tests.studies.challenge import cases
from tests.studies.challenge.answer_key import Acting, AnswerKey
from tests.studies.challenge.cases import TINY
from tests.studies.challenge.recipe import ChallengeRecipe, Kind, parse
from tests.studies.challenge.simulation import simulate


@pytest.fixture(autouse=True)
def single_thread() -> None:
    torch.set_num_threads(1)


def reactive(mass: float) -> Acting:
    return Acting(effect="reactive-loading", parameter="mass", value=mass, unit="kg/m²")


@pytest.fixture(scope="module")
def recipe() -> ChallengeRecipe:
    return replace(parse(TINY, where="tiny"), settle=1.0)


def reacting(name: str, mass: float) -> AnswerKey:
    return replace(cases.key(name, Kind.ONE, reactive(mass)), speeds=(7.0, 8.0))


def test_a_strength_that_tears_the_cloth_apart_is_halved_until_it_does_not(
    recipe: ChallengeRecipe,
) -> None:
    torn, whole = reacting("set-001", 3.0), reacting("set-002", 0.02)
    simulated = simulate(recipe, 1, [torn, whole])
    acted = simulated["set-001"].effects
    assert 3.0 / acted[0].value in (2.0, 4.0, 8.0)
    assert simulated["set-002"].effects == whole.effects
    again = simulate(recipe, 1, [replace(torn, effects=acted), whole])
    assert np.array_equal(again["set-001"].positions[0], simulated["set-001"].positions[0])


def test_what_tears_the_cloth_apart_at_an_eighth_as_well_is_an_error(
    recipe: ChallengeRecipe,
) -> None:
    with pytest.raises(FlagdataError, match=r"set-001.*diverged"):
        simulate(recipe, 1, [reacting("set-001", 30.0)])
