"""Scenes: typed descriptions of one piece of cloth in the wind, and what they say about the batch
they form."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError, UsageError
from sim.cloth import handles as held
from sim.cloth.air import AirForce, QuadraticNormal
from sim.cloth.cloth_batch import Cloth
from sim.cloth.contact import Contact
from sim.cloth.handles import Handles
from sim.cloth.limits import StrainLimits
from sim.cloth.material import Material
from sim.cloth.mesh import Mesh, grid
from sim.cloth.sizing import Remeshing
from sim.cloth.state import State
from sim.cloth.stiffness_tables import Evaluation
from sim.cloth.system import System
from sim.wind.uniform import UniformWind

GRAVITY = (0.0, 0.0, -9.81)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """One cloth, held somewhere, in a wind.

    Attributes:
        mesh: its rest state.
        position: (vertex, 3) where it starts [m].
        material: what it is made of.
        handles: where it is held.
        wind: (3,) velocity of the air [m/s]: where it goes to.
        gravity: (3,) [m/s²].
        air: the wind's force.
        evaluation: how the material's tables are read.
        contact: how layers keep apart; None lets them pass through each other.
        limits: of strain; None lets faces stretch as their stiffness allows.
        remeshing: how finely the cloth is divided after each frame; None keeps the mesh.

    Raises:
        InputError: a shape that does not fit, a value that is not finite, a held vertex that is not
            there, or a connected piece of cloth that nothing holds.
    """

    mesh: Mesh
    position: FloatArray
    material: Material
    handles: Handles
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gravity: tuple[float, float, float] = GRAVITY
    air: AirForce = field(default_factory=QuadraticNormal)
    evaluation: Evaluation = Evaluation.ARCSIM
    contact: Contact | None = None
    limits: StrainLimits | None = None
    remeshing: Remeshing | None = None

    def __post_init__(self) -> None:
        position = np.array(self.position, dtype=np.float64)
        if position.shape != (self.mesh.vertex_count, 3):
            raise InputError(
                f"positions have shape {position.shape}",
                where="scene",
                fix=f"give ({self.mesh.vertex_count}, 3) in metres",
            )
        if not np.isfinite(position).all():
            raise InputError(
                "a start position is not finite", where="scene", fix="give finite metres"
            )
        position.setflags(write=False)
        object.__setattr__(self, "position", position)
        for name, vector in (("wind", self.wind), ("gravity", self.gravity)):
            if len(vector) != 3 or not all(math.isfinite(value) for value in vector):
                raise InputError(
                    f"{name} {vector!r} is not three finite numbers",
                    where="scene",
                    fix="give (x, y, z)",
                )
        outside = [v for v in self.handles.vertices if v >= self.mesh.vertex_count]
        if outside:
            raise InputError(
                f"the held vertex {outside[0]} is not one of the mesh's {self.mesh.vertex_count}",
                where="handles",
                fix="correct the index",
            )
        pieces = self.mesh.components()
        loose = set(pieces.tolist()) - set(pieces[list(self.handles.vertices)].tolist())
        if loose:
            vertex = int(np.flatnonzero(pieces == min(loose))[0])
            raise InputError(
                f"{len(loose)} connected piece(s) of the cloth are not held anywhere",
                where=f"piece with vertex {vertex}",
                fix="add a handle, or drop the piece",
            )


def upright(mesh: Mesh) -> FloatArray:
    """Places the mesh in the y–z plane, u along y and v along z: across a wind in +x, as the
    reference scenes start.

    Returns:
        (vertex, 3) [m].
    """
    zero = np.zeros(mesh.vertex_count)
    return np.stack([zero, mesh.rest[:, 0], mesh.rest[:, 1]], axis=1)


def roughen_start(
    flat: FloatArray, handles: Handles, rng: np.random.Generator, sigma: float
) -> FloatArray:
    """Returns a start (vertex, 3) [m]: a flat one, with normal noise of deviation `sigma` [m] on
    what nothing holds."""
    noise = rng.normal(0.0, sigma, flat.shape)
    noise[list(handles.vertices)] = 0.0
    return flat + noise


def flag(
    *,
    material: Material,
    wind_speed: float,
    width: float = 1.5,
    height: float = 1.0,
    columns: int = 30,
    evaluation: Evaluation = Evaluation.ARCSIM,
) -> Scene:
    """Makes a flag held at its two hoist corners, in a wind along +x [m/s]; rows follow from the
    aspect ratio.

    Raises:
        InputError: see `Scene` and `sim.cloth.mesh.grid`.
    """
    mesh = grid(
        width=width, height=height, columns=columns, rows=max(1, round(columns * height / width))
    )
    return Scene(
        mesh=mesh,
        position=upright(mesh),
        material=material,
        handles=Handles(vertices=held.corners(mesh.rest)),
        wind=(wind_speed, 0.0, 0.0),
        evaluation=evaluation,
    )


def hanging_cloth(
    *,
    material: Material,
    wind: tuple[float, float],
    side: float = 1.0,
    columns: int = 20,
    evaluation: Evaluation = Evaluation.ARCSIM,
) -> Scene:
    """Makes a square cloth held at its two top corners, in a horizontal wind (x, y) [m/s].

    Raises:
        InputError: see `Scene` and `sim.cloth.mesh.grid`.
    """
    mesh = grid(width=side, height=side, columns=columns, rows=columns)
    return Scene(
        mesh=mesh,
        position=upright(mesh),
        material=material,
        handles=Handles(vertices=held.top_corners(mesh.rest)),
        wind=(*wind, 0.0),
        evaluation=evaluation,
    )


def assemble(
    scenes: Sequence[Scene],
    *,
    dtype: torch.dtype = torch.float32,
    device: torch.device | str = "cpu",
) -> tuple[System, State]:
    """Assembles the batch of these scenes, and their start at rest. Members differ in start,
    material, wind and gravity.

    Raises:
        UsageError: no scenes, or scenes with different meshes, handles, wind forces, evaluations,
            contacts, limits or remeshing.
    """
    if not scenes:
        raise UsageError("there are no scenes to simulate", fix="give at least one")
    first = scenes[0]
    for index, scene in enumerate(scenes):
        same = scene.mesh is first.mesh or (
            np.array_equal(scene.mesh.rest, first.mesh.rest)
            and np.array_equal(scene.mesh.faces, first.mesh.faces)
        )
        shared = ("handles", "air", "evaluation", "contact", "limits", "remeshing")
        if not same or any(getattr(scene, name) != getattr(first, name) for name in shared):
            raise UsageError(
                f"scene {index} differs from scene 0 in mesh or one of: {', '.join(shared)}",
                where="batch",
                fix="simulate such scenes in batches of their own",
            )

    def real(values: FloatArray) -> torch.Tensor:
        return torch.tensor(values, dtype=dtype, device=device)

    cloth = Cloth.build(
        first.mesh,
        [s.material for s in scenes],
        evaluation=first.evaluation,
        dtype=dtype,
        device=device,
    )
    position = real(np.stack([s.position for s in scenes], axis=-1))
    vertices = list(first.handles.vertices)
    system = System(
        cloth=cloth,
        gravity=real(np.array([s.gravity for s in scenes]).T),
        wind=UniformWind(constant=real(np.array([s.wind for s in scenes]).T)),
        air=first.air,
        handles=first.handles,
        held=torch.tensor(vertices, dtype=torch.int64, device=device),
        anchors=position[vertices].clone(),
        contact=first.contact,
        limits=first.limits,
        remeshing=first.remeshing,
    )
    return system, State(position=position, velocity=torch.zeros_like(position))
