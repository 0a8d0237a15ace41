"""How the cloth of a null differs from the nominal one beyond what is calibrated: in its tables of
stiffness.

A user names the nearest of the tabulated materials; the cloth on the pole is another. Of the ten
cloths of Wang, O'Brien and Ramamoorthi (SIGGRAPH 2011), brought to one mass per area, the stiffness
of stretching along warp and weft is 0.5 to 23 times that of Camel Ponte Roma, warp and weft apart
by up to 3, and their stiffness of bending along warp, bias and weft apart by up to 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from sim.cloth.material import Material

_STRETCHING = (0.5, 2.0)
_APART = 1.7
"""Along one direction, the factor beside that of all directions is log-uniform from one over this
to this."""


@dataclass(frozen=True, kw_only=True)
class StiffnessFactors:
    """Factors [1] on the tables of a material.

    Attributes:
        stretching: of all stiffness of the membrane.
        warp, weft, shear: of that along u, along v, and of their shear, beside `stretching`.
        bending: of edges at 0, 45 and 90° from u.
    """

    stretching: float = 1.0
    warp: float = 1.0
    weft: float = 1.0
    shear: float = 1.0
    bending: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def of(self, material: Material) -> Material:
        """Multiplies the material's tables; the coupling of warp and weft by their geometric
        mean."""
        along = np.array([self.warp, math.sqrt(self.warp * self.weft), self.weft, self.shear])
        return replace(
            material,
            stretching=material.stretching * self.stretching * along,
            bending=material.bending * np.array(self.bending)[:, None],
        )


def drawn(rng: np.random.Generator) -> StiffnessFactors:
    """Draws a fabric over the prior: all factors log-uniform, those of bending about a mean of 1,
    which is calibrated."""
    stretching = float(np.exp(rng.uniform(*np.log(_STRETCHING))))
    logs = rng.uniform(-math.log(_APART), math.log(_APART), 6)
    logs[3:] -= logs[3:].mean()
    warp, weft, shear, first, second, third = (float(factor) for factor in np.exp(logs))
    bending = (first, second, third)
    return StiffnessFactors(
        stretching=stretching, warp=warp, weft=weft, shear=shear, bending=bending
    )
