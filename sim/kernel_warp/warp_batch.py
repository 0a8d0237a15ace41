"""Hands a system's tensors to the Warp kernel, on whatever device they are."""

from __future__ import annotations

import importlib
import threading
import weakref
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import AnyArray, IntArray
from flagdata.errors import UsageError
from sim.cloth.cloth_batch import incidence
from sim.cloth.mesh import Mesh
from sim.cloth.stiffness_tables import Evaluation
from sim.cloth.system import Drive, System

FACES_LIMIT = 16_383
"""Most faces: two indices share a number, and one of them is four times a face."""
_WHERE = "backend warp"


def lacking(system: System) -> list[str]:
    """Lists, in words, what acts in a system that the Warp kernel does not have."""
    acting = {
        "effects": system.effects,
        "effects on the wind": system.flows,
        "added mass": system.loads,
        "ties beside the handles": system.ties,
        "forces that remember": system.remembering,
        "contact": system.contact is not None,
        "strain limits": system.limits is not None,
        "bending stiffness that differs along the cloth": system.cloth.stiffening is not None,
        f"the wind force {type(system.air).__name__}": system.air is not system.air.plain,
    }
    return [name for name, acts in acting.items() if acts]


@dataclass(frozen=True, kw_only=True)
class WarpKernel:
    """The kernel for one system.

    Attributes:
        code: the module `sim.kernel_warp.leapfrog`.
        sheet, members: its arguments of that name; the tensors they point to are `alive`.
    """

    code: ModuleType
    system: System
    sheet: Any
    members: Any
    alive: tuple[Tensor, ...]

    @classmethod
    def of(cls, system: System) -> WarpKernel:
        """Builds the kernel for a system.

        Raises:
            UsageError: warp-lang is not installed, or has no such device; numbers that are not
                float32; a mesh that is too large; a system with more than the base model, which is
                named.
        """
        with _LAUNCHING:
            if system not in _KERNELS:
                _KERNELS[system] = cls._build(system)
            return _KERNELS[system]

    @classmethod
    def _build(cls, system: System) -> WarpKernel:
        if unsupported := lacking(system):
            raise UsageError(
                f"the Warp kernel has only the base model, not {', '.join(unsupported)}",
                where=_WHERE,
                fix="leave them out, or use another backend",
            )
        cloth = system.cloth
        if cloth.dtype != torch.float32:
            raise UsageError(
                f"the numbers are of type {cloth.dtype}",
                where=_WHERE,
                fix="use float32, or another backend",
            )
        if len(cloth.faces) > FACES_LIMIT:
            raise UsageError(
                f"the mesh has {len(cloth.faces)} faces",
                where=_WHERE,
                fix=f"have at most {FACES_LIMIT}, or use another backend",
            )
        code = _code(cloth.device)
        where = code.wp.device_from_torch(cloth.device)
        if where.is_cuda:
            _check_room(cloth.mesh, where.max_shared_memory_per_block)
        alive: list[Tensor] = []

        def array(values: AnyArray | Tensor, dtype: Any = None) -> Any:
            tensor = torch.as_tensor(values).to(cloth.device).contiguous()
            alive.append(tensor)
            return code.wp.from_torch(tensor, dtype=dtype)

        sheet = code.Sheet()
        for name, values in _sheet(cloth.mesh, system.held).items():
            setattr(sheet, name, array(values.astype(np.uint32).view(np.int32)))
        sheet.gradient = array(cloth.gradients[:, :, 1:].permute(2, 1, 0).flatten())
        sheet.area = array(cloth.areas)
        sheet.column, sheet.shape = array(cloth.hinge_column), array(cloth.hinge_shape)
        sheet.row = array(cloth.hinge_rows[:, 1] + 2 * cloth.hinge_rows[:, 2])
        members = code.Members()
        members.samples = array(cloth.samples.flatten().view(torch.int64))
        members.table = array(cloth.table_of.int())
        members.counts = code.wp.vec3i(*cloth.grid.counts)
        members.origin, members.fineness = cloth.grid.origin, 1 / cloth.grid.spacing
        bending = np.stack([material.bending for material in cloth.materials], axis=-1)
        members.bending = array(torch.tensor(bending, dtype=torch.float32).reshape(15, -1))
        members.symmetric = int(cloth.evaluation is Evaluation.CORRECTED)
        members.damping = array(cloth.damping)
        inverse = 1 / cloth.mass
        members.inverse_mass = array(
            inverse.index_fill(0, system.held, 0.0) if system.is_clamped else inverse
        )
        members.gravity = array(system.gravity)
        members.density, members.drag = system.air.plain.density, system.air.plain.drag
        members.stiffness = system.handles.stiffness if system.sprung else 0.0
        return cls(code=code, system=system, sheet=sheet, members=members, alive=tuple(alive))

    def advance(
        self, drive: Drive, x: Tensor, v: Tensor, h: float, steps: int
    ) -> tuple[Tensor, Tensor]:
        """Takes leapfrog steps: positions and velocities (vertex, 3, batch) after `steps` steps of
        `h` [s]."""
        wp, mesh = self.code.wp, self.system.cloth.mesh
        tensors = [torch.stack(drive.wind), torch.stack(drive.targets), drive.rate.contiguous()]
        after = (
            x.clone(memory_format=torch.contiguous_format),
            v.clone(memory_format=torch.contiguous_format),
        )
        motion = self.code.Motion()
        motion.wind, motion.targets, motion.rate = (wp.from_torch(tensor) for tensor in tensors)
        where = wp.device_from_torch(x.device)
        with _LAUNCHING:
            kernel = self.code.kernel(mesh.vertex_count, len(mesh.faces), len(mesh.hinges))
            wp.launch_tiled(
                kernel,
                dim=[self.system.cloth.batch],
                block_dim=self.code.THREADS,
                device=where,
                inputs=[
                    self.sheet,
                    self.members,
                    motion,
                    *(wp.from_torch(tensor) for tensor in after),
                    h,
                    steps,
                ],
                stream=wp.stream_from_torch(torch.cuda.current_stream(x.device))
                if where.is_cuda
                else None,
            )
        return after


_LAUNCHING = threading.Lock()  # Warp is started, compiles and launches in one thread at a time
_KERNELS: weakref.WeakKeyDictionary[System, WarpKernel] = weakref.WeakKeyDictionary()


def _code(device: torch.device) -> ModuleType:
    """Imports the kernel's module.

    Raises:
        UsageError: warp-lang is not installed, or does not know the device.
    """
    try:
        code = importlib.import_module("sim.kernel_warp.leapfrog")
    except ModuleNotFoundError as error:
        if error.name != "warp":
            raise
        raise UsageError(
            "warp-lang is not installed",
            where=_WHERE,
            fix="pip install 'flagdata[gpu]', or use another backend",
        ) from None
    devices = [str(device) for device in code.wp.get_devices()]
    name = "cpu" if device.type == "cpu" else f"{device.type}:{device.index or 0}"
    if name not in devices:
        raise UsageError(
            f"Warp has no device {name!r}, only {', '.join(devices)}",
            where=_WHERE,
            fix="install the driver of the graphics processor, or use one of these",
        )
    return code


def _check_room(mesh: Mesh, room: int) -> None:
    """Checks that a flag's state fits the shared memory of a thread block [bytes].

    Raises:
        UsageError: it does not.
    """
    taken = (
        28 * mesh.vertex_count + 36 * len(mesh.faces) + 4 * len(mesh.hinges) + 64
    )  # see the tiles of the kernel
    if taken > room:
        raise UsageError(
            f"a mesh of {mesh.vertex_count} vertices takes {taken} bytes of shared memory, of "
            f"which there are {room}",
            where=_WHERE,
            fix="take a coarser mesh, or another backend",
        )


def _sheet(mesh: Mesh, held: Tensor) -> dict[str, IntArray]:
    """Computes the index arrays of `leapfrog.Sheet`."""
    faces, hinges = mesh.faces, mesh.hinges
    place_of = {  # directed edge → face and the corner opposite
        (int(face[(c + 1) % 3]), int(face[(c + 2) % 3])): (e, c)
        for e, face in enumerate(faces)
        for c in range(3)
    }
    left = np.array([place_of[int(i), int(j)] for i, j, *_ in hinges], dtype=np.int64).reshape(
        -1, 2
    )
    right = np.array([place_of[int(j), int(i)] for i, j, *_ in hinges], dtype=np.int64).reshape(
        -1, 2
    )
    edge = np.full(faces.shape, len(hinges))
    edge[tuple(left.T)] = edge[tuple(right.T)] = np.arange(len(hinges))
    around = incidence(faces, mesh.vertex_count)
    hold = np.zeros(mesh.vertex_count, dtype=np.int64)
    hold[held.cpu().numpy()] = 1 + np.arange(len(held))

    def pair(lower: IntArray, upper: IntArray) -> IntArray:
        return lower | upper << 16

    (a, b, c), (ea, eb, ec) = faces.T, edge.T
    return {
        "corner": np.concatenate([pair(a, b), pair(c, ea), pair(eb, ec)]),
        "end": pair(hinges[:, 0], hinges[:, 1]),
        "side": pair(4 * left[:, 0] + left[:, 1], 4 * right[:, 0] + right[:, 1]),
        "around": around.ravel(),
        "vertex": pair((around < faces.size).sum(0), hold),
    }
