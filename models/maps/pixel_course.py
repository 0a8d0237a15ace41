"""Statistics of a course in time at each pixel that several kinds of maps share: its spectrum's
shape, and the picture at rest."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import torch
from torch import Tensor

Band = tuple[float, float]


@functools.cache
def fourier_rows(count: int) -> Tensor:
    """Computes real and imaginary part of the Fourier transform (2, count // 2, count) float32
    under a Hann window, over √count, less the mean and without the bin at zero. real and imaginary
    part of the Fourier transform under a Hann window, over √count, less the mean and without the
    bin at zero. `models.maps.spectral_layer.periodogram` is the definition.

    It is kept and must not be written to.
    """
    window = torch.hann_window(count, periodic=True, dtype=torch.float64)
    window = window * (count / window.square().sum()).sqrt() / math.sqrt(count)
    turn = 2 * math.pi * torch.arange(1, count // 2 + 1, dtype=torch.float64)[:, None] / count
    phase = turn * torch.arange(count)
    rows = torch.stack([phase.cos(), -phase.sin()]) * window
    return (rows - rows.mean(dim=2, keepdim=True)).float()


def shares_of_nyquist(power: Tensor, *, steps: int) -> Tensor:
    """Returns frequencies (bin,) of a spectrum (…, bin, h, w) of so many steps over the Nyquist
    frequency, without the bin at zero."""
    return torch.arange(1, power.shape[-3] + 1, device=power.device, dtype=power.dtype) / (
        steps / 2
    )


def centre_and_width(power: Tensor, share: Tensor, *, floor: float) -> tuple[Tensor, Tensor]:
    """Computes the mean frequency (…, h, w) and its standard deviation of spectra (…, bin, h, w),
    in the unit of `share`. the mean frequency and its standard deviation, in the unit of `share`.

    Args:
        share: (bin,) frequencies.
        floor: a power that is added to the sum of all bins, so that both fall to 0 where nothing
            moves.
    """
    weight, total = share[:, None, None], power.sum(dim=-3) + floor
    centre = (power * weight).sum(dim=-3) / total
    width = ((power * weight.square()).sum(dim=-3) / total - centre.square()).clamp(min=0).sqrt()
    return centre, width


def band_powers(power: Tensor, share: Tensor, bands: Sequence[Band]) -> list[Tensor]:
    """Sums the power (…, h, w) of the bins in (low, high] for each band. the power of the bins in
    (low, high]."""
    return [power[..., (share > low) & (share <= high), :, :].sum(dim=-3) for low, high in bands]


def log_power(power: Tensor, *, floor: float) -> Tensor:
    """Computes log(1 + power/floor): logarithmic above the floor, linear below."""
    return (power / floor).log1p()


def at_rest(frames: Tensor) -> Tensor:
    """Describes frames (time, h, w) by three pictures (3, h, w): the mean, the log of its slope,
    the log of the standard deviation in time. the mean picture, the log of its slope, the log of
    the standard deviation in time."""
    mean = frames.mean(dim=0)
    spread = (frames - mean).square().mean(dim=0).sqrt()  # a third of the time of torch.std_mean
    slope = torch.zeros_like(mean)
    slope[:, 1:-1] = (mean[:, 2:] - mean[:, :-2]).square()
    slope[1:-1] += (mean[2:] - mean[:-2]).square()
    return torch.stack([mean, (slope.sqrt() * 10).log1p(), (spread * 10).log1p()])
