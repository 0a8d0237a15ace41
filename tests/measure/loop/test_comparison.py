"""When a named effect has failed on unseen data, when its control is as good, and when it stands."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import t as student

from measure.loop.comparison import Trial, folds, paired, total_error
from measure.loop.forecast import Segments
from measure.loop.verdict import Comparison, Estimate
from measure.observe.trajectory import Specimen, Trajectory, WindTrack

RNG = np.random.default_rng(1)
NOISE = RNG.standard_normal(12)
NOISE = (NOISE - NOISE.mean()) / NOISE.std(ddof=1)


def around(mean: float) -> np.ndarray:
    """Twelve segments of this mean and standard deviation 1: a standard error of the sum of √12."""
    return mean + NOISE


def trial(helped: float, apart: float | None) -> Trial:
    one = Estimate(value=1.0, low=0.9, high=1.1, unit="m", level=0.9)
    comparison = Comparison(
        what="unseen", frames=1, before=one, after=one, reduction=one, floor=one, oracle=None, share=None, control=None,
        control_name="",
    )  # fmt: skip
    return Trial(
        comparisons=(comparison,), helped=around(helped), apart=None if apart is None else around(apart),
        recording=np.zeros(12, dtype=np.int64),
    )  # fmt: skip


# Two standard errors of the sum of twelve are 2 √12 = 12 · 0.577.
@pytest.mark.parametrize(
    ("helped", "apart", "failed", "tied"),
    [
        (1.0, 0.6, False, False),
        (1.0, 0.55, False, True),
        (1.0, -0.55, False, True),
        (1.0, -0.6, True, True),
        (-0.1, 0.6, True, False),
        (1.0, None, False, False),
    ],
)
def test_two_standard_errors_decide(helped: float, apart: float | None, failed: bool, tied: bool) -> None:
    found = trial(helped, apart)
    assert (found.failed, found.tied) == (failed, tied)


def test_errors_that_are_not_finite_have_failed() -> None:
    helped = around(1.0)
    helped[3] = np.nan
    assert Trial(comparisons=trial(1.0, 1.0).comparisons, helped=helped).failed


@pytest.mark.parametrize(("frames", "each", "late"), [(250, 4, 2), (202, 3, 1), (450, 8, 2), (500, 9, 3)])
def test_two_segments_of_four_are_late_and_a_third_of_more(
    specimen: Specimen, frames: int, each: int, late: int
) -> None:
    """Of 2 s at 25 frames a second, after 8 frames; with one alone a recording's chance would not show."""
    wind = WindTrack.constant((4.0, 0.0, 0.0))
    still = np.zeros((frames, specimen.mesh.vertex_count, 3))
    own = [Trajectory(name=n, markers=specimen.mesh.rest, positions=still, rate=25.0, wind=wind) for n in ("a", "b")]
    segments = Segments.of(own)
    assert len(segments) == 2 * each
    *apart, last = folds(segments, [4.0, 4.0])
    np.testing.assert_array_equal([fold.outside for fold in apart], [segments.recording == k for k in (0, 1)])
    np.testing.assert_array_equal(last.outside, np.tile(np.arange(each) >= each - late, 2))


def test_what_differs_between_recordings_is_no_error() -> None:
    """Three recordings of four segments with a standard deviation of 1 each about means far apart: √(3 · 4)."""
    own = np.array([-1.0, 1.0, -1.0, 1.0]) * np.sqrt(3 / 4)
    values = np.concatenate([own, 50 + own, -20 + own])
    assert total_error(values, np.repeat([0, 1, 2], 4)) == pytest.approx(np.sqrt(12), rel=1e-12)


def test_of_a_recording_with_one_segment_the_error_is_that_of_all() -> None:
    values = np.array([1.0, 3.0, 8.0])
    # Standard deviation √13 of 1, 3, 8 about 4; times √3.
    assert total_error(values, np.array([0, 0, 1])) == pytest.approx(np.sqrt(39), rel=1e-12)
    assert total_error(values[:1], np.array([0])) == np.inf


def test_no_trial_neither_fails_nor_ties() -> None:
    assert not Trial().failed
    assert not Trial().tied


def test_a_paired_reduction_is_the_difference_of_roots_with_students_interval() -> None:
    before, after = np.full(12, 4e-4), np.full(12, 1e-4) + 1e-5 * NOISE
    found = paired(before, after)
    assert found.value == pytest.approx(0.02 - 0.01, rel=1e-12)
    # d√x = dx/(2√x), here by the secant between the two roots: 1/(0.02 + 0.01).
    reach = student.ppf(0.95, 11) * 1e-5 / 12**0.5 / 0.03
    assert found.high - found.value == pytest.approx(reach, rel=1e-9)
