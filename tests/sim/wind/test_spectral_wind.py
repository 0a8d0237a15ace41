"""The gust model against the moments and the spectrum it is defined by."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import welch

from flagdata.core.rng import stream
from flagdata.errors import InputError
from sim.wind import VonKarman
from tests.refusals import unrefused

GUSTS = VonKarman(mean=6.0, intensity=0.2, length=60.0)


def test_the_density_integrates_to_the_variance() -> None:
    """∫ S df = σ² to 0.1 %: the constant 70.8 is a rounding of the exact (Γ-function) value."""
    total = quad(lambda f: float(GUSTS.density(f)), 0, np.inf)[0]
    assert total == pytest.approx(1.2**2, rel=2e-3)


def test_the_inertial_range_falls_by_five_thirds() -> None:
    ratio = float(GUSTS.density(200.0) / GUSTS.density(100.0))
    assert ratio == pytest.approx(2 ** (-5 / 3), rel=1e-4)


def test_an_ensemble_has_the_stated_mean_and_deviation() -> None:
    """400 series of 600 s: mean of all ± σ √(2T/D) / √400 with T = L/U = 10 s is ± 0.011 m/s; 4 σ
    allowed."""
    series = np.stack([GUSTS.series(stream(1, i), duration=600, rate=5) for i in range(400)])
    assert series.mean() == pytest.approx(6.0, abs=0.045)
    # What lies above the Nyquist frequency of 2.5 Hz is left out: 1.0 % of σ.
    expected = np.sqrt(quad(lambda f: float(GUSTS.density(f)), 0, 2.5)[0])
    assert series.std(axis=0).mean() == pytest.approx(expected, rel=0.02)


def test_the_periodogram_of_an_ensemble_follows_the_density() -> None:
    series = np.stack([GUSTS.series(stream(2, i), duration=600, rate=5) for i in range(200)])
    frequency, power = welch(series, fs=5, nperseg=512, axis=1)
    band = (frequency > 0.1) & (frequency < 2)
    # 200 × 10 segments: 2 % scatter a bin; leakage of the window adds a few per cent on a steep
    # spectrum.
    assert np.median(power.mean(0)[band] / GUSTS.density(frequency[band])) == pytest.approx(
        1.0, abs=0.04
    )


def test_the_correlation_time_is_the_length_over_the_mean() -> None:
    """S(0) = 4 σ² T, with the integral time scale T = L/U: one realisation's mean over D has
    variance 2 σ² T / D."""
    means = [GUSTS.series(stream(3, i), duration=1000, rate=1).mean() for i in range(600)]
    assert np.std(means) == pytest.approx(1.2 * np.sqrt(2 * 10 / 1000), rel=0.1)


def test_the_same_stream_gives_the_same_gusts() -> None:
    one, two = (GUSTS.series(stream(4, "gust"), duration=10, rate=10) for _ in range(2))
    assert np.array_equal(one, two)


def test_impossible_wind_is_refused() -> None:
    cases = [(0, 0.1, 50), (np.nan, 0.1, 50), (5, -0.1, 50), (5, 0.1, 0)]
    assert (
        unrefused(
            lambda mean, intensity, length: VonKarman(
                mean=mean, intensity=intensity, length=length
            ),
            cases,
            InputError,
        )
        == []
    )
