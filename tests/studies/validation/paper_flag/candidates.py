"""What may have been missing: each candidate as a load on the sheet, with the strengths that are
tried.

A model of the paper flag is a candidate and a factor s on the logged speed, which is 1 or free: the
sheet hangs in the jet's shear layer and meets s U. The declared hypothesis is the reactive loading;
the others are the wrong-effect controls, which are given the same freedom.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import torch

from sim.effects import (
    AddedMass,
    Effect,
    InternalDamping,
    Lift,
    ReactiveLoading,
    TangentialLinearDrag,
)
from tests.studies.validation.paper_flag.sheet import Sheet


class Candidate(StrEnum):
    """Names are those of `sim.effects.EFFECTS`; the base model is the one without any."""

    NONE = "base"
    REACTIVE = "reactive-loading"
    ADDED_MASS = "added-mass"
    DAMPING = "internal-damping"
    LIFT = "lift"
    FRICTION = "tangential-linear-drag"
    REACTIVE_AND_LIFT = "reactive-loading + lift"


class Shear(StrEnum):
    """The speed at the sheet."""

    LOGGED = "logged"
    """The tunnel's."""
    FREE = "free"
    """s times the tunnel's, s a nuisance."""


@dataclass(frozen=True, kw_only=True)
class Load:
    """Strengths of the effects; 0 is none.

    Attributes:
        reactive, added: mass of air per area over ρ L.
        damping: d [s].
        lift: C, slope of the lift coefficient.
        friction: c [kg/(m² s)].
    """

    reactive: float = 0.0
    added: float = 0.0
    damping: float = 0.0
    lift: float = 0.0
    friction: float = 0.0

    def __str__(self) -> str:
        units = {
            "reactive": "M {} ρL",
            "added": "M₀ {} ρL",
            "damping": "d {} s",
            "lift": "C {}",
            "friction": "c {} kg/(m² s)",
        }
        parts = [
            text.format(f"{value:.2g}")
            for name, text in units.items()
            if (value := getattr(self, name))
        ]
        return ", ".join(parts) or "–"


def tried(candidate: Candidate) -> tuple[Load, ...]:
    """Loads of a candidate for linear stability: the priors of `sim.effects`, from where they do
    next to nothing."""
    masses = np.geomspace(0.03, 1.0, 29).tolist()
    lifts = np.geomspace(0.04, 6.3, 25).tolist()
    match candidate:
        case Candidate.NONE:
            return (Load(),)
        case Candidate.REACTIVE:
            return tuple(Load(reactive=m) for m in masses)
        case Candidate.ADDED_MASS:
            return tuple(Load(added=m) for m in masses[::2])
        case Candidate.DAMPING:
            return tuple(Load(damping=d) for d in np.geomspace(1e-5, 2.5e-3, 13).tolist())
        case Candidate.LIFT:
            return tuple(Load(lift=c) for c in lifts)
        case Candidate.FRICTION:
            return tuple(Load(friction=c) for c in np.geomspace(5e-4, 0.2, 13).tolist())
        case Candidate.REACTIVE_AND_LIFT:
            return tuple(
                Load(reactive=m, lift=c) for m, c in itertools.product(masses[::4], lifts[::4])
            )


def loaded(load: Load, *, bare: Sheet, length: float, density: float) -> Sheet:
    """The sheet at this length with this load."""
    return replace(
        bare,
        length=length,
        reactive_mass=load.reactive * density * length,
        still_mass=load.added * density * length,
        damping=load.damping,
        lift=density * load.lift / 2,
        friction=load.friction,
    )


def effects(loads: Sequence[Load], *, length: float, density: float) -> list[Effect]:
    """The effects of a batch whose members have these loads."""

    def each(name: str) -> torch.Tensor:
        return torch.tensor([getattr(load, name) for load in loads], dtype=torch.float64)

    return [
        ReactiveLoading(mass=each("reactive") * density * length),
        AddedMass(mass=each("added") * density * length),
        InternalDamping(time=each("damping")),
        Lift(coefficient=each("lift"), density=density),
        TangentialLinearDrag(coefficient=each("friction")),
    ]
