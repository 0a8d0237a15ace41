"""Numbers that a user states."""

from __future__ import annotations

import math

import click
import numpy as np
import pytest

from flagdata.core.stated import Stated, parse
from flagdata.errors import UsageError
from flagdata.verbs.option_types import STATED
from tests.refusals import unrefused


def test_a_value_a_value_with_its_deviation_and_a_range_are_read_and_written_as_they_were() -> None:
    cases = {
        "0.284": (0.284, 0.284, 0.0, 0.284), "0.284±0.01": (0.284, 0.284, 0.01, {"value": 0.284, "sigma": 0.01}),
        " 0.284 +- 0.01 ": (0.284, 0.284, 0.01, {"value": 0.284, "sigma": 0.01}),
        "0.27:0.30": (0.27, 0.30, 0.0, [0.27, 0.30]), "-1:.5": (-1.0, 0.5, 0.0, [-1.0, 0.5]),
        "2e-1": (0.2, 0.2, 0.0, 0.2),
    }  # fmt: skip
    for text, (low, high, sigma, recipe) in cases.items():
        found = parse(text)
        assert (found.low, found.high, found.sigma, found.recipe()) == (low, high, sigma, recipe), (
            text
        )
        assert parse(found.text) == found
        assert Stated.of(text) == STATED.convert(text, None, None) == found
    assert parse("0.284").exact
    assert not parse("0.284±0.01").exact
    assert Stated.of(0.2) == parse("0.2")
    assert Stated.of((0.1, 0.2)) == parse("0.1:0.2")
    assert parse("0.284±0.01").within(2.0) == pytest.approx((0.264, 0.304))


def test_a_statement_has_a_middle_a_deviation_and_draws_of_these() -> None:
    for text, middle, deviation in (
        ("0.2", 0.2, 0.0),
        ("0.2±0.01", 0.2, 0.01),
        ("0.27:0.30", 0.285, 0.03 / math.sqrt(12)),
    ):
        stated = parse(text)
        assert (stated.middle, stated.deviation) == pytest.approx((middle, deviation))
        drawn = stated.draw(np.random.default_rng(1), 20_000)
        assert (drawn.mean(), drawn.std()) == pytest.approx((middle, deviation), abs=3e-4)
        assert text != "0.27:0.30" or (drawn.min() >= 0.27 and drawn.max() <= 0.30)


def test_other_texts_are_refused_with_the_forms_that_are_read() -> None:
    texts = [
        "",
        "heavy",
        "0.3:0.2",
        "0.2:0.2",
        "0.2±0",
        "0.2±-1",
        "0.1:0.2±0.1",
        "1:2:3",
        "nan",
        "inf",
        "1e999",
        "284g",
    ]
    assert unrefused(parse, [(text, "0.28±0.01") for text in texts], UsageError) == []
    with pytest.raises(click.BadParameter, match=r"0\.27:0\.30"):
        STATED.convert("light", None, None)
