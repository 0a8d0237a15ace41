"""Intervals of a refinement: a posterior at an end of the box that is searched is a bound."""

from __future__ import annotations

import math

import numpy as np

from flagdata.answer import Bound
from flagdata.core.rng import stream
from flagdata.recipes.typed_tables import Range
from measure.posterior_ends import limits_of
from measure.refine import Refined, Round
from measure.refine.procedure import _is_settled
from measure.refine.refinement import intervals_of, phrase

BOX = (Range(low=0.0, high=10.0), Range(low=0.05, high=0.40))


def found(
    wind: tuple[float, float], area_weight: tuple[float, float], *, stated: bool = False
) -> tuple[Refined, ...]:
    """Intervals of draws that are uniform between these ends."""
    rng = stream(1, "refinement")
    draws = np.stack(
        [rng.uniform(*wind, 2000), rng.uniform(*area_weight, 2000), rng.normal(size=2000)], axis=1
    )
    prior = np.stack(
        [rng.uniform(0, 10, 2000), rng.uniform(0.05, 0.4, 2000), rng.normal(size=2000)], axis=1
    )
    density_limits = (0.05, 0.40) if stated else limits_of("area_weight")
    return intervals_of(
        draws, prior, 0.9, ranges=BOX, limits=(limits_of("wind_speed"), density_limits)
    )


def test_winds_at_the_end_of_the_box_are_bounded_on_one_side_and_those_inside_are_not() -> None:
    strong, heavy, bending = found((8.0, 10.0), (0.36, 0.40))
    assert (strong.span.bound, strong.span.high, strong.value) == (Bound.LEAST, math.inf, None)
    assert heavy.span.bound is Bound.LEAST
    assert (bending.span.bound, bending.value is None) == (None, False)
    assert phrase(strong, 1, " m/s") == "at least 8.1 m/s"
    inside = found((6.0, 8.0), (0.1, 0.2))
    assert [entry.span.bound for entry in inside] == [None, None, None]
    assert phrase(inside[0], 0, " m/s") == "7 m/s [6, 8]"


def test_calm_air_and_an_area_weight_that_is_known_keep_their_median() -> None:
    calm, known, _ = found((0.0, 1.0), (0.36, 0.40), stated=True)
    assert (calm.span.low, calm.value is None) == (0.0, False)
    assert (known.span.high, known.value is None) == (0.40, False)


def test_a_wind_that_is_only_bounded_has_not_settled() -> None:
    def at(interval: Refined) -> Round:
        return Round(evaluations=8, distance=1.0, floor=1.0, intervals=(interval,), seconds=1.0)

    strong, inside = found((8.0, 10.0), (0.1, 0.2))[0], found((6.0, 8.0), (0.1, 0.2))[0]
    assert _is_settled([at(inside), at(inside)], 0.1)
    assert not _is_settled([at(strong), at(strong)], 0.1)
    assert not _is_settled([at(inside), at(strong)], 0.1)
    assert not _is_settled([at(strong), at(inside)], 0.1)
