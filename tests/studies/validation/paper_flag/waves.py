"""What a fluttering line does: frequency, amplitude, envelope, speed of its waves and shape, with
intervals.

Heights y(x, t) are modelled, column by column, as m(x) + Re Σ_k a_k(x) exp(2πi k f t), fitted by
least squares to what was seen; gaps are left out, not filled. The spectrum's residual, summed over
columns, gives f. Intervals are Student's
about blocks of whole cycles: each cycle has its own frequency (from the phase of the motion on the
mean shape), amplitude and wave speed, and neighbouring cycles are joined to blocks since they
resemble each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError

HARMONICS = 3
LEVEL = 0.9
_BLOCK = 2
"""Cycles joined to one block."""
_FEWEST = 4
"""Blocks an interval needs."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A value, its standard error and its interval at 90 %.

    Attributes:
        count: blocks it rests on.
    """

    value: float
    error: float
    low: float
    high: float
    count: int

    def as_dict(self) -> dict[str, float | int | None]:
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in vars(self).items()
        }

    def scaled(self, factor: float) -> Estimate:
        """In another unit."""
        return Estimate(
            value=self.value * factor,
            error=self.error * factor,
            low=self.low * factor,
            high=self.high * factor,
            count=self.count,
        )


@dataclass(frozen=True, kw_only=True)
class Waves:
    """The motion of a line, in the unit of its heights.

    Attributes:
        frequency: [Hz].
        explained: share of the heights' variance that the periodic model explains.
        amplitude: largest of |a_1(x)|.
        speed: of the travelling wave, positive towards larger x: ω over the slope of its phase, in
            units of x a second.
        travelling: 1 for a wave that only travels, 0 for one that only stands: the smaller over the
            larger axis of the ellipse that the complex heights fill (Feeny, J. Sound Vib. 310:90,
            2008).
        columns: (column,) x of what follows.
        profile: (column,) complex a_1.
        mean: (column,) m.
        lowest, highest: (column,) 2 % and 98 % of the heights seen: the envelope.
        two_modes: share of the variance in the first two proper orthogonal modes, of frames seen
            whole; NaN without.
    """

    frequency: Estimate
    explained: float
    amplitude: Estimate
    speed: Estimate
    travelling: float
    columns: FloatArray
    profile: NDArray[np.complex128]
    mean: FloatArray
    lowest: FloatArray
    highest: FloatArray
    two_modes: float


def waves(
    time: FloatArray,
    columns: FloatArray,
    heights: FloatArray,
    *,
    band: tuple[float, float] = (3.0, 60.0),
    harmonics: int = HARMONICS,
    least_seen: float = 0.3,
) -> Waves:
    """The periodic part of a motion.

    Args:
        time: (frame,) [s].
        columns: (column,) x.
        heights: (frame, column), NaN where not seen.
        band: where the frequency is sought [Hz].
        harmonics: K of the model.
        least_seen: share of the frames in which a column must be seen to count.

    Raises:
        InputError: fewer than two usable columns, or less than four cycles.
    """
    seen = np.isfinite(heights)
    use = seen.mean(axis=0) >= least_seen
    if use.sum() < 2:
        raise InputError(
            f"{int(use.sum())} columns are seen in {least_seen:.0%} of the frames",
            where="waves",
            fix="give a clip in which the line is in view for longer",
        )
    columns, heights, seen = columns[use], heights[:, use], seen[:, use]
    mean = np.nanmean(heights, axis=0)
    frequency = _frequency(time, heights - mean, band, harmonics)
    duration = float(time[-1] - time[0])
    if frequency * duration < _FEWEST:
        raise InputError(
            f"{frequency * duration:.1f} cycles at {frequency:.3g} Hz",
            where="waves",
            fix="give a longer clip",
        )
    offset, coefficients = _fit(time, heights, frequency, harmonics)
    profile = coefficients[0]
    model = offset + _harmonic(time, coefficients, frequency)
    residual = np.where(seen, heights - model, 0.0)
    varied = np.where(seen, heights - mean, 0.0)
    phases, amplitudes, speeds = _cycles(time, columns, heights - offset, profile, frequency)
    step = 1 / frequency
    local = np.diff(np.unwrap(phases)) / (2 * np.pi * step) + frequency
    lowest, highest = np.nanpercentile(heights, [2, 98], axis=0)
    return Waves(
        frequency=_about(float(frequency + _drift(phases) / (2 * np.pi * step)), local),
        explained=float(1 - (residual**2).sum() / (varied**2).sum()),
        amplitude=_about(float(np.abs(profile).max()), amplitudes * float(np.abs(profile).max())),
        speed=_about(wave_speed(columns, profile, frequency), speeds),
        travelling=_travelling(profile),
        columns=columns,
        profile=profile,
        mean=offset,
        lowest=lowest,
        highest=highest,
        two_modes=_two_modes(heights),
    )


def wave_speed(columns: FloatArray, profile: NDArray[np.complex128], frequency: float) -> float:
    """ω / (−d arg a / dx), the slope weighted with |a|²: columns where nothing moves say
    nothing."""
    phase = np.unwrap(np.angle(profile))
    weight = profile.real**2 + profile.imag**2
    slope = _slope(columns, phase, weight)
    return float(-2 * np.pi * frequency / slope) if slope else math.inf


def _slope(x: FloatArray, y: FloatArray, weight: FloatArray) -> float:
    centre = (weight * x).sum() / weight.sum()
    return float((weight * (x - centre) * y).sum() / (weight * (x - centre) ** 2).sum())


def _frequency(
    time: FloatArray, heights: FloatArray, band: tuple[float, float], harmonics: int
) -> float:
    """Least residual: of the fundamental alone on a coarse grid, of the whole model on a fine one
    around the best.

    Of the fundamental alone first, since a motion of frequency f is also one of f/2 with twice the
    harmonics.
    """
    duration = float(time[-1] - time[0])
    grid = np.arange(band[0], band[1], 0.1 / duration)
    chosen = heights[:, np.unique(np.linspace(0, heights.shape[1] - 1, 12).round().astype(int))]
    fundamental = np.array([_residual(time, chosen, f, 1) for f in grid])
    best = float(grid[fundamental.argmin()])
    finer = np.linspace(best - 0.3 / duration, best + 0.3 / duration, 61)
    return float(finer[np.argmin([_residual(time, chosen, float(f), harmonics) for f in finer])])


def _design(time: FloatArray, frequency: float, harmonics: int) -> FloatArray:
    angle = 2 * np.pi * frequency * time[:, None] * np.arange(1, harmonics + 1)
    return np.concatenate([np.ones((len(time), 1)), np.cos(angle), np.sin(angle)], axis=1)


def _residual(time: FloatArray, heights: FloatArray, frequency: float, harmonics: int) -> float:
    """Sum of squares that the model leaves of all columns, each fitted to its own frames by the
    normal equations."""
    design = _design(time, frequency, harmonics)
    seen = np.isfinite(heights).astype(np.float64)
    known = np.nan_to_num(heights)
    pairs = (design[:, :, None] * design[:, None, :]).reshape(len(time), -1)
    width = design.shape[1]
    left = (seen.T @ pairs).reshape(-1, width, width)
    right = known.T @ design
    found = np.linalg.solve(left, right[..., None])[..., 0]
    return float((known**2).sum() - (found * right).sum())


def _fit(
    time: FloatArray, heights: FloatArray, frequency: float, harmonics: int
) -> tuple[FloatArray, NDArray[np.complex128]]:
    """m, (column,), and a_k, (harmonic, column)."""
    design = _design(time, frequency, harmonics)
    found = np.empty((design.shape[1], heights.shape[1]))
    for index, column in enumerate(heights.T):
        seen = np.isfinite(column)
        found[:, index] = np.linalg.lstsq(design[seen], column[seen], rcond=None)[0]
    return found[0], found[1 : harmonics + 1] - 1j * found[harmonics + 1 :]


def _harmonic(
    time: FloatArray, coefficients: NDArray[np.complex128], frequency: float
) -> FloatArray:
    turning = np.exp(2j * np.pi * frequency * time[:, None] * np.arange(1, len(coefficients) + 1))
    return (turning @ coefficients).real


def _cycles(
    time: FloatArray,
    columns: FloatArray,
    moving: FloatArray,
    profile: NDArray[np.complex128],
    frequency: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Phase and amplitude of each whole cycle on the mean shape, relative to the mean motion, and
    its wave speed."""
    phases, amplitudes, speeds = [], [], []
    cycle = np.floor((time - time[0]) * frequency + 1e-9).astype(int)
    for number in range(int((time[-1] - time[0]) * frequency)):
        here = cycle == number
        part, at = moving[here], time[here]
        seen = np.isfinite(part)
        turned = profile * np.exp(2j * np.pi * frequency * at[:, None])
        design = np.stack([turned[seen].real, -turned[seen].imag], axis=1)
        if len(design) < 2 * len(columns):  # less than two frames' worth of heights
            continue
        c, s = np.linalg.lstsq(design, part[seen], rcond=None)[0]
        phases.append(math.atan2(s, c))
        amplitudes.append(math.hypot(c, s))
        whole = seen.mean(axis=0) > 0.6
        if whole.sum() > 2:
            _, own = _fit(at, part[:, whole], frequency, 1)
            speeds.append(wave_speed(columns[whole], own[0], frequency))
    return np.array(phases), np.array(amplitudes), np.array(speeds)


def _drift(phases: FloatArray) -> float:
    """Radians a cycle by which the phase runs ahead of the fitted frequency."""
    turned = np.unwrap(phases)
    return float(np.polyfit(np.arange(len(turned)), turned, 1)[0]) if len(turned) > 1 else 0.0


def _about(value: float, each: FloatArray) -> Estimate:
    """Student's interval about `value` from the means of blocks of cycles."""
    each = each[np.isfinite(each)]
    blocks = len(each) // _BLOCK
    if blocks < 2:
        return Estimate(value=value, error=math.nan, low=math.nan, high=math.nan, count=blocks)
    means = each[: blocks * _BLOCK].reshape(blocks, _BLOCK).mean(axis=1)
    error = float(means.std(ddof=1) / math.sqrt(blocks))
    half = float(stats.t.ppf((1 + LEVEL) / 2, blocks - 1)) * error
    return Estimate(value=value, error=error, low=value - half, high=value + half, count=blocks)


def _travelling(profile: NDArray[np.complex128]) -> float:
    parts = np.stack([profile.real, profile.imag])
    sizes = np.linalg.svd(parts, compute_uv=False)
    return float(sizes[1] / sizes[0])


def _two_modes(heights: FloatArray) -> float:
    whole = np.isfinite(heights).all(axis=1)
    if whole.sum() < heights.shape[1] / 4 or whole.sum() < 50:
        return math.nan
    sizes = np.linalg.svd(heights[whole] - heights[whole].mean(axis=0), compute_uv=False) ** 2
    return float(sizes[:2].sum() / sizes.sum())
