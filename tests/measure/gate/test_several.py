"""How many strange windows refuse a recording: the stated rate holds whatever the windows have in
common."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.special import ndtr, ndtri

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.errors import InputError
from measure.gate.gate_verdict import refused_share, refusing, window_rate

RATE = 0.05
RECORDINGS = 40_000
SLACK = 3 * np.sqrt(RATE * (1 - RATE) / RECORDINGS)


def refused(scores: FloatArray) -> float:
    """Share of recordings that are refused, of normal scores (recording, window)."""
    windows = scores.shape[1]
    strange = ndtr(scores) <= window_rate(windows, RATE)
    return float((strange.sum(axis=1) >= refusing(windows)).mean())


def test_more_than_a_quarter_refuses_and_two_at_least_where_there_are_two() -> None:
    assert [refusing(windows) for windows in (1, 2, 3, 4, 7, 8, 11, 12, 100)] == [
        1,
        2,
        2,
        2,
        2,
        3,
        3,
        4,
        26,
    ]


@pytest.mark.parametrize("windows", [1, 2, 5, 7, 30])
@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.85, 0.97, 1.0])
def test_windows_that_are_alike_by_any_degree_keep_the_rate(
    windows: int, correlation: float
) -> None:
    rng = stream(1, "alike", windows)
    shared, own = rng.normal(size=(RECORDINGS, 1)), rng.normal(size=(RECORDINGS, windows))
    assert refused(np.sqrt(correlation) * shared + np.sqrt(1 - correlation) * own) <= RATE + SLACK


@pytest.mark.parametrize("memory", [0.9, 0.975])
def test_windows_that_are_the_more_alike_the_nearer_they_are_keep_the_rate(memory: float) -> None:
    noise = stream(2, "neighbours").normal(size=(RECORDINGS, 30))
    noise[:, 0] /= np.sqrt(1 - memory**2)  # stationary from the start
    assert refused(lfilter([np.sqrt(1 - memory**2)], [1, -memory], noise, axis=1)) <= RATE + SLACK


def test_however_many_sizes_are_tried_a_recording_of_one_of_them_keeps_the_rate() -> None:
    """It is refused where it is refused at every size: at others it may be as strange as can be, or
    less than at its own."""
    rng = stream(3, "sizes")
    own = np.sqrt(0.7) * rng.normal(size=(RECORDINGS, 1)) + np.sqrt(0.3) * rng.normal(
        size=(RECORDINGS, 8)
    )
    level, needed = window_rate(8, RATE), refusing(8)
    at = [(ndtr(own + shift) <= level).sum(axis=1) >= needed for shift in (-10.0, -0.5, 0.0, 0.5)]
    assert float(np.all(at, axis=0).mean()) <= RATE + SLACK


def test_the_rate_of_one_window_is_its_own_and_that_of_many_follows_the_formula() -> None:
    assert window_rate(1, RATE) == RATE
    assert window_rate(3, RATE) == RATE  # the median of three
    many = window_rate(4000, RATE)
    assert ndtri(many) == pytest.approx(
        -np.sqrt(ndtri(RATE / 1.15) ** 2 + ndtri(0.25) ** 2), abs=0.01
    )
    assert refused_share(many, 4000) == pytest.approx(RATE / 1.15, rel=1e-3)


def test_no_correlation_is_left_out_at_which_more_are_refused() -> None:
    """Two of four independent windows are strange with the probability of the binomial
    distribution, two that are the same with that of one."""
    assert refused_share(0.4, 4) == pytest.approx(1 - 0.6**4 - 4 * 0.4 * 0.6**3)
    assert refused_share(0.4, 2) == pytest.approx(0.4)


@pytest.mark.parametrize(("windows", "rate"), [(0, 0.05), (3, 0.0), (3, 1.0)])
def test_a_rate_that_is_none_is_refused(windows: int, rate: float) -> None:
    with pytest.raises(InputError, match="false-alarm rate"):
        window_rate(windows, rate)
