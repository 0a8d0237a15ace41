"""A page of hand-made features of a clip: what a person would measure before training a network.

They are the yardstick of every network: one that does not beat a regression on them has learned
nothing beyond them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from flagdata.errors import InputError

BAND_EDGES = (0.4, 1.25, 2.1, 3.3, 5.0, 7.5, 12.5)
"""Edges [Hz] of the frequency bands: from below one cycle in a clip of 30 frames to the Nyquist
frequency of 25 Hz."""

SIDE = 112
"""Height and width [px] to which larger clips are averaged down; in px of this grid all lengths are
given."""

FLOOR = 1e-6
"""Power, in variances of the clip, added before logarithms: about what rounding to 8 bits leaves in
one frequency of a clip with a standard deviation of 50 gray levels, (1/12) / 50² / 15."""

LEAST_SLOPE = 0.02
"""Slope [standard deviations/px] added to the divisor of the normal flow: flat pixels have no
flow."""

_SIGNALS = ("change", "slope_x", "slope_y")
_BANDS = tuple(f"{low:g}_{high:g}hz" for low, high in pairwise(BAND_EDGES))

FEATURES: tuple[str, ...] = (
    *(f"log_power_{signal}_{band}" for signal in _SIGNALS for band in _BANDS),
    *(
        f"{quantity}_{signal}"
        for signal in _SIGNALS
        for quantity in ("dominant_frequency", "mean_frequency", "bandwidth")
    ),
    "local_frequency_mean",
    "local_frequency_spread",
    "coverage_0.1",
    "coverage_0.3",
    "coverage_1",
    "log_motion_median",
    "log_motion_p90",
    "log_motion_p99",
    "log_normal_flow_rms",
    "log_normal_flow_median",
    "log_normal_flow_p90",
    "log_flow_x",
    "log_flow_y",
    "flow_unsteadiness",
    "motion_x",
    "motion_y",
    "motion_width",
    "motion_height",
    "log_motion_aspect",
    "motion_tilt",
    "motion_concentration",
    "skewness_x",
    "skewness_y",
    "coherence_x",
    "coherence_y",
    "wavenumber_x",
    "wavenumber_y",
    "log_slope",
    "log_slope_aspect",
    "log_share_moving",
    "change_unsteadiness",
)
"""Names of the features in their order. A slope is a derivative of the gray level; motion, its
deviation in time."""


def features(frames: Tensor, *, rate: float) -> Tensor:
    """Measures the features of clips: (batch, len(FEATURES)) float32, none of them changed by
    contrast or brightness.

    Powers are logarithms to base 10 of variances over the clip's own; frequencies in Hz; flows in
    log10(px/s) and positions and lengths in px, over `SIDE`. Flow is the normal flow of Horn and
    Schunck (1981), |∂I/∂t| / |∇I|, and the least-squares translation of each frame (Lucas and
    Kanade, 1981). Coherence and wavenumber [rad/px] are modulus and angle of the cross-spectrum of
    neighbouring pixels at the dominant frequency: a travelling wave has coherence 1 and its own
    wavenumber. Horizontal positions, skewness, tilt and wavenumbers keep no sign, so that a
    mirrored clip has the same features: a wind's speed has no side.

    Args:
        frames: (batch, 1, time, height, width), gray, of any scale, at least 8 frames and 16×16 px.
        rate: frames per second [Hz], at least twice the last of `BAND_EDGES`.

    Raises:
        InputError: clips too short, small or slow, or without contrast.
    """
    if (
        frames.ndim != 5
        or frames.shape[1] != 1
        or frames.shape[2] < 8
        or min(frames.shape[3:]) < 16
    ):
        raise InputError(
            f"the clips have the shape {tuple(frames.shape)}",
            fix="give gray clips (batch, 1, time, height, width) of at least 8 frames and 16×16 "
            "pixels",
        )
    if rate < 2 * BAND_EDGES[-1]:
        raise InputError(
            f"{rate:g} frames a second do not resolve {BAND_EDGES[-1]:g} Hz",
            fix=f"give {2 * BAND_EDGES[-1]:g} or more",
        )
    return torch.stack([_of_clip(clip[0], rate) for clip in frames])


def _of_clip(clip: Tensor, rate: float) -> Tensor:
    gray = _reduce_clip(clip.float())
    mean = gray.mean()
    gray = gray - mean
    deviation = gray.square().mean().sqrt()
    if not bool(deviation > 1e-6 * (1 + mean.abs())):
        raise InputError(
            "the hand-made features need contrast and finite numbers, and this clip lacks them",
            fix="leave the clip out",
        )
    gray /= deviation
    change = gray[1:, 1:-1, 1:-1] - gray[:-1, 1:-1, 1:-1]
    slope_x = 0.5 * (gray[:, 1:-1, 2:] - gray[:, 1:-1, :-2])
    slope_y = 0.5 * (gray[:, 2:, 1:-1] - gray[:, :-2, 1:-1])
    inner = gray[:, 1:-1, 1:-1]
    motion = (inner - inner.mean(dim=0)).square().mean(dim=0)
    wave = _transform(inner, rate)
    numbers = [
        *_spectral(wave, slope_x, slope_y, rate),
        *_coverage(motion),
        *_flow(change, slope_x, slope_y, rate),
        *_shape(motion),
        *_waves(wave),
        *_appearance(change, slope_x, slope_y, motion),
    ]
    return torch.stack(
        [torch.as_tensor(number, dtype=torch.float32, device=clip.device) for number in numbers]
    )


def _reduce_clip(clip: Tensor) -> Tensor:
    """Returns the clip averaged over whole blocks of pixels, so that its shorter side is near
    `SIDE`."""
    block = max(1, round(min(clip.shape[1:]) / SIDE))
    height, width = (side // block * block for side in clip.shape[1:])
    parts = [clip[:, i:height:block, j:width:block] for i in range(block) for j in range(block)]
    return clip if block == 1 else sum(parts[1:], start=parts[0]) / block**2


def _log(power: Tensor) -> Tensor:
    return (power + FLOOR).log10()


def _transform(signal: Tensor, rate: float) -> tuple[Tensor, Tensor, Tensor]:
    """Returns real and imaginary part (bin, height, width) of the windowed transform without its
    mean, and Hz (bin,).

    One matrix product: the Hann window (Σw² = n) and the subtraction of the mean are part of the
    matrix, and |F|²/n² is the part of the variance in a bin, but for the factor 2 of negative
    frequencies.
    """
    n = len(signal)
    t = np.arange(n)
    window = np.hanning(n + 1)[:-1]
    window *= math.sqrt(n / np.square(window).sum())
    frequency = np.arange(1, n // 2 + 1)
    angle = 2 * np.pi * np.outer(frequency, t) / n
    rows = np.concatenate([np.cos(angle) * window, -np.sin(angle) * window]) / n
    rows -= rows.mean(axis=1, keepdims=True)
    matrix = torch.as_tensor(rows, dtype=signal.dtype, device=signal.device)
    flat = (matrix @ signal.flatten(1)).unflatten(1, signal.shape[1:])
    real, imaginary = flat.chunk(2)
    return (
        real,
        imaginary,
        torch.as_tensor(frequency * rate / n, dtype=signal.dtype, device=signal.device),
    )


def _band_shares(frequency: Tensor, width: float) -> Tensor:
    """Returns the share of each bin, f ± width/2, in each band: (band, bin). Bands finer than the
    bins share them."""
    edges = torch.tensor(BAND_EDGES, dtype=frequency.dtype, device=frequency.device)
    low = torch.maximum(edges[:-1, None], frequency - width / 2)
    high = torch.minimum(edges[1:, None], frequency + width / 2)
    return (high - low).clamp_min(0) / width


def _spectral(
    wave: tuple[Tensor, Tensor, Tensor], slope_x: Tensor, slope_y: Tensor, rate: float
) -> list[Tensor]:
    """Computes band powers and shape of the spectra of the change from frame to frame and of both
    slopes."""
    powers: list[Tensor] = []
    shapes: list[Tensor] = []
    local: list[Tensor] = []
    for signal in (None, slope_x, slope_y):
        real, imaginary, frequency = wave if signal is None else _transform(signal, rate)
        power = (real.square() + imaginary.square()).mul_(2)
        if signal is None:
            power *= (2 * (math.pi * frequency / rate).sin()).square()[:, None, None]
            strongest, index = power.max(dim=0)
            weight = strongest + FLOOR
            middle = _weighted_mean(frequency[index], weight)
            local = [middle, _weighted_mean((frequency[index] - middle).square(), weight).sqrt()]
        spectrum = power.mean(dim=(1, 2))
        powers += list(_log(_band_shares(frequency, float(frequency[0])) @ spectrum))
        weight = spectrum + FLOOR / len(spectrum)
        middle = _weighted_mean(frequency, weight)
        shapes += [
            frequency[spectrum.argmax()],
            middle,
            _weighted_mean((frequency - middle).square(), weight).sqrt(),
        ]
    return powers + shapes + local


def _weighted_mean(values: Tensor, weight: Tensor) -> Tensor:
    return (values * weight).sum() / weight.sum()


def _quantiles(values: Tensor, levels: Sequence[float]) -> list[Tensor]:
    ordered = values.flatten().sort().values
    return [ordered[min(len(ordered) - 1, int(level * len(ordered)))] for level in levels]


def _coverage(motion: Tensor) -> list[Tensor]:
    covered = [(motion > level**2).float().mean() for level in (0.1, 0.3, 1.0)]
    return covered + [_log(power) for power in _quantiles(motion, (0.5, 0.9, 0.99))]


def _flow(change: Tensor, slope_x: Tensor, slope_y: Tensor, rate: float) -> list[Tensor]:
    """Computes normal flow where there is slope, and the translation of each frame, both in widths
    of the reduced image."""
    scale = rate / SIDE
    x, y = 0.5 * (slope_x[1:] + slope_x[:-1]), 0.5 * (slope_y[1:] + slope_y[:-1])
    xx, yy, xy = (x * x).mean(dim=(1, 2)), (y * y).mean(dim=(1, 2)), (x * y).mean(dim=(1, 2))
    xt, yt = (x * change).mean(dim=(1, 2)), (y * change).mean(dim=(1, 2))
    determinant = xx * yy - xy.square() + FLOOR
    u, v = (yy * xt - xy * yt) / determinant * scale, (xx * yt - xy * xt) / determinant * scale
    speed = (u.square() + v.square()).sqrt()
    sparse = (slice(None, None, 2), slice(None, None, 4))
    slope = (x[sparse].square() + y[sparse].square()).sqrt()
    normal = change[sparse].abs() / (slope + LEAST_SLOPE)
    median, high = _quantiles(normal, (0.5, 0.9))
    rms = (
        change.square().mean() / (slope_x.square().mean() + slope_y.square().mean() + FLOOR)
    ).sqrt()
    return [
        _log(rms * scale),
        _log(median * scale),
        _log(high * scale),
        _log(u.square().mean().sqrt()),
        _log(v.square().mean().sqrt()),
        speed.std() / (speed.mean() + FLOOR),
    ]


def _shape(motion: Tensor) -> list[Tensor]:
    """Computes moments of the motion's power over the image: moments of its power over the
    image."""
    height, width = motion.shape
    weight = motion + FLOOR
    x = (torch.arange(width, device=motion.device, dtype=motion.dtype) - (width - 1) / 2) / SIDE
    y = (torch.arange(height, device=motion.device, dtype=motion.dtype) - (height - 1) / 2) / SIDE
    column, row = weight.sum(dim=0), weight.sum(dim=1)
    mean_x, mean_y = _weighted_mean(x, column), _weighted_mean(y, row)
    spread_x = _weighted_mean((x - mean_x).square(), column).sqrt()
    spread_y = _weighted_mean((y - mean_y).square(), row).sqrt()
    mixed = ((y - mean_y) @ weight @ (x - mean_x)) / weight.sum()
    return [
        mean_x.abs(),
        mean_y,
        spread_x,
        spread_y,
        (spread_x / spread_y).log10(),
        (mixed / (spread_x * spread_y)).abs(),
        weight.sum().square() / (weight.square().sum() * weight.numel()),
        (_weighted_mean((x - mean_x) ** 3, column) / spread_x**3).abs(),
        _weighted_mean((y - mean_y) ** 3, row) / spread_y**3,
    ]


def _waves(transform: tuple[Tensor, Tensor, Tensor]) -> list[Tensor]:
    """Computes coherence and wavenumber [rad/px] along x and y at the frequency that dominates the
    rate of change."""
    real, imaginary, frequency = transform
    power = (real.square() + imaginary.square()).mean(dim=(1, 2))
    wave = torch.complex(
        *(part[(power * frequency.square()).argmax()] for part in (real, imaginary))
    )
    pairs = ((wave[:, 1:], wave[:, :-1]), (wave[1:], wave[:-1]))
    coherence, wavenumber = [], []
    for ahead, behind in pairs:
        cross = (ahead * behind.conj()).sum()
        energy = 0.5 * (ahead.abs().square().sum() + behind.abs().square().sum())
        coherence.append(cross.abs() / (energy + FLOOR))
        wavenumber.append(cross.angle().abs())
    return coherence + wavenumber


def _appearance(change: Tensor, slope_x: Tensor, slope_y: Tensor, motion: Tensor) -> list[Tensor]:
    along, across = slope_x.square().mean(), slope_y.square().mean()
    activity = change.square().mean(dim=(1, 2))
    return [
        _log(along + across),
        ((along + FLOOR) / (across + FLOOR)).log10(),
        _log(motion.mean()),
        activity.std() / (activity.mean() + FLOOR),
    ]
