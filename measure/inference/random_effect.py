"""What numerics leave, learnt from nulls: a mean, a covariance, and a random effect of each kind of
numerics.

Segments of data obey r = μ(U) + R δ + ε with ε of covariance Σ. μ and Σ are learnt from null
recordings, whose own
δ is none: their statistics are taken at the calibration they were simulated with, those of data at
the one that is fitted to them. U is the wind's speed; μ is that of the nominal cloth, as far as
nulls of it show. Recordings of one cloth share the numerics they differ from the fit's by, and what
is not linear in its calibration, so that μ has a part
in common to an experiment: nuisance columns, learnt from the nulls as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray, IntArray
from measure.forecasting.calibrated_parameters import DAMPING, PRIOR, Calibration
from measure.forecasting.setting import Design
from measure.inference.growth import power
from measure.probes.segment_rows import StatisticRows
from measure.probes.statistics import Statistics

_SHIFTS = 16
"""Number of shifts. In 112 null experiments, drops of columns fell by a fifth from 8 to 16, by a
twentieth to 32."""


@dataclass(frozen=True, kw_only=True, eq=False)
class NullModel:
    """μ and Σ of one design, from null segments.

    Attributes:
        coefficients: (feature, column) of μ in 1, U, U², for the design's cloth.
        covariance: (column, column) Σ of one segment, about the mean of its experiment.
        shifts: (shift, column) how μ moves from one experiment to another: principal directions,
            each as long as its standard deviation. Where no null is of the design's cloth, how it
            moves from cloth to cloth is among them.
        turning: the same of moments about the pole; None where they are not looked at.
        prior: (theta,) standard deviations of the calibrated parameters about the nominal ones, in
            units of `THETA`.
    """

    coefficients: FloatArray
    covariance: FloatArray
    shifts: FloatArray
    turning: NullModel | None = None
    prior: FloatArray = field(default_factory=PRIOR.copy)

    @classmethod
    def fit(cls, nulls: Nulls, design: Design) -> NullModel:
        """Fits the model to segments whose calibrations are known, for segments of a design.

        What numerics leave is smoother the more the cloth is damped, so that more of it lies along
        the columns: all of it is taken to be larger by a power of the damping.
        """
        grown = _power_of_damping(nulls)
        clean = nulls.statistics.r * np.exp(-grown * nulls.calibration[:, DAMPING])[:, None]
        features = np.c_[_features(nulls.speeds), nulls.beyond(design)]
        coefficients, *_ = np.linalg.lstsq(features, clean, rcond=None)
        residuals = clean - features @ coefficients
        experiment = nulls.experiment
        means = np.stack(
            [residuals[experiment == index].mean(axis=0) for index in range(experiment.max() + 1)]
        )
        within = residuals - means[experiment]
        covariance = within.T @ within / max(len(residuals) - len(means) - features.shape[1], 1)
        covariance += np.diag(np.full(len(covariance), _UNSEEN * np.diag(covariance).mean()))
        covariance = _shrunk(
            covariance * _inflation(within, nulls.statistics.recording, covariance), len(residuals)
        )
        first = np.unique(experiment, return_index=True)[1]
        by_cloth = _by_cloth(means, nulls.numerics[first], nulls.cloth[first], covariance)
        if design.cloth in by_cloth:
            coefficients[0] += by_cloth[design.cloth]
            means = means - np.stack([by_cloth[cloth] for cloth in nulls.cloth[first]])
        turning, size = nulls.statistics.turning, (design.damping / Calibration().damping) ** grown
        return cls(
            coefficients=size * coefficients[:_POWERS],
            covariance=size**2 * covariance,
            shifts=size * _principal(means, covariance),
            turning=None
            if turning is None
            else cls.fit(replace(nulls, statistics=turning), design),
        )

    def under(self, prior: FloatArray) -> NullModel:
        """Replaces the prior of the calibrated parameters."""
        return replace(
            self, prior=prior, turning=None if self.turning is None else self.turning.under(prior)
        )

    def mean(self, speeds: FloatArray) -> FloatArray:
        """Predicts the mean (segment, column)."""
        return _features(speeds) @ self.coefficients


@dataclass(frozen=True, kw_only=True, eq=False)
class Nulls(StatisticRows):
    """Segments of null recordings, with what they were made with.

    Attributes:
        statistics: of the segments.
        speeds: (segment,) of the wind [m/s].
        calibration: (segment, theta) steps from the nominal calibration to the one they were
            simulated with.
        numerics: (segment,) which mesh and method.
        noise: (segment,) of a marker's coordinate [m].
        period: (segment,) between the frames used [s].
        cloth: (segment,) `Material.fingerprint` of the nominal one, one to a mesh and method.
    """

    statistics: Statistics
    speeds: FloatArray
    calibration: FloatArray
    numerics: IntArray
    noise: FloatArray
    period: FloatArray
    cloth: NDArray[np.str_]

    @cached_property
    def experiment(self) -> IntArray:
        """(segment,) recordings of one cloth, by one numerics: 0, 1, …"""
        _, index = np.unique(np.c_[self.numerics, self.calibration], axis=0, return_inverse=True)
        return index.reshape(-1)

    @classmethod
    def joined(  # pyright: ignore[reportIncompatibleMethodOverride]
        cls, parts: Sequence[Self]
    ) -> Self:
        """Joins nulls one after another, of as many markers as all have; recordings and numerics
        are those of the parts."""
        least = min(part.statistics.marker_error.shape[1] for part in parts)
        return super().joined(
            [
                replace(
                    p,
                    statistics=replace(
                        p.statistics, marker_error=p.statistics.marker_error[:, :least]
                    ),
                )
                for p in parts
            ]
        )

    def beyond(self, design: Design) -> FloatArray:
        """Computes by how much squared noise [mm²] and period [10 ms] differ from a design's, where
        they vary, (segment, k)."""
        beyond = np.stack(
            [1e6 * (self.noise**2 - design.noise**2), 100 * (self.period - design.period)], axis=1
        )
        return beyond[:, np.ptp(beyond, axis=0) > 0]

    @property
    def design(self) -> Design:
        """The design of the first segment: that of all, where they are of one experiment."""
        damping = Calibration().moved((0.0, 0.0, float(self.calibration[0, DAMPING]))).damping
        return Design(
            noise=float(self.noise[0]),
            period=float(self.period[0]),
            cloth=str(self.cloth[0]),
            damping=damping,
        )


_POWERS = 3
_UNSEEN = 1e-9
"""Share of the mean variance below which a column is unobservable, as that of an effect without a
moment."""


def _power_of_damping(nulls: Nulls) -> float:
    """Estimates by which power of the damping r grows, about the mean of its experiment and in
    units of all."""
    _, first, experiment = np.unique(nulls.experiment, return_index=True, return_inverse=True)
    clean, features = nulls.statistics.r, _features(nulls.speeds)
    residuals = clean - features @ np.linalg.lstsq(features, clean, rcond=None)[0]
    means = np.stack([residuals[experiment == index].mean(axis=0) for index in range(len(first))])
    squared = (residuals - means[experiment]) ** 2
    total = np.maximum(squared.mean(axis=0), np.finfo(np.float64).tiny)
    sizes = np.array(
        [(squared[experiment == index].mean(axis=0) / total).mean() for index in range(len(first))]
    )
    return power(np.sqrt(sizes), nulls.calibration[first, DAMPING])


def _features(speeds: FloatArray) -> FloatArray:
    return np.stack([np.ones_like(speeds), speeds, speeds**2], axis=1)


def _by_cloth(
    means: FloatArray, kinds: IntArray, cloths: NDArray[np.str_], covariance: FloatArray
) -> dict[str, FloatArray]:
    """Predicts for each cloth, (column,), what the nulls of one nominal cloth have in common,
    beyond that of all.

    A random effect of the cloth beside one of the numerics, predicted linearly (Henderson,
    Biometrics 31:423, 1975). Their variances are found by moments, in units of the covariance and
    summed over the columns. Empty where they
    cannot be separated: one cloth alone, or no cloth by two numerics.

    Args:
        means: (experiment, column).
        kinds, cloths: (experiment,) its numerics and nominal cloth.
    """
    numbers, first = np.unique(kinds, return_index=True)
    by_kind, cloth_of = (
        np.stack([means[kinds == kind].mean(axis=0) for kind in numbers]),
        cloths[first],
    )
    names = [str(name) for name in np.unique(cloth_of)]
    free = len(numbers) - len(names)
    if len(names) < 2 or free < 1:
        return {}
    centres = {name: by_kind[cloth_of == name].mean(axis=0) for name in names}
    counts = np.array([(cloth_of == name).sum() for name in names])
    factor = np.linalg.cholesky(covariance)
    about = np.linalg.solve(
        factor, (by_kind - np.stack([centres[str(name)] for name in cloth_of])).T
    )
    of_numerics = float((about**2).sum()) / free
    between = np.linalg.solve(factor, np.stack(list(centres.values())).T).var(axis=1, ddof=1).sum()
    of_cloths = max(float(between) - of_numerics * float((1 / counts).mean()), 0.0)
    shrunk = counts * of_cloths / (counts * of_cloths + of_numerics)
    return {name: share * centres[name] for name, share in zip(names, shrunk, strict=True)}


def _principal(means: FloatArray, covariance: FloatArray) -> FloatArray:
    """Computes directions with most of the variance of the means, in units of the covariance:
    (shift, column)."""
    factor = np.linalg.cholesky(covariance)
    whitened = np.linalg.solve(factor, (means - means.mean(axis=0)).T)
    directions, size, _ = np.linalg.svd(whitened, full_matrices=False)
    count = min(_SHIFTS, max(len(means) - 1, 0))
    scale = size[:count] / np.sqrt(max(len(means) - 1, 1))
    return (factor @ (directions[:, :count] * scale)).T


def _inflation(residuals: FloatArray, recording: IntArray, covariance: FloatArray) -> float:
    """Computes how much more recordings' means vary than those of as many independent segments, at
    least 1."""
    sums = np.stack(
        [
            residuals[recording == index].sum(axis=0) / np.sqrt((recording == index).sum())
            for index in np.unique(recording)
        ]
    )
    ratio = np.mean(sums**2, axis=0) / np.diag(covariance)
    return float(max(1.0, np.median(ratio)))


def _shrunk(covariance: FloatArray, count: int) -> FloatArray:
    """Shrinks the covariance toward its diagonal, by the share that chance correlations have at
    this count."""
    share = min(1.0, len(covariance) / count)
    return (1 - share) * covariance + share * np.diag(np.diag(covariance))
