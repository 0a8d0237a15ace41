"""Marker noise, estimated from what no smooth motion of a cloth does.

A high difference in time leaves little of a motion that is well sampled, a marker's departure from the polynomial
through its neighbours little of a shape that is. Of noise that is independent from marker to marker and from frame to
frame both leave a known multiple, so their product does. Each pair of orders gives an estimate, which is that of the
noise plus what is left of the motion; the smallest is taken. The same noise is supposed at all markers, so those that
move least (near the pins) say most: of the markers' variances the lower decile is taken, over that decile of a χ².

Noise that neighbours or frames share (a camera that shakes, a smoothing tracker) is not counted as noise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.stats import chi2

from flagdata.errors import InputError

_TIME_ORDERS = (2, 4, 6, 8, 10, 12)
_DEGREES = (0, 1, 2, 3, 4)  # of the polynomial in (u, v); 0 stands for the marker itself
_SPARE = 1.5  # neighbours for each coefficient of the polynomial
_LEAST = 30  # values that a marker's mean square needs, or all there are
_ENOUGH = 50_000  # positions are looked at, about; of more, every so many-th marker
_SHARE = 0.1  # of the markers, those that move least


@dataclass(frozen=True, kw_only=True)
class Stencils:
    """How far each marker is from the polynomial through its neighbours.

    Attributes:
        neighbours: (marker, k), the marker itself first.
        weights: (marker, k) with unit sum of squares, so that unit noise leaves unit noise.
    """

    neighbours: NDArray[np.int64]
    weights: NDArray[np.float64]

    def of(self, values: NDArray[np.float64], step: int = 1) -> NDArray[np.float64]:
        """(frame, …, 3) departures of every `step`-th marker, from values (frame, marker, 3); NaN where one is NaN."""
        weights, neighbours = self.weights[::step], self.neighbours[::step]
        departure = np.zeros((len(values), len(neighbours), 3))
        for column in range(neighbours.shape[1]):
            departure += weights[:, column, None] * values[:, neighbours[:, column]]
        return departure


def estimate(markers: NDArray[np.float64], positions: NDArray[np.float64], *, where: str) -> float:
    """Standard deviation of a coordinate's noise [m].

    Within 10 % for white noise on a motion that is smooth on the scale of the frames or of the markers; too large where
    it is smooth on neither.

    Args:
        markers: (marker, 2) rest coordinates [m].
        positions: (frame, marker, 3) [m]; NaN where not tracked.

    Raises:
        InputError: too few frames or tracked markers for any estimate.
    """
    smallest = math.inf
    step = max(1, round(positions.shape[0] * positions.shape[1] / _ENOUGH))
    for degree in _DEGREES:
        fits = stencils(markers, degree)
        if fits is None:
            break
        departure, before = fits.of(positions, step), 0
        for order in _TIME_ORDERS:
            if len(departure) <= order - before:
                break
            departure, before = np.diff(departure, n=order - before, axis=0), order
            smallest = min(smallest, _quietest(departure, order))
    if not math.isfinite(smallest):
        raise InputError(
            "too few values to estimate the noise from", where=where, fix="give the standard deviation of a coordinate"
        )
    return smallest


def stencils(markers: NDArray[np.float64], degree: int) -> Stencils | None:
    """Departures from polynomials of a degree fitted to the nearest neighbours; None where there are too few of them.

    Args:
        markers: (marker, 2) [m].
        degree: 0 for the values themselves.
    """
    count = len(markers)
    if degree == 0:
        return Stencils(neighbours=np.arange(count)[:, None], weights=np.ones((count, 1)))
    terms = (degree + 1) * (degree + 2) // 2
    near = math.ceil(_SPARE * terms) + 1
    if count < near:
        return None
    neighbours = np.asarray(KDTree(markers).query(markers, k=near)[1], dtype=np.int64)
    arms = markers[neighbours] - markers[:, None]
    arms = arms / np.abs(arms).max(axis=(1, 2), keepdims=True)
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    basis = np.stack([arms[..., 0] ** i * arms[..., 1] ** j for i, j in powers], axis=-1)
    # The fit to the neighbours alone, at the marker: the constant term.
    fit = np.linalg.pinv(basis[:, 1:], rcond=1e-6)[:, 0]
    weights = np.concatenate([np.ones((count, 1)), -fit], axis=1)
    return Stencils(neighbours=neighbours, weights=weights / np.linalg.norm(weights, axis=1, keepdims=True))


def _quietest(values: NDArray[np.float64], order: int) -> float:
    """Standard deviation at the markers that move least, from differences (frame, marker, 3) of an order in time;
    infinite where too few values are there."""
    square = (values * values).sum(axis=2) / 3
    there = np.isfinite(square)
    frames = there.sum(axis=0)
    enough = 3 * frames >= min(_LEAST, 3 * len(square))
    if not enough.any():
        return math.inf
    means = np.where(there, square, 0.0).sum(axis=0)[enough] / frames[enough]
    # Differences of white noise are correlated, ρ_k = C(2d, d+k)/C(2d, d); Σ ρ_k² = C(4d, 2d)/C(2d, d)² of them count
    # as one.
    together = math.comb(4 * order, 2 * order) / math.comb(2 * order, order) ** 2
    scale = math.comb(2 * order, order)  # variance of the difference of unit white noise
    free = max(1.0, 3 * float(np.median(frames[enough])) / together)
    return math.sqrt(float(np.quantile(means, _SHARE)) / (scale * float(chi2.ppf(_SHARE, free)) / free))
