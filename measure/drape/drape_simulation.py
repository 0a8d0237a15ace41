"""Simulated drapes over the range of cloths, once for all fabrics: rest depends on stiffness over
weight alone.

The cloth is in its simplest form: stretching and shear of constant stiffness, and bending that
differs between warp and weft. What bends it is the tables' rows for edges along u, between, and
along v; on a mesh of nearly equilateral triangles without a preferred direction the cloth then
bends as a plate with a quarter of them (see `ratio`).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.rng import stream
from flagdata.recipes.typed_tables import Range, Scale
from measure.cloth import Uncertain, draws, readings_of
from measure.drape.drape_shape import rim_of, shape_of
from sim.cloth.material import BENDING_SHAPE, Material, isotropic
from sim.cloth.mesh import Mesh
from sim.cloth.scene import GRAVITY, assemble
from sim.cloth.stiffness_tables import direction_rows
from sim.effects import apply
from sim.effects.rest_curvature import RestCurvature
from sim.run.cusick_drape import DISC, PEDESTAL, at_rest, disc, drape_scene

REVISION = 1
"""Raised where the same cloth drapes otherwise than before."""
ROWS = 9
"""Of triangles from the pedestal's edge to the rim."""
LIMIT = 0.9
"""Time until a drape is measured [s]."""
AREA_WEIGHT = 0.2
"""Of all simulated cloths [kg/m²]: rest depends on ratios to it."""
_STRETCHING = 1500.0
"""Stretching over weight, Y h/ρ [m²/s²]: 300 N/m at 0.2 kg/m², so that its weight strains a drape
by 0.0004."""
_DAMPING = 0.01
_BATCH = 16

BENDING_LENGTH = Uncertain(
    name="bending_length",
    unit="m",
    prior=Range(low=0.008, high=0.032, scale=Scale.LOG),
    source="(B/(ρ g))^(1/3) (Peirce 1930) of B, the geometric mean of warp and weft; below it "
    "folds are narrower than "
    "the mesh, above it a disc of 0.3 m hardly drapes",
    limits=(0.0, np.inf),
)
ANISOTROPY = Uncertain(
    name="anisotropy",
    unit="1",
    prior=Range(low=-1.2, high=1.2),
    source="half the logarithm of the rows for edges across over along u: warp and weft by a "
    "factor of up to 3.3",
)
SHEAR = Uncertain(
    name="shear",
    unit="m²/s²",
    prior=Range(low=50.0, high=3000.0, scale=Scale.LOG),
    source="k3 over weight: 10 to 600 N/m at 0.2 kg/m²; fabrics shear with 30 to 170 N/m, k3 is "
    "twice that",
    limits=(0.0, np.inf),
)
CURVATURE = Uncertain(
    name="rest_curvature",
    unit="1/m",
    prior=Range(low=-25.0, high=25.0),
    source="of cloth rolled on a radius of 40 mm or more",
)
CLOTH = (BENDING_LENGTH, ANISOTROPY, SHEAR, CURVATURE)
"""What is simulated, in the order of its draws."""


def material(bending_length: float, anisotropy: float, shear: float) -> Material:
    """Makes a cloth of `AREA_WEIGHT`; arguments as in `CLOTH`."""
    stiffness = 4 * bending_length**3 * AREA_WEIGHT * -GRAVITY[2] / _mean(anisotropy)
    rows = stiffness * np.exp(np.array([-anisotropy, 0.0, anisotropy]))
    cloth = isotropic(
        name="drape",
        area_weight=AREA_WEIGHT,
        stretching=_STRETCHING * AREA_WEIGHT,
        shear=shear * AREA_WEIGHT,
        bending=1.0,
        damping=_DAMPING,
    )
    return replace(cloth, bending=np.broadcast_to(rows[:, None], BENDING_SHAPE))


def _shares(anisotropy: float) -> tuple[float, float]:
    """Computes 4 B/k of bending along u and along v, for the row in between k = 1: 3 ⟨k(φ) (4/3
    cos²ψ − 1/3)²⟩ over edges of all directions φ, ψ being the angle of their normal to the bent
    direction."""
    edges = (np.arange(720) + 0.5) * np.pi / 720
    folded = np.minimum(edges, np.pi - edges)
    k = direction_rows(folded) @ np.exp(np.array([-anisotropy, 0.0, anisotropy]))
    along = (4 / 3 * np.sin(edges) ** 2 - 1 / 3) ** 2
    across = (4 / 3 * np.cos(edges) ** 2 - 1 / 3) ** 2
    return float(3 * (k * along).mean()), float(3 * (k * across).mean())


def _mean(anisotropy: float) -> float:
    along, across = _shares(anisotropy)
    return float(np.sqrt(along * across))


def ratio(anisotropy: float) -> float:
    """Computes B along u over B along v."""
    along, across = _shares(anisotropy)
    return along / across


@functools.cache
def mesh(rows: int = ROWS) -> tuple[Mesh, IntArray]:
    """Makes the mesh of all simulated drapes, with its rim."""
    made = disc(np.random.default_rng(0), rows=rows)  # the mesh of the sheet
    return made, rim_of(made)


@dataclass(frozen=True, kw_only=True, eq=False)
class DrapeBatch:
    """Drapes that are simulated together.

    Attributes:
        values: name → (drape,), see `CLOTH`.
        seeds: (drape,) of their starts.
        rows: of the mesh.
    """

    values: Mapping[str, FloatArray]
    seeds: tuple[int, ...]
    rows: int = ROWS

    def content(self) -> Mapping[str, Any]:
        """Returns all that the shapes depend on, as JSON values."""
        return {
            "drapes": REVISION,
            "rows": self.rows,
            "limit": LIMIT,
            "disc": [DISC, PEDESTAL],
            "seeds": list(self.seeds),
            "values": {name: column.tolist() for name, column in self.values.items()},
        }

    def positions(self) -> FloatArray:
        """Simulates them: (vertex, 3, drape) [m]."""
        made, _ = mesh(self.rows)
        columns = [self.values[about.name] for about in (BENDING_LENGTH, ANISOTROPY, SHEAR)]
        cloths = [material(*map(float, row)) for row in zip(*columns, strict=True)]
        scenes = [
            drape_scene(made, cloth, stream(seed, "drape", "start"))
            for cloth, seed in zip(cloths, self.seeds, strict=True)
        ]
        system, state = assemble(scenes)
        curl = torch.tensor(self.values[CURVATURE.name], dtype=system.cloth.dtype)
        system, state = apply([RestCurvature(curvature=curl)], system, state)
        return at_rest(system, state, limit=LIMIT).position.double().numpy()

    @property
    def effort(self) -> int:
        """Number of drapes."""
        return len(self.seeds)

    def arrays(self) -> Mapping[str, FloatArray]:
        """Simulates and measures them; see `read`."""
        return {"readings": self.read()}

    def read(self) -> FloatArray:
        """Simulates and measures them: (drape, 7), see `Shape.numbers`."""
        made, rim = mesh(self.rows)
        positions = self.positions()
        return np.stack(
            [shape_of(made, positions[..., i], rim=rim).numbers() for i in range(len(self.seeds))]
        )


def batches(count: int, *, seed: int) -> list[DrapeBatch]:
    """Returns so many drapes that cover the range of `CLOTH`."""
    values = draws(CLOTH, count, seed=seed, name="drapes")
    return [
        DrapeBatch(
            values={name: column[start : start + _BATCH] for name, column in values.items()},
            seeds=tuple(range(seed * 10_000 + start, seed * 10_000 + min(start + _BATCH, count))),
        )
        for start in range(0, count, _BATCH)
    ]


def simulated_drapes(
    count: int,
    *,
    seed: int,
    folder: Path,
    workers: int = 1,
    advance: Callable[[int], object] | None = None,
) -> tuple[Mapping[str, FloatArray], FloatArray]:
    """Returns the values, name → (drape,), and the shapes (drape, 7) of simulated drapes; those
    that the folder lacks are simulated, as in `measure.cloth.design`.

    Args:
        advance: called with the number of drapes that were simulated or found.
    """
    several = batches(count, seed=seed)
    shapes = readings_of(several, folder=folder, workers=workers, advance=advance)
    return {
        about.name: np.concatenate([b.values[about.name] for b in several]) for about in CLOTH
    }, shapes
