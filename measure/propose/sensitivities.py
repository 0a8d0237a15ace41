"""Sensitivities of predictions to many terms: those of one field run side by side, each on a copy of the segments.

A field is evaluated once for all its shapes, and small batches cost as much as larger ones: so a term takes a third of
the time that it takes alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from measure.forecasting.calibration import Calibration
from measure.forecasting.observer import WIDEST, Forecaster
from measure.forecasting.regressors import Column
from measure.forecasting.segments import Segments
from measure.propose.terms import MASS, TermColumn
from sim.cloth import Cloth
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
    """Name of each column → change of the predictions with it, (frame, marker, 3, segment) [m per unit].

    Args:
        base: errors of the nominal model.
    """
    nominal = [Calibration()] * len(segments)
    found: dict[str, Tensor] = {}
    fields: dict[str, list[TermColumn]] = {}
    for column in columns:
        if isinstance(column, TermColumn):
            fields.setdefault(column.term.field, []).append(column)
        else:
            found[column.name] = forecaster.sensitivity(column, segments, nominal, base)
    each = max(1, WIDEST // len(segments))
    for own in fields.values():
        for first in range(0, len(own), each):
            found |= _bundle(forecaster, segments, base, own[first : first + each])
    return found


def _bundle(
    forecaster: Forecaster, segments: Segments, base: Tensor, columns: Sequence[TermColumn]
) -> dict[str, Tensor]:
    """Sensitivities to terms of one field."""
    count, step = len(segments), columns[0].step
    copies = segments.select(list(range(count)) * len(columns))
    system, state = forecaster.system(copies, [Calibration()] * len(copies))
    flat = Flat(cloth=system.cloth)
    weights = torch.cat([step * column.term.at.of(flat).expand(-1, 1, count) for column in columns], dim=2)
    field = columns[0].term.field
    effect: Effect = MassSideBySide(weights=weights) if field == MASS else SideBySide(field=field, weights=weights)
    errors = forecaster.errors(*effect.apply(system, state), copies)
    return {
        column.name: (base - errors[..., place * count : (place + 1) * count]) / step
        for place, column in enumerate(columns)
    }
