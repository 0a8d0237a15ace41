"""A refinement of a flag of another size: what was found of the simulated one scales with the
flag."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flagdata.answer import Bound, Span
from flagdata.core.json_values import json_values
from flagdata.core.stated import parse
from measure.estimate import Options
from measure.estimate.refined import _searched_range, refine_window, scale_refinement
from measure.refine import Clip, Refined, Refinement, Round
from measure.refine.refinement import phrase
from models.networks.targets import Cloth

NOTHING: Any = None


def interval(name: str, median: float, half: float) -> Refined:
    own = Span(low=median - half, high=median + half, level=0.9, bound=None, estimated=True)
    return Refined(name=name, unit="", value=median, sigma=None, span=own, prior_share=0.5)


@pytest.fixture
def found() -> Refinement:
    intervals = (
        interval("wind_speed", 4.0, 0.5),
        interval("area_weight", 0.12, 0.01),
        interval("bending_scale", -4.0, 0.2),
        interval("anisotropy", 0.3, 0.1),
        interval("nonlinearity", -0.2, 0.1),
        interval("wind_speed.1", 6.0, 1.0),
    )
    step = Round(evaluations=28, distance=2.0, floor=1.0, intervals=intervals[:2], seconds=3.0)
    return Refinement(
        targets=(),
        level=0.9,
        intervals=intervals,
        amortised=intervals[:4],
        bending=np.full((15, 3), 1e-4),
        rounds=(step,),
        traces=(),
        floor=1.0,
        reached=True,
        stopped="",
        posterior=NOTHING,
        evaluators=(),
        seconds={},
        findings=(),
        seed=1,
    )


def test_a_flag_four_times_as_long_has_twice_the_wind_four_times_the_weight_and_4_to_the_4th_the_stiffness(
    found: Refinement,
) -> None:
    """Froude number U²/(gL), mass ratio ρ_s/(ρ_air L) and B/(ρ_air U² L³) are those of the
    simulated flag."""
    larger = scale_refinement(found, 4.0)
    by_name = {entry.name: entry for entry in larger.intervals}
    assert (by_name["wind_speed"].value, by_name["wind_speed"].span.high) == (8.0, 9.0)
    assert by_name["wind_speed.1"].span.low == 10.0
    assert by_name["area_weight"].value == pytest.approx(0.48)
    assert by_name["bending_scale"].value == pytest.approx(-4.0 + math.log10(256))
    assert by_name["bending_scale"].span.high - by_name["bending_scale"].span.low == pytest.approx(
        0.4
    )
    np.testing.assert_allclose(larger.bending, 256e-4)


def test_a_bound_scales_and_stays_one(found: Refinement) -> None:
    least = Span(low=9.4, high=math.inf, level=0.95, bound=Bound.LEAST, estimated=False)
    strong = replace(found.intervals[0], value=None, span=least)
    larger = scale_refinement(replace(found, intervals=(strong, *found.intervals[1:])), 4.0)
    assert larger.intervals[0].span == replace(least, low=18.8)
    interval = json_values(larger.intervals[0])
    assert (interval["median"], interval["low"], interval["high"], interval["bound"]) == (
        None,
        18.8,
        None,
        "at-least",
    )
    assert phrase(larger.intervals[0], 2, " m/s") == "at least 18.80 m/s"


def test_what_has_no_size_stays(found: Refinement) -> None:
    before = {entry.name: entry for entry in found.intervals}
    after = {entry.name: entry for entry in scale_refinement(found, 0.5).intervals}
    for name in ("anisotropy", "nonlinearity"):
        assert after[name] == before[name]


def test_rounds_and_the_networks_first_estimate_scale_alike(found: Refinement) -> None:
    larger = scale_refinement(found, 4.0)
    assert larger.amortised == larger.intervals[:4]
    assert larger.rounds == (replace(found.rounds[0], intervals=larger.intervals[:2]),)


def test_a_flag_of_the_simulated_size_is_left_as_it_is(found: Refinement) -> None:
    assert scale_refinement(found, 1.0) is found


def test_the_view_that_a_record_states_is_that_of_the_simulated_clips_whatever_part_of_the_picture_is_judged(
    found: Refinement, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[Clip] = []
    monkeypatch.setattr(
        "measure.estimate.refined.run", lambda clips, *_, **__: given.extend(clips) or found
    )
    recording: Any = object()
    measured: Any = SimpleNamespace(
        film="flag",
        clip=np.zeros((2, 4, 4), np.uint8),
        options=Options(),
        sizes=SimpleNamespace(scale=np.array([1.0])),
    )
    cut: Any = SimpleNamespace(artifact=recording)
    model: Any = SimpleNamespace(cloth=Cloth.FLAG)
    refine_window(measured, cut, model, budget=20, cache=None)
    assert given[0].recording is recording


def test_an_area_weight_is_searched_as_a_range_at_the_size_that_is_simulated() -> None:
    # Two standard deviations either way, 1 % of a value; a flag twice as long weighs twice as much.
    for text, scale, ends in (
        ("0.12:0.15", 1.0, (0.12, 0.15)),
        ("0.28±0.01", 2.0, (0.13, 0.15)),
        ("0.2", 1.0, (0.198, 0.202)),
    ):
        searched = _searched_range(parse(text), scale)
        assert (searched.low, searched.high, searched.sigma) == pytest.approx((*ends, 0.0))
