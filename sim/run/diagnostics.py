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

CRUMPLED = 0.2
"""Root mean square compression of the faces beyond which a sheet has crumpled. Cloth gives way to compression by
buckling, so that its faces keep their area: flags of 12 and 30 columns in 0 to 10 m/s, at 0.12 and 0.284 kg/m², have at
most 0.11 with the declared damping of 0.25 ms once they have settled, and at most 0.15 in the first frames.

Without damping a sheet with a measured stretching table becomes a ball of noise, at 0.43 to 0.52. It is not the step's
doing: as in the reference simulator, the force takes the table's stiffness at each strain as if it were constant, so
that it derives from no energy, and gives some in every cycle. (12 columns without air: from 3 J at 0.6 s to 390 J at
2.4 s. In 4 m/s of wind the compression passes 0.3 within 1.2 s in the automatic step, half of it and a quarter. With
constant stiffness it stays at 0.02.) The declared damping takes more than the tables give. In the ball faces are
stretched to twice their length and stiffer than the 15 % that the stable step is estimated for: in the automatic step
most such sheets diverge within a second or two more, in half of it none. Both are reported and not stored."""
_LATE = 4
"""Share of the kept frames that is looked at, the last quarter: starts are rough, and no sheet uncrumples."""


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """Diagnostics of one member.

    Attributes:
        energies: name → value at each kept frame [J]: kinetic, stretching, bending, gravity, and where there are such,
            handles, contact.
        largest_strain: at each kept frame, the largest principal stretch of any face, less 1.
        compression: at each kept frame, how much faces are compressed, root mean square (see `CRUMPLED`).
    """

    energies: Mapping[str, tuple[float, ...]]
    largest_strain: tuple[float, ...]
    compression: tuple[float, ...]

    @property
    def crumpled(self) -> bool:
        """Whether the sheet is a ball of noise at the end."""
        return self.late_compression > CRUMPLED

    @property
    def late_compression(self) -> float:
        """Mean over the last quarter of the kept frames."""
        late = self.compression[-max(1, len(self.compression) // _LATE) :]
        return math.fsum(late) / len(late)

    def summary(self) -> dict[str, Any]:
        """Means over the kept frames, and the largest strain of all, as JSON."""
        means = {name: math.fsum(values) / len(values) for name, values in self.energies.items()}
        return {
            "mean_energies": means,
            "largest_strain": max(self.largest_strain),
            "late_compression": self.late_compression,
        }


@dataclass
class Monitor:
    """Collects diagnoses of a batch, frame by frame."""

    energies: list[dict[str, Tensor]] = field(default_factory=list)
    strains: list[Tensor] = field(default_factory=list)
    compressions: list[Tensor] = field(default_factory=list)

    def look(self, system: System, state: State) -> None:
        """Take note of a kept frame."""
        self.energies.append({name: value.cpu() for name, value in system.energies(state).items()})
        strains = principal_strains(system.cloth, state.position)
        self.strains.append(strains.amax((0, 1)).cpu())
        self.compressions.append((strains[:, 0].clamp(max=0) ** 2).mean(0).sqrt().cpu())

    def of(self, member: int) -> Diagnosis:
        """The diagnosis of a member by its place in the batch."""
        names = self.energies[0] if self.energies else {}
        return Diagnosis(
            energies={name: tuple(float(e[name][member]) for e in self.energies) for name in names},
            largest_strain=tuple(float(s[member]) for s in self.strains),
            compression=tuple(float(c[member]) for c in self.compressions),
        )


def principal_strains(cloth: Cloth, position: Tensor) -> Tensor:
    """Principal stretches less 1: (face, 2, batch), the smaller first."""
    e = membrane.strain(cloth, position)
    c00, c11, c01 = 2 * e.g00 + 1, 2 * e.g11 + 1, 2 * e.g01
    middle, half = (c00 + c11) / 2, (((c00 - c11) / 2) ** 2 + c01**2).sqrt()
    return torch.stack([middle - half, middle + half], dim=1).clamp(min=0).sqrt() - 1
