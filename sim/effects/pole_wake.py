"""The wake of the pole the flag hangs on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import torch
from torch import Tensor

from sim.effects.cloth_geometry import horizontal, left_of, norm
from sim.effects.effect import FlowEffect
from sim.effects.parameter import NOT_NEGATIVE, Value, shape, strength


@dataclass(frozen=True, kw_only=True)
class PoleWake(FlowEffect):
    """The mean wake of a vertical cylinder through the middle of the attachments.

    With x downstream of the axis, y across, and the momentum thickness θ = C_D D/2, the wind's
    horizontal part loses

        q · 1.58 √(θ/ξ) exp(−y²/(2 ℓ²)) · x/(x + D),    ℓ = 0.252 √(θ ξ),    ξ = x + 2.5 θ

    of itself for x > 0: the self-preserving plane wake (Tennekes and Lumley, A First Course in
    Turbulence, 1972, section 4.2), with its origin moved so that it starts at 1, and formed within
    about a diameter. Far behind, the loss integrates to θ across the wake. Vortex shedding is not
    in it.

    Attributes:
        share: q; 1 for the wake of theory.
        diameter: D of the pole.
        drag: C_D of the pole.
    """

    share: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.3, 1.5),
            weighed=(0.2, 1.5),
            step=0.4,
            admissible=(0.0, 2.0),
            source="1 by theory; the constants scatter by 20 % between wakes, slanted poles more",
        ),
    ] = 0.0
    diameter: Annotated[
        Value,
        shape(
            unit="m",
            prior=(0.02, 0.12),
            admissible=(1e-4, 2.0),
            source="flag poles: 20 mm hand-held to 120 mm at 10 m",
        ),
    ] = 0.06
    drag: Annotated[
        Value,
        shape(
            unit="1",
            prior=(0.6, 1.2),
            admissible=NOT_NEGATIVE,
            source="circular cylinder: 1.2 below Re 2e5, 0.3–0.7 above (Hoerner, Fluid-Dynamic "
            "Drag, 1965, ch. 3)",
        ),
    ] = 1.1

    def field(self, time: float, offset: Tensor, wind: Tensor) -> Tensor:
        level = horizontal(wind, axis=-2)
        direction = level / norm(level, axis=-2).clamp(min=torch.finfo(wind.dtype).tiny)
        along = (offset * direction).sum(1, keepdim=True)
        across = (offset * left_of(direction, axis=-2)).sum(1, keepdim=True)
        thickness = self.drag * self.diameter / 2
        downstream = along.clamp(min=0)
        grown = downstream + 2.5 * thickness + torch.finfo(wind.dtype).tiny
        width = 0.252**2 * thickness * grown + torch.finfo(wind.dtype).tiny
        depth = 1.58 * (thickness / grown) ** 0.5 * torch.exp(-(across**2) / (2 * width))
        loss = self.share * depth * downstream / (downstream + self.diameter)
        return wind - loss * level
