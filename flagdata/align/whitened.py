"""Wind and motion behind one autoregressive filter: their scores at all trial offsets, and the
peak's uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.optimize import nnls

from flagdata.align.bins import STEPS, LagBins
from flagdata.core.arrays import FloatArray
from flagdata.record.signals import Series

_ORDER = 4  # of the autoregression; lower leaves noise correlated, higher follows it less certainly
_WIDTHS = (1.0, 2.0, 4.0, 8.0)  # bins
_ROUNDS = 3  # of fitting filter and response in turn
FEWEST_BINS = 30
"""Fewer wind bins in common are not compared, however long they are."""
_TRIALS_AT_ONCE = 256
_VANISHING = 1e-12  # of a variance of normal scores: nothing moves
_PERFECT = 1 - 1e-12  # |r|, so that its atanh is finite


@dataclass(frozen=True, kw_only=True)
class Whitened:
    """Wind and motion behind the filter φ(B) = 1 − Σ φ_p B^p, B a step of one bin.

    Attributes:
        bins: what they were before.
        wind: (n,) filtered, NaN where a tap is missing.
        motion: as long as `bins.motion`, filtered at the spacing of a whole bin.
    """

    bins: LagBins
    wind: Series
    motion: Series

    @classmethod
    def by(cls, filters: Series, wind: Series, bins: LagBins) -> Whitened:
        return cls(
            bins=bins, wind=_filter(wind, filters, 1), motion=_filter(bins.motion, filters, STEPS)
        )

    def search(self, *, overlap: float) -> tuple[Series, Series, int]:
        """Computes this pair's scores z (m,), the bins compared (m,), and the trial where z is
        greatest; −1 where none is."""
        scores, counts = self.scores(self.wind[:, None], overlap=overlap)
        score = scores[:, 0]
        return score, counts, int(np.nanargmax(score)) if np.any(np.isfinite(score)) else -1

    def scores(self, winds: FloatArray, *, overlap: float) -> tuple[FloatArray, Series]:
        """Computes scores z = atanh(r) √(n − 3), (m, s), of winds (n, s), and how many bins each
        trial offset compares, (m,).

        All winds count as missing where the filtered wind is. Trials that cover less than `overlap`
        [s] get NaN.
        """
        present = np.isfinite(self.wind)
        weight = present.astype(np.float64)
        filled = np.where(present[:, None], winds, 0.0)
        squares = filled * filled
        is_finite = np.isfinite(self.motion)
        motion = np.where(is_finite, self.motion, 0.0)
        trials = len(self.bins.offsets)
        scores = np.empty((trials, winds.shape[1]))
        counts = np.empty(trials)
        enough = max(FEWEST_BINS, overlap / self.bins.period)
        for start in range(0, trials, _TRIALS_AT_ONCE):
            part = slice(start, start + _TRIALS_AT_ONCE)
            mask = self.bins.windows(is_finite, part).astype(np.float64)
            y = np.ascontiguousarray(self.bins.windows(motion, part))
            n = mask @ weight
            safe = np.maximum(n, 1.0)[:, None]
            mean_y, mean_yy = (y @ weight)[:, None] / safe, ((y * y) @ weight)[:, None] / safe
            mean_x, mean_xx = (mask @ filled) / safe, (mask @ squares) / safe
            covariance = (y @ filled) / safe - mean_x * mean_y
            variance = (mean_xx - mean_x**2) * (mean_yy - mean_y**2)
            usable = (n[:, None] >= enough) & (variance > _VANISHING)
            r = covariance / np.sqrt(np.where(usable, variance, 1.0))
            z = (
                np.arctanh(np.clip(r, -_PERFECT, _PERFECT))
                * np.sqrt(np.maximum(n - 3, 0.0))[:, None]
            )
            scores[part] = np.where(usable, z, np.nan)
            counts[part] = n
        return scores, counts

    def peak(self, score: Series, best: int) -> Peak:
        """Refines the peak at trial `best` of this pair's own scores, with its uncertainty (see
        `lag`)."""
        x, y, dx = (
            self.wind,
            self.motion[self.bins.index(best)],
            _slope(self.wind) / self.bins.period,
        )
        valid = np.isfinite(x) & np.isfinite(y) & np.isfinite(dx)
        n = int(np.count_nonzero(valid))
        centred_x, centred_y = x - np.mean(x[valid]), y - np.mean(y[valid])
        covariance = float(np.mean(centred_x[valid] * centred_y[valid]))
        variance = float(np.mean(centred_x[valid] ** 2))
        gain = covariance / variance
        psi = np.where(valid, (centred_y - gain * centred_x) * (dx - np.mean(dx[valid])), 0.0)
        curvature = gain * float(np.var(dx[valid]))
        sigma = math.sqrt(long_run_variance(psi, n) / n) / curvature if curvature > 0 else math.inf
        correlation = covariance / math.sqrt(variance * float(np.mean(centred_y[valid] ** 2)))
        return Peak(offset=self._vertex(score, best), sigma=sigma, correlation=correlation, bins=n)

    def _vertex(self, score: Series, best: int) -> float:
        """Finds where a parabola through half a bin either side of the peak is greatest [s]."""
        half = STEPS // 2
        around_peak = np.arange(max(best - half, 0), min(best + half + 1, len(score)))
        around_peak = around_peak[np.isfinite(score[around_peak])]
        centre = float(self.bins.offsets[best])
        if len(around_peak) < half:
            return centre
        away = self.bins.offsets[around_peak] - centre
        square, line, _ = np.polyfit(away, score[around_peak], 2)
        return (
            centre + float(np.clip(-line / (2 * square), away[0], away[-1]))
            if square < 0
            else centre
        )


@dataclass(frozen=True, kw_only=True)
class Peak:
    """A refined peak: offset and its statistical standard uncertainty [s], correlation, and bins
    compared."""

    offset: float
    sigma: float
    correlation: float
    bins: int


@dataclass(frozen=True, kw_only=True)
class Fit:
    """Two views of one model: `best` for the offset, `whitest` for the test whether there is any
    relation.

    Attributes:
        best: filtered by what the wind leaves unexplained of the motion; most certain if the two
            are related.
        whitest: filtered by the motion's own autoregression (Box and Jenkins, 1970); least chance
            for accidents, since the motion is then white whether or not it follows the wind.
    """

    best: Whitened
    whitest: Whitened


def fit(bins: LagBins, *, overlap: float) -> Fit | None:
    """Fits the filter φ(B) and the smooth, symmetric response to the wind that suit a pair best,
    found in turn.

    The response is a sum of Gaussians of several widths with coefficients ≥ 0, by non-negative
    least squares on the
    filtered series at the best offset: the wind's quick changes, which the flag elsewhere does not
    see and which the sensor's noise drowns, count by what they explain. Being symmetric in time it
    moves no peak. The filter is fitted to the residual.

    Returns:
        `None` where no trial offset covers `overlap` [s], or the motion rises with the wind at
            none.
    """
    smooth = np.stack(
        [_smooth_samples(bins.wind, width) for width in _WIDTHS], axis=1
    )  # (n, widths)
    motion_filter = filters = autoregression(bins.motion, stride=STEPS)
    best, highest = -1, -math.inf
    for column in smooth.T:
        score, _, trial = Whitened.by(filters, column, bins).search(overlap=overlap)
        if trial >= 0 and score[trial] > highest:
            best, highest = trial, float(score[trial])
    if best < 0:
        return None
    pair = Whitened.by(motion_filter, smooth[:, 0], bins)
    wind = smooth[:, 0]
    for _ in range(_ROUNDS):
        motion = bins.motion[bins.index(best)]
        weights = _response(smooth, motion, filters)
        if not np.any(weights > 0):
            return None
        wind = smooth @ weights
        filters = autoregression(motion - wind, stride=1)
        pair = Whitened.by(filters, wind, bins)
        score, _, best = pair.search(overlap=overlap)
        if best < 0 or score[best] <= 0:
            return None
    return Fit(best=pair, whitest=Whitened.by(motion_filter, wind, bins))


def longest_compared(bins: LagBins) -> float:
    """Computes the longest time that a pair can be compared over at any trial offset [s]: the
    filter takes some bins at the start and after each gap."""
    pair = Whitened.by(autoregression(bins.motion, stride=STEPS), bins.wind, bins)
    _, counts, _ = pair.search(overlap=0.0)
    return bins.period * float(counts.max())


def _response(smooth: FloatArray, motion: Series, filters: Series) -> Series:
    """Fits a_w ≥ 0, (widths,), of Σ a_w smooth_w to the motion (n,) behind the filter."""
    columns = np.stack([_filter(column, filters, 1) for column in smooth.T], axis=1)
    target = _filter(motion, filters, 1)
    finite = np.isfinite(target) & np.all(np.isfinite(columns), axis=1)
    centred = columns[finite] - columns[finite].mean(axis=0)
    weights, _ = nnls(centred, target[finite] - target[finite].mean())
    return weights


def _smooth_samples(samples: Series, width: float) -> Series:
    """Averages what is there over a Gaussian of standard deviation `width` [bins]; NaN stays
    NaN."""
    reach = math.ceil(3 * width)
    kernel = np.exp(-0.5 * np.square(np.arange(-reach, reach + 1) / width))
    is_finite = np.isfinite(samples)
    total = np.convolve(np.where(is_finite, samples, 0.0), kernel, mode="full")[
        reach : reach + len(samples)
    ]
    weight = np.convolve(is_finite.astype(np.float64), kernel, mode="full")[
        reach : reach + len(samples)
    ]
    return np.where(is_finite, total / np.maximum(weight, 1e-300), np.nan)


def autoregression(samples: Series, *, stride: int) -> Series:
    """Fits (4,) coefficients φ of samples a `stride` apart, by Yule and Walker; missing samples
    count as the mean.

    Autocovariances are biased (divided by the number of samples, not of pairs), which keeps the
    filter stable.
    """
    present = np.isfinite(samples)
    centred = np.where(present, samples - np.mean(samples[present]), 0.0)
    covariance = np.array(
        [
            float(centred[: len(centred) - k * stride] @ centred[k * stride :])
            for k in range(_ORDER + 1)
        ]
    )
    if covariance[0] <= 0:
        return np.zeros(_ORDER)
    covariance[0] *= 1 + 1e-9  # a constant series stays solvable
    return np.asarray(solve_toeplitz(covariance[:-1], covariance[1:]), dtype=np.float64)


def _filter(samples: Series, filters: Series, stride: int) -> Series:
    """samples − Σ φ_p samples shifted by p · stride; NaN before the first whole history."""
    out = np.full(samples.shape, np.nan)
    reach = len(filters) * stride
    if len(samples) > reach:
        out[reach:] = samples[reach:]
        for p, phi in enumerate(filters, start=1):
            out[reach:] -= phi * samples[reach - p * stride : len(samples) - p * stride]
    return out


def _slope(samples: Series) -> Series:
    """Computes the derivative per sample by the central difference of fourth order; NaN at the ends
    and beside gaps."""
    out = np.full(samples.shape, np.nan)
    if len(samples) > 4:
        out[2:-2] = (8 * (samples[3:-1] - samples[1:-3]) - (samples[4:] - samples[:-4])) / 12
    return out


def long_run_variance(psi: Series, count: int) -> float:
    """Computes the long-run variance of Newey and West (1987): Σ over lags of the autocovariances
    of `count` samples with Bartlett's weights."""
    reach = math.ceil(count ** (1 / 3))
    total = float(psi @ psi)
    for lag in range(1, reach + 1):
        total += 2 * (1 - lag / (reach + 1)) * float(psi[:-lag] @ psi[lag:])
    return total / count
