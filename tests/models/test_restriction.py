"""A posterior restricted to a known range is the posterior under the restricted prior."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from flagdata.errors import InputError
from models.restriction import ASPECT_SLACK, FEWEST, Known, restricted
from models.targets import Scaling
from tests.refusals import unrefused

SCALING = Scaling(names=("wind_speed", "fabric_density"))


def _draws(count: int, *, seed: int = 0) -> torch.Tensor:
    """(1, count, 2) logits of a wind that grows with the area weight: U = 2 + 20 ρ + 0.1 N(0, 1) m/s, ρ even."""
    generator = np.random.default_rng(seed)
    density = generator.uniform(0.05, 0.40, count)
    wind = 2 + 20 * density + 0.1 * generator.standard_normal(count)
    return SCALING.learned(torch.from_numpy(np.stack([wind, density], axis=1)))[None]


def test_the_wind_of_a_known_area_weight_is_the_conditional_one() -> None:
    known = Known.everywhere("density", 0.19, 0.21, count=1)
    logits, share = restricted(_draws(40_000), SCALING, known, draws=1_000)
    wind, density = SCALING.values(logits.double())[0].numpy().T
    assert share == pytest.approx([0.02 / 0.35], abs=0.005)
    assert density.min() >= 0.19 - 1e-6
    assert density.max() <= 0.21 + 1e-6
    # E[U | ρ in 0.19 … 0.21] = 2 + 20 · 0.20; variance 0.1² + 20² · 0.02²/12
    assert wind.mean() == pytest.approx(6.0, abs=0.02)
    assert wind.std() == pytest.approx((0.1**2 + 20**2 * 0.02**2 / 12) ** 0.5, rel=0.08)


def test_each_clip_has_its_own_range() -> None:
    logits = _draws(20_000).expand(2, -1, -1)
    known = Known(name="density", low=np.array([0.05, 0.30]), high=np.array([0.10, 0.40]))
    found, _ = restricted(logits, SCALING, known, draws=500)
    density = SCALING.values(found.double())[..., 1].numpy()
    assert density[0].max() <= 0.10 + 1e-6
    assert density[1].min() >= 0.30 - 1e-6


def test_draws_that_are_nearest_stand_for_a_range_that_has_none_and_the_share_says_so() -> None:
    values = torch.stack([torch.full((5_000,), 5.0), torch.linspace(0.06, 0.10, 5_000)], dim=1)
    logits = SCALING.learned(values)[None]
    found, share = restricted(logits, SCALING, Known.everywhere("density", 0.3, 0.4, count=1), draws=64)
    density = SCALING.values(found.double())[0, :, 1].numpy()
    assert share.tolist() == [0.0]
    assert density.min() == pytest.approx(0.10 - 0.04 * FEWEST / 5_000, abs=1e-5)


def test_a_range_that_the_model_cannot_use_is_refused() -> None:
    cases = [
        (("density", 0.01, 0.10), "0.05 to 0.4"),
        (("density", 0.10, 0.50), "0.05 to 0.4"),
        (("bending_scale", -4.0, -3.5), "does not estimate the bending_scale"),
    ]
    assert (
        unrefused(
            lambda known: restricted(_draws(100), SCALING, Known.everywhere(*known, count=1), draws=10),
            cases,
            InputError,
        )
        == []
    )


def test_a_range_whose_ends_are_not_in_order_is_refused() -> None:
    with pytest.raises(InputError, match="in order"):
        Known.everywhere("density", 0.2, 0.1, count=1)


BOTH = Scaling(names=("outdoor_wind", "fabric_density", "aspect"))


def test_of_a_flag_that_was_measured_and_weighed_both_restrict_the_wind() -> None:
    """U = 2 + 20 ρ + 3 a + 0.1 N(0, 1) m/s of even ρ and a: at ρ = 0.2 and a = ln 1.5 it is 6 + 3 · 0.405 m/s."""
    generator = np.random.default_rng(3)
    density, aspect = generator.uniform(0.05, 0.40, 200_000), generator.uniform(0.0, 0.693, 200_000)
    wind = 2 + 20 * density + 3 * aspect + 0.1 * generator.standard_normal(200_000)
    logits = BOTH.learned(torch.from_numpy(np.stack([wind, density, aspect], axis=1)))[None]
    weighed, measured = Known.everywhere("density", 0.19, 0.21, count=1), Known.of_aspect(3.0, 2.0, count=1)
    found, share = restricted(logits, BOTH, weighed, measured, draws=800)
    values = BOTH.values(found.double())[0].numpy()
    assert share == pytest.approx([0.02 / 0.35 * 2 * ASPECT_SLACK / 0.693], rel=0.06)
    assert values[:, 0].mean() == pytest.approx(6 + 3 * np.log(1.5), abs=0.03)
    assert np.abs(values[:, 1] - 0.2).max() <= 0.01 + 1e-6
    assert np.abs(values[:, 2] - np.log(1.5)).max() <= ASPECT_SLACK + 1e-6
    one, _ = restricted(logits, BOTH, weighed, draws=800)
    assert BOTH.values(one.double())[0, :, 0].numpy().std() > 3 * values[:, 0].std()
