"""What is measured of every member on the way: energies, strain, and whether its shape can be believed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import torch
from torch import Tensor

from sim import membrane
from sim.cloth import Cloth
from sim.state import State
from sim.system import System


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """Of one member.

    Attributes:
        energies: name → value at each kept frame [J]: kinetic, stretching, bending, gravity, and where there are such,
            handles, contact.
        largest_strain: at each kept frame, the largest principal stretch of any face, less 1.
    """

    energies: Mapping[str, tuple[float, ...]]
    largest_strain: tuple[float, ...]

    def summary(self) -> dict[str, Any]:
        """Means over the kept frames, and the largest strain of all, as JSON."""
        means = {name: math.fsum(values) / len(values) for name, values in self.energies.items()}
        return {"mean_energies": means, "largest_strain": max(self.largest_strain)}


@dataclass
class Monitor:
    """Collects diagnoses of a batch, frame by frame."""

    energies: list[dict[str, Tensor]] = field(default_factory=list)
    strains: list[Tensor] = field(default_factory=list)

    def look(self, system: System, state: State) -> None:
        """Take note of a kept frame."""
        self.energies.append({name: value.cpu() for name, value in system.energies(state).items()})
        self.strains.append(principal_strains(system.cloth, state.position).amax((0, 1)).cpu())

    def of(self, member: int) -> Diagnosis:
        """The diagnosis of a member by its place in the batch."""
        names = self.energies[0] if self.energies else {}
        return Diagnosis(
            energies={name: tuple(float(e[name][member]) for e in self.energies) for name in names},
            largest_strain=tuple(float(s[member]) for s in self.strains),
        )


def principal_strains(cloth: Cloth, position: Tensor) -> Tensor:
    """Principal stretches less 1: (face, 2, batch), the smaller first."""
    e = membrane.strain(cloth, position)
    c00, c11, c01 = 2 * e.g00 + 1, 2 * e.g11 + 1, 2 * e.g01
    middle, half = (c00 + c11) / 2, (((c00 - c11) / 2) ** 2 + c01**2).sqrt()
    return torch.stack([middle - half, middle + half], dim=1).clamp(min=0).sqrt() - 1
