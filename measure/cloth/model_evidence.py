"""How well the base model and each effect predict what recordings show, averaged over all that is
not known.

    p(y | e) = ∫ p(θ) p(s) ∏_j p(place_j) t(y_j | θ, s, place_j)

in normal scores, in which the prior is standard normal, by importance sampling from normal
distributions about the posterior's modes (two, since a strength may have two signs), which
Gauss–Newton steps find. Many experiments are
evaluated at once: null experiments go the same way as the recordings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import gammaln, logsumexp, ndtr

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from measure.cloth.design import Weighable
from measure.cloth.emulator import Scatter, scatter
from measure.cloth.flag_prior import Uncertain
from measure.cloth.sight import Sight, dimension, values

_STEPS = 14
_DIFFERENCE = 1e-3
_STARTS = (-0.7, 0.7)
"""Normal scores of the strength at which a search begins."""
_DRAWS = 256
"""Importance samples of each experiment. More lower the error of a Bayes factor with the root of
their number, and take time in proportion."""
_WIDER = 1.3
"""Standard deviations of what they are drawn from over those of the posterior's normal
approximation. Nearer to 1 misses posteriors with heavier tails; larger wastes draws."""
_TAIL = 6.0
"""Degrees of freedom of what they are drawn from."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Experiments:
    """What is fitted, each by itself.

    Attributes:
        summaries: for each recording (n, used summary).
        stated: (n,) area weights that a scale showed [kg/m²]; None where none was.
        sigma: standard uncertainty of these, as a share.
    """

    summaries: tuple[FloatArray, ...]
    stated: FloatArray | None = None
    sigma: float = 0.0

    def __len__(self) -> int:
        return len(self.summaries[0])

    @cached_property
    def whole(self) -> FloatArray:
        """Returns (n, k) of all recordings side by side."""
        return np.concatenate(self.summaries, axis=1)

    def repeated(self, times: int) -> Experiments:
        """Repeats each so many times, one after the other."""
        return Experiments(
            summaries=tuple(np.repeat(rows, times, axis=0) for rows in self.summaries),
            sigma=self.sigma,
            stated=None if self.stated is None else np.repeat(self.stated, times),
        )

    def off(self, weight: FloatArray) -> FloatArray:
        """Returns (n,) by how many standard deviations stated weights are off from (n,) [kg/m²]; 0
        where none was stated."""
        return (
            np.zeros(len(weight))
            if self.stated is None
            else np.log(self.stated / weight) / self.sigma
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """A model fitted to experiments.

    Attributes:
        evidence: (n,) logarithms of p(y | e).
        misfit: (n,) squared standardised distance at the mode, that of the scores from their prior
            included.
        scores: (n, draw, dimension) of importance samples.
        weights: (n, draw) of them, of sum 1.
    """

    evidence: FloatArray
    misfit: FloatArray
    scores: FloatArray
    weights: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Hypothesis:
    """The base model, or it with an effect, for several recordings of one cloth.

    Attributes:
        sights: of the recordings.
        effect: the strength's prior; None for the base model.
    """

    sights: tuple[Sight, ...]
    effect: Uncertain | None = None

    @cached_property
    def scatter(self) -> Scatter:
        """Estimates the scatter of all recordings' summaries about their prediction."""
        return scatter([sight.emulator for sight in self.sights])

    @property
    def dimension(self) -> int:
        """Counts coordinates of the scores: cloth, then each recording's place, then the
        strength."""
        return dimension(self.sights) + (self.effect is not None)

    def values(
        self, scores: FloatArray
    ) -> tuple[dict[str, FloatArray], list[dict[str, FloatArray]], FloatArray | None]:
        """Cloths, places of each recording, and strengths beyond null, at normal scores (n,
        dimension)."""
        cloth, places = values(scores, self.sights)
        return cloth, places, None if self.effect is None else self.effect.at(ndtr(scores[:, -1]))

    def predicted(self, scores: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Means (n, k) of all recordings' summaries, factors (n,) of their scatter, area weights
        (n,) [kg/m²]."""
        cloth, places, strength = self.values(scores)
        name = None if self.effect is None else self.effect.name
        predictions = [
            sight.predict({**cloth, **view}, name, strength)
            for sight, view in zip(self.sights, places, strict=True)
        ]
        mean = np.concatenate([part for part, _ in predictions], axis=1)
        return mean, np.mean([part for _, part in predictions], axis=0), cloth["area_weight"]

    def log_posterior(self, scores: FloatArray, observed: Experiments) -> FloatArray:
        """Returns (n,) logarithm of likelihood times prior, but for a constant of stated
        weights."""
        mean, stretch, weight = self.predicted(scores)
        total = -0.5 * np.square(scores).sum(axis=1) - 0.5 * scores.shape[1] * np.log(2 * np.pi)
        total += self.scatter.log_density(observed.whole - mean, stretch)
        return total - 0.5 * np.square(observed.off(weight))

    def fit(self, observed: Experiments, rng: np.random.Generator) -> Fit:
        """Fit it to experiments, each by itself."""
        n, d = len(observed), self.dimension
        modes = self._modes(observed)
        drawn, density = [], []
        size = _DRAWS // len(modes)
        for at, curvature, _ in modes:
            root = np.linalg.cholesky(np.linalg.inv(curvature)) * _WIDER
            heavy = np.sqrt(_TAIL / rng.chisquare(_TAIL, (n, size, 1)))
            drawn.append(
                at[:, None]
                + np.einsum("nij,nmj->nmi", root, rng.standard_normal((n, size, d))) * heavy
            )
        scores = np.concatenate(drawn, axis=1)
        for at, curvature, _ in modes:
            density.append(_log_t(scores - at[:, None], curvature / _WIDER**2))
        proposal = logsumexp(density, axis=0) - np.log(len(modes))
        flat = scores.reshape(-1, d)
        ratio = (
            self.log_posterior(flat, observed.repeated(scores.shape[1])).reshape(n, -1) - proposal
        )
        evidence = logsumexp(ratio, axis=1) - np.log(scores.shape[1])
        misfits = np.array([misfit for _, _, misfit in modes])
        return Fit(
            evidence=evidence,
            misfit=misfits.min(axis=0),
            scores=scores,
            weights=np.exp(ratio - logsumexp(ratio, axis=1, keepdims=True)),
        )

    def misfit(self, observed: Experiments) -> FloatArray:
        """Returns (n,) the misfit of `fit`, without the rest of it."""
        return np.array([misfit for _, _, misfit in self._modes(observed)]).min(axis=0)

    def _modes(self, observed: Experiments) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
        """Finds modes of the posterior, from each start, as `_climbed`."""
        modes = []
        for begin in _STARTS if self.effect is not None else (0.0,):
            at = np.zeros((len(observed), self.dimension))
            if self.effect is not None:
                at[:, -1] = begin
            modes.append(self._climb(at, observed))
        return modes

    def _climb(
        self, at: FloatArray, observed: Experiments
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Climbs to a mode (n, d) from a start, the curvature there (n, d, d), and the misfit
        (n,)."""
        value, damping = self.log_posterior(at, observed), np.full(len(at), 1.0)
        for _ in range(_STEPS):
            gradient, curvature = self._slope(at, observed)
            step = np.linalg.solve(
                curvature * (1 + damping[:, None, None] * np.eye(at.shape[1])), gradient[..., None]
            )
            tried = np.clip(at + np.clip(step[..., 0], -2.0, 2.0), -5.0, 5.0)
            stepped = self.log_posterior(tried, observed)
            better = stepped > value
            at, value = np.where(better[:, None], tried, at), np.where(better, stepped, value)
            damping = np.where(better, damping / 5, damping * 4).clip(1e-6, 1e6)
        _, curvature = self._slope(at, observed)
        mean, stretch, weight = self.predicted(at)
        misfit = np.square(at).sum(axis=1) + np.square(observed.off(weight))
        return at, curvature, misfit + self.scatter.distance(observed.whole - mean, stretch)

    def _slope(self, at: FloatArray, observed: Experiments) -> tuple[FloatArray, FloatArray]:
        """Computes gradient (n, d) and Gauss–Newton's curvature (n, d, d) of minus the logarithm,
        at scores (n, d)."""
        n, d = at.shape
        moved = at[:, None] + _DIFFERENCE * np.concatenate([np.zeros((1, d)), np.eye(d)])
        gradient, curvature = -at.copy(), np.broadcast_to(np.eye(d), (n, d, d)).copy()
        mean, stretch, weight = self.predicted(moved.reshape(-1, d))
        if observed.stated is not None:
            off = observed.repeated(d + 1).off(weight).reshape(n, d + 1)
            slopes_of = (off[:, :1] - off[:, 1:]) / _DIFFERENCE
            gradient += slopes_of * off[:, :1]
            curvature += slopes_of[:, :, None] * slopes_of[:, None]
        mean, scale = mean.reshape(n, d + 1, -1), np.sqrt(stretch.reshape(n, d + 1)[:, :1])
        white = ((observed.whole - mean[:, 0]) @ self.scatter.white.T) / scale
        slopes = ((mean[:, 1:] - mean[:, :1]) / _DIFFERENCE) @ self.scatter.white.T / scale[:, None]
        freedom = self.scatter.freedom
        heavy = (freedom + white.shape[1]) / (freedom + np.square(white).sum(axis=1))
        gradient += heavy[:, None] * np.einsum("ndk,nk->nd", slopes, white)
        curvature += heavy[:, None, None] * np.einsum("ndk,nek->nde", slopes, slopes)
        return gradient, curvature


def _log_t(offset: FloatArray, precision: FloatArray) -> FloatArray:
    """Returns (n, m) logarithm of multivariate t with `_TAIL` degrees of freedom, at offsets (n, m,
    d) from its middle."""
    d = offset.shape[2]
    distance = np.einsum("nmi,nij,nmj->nm", offset, precision, offset)
    _, determinant = np.linalg.slogdet(precision)
    constant = gammaln((_TAIL + d) / 2) - gammaln(_TAIL / 2) - 0.5 * d * np.log(_TAIL * np.pi)
    return constant + 0.5 * determinant[:, None] - 0.5 * (_TAIL + d) * np.log1p(distance / _TAIL)


def quantiles(values: FloatArray, weights: FloatArray, shares: Sequence[float]) -> list[float]:
    """Returns quantiles of weighted draws (m,)."""
    order = np.argsort(values)
    total: FloatArray = np.cumsum(weights[order])
    return [
        float(values[order][min(int(np.searchsorted(total, share)), len(order) - 1)])
        for share in shares
    ]


@dataclass(frozen=True, kw_only=True, eq=False)
class Misfits:
    """What models leave of experiments at their modes.

    Attributes:
        base: (n,) of the base model.
        left: (n, effect) of the model with each.
    """

    base: FloatArray
    left: FloatArray

    def rows(self, which: Sequence[int]) -> Misfits:
        """Selects some experiments."""
        chosen = np.asarray(which, dtype=np.int64)
        return Misfits(base=self.base[chosen], left=self.left[chosen])


@dataclass(frozen=True, kw_only=True, eq=False)
class Weighing:
    """What experiments say of each effect.

    Attributes:
        effects: that were weighed.
        factors: (n, effect) logarithms of the Bayes factors against the base model [nat].
        misfits: what the models leave.
    """

    effects: tuple[Weighable, ...]
    factors: FloatArray
    misfits: Misfits


def hypothesis(sights: Sequence[Sight], effect: Weighable | None) -> Hypothesis:
    """Returns the base model, or it with an effect."""
    return Hypothesis(sights=tuple(sights), effect=None if effect is None else effect.prior)


def weigh(
    sights: Sequence[Sight],
    observed: Experiments,
    effects: Sequence[Weighable],
    *,
    seed: int,
) -> Weighing:
    """Weighs effects on experiments, each by itself.

    Args:
        effects: those that all sights' models know a response of.
    """
    base = fit_model(sights, observed, None, seed=seed)
    fits = [fit_model(sights, observed, effect, seed=seed) for effect in effects]
    return Weighing(
        effects=tuple(effects),
        factors=_side_by_side([fit.evidence - base.evidence for fit in fits], len(observed)),
        misfits=Misfits(
            base=base.misfit, left=_side_by_side([fit.misfit for fit in fits], len(observed))
        ),
    )


def misfits(
    sights: Sequence[Sight], observed: Experiments, effects: Sequence[Weighable]
) -> Misfits:
    """Returns the misfits of `weigh`, without Bayes factors."""
    leftovers = [hypothesis(sights, effect).misfit(observed) for effect in effects]
    return Misfits(
        base=hypothesis(sights, None).misfit(observed), left=_side_by_side(leftovers, len(observed))
    )


def _side_by_side(columns: Sequence[FloatArray], count: int) -> FloatArray:
    """Stacks columns to (count, column), also of none."""
    return np.stack(columns, axis=1) if columns else np.zeros((count, 0))


def fit_model(
    sights: Sequence[Sight],
    observed: Experiments,
    effect: Weighable | None,
    *,
    seed: int,
) -> Fit:
    """Fits one model to experiments; as `weigh`."""
    rng = stream(seed, "films", "weigh", "base" if effect is None else effect.name)
    return hypothesis(sights, effect).fit(observed, rng)


def expected_strength(sights: Sequence[Sight], effect: Weighable) -> float:
    """Returns the strength at which these changes are, beyond null."""
    return float(np.mean([sight.responses[effect.name].expected for sight in sights]))
