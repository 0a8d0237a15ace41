"""The sheet at large amplitude, in time: our simulator on a strip of the sheet, clamped along its
hoist.

A strip one cell high moves in its plane of bending alone, as the filmed sheets do. It goes through
scenes, effects and integrators as a user's cloth does; here is only its geometry, its start and
what is read off.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from sim.cloth.air import QuadraticNormal
from sim.cloth.handles import Handles
from sim.cloth.material import isotropic
from sim.cloth.mesh import grid
from sim.cloth.scene import Scene, assemble
from sim.effects import Effect, apply
from sim.integrate import Symplectic

_GRID_RIGIDITY = 5.0
"""A grid with alternating diagonals has a fifth of its table's rigidity (verified on the heavy
elastica)."""


@dataclass(frozen=True, kw_only=True)
class StripRun:
    """How the strip is simulated.

    Attributes:
        columns: cells along the sheet.
        stretching: in-plane stiffness [N/m]: stiff against the air's tension, soft enough for long
            steps.
        damping: internal, of the base model [s].
        settle: time before anything is kept [s].
        duration: time kept [s].
        rate: frames a second kept [Hz].
        push: deflection of the tip at the start, in lengths.
    """

    columns: int = 24
    stretching: float = 300.0
    damping: float = 2e-5
    settle: float = 1.0
    duration: float = 1.0
    rate: float = 500.0
    push: float = 0.05

    def __post_init__(self) -> None:
        if (
            self.columns < 4
            or min(self.stretching, self.duration, self.rate) <= 0
            or self.settle < 0
        ):
            raise InputError(
                f"{self} cannot be simulated",
                where="strip",
                fix="give positive values, 4 columns or more",
            )


@dataclass(frozen=True, kw_only=True)
class StripMotion:
    """What the strip did.

    Attributes:
        time: (frame,) [s].
        along, across: (frame, point, member) of the middle line from clamp to tip, in the stream's
            direction and across it [m]; NaN after a member's simulation has diverged.
        arc: (point,) distance from the clamp along the sheet [m].
    """

    time: FloatArray
    along: FloatArray
    across: FloatArray
    arc: FloatArray


def simulate(
    *,
    length: float,
    mass: float,
    rigidity: float,
    density: float,
    speeds: Sequence[float],
    effects: Sequence[Effect],
    run: StripRun,
) -> StripMotion:
    """One member a stream speed [m/s], with the base model's air of this density [kg/m³] and these
    effects.

    The cells beside the clamp are held, which clamps the strip at their middle.
    """
    cell = length / (run.columns - 0.5)
    mesh = grid(width=cell * run.columns, height=cell, columns=run.columns, rows=1)
    x = mesh.rest[:, 0] - cell / 2
    clamp = tuple(int(i) for i in np.flatnonzero(x < cell))
    share = np.clip((x - cell / 2) / (length - cell / 2), 0, None)
    across = run.push * length * share**2 * (6 - 4 * share + share**2) / 3
    material = isotropic(
        name="paper",
        area_weight=mass,
        stretching=run.stretching,
        shear=run.stretching,
        bending=_GRID_RIGIDITY * rigidity,
        damping=run.damping,
    )
    scenes = [
        Scene(
            mesh=mesh,
            position=np.stack([x, across, mesh.rest[:, 1]], axis=1),
            material=material,
            handles=Handles(vertices=clamp, stiffness=math.inf),
            wind=(float(speed), 0.0, 0.0),
            gravity=(0.0, 0.0, 0.0),
            air=QuadraticNormal(density=density),
        )
        for speed in speeds
    ]
    system, state = apply(effects, *assemble(scenes, dtype=torch.float64))
    integrator = Symplectic()
    order = np.argsort(mesh.rest[:, 0], kind="stable").reshape(
        -1, 2
    )  # the two vertices of each cross line
    interval = 1 / run.rate
    kept = round(run.duration * run.rate)
    skipped = round(run.settle * run.rate)
    frames = []
    with torch.no_grad():
        for index in range(skipped + kept):
            state = integrator.advance(system, state, interval)
            if index >= skipped:
                frames.append(state.position.numpy()[order].mean(axis=1))
    track = np.stack(frames)
    track[~np.isfinite(track)] = np.nan
    return StripMotion(
        time=np.asarray((np.arange(kept) + 1) * interval, dtype=np.float64),
        along=track[:, :, 0],
        across=track[:, :, 1],
        arc=np.unique(np.round(x, 12)),
    )


def as_columns(motion: StripMotion, member: int, columns: FloatArray) -> FloatArray:
    """The member's line as a camera sees it: heights at fixed distances from the clamp along the
    stream [m].

    Args:
        columns: (column,) [m].

    Returns:
        (frame, column) [m]; NaN beyond the tip, and in frames in which the line is folded over.
    """
    heights = np.full((len(motion.time), len(columns)), np.nan)
    for frame, (along, across) in enumerate(
        zip(motion.along[..., member], motion.across[..., member], strict=True)
    ):
        if (np.diff(along) > 0).all():
            heights[frame] = np.interp(columns, along, across, right=np.nan)
    return heights
