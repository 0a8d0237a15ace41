"""A quantity in words: its value, its bound, or what was assumed of it, each with its level
once."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from flagdata.answer import Bound, Quantity, Span

WHOLE = Quantity(
    name="wind_speed",
    unit="m/s",
    value=4.336,
    sigma=0.3,
    span=Span(low=3.9, high=4.812, level=0.9, bound=None, estimated=True),
    assumed=(0.0, 10.0),
)
LEAST = replace(
    WHOLE,
    value=None,
    span=Span(low=9.4, high=math.inf, level=0.95, bound=Bound.LEAST, estimated=False),
)


@pytest.mark.parametrize(
    ("quantity", "text", "with_level"),
    [
        (WHOLE, "4.34 [3.9, 4.81] m/s", "4.34 [3.9, 4.81] m/s, 90 %"),
        (LEAST, "at least 9.4 m/s, 95 %", "at least 9.4 m/s, 95 %"),
        (replace(WHOLE, constrained=False), "not determined (assumed: 0 to 10 m/s)", None),
        (replace(WHOLE, constrained=False, given=True), "0 to 10 m/s, as given", None),
        (
            replace(WHOLE, constrained=False, given=True, assumed=(4.0, 4.0)),
            "4 m/s, as given",
            None,
        ),
        (replace(WHOLE, constrained=False, assumed=None), "not determined", None),
        (replace(WHOLE, value=None), "not determined (assumed: 0 to 10 m/s)", None),
        (replace(WHOLE, unit="1"), "4.34 [3.9, 4.81]", "4.34 [3.9, 4.81], 90 %"),
    ],
)
def test_a_quantity_is_phrased_with_its_level_once(
    quantity: Quantity, text: str, with_level: str | None
) -> None:
    assert quantity.text == text
    assert quantity.text_with_level == (with_level or text)


def test_a_value_beside_a_bound_keeps_its_interval() -> None:
    """Calm air: nothing lies beyond the end, so that the mean is an estimate."""
    span = Span(low=0.0, high=0.5, level=0.95, bound=Bound.MOST, estimated=True)
    assert replace(WHOLE, value=0.2, span=span).text == "0.2 [0, 0.5] m/s"
