"""Axes and lines of the charts."""

from __future__ import annotations

import itertools
import math
import re

import numpy as np
import pytest

from measure.report.chart import (
    Linear,
    Logarithmic,
    path_through,
    room_below,
    room_beside,
    thin_line,
)


def test_a_linear_axis_maps_its_ends_and_its_middle() -> None:
    scale = Linear(2.0, 6.0, 100.0, 20.0)
    assert [scale(v) for v in (2.0, 4.0, 6.0)] == [100.0, 60.0, 20.0]


def test_a_logarithmic_axis_gives_equal_ratios_equal_lengths() -> None:
    scale = Logarithmic(0.01, 100.0, 0.0, 400.0)
    assert np.diff([scale(v) for v in (0.01, 0.1, 1.0, 10.0, 100.0)]) == pytest.approx([100.0] * 4)


@pytest.mark.parametrize("length", [40.0, 90.0, 240.0, 560.0])
@pytest.mark.parametrize(
    ("low", "high"), [(0.0, 1.0), (-3.2e-5, 7.7e-5), (0.0, 41.27), (1999.0, 2003.5), (-9e7, 4e7)]
)
def test_labels_have_room_and_stand_at_round_values_within_the_axis(
    low: float, high: float, length: float
) -> None:
    scale = Linear(low, high, 0.0, length)
    for room in (room_beside, room_below):
        ticks = scale.ticks(room)
        values = [v for v, _ in ticks]
        assert all(
            low <= v <= high or math.isclose(v, low) or math.isclose(v, high) for v in values
        )
        for (a, first), (b, second) in itertools.pairwise(ticks):
            assert scale(b) - scale(a) >= (room(first) + room(second)) / 2 - 1e-6
        steps = {f"{b - a:.6e}"[:3] for a, b in itertools.pairwise(values)}
        assert steps <= {"1.0", "2.0", "5.0"}


@pytest.mark.parametrize(("low", "high"), [(1e-9, 1e-3), (0.12, 0.9), (0.3, 4.0), (1e-2, 1e12)])
def test_decades_are_labelled_as_far_as_there_is_room(low: float, high: float) -> None:
    scale = Logarithmic(low, high, 0.0, 300.0)
    ticks = scale.ticks(room_beside)
    assert ticks
    for (a, first), (b, second) in itertools.pairwise(ticks):
        assert scale(b) - scale(a) >= (room_beside(first) + room_beside(second)) / 2 - 1e-6


def test_an_axis_over_nothing_or_one_value_still_has_a_length() -> None:
    for values in ([], [math.nan], [3.0], [0.0, 0.0]):
        for scale in (Linear.over(values, 0.0, 100.0), Logarithmic.over(values, 0.0, 100.0)):
            assert scale.high > scale.low


def test_a_dense_line_keeps_its_peaks() -> None:
    times = np.linspace(0, 10, 20_000)
    values = np.zeros_like(times)
    values[12_345] = 1.0
    axes = (Linear(0, 10, 0, 500), times.tolist()), (Linear(0, 1, 100, 0), values.tolist())
    xs, ys = thin_line(axes)
    assert len(xs) <= 1000
    assert min(ys) == 0.0
    assert xs[int(np.argmin(ys))] == pytest.approx(times[12_345] * 50)


def test_a_line_is_lifted_where_a_value_is_missing() -> None:
    path = path_through([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 1.0, math.nan, 1.0, 0.0])
    assert re.findall("[ML]", path) == ["M", "L", "M", "L"]
