"""The windows of one film as one gusty series: each window's wind, the film's mean and how strong
the gusts are.

What the network says of window w is its posterior of the wind there. m_w and s_w are the mean and
the standard deviation of the logarithm of a log-normal distribution of the same moments
(`log_moments`), so that draws near zero wind, or slightly negative, carry no extra weight.
With u_w the logarithm of the true wind,

    m_w = u_w + b + e_w,     u_w = μ + g_w.

- *b*, of standard deviation σ_b s, s the root mean square of the film's s_w, is common to all
  windows: the cloth, the flag's look and the view are those of the film.
- *e_w*, of standard deviation σ_e s_w, is the window's own. That of two windows is correlated by 1
  where they are the same, by ρ_½ where they share a half, by ρ_1 where one ends as the other
  begins, by 0 from two lengths on, and linearly between. Where this is convex it is a correlation
  (Pólya, Proc. Berkeley Symposium, 1949).
- *g*, the gusts, are an Ornstein–Uhlenbeck process of standard deviation I and integral time L/U,
  averaged over each window. Of the logarithm, I is the intensity of the turbulence, σ_u/U.
- *μ* has a flat prior.

Given I and L all is linear and Gaussian, and solved exactly. The two are summed over a grid,
weighted by their priors and by the likelihood of windows that do not overlap, which asks least of
the errors' correlation:

- I is uniform from 0 to `MOST_INTENSE`. A uniform standard deviation does not draw the windows
  together where there are few of them, as an inverse gamma or a uniform logarithm would (Gelman,
  Bayesian Analysis 1, 2006, section 7).
- L has an even logarithm over the integral lengths 8.1 Λ₁ of the Kaimal spectrum of IEC
  61400-1:2019, annex C, with Λ₁ of 0.7 times the height up to 60 m and 42 m above: 57 m at a height
  of 10 m to 340 m from 60 m on. The lower end is rounded to 50 m.

σ_b, σ_e, ρ_½ and ρ_1 belong to a model, the first two also to whether the weight was stated.
`python -m tests.studies series-errors` measures them and writes them into the model's card, where
`errors_of_model` finds them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, cholesky

from flagdata.answer import Quantity, Span
from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from measure.estimate.card_entries import card_entry
from models.trained.estimator import Estimator

SERIES_KEY = "wind_series"
"""Where a model's card states its `SeriesErrors`."""
_FORMAT = 1
MOST_INTENSE = 0.5
"""Largest intensity of gusts that is considered. EN 1991-1-4 has 0.43 at 10 m in towns."""
_INTENSITIES = 25
LENGTHS = (50.0, 340.0)
"""Least and largest integral length that is considered [m]."""
_LENGTHS = 4
LEAST_NARROWED = 0.8
"""Standard deviation of the posterior of the intensity over that of the prior, above which the film
says nothing of it; about where `measure.estimate.film_answer.LEAST_INFORMATION` puts the same for
quantities."""
_NEGLIGIBLE = 1e-6
"""Share of the posterior below which a point of the grid is left out."""
_LEAST_SPEED = 0.1
"""m/s below which gusts are carried no slower."""


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Standard deviations of errors, in those of the network's own posteriors.

    Attributes:
        shared: of the error that all windows of a film have in common, σ_b.
        own: of the error of each window, σ_e.

    Raises:
        InputError: one that is below 0 or not finite, or no error of its own.
    """

    shared: float
    own: float

    def __post_init__(self) -> None:
        if not (0 <= self.shared < math.inf and 0 < self.own < math.inf):
            raise InputError(
                f"standard deviations of {self.shared:g} and {self.own:g}",
                fix="give finite numbers, the second above 0",
            )


@dataclass(frozen=True, kw_only=True)
class SeriesErrors:
    """How a model errs in the windows of one film.

    Attributes:
        opened: where the weight of the cloth is not stated exactly.
        stated: where it is.
        halves, neighbours: correlations of the own errors of two windows that share a half, and of
            which one ends as the other begins.
        source: where they are from, in words.

    Raises:
        InputError: correlations that are not convex over the distance of windows.
    """

    opened: Pair
    stated: Pair
    halves: float
    neighbours: float
    source: str

    def __post_init__(self) -> None:
        least, most = 1.5 * self.neighbours, (1 + self.neighbours) / 2
        if not (self.neighbours >= 0 and least <= self.halves <= most):
            raise InputError(
                f"correlations {self.halves:g} and {self.neighbours:g}",
                fix=f"give a second of 0 or more, and a first from {least:g} to {most:g}",
            )

    def entry(self) -> dict[str, Any]:
        """Returns what a model's card says of it: JSON values."""
        return {
            "format": _FORMAT,
            "open": {"shared": self.opened.shared, "own": self.opened.own},
            "stated": {"shared": self.stated.shared, "own": self.stated.own},
            "halves": self.halves,
            "neighbours": self.neighbours,
            "source": self.source,
        }

    @classmethod
    def of_entry(cls, entry: Mapping[str, Any]) -> SeriesErrors:
        """Reads what a card says.

        Raises:
            KeyError, TypeError, ValueError, InputError: it is damaged, or of another format.
        """
        if entry["format"] != _FORMAT:
            raise ValueError(f"it is of format {entry['format']}, this version reads {_FORMAT}")
        pairs = {
            name: Pair(shared=float(entry[name]["shared"]), own=float(entry[name]["own"]))
            for name in ("open", "stated")
        }
        return cls(
            opened=pairs["open"],
            stated=pairs["stated"],
            halves=float(entry["halves"]),
            neighbours=float(entry["neighbours"]),
            source=str(entry["source"]),
        )


def errors_of_model(model: Estimator) -> SeriesErrors | None:
    """Reads how a model errs in windows of one film from its card; None where it does not say.

    Raises:
        CorruptError: the entry is damaged.
    """
    return card_entry(model, SERIES_KEY, SeriesErrors.of_entry, study="series-errors")


@dataclass(frozen=True, kw_only=True, eq=False)
class GustPrior:
    """A grid of gusts, all points equally probable before the film.

    Attributes:
        intensity: (i,) standard deviations of the logarithm of the wind.
        length: (l,) integral lengths [m].
        cell: width of the cells whose middles the intensities are; 0 where they are exact.
    """

    intensity: FloatArray
    length: FloatArray
    cell: float = 0.0

    @classmethod
    def standard(cls, *, size: float = 1.0) -> GustPrior:
        """Returns the prior of the module's text.

        Args:
            size: of the flag in lengths of the network's, which is the unit of lengths then.
        """
        cell = MOST_INTENSE / _INTENSITIES
        return cls(
            intensity=np.linspace(cell / 2, MOST_INTENSE - cell / 2, _INTENSITIES),
            length=np.geomspace(*LENGTHS, _LENGTHS) / size,
            cell=cell,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Gusty:
    """Draws of a gusty series at each size of flag that is considered (i).

    Attributes:
        winds: (i, k, n) of the windows, of a flag of the network's own size [m/s].
        intensity: (i, n) of the gusts.
    """

    winds: FloatArray
    intensity: FloatArray

    def reorder_draws(self, orders: Sequence[NDArray[np.intp]]) -> Gusty:
        """Returns the draws of each size in another order, (i, n) their places."""
        return Gusty(
            winds=np.stack(
                [winds[:, order] for winds, order in zip(self.winds, orders, strict=True)]
            ),
            intensity=np.stack(
                [values[order] for values, order in zip(self.intensity, orders, strict=True)]
            ),
        )


@dataclass(frozen=True, kw_only=True)
class Gusts:
    """How strong the gusts of a film are.

    Attributes:
        intensity: standard deviation over mean wind.
        windows: that it rests on.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "intensity=intensity.value",
        "interval=intensity.interval",
        "level=intensity.level",
        "windows",
        "constrained=intensity.constrained",
        "sentence",
    )

    intensity: Quantity
    windows: int

    @classmethod
    def of(cls, draws: FloatArray, *, level: float, windows: int) -> Gusts:
        """Summarises draws (n,) of the intensity. The film says something of it where the posterior
        is narrower than the uniform prior."""
        low, high = (float(end) for end in np.quantile(draws, [(1 - level) / 2, (1 + level) / 2]))
        sigma = float(draws.std())
        intensity = Quantity(
            name="gust_intensity",
            unit="1",
            value=float(draws.mean()),
            sigma=sigma,
            span=Span(low=low, high=high, level=level, bound=None, estimated=True),
            assumed=(0.0, MOST_INTENSE),
            constrained=sigma <= LEAST_NARROWED * MOST_INTENSE / math.sqrt(12),
        )
        return cls(intensity=intensity, windows=windows)

    @property
    def words(self) -> str:
        """Says how strong they are, "14 % of the wind, between 9 and 21 %"."""
        if not self.intensity.constrained or self.intensity.value is None:
            return f"{self.windows} windows do not constrain how strong they are"
        low, high = (f"{100 * end:.0f}" for end in self.intensity.interval)
        return f"{100 * self.intensity.value:.0f} % of the wind, between {low} and {high} %"

    @property
    def sentence(self) -> str:
        """Phrases them, "gusts of 14 % [9, 21]" with the level; without a value where the film
        narrows nothing."""
        if not self.intensity.constrained or self.intensity.value is None:
            return f"gusts: {self.windows} windows do not constrain how strong they are"
        interval = self.intensity.span.word(lambda share: f"{100 * share:.0f}")
        return (
            f"gusts of {100 * self.intensity.value:.0f} % {interval} of the wind, "
            f"{self.intensity.span.percent}"
        )


def log_moments(winds: FloatArray) -> tuple[float, float]:
    """Computes mean and standard deviation of the logarithm of a log-normal distribution with the
    mean M and the standard deviation S of draws (n,) of a wind [m/s]: s² = ln(1 + S²/M²), ln M −
    s²/2.

    Raises:
        InputError: a mean that is not above 0.
    """
    mean = float(winds.mean())
    if not mean > 0:
        raise InputError(
            f"winds of a mean of {mean:g} m/s", fix="give draws of a wind above calm air"
        )
    variance = math.log1p(float(winds.var()) / mean**2)
    return math.log(mean) - variance / 2, math.sqrt(variance)


def gust_covariance(
    starts: FloatArray, *, window: float, intensity: float, time: float
) -> FloatArray:
    """Computes the covariance (k, k) of an Ornstein–Uhlenbeck process averaged over windows.

    With R(t) = e^(−|t|/T) and G″ = R, the covariance of the means over two windows of length w that
    begin d apart is I² [G(d + w) + G(d − w) − 2 G(d)]/w², G(t) = T² e^(−|t|/T) + T |t|.

    Args:
        starts: (k,) of the windows [s].
        window: their length [s].
        intensity: standard deviation of the process.
        time: its integral time T [s].
    """
    apart = np.abs(starts[:, None] - starts[None, :])

    def twice(t: FloatArray) -> FloatArray:
        return time**2 * np.exp(-np.abs(t) / time) + time * np.abs(t)

    return (
        intensity**2
        * (twice(apart + window) + twice(apart - window) - 2 * twice(apart))
        / window**2
    )


def error_correlation(
    starts: FloatArray, *, window: float, halves: float, neighbours: float
) -> FloatArray:
    """Computes the correlation (k, k) of the windows' own errors, as the module's text has it."""
    apart = np.abs(starts[:, None] - starts[None, :]) / window
    return np.interp(apart, [0.0, 0.5, 1.0, 2.0], [1.0, halves, neighbours, 0.0])


@dataclass(frozen=True, kw_only=True, eq=False)
class Course:
    """The winds of a film's windows, given what the network says of each.

    Attributes:
        logs: (k,) means of the logarithm of the wind [m/s], m_w.
        sigmas: (k,) its standard deviations, s_w.
        starts: (k,) of the windows, ascending [s].
        window: their length [s].
        apart: places of windows that do not overlap, on which the gusts rest.
        pair: the errors' standard deviations.
        halves, neighbours: correlations of own errors, see `SeriesErrors`.
        prior: of the gusts.

    Raises:
        InputError: shapes that disagree, or fewer than two windows.
    """

    logs: FloatArray
    sigmas: FloatArray
    starts: FloatArray
    window: float
    apart: Sequence[int]
    pair: Pair
    halves: float
    neighbours: float
    prior: GustPrior

    def __post_init__(self) -> None:
        shapes = {np.shape(self.logs), np.shape(self.sigmas), np.shape(self.starts)}
        if len(shapes) != 1 or len(self.logs) < 2:
            raise InputError(
                f"windows of shapes {shapes}",
                fix="give two windows or more, each with all its numbers",
            )

    @property
    def speed(self) -> float:
        """The wind that carries gusts past the flag [m/s]."""
        return max(math.exp(float(self.logs.mean())), _LEAST_SPEED)

    @cached_property
    def own(self) -> FloatArray:
        """(k, k) covariance of the windows' own errors."""
        correlation = error_correlation(
            self.starts, window=self.window, halves=self.halves, neighbours=self.neighbours
        )
        return self.pair.own**2 * np.outer(self.sigmas, self.sigmas) * correlation

    @property
    def shared(self) -> float:
        """Standard deviation of the error that all windows have in common."""
        return self.pair.shared * math.sqrt(float(np.mean(self.sigmas**2)))

    def gusts(self, intensity: float, length: float) -> FloatArray:
        """(k, k) covariance of the windows' gusts."""
        return gust_covariance(
            self.starts, window=self.window, intensity=intensity, time=length / self.speed
        )

    @cached_property
    def points(self) -> tuple[tuple[float, float], ...]:
        """(intensity, length) of the grid."""
        return tuple(
            (i, length)
            for i in self.prior.intensity.tolist()
            for length in self.prior.length.tolist()
        )

    @cached_property
    def weights(self) -> FloatArray:
        """(g,) probabilities of the grid's points given the film.

        With a flat mean the likelihood of Σ is |Σ|^(−½) (1ᵀΣ⁻¹1)^(−½) exp(−½ rᵀΣ⁻¹r), r about the
        generalised mean. The shared error moves all windows alike and has no part in it.
        """
        chosen = np.ix_(list(self.apart), list(self.apart))
        log = np.array(
            [self._log_likelihood((self.gusts(*point) + self.own)[chosen]) for point in self.points]
        )
        share = np.exp(log - log.max())
        return share / share.sum()

    def _log_likelihood(self, covariance: FloatArray) -> float:
        factor = cho_factor(covariance, lower=True)
        logs = self.logs[list(self.apart)]
        both = cho_solve(factor, np.stack([np.ones_like(logs), logs], axis=1))
        information = float(both[:, 0].sum())
        mean = float(both[:, 1].sum()) / information
        off = logs - mean
        misfit = float(off @ (both[:, 1] - mean * both[:, 0]))
        return -float(np.log(np.diag(factor[0])).sum()) - 0.5 * math.log(information) - 0.5 * misfit

    def given(self, intensity: float, length: float) -> tuple[FloatArray, FloatArray]:
        """Computes mean (k,) and covariance (k, k) of the logarithms of the winds given the gusts'
            two numbers: with K of the gusts, Σ = K + that of own errors and a = 1 − KΣ⁻¹1,

                μ̂ 1 + KΣ⁻¹(m − μ̂ 1),     K − KΣ⁻¹K + a aᵀ/(1ᵀΣ⁻¹1) + σ² 11ᵀ,     with σ
        of the shared error.
        """
        gusts, ones = self.gusts(intensity, length), np.ones_like(self.logs)
        factor = cho_factor(gusts + self.own, lower=True)
        whitened = cho_solve(factor, np.column_stack([ones, self.logs, gusts]))
        information = float(whitened[:, 0].sum())
        mean = float(whitened[:, 1].sum()) / information
        gain = whitened[:, 2:].T  # KΣ⁻¹
        unexplained = ones - gain @ ones
        covariance = (
            gusts - gain @ gusts + np.outer(unexplained, unexplained) / information + self.shared**2
        )
        return mean + gain @ (self.logs - mean), 0.5 * (covariance + covariance.T)

    def draws(self, count: int, generator: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Draws winds (k, count) [m/s] of all windows together, and the gusts' intensity (count,)
        of each draw."""
        kept = np.flatnonzero(self.weights >= _NEGLIGIBLE * self.weights.max())
        ends = np.cumsum(self.weights[kept]) / self.weights[kept].sum()
        place = np.minimum(
            np.searchsorted(ends, (np.arange(count) + generator.uniform()) / count, side="right"),
            len(kept) - 1,
        )
        normal = generator.standard_normal((len(self.logs), count))
        jitter = generator.uniform(-0.5, 0.5, count) * self.prior.cell
        winds, intensity = np.empty((len(self.logs), count)), np.empty(count)
        for number in np.unique(place):
            point, chosen = self.points[kept[number]], np.flatnonzero(place == number)
            mean, covariance = self.given(*point)
            winds[:, chosen] = mean[:, None] + _root(covariance) @ normal[:, chosen]
            intensity[chosen] = point[0]
        order = generator.permutation(count)
        return np.exp(winds[:, order]), (intensity + jitter)[order]


def _root(covariance: FloatArray) -> FloatArray:
    """Computes a square root (k, k) of a covariance, which may be singular."""
    size = float(np.trace(covariance)) / len(covariance)
    return cholesky(covariance + 1e-10 * size * np.eye(len(covariance)), lower=True)
