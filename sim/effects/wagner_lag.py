"""The wake's memory: the load on the cloth grows late, as a wing's does that is set moving at once.

What a wing sheds into its wake holds its load back. After a sudden start the circulatory load is
φ(τ) of its final one (Wagner, Z. angew. Math. Mech. 5:17, 1925), with τ = 2 U t/L the distance
travelled in half chords, by Jones' fit

    φ(τ) = 1 − 0.165 exp(−0.0455 τ) − 0.335 exp(−0.3 τ)         (R. T. Jones, NACA report 681, 1940)

A load F that varies is then held back by two lags,

    L_total = F − s Σ Aᵢ (F − zᵢ),    żᵢ = (2 U/L) bᵢ (F − zᵢ),
    A = (0.165, 0.335),    b = (0.0455, 0.3)

which for F switched on at rest (zᵢ = 0) is F (1 − s (1 − φ)). Here F is the base model's normal
load of each face, ρ |w·n| w·n per area, U its speed relative to the air |w|, and L the length of
the flat cloth. It is a closure: the wake of one face acts on that face alone, as if all of the
cloth had its history.

A run begins with zᵢ = 0, as if the air had just begun to move, also where it begins from an
observed motion. Of a flag that flutters F changes its sign several times within the lags' times
L/(2 U bᵢ), 0.5 and 3.3 s at 1.5 m and 5 m/s, so that zᵢ stays near the small mean of F: over 0.1 s
this start moves the cloth by 0.29 of what the effect does, and zᵢ = F by 1.1 of it
(`tests/sim/effects/test_wagner_lag.py`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np
import torch
from torch import Tensor

from sim.cloth.air import FaceWind, face_wind
from sim.cloth.cloth_batch import Cloth
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects.cloth_geometry import norm
from sim.effects.effect import Effect, pressing
from sim.effects.parameter import Value, strength
from sim.kernel.effect_code import Given

JONES = ((0.165, 0.0455), (0.335, 0.3))
"""Amplitude and rate [1/half chord] of each lag, as in the C++."""


@dataclass(frozen=True, kw_only=True)
class WagnerLag(Effect):
    """−s Σ Aᵢ (F − zᵢ) a n on every face of area a, with żᵢ = (2 U/L) bᵢ (F − zᵢ) and F the base
    model's normal load.

    Attributes:
        share: s; 1 for Jones' fit to Wagner's function.
    """

    unweighed: ClassVar[str] = "in forecasts of 0.1 s it moves cloth as an air-density does"
    share: Annotated[
        Value,
        strength(
            unit="1",
            prior=(0.0, 1.0),
            admissible=(0.0, 1.0),
            source="1 for a wing of infinite span in attached flow (Wagner 1925); less for a "
            "finite one, whose final "
            "load is smaller while its first is nearly the same (Jones, NACA report 681, 1940)",
        ),
    ] = 0.0

    def apply(self, system: System, state: State) -> tuple[System, State]:
        lag = HeldBack(effect=self, density=pressing(self, system.air).density)
        memory = (*state.memory, lag.start(system.cloth, state.position))
        return replace(system, remembering=(*system.remembering, lag)), replace(
            state, memory=memory
        )


@dataclass(frozen=True, kw_only=True)
class HeldBack:
    """The lag of the normal load ρ |w·n| w·n of the base model's air.

    Attributes:
        density: ρ [kg/m³].
    """

    effect: WagnerLag
    density: float

    def start(self, cloth: Cloth, position: Tensor) -> Tensor:
        """Returns zᵢ = 0: (2, face, batch) [Pa]."""
        return position.new_zeros((len(JONES), len(cloth.faces), position.shape[-1]))

    def update(
        self,
        cloth: Cloth,
        memory: Tensor,
        position: Tensor,
        velocity: Tensor,
        wind: Tensor,
        elapsed: float,
    ) -> Tensor:
        """Computes zᵢ after a step of `elapsed` [s] with F as at its end, exactly: (2, face, batch)
        [Pa]."""
        relative = face_wind(cloth, position, velocity, wind)
        load, half_chords = (
            self._load(relative),
            2 / _length(cloth) * elapsed * norm(relative.relative)[:, 0],
        )
        lags = zip(memory, JONES, strict=True)
        return torch.stack(
            [load + (past - load) * torch.exp(-rate * half_chords) for past, (_, rate) in lags]
        )

    def force(
        self, cloth: Cloth, memory: Tensor, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        """Computes forces (vertex, 3, batch) [N]."""
        relative = face_wind(cloth, position, velocity, wind)
        load = self._load(relative)
        lags = zip(memory, JONES, strict=True)
        lacking = torch.stack([amplitude * (load - past) for past, (amplitude, _) in lags]).sum(0)
        third = (cloth.areas / 3)[:, None, None]
        return cloth.shared_out(
            third * (-self.effect.share * lacking).unsqueeze(1) * relative.normal
        )

    def given(self, cloth: Cloth) -> Given:
        """Lists what its C++ reads: s, half chords a metre, and ρ."""
        return Given(of=WagnerLag, numbers=(self.effect.share, 2 / _length(cloth), self.density))

    def _load(self, relative: FaceWind) -> Tensor:
        """Computes F, (face, batch) [Pa]."""
        return self.density * (relative.across.abs() * relative.across)[:, 0]


def _length(cloth: Cloth) -> float:
    """Computes the flat cloth's length from hoist to fly [m]."""
    return float(np.ptp(cloth.mesh.rest[:, 0]))
