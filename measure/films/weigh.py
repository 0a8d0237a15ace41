"""Every effect weighed on many experiments at once: the recordings, and null experiments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.rng import stream
from measure.calibrate.prior import CLOTH, Floats
from measure.films.evidence import Experiments, Fit, Hypothesis, Sight
from measure.films.library import Weighable


@dataclass(frozen=True, kw_only=True, eq=False)
class Weighing:
    """What experiments say of each effect.

    Attributes:
        effects: that were weighed.
        base: (n,) logarithm of the base model's evidence.
        misfit: (n,) of the base model at its mode.
        cloth: (n, 3) normal scores of area weight, bending and damping there.
        factors: (n, effect) logarithms of the Bayes factors against the base model [nat].
        left: (n, effect) misfit of the model with each.
    """

    effects: tuple[Weighable, ...]
    base: Floats
    misfit: Floats
    cloth: Floats
    factors: Floats
    left: Floats

    def rows(self, which: slice | Sequence[int]) -> Weighing:
        """Of some experiments."""
        own = which if isinstance(which, slice) else np.asarray(which, dtype=np.int64)
        return Weighing(
            effects=self.effects, base=self.base[own], misfit=self.misfit[own], cloth=self.cloth[own],
            factors=self.factors[own],
            left=self.left[own],
        )  # fmt: skip


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
    empty = np.zeros((len(base.evidence), 0))
    return Weighing(
        effects=tuple(effects), base=base.evidence, misfit=base.misfit, cloth=base.mode[:, : len(CLOTH)],
        factors=np.stack([one.evidence - base.evidence for one in fits], axis=1) if fits else empty,
        left=np.stack([one.misfit for one in fits], axis=1) if fits else empty,
    )  # fmt: skip


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
