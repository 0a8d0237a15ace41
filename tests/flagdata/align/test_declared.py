"""Clocks that someone vouches for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flagdata.align import given
from flagdata.align.declared import by_stamps, stamp_sigma, stamp_step
from flagdata.core.clock_model import ClockModel, Segment
from flagdata.errors import InputError, UsageError
from tests.refusals import unrefused

SECOND = S = 1_000_000_000
SPAN = {"start": 1_000 * SECOND, "end": 1_600 * SECOND}


def test_a_given_offset_moves_every_instant_by_as_much() -> None:
    model = given("cam", "mast", offset=-3.25, sigma=0.4, **SPAN)
    times = np.array([1_000, 1_300, 1_599], dtype=np.int64) * SECOND
    np.testing.assert_array_equal(model.to_common(times), times - 3_250_000_000)


def test_uncertainty_grows_away_from_the_middle_by_the_rate_of_quartz() -> None:
    model = given("cam", "mast", offset=0.0, sigma=0.4, **SPAN)
    # 3e-5 s/s, ±50 ppm rectangular, over 300 s is 9 ms.
    sigma = model.sigma(np.array([1_300, 1_600], dtype=np.int64) * SECOND)
    assert sigma[0] == pytest.approx(0.4, rel=1e-12)
    assert sigma[1] == pytest.approx(math.hypot(0.4, 0.009), rel=1e-12)


def test_stamps_leave_instants_as_they_are() -> None:
    model = by_stamps("cam", "mast", sigma=0.5, **SPAN)
    assert model.method == "stamps"
    assert model.to_common(np.int64(1_234)) == 1_234


def test_nobody_can_vouch_for_an_offset_without_an_uncertainty() -> None:
    cases = [0.0, -1.0, math.inf, math.nan]
    assert (
        unrefused(
            lambda sigma: by_stamps("cam", "mast", sigma=sigma, **SPAN),
            zip(cases),
            UsageError,
            "uncertainty",
        )
        == []
    )


def test_an_offset_that_is_no_number_is_refused() -> None:
    with pytest.raises(UsageError, match="clock offset"):
        given("cam", "mast", offset=math.inf, sigma=1.0, **SPAN)


@pytest.mark.parametrize(
    ("stamps", "step"),
    [
        ([0, 60, 120], 60.0),
        ([0, 1, 2, 7], 1.0),
        ([0, 0.1, 0.3], 0.1),
        ([0, 0.123], 0.001),
        ([0, 0.000_5], 0.0),
    ],
)
def test_the_step_of_stamps_is_the_coarsest_that_divides_them(
    stamps: list[float], step: float
) -> None:
    time = np.array([round(s * SECOND) for s in stamps], dtype=np.int64)
    assert stamp_step(time) == step
    assert stamp_sigma(time) == pytest.approx(step / math.sqrt(12))


def test_no_stamps_have_no_step() -> None:
    with pytest.raises(InputError, match="no stamps"):
        stamp_step(np.zeros(0, dtype=np.int64))


def test_a_model_reads_back_as_it_was_written() -> None:
    model = ClockModel(
        device="cam",
        reference="mast",
        method="estimated",
        confidence=0.97,
        segments=(
            Segment(
                start=0,
                end=10,
                origin=5,
                offset=1.5,
                drift=1e-5,
                sigma_offset=0.1,
                sigma_drift=1e-6,
            ),
            Segment(start=10, end=20, origin=15, offset=-2.0),
        ),
    )
    assert ClockModel.from_json(model.to_json()) == model


def test_segments_apply_from_their_start_and_the_nearest_beyond_all() -> None:
    model = ClockModel(
        device="cam",
        reference="mast",
        method="given",
        confidence=1.0,
        segments=(
            Segment(start=10 * SECOND, end=20 * SECOND, origin=15 * SECOND, offset=1.0, drift=0.01),
            Segment(start=20 * SECOND, end=30 * SECOND, origin=20 * SECOND, offset=5.0),
        ),
    )
    times = np.array([0, 15, 20, 40], dtype=np.int64) * SECOND
    # By hand: 0 + 1 - 0.15; 15 + 1; 20 + 5; 40 + 5.
    np.testing.assert_array_equal(
        model.to_common(times), np.array([850, 16_000, 25_000, 45_000]) * 1_000_000
    )


def test_models_without_order_are_refused() -> None:
    cases = [
        (),
        (
            Segment(start=0, end=10, origin=0, offset=0.0),
            Segment(start=5, end=20, origin=0, offset=0.0),
        ),
    ]
    assert (
        unrefused(
            lambda segments: ClockModel(
                device="a", reference="b", method="given", confidence=1.0, segments=segments
            ),
            zip(cases),
            InputError,
        )
        == []
    )


@pytest.mark.parametrize(
    "wrong",
    [{"end": 0}, {"offset": math.nan}, {"sigma_offset": -1.0}, {"drift": 0.5}],
)
def test_segments_that_are_no_clock_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError):
        Segment(**{"start": 0, "end": 10, "origin": 0, "offset": 0.0, **wrong})  # type: ignore[arg-type]


def model(*segments: Segment) -> ClockModel:
    return ClockModel(
        device="camera", reference="wind", method="given", confidence=1.0, segments=segments
    )


def test_offset_and_drift_add_up() -> None:
    """2 s + 50 ppm over 1000 s = 2.05 s."""
    clock = model(Segment(start=0, end=10_000 * S, origin=0, offset=2.0, drift=50e-6))
    assert clock.to_common(1000 * S) == 1000 * S + 2_050_000_000


def test_uncertainty_grows_away_from_the_origin() -> None:
    """hypot(0.3, 1e-3 · 400) = 0.5."""
    clock = model(
        Segment(
            start=0, end=1000 * S, origin=500 * S, offset=0.0, sigma_offset=0.3, sigma_drift=1e-3
        )
    )
    assert clock.sigma(np.array([500 * S, 900 * S, 100 * S])) == pytest.approx([0.3, 0.5, 0.5])


def test_each_time_uses_its_own_segment() -> None:
    clock = model(
        Segment(start=0, end=100 * S, origin=0, offset=1.0),
        Segment(start=100 * S, end=200 * S, origin=0, offset=-1.0),
    )
    times = np.array([50, 100, 150]) * S
    assert clock.to_common(times).tolist() == [51 * S, 99 * S, 149 * S]


def test_nanoseconds_survive_at_the_present_epoch() -> None:
    """Float64 holds 1.7e18 ns only to 256 ns; the model must not go through it."""
    now = 1_763_000_000_000_000_001
    assert int(model(Segment(start=0, end=2 * now, origin=now, offset=0.0)).to_common(now)) == now
