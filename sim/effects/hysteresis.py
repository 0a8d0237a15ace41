"""Friction between the yarns when the cloth bends."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import torch
from torch import Tensor

from sim.cloth import bending
from sim.cloth.cloth_batch import Cloth, gather_sum
from sim.cloth.state import State
from sim.cloth.stiffness_tables import CURVATURE_SPACING
from sim.cloth.system import System
from sim.effects.effect import Effect
from sim.effects.parameter import NOT_NEGATIVE, Value, shape, strength
from sim.kernel.effect_code import Given


@dataclass(frozen=True, kw_only=True)
class Hysteresis(Effect):
    """Dahl's friction model (1968) in the curvature α = ½ θ l/(a0 + a1) of every hinge.

    Beside the elastic couple per width k α there is one of H z, with

        dz = (1 − z sgn dα) dα / α₀,    −1 ≤ z ≤ 1,

    that is, over any monotone change Δα, z ← s + (z − s) exp(−|Δα|/α₀) with s = sgn Δα. It does not
    depend on the rate. A cycle between −A and A dissipates 4 H (A − α₀ tanh(A/α₀)) per area of
    hinge. The force is explicit in both
    integrators: with backward Euler, H/α₀ should not exceed the cloth's bending stiffness by much.

    Attributes:
        couple: H, half the width of the hysteresis loop.
        curvature: α₀ over which the friction turns round.
    """

    double: ClassVar[bool] = True
    effect_class: ClassVar[str] = "bending"
    couple: Annotated[
        Value,
        strength(
            unit="N",
            prior=(0.0, 5e-4),
            weighed=(5e-5, 2e-3),
            step=1e-4,
            admissible=NOT_NEGATIVE,
            source="Kawabata's 2HB of 0.02–0.1 gf·cm/cm for apparel cloth (Kawabata, "
            "Standardization and Analysis of "
            "Hand Evaluation, 1980), halved",
        ),
    ] = 0.0
    curvature: Annotated[
        Value,
        shape(
            unit="1/m",
            prior=(2.0, 50.0),
            admissible=(1e-2, 1e4),
            source="initial slopes of Kawabata's bending curves: friction turns round within 10–50 "
            "1/m",
        ),
    ] = 10.0

    def start(self, cloth: Cloth, position: Tensor) -> Tensor:
        """Returns z = 0, and the fold angles: (2, hinge, batch)."""
        angle = bending.fold_angle(cloth, position)
        return torch.stack([torch.zeros_like(angle), angle])

    def update(
        self,
        cloth: Cloth,
        memory: Tensor,
        position: Tensor,
        velocity: Tensor,
        wind: Tensor,
        elapsed: float,
    ) -> Tensor:
        """Computes z and the fold angles after a step to a position (vertex, 3, batch), however
        long: (2, hinge, batch)."""
        past, before = memory
        angle = bending.fold_angle(cloth, position)
        change = CURVATURE_SPACING * cloth.hinge_column[:, None] * (angle - before)
        goal = torch.sign(change)
        return torch.stack(
            [goal + (past - goal) * torch.exp(-change.abs() / self.curvature), angle]
        )

    def force(
        self, cloth: Cloth, memory: Tensor, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        """Computes −½ l H z ∇θ on every hinge, as the elastic couple −½ l k α ∇θ: (vertex, 3,
        batch) [N]."""
        moment = (-_half_lengths(cloth)[:, None] * self.couple * memory[0]).unsqueeze(1)
        return gather_sum(
            [moment * g for g in bending.fold(cloth, position).gradient], cloth.hinge_slots
        )

    def given(self, cloth: Cloth) -> Given:
        """Lists what its C++ reads: its parameters, and of each hinge its curvature per angle and
        half its length."""
        columns = torch.stack([CURVATURE_SPACING * cloth.hinge_column, _half_lengths(cloth)], dim=1)
        return replace(super().given(cloth), own=columns.unsqueeze(-1).expand(-1, -1, cloth.batch))

    def apply(self, system: System, state: State) -> tuple[System, State]:
        memory = (*state.memory, self.start(system.cloth, state.position))
        return replace(system, remembering=(*system.remembering, self)), replace(
            state, memory=memory
        )


def _half_lengths(cloth: Cloth) -> Tensor:
    """Computes half the hinges' lengths, (hinge,) [m]."""
    return torch.as_tensor(cloth.mesh.hinge_lengths, dtype=cloth.dtype, device=cloth.device) / 2
