"""What is left out together, and how errors on unseen data are compared."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import t as student

from measure.forecasting import Segments
from measure.loop import folds, paired_difference, total_error
from measure.trajectories import Specimen, Trajectory, WindTrack

RNG = np.random.default_rng(1)
NOISE = RNG.standard_normal(12)
NOISE = (NOISE - NOISE.mean()) / NOISE.std(ddof=1)


@pytest.mark.parametrize(
    ("frames", "each", "late"), [(250, 4, 2), (202, 3, 1), (450, 8, 2), (500, 9, 3)]
)
def test_two_segments_of_four_are_late_and_a_third_of_more(
    specimen: Specimen, frames: int, each: int, late: int
) -> None:
    """Of 2 s at 25 frames a second, after 8 frames; with one alone a recording's chance would not
    show."""
    wind = WindTrack.constant((4.0, 0.0, 0.0))
    still = np.zeros((frames, specimen.mesh.vertex_count, 3))
    own = [
        Trajectory(name=n, markers=specimen.mesh.rest, positions=still, rate=25.0, wind=wind)
        for n in ("a", "b")
    ]
    segments = Segments.of(own)
    assert len(segments) == 2 * each
    *apart, last = folds(segments, [4.0, 4.0])
    np.testing.assert_array_equal(
        [fold.outside for fold in apart], [segments.recording == k for k in (0, 1)]
    )
    np.testing.assert_array_equal(last.outside, np.tile(np.arange(each) >= each - late, 2))


def test_what_differs_between_recordings_is_no_error() -> None:
    """Three recordings of four segments with a standard deviation of 1 each about means far apart:
    √(3 · 4)."""
    own = np.array([-1.0, 1.0, -1.0, 1.0]) * np.sqrt(3 / 4)
    values = np.concatenate([own, 50 + own, -20 + own])
    assert total_error(values, np.repeat([0, 1, 2], 4)) == pytest.approx(np.sqrt(12), rel=1e-12)


def test_of_a_recording_with_one_segment_the_error_is_that_of_all() -> None:
    values = np.array([1.0, 3.0, 8.0])
    # Standard deviation √13 of 1, 3, 8 about 4; times √3.
    assert total_error(values, np.array([0, 0, 1])) == pytest.approx(np.sqrt(39), rel=1e-12)
    assert total_error(values[:1], np.array([0])) == np.inf


def test_a_paired_reduction_is_the_difference_of_roots_with_students_interval() -> None:
    before, after = np.full(12, 4e-4), np.full(12, 1e-4) + 1e-5 * NOISE
    found = paired_difference(before, after)
    assert found.value == pytest.approx(0.02 - 0.01, rel=1e-12)
    # d√x = dx/(2√x), here by the secant between the two roots: 1/(0.02 + 0.01).
    reach = student.ppf(0.95, 11) * 1e-5 / 12**0.5 / 0.03
    assert found.high - found.value == pytest.approx(reach, rel=1e-9)
