"""Every effect weighed on many experiments at once: the recordings, and null experiments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.arrays import FloatArray
from flagdata.errors import InputError
from flagdata.rng import stream
from measure.films.evidence import Experiments, Fit, Hypothesis, Sight
from measure.films.library import Weighable
from measure.films.score_test import Directions
from measure.forecasting.strengths import Suspicion


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
        """Of some experiments."""
        own = np.asarray(which, dtype=np.int64)
        return Misfits(base=self.base[own], left=self.left[own])


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

    def rows(self, which: Sequence[int]) -> Weighing:
        """Of some experiments."""
        own = np.asarray(which, dtype=np.int64)
        return Weighing(effects=self.effects, factors=self.factors[own], misfits=self.misfits.rows(which))


def hypothesis(sights: Sequence[Sight], effect: Weighable | None) -> Hypothesis:
    """The base model, or it with an effect."""
    return Hypothesis(sights=tuple(sights), effect=None if effect is None else effect.prior)


def weigh(
    sights: Sequence[Sight],
    observed: Experiments,
    effects: Sequence[Weighable],
    *,
    seed: int,
) -> Weighing:
    """Weigh effects on experiments, each by itself.

    Args:
        effects: those that all sights' models know a response of.
    """
    base = fitted(sights, observed, None, seed=seed)
    fits = [fitted(sights, observed, effect, seed=seed) for effect in effects]
    return Weighing(
        effects=tuple(effects),
        factors=_side_by_side([one.evidence - base.evidence for one in fits], len(observed)),
        misfits=Misfits(base=base.misfit, left=_side_by_side([one.misfit for one in fits], len(observed))),
    )


def misfits(sights: Sequence[Sight], observed: Experiments, effects: Sequence[Weighable]) -> Misfits:
    """Those of `weigh`, without Bayes factors."""
    left = [hypothesis(sights, effect).misfit(observed) for effect in effects]
    return Misfits(base=hypothesis(sights, None).misfit(observed), left=_side_by_side(left, len(observed)))


def _side_by_side(columns: Sequence[FloatArray], count: int) -> FloatArray:
    """(count, column), also of none."""
    return np.stack(columns, axis=1) if columns else np.zeros((count, 0))


def fitted(
    sights: Sequence[Sight],
    observed: Experiments,
    effect: Weighable | None,
    *,
    seed: int,
) -> Fit:
    """One model fitted to experiments; as `weigh`."""
    rng = stream(seed, "films", "weigh", "base" if effect is None else effect.name)
    return hypothesis(sights, effect).fit(observed, rng)


def directions(sights: Sequence[Sight], effects: Sequence[Weighable], suspected: Suspicion | None) -> Directions:
    """Along which the recordings are tested: the mean changes of their summaries by the effects' pairs.

    Args:
        effects: those that all sights' models know a response of.
        suspected: one of them, along which alone is looked; None for all.

    Raises:
        InputError: too few pairs of the suspected one show the flag.
    """
    names = [one.name for one in effects]
    if suspected is not None and suspected.name not in names:
        raise InputError(
            f"too few flags with {suspected.name} show what the recordings show",
            where="--suspect",
            fix="suspect another effect, or leave it out",
        )
    changes = [np.concatenate([own.model.responses[name].change for own in sights]) for name in names]
    size = sum(int(own.model.used.sum()) for own in sights)
    return Directions(
        changes=np.array(changes).reshape(len(names), size),
        signs=np.array([int(one.low > 0) for one in effects], dtype=np.int64),
        suspected=None if suspected is None else (names.index(suspected.name), suspected.sign),
    )


def expected(sights: Sequence[Sight], effect: Weighable) -> float:
    """The strength at which these changes are, beyond null."""
    return float(np.mean([own.model.responses[effect.name].expected for own in sights]))
