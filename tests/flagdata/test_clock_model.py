"""Clock models: offset, drift and segments, against arithmetic done by hand."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.align.clock import ClockModel, Segment
from flagdata.errors import InputError

S = 10**9


def model(*segments: Segment) -> ClockModel:
    return ClockModel(device="camera", reference="wind", method="given", confidence=1.0, segments=segments)


def test_offset_and_drift_add_up() -> None:
    """2 s + 50 ppm over 1000 s = 2.05 s."""
    clock = model(Segment(start=0, end=10_000 * S, origin=0, offset=2.0, drift=50e-6))
    assert clock.to_common(1000 * S) == 1000 * S + 2_050_000_000


def test_uncertainty_grows_away_from_the_origin() -> None:
    """hypot(0.3, 1e-3 · 400) = 0.5."""
    clock = model(Segment(start=0, end=1000 * S, origin=500 * S, offset=0.0, sigma_offset=0.3, sigma_drift=1e-3))
    assert clock.sigma(np.array([500 * S, 900 * S, 100 * S])) == pytest.approx([0.3, 0.5, 0.5])


def test_each_time_uses_its_own_segment() -> None:
    clock = model(
        Segment(start=0, end=100 * S, origin=0, offset=1.0), Segment(start=100 * S, end=200 * S, origin=0, offset=-1.0)
    )
    times = np.array([50, 100, 150]) * S
    assert clock.to_common(times).tolist() == [51 * S, 99 * S, 149 * S]


def test_nanoseconds_survive_at_the_present_epoch() -> None:
    """Float64 holds 1.7e18 ns only to 256 ns; the model must not go through it."""
    now = 1_763_000_000_000_000_001
    assert int(model(Segment(start=0, end=2 * now, origin=now, offset=0.0)).to_common(now)) == now


def test_json_round_trip() -> None:
    clock = model(Segment(start=0, end=5, origin=2, offset=0.1, drift=1e-6, sigma_offset=0.2, sigma_drift=1e-7))
    assert ClockModel.from_json(clock.to_json()) == clock


@pytest.mark.parametrize(
    ("start", "end", "offset", "sigma", "drift"),
    [(0, 0, 0.0, 0.0, 0.0), (0, 1, float("nan"), 0.0, 0.0), (0, 1, 0.0, -1.0, 0.0), (0, 1, 0.0, 0.0, 0.5)],
)
def test_impossible_segments_are_refused(start: int, end: int, offset: float, sigma: float, drift: float) -> None:
    with pytest.raises(InputError):
        Segment(start=start, end=end, origin=0, offset=offset, sigma_offset=sigma, drift=drift)


def test_overlapping_segments_are_refused() -> None:
    with pytest.raises(InputError, match="overlap"):
        model(Segment(start=0, end=10, origin=0, offset=0.0), Segment(start=5, end=20, origin=0, offset=0.0))
