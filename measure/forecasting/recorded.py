"""What recordings of markers and meshes have of that which effects need."""

from __future__ import annotations

import math
from collections.abc import Iterable

from measure.forecasting.segments import Segment
from measure.trajectories.trajectory import Specimen, Trajectory
from sim.cloth.handles import full_hoist
from sim.effects.weighing import Need

STATED_WEIGHT = 0.05
"""Relative standard uncertainty of an area weight that is stated to a few percent."""
_DIRECTION = math.radians(2.0)


def recorded(specimen: Specimen, parts: Iterable[Trajectory | Segment]) -> frozenset[Need]:
    """Lists what recordings of a specimen have, or their segments, and what is stated of them."""
    parts, uncertainty = list(parts), specimen.area_weight_uncertainty
    has = {
        Need.MARKERS: True,
        Need.FREE_HOIST: bool({*full_hoist(specimen.mesh.rest)} - {*specimen.held}),
        Need.STILL: all(part.attachments is None for part in parts),
        Need.TURBULENCE: not all(part.wind.steady for part in parts),
        Need.AREA_WEIGHT: uncertainty is not None and uncertainty <= STATED_WEIGHT,
        Need.DIRECTION: all(part.wind.direction <= _DIRECTION for part in parts),
        Need.ANCHORS: specimen.anchors_given,
    }
    return frozenset(need for need, given in has.items() if given)
