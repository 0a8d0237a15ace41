"""The first candidates refitted beyond the linear model, before one of them is named.

Strong effects are far from linear: a lift of 1.4 shows as 0.3 where sensitivities are taken at none, and predicts
unseen recordings worse than nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from measure.loop.bank import columns, names
from measure.loop.comparison import LeftOut, left_out
from measure.loop.criteria import CRITERIA
from measure.loop.forecast import Forecaster, Segments
from measure.loop.inference import Evidence, left_together
from measure.loop.lines import Line
from measure.loop.reference import Reference
from measure.loop.refine import DivergedError, Refined, refine
from measure.loop.statistics import Projection
from measure.loop.whitened_misfit import WhitenedMisfit

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Fits:
    """Models of one experiment beyond the linear: each is fitted once, and once without the same segments.

    Attributes:
        whitened: the measure; its statistics at the nominal model are where the fits begin.
    """

    forecaster: Forecaster
    segments: Segments
    whitened: WhitenedMisfit
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
        """Of one of these models, each time fitted to the other segments alone."""
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
        evidence: of what it leaves; without moments about the pole or the wind's course, where it takes away much of
            them.
        line: of the errors' spectra that it leaves; None where there is none, or it takes away much of its power.
    """

    coefficient: float
    gains: Floats
    leftover: float
    evidence: Evidence
    line: Line | None = None


def refit(fits: Fits, reference: Reference, candidates: Sequence[int], *, workers: int = 1) -> dict[int, Refit]:
    """Column → what its model does; columns whose cloth diverges are left out.

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
        errors = fits.errors(fitted)
        evidence = less_swing(less_moments(fits.whitened.of(errors), bare), bare)
        line = _own(fits.whitened.projection, reference.line(evidence), unaided, errors)
        gains = np.zeros(len(together))
        for outside, old, new in zip(parts, before, left(fitted), strict=True):
            gains[outside] = old - new
        return Refit(
            coefficient=fitted.model.effects[0][1], gains=np.where(np.isfinite(gains), gains, -np.inf),
            leftover=reference.p_left_by(evidence, names(), [column], swinging=line is not None), evidence=evidence,
            line=line,
        )  # fmt: skip

    with ThreadPoolExecutor(max_workers=workers) as pool:
        list(pool.map(fits.of, [(), *((column,) for column in candidates)]))
        before, unaided = left(fits.base), fits.errors(fits.base)
        bare = fits.whitened.of(unaided)
        found = dict(zip(candidates, pool.map(one, candidates), strict=True))
    return {column: made for column, made in found.items() if made is not None}


def less_moments(evidence: Evidence, before: Evidence) -> Evidence:
    """Without the moments that a model leaves, if it takes away much of their misfit."""
    if evidence.turning is None or before.turning is None:
        return evidence
    taken = evidence.turning.fit(()).left < (1 - CRITERIA.taken) * before.turning.fit(()).left
    return replace(evidence, turning=None) if taken else evidence


def less_swing(evidence: Evidence, before: Evidence) -> Evidence:
    """Without the wind's course as a model leaves it, if it takes away much of what swings most."""
    swing, whole = evidence.swing, before.swing
    if swing is None or whole is None:
        return evidence
    most = int(np.argmax(np.abs(whole)))
    return replace(evidence, course=None) if abs(swing[most]) < (1 - CRITERIA.taken) * abs(whole[most]) else evidence


def _own(projection: Projection, line: Line | None, before: Tensor, after: Tensor) -> Line | None:
    """A line of the errors that a model leaves, unless the base model's errors had it, and more of it."""
    if line is None or projection.spectrum is None:
        return None
    return None if projection.spectrum.share_left(line, before, after) < 1 - CRITERIA.taken else line
