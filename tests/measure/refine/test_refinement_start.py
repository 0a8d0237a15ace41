"""A refinement starts from the network's estimates of the clip and from the given properties of the
cloth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.core.rng import stream
from flagdata.recipes.typed_tables import Range
from measure.refine import AREA_WEIGHT_COLUMN, WIND_COLUMN, Space, refinement_start
from models.trained.estimator import Estimator
from sim.run import Recipe


def test_completed_points_have_the_given_wind_and_area_weight(recipe: Recipe) -> None:
    space = Space.of(recipe)
    given = np.array([[3.0, 0.12, -4.0, 0.1], [7.5, 0.165, -3.9, -0.2]])
    values = space.values(refinement_start.complete_points(space, given, seed=0))
    np.testing.assert_allclose(values[:, WIND_COLUMN], given[:, 0])
    np.testing.assert_allclose(values[:, AREA_WEIGHT_COLUMN], given[:, 1])


def test_an_area_weight_that_is_known_is_what_the_refinement_starts_from(
    estimator: Estimator, recipe: Recipe
) -> None:
    known = replace(
        recipe, material=replace(recipe.material, area_weight=Range(low=0.12, high=0.125))
    )
    clip = stream(0, "clip").integers(0, 255, (8, 48, 48), dtype=np.uint8)
    draws = refinement_start.amortised_draws(
        estimator, clip, Space.of(known), aspect=1.5, seed=1, draws=200
    )
    assert 0.12 <= draws[:, 1].min() <= draws[:, 1].max() <= 0.125 + 1e-6
    free = refinement_start.amortised_draws(
        estimator, clip, Space.of(recipe), aspect=1.5, seed=1, draws=200
    )
    assert np.ptp(free[:, 1]) > 0.01


def test_summaries_are_the_networks_own_estimates_as_shares_of_their_ranges(
    estimator: Estimator,
) -> None:
    """The logistic function of the posterior's mean logit, here from 20,000 of its draws."""
    clips = stream(0, "clips").integers(0, 255, (5, 8, 48, 48), dtype=np.uint8)
    embedded = estimator.embeddings(estimator.inputs(clips))
    rows = np.concatenate([torch.cat(embedded, dim=1).double().numpy(), np.full((1, 6), np.nan)])
    summaries = refinement_start.summaries(estimator, rows)
    assert summaries.shape == (6, 2)
    assert np.isnan(summaries[-1]).all()
    drawn = estimator.logits(embedded, seed=1, draws=20_000).mean(dim=1).sigmoid().double().numpy()
    assert [target.name for target in estimator.targets][:2] == list(refinement_start.SUMMARISED)
    np.testing.assert_allclose(summaries[:-1], drawn[:, :2], atol=0.01)


def test_widening_by_one_changes_nothing(recipe: Recipe) -> None:
    space = Space.of(recipe)
    reported = space.reported_quantities(space.prior(np.random.default_rng(3), 50))[:, :4]
    reported[:, :2] = np.clip(reported[:, :2], [0.2, 0.101], [9.8, 0.169])
    assert refinement_start.widen_draws(reported, 1.0, space) == pytest.approx(reported)
