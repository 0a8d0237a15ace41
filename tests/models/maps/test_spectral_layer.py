"""The spectral decomposition layer against signals whose spectrum is known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from scipy.signal import periodogram as scipy_periodogram

from flagdata.errors import InputError
from models.maps.spectral_layer import SpectralDecomposition, periodogram
from tests.refusals import unrefused

RATE = 25.0


def volume(values: torch.Tensor) -> torch.Tensor:
    return values.reshape(1, 1, -1, 1, 1)


@pytest.mark.parametrize("cycles", [2, 5, 11])
def test_a_sinusoid_shows_at_its_own_frequency_with_its_own_power(cycles: int) -> None:
    """Hann, Σw² = N: peak |F|²/N = a² N² (Σw)² / (4 N Σw²) · … = a² N / 6, since (Σw)²/(N Σw²) =
    2/3."""
    n, a = 50, 1.7
    t = torch.arange(n, dtype=torch.float64)
    out = SpectralDecomposition(rate=RATE)(
        volume(a * torch.sin(2 * math.pi * cycles * t / n + 0.3) + 9.0)
    )
    assert out.shape == (1, 2, 1, 1)
    assert out[0, 0].item() == pytest.approx(a**2 * n / 6, rel=1e-9)
    assert out[0, 1].item() == pytest.approx(cycles * RATE / n)


def test_powers_agree_with_scipys_periodogram() -> None:
    """scipy's one-sided density P: |F|²/N under Σw² = N equals P · rate / 2 away from zero and
    Nyquist."""
    signal = np.random.Generator(np.random.PCG64(1)).standard_normal(31)
    power, frequency = periodogram(volume(torch.from_numpy(signal)), rate=RATE)
    expected_frequency, density = scipy_periodogram(
        signal, fs=RATE, window="hann", detrend="constant"
    )
    np.testing.assert_allclose(frequency.numpy(), expected_frequency[1:])
    np.testing.assert_allclose(power.flatten().numpy(), density[1:] * RATE / 2, rtol=1e-9)


def test_each_pixel_and_channel_has_its_own_peaks_in_the_stated_order() -> None:
    t = torch.arange(30, dtype=torch.float64) / 30
    clip = torch.zeros(1, 2, 30, 1, 2, dtype=torch.float64)
    for channel in range(2):
        for x in range(2):
            strong, weak = 3 + 2 * channel + 4 * x, 12 - channel
            clip[0, channel, :, 0, x] = 2 * torch.sin(2 * math.pi * strong * t) + torch.sin(
                2 * math.pi * weak * t
            )
    out = SpectralDecomposition(rate=30, peaks=1)(clip)
    assert out.shape == (1, 4, 1, 2)
    assert out[0, 2:, 0].round().tolist() == [[3, 7], [5, 9]]


def test_a_still_clip_has_no_power() -> None:
    out = SpectralDecomposition(rate=RATE, peaks=2)(torch.full((2, 1, 30, 4, 5), 128.0))
    assert out.shape == (2, 4, 4, 5)
    assert out[:, :2].abs().max() < 1e-6


def test_power_passes_gradients() -> None:
    clip = torch.randn(
        1, 1, 8, 2, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(0)
    )
    clip.requires_grad_(True)
    assert torch.autograd.gradcheck(lambda c: periodogram(c, rate=RATE)[0], (clip,))


def test_what_has_no_spectrum_is_refused() -> None:
    cases = [
        torch.zeros(1, 1, 3, 2, 2),
        torch.zeros(1, 1, 30, 2),
        torch.zeros(1, 1, 30, 2, 2).int(),
    ]
    assert not unrefused(
        lambda clip: SpectralDecomposition(rate=RATE)(clip), zip(cases), InputError
    )
