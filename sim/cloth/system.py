"""All forces on a batch of cloths: the equations of motion that the integrators solve."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import BoolArray
from flagdata.errors import ErrorKind, UsageError
from sim.cloth import bending, contact, inertia, membrane
from sim.cloth.air import AirForce
from sim.cloth.cloth_batch import Cloth
from sim.cloth.contact import Contact
from sim.cloth.handles import Handles
from sim.cloth.limits import StrainLimits, limit_strains, limited_among_slivers
from sim.cloth.sizing import Remeshing
from sim.cloth.state import State
from sim.wind import Wind


class InapplicableError(UsageError):
    """An effect that a cloth cannot have as it is held."""

    kind = ErrorKind.INAPPLICABLE


class Effect(Protocol):
    """A force the base model lacks."""

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        """Computes forces (vertex, 3, batch) [N] at a time [s], for a wind (3, batch), or (vertex,
        3, batch) where it varies [m/s]."""
        ...


class Flow(Protocol):
    """What makes the wind differ from place to place."""

    def field(self, time: float, position: Tensor, wind: Tensor) -> Tensor:
        """Computes the air at the vertices, (vertex, 3, batch) [m/s], for a wind (3, batch) or
        (vertex, 3, batch) so far."""
        ...


class Load(Protocol):
    """Mass of air that the cloth takes along."""

    def added_mass(self, cloth: Cloth) -> Tensor:
        """Computes the added mass (vertex, batch) [kg], for motion along the normals (see
        `sim.cloth.inertia`)."""
        ...


@dataclass(frozen=True, kw_only=True)
class Springs:
    """Springs −k (s − min(1, ℓ/|d|)) d for a stretch d from anchors that move with the handles.

    Attributes:
        vertices: (spring,).
        anchors: (spring, 3, batch) at zero offset [m].
        stiffness: k, (spring, batch) [N/m].
        slack: ℓ, (spring, batch) [m].
        share: s; 1 for springs of their own, 0 for what slack takes away from the handles'.
    """

    vertices: Tensor
    anchors: Tensor
    stiffness: Tensor
    slack: Tensor
    share: float


class AnchorMotion(Protocol):
    """Anchors that move one by one, as observed."""

    def displacement(self, time: float) -> Tensor:
        """Computes displacements (held, 3, batch) from where the system has the anchors [m], at a
        time [s]."""
        ...


class Tie(Protocol):
    """Springs beside the handles, damped as those are. Where it loosens handles it makes up the
    difference to them."""

    def springs(self, cloth: Cloth) -> Springs:
        """Describes the tie as springs."""
        ...

    def force(self, cloth: Cloth, time: float, position: Tensor) -> Tensor:
        """Computes the elastic part: (vertex, 3, batch) [N]."""
        ...

    def stiffness(self, cloth: Cloth, time: float, position: Tensor) -> Tensor:
        """Computes stiffnesses (vertex, batch), the same on each axis [N/m]."""
        ...

    def stiffest(self, cloth: Cloth) -> Tensor:
        """Bounds the stiffness from above at any time and shape, (vertex, batch), at least 0
        [N/m]."""
        ...


class Remembering(Protocol):
    """A force that depends on what the cloth has gone through: it remembers (see `State.memory`),
    in steps of any size.

    Positions and velocities are (vertex, 3, batch) [m, m/s], a wind (3, batch) or (vertex, 3,
    batch) [m/s].
    """

    def start(self, cloth: Cloth, position: Tensor) -> Tensor:
        """Returns what is remembered when nothing has happened."""
        ...

    def update(
        self,
        cloth: Cloth,
        memory: Tensor,
        position: Tensor,
        velocity: Tensor,
        wind: Tensor,
        elapsed: float,
    ) -> Tensor:
        """Returns what is remembered after a step of `elapsed` [s] to a position."""
        ...

    def force(
        self, cloth: Cloth, memory: Tensor, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        """Computes forces (vertex, 3, batch) [N]."""
        ...


@dataclass(frozen=True, kw_only=True)
class Drive:
    """What moves a cloth from outside during a short time, linear between its start and its end.

    Attributes:
        wind: (3, batch) at the start and at the end [m/s].
        targets: (held, 3, batch) of the handles at the start and at the end [m].
        rate: (held, 3, batch) velocity of the handles [m/s].
        offset: (3,) displacement of everything that moves with the handles, at the start and at the
            end [m].
        drift: (3,) its velocity [m/s].
    """

    wind: tuple[Tensor, Tensor]
    targets: tuple[Tensor, Tensor]
    rate: Tensor
    offset: tuple[Tensor, Tensor]
    drift: Tensor

    def part(self, start: float, end: float) -> Drive:
        """Returns the part of the drive between two shares of it, each from 0 to 1."""

        def between(pair: tuple[Tensor, Tensor]) -> tuple[Tensor, Tensor]:
            return torch.lerp(*pair, start), torch.lerp(*pair, end)

        return replace(
            self,
            wind=between(self.wind),
            targets=between(self.targets),
            offset=between(self.offset),
        )

    def select(self, members: slice) -> Drive:
        """Selects the drive of some members only."""

        def select_members(pair: tuple[Tensor, Tensor]) -> tuple[Tensor, Tensor]:
            return pair[0][..., members], pair[1][..., members]

        return replace(
            self,
            wind=select_members(self.wind),
            targets=select_members(self.targets),
            rate=self.rate[..., members],
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class System:
    """A batch: m a = membrane + bending + gravity + air + handle springs + effects.

    Attributes:
        cloth: mesh and materials.
        gravity: (3, batch) [m/s²].
        wind: the undisturbed air.
        air: how it pushes.
        handles: how the cloth is held.
        held: (held,) the handles' vertices.
        anchors: (held, 3, batch) where they are tied at zero offset [m].
        motion: of each anchor beside that of all handles; None for none. Ties do not follow it.
        effects: what else acts.
        flows: what makes the wind differ from place to place, applied in order.
        loads: air that moves with the cloth.
        ties: attachments beside the handles.
        remembering: forces that remember.
        contact: how layers keep apart; None lets them pass through each other.
        limits: of strain; None lets faces stretch as their stiffness allows.
        remeshing: how the mesh follows shape and motion (see `sim.run.simulation_loop.Batch`); None
            keeps it.
    """

    cloth: Cloth
    gravity: Tensor
    wind: Wind
    air: AirForce
    handles: Handles
    held: Tensor
    anchors: Tensor
    motion: AnchorMotion | None = None
    effects: tuple[Effect, ...] = ()
    flows: tuple[Flow, ...] = ()
    loads: tuple[Load, ...] = ()
    ties: tuple[Tie, ...] = ()
    remembering: tuple[Remembering, ...] = ()
    contact: Contact | None = None
    limits: StrainLimits | None = None
    remeshing: Remeshing | None = None

    def __post_init__(self) -> None:
        if self.motion is not None and self.ties:
            raise InapplicableError(
                "ties cannot act beside handles whose anchors move one by one",
                where="system",
                fix="leave out the effects that loosen or add attachments, or move all handles "
                "together",
            )

    @cached_property
    def free(self) -> Tensor:
        """(vertex, 1, 1): 0 for rigidly held vertices, 1 for all others."""
        free = torch.ones_like(self.cloth.mass[:, :1]).unsqueeze(-1)
        if self.is_clamped:
            free[self.held] = 0
        return free

    @cached_property
    def loose(self) -> Tensor:
        """(vertex, 1, 1): 0 for what the handles hold, rigidly or by springs, 1 for all others."""
        return torch.ones_like(self.cloth.mass[:, :1]).unsqueeze(-1).index_fill(0, self.held, 0.0)

    def limit_strains(
        self, position: Tensor, velocity: Tensor, step: float
    ) -> tuple[Tensor, Tensor]:
        """Positions and velocities after a step [s], brought within the strain limits."""
        if self.limits is None:
            return position, velocity
        bring_within = limit_strains if self.remeshing is None else limited_among_slivers
        return bring_within(self.cloth, self.limits, position, velocity, step, self.loose)

    def effective(self, position: Tensor, force: Tensor) -> Tensor:
        """Computes the force that gives the cloth's own mass its acceleration (see
        `sim.cloth.inertia`): (vertex, 3, batch) [N]."""
        if not self.loads:
            return force
        normals = inertia.mean_normals(self.cloth, position)
        return inertia.effective(
            force, mass=self.cloth.mass, added=self.added_mass, normals=normals
        )

    @property
    def added_mass(self) -> Tensor:
        """(vertex, batch) of the air that moves with the cloth [kg]."""
        total = torch.zeros_like(self.cloth.mass)
        for load in self.loads:
            total = total + load.added_mass(self.cloth)
        return total

    def tied(self, time: float, position: Tensor) -> Tensor | None:
        """Computes the stiffness of the ties (vertex, 1, batch) [N/m]; None where there are
        none."""
        if not self.ties:
            return None
        return (
            torch.stack([tie.stiffness(self.cloth, time, position) for tie in self.ties])
            .sum(0)
            .unsqueeze(1)
        )

    def remember_step(
        self,
        memory: tuple[Tensor, ...],
        wind: Tensor,
        time: float,
        position: Tensor,
        velocity: Tensor,
        *,
        elapsed: float,
    ) -> tuple[Tensor, ...]:
        """Computes what forces remember after a step of `elapsed` [s] to a time [s], a position and
        a velocity (vertex, 3, batch) [m, m/s], in a wind (3, batch) [m/s]."""
        if not self.remembering:
            return self.checked(memory)
        local = self.local(wind, time, position)
        return tuple(
            force.update(self.cloth, past, position, velocity, local, elapsed)
            for force, past in zip(self.remembering, self.checked(memory), strict=True)
        )

    def checked(self, memory: tuple[Tensor, ...]) -> tuple[Tensor, ...]:
        """Returns what forces remember, unchanged.

        Raises:
            UsageError: none of some, or too many.
        """
        if len(memory) != len(self.remembering):
            raise UsageError(
                f"the state has {len(memory)} memories for {len(self.remembering)} forces that "
                "remember",
                where="system",
                fix="start from the state that `sim.effects.apply` returns with the system",
            )
        return memory

    def local(self, wind: Tensor, time: float, position: Tensor) -> Tensor:
        """Computes the air at the vertices [m/s]: (vertex, 3, batch), or the wind (3, batch) itself
        where nothing disturbs it."""
        for flow in self.flows:
            wind = flow.field(time, position, wind)
        return wind

    def internal(self, position: Tensor, velocity: Tensor) -> Tensor:
        """Computes membrane, bending and contact forces, elastic and damping: (vertex, 3, batch)
        [N]."""
        total = membrane.force(self.cloth, position, velocity) + bending.force(
            self.cloth, position, velocity
        )
        if self.contact is None:
            return total
        pairs = contact.candidates(self.cloth, self.contact, position, self.neighbours)
        return total + contact.force(self.cloth, self.contact, position, velocity, pairs)

    @cached_property
    def neighbours(self) -> BoolArray:
        """(vertex, face) whether contact passes over them: too close at rest to be different
        layers."""
        if self.contact is None:
            return np.ones((self.cloth.mesh.vertex_count, len(self.cloth.faces)), dtype=bool)
        return contact.neighbours(self.cloth.mesh, self.contact)

    def external(
        self,
        wind: Tensor,
        time: float,
        position: Tensor,
        velocity: Tensor,
        *,
        memory: tuple[Tensor, ...] = (),
        air_position: Tensor | None = None,
        effect_velocity: Tensor | None = None,
    ) -> Tensor:
        """Computes gravity, air, effects, ties and forces that remember: (vertex, 3, batch) [N].

        Args:
            wind: (3, batch) [m/s].
            time: of the effects [s].
            memory: of the forces that remember.
            air_position: the shape the air sees, if another than `position` (see
                `integrate.implicit.AirShape`).
            effect_velocity: the velocity the effects see, if another than `velocity` (see
                `integrate.symplectic`).
        """
        shape = position if air_position is None else air_position
        wind = self.local(wind, time, shape)
        total = self.cloth.mass.unsqueeze(1) * self.gravity + self.air.force(
            self.cloth, shape, velocity, wind
        )
        for tie in self.ties:
            total = total + tie.force(self.cloth, time, position)
        moving = velocity if effect_velocity is None else effect_velocity
        return self._with_added(total, wind, time, position, moving, memory)

    def _with_added(
        self,
        total: Tensor,
        wind: Tensor,
        time: float,
        position: Tensor,
        velocity: Tensor,
        memory: tuple[Tensor, ...],
    ) -> Tensor:
        for effect in self.effects:
            total = total + effect.force(self.cloth, time, position, velocity, wind)
        for force, past in zip(self.remembering, self.checked(memory), strict=True):
            total = total + force.force(self.cloth, past, position, velocity, wind)
        return total

    def offset(self, time: float) -> Tensor:
        """Computes the displacement of the handles' anchors at a time, (3,) [m]."""
        return torch.as_tensor(
            self.handles.offset(time), dtype=self.anchors.dtype, device=self.anchors.device
        )

    def targets(self, time: float) -> Tensor:
        """Computes where the handles are at a time, (held, 3, batch) [m]."""
        return self._targets(time, self.offset(time))

    def _targets(self, time: float, offset: Tensor) -> Tensor:
        moved = self.anchors + offset[:, None]
        return moved if self.motion is None else moved + self.motion.displacement(time)

    def drive(self, start: float, end: float) -> Drive:
        """Returns wind and handles between two times [s], taken as linear."""
        (drive,) = self.drives((start, end))
        return drive

    def drives(self, times: Sequence[float]) -> list[Drive]:
        """Returns the drives between each two times that follow one another."""
        winds = [self.wind.velocity(time) for time in times]
        offsets = [self.offset(time) for time in times]
        targets = [self._targets(time, offset) for time, offset in zip(times, offsets, strict=True)]
        return [
            Drive(
                wind=(winds[k], winds[k + 1]),
                targets=(targets[k], targets[k + 1]),
                rate=(targets[k + 1] - targets[k]) / (end - start),
                offset=(offsets[k], offsets[k + 1]),
                drift=(offsets[k + 1] - offsets[k]) / (end - start),
            )
            for k, (start, end) in enumerate(pairwise(times))
        ]

    @property
    def sprung(self) -> bool:
        """Whether any vertex is held by springs."""
        return bool(self.handles.vertices) and not self.handles.rigid

    @property
    def is_clamped(self) -> bool:
        """Whether any vertex is held rigidly."""
        return bool(self.handles.vertices) and self.handles.rigid

    def force(
        self,
        drive: Drive,
        share: float,
        time: float,
        position: Tensor,
        velocity: Tensor,
        *,
        memory: tuple[Tensor, ...] = (),
        effect_velocity: Tensor | None = None,
    ) -> Tensor:
        """Computes all forces: (vertex, 3, batch) [N]. Rigid handles add none.

        Args:
            drive: wind and handles.
            share: where between its start (0) and its end (1).
            time: of the effects [s].
            memory: of the forces that remember.
            effect_velocity: the velocity the effects see, if another than `velocity`.
        """
        wind = torch.lerp(*drive.wind, share)
        total = self.internal(position, velocity) + self.external(
            wind, time, position, velocity, memory=memory, effect_velocity=effect_velocity
        )
        total = total + self._tie_damping(drive, time, position, velocity)
        if not self.sprung:
            return total
        stretch = position[self.held] - torch.lerp(*drive.targets, share)
        stretch = stretch + self.cloth.damping * (velocity[self.held] - drive.rate)
        return total.index_add(0, self.held, -self.handles.stiffness * stretch)

    @property
    def extra(self) -> bool:
        """Whether anything acts beside the base model in the undisturbed wind, with ties and
        loads."""
        return (
            bool((*self.effects, *self.flows, *self.remembering)) or self.air is not self.air.plain
        )

    @cached_property
    def base(self) -> System:
        """The base model with ties and loads, in the undisturbed wind."""
        return replace(self, air=self.air.plain, effects=(), flows=(), remembering=())

    @cached_property
    def alone(self) -> System:
        """The base model without loads, of the ties with those alone that loosen its handles."""
        return replace(
            self.base, loads=(), ties=tuple(tie for tie in self.ties if self._loosened_by(tie))
        )

    @cached_property
    def beside(self) -> System:
        """All that `alone` lacks, beside the base model."""
        return replace(self, ties=tuple(tie for tie in self.ties if not self._loosened_by(tie)))

    def _loosened_by(self, tie: Tie) -> bool:
        return tie.springs(self.cloth).share < 1

    def extra_force(
        self,
        drive: Drive,
        share: float,
        time: float,
        position: Tensor,
        velocity: Tensor,
        *,
        memory: tuple[Tensor, ...] = (),
        effect_velocity: Tensor | None = None,
    ) -> Tensor:
        """Computes the part of `force` that is not the `base`'s: (vertex, 3, batch) [N]. Arguments
        as there.

        Of the air, it is the difference to the base's.
        """
        undisturbed = torch.lerp(*drive.wind, share)
        wind = self.local(undisturbed, time, position)
        total = torch.zeros_like(position)
        if self.flows:
            total = total + self.air.force(self.cloth, position, velocity, wind)
            total = total - self.air.plain.force(self.cloth, position, velocity, undisturbed)
        elif self.air is not self.air.plain:
            total = total + self.air.beyond(self.cloth, position, velocity, wind)
        moving = velocity if effect_velocity is None else effect_velocity
        return self._with_added(total, wind, time, position, moving, memory)

    def _tie_damping(self, drive: Drive, time: float, position: Tensor, velocity: Tensor) -> Tensor:
        """Computes Kelvin–Voigt damping of the ties, whose other ends move with the handles:
        (vertex, 3, batch) [N]."""
        tied = self.tied(time, position)
        if tied is None:
            return torch.zeros_like(velocity)
        return -self.cloth.damping * tied * (velocity - drive.drift[:, None])

    def tensors(self) -> tuple[Tensor, ...]:
        """Lists the parameters that gradients may be wanted of."""
        cloth = self.cloth
        base = (
            cloth.mass,
            cloth.samples,
            cloth.segments,
            cloth.damping,
            self.gravity,
            self.anchors,
        )
        parts = (
            cloth.stiffening,
            self.wind,
            self.air,
            *self.effects,
            *self.flows,
            *self.loads,
            *self.ties,
            *self.remembering,
        )
        return (*base, *(tensor for part in parts for tensor in _tensors_of(part)))

    def energies(self, state: State) -> dict[str, Tensor]:
        """Computes kinetic, stretching, bending, gravity and handle energy: (batch,) each [J].

        Gravity's is relative to the origin; stretching and bending are exact for constant
        stiffness.
        """
        mass = self.cloth.mass
        result = {
            "kinetic": (mass * (state.velocity**2).sum(1)).sum(0) / 2,
            "stretching": membrane.energy(self.cloth, state.position),
            "bending": bending.energy(self.cloth, state.position),
            "gravity": -(mass * (state.position * self.gravity).sum(1)).sum(0),
        }
        if self.contact is not None:
            pairs = contact.candidates(self.cloth, self.contact, state.position, self.neighbours)
            result["contact"] = contact.energy(self.cloth, self.contact, state.position, pairs)
        if self.sprung:
            stretch = state.position[self.held] - self.targets(state.time)
            result["handles"] = self.handles.stiffness * (stretch**2).sum((0, 1)) / 2
        return result


def _tensors_of(part: object) -> Iterator[Tensor]:
    """Yields the tensors in the fields of a dataclass, and in those of the dataclasses it holds."""
    if isinstance(part, Tensor):
        yield part
    elif isinstance(part, tuple):
        for item in part:
            yield from _tensors_of(item)
    elif is_dataclass(part):
        for entry in fields(part):
            yield from _tensors_of(getattr(part, entry.name))
