"""The search space is the paper's, and its coordinates lose nothing."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import InputError
from measure.refine import QUANTITIES, Space
from sim.cloth.material import named_material
from sim.run import Recipe, load


def test_the_centre_is_the_material_at_mid_density_and_mid_wind(recipe: Recipe) -> None:
    values = Space.of(recipe).values(np.zeros((1, 17)))[0]
    np.testing.assert_allclose(values[:15], named_material("camel-ponte-roma").bending.ravel())
    np.testing.assert_allclose(values[15:], [0.135, 5.0])  # middle of table 1's ranges


def test_corners_are_a_tenth_and_ten_times_the_material(recipe: Recipe) -> None:
    space, bending = Space.of(recipe), named_material("camel-ponte-roma").bending.ravel()
    low, high = space.values(np.array([[-1.0] * 17, [1.0] * 17]))
    np.testing.assert_allclose(low, [*(bending * 0.1), 0.10, 0.0])
    np.testing.assert_allclose(high, [*(bending * 10), 0.17, 10.0])


def test_normalising_undoes_what_denormalising_did(recipe: Recipe, points: np.ndarray) -> None:
    space = Space.of(recipe)
    np.testing.assert_allclose(space.unit(space.values(points)), points, atol=1e-12)


def test_the_prior_is_uniform_in_the_factor_where_the_recipe_is(recipe: Recipe) -> None:
    space = Space.of(recipe)
    drawn = (
        space.values(space.prior(np.random.default_rng(0), 20_000))[:, :15]
        / named_material("camel-ponte-roma").bending.ravel()
    )
    # a uniform variable on [0.1, 10] has mean 5.05 and standard deviation 9.9/√12; 4 standard
    # errors of 300,000 draws
    assert abs(drawn.mean() - 5.05) < 4 * 9.9 / np.sqrt(12 * drawn.size)
    assert abs(drawn.std() - 9.9 / np.sqrt(12)) < 0.02


def test_combinations_of_bending_follow_their_definitions(recipe: Recipe) -> None:
    space = Space.of(recipe)
    table = np.full((3, 5), 1e-5)
    table[0] *= 4  # along the warp
    table[:, 3:] *= 3  # at the two largest curvatures
    point = space.unit(np.array([[*table.ravel(), 0.12, 3.0]]))
    reported = dict(
        zip((q.name for q in QUANTITIES), space.reported_quantities(point)[0], strict=True)
    )
    inside = space.values(point)[0, :15].reshape(3, 5)
    np.testing.assert_allclose(
        inside, table
    )  # within the box, so that nothing was moved to its edge
    assert reported["anisotropy"] == pytest.approx(np.log10(4))
    assert reported["nonlinearity"] == pytest.approx(np.log10(3))
    assert reported["bending_scale"] == pytest.approx(-5 + np.log10(4) / 3 + np.log10(3) * 2 / 5)
    assert (reported["wind_speed"], reported["area_weight"]) == (
        pytest.approx(3.0),
        pytest.approx(0.12),
    )


def test_a_common_factor_widens_the_box_and_moves_all_coefficients_together() -> None:
    space = Space.of(load("flag-fabrics"))
    bending = named_material("camel-ponte-roma").bending.ravel()
    low, high = space.values(np.array([[-1.0] * 17, [1.0] * 17]))
    np.testing.assert_allclose(low, [*(bending * 0.125 * 0.1), 0.05, 0.0])
    np.testing.assert_allclose(high, [*(bending * 4 * 10), 0.40, 10.0])
    logs = np.log(space.values(space.prior(np.random.default_rng(1), 20_000))[:, :15] / bending)
    # ln of a log-uniform factor from 0.125 to 4: variance (ln 32)²/12, shared by all coefficients
    np.testing.assert_allclose(
        np.cov(logs[:, 0], logs[:, 1])[0, 1], np.log(32) ** 2 / 12, rtol=0.05
    )


def test_draws_of_the_prior_lie_within_the_start_ranges() -> None:
    space = Space.of(load("flag-fabrics"))
    drawn = space.reported_quantities(space.prior(np.random.default_rng(2), 5_000))[:, :4]
    for column, entry in zip(drawn.T, space.start_ranges, strict=True):
        assert entry.low <= column.min() <= column.max() <= entry.high


def test_points_outside_of_the_box_are_refused(recipe: Recipe) -> None:
    with pytest.raises(InputError, match="outside"):
        Space.of(recipe).values(np.full((1, 17), 1.2))


def test_a_recipe_without_ranges_is_refused() -> None:
    with pytest.raises(InputError, match="ranges"):
        Space.of(load("hanging-cloth"))


def test_a_prior_of_several_scenes_is_their_mixture_within_the_box() -> None:
    """Shares and moments by the law of total probability; bending outside of the smaller box only
    from the larger."""
    box, usual = Space.of(load("flag-fabrics")), Space.of(load("flag-wide"))
    mixed = box.learned([(usual, 3.0), (box, 1.0)])
    drawn = mixed.values(mixed.prior(np.random.default_rng(4), 40_000))
    area_weight = drawn[:, 15]
    inside = np.log(0.17 / 0.10) / np.log(0.40 / 0.05)  # of a log-uniform area weight
    assert ((area_weight >= 0.10) & (area_weight <= 0.17)).mean() == pytest.approx(
        0.75 + 0.25 * inside, abs=0.01
    )
    means = 0.135, (0.40 - 0.05) / np.log(0.40 / 0.05)
    assert area_weight.mean() == pytest.approx(0.75 * means[0] + 0.25 * means[1], abs=0.001)
    assert drawn[:, 16].mean() == pytest.approx(5.0, abs=0.06)
    factor = drawn[:, :15] / named_material("camel-ponte-roma").bending.ravel()
    beyond = (factor.max(axis=1) > 10.001) | (factor.min(axis=1) < 0.0999)
    own = (
        box.values(box.prior(np.random.default_rng(5), 40_000))[:, :15]
        / named_material("camel-ponte-roma").bending.ravel()
    )
    of_box = ((own.max(axis=1) > 10.001) | (own.min(axis=1) < 0.0999)).mean()
    assert beyond.mean() == pytest.approx(0.25 * of_box, abs=0.01)
    assert mixed.identity == box.identity


def test_a_part_of_a_prior_that_reaches_out_of_the_box_is_refused() -> None:
    box, usual = Space.of(load("flag-fabrics")), Space.of(load("flag-wide"))
    with pytest.raises(InputError, match="reaches out of the box"):
        usual.learned([(box, 1.0)])
    with pytest.raises(InputError, match="weight 0"):
        box.learned([(usual, 0.0)])
