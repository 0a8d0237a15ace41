"""Lines of the errors' spectra: found where something swings at a frequency that goes with the
wind, and only there."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from flagdata.core.arrays import FloatArray
from measure.probes import REDUCED, Lines, strongest
from measure.probes.lines import SHAPES, Spectrum
from sim.cloth.mesh import grid

PERIOD, FRAMES, SEGMENTS = 0.04, 50, 12
SPEEDS = np.repeat([3.5, 5.0, 7.0], 4)
MARKERS = grid(width=1.5, height=1.0, columns=8, rows=5).rest
SPECTRUM = Spectrum.of(MARKERS, MARKERS, SPEEDS, PERIOD)


def noise(seed: int) -> FloatArray:
    """(frame, marker, 3, segment), white."""
    return np.random.default_rng(seed).normal(size=(FRAMES, len(MARKERS), 3, SEGMENTS))


def swinging(reduced: float, size: float, *, axis: int = 1, goes: bool = True) -> FloatArray:
    """The same everywhere along an axis, at `reduced` Hz for each m/s of wind, or whatever the wind
    at that of 5."""
    phase = np.random.default_rng(9).uniform(0, 2 * np.pi, SEGMENTS)
    frequency = reduced * (SPEEDS if goes else np.full(SEGMENTS, 5.0))
    errors = np.zeros((FRAMES, len(MARKERS), 3, SEGMENTS))
    errors[:, :, axis] = (
        size * np.sin(2 * np.pi * frequency * PERIOD * np.arange(FRAMES)[:, None] + phase)[:, None]
    )
    return errors


def prominence(errors: FloatArray) -> FloatArray:
    return SPECTRUM.prominence(torch.as_tensor(errors))


@pytest.fixture(scope="module")
def nulls() -> tuple[Lines, FloatArray]:
    groups = np.stack([strongest(prominence(noise(seed))) for seed in range(200)])
    lines = Lines.of(groups)
    return lines, lines.standing_out(groups)


def far(nulls: tuple[Lines, FloatArray], errors: FloatArray) -> tuple[float, float, int]:
    lines, standing = nulls
    line = lines.line(
        prominence(errors), centre=float(standing.mean()), width=float(standing.std())
    )
    return line.far, line.reduced, line.axis


def test_white_noise_has_the_prominence_of_an_exponential_over_its_median() -> None:
    found = prominence(noise(1))
    assert found.shape == (SEGMENTS, len(REDUCED), 3 * len(SHAPES))
    # Periodograms of white noise are exponential: mean over median 1/ln 2. 12 segments of 25
    # independent frequencies in 15 directions, 4500 draws: 1.5 %; medians are those of the ten
    # draws or so within 2 Hz, which adds a tenth.
    assert np.nanmean(found) == pytest.approx(1 / math.log(2), rel=0.15)


@pytest.mark.parametrize(("reduced", "axis"), [(1.33, 1), (1.7, 2)])
def test_what_goes_with_the_wind_is_found_with_its_frequency(
    nulls: tuple[Lines, FloatArray], reduced: float, axis: int
) -> None:
    # A third of a marker's noise, and 54 markers: 2.4 of their mean's.
    found = far(nulls, noise(3) + swinging(reduced, 0.33, axis=axis))
    assert found[0] > 6
    assert found[1] == pytest.approx(reduced, rel=0.05)
    assert found[2] == axis


def test_what_swings_as_fast_in_any_wind_counts_in_one_wind_at_a_time() -> None:
    def logarithm(seed: int, *, goes: bool) -> float:
        across = 1  # of the first shape
        return float(strongest(prominence(noise(seed) + swinging(1.33, 1.0, goes=goes)))[across])

    # One of three winds shows it at any one reduced frequency: a third of the power's logarithm,
    # and what the best of the noise adds in the others.
    shares = [logarithm(seed, goes=False) / logarithm(seed, goes=True) for seed in range(8)]
    assert 1 / 3 < np.mean(shares) < 0.6


def test_noise_alone_is_like_the_nulls(nulls: tuple[Lines, FloatArray]) -> None:
    found = [far(nulls, noise(seed))[0] for seed in range(1000, 1100)]
    # Standardised: mean 0 ± 0.1 of a hundred, and of the 200 nulls; few beyond what nulls reach.
    assert abs(np.mean(found)) < 0.45
    assert 0.7 < np.std(found) < 1.4
    assert np.mean(np.array(found) > 3) < 0.05


def test_a_larger_unit_is_no_more_prominent() -> None:
    np.testing.assert_allclose(prominence(1e3 * noise(1)), prominence(noise(1)), rtol=1e-9)


def test_frequencies_beyond_what_frames_show_are_left_out() -> None:
    found = prominence(noise(1))
    highest = 0.5 / PERIOD - 0.5
    beyond = REDUCED * SPEEDS[:, None] >= highest
    np.testing.assert_array_equal(np.isnan(found[:, :, 0]), beyond)
    slow = Spectrum.of(MARKERS, MARKERS, 4 * SPEEDS, PERIOD)
    np.testing.assert_array_equal(strongest(slow.prominence(torch.as_tensor(noise(1)))), 0.0)
