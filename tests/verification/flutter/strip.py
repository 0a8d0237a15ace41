"""The simulator's answer to the question of `beam`: how fast small deflections of a strip of cloth
grow in a stream.

The strip is in the x–z plane, one cell high or more, its stream along x. The simulator knows
nothing of beams: the strip is a mesh of triangles and hinges like any cloth, and goes through
scenes, effects and integrators as a user's cloth does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray
from sim.cloth.handles import Handles
from sim.cloth.material import isotropic
from sim.cloth.mesh import grid
from sim.cloth.scene import Scene, assemble
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import Effect, ReactiveLoading, TangentialLinearDrag, apply
from sim.integrate import Integrator, Symplectic
from tests.verification.flutter.beam import Onset, Strip

# In-plane stiffness [N/m]: stiff enough that nothing stretches, soft enough that steps are long.
_STRETCHING = 10.0
# Tip deflection at the start, in lengths: small enough that quadratic drag and large slopes do not
# count at the end of the growth either.
_DEFLECTION = 1e-7
_SAMPLES = 120


def assembled(
    members: Sequence[Strip],
    *,
    columns: int,
    rows: int = 1,
    deflection: float = _DEFLECTION,
    stretching: float = _STRETCHING,
) -> tuple[System, State]:
    """One member a strip, bent by `deflection` lengths and at rest, of in-plane stiffness
    `stretching` [N/m].

    The cells beside the clamp are held, which clamps the strip at their middle; the rigidity of a
    grid with alternating diagonals is a fifth of the table's (by hand, in the verification of the
    heavy elastica).
    """
    length = members[0].length
    cell = length / (columns - 0.5)
    mesh = grid(width=cell * columns, height=rows * cell, columns=columns, rows=rows)
    x = mesh.rest[:, 0] - cell / 2
    clamp = tuple(int(i) for i in np.flatnonzero(x < cell))
    scenes = []
    for index, strip in enumerate(members):
        material = isotropic(
            name=f"strip {index}",
            area_weight=strip.mass,
            stretching=stretching,
            shear=stretching,
            bending=5 * strip.rigidity,
            damping=strip.damping,
        )
        free = np.clip(x, 0, None)
        # Stretched by the friction, so that it does not bounce; the bend has no curvature at the
        # free end.
        along = x + strip.friction * strip.speed * (length * free - free**2 / 2) / stretching
        share = np.clip((x - cell / 2) / (length - cell / 2), 0, None)  # the clamp stays flat
        across = deflection * length * share**2 * (6 - 4 * share + share**2) / 3
        scenes.append(
            Scene(
                mesh=mesh,
                position=np.stack([along, across, mesh.rest[:, 1]], axis=1),
                material=material,
                handles=Handles(vertices=clamp, stiffness=math.inf),
                wind=(strip.speed, 0.0, 0.0),
                gravity=(0.0, 0.0, 0.0),
            )
        )

    def each(name: str) -> torch.Tensor:
        return torch.tensor([getattr(strip, name) for strip in members], dtype=torch.float64)

    effects: list[Effect] = [
        ReactiveLoading(mass=each("air_mass")),
        TangentialLinearDrag(coefficient=each("friction")),
    ]
    return apply(effects, *assemble(scenes, dtype=torch.float64))


def deflections(
    members: Sequence[Strip],
    *,
    columns: int,
    interval: float,
    samples: int,
    integrator: Integrator,
    rows: int = 1,
    deflection: float = _DEFLECTION,
    stretching: float = _STRETCHING,
) -> FloatArray:
    """(samples, vertex, member) out of the plane [m], every `interval` [s]."""
    system, state = assembled(
        members, columns=columns, rows=rows, deflection=deflection, stretching=stretching
    )
    frames = []
    for _ in range(samples):
        frames.append(state.position[:, 1].numpy().copy())
        state = integrator.advance(system, state, interval)
    return np.stack(frames)


def last_mode(frames: FloatArray, interval: float) -> complex:
    """The rate [1/s] of the largest of the exponentials that a motion consists of at its end.

    By dynamic mode decomposition (Schmid, J. Fluid Mech. 656:5, 2010) with one delay: the
    eigenvalues of the matrix that takes each pair of successive frames to the next, in the space of
    the leading singular vectors.

    Args:
        frames: (samples, vertex).
        interval: between frames [s].
    """
    pairs = np.concatenate([frames[:-1], frames[1:]], axis=1).T
    left, sizes, right = np.linalg.svd(pairs[:, :-1], full_matrices=False)
    rank = int((sizes > 1e-6 * sizes[0]).sum())
    left, sizes, right = left[:, :rank], sizes[:rank], right[:rank]
    values, vectors = np.linalg.eig(left.T @ pairs[:, 1:] @ right.T / sizes)
    shares = np.abs(np.linalg.solve(vectors, left.T @ pairs[:, -1]))
    rate = complex(np.log(complex(values[np.argmax(shares)])) / interval)
    return complex(rate.real, abs(rate.imag))


def growth(
    members: Sequence[Strip],
    *,
    columns: int,
    duration: float,
    rows: int = 1,
    integrator: Integrator | None = None,
) -> NDArray[np.complex128]:
    """(member,) rate s of what is left after `duration` [s], w ∝ exp(s t), Im s ≥ 0, from the
    second half of it."""
    interval = duration / _SAMPLES
    frames = deflections(
        members,
        columns=columns,
        rows=rows,
        interval=interval,
        samples=_SAMPLES,
        integrator=integrator or Symplectic(),
    )[_SAMPLES // 2 :]
    return np.array([last_mode(frames[..., index], interval) for index in range(len(members))])


def crossing(speeds: FloatArray, rates: NDArray[np.complex128]) -> Onset:
    """Where the growth passes zero, linear between the two speeds around it.

    Raises:
        ValueError: it does not pass zero once, upwards.
    """
    grown = rates.real > 0
    if grown[0] or not grown[-1] or (np.diff(grown.astype(int)) != 0).sum() != 1:
        raise ValueError(f"growth rates {rates.real} at {speeds} have no single onset")
    after = int(np.argmax(grown))
    share = rates.real[after - 1] / (rates.real[after - 1] - rates.real[after])
    return Onset(
        speed=float(speeds[after - 1] + share * (speeds[after] - speeds[after - 1])),
        frequency=float(
            rates.imag[after - 1] + share * (rates.imag[after] - rates.imag[after - 1])
        ),
    )


def sweep(strip: Strip, speeds: FloatArray) -> list[Strip]:
    """This strip in streams of these speeds."""
    return [replace(strip, speed=float(speed)) for speed in speeds]
