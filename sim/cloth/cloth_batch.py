"""A batch of cloths on one mesh as tensors: everything the forces need that does not change during
a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import InputError, UsageError
from sim.cloth import on_mesh
from sim.cloth.material import Material
from sim.cloth.mesh import Mesh
from sim.cloth.stiffness_tables import (
    GRIDS,
    Evaluation,
    StrainGrid,
    bending_segments,
    direction_rows,
    sample_stretching,
)

_COLUMN = 0.2  # 1 / tables.CURVATURE_SPACING
_OF_MEMBERS = ("mass", "table_of", "segments", "damping")
"""Fields whose last axis is the batch."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Cloth:
    """Constants of a batch, which is the last axis of every tensor that has one. Every member has
    its own material on the shared mesh.

    Attributes:
        mesh: the rest state.
        materials: one for each member.
        evaluation: how the tables are read.
        faces: (face, 3) indices.
        gradients: (face, 2, 3) shape derivatives [1/m].
        areas: (face,) rest areas [m²].
        hinges: (hinge, 4) indices, see `Mesh.hinges`.
        hinge_shape: (hinge,) S = l²/(2(a0 + a1)).
        hinge_column: (hinge,) fold angle → curvature in table columns, 0.1 l/(a0 + a1) [1/rad].
        hinge_rows: (hinge, 3) weights of the bending rows.
        mass: (vertex, batch) lumped [kg].
        samples: (table, n00, n11, n01, 4) stretching stiffness [N/m].
        table_of: (batch,) table of each member.
        grid: the strains at which samples are taken.
        segments: (3, 5, batch) bending [N·m].
        damping: (batch,) d [s].
        face_slots: (k, vertex) rows of the stacked corner forces (3·face, …) to sum at each vertex,
            padded with 3·face.
        hinge_slots: the same for (4·hinge, …), padded with 4·hinge.
        stiffening: (hinge, batch) bending stiffness on top, as a share of the table's; None where
            there is none.
    """

    mesh: Mesh
    materials: tuple[Material, ...]
    evaluation: Evaluation
    faces: Tensor
    gradients: Tensor
    areas: Tensor
    hinges: Tensor
    hinge_shape: Tensor
    hinge_column: Tensor
    hinge_rows: Tensor
    mass: Tensor
    samples: Tensor
    table_of: Tensor
    grid: StrainGrid
    segments: Tensor
    damping: Tensor
    face_slots: Tensor
    hinge_slots: Tensor
    stiffening: Tensor | None = None

    @classmethod
    def build(
        cls,
        mesh: Mesh,
        materials: Sequence[Material],
        *,
        evaluation: Evaluation = Evaluation.ARCSIM,
        dtype: torch.dtype = torch.float32,
        device: torch.device | str = "cpu",
    ) -> Cloth:
        """Builds a batch with one member for each material.

        Raises:
            InputError: no materials.
        """
        if not materials:
            raise InputError(
                "the batch has no members", where="cloth", fix="give one material for each member"
            )

        def real(values: FloatArray) -> Tensor:
            return torch.tensor(values, dtype=dtype, device=device)

        def index(values: IntArray) -> Tensor:
            return torch.tensor(values, dtype=torch.int64, device=device)

        tables: dict[bytes, int] = {}
        table_of = [tables.setdefault(m.stretching.tobytes(), len(tables)) for m in materials]
        samples = [
            sample_stretching(np.frombuffer(key).reshape(6, 4), evaluation) for key in tables
        ]
        area_weight = np.array([m.area_weight for m in materials])
        lengths, hinge_areas = mesh.hinge_lengths, mesh.hinge_areas
        return cls(
            mesh=mesh,
            materials=tuple(materials),
            evaluation=evaluation,
            faces=index(mesh.faces),
            gradients=real(mesh.gradients),
            areas=real(mesh.areas),
            hinges=index(mesh.hinges),
            hinge_shape=real(lengths**2 / (2 * hinge_areas)),
            hinge_column=real(0.5 * _COLUMN * lengths / hinge_areas),
            hinge_rows=real(direction_rows(mesh.hinge_directions)),
            mass=real(mesh.vertex_areas[:, None] * area_weight),
            samples=real(np.stack(samples)),
            table_of=index(np.array(table_of)),
            grid=GRIDS[evaluation],
            segments=real(bending_segments(materials)),
            damping=real(np.array([m.damping for m in materials])),
            face_slots=index(incidence(mesh.faces, mesh.vertex_count)),
            hinge_slots=index(incidence(mesh.hinges, mesh.vertex_count)),
        )

    @classmethod
    def joined(cls, parts: Sequence[Cloth]) -> Cloth:
        """Joins the members of batches on one mesh, in order.

        Raises:
            UsageError: batches that differ in more than mass, bending and damping.
        """
        first = parts[0]
        shared = {f.name for f in fields(cls)} - {
            "mesh",
            "evaluation",
            "grid",
            "materials",
            "stiffening",
            *_OF_MEMBERS,
        }
        for part in parts:
            if part.mesh is not first.mesh or any(
                not torch.equal(getattr(part, f), getattr(first, f)) for f in shared
            ):
                raise UsageError(
                    "the batches differ in mesh or stretching",
                    where="cloth",
                    fix="simulate them one by one",
                )
        stiffening = None
        if any(part.stiffening is not None for part in parts):
            bare = [part.mass.new_zeros(len(part.hinges), part.batch) for part in parts]
            stiffening = torch.cat(
                [
                    z if p.stiffening is None else p.stiffening
                    for p, z in zip(parts, bare, strict=True)
                ],
                -1,
            )
        return replace(
            first,
            materials=tuple(m for part in parts for m in part.materials),
            stiffening=stiffening,
            **{
                name: torch.cat([getattr(part, name) for part in parts], dim=-1)
                for name in _OF_MEMBERS
            },
        )

    def at_corners(self, field: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Selects a vertex field (vertex, …) at the three corners of the faces: (face, …) each."""
        first, second, third = field.index_select(0, self._corner).unflatten(
            0, (3, len(self.faces))
        )
        return first, second, third

    def shared_out(self, share: Tensor) -> Tensor:
        """Sums, at each vertex, the shares (face, 3, batch) that faces give to each of their
        corners: (vertex, 3, batch)."""
        return gather_sum([share], self._around)

    @cached_property
    def _corner(self) -> Tensor:
        """(3·face,) vertices, of the first corners first."""
        return self.faces.T.reshape(-1)

    @cached_property
    def _around(self) -> Tensor:
        """(k, vertex) faces around each vertex in the order of `face_slots`, padded with their
        number."""
        count = len(self.faces)
        return torch.where(self.face_slots == 3 * count, count, self.face_slots % count)

    @property
    def batch(self) -> int:
        return len(self.materials)

    @property
    def dtype(self) -> torch.dtype:
        return self.mass.dtype

    @property
    def device(self) -> torch.device:
        return self.mass.device


def incidence(elements: IntArray, vertex_count: int) -> IntArray:
    """Lists which corners of which elements meet at each vertex.

    Args:
        elements: (element, corner) vertex indices.

    Returns:
        (k, vertex) indices `corner * len(elements) + element` in ascending order, padded with
            `elements.size`.
    """
    vertex = elements.T.ravel()
    order = np.argsort(vertex, kind="stable")
    counts = np.bincount(vertex, minlength=vertex_count)
    slots = np.full(
        (vertex_count, max(int(counts.max(initial=0)), 1)), elements.size, dtype=np.int64
    )
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    rank = np.arange(len(vertex)) - np.repeat(starts, counts)
    slots[vertex[order], rank] = order
    return np.ascontiguousarray(slots.T)


def gather_sum(corners: Sequence[Tensor], slots: Tensor) -> Tensor:
    """Sums corner contributions at the vertices, in a fixed order: no atomics, so the same bits
    every time.

    Args:
        corners: one (element, 3, batch) tensor for each corner.
        slots: (k, vertex) from `incidence`.

    Returns:
        (vertex, 3, batch).
    """
    if on_mesh.usable(*corners):
        return on_mesh.gather_sum(corners, slots)
    stacked = torch.cat([*corners, torch.zeros_like(corners[0][:1])])
    first, *remaining = stacked.index_select(0, slots.reshape(-1)).unflatten(0, tuple(slots.shape))
    total = first.clone()
    for contribution in remaining:
        total += contribution
    return total
