"""The answer in words: which quantities get a value, which do not, and how much the film added to
what was assumed."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from flagdata.answer import Bound, Quantity, Span
from flagdata.core.json_values import json_values
from flagdata.core.rng import stream
from flagdata.errors import InputError
from measure.estimate import information
from measure.estimate.film_answer import explain_bound, phrase, quantities, sentence


def whole(low: float, high: float) -> Span:
    """An interval with two ends."""
    return Span(low=low, high=high, level=0.9, bound=None, estimated=True)


WIND = Quantity(
    name="wind_speed",
    unit="m/s",
    value=4.3,
    sigma=0.27,
    span=whole(3.9, 4.8),
    assumed=(0.0, 10.0),
    information=1.9,
)
WEIGHT = Quantity(
    name="area_weight",
    unit="kg/m²",
    value=0.13,
    sigma=0.014,
    span=whole(0.11, 0.16),
    assumed=(0.1, 0.17),
    information=0.3,
)
UNCONSTRAINED = Quantity(
    name="area_weight",
    unit="kg/m²",
    value=0.135,
    sigma=0.02,
    span=whole(0.1, 0.17),
    assumed=(0.1, 0.17),
    constrained=False,
    information=0.001,
)
STRONG = Quantity(
    name="wind_speed",
    unit="m/s",
    value=None,
    sigma=None,
    assumed=(0.0, 10.0),
    information=3.0,
    span=Span(low=9.4, high=math.inf, level=0.95, bound=Bound.LEAST, estimated=False),
)
CALM = Quantity(
    name="wind_speed",
    unit="m/s",
    value=0.2,
    sigma=0.1,
    assumed=(0.0, 10.0),
    information=3.0,
    span=Span(low=0.0, high=0.5, level=0.95, bound=Bound.MOST, estimated=True),
)


def test_the_answer_is_one_line() -> None:
    assert (
        sentence([WIND, WEIGHT])
        == "wind 4.3 m/s [3.9, 4.8] 90 %, area weight 0.13 kg/m² [0.11, 0.16]"
    )


def test_a_quantity_without_information_is_reported_with_its_prior_range() -> None:
    assert sentence([WIND, UNCONSTRAINED]) == (
        "wind 4.3 m/s [3.9, 4.8] 90 %; area weight: not constrained by this clip (prior range 0.10 "
        "to 0.17 kg/m²)"
    )
    assert sentence([UNCONSTRAINED]).startswith("area weight: not constrained")


def test_a_wind_at_the_end_of_what_the_model_knows_is_bounded_on_one_side_with_the_reason() -> None:
    assert sentence([STRONG, WEIGHT]) == (
        "wind at least 9.4 m/s, 95 % (the network's range ends at 10.0 m/s), area weight 0.13 "
        "kg/m² [0.11, 0.16] 90 %"
    )
    assert sentence([CALM, UNCONSTRAINED]).startswith(
        "wind at most 0.5 m/s, 95 %; area weight: not constrained"
    )
    finding = explain_bound(STRONG)
    assert finding is not None
    assert finding.kind == "wind-speed-at-end"
    assert "ends at 10.0 m/s" in finding.what
    assert explain_bound(CALM) is explain_bound(WIND) is None


def test_an_end_that_nothing_bounds_is_null_in_json_and_no_value_is_given() -> None:
    document = json.loads(json.dumps(json_values(STRONG), allow_nan=False))
    assert (document["value"], document["sigma"], document["interval"]) == (None, None, [9.4, None])
    assert (document["bound"], document["level"]) == ("at-least", 0.95)
    assert (json_values(WIND)["bound"], json_values(WIND)["level"]) == (None, 0.9)


def test_draws_at_both_ends_of_the_range_give_no_value() -> None:
    draws = np.repeat([0.01, 9.99], 500)[:, None]
    both = found(draws, np.linspace(0, 10, 1000)[:, None], "wind_speed", assumed=(0.0, 10.0))
    assert (both.bound, both.constrained) == (Bound.NOTHING, False)


def test_the_weight_of_a_small_flag_is_given_to_a_gram() -> None:
    small = Quantity(
        name="area_weight",
        unit="kg/m²",
        value=0.0325,
        sigma=0.003,
        span=whole(0.028, 0.038),
        assumed=(0.025, 0.0425),
        information=0.4,
    )
    assert phrase(small, first=False) == "area weight 0.033 kg/m² [0.028, 0.038]"


def test_information_is_the_divergence_of_gaussians() -> None:
    rng = stream(1, "information")
    prior = rng.normal(0, 2, 200_000)
    # ½ (σ²/τ² − 1 − ln σ²/τ² + m²/τ²) with σ = 1, τ = 2, m = 1.
    assert information(rng.normal(1, 1, 200_000), prior) == pytest.approx(
        0.5 * (0.25 - 1 - np.log(0.25) + 0.25), abs=0.01
    )
    assert information(prior, prior) == pytest.approx(0, abs=1e-12)


def found(
    draws: np.ndarray,
    prior: np.ndarray,
    name: str,
    *,
    assumed: tuple[float, float],
    level: float = 0.9,
) -> Quantity:
    low, high = assumed
    return quantities(
        draws,
        prior,
        [name],
        level=level,
        assumed=np.array([assumed]),
        places=(draws - low) / (high - low),
        stated_values={},
    )[0]


def test_a_posterior_equal_to_the_prior_gives_no_value_and_a_narrow_one_does() -> None:
    rng = stream(2, "told")
    prior = rng.uniform(0.1, 0.17, size=(5000, 1))
    assert not found(
        rng.uniform(0.1, 0.17, size=(400, 1)), prior, "area_weight", assumed=(0.1, 0.17)
    ).constrained
    assert found(
        rng.normal(0.13, 0.01, size=(400, 1)), prior, "area_weight", assumed=(0.1, 0.17)
    ).constrained


def test_the_interval_contains_its_share_of_the_draws() -> None:
    draws = np.linspace(0, 1, 1001)[:, None]
    own = found(draws, draws, "wind_speed", assumed=(0.0, 1.0), level=0.8).span
    assert (own.low, own.high) == (pytest.approx(0.1), pytest.approx(0.9))
    with pytest.raises(InputError, match="between 0 and 1"):
        found(draws, draws, "wind_speed", assumed=(0.0, 1.0), level=1.0)
