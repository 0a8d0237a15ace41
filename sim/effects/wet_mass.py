"""Water in the cloth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

from sim.cloth.cloth_batch import Cloth
from sim.effects.effect import ClothEffect
from sim.effects.parameter import NOT_NEGATIVE, Value, strength
from sim.effects.weighing import Copied, Need


@dataclass(frozen=True, kw_only=True)
class WetMass(ClothEffect):
    """Every mass is multiplied by 1 + w.

    Attributes:
        uptake: w, mass of water per mass of dry cloth.
    """

    effect_class: ClassVar[str] = "hem"
    copied: ClassVar[Copied | None] = Copied(
        by="the area weight", shown_by=Need.AREA_WEIGHT, how="the dry cloth on a scale"
    )
    uptake: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.0, 1.0),
            weighed=(0.05, 1.0),
            step=0.1,
            admissible=NOT_NEGATIVE,
            source="moisture regain of 0.004 (polyester) to 0.085 (cotton) at 65 % humidity, "
            "ISO/TR 6741-4; dripping "
            "cloth 0.3–1.5",
        ),
    ] = 0.0

    def cloth(self, cloth: Cloth) -> Cloth:
        return replace(cloth, mass=cloth.mass * (1 + self.uptake))
