"""The calibrated parameters of the base model: area weight, bending and internal damping, with
bounds, steps, priors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flagdata.core.arrays import FloatArray
from measure.trajectories.trajectory import AREA_WEIGHT_UNCERTAINTY
from sim.cloth.material import Material


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """The base model's parameters, as factors on the nominal material; damping as it is [s]."""

    area_weight: float = 1.0
    bending: float = 1.0
    damping: float = 2.5e-3

    def material(self, nominal: Material) -> Material:
        """Scales the nominal material by the calibration."""
        scaled = nominal.scaled(area_weight=self.area_weight, bending=self.bending)
        return replace(scaled, damping=self.damping)

    def moved(self, steps: Sequence[float]) -> Calibration:
        """Moves the calibration by steps along `THETA`, in its units, within its bounds."""
        area_weight, bending, damping = steps
        return Calibration(
            area_weight=float(np.clip(self.area_weight * math.exp(area_weight), *_AREA_WEIGHT)),
            bending=float(np.clip(self.bending * math.exp(bending), *_BENDING)),
            damping=float(np.clip(self.damping * math.exp(damping), *_DAMPING)),
        )

    def steps_from(self, origin: Calibration) -> tuple[float, float, float]:
        """Computes the steps along `THETA` that lead here from another."""
        return (
            math.log(self.area_weight / origin.area_weight),
            math.log(self.bending / origin.bending),
            math.log(self.damping / origin.damping),
        )

    @property
    def at_bounds(self) -> tuple[str, ...]:
        """Names of the parameters at a bound of the model: the data would take them beyond."""
        bounds = {"area_weight": _AREA_WEIGHT, "bending": _BENDING, "damping": _DAMPING}
        return tuple(
            name for name, span in bounds.items() if not span[0] < getattr(self, name) < span[1]
        )


_AREA_WEIGHT = (0.2, 5.0)
_BENDING = (0.02, 50.0)
_DAMPING = (0.25e-3, 0.2)  # s; with less, the motion of a flag does not converge in the mesh

THETA: tuple[tuple[str, str, float], ...] = (
    ("area_weight", "ln", 0.1),
    ("bending", "ln", 0.7),
    ("damping", "ln", 0.7),
)
"""Name, unit and step of the calibrated parameters: natural logarithms of factors, and of the
damping's time."""

DAMPING = [name for name, *_ in THETA].index("damping")
"""Place of the damping among `THETA`."""


def prior(area_weight_uncertainty: float) -> FloatArray:
    """Returns standard deviations of the calibrated parameters about the nominal ones, in the units
    of `THETA`.

    Bending is known within a factor of e (the spread of one kind of cloth: Wang et al. 2011).
    Damping is hardly ever
    measured: within a factor of 4.5 about 2.5 ms, so that 0.25 to 30 ms are within 1.7 standard
    deviations.

    Args:
        area_weight_uncertainty: relative standard uncertainty of the area weight.
    """
    return np.array([area_weight_uncertainty, 1.0, 1.5])


PRIOR = prior(AREA_WEIGHT_UNCERTAINTY)
"""Where nobody says how well the area weight is known."""

PRIOR_WITHOUT_MASS = prior(1.0)
"""Of a cloth that was not weighed and whose material is a guess: its area weight within a factor of
e."""
