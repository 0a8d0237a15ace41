"""Whether the base model suffices: how far what recordings show lies along each effect's change.

    z_e = d_eᵀ V⁻¹ (y − f(w)) / √(d_eᵀ V⁻¹ d_e)

y are the summaries of all recordings side by side, f their regression on the logarithm of the area
weight alone, fitted to simulations of the base model, V the covariance of the residuals of these
and of null flags about it, drawn towards equal variances (Ledoit and Wolf). Bending, damping, gain,
view, fabric, meshes, time steps and errors of pixels are
left in V: nothing is fitted to the recordings. d_e is the mean change by effect e over its pairs.
z_0 is the cube root (Wilson and Hilferty) of the whole misfit yᵀV⁻¹y, so that a change along no
effect of the library is seen as well.

Each is brought to the scale of null flags of kinds of numerics that are left out: of V, and of the
flags by which they are judged. T is the largest: of z_e where an effect has one sign, of |z_e|
where it has two, and of z_0; or the one direction that was suspected beforehand. A null flag goes
the whole way as the recordings do, by the flags of all other kinds, so that a kind that is odd does
not judge itself. A weight that is stated to σ is read by a scale of that σ in simulations and null
flags too, which widens V by what it leaves open; null flags whose weight is within a factor of e of
it are those by which recordings are judged.

Given that something is missing, effects have posterior probabilities with equal priors. The
confidence set is the smallest that has 95 % of it; a name is given alone only where one effect has
as much. None is named where what was found lies along no effect's direction. A model with one of
them has to pass the test of its own misfit, against that of null flags with the same effect fitted
to them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import logsumexp

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.errors import InputError
from measure.cloth.design import Weighable
from measure.cloth.model_evidence import Experiments, Misfits, Sight, Weighing
from measure.forecasting.strengths import Suspicion
from measure.nulls.clustered import ClusteredNulls
from measure.verdict.decided import undecided_sentences
from measure.verdict.verdict_record import Conclusion
from models.trained.outliers import shrunk_covariance

ALIKE = 1.0
"""Logarithm of the area weight within which null flags count as alike to a weighed one."""
Mask = BoolArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Directions:
    """Along which changes are looked for.

    Attributes:
        changes: (effect, k) mean change of the summaries by each effect at its expected strength,
            upwards.
        signs: (effect,) 1 where it can only be stronger, 0 where it may have either sign.
        suspected: place and sign of the one that was suspected beforehand; None to look along all.
    """

    changes: FloatArray
    signs: IntArray
    suspected: tuple[int, int] | None = None

    def far(self, z: FloatArray) -> FloatArray:
        """Returns (n, direction) of standardised z (n, effect + 1): how far each goes in the
        direction that counts."""
        if self.suspected is not None:
            direction, sign = self.suspected
            return sign * z[:, direction : direction + 1]
        return np.concatenate([self.along(z), z[:, -1:]], axis=1)

    def along(self, z: FloatArray) -> FloatArray:
        """Returns (n, effect) of each effect's, whether suspected or not."""
        scores = z[:, :-1]
        return np.where(self.signs == 0, np.abs(scores), scores)


@dataclass(frozen=True, kw_only=True, eq=False)
class Axes:
    """Of one V.

    Attributes:
        weights: (k, effect) from residuals to z.
        white: (k, k) from residuals to coordinates in which V is one.
    """

    weights: FloatArray
    white: FloatArray

    @classmethod
    def of(cls, residuals: FloatArray, changes: FloatArray) -> Axes:
        """Finds the axes of residuals (n, k) and changes (effect, k)."""
        spread = residuals.std(axis=0)
        covariance, _ = shrunk_covariance(residuals / spread)
        white = np.linalg.inv(np.linalg.cholesky(covariance)) / spread
        along = white @ changes.T
        length = np.linalg.norm(along, axis=0)
        # An effect that changes nothing has no direction, and a z of 0.
        return cls(weights=white.T @ (along / np.where(length > 0, length, 1.0)), white=white)

    def z(self, residuals: FloatArray) -> FloatArray:
        """Returns (n, effect + 1) z_e, and z_0."""
        k = self.white.shape[0]
        misfit = np.square(residuals @ self.white.T).sum(axis=1)
        root = (np.cbrt(misfit / k) - (1 - 2 / (9 * k))) / math.sqrt(2 / (9 * k))
        return np.concatenate([residuals @ self.weights, root[:, None]], axis=1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Standing:
    """By which experiments are brought to the scale of null flags of kinds that are left out.

    Attributes:
        axes: of V.
        centre, spread: (effect + 1,) of these null flags.
    """

    axes: Axes
    centre: FloatArray
    spread: FloatArray

    def of(self, residuals: FloatArray) -> FloatArray:
        """Standardises to (n, effect + 1) z_e and z_0 of residuals (n, k)."""
        return (self.axes.z(residuals) - self.centre) / self.spread


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """Residuals about the regression on the area weight.

    Attributes:
        observed: (1, k) of the recordings.
        base, null: (n, k) of simulations and null flags.
        kinds: (null,) of numerics.
        comparable: (null,) whose weight is as that of the recordings.
        changes: (effect, k).
    """

    observed: FloatArray
    base: FloatArray
    null: FloatArray
    kinds: IntArray
    comparable: Mask
    changes: FloatArray
    _known: dict[frozenset[int], Axes] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        observed: Experiments,
        base: Experiments,
        nulls: Experiments,
        kinds: IntArray,
        changes: FloatArray,
    ) -> Scene:
        """Fits the regression to summaries and weights as scales read them."""
        at = [_logarithm(experiment, observed) for experiment in (observed, base, nulls)]
        coefficients = np.linalg.lstsq(_regressors(at[1]), base.whole, rcond=None)[0]
        residuals = [
            experiment.whole - _regressors(logarithms) @ coefficients
            for experiment, logarithms in zip((observed, base, nulls), at, strict=True)
        ]
        return cls(
            observed=residuals[0],
            base=residuals[1],
            null=residuals[2],
            kinds=kinds,
            changes=changes,
            comparable=np.asarray(np.abs(at[2]) < ALIKE, dtype=np.bool_),
        )

    def axes(self, *without: int) -> Axes:
        """Returns the axes of V without some kinds."""
        key = frozenset(without)
        if key not in self._known:
            remaining = ~np.isin(self.kinds, list(key))
            self._known[key] = Axes.of(
                np.concatenate([self.base, self.null[remaining]]), self.changes
            )
        return self._known[key]

    def standing(self, without: int | None) -> Standing:
        """Standardises by null flags of all kinds but one; None for all."""
        without_kinds = () if without is None else (without,)
        kinds = [
            kind
            for kind in np.unique(self.kinds[self.comparable]).tolist()
            if kind not in without_kinds
        ]
        if not kinds:
            raise InputError(
                "no null experiment of another kind of numerics has a flag as heavy as the cloth",
                where="area weight",
                fix="check its unit (kg/m²), or simulate more kinds",
            )
        scores = np.concatenate(
            [
                self.axes(*without_kinds, kind).z(self.null[self.comparable & (self.kinds == kind)])
                for kind in kinds
            ]
        )
        spread = scores.std(axis=0, ddof=1)
        return Standing(
            axes=self.axes(*without_kinds),
            centre=scores.mean(axis=0),
            spread=np.where(spread > 0, spread, 1.0),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Scored:
    """What the test found.

    Attributes:
        z: (effect,) standardised, of the recordings.
        whole: z_0 of them.
        statistic: T.
        nulls: T of the null flags that are alike, each judged by all other kinds.
        alone: (effect,) p of each direction by itself.
        family: (effect,) p of each as the largest of all.
        power: (effect,) share of null flags that are beyond the critical value once moved by the
            effect.
        tested: (effect,) the same of those that are looked for: the suspected one, or all.
        pointed: whether what makes the statistic at the level lies along an effect.
        comparable: (null,) which null flags these are.
    """

    z: FloatArray
    whole: float
    statistic: float
    nulls: ClusteredNulls
    alone: FloatArray
    family: FloatArray
    power: FloatArray
    tested: FloatArray
    pointed: bool
    comparable: Mask

    @property
    def p_value(self) -> float:
        """Returns p of the base model."""
        return self.nulls.p(self.statistic)


def score(
    observed: Experiments,
    base: Experiments,
    nulls: Experiments,
    kinds: IntArray,
    directions: Directions,
    *,
    level: float,
) -> Scored:
    """Test one experiment.

    Args:
        observed: of it alone.
        base: simulations of the base model.
        nulls: null flags.
        kinds: (null,) of their numerics.
        level: at which power is stated.
    """
    scene = Scene.of(observed, base, nulls, kinds, directions.changes)
    standing_of_all = scene.standing(None)
    z = standing_of_all.of(scene.observed)
    scores = np.full((len(kinds), len(directions.changes) + 1), np.nan)
    standings = {kind: scene.standing(kind) for kind in np.unique(kinds[scene.comparable]).tolist()}
    for kind, standing in standings.items():
        members = scene.comparable & (kinds == kind)
        scores[members] = standing.of(scene.null[members])
    scores, null_kinds = scores[scene.comparable], kinds[scene.comparable]
    farthest = ClusteredNulls(null=directions.far(scores).max(axis=1), kinds=null_kinds)
    along, alone = directions.along(z)[0], directions.along(scores)
    # As the largest of all directions, whichever was suspected.
    largest = ClusteredNulls(
        null=np.concatenate([alone, scores[:, -1:]], axis=1).max(axis=1), kinds=null_kinds
    )
    family = np.array([largest.p(float(size)) for size in along])
    power = _power(scene, standings, directions, farthest.critical(level))
    suspected = directions.suspected
    return Scored(
        z=z[0, :-1],
        whole=float(z[0, -1]),
        statistic=float(directions.far(z).max()),
        nulls=farthest,
        alone=np.array(
            [
                ClusteredNulls(null=alone[:, column], kinds=null_kinds).p(float(along[column]))
                for column in range(len(along))
            ]
        ),
        family=family,
        power=power,
        tested=power if suspected is None else power[suspected[0] : suspected[0] + 1],
        pointed=suspected is not None or bool((family <= level).any()),
        comparable=scene.comparable,
    )


def _power(
    scene: Scene, by_kind: dict[int, Standing], directions: Directions, critical: float | None
) -> FloatArray:
    """Returns (effect,) share of null flags that are beyond a critical value once each effect acts
    on them."""
    power = np.zeros(len(directions.changes))
    if critical is None:
        return power
    for column, change in enumerate(directions.changes):
        signs = (1, -1) if directions.signs[column] == 0 else (1,)
        if directions.suspected is not None and directions.suspected[0] == column:
            signs = (directions.suspected[1],)
        beyond = [
            directions.far(
                standing.of(scene.null[scene.comparable & (scene.kinds == kind)] + sign * change)
            ).max(axis=1)
            > critical
            for kind, standing in by_kind.items()
            for sign in signs
        ]
        power[column] = float(np.concatenate(beyond).mean())
    return power


def _logarithm(experiments: Experiments, observed: Experiments) -> FloatArray:
    """Returns (n,) of area weights as a scale read them over the stated one; 0 where none was
    stated, so that all are alike."""
    return (
        np.zeros(len(experiments))
        if experiments.stated is None or observed.stated is None
        else np.log(experiments.stated / observed.stated[0])
    )


def _regressors(logarithm: FloatArray) -> FloatArray:
    """Returns (n, 3) quadratic in it."""
    return np.stack([np.ones_like(logarithm), logarithm, logarithm**2], axis=1)


def directions(
    sights: Sequence[Sight], effects: Sequence[Weighable], suspected: Suspicion | None
) -> Directions:
    """Finds the directions along which the recordings are tested: the mean changes of their
    summaries by the effects' pairs.

    Args:
        effects: those that all sights' models know a response of.
        suspected: one of them, along which alone is looked; None for all.

    Raises:
        InputError: too few pairs of the suspected one show the flag.
    """
    names = [effect.name for effect in effects]
    if suspected is not None and suspected.name not in names:
        raise InputError(
            f"too few flags with {suspected.name} show what the recordings show",
            where="--suspect",
            fix="suspect another effect, or leave it out",
        )
    changes = [np.concatenate([sight.responses[name].change for sight in sights]) for name in names]
    size = sum(int(sight.used.sum()) for sight in sights)
    return Directions(
        changes=np.array(changes).reshape(len(names), size),
        signs=np.array([int(effect.low > 0) for effect in effects], dtype=np.int64),
        suspected=None if suspected is None else (names.index(suspected.name), suspected.sign),
    )


TEMPERED = 0.5
"""Share of the Bayes factors' logarithms that counts: regressions of an effect from 16 pairs err in
the same way in all recordings (decision 046). Nearer to 1 names single effects more often, and
wrong ones too."""
CONFIDENCE = 0.95
"""Of the set of effects that may be what is missing. Higher names more effects side by side; lower
leaves out the right one more often."""
PART = 0.25
"""Share of the misfit beyond that of null flags which an effect that is called a part takes
away."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Judged:
    """What was decided.

    Attributes:
        conclusion: see `Conclusion`.
        named: places of the effects named among those weighed, most probable first.
        confident: places of the confidence set's, most probable first.
        probability: (effect,) given that one of them is missing.
        leftover: (effect,) p of what the model with each leaves.
        scored: the test.
        open: why the base model is neither rejected nor said to suffice, sentences; empty where it
            is.
    """

    conclusion: Conclusion
    named: tuple[int, ...]
    confident: tuple[int, ...]
    probability: FloatArray
    leftover: FloatArray
    scored: Scored
    open: tuple[str, ...] = ()

    @property
    def p_value(self) -> float:
        """Returns p of the base model."""
        return self.scored.p_value


def judge(
    weighing: Weighing,
    nulls: Misfits,
    kinds: IntArray,
    scored: Scored,
    *,
    level: float,
    departure: float,
) -> Judged:
    """Judge one experiment.

    Args:
        weighing: of it alone.
        nulls: what models leave of null flags.
        kinds: (null,) of their numerics.
        scored: how it was tested.
        level: of the tests.
        departure: root mean square departure of its observables from the base model fitted to it
            [their scatters].
    """
    nulls, kinds = nulls.rows(np.flatnonzero(scored.comparable).tolist()), kinds[scored.comparable]
    factors = weighing.factors[0]
    probability = np.exp(TEMPERED * factors - logsumexp(TEMPERED * factors))
    order = np.argsort(-probability)
    count = 1 + int(np.searchsorted(np.cumsum(probability[order]), CONFIDENCE - 1e-9))
    confident = tuple(int(column) for column in order[:count])
    leftover = np.array(
        [
            ClusteredNulls(null=nulls.left[:, column], kinds=kinds).p(
                float(weighing.misfits.left[0, column])
            )
            for column in range(len(weighing.effects))
        ]
    )

    def conclude(
        conclusion: Conclusion, indices: tuple[int, ...] = (), reasons: tuple[str, ...] = ()
    ) -> Judged:
        return Judged(
            conclusion=conclusion,
            named=indices,
            confident=confident,
            probability=probability,
            leftover=leftover,
            scored=scored,
            open=reasons,
        )

    if not scored.nulls.tests(level):
        return conclude(Conclusion.UNTESTED)
    if scored.p_value > level:
        reasons = undecided_sentences(
            scored.p_value, level=level, departure=departure, power=scored.tested.tolist()
        )
        return conclude(Conclusion.UNDECIDED if reasons else Conclusion.SUFFICIENT, reasons=reasons)
    if not scored.pointed:
        return conclude(Conclusion.OUTSIDE)
    if any(leftover[column] > level for column in confident):
        return conclude(Conclusion.EFFECT if len(confident) == 1 else Conclusion.ONE_OF, confident)
    excess = float(weighing.misfits.base[0] - np.median(nulls.base))
    explained = float(weighing.misfits.base[0] - weighing.misfits.left[0, confident[0]])
    part = explained >= PART * excess
    return conclude(Conclusion.PARTLY, confident[:1]) if part else conclude(Conclusion.OUTSIDE)
