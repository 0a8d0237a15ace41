"""What the user says of the cloth and its surroundings, beside the recordings."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.stated import Stated
from flagdata.errors import InputError, UsageError
from measure.trajectories.cloth_mesh import VERTICES
from measure.trajectories.trajectory import AREA_WEIGHT_UNCERTAINTY
from sim.cloth.air import AirForce
from sim.cloth.material import Material


class Hold(StrEnum):
    """Attachments with a name. u runs from the hoist to the fly, v from the bottom to the top."""

    HOIST_CORNERS = "hoist-corners"
    """The two ends of the hoist: smallest u, smallest and largest v."""
    TOP_CORNERS = "top-corners"
    """The two ends of the top edge: largest v, smallest and largest u."""
    HOIST = "hoist"
    """All of the hoist."""

    @classmethod
    def _missing_(cls, value: object) -> Hold | None:
        """Reads `corners`, as films name the ends of the hoist."""
        return cls.HOIST_CORNERS if value == "corners" else None


@dataclass(frozen=True, kw_only=True, eq=False)
class Setup:
    """What is given of an experiment. None leaves a value to the recordings' own description.

    Attributes:
        material: nominal.
        area_weight: of the cloth, in place of the material's [kg/m²]; None for that.
        area_weight_uncertainty: relative standard uncertainty of an area weight that is stated
            without one, as the material's is; None of a cloth that was not weighed and whose
            material is a guess: all that is found is then a ratio to it.
        outline: (corner, 2) of the flat cloth, in the coordinates of the markers [m].
        pins: where the cloth is held: a name, or rest coordinates ((u, v), …) [m].
        carried: whether the attachments move: the cloth is held by hands or by a robot. They then
            go where the markers at the pins go, or where the nearest markers say that the pins are,
            and hold rigidly.
        stiffness: of each attachment on each axis [N/m]; infinite for rigid.
        gravity: magnitude [m/s²]; it acts along −z.
        air: the base model's force.
        vertices: of the model mesh, about.

    Raises:
        InputError: values that make no sense.
    """

    material: Material | None = None
    area_weight: Stated | None = None
    area_weight_uncertainty: float | None = AREA_WEIGHT_UNCERTAINTY
    outline: FloatArray | None = None
    pins: Hold | tuple[tuple[float, float], ...] | None = None
    carried: bool = False
    stiffness: float | None = None
    gravity: float | None = None
    air: AirForce | None = None
    vertices: int = VERTICES

    def __post_init__(self) -> None:
        if self.outline is not None and (
            np.ndim(self.outline) != 2 or np.shape(self.outline)[1:] != (2,)
        ):
            raise self._wrong(
                f"the outline has the shape {np.shape(self.outline)}", "give (corner, 2) in metres"
            )
        if self.outline is not None and (
            len(self.outline) < 3 or not np.isfinite(self.outline).all()
        ):
            raise self._wrong(
                "the outline has fewer than three finite corners", "list its corners in order"
            )
        if isinstance(self.pins, tuple) and not (self.pins and np.isfinite(self.pins).all()):
            raise self._wrong(
                f"the pins are {self.pins!r}", "give a name, or finite (u, v) in metres"
            )
        if self.stiffness is not None and not self.stiffness > 0:
            raise self._wrong(
                f"the stiffness is {self.stiffness!r}", "give N/m, or infinity for rigid pins"
            )
        if self.carried and self.stiffness not in (None, math.inf):
            raise self._wrong(
                "a stiffness of pins that are carried", "leave it out: they hold rigidly"
            )
        if self.area_weight is not None and not self.area_weight.middle > 0:
            raise self._wrong(
                f"the area weight is {self.area_weight.text} kg/m²", "give kg/m² above 0"
            )
        if self.relative is not None and not 0 < self.relative <= 1:
            raise self._wrong(
                f"the relative uncertainty of the area weight is {self.relative!r}",
                "give the relative standard uncertainty, such as 0.02 for 2 %",
            )
        if self.gravity is not None and not (math.isfinite(self.gravity) and self.gravity >= 0):
            raise self._wrong(f"the gravity is {self.gravity!r}", "give m/s², downward")
        if self.vertices < 16:
            raise self._wrong(f"the model mesh has {self.vertices} vertices", "ask for at least 16")

    @property
    def relative(self) -> float | None:
        """The relative standard uncertainty of the cloth's area weight; None of a guess."""
        if self.area_weight is None or self.area_weight.exact:
            return self.area_weight_uncertainty
        return self.area_weight.deviation / self.area_weight.middle

    def state_weight(self, area_weight: Stated | None, relative: float | None = None) -> Setup:
        """Puts what the user states of the cloth's weight in place of the material's; with neither,
        nothing changes.

        Args:
            area_weight: value and standard deviation of a weighing, or a range, uniform [kg/m²].
            relative: standard uncertainty of the material's own area weight, as a share of it.

        Raises:
            UsageError: both are given; or a weight without an uncertainty, or not above 0.
        """
        if area_weight is None:
            if relative is None:
                return self
            value = None if self.area_weight is None else Stated.of(self.area_weight.middle)
            return replace(self, area_weight=value, area_weight_uncertainty=relative)
        if relative is not None:
            raise UsageError(
                "the uncertainty of the weight is given twice",
                where="--density-uncertainty",
                fix="leave it out: --area-weight states both",
            )
        if not 0 < area_weight.deviation <= area_weight.middle:
            raise UsageError(
                f"an area weight of {area_weight.text} kg/m² has no usable uncertainty",
                where="--area-weight",
                fix="give that of the weighing, as in 0.155±0.003",
            )
        return replace(self, area_weight=area_weight)

    def _wrong(self, message: str, fix: str) -> InputError:
        return InputError(message, where="setup", fix=fix)


def sheet(width: float, height: float) -> FloatArray:
    """Outlines a rectangle from (0, 0) to (width, height) [m].

    Raises:
        InputError: a size that is not positive.
    """
    if not (0 < width < math.inf and 0 < height < math.inf):
        raise InputError(
            f"the cloth measures {width} m × {height} m",
            where="setup",
            fix="give positive sizes in metres",
        )
    return np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
