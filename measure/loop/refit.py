"""The first candidates refitted beyond the linear model, before one of them is named.

Strong effects are far from linear: a lift of 1.4 shows as 0.3 where sensitivities are taken at none, and predicts
unseen recordings worse than nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from measure.forecasting.model import Model
from measure.forecasting.observer import Forecaster
from measure.forecasting.regressors import columns, names
from measure.forecasting.segments import Segments
from measure.inference.evidence import Evidence, left_together
from measure.inference.whitened_misfit import WhitenedMisfit
from measure.loop.gauss_newton import DivergedError, Refined, refine
from measure.loop.profile import Profile, profiled
from measure.loop.validation import LeftOut, left_out
from measure.nulls.reference import Reference

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Fits:
    """Models of one experiment beyond the linear: each is fitted once, and once without the same segments.

    Attributes:
        whitened: the measure; the model of its statistics is where the fits begin.
        settling: (segment, quantity) what recordings settle at less what a model does; None where it is not looked at.
    """

    forecaster: Forecaster
    segments: Segments
    whitened: WhitenedMisfit
    settling: Callable[[Model], Floats] | None = None
    _made: dict[tuple[int, ...], Refined | None] = field(default_factory=dict)
    _left: dict[tuple[tuple[int, ...], bytes], LeftOut] = field(default_factory=dict)
    _errors: dict[tuple[int, ...], Tensor] = field(default_factory=dict)

    def of(self, chosen: Sequence[int]) -> Refined | None:
        """The base model with some columns of the library; None if its cloth diverges."""
        key = tuple(chosen)
        if key not in self._made:
            try:
                self._made[key] = refine(self.forecaster, self.segments, self.whitened, key, weighed=columns())
            except DivergedError:
                self._made[key] = None
        return self._made[key]

    def left_out(self, fitted: Refined, outsides: Sequence[NDArray[np.bool_]]) -> list[LeftOut]:
        """What one of these models leaves, each time fitted to the other segments alone."""
        keys = [(fitted.chosen, outside.tobytes()) for outside in outsides]
        new = [place for place, key in enumerate(keys) if key not in self._left]
        if new:
            own = [outsides[place] for place in new]
            made = left_out(self.forecaster, self.segments, fitted, self.whitened, own)
            self._left.update(zip([keys[place] for place in new], made, strict=True))
        return [self._left[key] for key in keys]

    def errors(self, fitted: Refined) -> Tensor:
        """(frame, marker, 3, segment) that one of these models leaves [m]."""
        if fitted.chosen not in self._errors:
            self._errors[fitted.chosen], _ = self.forecaster.run(
                *fitted.model.system(self.forecaster, self.segments), self.segments
            )
        return self._errors[fitted.chosen]

    def evidence(self, fitted: Refined) -> Evidence:
        """Of what one of these models leaves."""
        found = self.whitened.of(self.errors(fitted))
        return found if self.settling is None else replace(found, settled=self.settling(fitted.model))

    @property
    def base(self) -> Refined:
        """Without any.

        Raises:
            DivergedError: see `refine`.
        """
        made = self.of(())
        if made is None:
            raise DivergedError("the base model's cloth does not stay one", fix="check cloth, pins and wind")
        return made


@dataclass(frozen=True, kw_only=True, eq=False)
class Refit:
    """A refitted candidate.

    Attributes:
        coefficient: fitted to all recordings.
        gains: (segment,) held-out gain: see `inference.gains`.
        leftover: p-value of the global test on what it leaves.
        evidence: of what it leaves.
        profile: of the misfit across its strengths; None where it was not looked at.
    """

    coefficient: float
    gains: Floats
    leftover: float
    evidence: Evidence
    profile: Profile | None = None


def refit(fits: Fits, reference: Reference, candidates: Sequence[int], *, workers: int = 1) -> dict[int, Refit | None]:
    """Column → what its model does; None where its cloth diverges, fitted to all recordings or without one.

    Args:
        workers: threads; each model is run in one.
    """
    together = left_together(fits.whitened.found.recording)
    parts = [together == index for index in np.unique(together)]

    def left(fitted: Refined) -> list[Floats]:
        return [left.misfit for left in fits.left_out(fitted, parts)]

    def one(column: int) -> Refit | None:
        fitted = fits.of((column,))
        if fitted is None:
            return None
        evidence = fits.evidence(fitted)
        gains = np.zeros(len(together))
        for outside, old, new in zip(parts, before, left(fitted), strict=True):
            gains[outside] = old - new
        if not np.isfinite(gains).all():
            return None
        return Refit(
            coefficient=fitted.model.effects[0][1],
            gains=gains,
            leftover=reference.p_left_by(evidence, names(), [column]),
            evidence=evidence,
            profile=profiled(fits.forecaster, fits.segments, fits.whitened, fitted.model),
        )

    with ThreadPoolExecutor(max_workers=workers) as pool:
        list(pool.map(fits.of, [(), *((column,) for column in candidates)]))
        before = left(fits.base)
        return dict(zip(candidates, pool.map(one, candidates), strict=True))
