"""Viscous damping inside the cloth, beyond the material's own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

from sim.cloth.cloth_batch import Cloth
from sim.effects.effect import ClothEffect
from sim.effects.parameter import NOT_NEGATIVE, Value, strength


@dataclass(frozen=True, kw_only=True)
class InternalDamping(ClothEffect):
    """Kelvin–Voigt: the strain E is replaced by E + d dE/dt in all elastic forces, d added to the
    material's.

    Attributes:
        time: d; the amplitude of a vibration of angular frequency ω falls by e^(−π d ω) each cycle.
    """

    unweighed: ClassVar[str] = "the cloth's damping is calibrated"
    time: Annotated[
        Value,
        strength(
            unit="s",
            prior=(0.0, 2.5e-3),
            admissible=NOT_NEGATIVE,
            source="half the reference simulator's steps of 0.5 and 5 ms, whose backward Euler "
            "acts like it; loss "
            "factors d ω of 0.05–0.3 of woven cloth at 5–20 Hz",
        ),
    ] = 0.0

    def cloth(self, cloth: Cloth) -> Cloth:
        return replace(cloth, damping=cloth.damping + self.time)
