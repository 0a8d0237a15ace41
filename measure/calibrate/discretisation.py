"""Meshes and steps of other kinds than the fit's, by which null experiments are simulated.

The share of the step by which backward Euler damps is taken from the cloth's damping, as in all simulations here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from flagdata.rng import stream
from measure.nulls.simulation import irregular
from sim.mesh import Diagonals, Mesh, grid

FINER = (0.85, 1.2)
"""Vertices along a side over the fit's, by its mean area a vertex: 11 to 16 columns. Up to 1.75 on trajectories; here a
minute of film costs as much as 30 of their segments, and what finer meshes do is measured and part of the scatter
(`measure.calibrate.numerics`)."""
STEPS = (2e-3, 3e-3, 4e-3)
"""Of backward Euler [s]."""
LITTLE = 1e-3
"""s of damping below which cloths are simulated by leapfrog, whose steps may be the longer the less they damp."""


@dataclass(frozen=True, kw_only=True)
class Discretisation:
    """One kind of numerics.

    Attributes:
        finer: vertices along a side over the fit's.
        diagonals: which way a grid's faces are cut: 0 or 1 of `Diagonals`.
        uneven: seed of an irregular mesh; None for a grid.
        step: of backward Euler [s]; None for leapfrog.
    """

    finer: float
    diagonals: int
    uneven: int | None
    step: float | None

    @classmethod
    def drawn(cls, rng: np.random.Generator, *, explicit: float) -> Discretisation:
        """One at random: half of the meshes are irregular, as other codes' are.

        Args:
            explicit: share of leapfrog.
        """
        low, high = FINER
        return cls(
            finer=float(rng.uniform(low, high)),
            diagonals=int(rng.integers(2)),
            uneven=int(rng.integers(2**31)) if rng.random() < 0.5 else None,
            step=None if rng.random() < explicit else float(STEPS[rng.integers(len(STEPS))]),
        )

    def mesh(self, fit: Mesh) -> Mesh:
        """This kind's mesh of the cloth of the fit's one."""
        low, (width, height) = fit.rest.min(axis=0), np.ptp(fit.rest, axis=0).tolist()
        spacing = math.sqrt(width * height / fit.vertex_count) / self.finer
        flat = grid(
            width=width,
            height=height,
            columns=max(2, round(width / spacing)),
            rows=max(2, round(height / spacing)),
            diagonals=list(Diagonals)[self.diagonals],
        )
        if self.uneven is not None:
            flat = irregular(flat, spacing, stream(self.uneven, "discretisation", "mesh"))
        return replace(flat, rest=flat.rest + low)

    def content(self) -> dict[str, float | int | None]:
        """JSON values."""
        return {"finer": self.finer, "diagonals": self.diagonals, "uneven": self.uneven, "step": self.step}
