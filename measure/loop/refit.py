"""The first candidates refitted beyond the linear model, before one of them is named.

Strong effects are far from linear: a lift of 1.4 shows as 0.3 where sensitivities are taken at
none, and predicts unseen recordings worse than nothing.

The misfit across the strengths of an effect: where a likelihood is flat towards an end, a strength
is a bound.

A fit begins where least is left and ends where its steps stay, and its standard error is the slope
there. Of an effect
that saturates both say nothing: beyond some stiffness an attached hoist stands still whatever it
is, so that a fit ends anywhere (decision 041 has 25, 35 and 2e10 N/m² for 17,000). The profile
shows it: from some strength on, all leave the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from torch import Tensor

from flagdata.answer import Bound, Quantity, Span
from flagdata.core.arrays import BoolArray, FloatArray
from measure.forecasting.calibrated_parameters import Calibration
from measure.forecasting.model import Model, errors_of
from measure.forecasting.observer import Forecaster
from measure.forecasting.regressors import EffectColumn, columns
from measure.forecasting.segments import Segments
from measure.inference.segment_evidence import Evidence, left_together
from measure.inference.whitened_misfit import WhitenedMisfit
from measure.loop.gauss_newton import FitDivergedError, Refined, refine
from measure.loop.validation import LeftOut, left_out
from measure.nulls.null_simulation import FreeRunDivergedError
from measure.nulls.reference import Reference
from measure.posterior_ends import of_profile
from measure.verdict.criteria import CRITERIA
from sim.effects.parameter import Parameter

COUNT = 16
"""Strengths that are looked at, spaced by factors."""
BEYOND = 10.0
"""Factor by which they reach beyond what is expected, and beyond the fit, to either side."""
_WITHIN_THE_END, _AT_THE_END = 1 - 1e-6, 1 - 1e-5
"""Shares of the most that an effect may have: where strengths end, so that none is beyond it by
rounding, and from where on they reach it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """What models leave across the strengths of an effect, the cloth calibrated anew with each.

    Attributes:
        column: the effect's.
        sizes: (n,) ascending, distances of the strength from null.
        sign: of the strengths beyond null.
        misfit: (n,) squared distance that is left; infinite where the cloth does not stay one.
    """

    column: EffectColumn
    sizes: FloatArray
    sign: int
    misfit: FloatArray

    def estimate(self, *, larger: float) -> Quantity | None:
        """Estimates the strength as a bound; None where the profile has two ends, and the fit says
        more, or where strengths of the other sign lie beyond an end.

        What the fit's mesh and a mistold cloth do to an effect is a factor, and widens a bound as
        it does intervals.

        Args:
            larger: by how much standard errors are larger than the misfit says.
        """
        if not np.isfinite(self.misfit).any():
            return None
        span = self.span(larger=larger)
        described = self.column.described
        through = span.bound is Bound.MOST and not one_sided(described)
        if span.bound is None or span.estimated or through:
            return None
        factor = math.exp(CRITERIA.reach * CRITERIA.strength_factor)
        null, unit = described.null, self.column.unit
        best = float(self.sizes[int(np.argmin(self.misfit))])
        size = {Bound.LEAST: span.low / factor, Bound.MOST: span.high * factor}.get(
            span.bound, best
        )
        ends = (
            0.0 if span.bound is not Bound.LEAST else size,
            size if span.bound is Bound.MOST else span.high,
        )
        low, high = sorted(null + self.sign * end for end in ends)
        turned = {Bound.LEAST: Bound.MOST, Bound.MOST: Bound.LEAST}
        bound = span.bound if self.sign > 0 else turned.get(span.bound, span.bound)
        return Quantity.of(
            value=null + self.sign * size,
            low=low,
            high=high,
            unit=unit,
            level=span.level,
            bound=bound,
        )

    def span(self, *, larger: float) -> Span:
        """Computes the span of the distance from null, which cannot be less than none; as
        `estimate`."""
        described = self.column.described
        end = described.admissible[1] if self.sign > 0 else -described.admissible[0]
        farthest = end - self.sign * described.null
        if self.sizes[-1] > _AT_THE_END * farthest:
            farthest = float(self.sizes[-1])
        # In the logarithm, in which strengths are spaced.
        logarithmic = of_profile(
            np.log(self.sizes),
            self.misfit,
            level=CRITERIA.interval,
            larger=larger,
            limits=(-math.inf, math.log(farthest)),
        )
        return replace(
            logarithmic, low=math.exp(logarithmic.low), high=float(np.exp(logarithmic.high))
        )


def profile_strength(
    forecaster: Forecaster,
    segments: Segments,
    whitened: WhitenedMisfit,
    model: Model,
    index: int = 0,
) -> Profile:
    """Computes the misfit of a model across the strengths of one of its effects, the others as they
    are.

    Args:
        index: of the effect.
    """
    column, coefficient = model.effects[index]
    sizes, sign = across(column, coefficient)
    effects = [
        (*model.effects[:index], (column, sign * float(size)), *model.effects[index + 1 :])
        for size in sizes
    ]
    centre = Calibration().steps_from(model.calibration)
    misfits = []
    for errors in errors_of(
        [replace(model, effects=changed) for changed in effects], forecaster, segments
    ):
        finite = bool(errors.isfinite().all())
        misfits.append(whitened.of(errors).fit((), centre=centre).remainder if finite else math.inf)
    return Profile(column=column, sizes=sizes, sign=sign, misfit=np.array(misfits))


def one_sided(described: Parameter) -> bool:
    """Returns whether all strengths that are expected lie on one side of null."""
    low, high = (end - described.null for end in described.prior)
    return low * high >= 0


def across(column: EffectColumn, coefficient: float) -> tuple[FloatArray, int]:
    """Spaces distances from null, (n,), ascending, from well below what is expected and what was
    fitted to well beyond, as far as the effect may have them; returns them with the sign of the
    strengths."""
    described = column.described
    ends, single = [end - described.null for end in described.prior], one_sided(described)
    sign = int(np.sign(sum(ends) if single or not coefficient else coefficient))
    expected = sorted(abs(end) for end in ends if end * sign > 0)
    sizes = [
        *(expected if single else expected[-1:]),
        *([abs(coefficient)] if coefficient * sign > 0 else []),
    ]
    farthest = abs(described.nearest(described.null + sign * BEYOND * max(sizes)) - described.null)
    return np.geomspace(min(sizes) / BEYOND, _WITHIN_THE_END * farthest, COUNT), sign


@dataclass(frozen=True, kw_only=True, eq=False)
class Fits:
    """Models of one experiment beyond the linear: each is fitted once, and once without the same
    segments.

    Attributes:
        whitened: the measure; the model of its statistics is where the fits begin.
        settling: (segment, quantity) what recordings settle at less what a model does; None where
            it is not looked at.
    """

    forecaster: Forecaster
    segments: Segments
    whitened: WhitenedMisfit
    settling: Callable[[Model], FloatArray] | None = None
    _made: dict[tuple[int, ...], Refined | None] = field(default_factory=dict)
    _left: dict[tuple[tuple[int, ...], bytes], LeftOut] = field(default_factory=dict)
    _errors: dict[tuple[int, ...], Tensor] = field(default_factory=dict)

    def of(self, chosen: Sequence[int]) -> Refined | None:
        """Fits the base model with some columns of the library; None if its cloth diverges."""
        key = tuple(chosen)
        if key not in self._made:
            try:
                self._made[key] = refine(
                    self.forecaster, self.segments, self.whitened, key, columns=columns()
                )
            except FitDivergedError:
                self._made[key] = None
        return self._made[key]

    def left_out(self, fitted: Refined, outsides: Sequence[BoolArray]) -> list[LeftOut]:
        """Computes what one of these models leaves, each time fitted to the other segments
        alone."""
        keys = [(fitted.chosen, outside.tobytes()) for outside in outsides]
        new = [index for index, key in enumerate(keys) if key not in self._left]
        if new:
            new_outsides = [outsides[index] for index in new]
            fitted_anew = left_out(
                self.forecaster, self.segments, fitted, self.whitened, new_outsides
            )
            self._left.update(zip([keys[index] for index in new], fitted_anew, strict=True))
        return [self._left[key] for key in keys]

    def errors(self, fitted: Refined) -> Tensor:
        """Computes the errors (frame, marker, 3, segment) that one of these models leaves [m]."""
        if fitted.chosen not in self._errors:
            self._errors[fitted.chosen], _ = self.forecaster.run(
                *fitted.model.system(self.forecaster, self.segments), self.segments
            )
        return self._errors[fitted.chosen]

    def evidence(self, fitted: Refined) -> Evidence:
        """Computes the evidence of what one of these models leaves."""
        whitened_evidence = self.whitened.of(self.errors(fitted))
        return (
            whitened_evidence
            if self.settling is None
            else replace(whitened_evidence, settled=self.settling(fitted.model))
        )

    @property
    def base(self) -> Refined:
        """Fits the base model without any column.

        Raises:
            DivergedError: see `refine`.
        """
        fitted = self.of(())
        if fitted is None:
            raise FitDivergedError(
                "the base model's cloth does not stay one", fix="check cloth, pins and wind"
            )
        return fitted


@dataclass(frozen=True, kw_only=True, eq=False)
class Refit:
    """A refitted candidate.

    Attributes:
        coefficient: fitted to all recordings.
        gains: (segment,) held-out gain: see `inference.gains`.
        leftover: p of the test along all other effects on what it leaves.
        evidence: of what it leaves.
        profile: of the misfit across its strengths; None where it was not looked at.
    """

    coefficient: float
    gains: FloatArray
    leftover: float
    evidence: Evidence
    profile: Profile | None = None


def refit(
    fits: Fits, reference: Reference, candidates: Sequence[int], *, workers: int = 1
) -> dict[int, Refit | None]:
    """Refits the model with each column: column → what its model does; None where its cloth
    diverges, fitted to all recordings, without one or run freely.

    Args:
        workers: threads; each model is run in one.
    """
    together = left_together(fits.whitened.statistics.recording)
    parts = [together == index for index in np.unique(together)]

    def misfits_of(fitted: Refined) -> list[FloatArray]:
        return [fold.misfit for fold in fits.left_out(fitted, parts)]

    def refit_of(column: int) -> Refit | None:
        fitted = fits.of((column,))
        if fitted is None:
            return None
        try:
            evidence = fits.evidence(fitted)
        except FreeRunDivergedError:
            return None
        gains = np.zeros(len(together))
        for outside, old, new in zip(parts, before, misfits_of(fitted), strict=True):
            gains[outside] = old - new
        if not np.isfinite(gains).all():
            return None
        return Refit(
            coefficient=fitted.model.effects[0][1],
            gains=gains,
            leftover=reference.p_beside(evidence, [column]),
            evidence=evidence,
            profile=profile_strength(fits.forecaster, fits.segments, fits.whitened, fitted.model),
        )

    with ThreadPoolExecutor(max_workers=workers) as pool:
        list(pool.map(fits.of, [(), *((column,) for column in candidates)]))
        before = misfits_of(fits.base)
        return dict(zip(candidates, pool.map(refit_of, candidates), strict=True))
