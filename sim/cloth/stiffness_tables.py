"""Evaluation of the measured stretching and bending tables, as the reference simulator does it and
corrected.

Stretching. The tables give four stiffnesses at zero strain and, for five directions of the larger
principal strain, at full strain. They are sampled once on a regular grid over the Green strain
(G00, G11, |G01|) and looked up trilinearly.

- `ARCSIM` (ArcSim 0.2.1): a 30³ grid from (−0.25, −0.25, 0) with spacing 1/30; strain weight
  clamp(6(√λ1 − 1), 0, 1), λ1 the larger eigenvalue of C = 2G + I; angle weight from its
  eigenvector; negative values set to 0, then doubled. Zero strain is not a node of this grid, so
  that even an unstrained cloth gets a mixture of its neighbours: results of the reference depend on
  that, hence it is kept.
- `CORRECTED`: nodes at zero strain, half the spacing, and over the range cloth reaches (−0.15 to
  0.35); the coupling k1 keeps its sign, limited to |k1| ≤ 0.95 √(k0 k2) so that the energy stays
  positive; only k3 < 0 is set to 0.

Bending. The stiffness is linear between the five curvature columns α = ½ θ l/(a0 + a1) = 0, 5, 10,
15, 20 1/m and between the three edge directions, constant above 20 1/m.

- `ARCSIM`: a negative fold angle θ continues the first segment's line below zero curvature, clamped
  at 0: the two faces of the cloth bend differently.
- `CORRECTED`: |α| is looked up; both faces bend alike.

Source: Wang, O'Brien, Ramamoorthi, ACM TOG 30(4):71 (2011), section 3; the clamps from ArcSim
0.2.1's behaviour.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray
from sim.cloth.material import Material

CURVATURE_SPACING = 5.0
"""Distance of the bending table's columns [1/m]."""
_COUPLING_LIMIT = 0.95


class Evaluation(StrEnum):
    """How the measured tables are read between, beyond and below their entries."""

    ARCSIM = "arcsim"
    CORRECTED = "corrected"


@dataclass(frozen=True, kw_only=True)
class StrainGrid:
    """The regular grid over (G00, G11, |G01|) on which stretching stiffness is sampled."""

    origin: float
    spacing: float
    counts: tuple[int, int, int]


GRIDS = {
    Evaluation.ARCSIM: StrainGrid(origin=-0.25, spacing=1 / 30, counts=(30, 30, 30)),
    Evaluation.CORRECTED: StrainGrid(origin=-0.15, spacing=1 / 60, counts=(31, 31, 19)),
}


def sample_stretching(table: FloatArray, evaluation: Evaluation) -> FloatArray:
    """Samples the stretching stiffness at the nodes of the evaluation's grid.

    Args:
        table: (6, 4) [N/m].

    Returns:
        (n00, n11, n01, 4) [N/m], as they act (doubled).
    """
    grid = GRIDS[evaluation]
    direct = [grid.origin + np.arange(n) * grid.spacing for n in grid.counts[:2]]
    shear = np.arange(grid.counts[2]) * grid.spacing
    g00, g11, g01 = np.meshgrid(*direct, shear, indexing="ij")
    c00, c11, c01 = 2 * g00 + 1, 2 * g11 + 1, 2 * g01
    larger = (c00 + c11) / 2 + np.hypot((c00 - c11) / 2, c01)
    strain = np.clip(6 * (np.sqrt(larger) - 1), 0, 1)
    # The eigenvector of the larger eigenvalue lies in the first quadrant, since c01 ≥ 0.
    angle = np.where(c01 > 0, np.arctan2(c01, larger - c11), np.where(c00 >= c11, 0.0, np.pi / 2))
    column = np.clip(angle * 8 / np.pi, 0, 4 - 1e-6)
    low = column.astype(np.int64)
    share = (column - low)[..., None]
    full = table[1 + low] * (1 - share) + table[2 + low] * share
    stiffness = 2 * (table[0] * (1 - strain[..., None]) + full * strain[..., None])
    if evaluation is Evaluation.ARCSIM:
        return np.maximum(stiffness, 0)
    bound = _COUPLING_LIMIT * np.sqrt(stiffness[..., 0] * stiffness[..., 2])
    stiffness[..., 1] = np.clip(stiffness[..., 1], -bound, bound)
    stiffness[..., 3] = np.maximum(stiffness[..., 3], 0)
    return stiffness


def stretching_stiffness(
    g00: Tensor, g11: Tensor, g01: Tensor, samples: Tensor, table_of: Tensor, grid: StrainGrid
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Looks the stiffness up trilinearly; beyond the grid its edge values hold.

    Args:
        g00, g11, g01: (face, batch) Green strain.
        samples: (table, n00, n11, n01, 4) [N/m].
        table_of: (batch,) which table each member of the batch uses.

    Returns:
        k0, k1, k2, k3: (face, batch) [N/m].
    """
    cells, shares = [], []
    for value, start, count in zip(
        (g00, g11, g01.abs()), (grid.origin, grid.origin, 0.0), grid.counts, strict=True
    ):
        node = ((value - start) / grid.spacing).clamp(0, count - 1)
        # A member that has diverged (NaN) stays so through its share; its cell must only be one
        # that is there.
        cell = node.detach().nan_to_num(nan=0.0).floor().clamp(max=count - 2)
        cells.append(cell.long())
        shares.append(node - cell)
    flat = samples.reshape(-1, 4)
    _, n1, n2 = grid.counts
    base = ((table_of * grid.counts[0] + cells[0]) * n1 + cells[1]) * n2 + cells[2]
    total = torch.zeros((*base.shape, 4), dtype=samples.dtype, device=samples.device)
    for i, wi in enumerate((1 - shares[0], shares[0])):
        for j, wj in enumerate((1 - shares[1], shares[1])):
            for k, wk in enumerate((1 - shares[2], shares[2])):
                total = total + (wi * wj * wk).unsqueeze(-1) * flat[base + ((i * n1 + j) * n2 + k)]
    return total[..., 0], total[..., 1], total[..., 2], total[..., 3]


def bending_segments(materials: Sequence[Material]) -> FloatArray:
    """Computes the bending rows as coefficients of 1, c, (c − 1)₊, (c − 2)₊, (c − 3)₊ with c the
    curvature in columns.

    A piecewise linear function written as a sum vectorises where an indexed look-up does not.

    Returns:
        (3, 5, batch) [N·m].
    """
    tables = np.stack([material.bending for material in materials], axis=-1)
    slopes = np.diff(tables, axis=1)
    return np.concatenate([tables[:, :1], slopes[:, :1], np.diff(slopes, axis=1)], axis=1)


def bending_stiffness(
    curvature: Tensor, segments: Tensor, rows: Tensor, evaluation: Evaluation
) -> Tensor:
    """Computes the bending stiffness of hinges.

    Args:
        curvature: (hinge, batch) α in units of the column spacing (α / 5 1/m).
        segments: (3, 5, batch) from `bending_segments`.
        rows: (hinge, 3) weights of the three edge directions.

    Returns:
        (hinge, batch) [N·m], at least 0.
    """
    column = curvature.abs() if evaluation is Evaluation.CORRECTED else curvature
    column = column.clamp(max=4)
    basis = [column] + [(column - knot).clamp(min=0) for knot in range(1, 4)]
    total = torch.zeros_like(curvature)
    for row in range(3):
        value = segments[row, 0]
        for coefficient, function in zip(segments[row, 1:], basis, strict=True):
            value = value + coefficient * function
        total = total + rows[:, row, None] * value
    return total.clamp(min=0)


def direction_rows(directions: FloatArray) -> FloatArray:
    """Weighs the table's rows (0, 45, 90°) for edges in these directions.

    Args:
        directions: (hinge,) in [0, π/2].

    Returns:
        (hinge, 3), rows summing to 1.
    """
    row = np.clip(directions * 4 / np.pi, 0, 2)
    rows = [np.maximum(1 - row, 0), 1 - np.abs(row - 1), np.maximum(row - 1, 0)]
    return np.stack(rows, axis=1).astype(np.float64)
