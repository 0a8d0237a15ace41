"""Gusts: a stationary Gaussian wind-speed series with the von Kármán spectrum."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError


@dataclass(frozen=True, kw_only=True)
class VonKarman:
    """Longitudinal turbulence of the natural wind near the ground.

    One-sided spectrum of the along-wind speed (von Kármán 1948; in this form ESDU 85020 and EN
    1991-1-4 literature)::

        S(f) = 4 σ² (L/U) / (1 + 70.8 (f L/U)²)^(5/6)        [m²/s]

    with σ = intensity · U. It integrates to σ² and falls as f^(-5/3) in the inertial range.

    Attributes:
        mean: U [m/s].
        intensity: σ/U; 0.1 over water to 0.3 among buildings.
        length: longitudinal integral length scale L [m]; some 50–100 m at 10 m height.
    """

    mean: float
    intensity: float
    length: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mean) and self.mean > 0):
            raise InputError(
                f"the mean wind is {self.mean} m/s",
                where="VonKarman.mean",
                fix="give a speed above 0",
            )
        if not 0 <= self.intensity <= 1:
            raise InputError(
                f"the turbulence intensity is {self.intensity}",
                where="VonKarman.intensity",
                fix="give a ratio from 0 to 1",
            )
        if not (math.isfinite(self.length) and self.length > 0):
            raise InputError(
                f"the length scale is {self.length} m",
                where="VonKarman.length",
                fix="give a length above 0",
            )

    @property
    def sigma(self) -> float:
        """Standard deviation of the speed [m/s]."""
        return self.intensity * self.mean

    def density(self, frequency: ArrayLike) -> FloatArray:
        """Computes the one-sided spectral density [m²/s] at frequencies [Hz]; the shape is kept."""
        scale = self.length / self.mean
        reduced = np.asarray(frequency, dtype=np.float64) * scale
        return 4 * self.sigma**2 * scale / (1 + 70.8 * reduced**2) ** (5 / 6)

    def series(self, rng: np.random.Generator, *, duration: float, rate: float) -> FloatArray:
        """Draws a realisation of the speed [m/s], (round(duration · rate),), sampled at `rate`
        [Hz].

        The Fourier coefficients are independent complex Gaussians with variance S(f) Δf over a
        period of at least eight integral time scales and twice the duration, of which the first
        part is returned: so the series is a Gaussian process, not a sum of equal sinusoids with
        random phase, and does not wrap around. Energy above the Nyquist frequency is left out, as
        an instrument with a matching response would. Speeds below zero (possible at high intensity)
        are kept: they are the wind blowing back.
        """
        count = round(duration * rate)
        if count < 2:
            raise InputError(
                f"{duration} s at {rate} Hz are {count} samples", fix="ask for two samples or more"
            )
        # Longer than asked for, so that the ends, which belong together, are far apart.
        period = max(2 * duration, 8 * self.length / self.mean)
        total = 2 * math.ceil(period * rate / 2)
        frequency = np.fft.rfftfreq(total, 1 / rate)
        width = rate / total
        # A coefficient c stands for 2 Re(c e^iωt), of variance 2 E|c|² = S Δf: each of its parts
        # has S Δf / 4. The bin at zero is half as wide in a one-sided spectrum and stands for c
        # itself: variance S Δf / 2.
        scale = np.sqrt(self.density(frequency) * width / 4)
        coefficient = scale * (
            rng.standard_normal(len(frequency)) + 1j * rng.standard_normal(len(frequency))
        )
        coefficient[0] = coefficient[0].real * math.sqrt(2)
        return self.mean + np.fft.irfft(coefficient * total, total)[:count]
