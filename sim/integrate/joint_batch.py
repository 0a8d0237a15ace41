"""Batches of one cloth, each with effects of its own, advanced as one: small batches cost nearly as
much as large ones.

What the base model lacks is computed batch by batch, the base model's step for all of them at once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, pairwise

import torch
from torch import Tensor

from flagdata.errors import UsageError
from sim.cloth.cloth_batch import Cloth
from sim.cloth.state import State
from sim.cloth.system import AnchorMotion, Springs, System, Tie
from sim.wind import Wind


@dataclass(frozen=True, kw_only=True)
class _Winds:
    """The winds of batches, in order."""

    parts: tuple[Wind, ...]

    def velocity(self, time: float) -> Tensor:
        """Computes the wind (3, batch) [m/s] at a time [s]."""
        return torch.cat([part.velocity(time) for part in self.parts], dim=-1)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Motions:
    """The anchors of all batches, each moving as its own do."""

    parts: tuple[AnchorMotion, ...]

    def displacement(self, time: float) -> Tensor:
        """Computes displacements (held, 3, batch) [m] at a time [s]."""
        return torch.cat([part.displacement(time) for part in self.parts], dim=-1)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Loosening:
    """A tie of one batch among the members of all.

    Attributes:
        tie, cloth: of the batch.
        members: its place.
        batch: members of all.
    """

    tie: Tie
    cloth: Cloth
    members: slice
    batch: int

    def springs(self, cloth: Cloth) -> Springs:
        """Returns the springs of the batch, without stiffness for all others."""
        of_tie = self.tie.springs(self.cloth)
        anchors = of_tie.anchors[..., :1].repeat(1, 1, self.batch)
        anchors[..., self.members] = of_tie.anchors
        return Springs(
            vertices=of_tie.vertices,
            anchors=anchors,
            stiffness=self._widen_members(of_tie.stiffness),
            slack=self._widen_members(of_tie.slack),
            share=of_tie.share,
        )

    def force(self, cloth: Cloth, time: float, position: Tensor) -> Tensor:
        """Computes forces (vertex, 3, batch) [N]."""
        return self._widen_members(self.tie.force(self.cloth, time, position[..., self.members]))

    def stiffness(self, cloth: Cloth, time: float, position: Tensor) -> Tensor:
        """Computes stiffnesses (vertex, batch) [N/m]."""
        return self._widen_members(
            self.tie.stiffness(self.cloth, time, position[..., self.members])
        )

    def stiffest(self, cloth: Cloth) -> Tensor:
        """Computes stiffnesses (vertex, batch) [N/m]."""
        return self._widen_members(self.tie.stiffest(self.cloth))

    def _widen_members(self, of_members: Tensor) -> Tensor:
        """Widens (…, members of the batch) to (…, batch), 0 for all others."""
        of_batch = of_members.new_zeros((*of_members.shape[:-1], self.batch))
        of_batch[..., self.members] = of_members
        return of_batch


@dataclass(frozen=True, kw_only=True, eq=False)
class JointBatch:
    """Batches on one mesh, held alike.

    Attributes:
        systems: of the batches, in order.
    """

    systems: tuple[System, ...]

    @classmethod
    def of(cls, batches: Sequence[tuple[System, State]]) -> tuple[JointBatch, State]:
        """Batches with their starts, and the start of all: members in order, and what forces
        remember.

        Raises:
            UsageError: none, or starts at different times.
        """
        if not batches or any(state.time != batches[0][1].time for _, state in batches):
            raise UsageError(
                "there are no batches, or they have different times",
                where="joint batch",
                fix="start all of them at once",
            )
        return cls(systems=tuple(system for system, _ in batches)), _join_states(
            [state for _, state in batches]
        )

    @cached_property
    def plain(self) -> System:
        """The base model of all, without loads, of the ties with those alone that loosen handles.

        Raises:
            UsageError: batches that differ in their mesh, handles, air, contact or strain limits,
                or in whether their anchors move.
        """
        parts = [system.alone for system in self.systems]
        first = parts[0]
        for part in parts:
            shared = ("handles", "air", "contact", "limits")
            if not torch.equal(part.held, first.held) or any(
                getattr(part, s) != getattr(first, s) for s in shared
            ):
                raise UsageError(
                    f"the batches differ in one of: {', '.join(shared)}",
                    where="joint batch",
                    fix="run them one by one",
                )
        loosening = [
            _Loosening(tie=tie, cloth=part.cloth, members=members, batch=self._members[-1].stop)
            for part, members in zip(parts, self._members, strict=True)
            for tie in part.ties
        ]
        motions = [part.motion for part in parts if part.motion is not None]
        if motions and len(motions) < len(parts):
            raise UsageError(
                "some batches have anchors that move and some do not",
                where="joint batch",
                fix="run them one by one",
            )
        return replace(
            first,
            ties=tuple(loosening),
            cloth=Cloth.joined([part.cloth for part in parts]),
            wind=_Winds(parts=tuple(p.wind for p in parts)),
            gravity=torch.cat([part.gravity for part in parts], dim=-1),
            anchors=torch.cat([part.anchors for part in parts], dim=-1),
            motion=_Motions(parts=tuple(motions)) if motions else None,
        )

    @cached_property
    def beside(self) -> tuple[System, ...]:
        """What `plain` lacks of each."""
        return tuple(system.beside for system in self.systems)

    @cached_property
    def _members(self) -> list[slice]:
        """Of each batch among all."""
        ends = list(accumulate((system.cloth.batch for system in self.systems), initial=0))
        return [slice(*pair) for pair in pairwise(ends)]

    def parts(self, state: State) -> Iterator[tuple[System, slice, State]]:
        """Yields, for every batch, what `plain` lacks of its system, its slice of the members, and
        its state."""
        memory = state.memory
        for system, members in zip(self.beside, self._members, strict=True):
            of_system, memory = memory[: len(system.remembering)], memory[len(system.remembering) :]
            yield system, members, replace(state.select(members), memory=of_system)


def _join_states(states: Sequence[State]) -> State:
    return State(
        position=torch.cat([state.position for state in states], dim=-1),
        velocity=torch.cat([state.velocity for state in states], dim=-1),
        time=states[0].time,
        memory=tuple(past for state in states for past in state.memory),
    )
