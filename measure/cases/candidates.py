"""Which effect may have been missing: each candidate as a load on the sheet, with the range of its strength.

A model of the paper flag is a candidate and a factor s on the logged speed, which is 1 or free: the sheet hangs in the
jet's shear layer and meets s U. The declared hypothesis is the reactive loading; the others are the wrong-effect controls,
which are given the same freedom.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import torch
from numpy.typing import NDArray

from measure.cases.sheet import Sheet
from sim.effects import Effect
from sim.effects.added_mass import AddedMass
from sim.effects.internal_damping import InternalDamping
from sim.effects.lift import Lift
from sim.effects.reactive_loading import ReactiveLoading
from sim.effects.tangential_linear_drag import TangentialLinearDrag

STEPS = 25


class Candidate(StrEnum):
    """An effect; the base model is the candidate of no strength. Names are those of `sim.effects.EFFECTS`."""

    NONE = "base"
    REACTIVE = "reactive-loading"
    ADDED_MASS = "added-mass"
    DAMPING = "internal-damping"
    LIFT = "lift"
    FRICTION = "tangential-linear-drag"


class Shear(StrEnum):
    """The speed at the sheet."""

    LOGGED = "logged"
    """The tunnel's."""
    FREE = "free"
    """s times the tunnel's, s a nuisance."""


@dataclass(frozen=True, kw_only=True)
class Strengths:
    """Values of a candidate's strength that are tried, and what it is in.

    Attributes:
        unit: of the values; "ρL" for the mass of air per area over ρ L.
        symbol: of the strength.
    """

    low: float
    high: float
    unit: str
    symbol: str

    def grid(self) -> NDArray[np.float64]:
        """(STEPS,) values, logarithmic."""
        return np.geomspace(self.low, self.high, STEPS)


STRENGTHS = {
    Candidate.NONE: Strengths(low=1.0, high=1.0, unit="", symbol="–"),
    Candidate.REACTIVE: Strengths(low=0.03, high=1.0, unit="ρL", symbol="M"),
    Candidate.ADDED_MASS: Strengths(low=0.03, high=1.0, unit="ρL", symbol="M₀"),
    Candidate.DAMPING: Strengths(low=1e-5, high=2.5e-3, unit="s", symbol="d"),
    Candidate.LIFT: Strengths(low=0.04, high=6.3, unit="", symbol="C"),
    Candidate.FRICTION: Strengths(low=5e-4, high=0.2, unit="kg/(m² s)", symbol="c"),
}
"""The priors of `sim.effects`, widened at the lower end to where they do nothing; masses up to ρ L."""


def loaded(candidate: Candidate, strength: float, *, bare: Sheet, length: float, density: float) -> Sheet:
    """The sheet at this length with the candidate's load."""
    sheet = replace(bare, length=length)
    match candidate:
        case Candidate.NONE:
            return sheet
        case Candidate.REACTIVE:
            return replace(sheet, reactive_mass=strength * density * length)
        case Candidate.ADDED_MASS:
            return replace(sheet, still_mass=strength * density * length)
        case Candidate.DAMPING:
            return replace(sheet, damping=strength)
        case Candidate.LIFT:
            return replace(sheet, lift=density * strength / 2)
        case Candidate.FRICTION:
            return replace(sheet, friction=strength)


def effects(members: list[tuple[Candidate, float]], *, length: float, density: float) -> list[Effect]:
    """The effects of a batch whose members each have one candidate at one strength."""

    def of(candidate: Candidate) -> torch.Tensor:
        return torch.tensor([strength if which is candidate else 0.0 for which, strength in members], dtype=torch.float64)

    return [
        ReactiveLoading(mass=of(Candidate.REACTIVE) * density * length),
        AddedMass(mass=of(Candidate.ADDED_MASS) * density * length),
        InternalDamping(time=of(Candidate.DAMPING)),
        Lift(coefficient=of(Candidate.LIFT), density=density),
        TangentialLinearDrag(coefficient=of(Candidate.FRICTION)),
    ]
