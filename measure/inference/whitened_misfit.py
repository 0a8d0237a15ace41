"""Measures models by the directions of the statistics, with what the fit's numerics leave taken
out."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from torch import Tensor

from flagdata.core.arrays import FloatArray
from measure.forecasting.calibrated_parameters import Calibration
from measure.inference.random_effect import NullModel
from measure.inference.segment_evidence import Evidence
from measure.probes.statistics import Projection, Statistics


@dataclass(frozen=True, kw_only=True, eq=False)
class WhitenedMisfit:
    """A squared distance of markers is mostly what the fit's mesh cannot show, and its bias by the
    mesh is larger than what most effects change. By this measure, as in the linear evidence, errors
    count by what nulls leave.

    Attributes:
        statistics: of the base model.
        projection: their directions.
        null: the null model.
        speeds: (segment,) of the wind [m/s].
        origin: calibration of the base model that the statistics are taken at.
    """

    statistics: Statistics
    projection: Projection
    null: NullModel
    speeds: FloatArray
    origin: Calibration = field(default_factory=Calibration)

    def of(self, errors: Tensor) -> Evidence:
        """Computes the evidence of a model that leaves these errors (frame, marker, 3, segment) of
        all segments [m]."""
        lines, turned = self.projection.lines(errors), self.projection.turned(errors)
        turning_before = self.statistics.turning
        turning = (
            None if turning_before is None or turned is None else replace(turning_before, r=turned)
        )
        course, course_before = self.projection.course(errors), self.statistics.course
        if course is not None and course_before is not None:
            course = replace(course, log=course_before.log)
        moved = replace(
            self.statistics,
            r=self.projection.of(errors),
            lines=lines,
            turning=turning,
            course=course,
        )
        return self.evidence(moved)

    def evidence(self, statistics: Statistics) -> Evidence:
        """Computes the evidence of all segments."""
        return Evidence.of(statistics, self.speeds, self.null)
