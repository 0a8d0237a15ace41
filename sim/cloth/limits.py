"""Strain limits: cloth that gives easily at first and then hardly at all.

After every step each face is mapped back to the nearest deformation whose principal stretches lie
within the limits: F* = F V diag(σ*/σ) Vᵀ with FᵀF = V diag(σ²) Vᵀ, its centroid kept. A vertex
moves by the mean of what its faces ask for, weighted by their areas, which keeps the momentum; its
velocity changes by the move over the step, as in ArcSim (Narain, Samii, O'Brien 2012; Wang,
O'Brien, Ramamoorthi 2010). What the handles hold stays where it is, as there: else the cloth would
drag its handles along. One such sweep a step does not reach the limits exactly: under a steady pull
the excess is what one step of it adds, which falls with the square of the step. Long steps take
many sweeps, which from the ninth on are accelerated by Chebyshev's recurrence (Wang 2015, ACM
Trans. Graph. 34:246): 50 of them do as much as several hundred without it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import torch
from torch import Tensor

from flagdata.errors import InputError
from sim.cloth.cloth_batch import Cloth, gather_sum

PLAIN_SWEEPS = 8
"""Sweeps before the acceleration sets in."""
SPECTRAL_RADIUS = 0.995
"""Spectral radius of the sweeps, as the acceleration takes it. Tried on a flag of 30 columns with
limits of 5 %: 0.97, 0.99 and 0.995 leave the largest stretch of 50 sweeps at 1.14, 1.11 and 1.09,
plain sweeps at 1.32."""
RADIUS_AMONG_SLIVERS = 0.9999
"""The same where remeshing makes small triangles of unequal sides beside large ones, which take 500
sweeps a step of
5 ms: the paper's flag of 2 m then keeps its stretches within 0.91 and 1.07 in its first 0.2 s, with
200 and 0.9997 within 0.89 and 1.13, with 50 and 0.995 within 0.7 and 3."""


@dataclass(frozen=True, kw_only=True)
class StrainLimits:
    """Bounds of the principal stretches.

    Attributes:
        low, high: the paper's scenes say 0.95 and 1.05; null values 0 and infinity.
        sweeps: corrections a step. One is enough for the small steps; steps of 5 ms want about 50.

    Raises:
        InputError: limits that exclude the rest state, or no sweeps.
    """

    low: float = 0.95
    high: float = 1.05
    sweeps: int = 1

    def __post_init__(self) -> None:
        if not (0 <= self.low < 1 < self.high) or math.isnan(self.high):
            raise InputError(
                f"strain limits {self.low!r} to {self.high!r} exclude the rest state",
                where="strain limits",
                fix="give a low one in [0, 1) and a high one above 1",
            )
        if self.sweeps < 1:
            raise InputError(
                f"the limits take {self.sweeps} sweeps",
                where="strain limits",
                fix="give at least one",
            )


def stretches(cloth: Cloth, position: Tensor) -> tuple[Tensor, Tensor]:
    """Computes larger and smaller principal stretch of the faces: (face, batch) each."""
    _, squares = _decompose_deformation(cloth, position)
    return squares[0].sqrt(), squares[1].sqrt()


def _decompose_deformation(
    cloth: Cloth, position: Tensor
) -> tuple[tuple[Tensor, Tensor], tuple[Tensor, Tensor]]:
    """Computes x_u, x_v (face, 3, batch), and the eigenvalues of FᵀF, larger first (face,
    batch)."""
    corners = cloth.at_corners(position)
    d = cloth.gradients[..., None, None]
    xu = d[:, 0, 0] * corners[0] + d[:, 0, 1] * corners[1] + d[:, 0, 2] * corners[2]
    xv = d[:, 1, 0] * corners[0] + d[:, 1, 1] * corners[1] + d[:, 1, 2] * corners[2]
    a, b, c = (xu * xu).sum(1), (xu * xv).sum(1), (xv * xv).sum(1)
    middle, half = (a + c) / 2, (((a - c) / 2) ** 2 + b * b).sqrt()
    tiny = torch.finfo(position.dtype).tiny
    return (xu, xv), (middle + half, (middle - half).clamp(min=tiny))


def correction(cloth: Cloth, limits: StrainLimits, position: Tensor) -> Tensor:
    """Computes what one sweep moves the vertices by: (vertex, 3, batch) [m]."""
    (xu, xv), (large, small) = _decompose_deformation(cloth, position)
    scale_large = large.sqrt().clamp(limits.low, limits.high) / large.sqrt()
    scale_small = small.sqrt().clamp(limits.low, limits.high) / small.sqrt()
    # V diag(s) Vᵀ − I = α I + β C, a polynomial of C = FᵀF with the values s − 1 at its
    # eigenvalues.
    gap = large - small
    beta = torch.where(gap > 1e-9, (scale_large - scale_small) / gap.clamp(min=1e-9), 0.0)
    alpha = scale_large - 1 - beta * large
    a, b, c = (xu * xu).sum(1), (xu * xv).sum(1), (xv * xv).sum(1)
    beta, alpha = beta.unsqueeze(1), alpha.unsqueeze(1)
    du = alpha * xu + beta * (a.unsqueeze(1) * xu + b.unsqueeze(1) * xv)
    dv = alpha * xv + beta * (b.unsqueeze(1) * xu + c.unsqueeze(1) * xv)
    rest = torch.as_tensor(cloth.mesh.arms, dtype=position.dtype, device=position.device)[
        ..., None, None
    ]
    share = (cloth.areas / 3)[:, None, None]
    moves = [share * (du * rest[:, corner, 0] + dv * rest[:, corner, 1]) for corner in range(3)]
    areas = torch.as_tensor(cloth.mesh.vertex_areas, dtype=position.dtype, device=position.device)
    return gather_sum(moves, cloth.face_slots) / areas[:, None, None]


def least_correction(cloth: Cloth, limits: StrainLimits, position: Tensor) -> Tensor:
    """Computes what one sweep moves the vertices by, (vertex, 3, batch) [m], where triangles have
    unequal sides.

    For a principal direction v in the material, stretched by σ to σ d in space, the corners c move
    by (σ* − σ) d gᶜ·v/Σ (g·v)²: the least moves that bring its stretch to σ*, where gᶜ are the
    derivatives of corner c's shape function. `correction` moves them as the nearest F does, which
    is the same for equal sides; among slivers it is no nearest point, and sweeps of it diverge.
    """
    (xu, xv), squares = _decompose_deformation(cloth, position)
    a, b, c = (xu * xu).sum(1), (xu * xv).sum(1), (xv * xv).sum(1)
    turn = torch.atan2(2 * b, a - c) / 2
    directions = (turn.cos(), turn.sin()), (-turn.sin(), turn.cos())
    share = (cloth.areas / 3)[:, None, None]
    gradients = cloth.gradients[..., None]
    moves = [torch.zeros_like(xu)] * 3
    for square, (along_u, along_v) in zip(squares, directions, strict=True):
        stretch = square.sqrt()
        change = stretch.clamp(limits.low, limits.high) / stretch - 1
        axis = along_u.unsqueeze(1) * xu + along_v.unsqueeze(1) * xv
        slopes = along_u.unsqueeze(1) * gradients[:, 0] + along_v.unsqueeze(1) * gradients[:, 1]
        slopes = slopes / (slopes * slopes).sum(1, keepdim=True)
        pull = share * change.unsqueeze(1) * axis
        moves = [move + pull * slopes[:, corner : corner + 1] for corner, move in enumerate(moves)]
    areas = torch.as_tensor(cloth.mesh.vertex_areas, dtype=position.dtype, device=position.device)
    return gather_sum(moves, cloth.face_slots) / areas[:, None, None]


def limit_strains(
    cloth: Cloth,
    limits: StrainLimits,
    position: Tensor,
    velocity: Tensor,
    step: float,
    free: Tensor,
) -> tuple[Tensor, Tensor]:
    """Positions and velocities after a step [s]; `free` (vertex, 1, 1) is 0 for what the handles
    hold, else 1."""
    sweep = partial(correction, cloth, limits)
    return _swept(sweep, chebyshev_weights(limits.sweeps), position, velocity, step, free)


def limited_among_slivers(
    cloth: Cloth,
    limits: StrainLimits,
    position: Tensor,
    velocity: Tensor,
    step: float,
    free: Tensor,
) -> tuple[Tensor, Tensor]:
    """Positions and velocities after a step [s], as `limit_strains`, on a mesh of triangles with
    unequal sides."""
    sweep = partial(least_correction, cloth, limits)
    return _swept(
        sweep,
        chebyshev_weights(limits.sweeps, RADIUS_AMONG_SLIVERS),
        position,
        velocity,
        step,
        free,
    )


def _swept(
    sweep: Callable[[Tensor], Tensor],
    weights: list[float],
    position: Tensor,
    velocity: Tensor,
    step: float,
    free: Tensor,
) -> tuple[Tensor, Tensor]:
    before = position
    for weight in weights:
        after = position + free * sweep(position)
        if weight > 1:
            after = before + weight * (after - before)
        velocity = velocity + (after - position) / step
        before, position = position, after
    return position, velocity


def chebyshev_weights(sweeps: int, radius: float = SPECTRAL_RADIUS) -> list[float]:
    """Computes ω of each sweep: 1, then 2/(2 − ρ²), then 4/(4 − ρ² ω) of the one before."""
    weights = [1.0] * min(sweeps, PLAIN_SWEEPS)
    square = radius**2
    while len(weights) < sweeps:
        weights.append(
            2 / (2 - square) if len(weights) == PLAIN_SWEEPS else 4 / (4 - square * weights[-1])
        )
    return weights
