"""What the statistics of segments say: coefficients, tests against nulls, comparison on held-out segments.

Segments of data obey r = μ(U) + R δ + ε with ε of covariance Σ. μ and Σ are learnt from null recordings, whose own
δ is none: their statistics are taken at the calibration they were simulated with, those of data at the one that is
fitted to them. U is the wind's speed; μ is that of the nominal cloth, as far as
nulls of it tell. Recordings of one cloth share the numerics
they differ from the fit's by, and what is not linear in its calibration, so that μ has a part in common to an
experiment: nuisance columns, learnt from the nulls as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import UsageError
from measure.loop.columns import PRIOR, THETA, Calibration
from measure.loop.course import Course
from measure.loop.growth import power
from measure.loop.rows import Rows
from measure.loop.statistics import Statistics
from measure.loop.wind_log import by_recording

Floats = NDArray[np.float64]
Chosen = Sequence[int]

_HERE = (0.0,) * len(THETA)
_SHIFTS = 16
"""Number of shifts. In 112 null experiments, drops of columns fell by a fifth from 8 to 16, by a twentieth to 32."""


@dataclass(frozen=True, kw_only=True)
class Design:
    """What is seen, and how, which moves the mean of what numerics leave.

    Attributes:
        noise: of a marker's coordinate [m].
        period: between the frames that are used [s].
        cloth: `Material.fingerprint` of the nominal one.
        damping: of the base model that the statistics are taken at [s].
    """

    noise: float
    period: float
    cloth: str
    damping: float = Calibration().damping


@dataclass(frozen=True, kw_only=True, eq=False)
class NullModel:
    """μ and Σ of one design, from null segments.

    Attributes:
        coefficients: (feature, column) of μ in 1, U, U², for the design's cloth.
        covariance: (column, column) Σ of one segment, about the mean of its experiment.
        shifts: (shift, column) how μ moves from one experiment to another: principal directions, each as long as its
            standard deviation. Where no null is of the design's cloth, how it moves from cloth to cloth is among them.
        turning: the same of moments about the pole; None where they are not looked at.
        prior: (theta,) standard deviations of the calibrated parameters about the nominal ones, in units of `THETA`.
    """

    coefficients: Floats
    covariance: Floats
    shifts: Floats
    turning: NullModel | None = None
    prior: Floats = field(default_factory=PRIOR.copy)

    @classmethod
    def fit(cls, nulls: Nulls, design: Design) -> NullModel:
        """From segments whose calibrations are known, for segments of a design.

        What numerics leave is smoother the more the cloth is damped, so that more of it lies along the columns: all
        of it is taken to be larger by a power of the damping.
        """
        grown = _power_of_damping(nulls)
        clean = nulls.statistics.r * np.exp(-grown * nulls.calibration[:, _DAMPING])[:, None]
        features = np.c_[_features(nulls.speeds), nulls.beyond(design)]
        coefficients, *_ = np.linalg.lstsq(features, clean, rcond=None)
        left = clean - features @ coefficients
        experiment = nulls.experiment
        means = np.stack([left[experiment == index].mean(axis=0) for index in range(experiment.max() + 1)])
        within = left - means[experiment]
        covariance = within.T @ within / max(len(left) - len(means) - features.shape[1], 1)
        covariance += np.diag(np.full(len(covariance), _UNSEEN * np.diag(covariance).mean()))
        covariance = _shrunk(covariance * _inflation(within, nulls.statistics.recording, covariance), len(left))
        first = np.unique(experiment, return_index=True)[1]
        by_cloth = _by_cloth(means, nulls.numerics[first], nulls.cloth[first], covariance)
        if design.cloth in by_cloth:
            coefficients[0] += by_cloth[design.cloth]
            means = means - np.stack([by_cloth[cloth] for cloth in nulls.cloth[first]])
        turning, size = nulls.statistics.turning, (design.damping / Calibration().damping) ** grown
        return cls(
            coefficients=size * coefficients[:_POWERS], covariance=size**2 * covariance,
            shifts=size * _principal(means, covariance),
            turning=None if turning is None else cls.fit(replace(nulls, statistics=turning), design),
        )  # fmt: skip

    def under(self, prior: Floats) -> NullModel:
        """With another prior of the calibrated parameters."""
        return replace(self, prior=prior, turning=None if self.turning is None else self.turning.under(prior))

    def mean(self, speeds: Floats) -> Floats:
        """(segment, column)."""
        return _features(speeds) @ self.coefficients


@dataclass(frozen=True, kw_only=True, eq=False)
class Nulls(Rows):
    """Segments of null recordings, with what they were made with.

    Attributes:
        statistics: of the segments.
        speeds: (segment,) of the wind [m/s].
        calibration: (segment, theta) steps from the nominal calibration to the one they were simulated with.
        numerics: (segment,) which mesh and method.
        noise: (segment,) of a marker's coordinate [m].
        period: (segment,) between the frames used [s].
        cloth: (segment,) `Material.fingerprint` of the nominal one, one to a mesh and method.
    """

    statistics: Statistics
    speeds: Floats
    calibration: Floats
    numerics: NDArray[np.int64]
    noise: Floats
    period: Floats
    cloth: NDArray[np.str_]

    @cached_property
    def experiment(self) -> NDArray[np.int64]:
        """(segment,) recordings of one cloth, by one numerics: 0, 1, …"""
        _, index = np.unique(np.c_[self.numerics, self.calibration], axis=0, return_inverse=True)
        return index.reshape(-1)

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:  # pyright: ignore[reportIncompatibleMethodOverride]
        """One after another, of as many markers as all have; recordings and numerics are those of the parts."""
        least = min(part.statistics.marker_error.shape[1] for part in parts)
        return super().joined([
            replace(p, statistics=replace(p.statistics, marker_error=p.statistics.marker_error[:, :least]))
            for p in parts
        ])  # fmt: skip

    def beyond(self, design: Design) -> Floats:
        """(segment, k) by how much squared noise [mm²] and period [10 ms] differ from a design's, where they vary."""
        beyond = np.stack([1e6 * (self.noise**2 - design.noise**2), 100 * (self.period - design.period)], axis=1)
        return beyond[:, np.ptp(beyond, axis=0) > 0]

    @property
    def design(self) -> Design:
        """The design of the first segment: that of all, where they are of one experiment."""
        damping = Calibration().moved((0.0, 0.0, float(self.calibration[0, _DAMPING]))).damping
        return Design(
            noise=float(self.noise[0]), period=float(self.period[0]), cloth=str(self.cloth[0]), damping=damping
        )


_POWERS = 3
_TINY = np.finfo(np.float64).tiny
_UNSEEN = 1e-9
"""Share of the mean variance that a column has of which nothing is seen, as of an effect without a moment."""


_DAMPING = [name for name, *_ in THETA].index("damping")


def _power_of_damping(nulls: Nulls) -> float:
    """By which power of the damping r grows, about the mean of its experiment and in units of all."""
    _, first, experiment = np.unique(nulls.experiment, return_index=True, return_inverse=True)
    clean, features = nulls.statistics.r, _features(nulls.speeds)
    left = clean - features @ np.linalg.lstsq(features, clean, rcond=None)[0]
    means = np.stack([left[experiment == index].mean(axis=0) for index in range(len(first))])
    squared = (left - means[experiment]) ** 2
    whole = np.maximum(squared.mean(axis=0), np.finfo(np.float64).tiny)
    sizes = np.array([(squared[experiment == index].mean(axis=0) / whole).mean() for index in range(len(first))])
    return power(np.sqrt(sizes), nulls.calibration[first, _DAMPING])


def _features(speeds: Floats) -> Floats:
    return np.stack([np.ones_like(speeds), speeds, speeds**2], axis=1)


def _by_cloth(
    means: Floats, kinds: NDArray[np.int64], cloths: NDArray[np.str_], covariance: Floats
) -> dict[str, Floats]:
    """Cloth → (column,) what the nulls of one nominal cloth have in common, beyond that of all.

    A random effect of the cloth beside one of the numerics, predicted linearly (Henderson, Biometrics 31:423, 1975).
    Their variances are found by moments, in units of the covariance and summed over the columns. Empty where they
    cannot be told apart: one cloth alone, or no cloth by two numerics.

    Args:
        means: (experiment, column).
        kinds, cloths: (experiment,) its numerics and nominal cloth.
    """
    numbers, first = np.unique(kinds, return_index=True)
    by_kind, cloth_of = np.stack([means[kinds == kind].mean(axis=0) for kind in numbers]), cloths[first]
    names = [str(name) for name in np.unique(cloth_of)]
    free = len(numbers) - len(names)
    if len(names) < 2 or free < 1:
        return {}
    centres = {name: by_kind[cloth_of == name].mean(axis=0) for name in names}
    counts = np.array([(cloth_of == name).sum() for name in names])
    factor = np.linalg.cholesky(covariance)
    about = np.linalg.solve(factor, (by_kind - np.stack([centres[str(name)] for name in cloth_of])).T)
    of_numerics = float((about**2).sum()) / free
    between = np.linalg.solve(factor, np.stack(list(centres.values())).T).var(axis=1, ddof=1).sum()
    of_cloths = max(float(between) - of_numerics * float((1 / counts).mean()), 0.0)
    shrunk = counts * of_cloths / (counts * of_cloths + of_numerics)
    return {name: share * centres[name] for name, share in zip(names, shrunk, strict=True)}


def _principal(means: Floats, covariance: Floats) -> Floats:
    """Directions that hold most of what the means vary by, in units of the covariance: (shift, column)."""
    factor = np.linalg.cholesky(covariance)
    whitened = np.linalg.solve(factor, (means - means.mean(axis=0)).T)
    left, size, _ = np.linalg.svd(whitened, full_matrices=False)
    kept = min(_SHIFTS, max(len(means) - 1, 0))
    scale = size[:kept] / np.sqrt(max(len(means) - 1, 1))
    return (factor @ (left[:, :kept] * scale)).T


def _inflation(left: Floats, recording: NDArray[np.int64], covariance: Floats) -> float:
    """How much more recordings' means vary than those of as many independent segments, at least 1."""
    sums = np.stack(
        [left[recording == index].sum(axis=0) / np.sqrt((recording == index).sum()) for index in np.unique(recording)]
    )
    ratio = np.mean(sums**2, axis=0) / np.diag(covariance)
    return float(max(1.0, np.median(ratio)))


def _shrunk(covariance: Floats, count: int) -> Floats:
    """Toward its diagonal, by the share that chance correlations have at this count."""
    share = min(1.0, len(covariance) / count)
    return (1 - share) * covariance + share * np.diag(np.diag(covariance))


@dataclass(frozen=True, kw_only=True, eq=False)
class Evidence(Rows):
    """Segments beside a null model, as quadratic forms: the misfit of coefficients δ is c − 2 g·δ + δᵀ H δ.

    Its columns are the statistics', then the null model's shifts, then what the log of each recording's wind may be off
    by.

    Attributes:
        recording: (segment,) index of each one's recording.
        curvature: (segment, column, column) H = Rᵀ Σ⁻¹ R.
        score: (segment, column) g = Rᵀ Σ⁻¹ (r − μ).
        energy: (segment,) c = (r − μ)ᵀ Σ⁻¹ (r − μ).
        columns: how many are the statistics' and those given beside; the nuisances follow.
        lines: (segment, reduced frequency, direction) of the errors' spectra: see `lines`; None where not looked at.
        turning: the same of moments about the pole; None where they are not looked at.
        course: of the wind, as the errors tell it; None where not looked at.
        prior: of the calibrated parameters, see `NullModel`.
    """

    _WHOLE: ClassVar = frozenset({"columns", "prior"})

    recording: NDArray[np.int64]
    curvature: Floats
    score: Floats
    energy: Floats
    columns: int
    lines: Floats | None = None
    turning: Evidence | None = None
    course: Course | None = None
    prior: Floats = field(default_factory=PRIOR.copy)

    @classmethod
    def of(cls, statistics: Statistics, speeds: Floats, null: NullModel, *, beside: Floats | None = None) -> Evidence:
        """The evidence of segments with their wind's speed (segment,) [m/s].

        Args:
            beside: (segment, column, k) how k coefficients more move r, along which nothing was taken: they become the
                columns after the statistics', and moments are not looked at.

        Raises:
            UsageError: moments of the statistics or of the nulls alone.
        """
        if beside is not None:
            response = np.concatenate([statistics.response, beside], axis=2)
            statistics = replace(statistics, response=response)
        own = cls._of(statistics.r, statistics, speeds, null)
        if beside is not None or (statistics.turning is None and null.turning is None):
            return own
        if statistics.turning is None or null.turning is None:
            raise UsageError("moments of nulls or data alone", where="evidence", fix="look at them in both or in none")
        return replace(own, turning=cls.of(statistics.turning, speeds, null.turning))

    @classmethod
    def _of(cls, r: Floats, statistics: Statistics, speeds: Floats, null: NullModel) -> Evidence:
        left = r - null.mean(speeds)
        shifts = np.broadcast_to(null.shifts.T, (len(left), *null.shifts.T.shape))
        response = np.concatenate([statistics.response, shifts], axis=2)
        if statistics.log is not None:
            response = np.concatenate([response, by_recording(statistics.log, statistics.recording)], axis=2)
        precision = np.linalg.inv(null.covariance)
        weighted = np.einsum("sia,ij->saj", response, precision)
        return cls(
            recording=statistics.recording, curvature=weighted @ response,
            score=np.einsum("saj,sj->sa", weighted, left),
            energy=np.einsum("si,ij,sj->s", left, precision, left), columns=statistics.response.shape[2],
            lines=statistics.lines, course=statistics.course, prior=null.prior,
        )  # fmt: skip

    @property
    def nuisance(self) -> list[int]:
        """Columns that are always fitted: the calibrated parameters, the shifts of the numerics, and what the logs of
        the wind may be off by."""
        return [*range(len(THETA)), *range(self.columns, self.score.shape[1])]

    @property
    def swing(self) -> Floats | None:
        """(part,) of the wind's course; None where it is not looked at."""
        return None if self.course is None else self.course.swing(self.recording)

    def _total(self) -> tuple[Floats, Floats, float]:
        """Sums over the segments, with the priors of the nuisance columns."""
        curvature = self.curvature.sum(axis=0)
        prior = np.concatenate([self.prior**-2, np.ones(self.score.shape[1] - self.columns)])
        curvature[self.nuisance, self.nuisance] += prior
        return curvature, self.score.sum(axis=0), float(self.energy.sum())

    def fit(self, chosen: Chosen, *, centre: Sequence[float] | Floats = _HERE) -> Fit:
        """Generalised least squares of the nuisance columns, under their priors, and the chosen ones.

        Args:
            centre: of the calibrated parameters' prior, in steps from where the statistics were taken.
        """
        active = [*self.nuisance, *chosen]
        curvature, score, energy = self._total()
        pull = self.prior**-2 * np.asarray(centre)
        score[: len(THETA)] += pull
        energy += float(pull @ np.asarray(centre))
        covariance = np.asarray(np.linalg.inv(curvature[np.ix_(active, active)]), dtype=np.float64)
        value = covariance @ score[active]
        return Fit(active=tuple(active), value=value, covariance=covariance, left=energy - float(score[active] @ value))

    def freed(self, column: int) -> Evidence:
        """With a coefficient of a column that is free in every segment: what is left across it.

        Moments about the pole and the wind's course are not looked at: what fluctuates within a segment moves them all
        the same.
        """
        own = np.maximum(self.curvature[:, column, column], np.finfo(np.float64).tiny)
        along, slope = self.curvature[:, column], self.score[:, column]
        curvature = self.curvature - along[:, :, None] * along[:, None, :] / own[:, None, None]
        score = self.score - along * (slope / own)[:, None]
        # Nothing is left of the column itself: it stays as one of which nothing is known.
        curvature[:, column, :] = curvature[:, :, column] = score[:, column] = 0.0
        curvature[:, column, column] = 1.0
        return Evidence(
            recording=self.recording, curvature=curvature, score=score, energy=self.energy - slope**2 / own,
            columns=self.columns, lines=self.lines, prior=self.prior,
        )  # fmt: skip

    def drops(self, beside: Chosen = ()) -> Floats:
        """(column,) how much each column, added to the nuisances and to some more, lowers the squared distance."""
        active = [*self.nuisance, *beside]
        curvature, score, _ = self._total()
        solved = np.linalg.solve(curvature[np.ix_(active, active)], np.c_[curvature[active], score[active]])
        own = np.diag(curvature) - np.einsum("ai,ai->i", curvature[active], solved[:, :-1])
        slope = score - curvature[active].T @ solved[:, -1]
        drops = slope**2 / np.maximum(own, np.maximum(1e-9 * np.diag(curvature), np.finfo(np.float64).tiny))
        drops[active] = 0.0
        return drops[: self.columns]

    def with_one_more(self, active: Chosen, columns: Chosen) -> tuple[Floats, Floats, Floats]:
        """How a fit of some columns moves with one more, for each of others: (column,) its coefficients, (all, column)
        how all coefficients go with it, (all,) those of the fit without."""
        curvature, score, _ = self._total()
        chosen, others = list(active), list(columns)
        across = curvature[np.ix_(chosen, others)]
        solved = np.linalg.solve(curvature[np.ix_(chosen, chosen)], np.c_[across, score[chosen]])
        moved, fitted = np.zeros((len(score), len(others))), np.zeros(len(score))
        moved[chosen], moved[others, range(len(others))], fitted[chosen] = -solved[:, :-1], 1.0, solved[:, -1]
        whole = np.diag(curvature)[others]
        own = whole - np.einsum("ai,ai->i", across, solved[:, :-1])
        step = (score[others] - across.T @ solved[:, -1]) / np.maximum(own, np.maximum(1e-9 * whole, _TINY))
        return step, moved, fitted

    def left_out(self, outside: NDArray[np.bool_], chosen: Chosen = ()) -> Floats:
        """(segment,) half misfits of some segments, when the nuisances and chosen columns are fitted to the others."""
        fit = self.select(~outside).fit(chosen)
        return self.select(outside).misfit(fit.active, fit.value) / 2

    def misfit(self, active: Chosen, value: Floats) -> Floats:
        """(segment,) what coefficients leave of each segment."""
        places = list(active)
        quadratic = np.einsum("a,sab,b->s", value, self.curvature[:, places][:, :, places], value)
        return self.energy - 2 * self.score[:, places] @ value + quadratic


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """Coefficients of some columns, with their covariance, and the squared distance they leave, prior included."""

    active: tuple[int, ...]
    value: Floats
    covariance: Floats
    left: float

    def in_errors(self, columns: Sequence[int]) -> Floats:
        """(column,) some coefficients in their standard errors."""
        return np.array([value / error for value, error in map(self.of, columns)])

    def of(self, column: int) -> tuple[float, float]:
        """Coefficient and standard error."""
        place = self.active.index(column)
        return float(self.value[place]), float(np.sqrt(self.covariance[place, place]))


def left_together(recording: NDArray[np.int64]) -> NDArray[np.int64]:
    """(segment,) what is left out together: a recording, or each half of a single one."""
    if len(np.unique(recording)) > 1:
        return recording
    return (np.arange(len(recording)) >= len(recording) / 2).astype(np.int64)


def gains(evidence: Evidence, choices: Sequence[Chosen]) -> Floats:
    """How much better each choice of columns predicts segments it was not fitted to: (choice, segment).

    Each recording is left out in turn (of a single recording, each half), the model is fitted to the others, and the
    left-out segments' half misfits are compared with the base model's, fitted to the same.
    """
    folds = left_together(evidence.recording)
    result = np.zeros((len(choices), len(folds)))
    for index in np.unique(folds):
        inside, outside = evidence.select(folds != index), evidence.select(folds == index)
        base = inside.fit(())
        before = outside.misfit(base.active, base.value)
        for place, chosen in enumerate(choices):
            fit = inside.fit(chosen)
            result[place, folds == index] = (before - outside.misfit(fit.active, fit.value)) / 2
    return result


def best_gain(evidence: Evidence, beside: Chosen = ()) -> float:
    """The largest held-out gain that one more column brings, over that of some columns alone: see `gains`."""
    folds, active = left_together(evidence.recording), [*evidence.nuisance, *beside]
    columns = [column for column in range(evidence.columns) if column not in active]
    total = np.zeros(len(columns))
    for index in np.unique(folds):
        inside, outside = evidence.select(folds != index), evidence.select(folds == index)
        step, moved, fitted = inside.with_one_more(active, columns)
        curvature = outside.curvature.sum(axis=0)
        slope = (outside.score.sum(axis=0) - curvature @ fitted) @ moved
        total += step * slope - step**2 * np.einsum("pc,pq,qc->c", moved, curvature, moved) / 2
    return float(total.max())
