"""Prediction errors and the effect of terms on them, projected on directions whose null
distribution is known.

A test statistic for each term would need its own null recordings. Instead, errors are projected on
the directions s_i that `measure.nulls.bank` stores (sensitivities to the library's effects and to
smooth fields), and a term is described by its response along them:

    E r_i = μ_i + Σ_j R_ij δ_j,   R_ij = Σ w s_i·c_j / √(Σ w s_i²)

with c_j the sensitivity to term j. The part of a term's response orthogonal to all directions is
lost.

Sensitivities of predictions to many terms: those of one field run side by side, each on a copy of
the segments.

A field is evaluated once for all its shapes, and small batches cost as much as larger ones: so a
term takes a third of the time that it takes alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray, IntArray
from measure.forecasting.calibrated_parameters import THETA, Calibration
from measure.forecasting.model import Model, linearise_model
from measure.forecasting.observer import WIDEST, Forecaster
from measure.forecasting.regressors import Column
from measure.forecasting.segments import Segments
from measure.inference.random_effect import NullModel
from measure.inference.segment_evidence import Evidence
from measure.inference.whitened_misfit import WhitenedMisfit
from measure.probes.statistics import Projection, Statistics, error_scale, reduce_errors
from measure.propose.terms import MASS, TermColumn
from sim.cloth.cloth_batch import Cloth
from sim.effects.effect import ClothEffect, Effect
from sim.effects.field import FieldEffect, Flat, Seen, heavier


@dataclass(frozen=True, kw_only=True)
class SideBySide(FieldEffect):
    """A field with weights for each vertex and member.

    Attributes:
        field: of `Seen`.
        weights: (vertex, 1, batch), coefficients included.
    """

    field: str
    weights: Tensor

    def acceleration(self, seen: Seen) -> Tensor:
        return self.weights * getattr(seen, self.field)


@dataclass(frozen=True, kw_only=True)
class MassSideBySide(ClothEffect):
    """Mass with weights for each vertex and member.

    Attributes:
        weights: (vertex, 1, batch), coefficients included.
    """

    weights: Tensor

    def cloth(self, cloth: Cloth) -> Cloth:
        return heavier(cloth, self.weights)


def of_columns(
    forecaster: Forecaster, segments: Segments, base: Tensor, columns: Sequence[Column]
) -> dict[str, Tensor]:
    """Computes for each column, by name, the change of the predictions with it, (frame, marker, 3,
    segment) [m per unit].

    Args:
        base: errors of the nominal model.
    """
    nominal = [Calibration()] * len(segments)
    changes: dict[str, Tensor] = {}
    fields: dict[str, list[TermColumn]] = {}
    for column in columns:
        if isinstance(column, TermColumn):
            fields.setdefault(column.term.field, []).append(column)
        else:
            changes[column.name] = forecaster.sensitivity(column, segments, nominal, base)
    columns_at_once = max(1, WIDEST // len(segments))
    for of_field in fields.values():
        for first in range(0, len(of_field), columns_at_once):
            changes |= _bundle(
                forecaster, segments, base, of_field[first : first + columns_at_once]
            )
    return changes


def _bundle(
    forecaster: Forecaster, segments: Segments, base: Tensor, columns: Sequence[TermColumn]
) -> dict[str, Tensor]:
    """Computes sensitivities to terms of one field."""
    count, step = len(segments), columns[0].step
    copies = segments.select(list(range(count)) * len(columns))
    system, state = forecaster.system(copies, [Calibration()] * len(copies))
    flat = Flat(cloth=system.cloth)
    weights = torch.cat(
        [step * column.term.at.of(flat).expand(-1, 1, count) for column in columns], dim=2
    )
    field = columns[0].term.field
    effect: Effect = (
        MassSideBySide(weights=weights)
        if field == MASS
        else SideBySide(field=field, weights=weights)
    )
    errors = forecaster.errors(*effect.apply(system, state), copies)
    return {
        column.name: (base - errors[..., index * count : (index + 1) * count]) / step
        for index, column in enumerate(columns)
    }


_TOGETHER = 40
"""Columns reduced at a time: bounds memory."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ProjectedSegments:
    """Segments and the directions on which their errors are projected.

    Attributes:
        forecaster: of the model.
        segments: of the recordings.
        base: errors of the nominal model (frame, marker, 3, segment) [m].
        directions: sensitivities of the calibrated parameters, then of the weighed columns.
    """

    forecaster: Forecaster
    segments: Segments
    base: Tensor
    directions: tuple[Tensor, ...]

    @classmethod
    def of(
        cls, forecaster: Forecaster, segments: Segments, null_columns: Sequence[Column]
    ) -> ProjectedSegments:
        """Projects on the directions of the calibrated parameters and of the columns that the null
        bank weighs."""
        nominal = [Calibration()] * len(segments)
        base = forecaster.errors(*forecaster.system(segments, nominal), segments)
        along = forecaster.sensitivities(null_columns, segments, nominal, base)
        return cls(forecaster=forecaster, segments=segments, base=base, directions=tuple(along))

    def select(self, chosen: IntArray) -> ProjectedSegments:
        """Selects some segments only."""
        return replace(
            self,
            segments=self.segments.select(chosen),
            base=self.base[..., chosen],
            directions=tuple(direction[..., chosen] for direction in self.directions),
        )

    def whitened(self, null: NullModel, of_recordings: FloatArray) -> WhitenedMisfit:
        """Makes the misfit of the projected errors, whitened by the null model; `of_recordings` are
        wind speeds [m/s]."""
        recording, noise = self.segments.recording, self.segments.noise
        return WhitenedMisfit(
            statistics=reduce_errors(
                self.base, self.directions, recording, noise, self.segments.counted
            ),
            projection=Projection.along(
                self.directions, error_scale(self.base, recording, noise, self.segments.counted)
            ),
            null=null,
            speeds=self.speeds(of_recordings),
        )

    @property
    def calibrated(self) -> Statistics:
        """Statistics of the calibrated parameters, at the nominal model."""
        return self.project_errors(self.base, self.directions[: len(THETA)])

    def of_columns(self, columns: Sequence[Column]) -> Statistics:
        """Computes statistics of the calibrated parameters and some columns, at the nominal
        model."""
        parts = [self.calibrated]
        for first in range(0, len(columns), _TOGETHER):
            chunk = columns[first : first + _TOGETHER]
            changes = of_columns(self.forecaster, self.segments, self.base, chunk)
            parts.append(self.project_errors(self.base, [changes[column.name] for column in chunk]))
        return replace(parts[0], response=np.concatenate([part.response for part in parts], axis=2))

    def at(self, model: Model) -> Statistics:
        """Statistics of the calibrated parameters and the effects of a model, there."""
        base, changes = linearise_model(model, self.forecaster, self.segments)
        return self.project_errors(base, changes)

    def project_errors(self, base: Tensor, changes: Sequence[Tensor]) -> Statistics:
        """Projects errors, r (segment, direction), and their response to changes (segment,
        direction, change)."""
        both_responses = reduce_errors(
            base,
            [*self.directions, *changes],
            self.segments.recording,
            self.segments.noise,
            self.segments.counted,
        )
        count = len(self.directions)
        return replace(
            both_responses,
            r=both_responses.r[:, :count],
            response=both_responses.response[:, :count, count:],
        )

    def speeds(self, of_recordings: FloatArray) -> FloatArray:
        """Returns the wind speed of each segment [m/s], (segment,), of speeds by recording."""
        return of_recordings[self.segments.recording]


def evidence(statistics: Statistics, speeds: FloatArray, null: NullModel) -> Evidence:
    """Computes the evidence in projected statistics; its columns are those of the response."""
    return replace(Evidence.of(statistics, speeds, null), columns=statistics.response.shape[2])
