"""What the statistics of segments say beside a null model: coefficients, drops, comparison on
held-out segments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.errors import UsageError
from measure.forecasting.calibrated_parameters import PRIOR, THETA
from measure.inference.random_effect import NullModel
from measure.probes.segment_rows import StatisticRows
from measure.probes.statistics import Statistics
from measure.probes.wind_course import Course
from measure.probes.wind_log import DIRECTION, NUISANCES, by_recording

Chosen = Sequence[int]

_HERE = (0.0,) * len(THETA)
_TINY = np.finfo(np.float64).tiny


@dataclass(frozen=True, kw_only=True, eq=False)
class Evidence(StatisticRows):
    """Segments beside a null model, as quadratic forms: the misfit of coefficients δ is c − 2 g·δ +
    δᵀ H δ.

    Its columns are the statistics', then the null model's shifts, then what the log of each
    recording's wind may be off by.

    Attributes:
        recording: (segment,) index of each one's recording.
        curvature: (segment, column, column) H = Rᵀ Σ⁻¹ R.
        score: (segment, column) g = Rᵀ Σ⁻¹ (r − μ).
        energy: (segment,) c = (r − μ)ᵀ Σ⁻¹ (r − μ).
        columns: how many are the statistics' and those given beside; the nuisances follow.
        logged: how many of these, the last, are what logs may be off by.
        lines: (segment, reduced frequency, direction) of the errors' spectra: see `lines`; None
            where not looked at.
        turning: the same of moments about the pole; None where they are not looked at.
        course: of the wind, estimated from the errors; None where not asked for.
        settled: (segment, quantity) what its recording settles at less what the model does; None
            where not looked at.
        prior: of the calibrated parameters, see `NullModel`.
        statistics, speeds: that it is of, and the wind's (segment,) [m/s]; None of evidence across
            a column.
    """

    _WHOLE: ClassVar = frozenset({"columns", "logged", "prior"})

    recording: IntArray
    curvature: FloatArray
    score: FloatArray
    energy: FloatArray
    columns: int
    logged: int = 0
    lines: FloatArray | None = None
    turning: Evidence | None = None
    course: Course | None = None
    settled: FloatArray | None = None
    prior: FloatArray = field(default_factory=PRIOR.copy)
    statistics: Statistics | None = None
    speeds: FloatArray | None = None

    @classmethod
    def of(
        cls,
        statistics: Statistics,
        speeds: FloatArray,
        null: NullModel,
        *,
        further: FloatArray | None = None,
    ) -> Evidence:
        """Computes the evidence of segments with their wind's speed (segment,) [m/s].

        Args:
            further: (segment, column, k) how k coefficients more move r, along which nothing was
                taken: they become the columns after the statistics', and moments are not looked at.

        Raises:
            UsageError: moments of the statistics or of the nulls alone.
        """
        if further is not None:
            response = np.concatenate([statistics.response, further], axis=2)
            statistics = replace(statistics, response=response)
        evidence = cls._of(statistics.r, statistics, speeds, null)
        if further is not None or (statistics.turning is None and null.turning is None):
            return evidence
        if statistics.turning is None or null.turning is None:
            raise UsageError(
                "only the nulls or only the data have moments",
                where="evidence",
                fix="look at them in both or in none",
            )
        return replace(evidence, turning=cls.of(statistics.turning, speeds, null.turning))

    @classmethod
    def _of(
        cls, r: FloatArray, statistics: Statistics, speeds: FloatArray, null: NullModel
    ) -> Evidence:
        residuals = r - null.mean(speeds)
        shifts = np.broadcast_to(null.shifts.T, (len(residuals), *null.shifts.T.shape))
        response = np.concatenate([statistics.response, shifts], axis=2)
        plain = response.shape[2]
        if statistics.log is not None:
            response = np.concatenate(
                [response, by_recording(statistics.log, statistics.recording)], axis=2
            )
        precision = np.linalg.inv(null.covariance)
        weighted = np.einsum("sia,ij->saj", response, precision)
        return cls(
            recording=statistics.recording,
            curvature=weighted @ response,
            score=np.einsum("saj,sj->sa", weighted, residuals),
            energy=np.einsum("si,ij,sj->s", residuals, precision, residuals),
            columns=statistics.response.shape[2],
            logged=response.shape[2] - plain,
            lines=statistics.lines,
            course=statistics.course,
            settled=statistics.settled,
            prior=null.prior,
            statistics=statistics,
            speeds=speeds,
        )

    @property
    def nuisance(self) -> list[int]:
        """Columns that are always fitted: the calibrated parameters, the shifts of the numerics,
        and what the logs of the wind may be off by."""
        return [*range(len(THETA)), *range(self.columns, self.score.shape[1])]

    @property
    def swing(self) -> FloatArray | None:
        """(part,) of the wind's course; None where it is not looked at."""
        return None if self.course is None else self.course.swing(self.recording)

    @property
    def settles(self) -> FloatArray | None:
        """(quantity,) what recordings settle at less what the model does, the mean over recordings;
        None where it is not looked at."""
        if self.settled is None:
            return None
        return self.settled[np.unique(self.recording, return_index=True)[1]].mean(axis=0)

    def _total(self) -> tuple[FloatArray, FloatArray, float]:
        """Sums over the segments, with the priors of the nuisance columns."""
        curvature = self.curvature.sum(axis=0)
        prior = np.concatenate([self.prior**-2, np.ones(self.score.shape[1] - self.columns)])
        curvature[self.nuisance, self.nuisance] += prior
        return curvature, self.score.sum(axis=0), float(self.energy.sum())

    def fit(
        self, chosen: Chosen, *, centre: Sequence[float] | FloatArray = _HERE
    ) -> CoefficientFit:
        """Fits the nuisance columns by generalised least squares, under their priors, and the
        chosen ones.

        Args:
            centre: of the calibrated parameters' prior, in steps from where the statistics were
                taken.
        """
        active = [*self.nuisance, *chosen]
        curvature, score, energy = self._total()
        pull = self.prior**-2 * np.asarray(centre)
        score[: len(THETA)] += pull
        energy += float(pull @ np.asarray(centre))
        covariance = np.asarray(np.linalg.inv(curvature[np.ix_(active, active)]), dtype=np.float64)
        value = covariance @ score[active]
        return CoefficientFit(
            active=tuple(active),
            value=value,
            covariance=covariance,
            remainder=energy - float(score[active] @ value),
        )

    def freed(self, column: int) -> Evidence:
        """Frees a coefficient of a column in every segment: returns what is left across it.

        Moments about the pole, the wind's course and what recordings settle at are not looked at:
        what fluctuates within a segment moves them all the same.
        """
        information = np.maximum(self.curvature[:, column, column], np.finfo(np.float64).tiny)
        along, slope = self.curvature[:, column], self.score[:, column]
        curvature = (
            self.curvature - along[:, :, None] * along[:, None, :] / information[:, None, None]
        )
        score = self.score - along * (slope / information)[:, None]
        # Nothing is left of the column itself: it stays as one of which nothing is known.
        curvature[:, column, :] = curvature[:, :, column] = score[:, column] = 0.0
        curvature[:, column, column] = 1.0
        return Evidence(
            recording=self.recording,
            curvature=curvature,
            score=score,
            energy=self.energy - slope**2 / information,
            columns=self.columns,
            logged=self.logged,
            lines=self.lines,
            prior=self.prior,
        )

    def with_directions(self) -> Evidence:
        """Takes the directions of the logs as they are logged: nothing is fitted to them."""
        curvature, score = self.curvature.copy(), self.score.copy()
        places = np.arange(score.shape[1])[score.shape[1] - self.logged :][DIRECTION::NUISANCES]
        curvature[:, places, :] = 0.0
        curvature[:, :, places] = 0.0
        score[:, places] = 0.0
        return replace(self, curvature=curvature, score=score)

    def drops(self, along: Chosen = ()) -> FloatArray:
        """Computes how much each column, added to the nuisances and to some more, lowers the
        squared distance, (column,)."""
        return np.square(self.pulls(along))

    def pulls(self, along: Chosen = ()) -> FloatArray:
        """Computes the roots of `drops`, each with the sign of the column's coefficient,
        (column,)."""
        active = [*self.nuisance, *along]
        curvature, score, _ = self._total()
        solved = np.linalg.solve(
            curvature[np.ix_(active, active)], np.c_[curvature[active], score[active]]
        )
        information = np.diag(curvature) - np.einsum("ai,ai->i", curvature[active], solved[:, :-1])
        slope = score - curvature[active].T @ solved[:, -1]
        pulls = slope / np.sqrt(
            np.maximum(information, np.maximum(1e-9 * np.diag(curvature), _TINY))
        )
        pulls[active] = 0.0
        return pulls[: self.columns]

    def left_out(self, outside: BoolArray, chosen: Chosen = ()) -> FloatArray:
        """Computes half misfits of some segments, when the nuisances and chosen columns are fitted
        to the others, (segment,)."""
        fit = self.select(~outside).fit(chosen)
        return self.select(outside).misfit(fit.active, fit.value) / 2

    def misfit(self, active: Chosen, value: FloatArray) -> FloatArray:
        """Computes what coefficients leave of each segment, (segment,)."""
        places = list(active)
        quadratic = np.einsum("a,sab,b->s", value, self.curvature[:, places][:, :, places], value)
        return self.energy - 2 * self.score[:, places] @ value + quadratic


@dataclass(frozen=True, kw_only=True, eq=False)
class CoefficientFit:
    """Coefficients of some columns, with their covariance, and the squared distance they leave,
    prior included."""

    active: tuple[int, ...]
    value: FloatArray
    covariance: FloatArray
    remainder: float

    def in_errors(self, columns: Sequence[int]) -> FloatArray:
        """Computes some coefficients in their standard errors, (column,)."""
        return np.array([value / error for value, error in map(self.of, columns)])

    def of(self, column: int) -> tuple[float, float]:
        """Returns coefficient and standard error."""
        index = self.active.index(column)
        return float(self.value[index]), float(np.sqrt(self.covariance[index, index]))


def left_together(recording: IntArray) -> IntArray:
    """Numbers the segments by what is left out together, (segment,): a recording, or each half of a
    single one."""
    if len(np.unique(recording)) > 1:
        return recording
    return (np.arange(len(recording)) >= len(recording) / 2).astype(np.int64)


def gains(evidence: Evidence, choices: Sequence[Chosen]) -> FloatArray:
    """Computes how much better each choice of columns predicts segments it was not fitted to:
    (choice, segment).

    Each recording is left out in turn (of a single recording, each half), the model is fitted to
    the others, and the left-out segments' half misfits are compared with the base model's, fitted
    to the same.
    """
    folds = left_together(evidence.recording)
    result = np.zeros((len(choices), len(folds)))
    for index in np.unique(folds):
        inside, outside = evidence.select(folds != index), evidence.select(folds == index)
        base = inside.fit(())
        before = outside.misfit(base.active, base.value)
        for row, chosen in enumerate(choices):
            fit = inside.fit(chosen)
            result[row, folds == index] = (before - outside.misfit(fit.active, fit.value)) / 2
    return result
