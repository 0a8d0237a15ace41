"""Cloth that is curled at rest."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import torch
from torch import Tensor

from sim.cloth import bending
from sim.cloth.cloth_batch import Cloth, gather_sum
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects.effect import Effect
from sim.effects.parameter import Value, strength
from sim.kernel.effect_code import Given


@dataclass(frozen=True, kw_only=True)
class RestCurvature(Effect):
    """Hinges rest at the fold angles θ₀ of the cloth rolled onto a cylinder along v: energy k S (θ
    − θ₀)²/4.

    The stiffness k is still looked up at θ. Only its explicit part is new: +k S θ₀/2 ∇θ on every
    hinge.

    Attributes:
        curvature: of the cylinder; positive where the cloth is hollow on the side of its normals.
    """

    double: ClassVar[bool] = True
    curvature: Annotated[
        Value,
        strength(
            unit="1/m",
            prior=(-3.0, 3.0),
            weighed=(-6.0, 6.0),
            step=1.0,
            admissible=(-50.0, 50.0),
            source="cloth stored on rolls of 0.3 m radius or more; the curl of knitted edges is "
            "stronger, but narrow",
        ),
    ] = 0.0

    def apply(self, system: System, state: State) -> tuple[System, State]:
        curl = Curl(angle=bending.fold_angle(system.cloth, self.roll_cloth(system.cloth)))
        return replace(system, effects=(*system.effects, curl)), state

    def roll_cloth(self, cloth: Cloth) -> Tensor:
        """Rolls the cloth on its cylinder: (vertex, 3, batch) [m]."""
        rest = torch.tensor(cloth.mesh.rest, dtype=cloth.dtype, device=cloth.device)
        u, v = rest[:, :1], rest[:, 1:].expand(-1, cloth.batch)
        turn = (self.curvature * u / torch.pi).expand(-1, cloth.batch)
        # sin(κu)/κ and (1 − cos κu)/κ without the division.
        return torch.stack(
            [u * torch.sinc(turn), v, self.curvature * u**2 / 2 * torch.sinc(turn / 2) ** 2], dim=1
        )


@dataclass(frozen=True, kw_only=True)
class Curl:
    """The force of rest angles (hinge, batch) [rad]."""

    angle: Tensor

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        """Computes forces (vertex, 3, batch) [N]; time, velocity and wind do not matter."""
        f = bending.fold(cloth, position)
        moment = (bending.stiffness(cloth, f.angle) * self.angle).unsqueeze(1)
        return gather_sum([moment * gradient for gradient in f.gradient], cloth.hinge_slots)

    def given(self, cloth: Cloth) -> Given:
        """Lists what its C++ reads: the angle of each hinge."""
        return Given(of=type(self), numbers=(), own=self.angle.unsqueeze(1))
