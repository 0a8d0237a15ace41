"""Drag that depends on the Reynolds number, as a power law."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from torch import Tensor

from sim.effects.effect import PressureEffect
from sim.effects.parameter import Value, shape, strength

_SLOWEST = 1e-3
"""Below this speed [m/s] the coefficient stays what it is there, so that it is finite at rest."""


@dataclass(frozen=True, kw_only=True)
class PowerLawDrag(PressureEffect):
    """The normal force becomes ρ a |w_n| w_n (|w_n| / U₀)^(−m): a coefficient that falls as the
    Reynolds number's m.

    Attributes:
        exponent: m, 0 for a constant coefficient, 1 for Stokes flow.
        speed: U₀ at which the force is the base model's.
    """

    effect_class: ClassVar[str] = "dynamic-pressure"
    exponent: Annotated[
        Value,
        strength(
            unit="1",
            prior=(-0.3, 0.5),
            weighed=(-0.5, 0.8),
            step=0.2,
            admissible=(-2.0, 1.9),
            source="−dln C_D/dln Re: 0 for sharp-edged plates above Re 1000, to 0.5 for screens "
            "and threads at "
            "Re 1–100 (Hoerner, Fluid-Dynamic Drag, 1965, ch. 3)",
        ),
    ] = 0.0
    speed: Annotated[
        Value,
        shape(
            unit="m/s",
            prior=(2.0, 8.0),
            admissible=(1e-2, 100.0),
            source="middle of the winds of interest; shifts the coefficient only, so any value in "
            "them will do",
        ),
    ] = 5.0

    def factor(self, density: float, across: Tensor) -> Tensor:
        return (across.abs().clamp(min=_SLOWEST) / self.speed) ** (-self.exponent)
