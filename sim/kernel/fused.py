"""Hands a system's tensors to the compiled kernel, in blocks of as many members as fit a vector
register."""

from __future__ import annotations

import ctypes
import math
import weakref
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray, IntArray
from sim.cloth.cloth_batch import Cloth
from sim.cloth.contact import Contact, layers
from sim.cloth.limits import chebyshev_weights
from sim.cloth.stiffness_tables import Evaluation
from sim.cloth.system import Drive, System
from sim.compiler import library
from sim.kernel.acting import Acting, ActingEntry, acting

_POINTERS = (
    "face",
    "gradients",
    "areas",
    "hinge",
    "hinge_shape",
    "hinge_column",
    "hinge_rows",
    "held_vertex",
    "tie_vertex",
    "samples",
)
_SCALARS = ("origin", "spacing", "air_density", "air_drag", "stiffness")
_BLOCKED = (
    "mass",
    "inverse_mass",
    "added_mass",
    "segments",
    "stiffening",
    "damping",
    "table",
    "gravity",
    "tie_share",
    "tie_stiffness",
    "tie_slack",
    "wind",
    "targets",
    "rate",
    "tie_targets",
    "tie_rate",
)

_FEW = 8
"""Members that fit a narrow block: half of a wide one, with 0.6 (backward Euler) to 0.9 (leapfrog)
of its time."""

_CONTACT_POINTERS = ("face", "vertex_area", "centre", "apart", "group", "group_rest", "block")
_CONTACT_SCALARS = ("thickness", "stiffness", "friction")


class _Contact(ctypes.Structure):
    """Mirrors `contact::Settings` of contact.hpp."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("vertices", "faces", "groups", "blocks")),
        *((name, ctypes.c_void_p) for name in _CONTACT_POINTERS),
        *((name, ctypes.c_double) for name in _CONTACT_SCALARS),
    ]


class _Ends(ctypes.Structure):
    """Mirrors `Ends` of effect.hpp field by field."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("count", "width")),
        *((name, ctypes.c_void_p) for name in ("vertex", "within", "weight")),
    ]


class _Problem(ctypes.Structure):
    """Mirrors `Problem` of problem.hpp field by field."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("vertices", "faces", "hinges", "held", "ties")),
        ("counts", ctypes.c_int64 * 3),
        ("fold", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in _POINTERS),
        *((name, ctypes.c_double) for name in _SCALARS),
        ("batch", ctypes.c_int64),
        ("contact", _Contact),
        ("lowest", ctypes.c_double),
        ("highest", ctypes.c_double),
        ("sweeps", ctypes.c_int64),
        ("sweep_weights", ctypes.c_void_p),
        ("arms", ctypes.c_void_p),
        ("vertex_areas", ctypes.c_void_p),
        ("ends", _Ends),
        *((name, ctypes.c_void_p) for name in _BLOCKED),
        ("effects", ctypes.c_int64),
        ("effect", ctypes.POINTER(ActingEntry)),
    ]


class _Part(ctypes.Structure):
    """Mirrors `Part` of split.hpp field by field."""

    _fields_ = [
        ("problem", ctypes.POINTER(_Problem)),
        *((name, ctypes.c_int64) for name in ("blocks", "first", "count")),
    ]


class _Lists:
    """What the kernel's contact remembers from call to call of what is near: it saves time and
    changes no result.

    Attributes:
        place: in memory.
    """

    def __init__(self, code: ctypes.CDLL, kind: str, blocks: int) -> None:
        make, drop = _function(code, "lists", kind), _function(code, "drop", kind)
        make.restype, drop.restype = ctypes.c_void_p, None
        self.place = ctypes.c_void_p(make(ctypes.c_int64(blocks)))
        weakref.finalize(self, drop, self.place)


@dataclass(frozen=True, kw_only=True)
class Kernel:
    """The kernel for one system. One call at a time.

    Attributes:
        batch: members.
        kind: of the functions: numbers and lanes.
        lanes: members of a block.
        blocks: how many blocks the batch takes; spare lanes of the last repeat its last member.
        tensors: what the kernel reads, kept alive here.
        tied: (tie, 3, batch) anchors of the springs beside the handles [m].
        lists: the contact's candidates.
        beside: what acts beside the base model; None where the kernel does not have all of it.
    """

    code: ctypes.CDLL
    batch: int
    kind: str
    lanes: int
    blocks: int
    problem: _Problem
    tensors: dict[str, Tensor] = field(repr=False)
    tied: Tensor | None = field(repr=False)
    lists: _Lists = field(repr=False)
    beside: Acting | None

    @classmethod
    def of(cls, system: System, *, kind: str | None = None) -> Kernel | None:
        """Builds the kernel for a system, or for its base where effects have no C++ (see `beside`);
        None where there is
        none: not a CPU, not float32 or 64, or it cannot be built.

        Args:
            kind: of the functions, as that of another kernel which it is run beside; None for what
                its batch needs.
        """
        cloth = system.cloth
        if cloth.device.type != "cpu" or cloth.dtype not in (torch.float32, torch.float64):
            return None
        kind = kind or _kind(system)
        by_kind = _KERNELS.setdefault(system, {})
        if kind not in by_kind:
            code = library()
            if code is None:
                return None
            by_kind[kind] = cls._build(system, code, kind)
        return by_kind[kind]

    @classmethod
    def _build(cls, system: System, code: ctypes.CDLL, kind: str) -> Kernel:
        cloth = system.cloth
        lanes = int(_function(code, "lanes", kind)())
        blocks = math.ceil(cloth.batch / lanes)
        inverse_mass = 1 / cloth.mass
        if system.is_clamped:
            inverse_mass = inverse_mass.index_fill(0, system.held, 0.0)
        air = system.air.plain
        empty = cloth.mass[:0]
        ties = [tie.springs(cloth) for tie in system.ties]

        def of_ties(parts: list[Tensor]) -> Tensor:
            return torch.cat(parts) if parts else empty

        def block(tensor: Tensor) -> Tensor:
            return _to_blocks(tensor, lanes, blocks)

        tensors = {
            "face": cloth.faces.int(),
            "gradients": cloth.gradients,
            "areas": cloth.areas,
            "hinge": cloth.hinges.int(),
            "hinge_shape": cloth.hinge_shape,
            "hinge_column": cloth.hinge_column,
            "hinge_rows": cloth.hinge_rows,
            "held_vertex": system.held.int(),
            "samples": cloth.samples,
            "arms": torch.tensor(cloth.mesh.arms, dtype=cloth.dtype),
            "vertex_areas": torch.tensor(cloth.mesh.vertex_areas, dtype=cloth.dtype),
            "mass": block(cloth.mass),
            "inverse_mass": block(inverse_mass),
            "segments": block(cloth.segments),
            "stiffening": block(empty if cloth.stiffening is None else cloth.stiffening),
            "added_mass": block(system.added_mass if system.loads else empty),
            "tie_vertex": torch.cat([t.vertices for t in ties]).int() if ties else empty,
            "tie_share": block(of_ties([torch.full_like(t.stiffness, t.share) for t in ties])),
            "tie_stiffness": block(of_ties([t.stiffness for t in ties])),
            "tie_slack": block(of_ties([t.slack for t in ties])),
            "damping": block(cloth.damping),
            "table": block(cloth.table_of.int()),
            "gravity": block(system.gravity),
        }
        tensors = {name: tensor.contiguous() for name, tensor in tensors.items()}
        problem = _Problem(
            vertices=cloth.mesh.vertex_count,
            faces=len(cloth.faces),
            hinges=len(cloth.hinges),
            held=len(system.held),
            ties=len(tensors["tie_vertex"]),
            fold=int(cloth.evaluation is Evaluation.CORRECTED),
            origin=cloth.grid.origin,
            spacing=cloth.grid.spacing,
            air_density=air.density,
            air_drag=air.drag,
            stiffness=system.handles.stiffness if system.sprung else 0.0,
        )
        problem.batch = cloth.batch
        problem.counts[:] = cloth.grid.counts
        for name, tensor in tensors.items():
            setattr(problem, name, tensor.data_ptr() if tensor.numel() else None)
        tensors |= _set_ends(problem.ends, cloth)
        if system.contact is not None:
            tensors |= _set_contact(problem.contact, system, system.contact, tensors["face"], lanes)
        if system.limits is not None:
            problem.lowest, problem.highest = system.limits.low, system.limits.high
            problem.sweeps = system.limits.sweeps
            tensors["sweep_weights"] = torch.tensor(
                chebyshev_weights(system.limits.sweeps), dtype=cloth.dtype
            )
            problem.sweep_weights = tensors["sweep_weights"].data_ptr()
        return cls(
            code=code,
            batch=cloth.batch,
            kind=kind,
            lanes=lanes,
            blocks=blocks,
            problem=problem,
            tensors=tensors,
            tied=torch.cat([t.anchors for t in ties]) if ties else None,
            lists=_Lists(code, kind, blocks),
            beside=acting(system, kind, lambda tensor: block(tensor).contiguous()),
        )

    def _drive(self, drive: Drive) -> tuple[_Problem, list[Tensor]]:
        """Sets wind and handles of the problem; the tensors must outlive the call it is made
        for."""
        tensors = {
            "wind": self._stack_parts(drive.wind),
            "targets": self._stack_parts(drive.targets),
            "rate": self.pack(drive.rate),
        }
        if self.tied is not None:
            start, end = drive.offset
            tensors["tie_targets"] = self._stack_parts(
                (self.tied + start[:, None], self.tied + end[:, None])
            )
            tensors["tie_rate"] = self.pack(drive.drift[:, None].expand(3, self.batch))
        return self._problem_with(**tensors)

    def _tie_targets(self, offsets: Sequence[Tensor]) -> dict[str, Tensor]:
        """Locates the ties' anchors at displacements (3,) [m]; nothing where there are no ties."""
        if self.tied is None:
            return {}
        return {
            "tie_targets": self._stack_parts([self.tied + offset[:, None] for offset in offsets])
        }

    def _problem_with(self, **tensors: Tensor) -> tuple[_Problem, list[Tensor]]:
        """Sets some tensors of the problem, which must outlive the call it is made for."""
        problem = _Problem.from_buffer_copy(self.problem)
        for name, tensor in tensors.items():
            setattr(problem, name, tensor.data_ptr())
        return problem, list(tensors.values())

    def _stack_parts(self, parts: Sequence[Tensor]) -> Tensor:
        """Stacks (…, batch) at several times to (time, block, …, lane)."""
        return (
            _to_blocks(torch.stack(tuple(parts)), self.lanes, self.blocks)
            .movedim(1, 0)
            .contiguous()
        )

    def pack(self, tensor: Tensor) -> Tensor:
        """Packs (…, batch) to (block, …, lane), contiguous and not shared with the argument."""
        return _to_blocks(tensor, self.lanes, self.blocks).clone(
            memory_format=torch.contiguous_format
        )

    def unpack(self, blocks: Tensor) -> Tensor:
        """Unpacks (block, …, lane) to (…, batch)."""
        return blocks.movedim(0, -2).flatten(-2)[..., : self.batch].contiguous()

    def advance(
        self,
        drive: Drive,
        x: Tensor,
        v: Tensor,
        h: float,
        steps: int,
        *,
        memory: Sequence[Tensor] = (),
    ) -> tuple[Tensor, Tensor, tuple[Tensor, ...]]:
        """Takes leapfrog steps: positions and velocities (vertex, 3, batch) after `steps` steps of
        `h` [s], and what forces remember. Where `beside` is None it is that of the base model."""
        problem, alive = self._drive(drive)
        past = self._remember(problem, memory)
        xb, vb = self.pack(x), self.pack(v)
        scratch = torch.empty_like(xb[0])
        self._call(
            "advance",
            problem,
            self.lists.place,
            xb,
            vb,
            scratch,
            ctypes.c_double(h),
            ctypes.c_int64(steps),
        )
        del alive
        return self.unpack(xb), self.unpack(vb), tuple(map(self.unpack, past))

    def _remember(self, problem: _Problem, memory: Sequence[Tensor]) -> list[Tensor]:
        """Sets what acts beside the base model; returned is what forces remember, which a call
        changes."""
        past = [self.pack(tensor) for tensor in memory]
        if self.beside is not None:
            problem.effects, problem.effect = (
                len(self.beside.entries),
                self.beside.with_memory(past),
            )
        return past

    def forces(self, drive: Drive, share: float, x: Tensor, v: Tensor) -> Tensor:
        """Computes the base's forces (vertex, 3, batch) [N]: what `System.extra_force` leaves."""
        problem, alive = self._drive(drive)
        xb, vb = self.pack(x), self.pack(v)
        out = torch.empty_like(xb)
        self._call("forces", problem, self.lists.place, xb, vb, out, ctypes.c_double(share))
        del alive
        return self.unpack(out)

    def extra(
        self,
        drive: Drive,
        share: float,
        x: Tensor,
        v: Tensor,
        level: Tensor,
        *,
        memory: Sequence[Tensor] = (),
    ) -> Tensor:
        """Computes what `System.extra_force` does, where `beside` is not None: (vertex, 3, batch)
        [N].

        Args:
            level: the velocity that effects see (vertex, 3, batch) [m/s].
        """
        problem, alive = self._problem_with(wind=self._stack_parts(drive.wind))
        past = self._remember(problem, memory)
        xb, vb, lb = self.pack(x), self.pack(v), self.pack(level)
        out = torch.empty_like(xb)
        self._call("extra", problem, xb, vb, lb, out, ctypes.c_double(share))
        del alive, past
        return self.unpack(out)

    def implicit(
        self,
        winds: Sequence[Tensor],
        targets: Sequence[Tensor],
        x: Tensor,
        v: Tensor,
        h: float,
        *,
        lag: float,
        tolerance: float,
        iterations: int,
        offsets: Sequence[Tensor] = (),
        memory: Sequence[Tensor] = (),
    ) -> tuple[Tensor, Tensor]:
        """Takes backward Euler steps of `h` [s] without contact and limits: positions and
        velocities (vertex, 3, batch).

        Args:
            winds: (3, batch) at the start of each step [m/s].
            targets: (held, 3, batch) of the handles at the end of each [m].
            offsets: (3,) displacement of the ties' anchors at the start of each [m]; none where
                there are no ties.
            memory: of the forces that remember, which is that of all steps.
            lag: the air sees the shape x − lag v [s].

        Returns:
            NaN for members whose solve did not converge.
        """
        problem, alive = self._problem_with(
            wind=self._stack_parts(winds),
            targets=self._stack_parts(targets),
            **self._tie_targets(offsets),
        )
        past = self._remember(problem, memory)
        xb, vb = self.pack(x), self.pack(v)
        failed = torch.zeros((self.blocks, self.lanes), dtype=torch.int32)
        counts = (ctypes.c_int64(iterations), ctypes.c_int64(len(winds)))
        numbers = (ctypes.c_double(h), ctypes.c_double(lag), ctypes.c_double(tolerance), *counts)
        self._call("implicit", problem, xb, vb, failed, *numbers)
        del alive, past
        return self._solve_blocks(xb, vb, failed)

    def split(
        self,
        parts: Sequence[Kernel],
        winds: Sequence[Tensor],
        targets: Sequence[Tensor],
        x: Tensor,
        v: Tensor,
        h: float,
        *,
        tolerance: float,
        iterations: int,
        offsets: Sequence[Tensor],
        memory: Sequence[Tensor] = (),
    ) -> tuple[Tensor, Tensor, tuple[Tensor, ...]]:
        """Takes steps of `h` [s] of the splitting (see `sim.integrate.split`): positions,
        velocities (vertex, 3, batch), and what forces remember.

        Args:
            parts: of the batches, of this one's kind, whose members side by side are this one's;
                `beside` is none of theirs None.
            winds, targets, offsets, tolerance, iterations: as of `implicit`.
            memory: of the forces of all parts that remember, in order.
        """
        problem, alive = self._problem_with(
            wind=self._stack_parts(winds),
            targets=self._stack_parts(targets),
            **self._tie_targets(offsets),
        )
        problems: list[_Problem] = []
        remembered: list[tuple[Kernel, Tensor]] = []
        array, remaining = (_Part * len(parts))(), list(memory)
        first = 0
        for index, part in enumerate(parts):
            mine, tensors = part._problem_with(**part._tie_targets(offsets))
            count = 0 if part.beside is None else part.beside.remembering
            past = part._remember(mine, remaining[:count])
            array[index] = _Part(ctypes.pointer(mine), part.blocks, first, part.batch)
            remembered += [(part, tensor) for tensor in past]
            problems.append(mine)
            alive += tensors
            first, remaining = first + part.batch, remaining[count:]
        xb, vb = self.pack(x), self.pack(v)
        failed = torch.zeros((self.blocks, self.lanes), dtype=torch.int32)
        counts = (ctypes.c_int64(iterations), ctypes.c_int64(len(winds)))
        self._call(
            "split",
            problem,
            xb,
            vb,
            failed,
            ctypes.c_double(h),
            ctypes.c_double(tolerance),
            *counts,
            array,
            ctypes.c_int64(len(parts)),
        )
        del alive, problems
        return *self._solve_blocks(xb, vb, failed), tuple(
            part.unpack(tensor) for part, tensor in remembered
        )

    def _solve_blocks(self, x: Tensor, v: Tensor, failed: Tensor) -> tuple[Tensor, Tensor]:
        """Positions and velocities (vertex, 3, batch) of blocks, NaN for members whose solve did
        not converge."""
        after, lost = (self.unpack(x), self.unpack(v)), self.unpack(failed) != 0
        if bool(lost.any()):
            after = (after[0].masked_fill(lost, torch.nan), after[1].masked_fill(lost, torch.nan))
        return after

    def _call(
        self,
        name: str,
        problem: _Problem,
        *arguments: Tensor | ctypes._SimpleCData[Any] | ctypes.Array[_Part],
    ) -> None:
        function = _function(self.code, name, self.kind)
        function.restype = None
        passed = [ctypes.c_void_p(a.data_ptr()) if isinstance(a, Tensor) else a for a in arguments]
        function(ctypes.byref(problem), ctypes.c_int64(self.blocks), *passed)


def _set_ends(settings: _Ends, cloth: Cloth) -> dict[str, Tensor]:
    """Fills in the cloth's ends; the tensors that are pointed to are returned, to be kept alive."""
    ends = cloth.mesh.ends
    settings.count, settings.width = ends.within.shape
    tensors = {
        "vertex": torch.tensor(ends.vertices, dtype=torch.int32),
        "within": torch.tensor(ends.within, dtype=torch.int32),
        "weight": torch.tensor(ends.weights, dtype=cloth.dtype),
    }
    for name, tensor in tensors.items():
        setattr(settings, name, tensor.data_ptr())
    return {f"ends_{name}": tensor for name, tensor in tensors.items()}


def _set_contact(
    settings: _Contact, system: System, contact: Contact, face: Tensor, width: int
) -> dict[str, Tensor]:
    """Fills in the contact's settings; the tensors it points to are returned, to be kept alive."""
    cloth = system.cloth
    centre, separation = layers(cloth.mesh, contact)
    group, block = _groups(cloth.mesh.rest, width), _groups(centre, width)
    rest = np.where(group < 0, np.nan, cloth.mesh.rest.T[:, group]).swapaxes(
        0, 1
    )  # (group, 2, width)
    real = {
        "vertex_area": cloth.mesh.vertex_areas,
        "centre": centre,
        "apart": separation**2,
        "group_rest": rest,
    }
    tensors = {
        name: torch.tensor(np.ascontiguousarray(values), dtype=cloth.dtype)
        for name, values in real.items()
    }
    tensors |= {
        name: torch.tensor(values, dtype=torch.int32)
        for name, values in (("group", group), ("block", block))
    }
    settings.vertices, settings.faces = cloth.mesh.vertex_count, len(cloth.faces)
    settings.groups, settings.blocks = len(group), len(block)
    settings.thickness, settings.stiffness = contact.thickness, contact.stiffness
    settings.friction = contact.friction
    settings.face = face.data_ptr()
    for name, tensor in tensors.items():
        setattr(settings, name, tensor.data_ptr())
    return {f"contact_{name}": tensor for name, tensor in tensors.items()}


def _groups(points: FloatArray, width: int) -> IntArray:
    """Points (n, 2) in groups of `width` that lie close together: (group, width) indices, -1 where
    there is none.

    Halved across the longer side until few enough are left, always at a multiple of the width.
    """

    def halve_group(chosen: IntArray) -> list[IntArray]:
        if len(chosen) <= width:
            return [np.pad(chosen, (0, width - len(chosen)), constant_values=-1)]
        longer = int(np.argmax(np.ptp(points[chosen], axis=0)))
        ordered = chosen[np.argsort(points[chosen, longer], kind="stable")]
        middle = max(1, round(len(chosen) / (2 * width))) * width
        return [*halve_group(ordered[:middle]), *halve_group(ordered[middle:])]

    return np.stack(halve_group(np.arange(len(points))))


_KERNELS: weakref.WeakKeyDictionary[System, dict[str, Kernel]] = weakref.WeakKeyDictionary()


def _function(code: ctypes.CDLL, name: str, kind: str) -> Any:
    return getattr(code, f"{name}_{kind}")


def _kind(system: System) -> str:
    """Names of the kernel's functions by the type of the numbers, with narrow blocks where members
    are few.

    Contact adds forces up in groups as wide as a block: with it, blocks are as wide for few members
    as for many, so that what one gets does not depend on their number.
    """
    if system.cloth.dtype == torch.float64:
        return "f64"
    return "f32_few" if system.cloth.batch <= _FEW and system.contact is None else "f32"


def _to_blocks(tensor: Tensor, lanes: int, blocks: int) -> Tensor:
    """Packs (…, batch) to (block, …, lane); spare lanes repeat the last member."""
    spare = lanes * blocks - tensor.shape[-1]
    if spare:
        tensor = torch.cat([tensor, tensor[..., -1:].expand(*tensor.shape[:-1], spare)], dim=-1)
    return tensor.unflatten(-1, (blocks, lanes)).movedim(-2, 0)
