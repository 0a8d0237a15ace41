"""Fabrics of nulls: factors on the tables of the nominal material."""

from __future__ import annotations

import math

import numpy as np
import pytest

from measure.nulls import StiffnessFactors
from measure.nulls.stiffness import drawn
from sim.cloth.material import named_material


def test_without_factors_it_is_the_nominal_material() -> None:
    nominal = named_material("camel-ponte-roma")
    made = StiffnessFactors().of(nominal)
    np.testing.assert_array_equal(made.stretching, nominal.stretching)
    np.testing.assert_array_equal(made.bending, nominal.bending)
    assert made.area_weight == nominal.area_weight


def test_factors_are_on_their_own_directions_and_the_coupling_between_them() -> None:
    """C11 and C22 are multiplied by 2·3 and 2·12, C12 by their geometric mean 2·6, C33 by 2·0.5."""
    nominal = named_material("camel-ponte-roma")
    made = StiffnessFactors(
        stretching=2.0, warp=3.0, weft=12.0, shear=0.5, bending=(1.0, 2.0, 4.0)
    ).of(nominal)
    shape = (1,) * (nominal.stretching.ndim - 1) + (4,)
    np.testing.assert_allclose(
        made.stretching, nominal.stretching * np.reshape([6.0, 12.0, 24.0, 1.0], shape)
    )
    np.testing.assert_allclose(made.bending, nominal.bending * np.array([[1.0], [2.0], [4.0]]))


def test_draws_stay_within_their_ranges_and_do_not_move_the_mean_bending() -> None:
    made = [drawn(np.random.default_rng(seed)) for seed in range(200)]
    assert all(0.5 <= one.stretching <= 2.0 for one in made)
    along = np.array([(one.warp, one.weft, one.shear) for one in made])
    assert along.min() >= 1 / 1.7
    assert along.max() <= 1.7
    # log-uniform: a mean of 0 and a standard deviation of ln 1.7 / √3
    np.testing.assert_allclose(np.log(along).mean(axis=0), 0.0, atol=0.07)
    np.testing.assert_allclose(np.log(along).std(axis=0), math.log(1.7) / math.sqrt(3), rtol=0.1)
    for one in made:
        assert math.prod(one.bending) == pytest.approx(1.0)
