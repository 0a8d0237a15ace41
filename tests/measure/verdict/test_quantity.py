"""How numbers are written."""

from __future__ import annotations

import math

import pytest

from flagdata.answer import Quantity
from measure.verdict import (
    display,
    estimate_text,
    in_errors,
    number,
    probability,
    share,
    with_error,
    with_level,
)


def estimate(
    value: float, low: float, high: float, unit: str = "1", level: float = 0.9
) -> Quantity:
    return Quantity.of(value=value, low=low, high=high, unit=unit, level=level)


@pytest.mark.parametrize(("error", "text"), [(0.119, "0.83 ± 0.12"), (0.367, "0.8 ± 0.4")])
def test_digits_follow_the_particle_data_groups_examples(error: float, text: str) -> None:
    """Review of Particle Physics, Introduction, 5.3: 0.827 with either error."""
    assert with_error(0.827, error) == text


def test_an_uncertainty_that_rounds_up_keeps_two_digits() -> None:
    """Same section: 950–999 are rounded up to 1000, of which two digits are kept."""
    assert with_error(0.827, 0.0967) == "0.83 ± 0.10"


def test_the_house_example_of_a_wind_with_its_interval() -> None:
    assert with_level(estimate(6.24, 5.71, 6.78, "m/s")) == "6.2 m/s [5.7, 6.8] 90 %"


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (estimate(0.0042, 0.00399, 0.00441, "m"), "4.20 mm [3.99, 4.41]"),
        (estimate(0.040557, 0.040526, 0.040583, "m"), "40.56 mm [40.53, 40.58]"),
        (estimate(12345, 11000, 13700, "Pa"), "12300 Pa [11000, 13700]"),
        (estimate(-0.023, -0.031, -0.009, "s"), "−23 ms [−31, −9]"),
        (estimate(0.0003, -0.41, 0.44), "0.0 [−0.4, 0.4]"),
        (
            estimate(3.1e-5, 2.8e-5, 3.4e-5, "m/(s Pa)"),
            "3.10 × 10⁻⁵ m/(s Pa) [2.80 × 10⁻⁵, 3.40 × 10⁻⁵]",
        ),
        (estimate(2e7, 1e7, 3e7, "N"), "2.0 × 10⁷ N [1.0 × 10⁷, 3.0 × 10⁷]"),
        (estimate(0.62, 0.54, math.inf), "0.620 [0.540, ∞]"),
        (estimate(1.0, math.nan, math.nan, "m"), "1.00 m"),
        (estimate(math.nan, 1.0, 2.0, "m"), "—"),
        (None, "—"),
    ],
)
def test_intervals_worked_by_hand(given: Quantity | None, text: str) -> None:
    assert estimate_text(given) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (9.996, "10.0"),
        (-41.27, "−41.3"),
        (1234.0, "1230"),
        (1.5e-6, "1.50 × 10⁻⁶"),
        (-math.inf, "−∞"),
        (math.nan, "—"),
        (None, "—"),
    ],
)
def test_numbers_without_an_uncertainty_have_three_digits_and_a_real_minus(
    value: float | None, text: str
) -> None:
    assert number(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(1.0, "1.0"), (0.347, "0.35"), (0.005, "0.0050"), (0.0004, "4 × 10⁻⁴"), (math.nan, "—")],
)
def test_p_values_have_two_digits_and_one_where_they_are_tiny(value: float, text: str) -> None:
    assert probability(value) == text


def test_standard_errors_and_shares_have_fixed_decimals() -> None:
    assert [in_errors(v) for v in (-0.04, -1.26, 9.94, 9.96, 123.4)] == [
        "0.0",
        "−1.3",
        "9.9",
        "10",
        "123",
    ]
    assert [share(v) for v in (0.944, -0.0049, 1.0, None)] == ["0.94", "0.00", "1.00", "—"]


def test_lengths_turn_to_millimetres_only_where_all_of_them_are_small() -> None:
    assert (display([0.004, 0.09], "m").unit, display([0.004, 0.11], "m").unit) == ("mm", "m")
    assert display([0.004], "m/s").unit == "m/s"
    assert display([], "m").unit == "m"
