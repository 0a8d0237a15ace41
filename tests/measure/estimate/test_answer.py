"""The answer in words: what is told, what is not, and by how much the film added to what was assumed."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.rng import stream
from measure.estimate.answer import Quantity, information, quantities, sentence

WIND = Quantity(
    name="wind_speed", unit="m/s", value=4.3, sigma=0.27, low=3.9, high=4.8, assumed=(0.0, 10.0), information=1.9
)
WEIGHT = Quantity(
    name="density", unit="kg/m²", value=0.13, sigma=0.014, low=0.11, high=0.16, assumed=(0.1, 0.17), information=0.3
)
UNTOLD = Quantity(
    name="density", unit="kg/m²", value=0.135, sigma=0.02, low=0.1, high=0.17, assumed=(0.1, 0.17), information=0.001
)


def test_the_answer_is_one_line() -> None:
    assert sentence([WIND, WEIGHT], level=0.9) == "wind 4.3 m/s [3.9, 4.8] 90 %, area weight 0.13 kg/m² [0.11, 0.16]"


def test_what_the_film_did_not_tell_is_said_so() -> None:
    assert sentence([WIND, UNTOLD], level=0.9) == (
        "wind 4.3 m/s [3.9, 4.8] 90 %; area weight: not told by this clip; 0.10 to 0.17 kg/m² is what was assumed"
    )
    assert sentence([UNTOLD], level=0.9).startswith("area weight: not told")


def test_the_weight_of_a_small_flag_is_told_to_a_gram() -> None:
    small = Quantity(
        name="density", unit="kg/m²", value=0.0325, sigma=0.003, low=0.028, high=0.038, assumed=(0.025, 0.0425),
        information=0.4,
    )  # fmt: skip
    assert small.phrase(level=0.9, first=False) == "area weight 0.033 kg/m² [0.028, 0.038]"


def test_information_is_the_divergence_of_gaussians() -> None:
    rng = stream(1, "information")
    prior = rng.normal(0, 2, 200_000)
    # ½ (σ²/τ² − 1 − ln σ²/τ² + m²/τ²) with σ = 1, τ = 2, m = 1.
    assert information(rng.normal(1, 1, 200_000), prior) == pytest.approx(
        0.5 * (0.25 - 1 - np.log(0.25) + 0.25), abs=0.01
    )
    assert information(prior, prior) == pytest.approx(0, abs=1e-12)


def test_a_posterior_that_is_the_prior_tells_nothing_and_a_narrow_one_does() -> None:
    rng = stream(2, "told")
    prior = rng.uniform(0.1, 0.17, size=(5000, 1))
    assumed = np.array([[0.1, 0.17]])
    same = quantities(rng.uniform(0.1, 0.17, size=(400, 1)), prior, ["density"], level=0.9, assumed=assumed)
    assert not same[0].told
    narrow = quantities(rng.normal(0.13, 0.01, size=(400, 1)), prior, ["density"], level=0.9, assumed=assumed)
    assert narrow[0].told


def test_the_interval_holds_its_share_of_the_draws() -> None:
    draws = np.linspace(0, 1, 1001)[:, None]
    found = quantities(draws, draws, ["wind_speed"], level=0.8, assumed=np.array([[0.0, 10.0]]))[0]
    assert (found.low, found.high) == (pytest.approx(0.1), pytest.approx(0.9))
    with pytest.raises(InputError, match="between 0 and 1"):
        quantities(draws, draws, ["wind_speed"], level=1.0, assumed=np.array([[0.0, 10.0]]))
