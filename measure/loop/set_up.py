"""What recordings show of the set-up against what was declared: it leads a verdict, whatever the
test says."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flagdata.answer import Quantity
from measure.forecasting.regressors import TURNED, names
from measure.inference.segment_evidence import Evidence
from measure.nulls.reference import Reference
from measure.verdict.criteria import CRITERIA

HOIST = "full-hoist.stiffness"


@dataclass(frozen=True, kw_only=True)
class SetUp:
    """What recordings may show of the set-up against what was declared.

    Attributes:
        tolerance: standard deviation that the direction of the logs is declared with [rad].
        attached: whether the hoist stands still along its length, between the declared pins.
    """

    tolerance: float = 0.0
    attached: bool = False


def wind_turn(evidence: Evidence, reference: Reference) -> Quantity | None:
    """Estimates by how much the wind is turned from where its logs have it, counter-clockwise
    [rad], whatever their tolerance; None in still air, which has no direction."""
    column, undirected = names().index(TURNED), evidence.with_directions()
    if not undirected.curvature[:, column, column].any():
        return None
    value, _ = undirected.fit([column]).of(column)
    error = abs(value) / math.sqrt(max(float(reference.statistics(undirected)[column]), 1e-12))
    half = reference.reach_of(column) * error
    return Quantity.of(
        value=value, low=value - half, high=value + half, unit="rad", level=CRITERIA.interval
    )


def beyond_tolerance(direction: Quantity | None, tolerance: float) -> bool:
    """Returns whether all of the interval lies beyond a tolerance; never of a log whose direction
    is declared exactly, which is tested as every other effect is."""
    return (
        direction is not None and tolerance > 0 and max(direction.low, -direction.high) > tolerance
    )
