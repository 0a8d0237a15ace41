"""The calibrated parameters of the base model: density, bending and internal damping, with bounds, steps and priors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flagdata.arrays import FloatArray
from measure.observe.trajectory import DENSITY_UNCERTAINTY
from sim.material import Material


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """The base model's parameters, as factors on the nominal material; damping as it is [s]."""

    density: float = 1.0
    bending: float = 1.0
    damping: float = 2.5e-3

    def material(self, nominal: Material) -> Material:
        """Scales the nominal material by the calibration."""
        scaled = nominal.scaled(density=self.density, bending=self.bending)
        return replace(scaled, damping=self.damping)

    def moved(self, steps: Sequence[float]) -> Calibration:
        """Moves the calibration by steps along `THETA`, in its units, within its bounds."""
        density, bending, damping = steps
        return Calibration(
            density=float(np.clip(self.density * math.exp(density), *_DENSITY)),
            bending=float(np.clip(self.bending * math.exp(bending), *_BENDING)),
            damping=float(np.clip(self.damping * math.exp(damping), *_DAMPING)),
        )

    def steps_from(self, origin: Calibration) -> tuple[float, float, float]:
        """Computes the steps along `THETA` that lead here from another."""
        return (
            math.log(self.density / origin.density),
            math.log(self.bending / origin.bending),
            math.log(self.damping / origin.damping),
        )

    @property
    def at_bounds(self) -> tuple[str, ...]:
        """Names of the parameters at a bound of the model: the data would take them beyond."""
        bounds = {"density": _DENSITY, "bending": _BENDING, "damping": _DAMPING}
        return tuple(name for name, span in bounds.items() if not span[0] < getattr(self, name) < span[1])


_DENSITY = (0.2, 5.0)
_BENDING = (0.02, 50.0)
_DAMPING = (0.25e-3, 0.2)  # s; with less, the motion of a flag does not converge in the mesh

THETA: tuple[tuple[str, str, float], ...] = (("density", "ln", 0.1), ("bending", "ln", 0.7), ("damping", "ln", 0.7))
"""Name, unit and step of the calibrated parameters: natural logarithms of factors, and of the damping's time."""

DAMPING = [name for name, *_ in THETA].index("damping")
"""Place of the damping among `THETA`."""


def prior(density_uncertainty: float) -> FloatArray:
    """Returns standard deviations of the calibrated parameters about the nominal ones, in the units of `THETA`.

    Bending is known within a factor of e (the spread of one kind of cloth: Wang et al. 2011). Damping is hardly ever
    measured: within a factor of 4.5 about 2.5 ms, so that 0.25 to 30 ms are within 1.7 standard deviations.

    Args:
        density_uncertainty: relative standard uncertainty of the density.
    """
    return np.array([density_uncertainty, 1.0, 1.5])


PRIOR = prior(DENSITY_UNCERTAINTY)
"""Where nobody says how well the density is known."""

PRIOR_WITHOUT_MASS = prior(1.0)
"""Of a cloth that was not weighed and whose material is a guess: its density within a factor of e."""
