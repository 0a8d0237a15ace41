"""Batches of flags through time: the one loop behind every simulation.

Each caller states at which instants it looks (what comes before the first is the time to settle)
and what a divergence
leads to: figures that were published depend on both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray
from flagdata.errors import ErrorKind, FlagdataError, UsageError
from sim.cloth.state import SPEED_LIMIT, State
from sim.cloth.system import System
from sim.integrate import Integrator
from sim.remeshing.adapting import remesh_state


class Divergence(StrEnum):
    """What happens to a batch in which a member diverges."""

    REFUSE = "refuse"
    """The run ends with a `DivergedError`: the caller tries other steps or strengths, or reports
    it."""
    RESTART = "restart"
    """The member begins anew, so that no infinity slows the others down; `Batch.diverged` names
    it."""
    KEEP = "keep"
    """The run goes on: the member's positions are NaN or infinite from then on, and the caller
    drops them."""


class DivergedError(FlagdataError):
    """A simulated cloth diverged.

    Attributes:
        member: its place in the batch.
        time: of the state that was no cloth any more, on the clock of the run [s].
    """

    kind = ErrorKind.CLOTH_DIVERGED

    def __init__(self, member: int, time: float) -> None:
        self.member, self.time = member, time
        super().__init__(
            f"member {member} of a batch diverged before {time:.3f} s",
            where="simulation",
            fix="declare more damping, or take smaller steps",
        )

    def __reduce__(self) -> tuple[object, ...]:
        return DivergedError, (self.member, self.time)


@dataclass(kw_only=True, eq=False)
class Batch:
    """Flags that are simulated together.

    Attributes:
        system, state: the flags and where they are; the state moves on with the run, and so does
            the system where its mesh follows the cloth (`System.remeshing`): at the start, and
            after each call of the integrator.
        integrator: advances them.
        divergence: what a member that diverges leads to.
        speed_limit: of any vertex [m/s]: beyond it a member has diverged; infinite to wait for
            positions that are not finite. Without meaning for `KEEP`, which looks for nothing.
        diverged: member → clock of the run at which its first divergence was seen [s].
    """

    system: System
    state: State
    integrator: Integrator
    divergence: Divergence
    speed_limit: float = SPEED_LIMIT
    diverged: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.system, self.state = remesh_state(self.system, self.state)
        self._start = self.system, self.state

    def states(self, numbers: Iterable[int], rate: float) -> Iterator[State]:
        """Yields the states at these numbers of periods after the start, ascending; number 0 is the
        start itself.

        Every number is one call of the integrator, which divides the time since the one before into
        equal steps.

        Args:
            rate: periods a second [Hz].

        Raises:
            DivergedError: a member diverged, where the policy is to refuse.
            UsageError: remeshing that cannot act: see `sim.remeshing.adapting.check`.
        """
        now = 0
        for number in numbers:
            if number > now:
                with torch.no_grad():
                    self.state = self.integrator.advance(
                        self.system, self.state, (number - now) / rate
                    )
                now = number
                if self.divergence is not Divergence.KEEP:
                    self._check()
                self.system, self.state = remesh_state(self.system, self.state)
            yield self.state

    def positions(
        self, numbers: range, rate: float, *, look: Callable[[State], object] | None = None
    ) -> FloatArray:
        """Returns (frame, vertex, 3, member) [m] at these numbers of periods after the start; see
        `states`.

        The periods before the first are simulated one by one and not kept.

        Args:
            look: called with each state that is kept.

        Raises:
            UsageError: a mesh that changes on the way.
        """
        if self.system.remeshing is not None:
            raise UsageError(
                "the mesh changes from frame to frame, so that positions are no single array",
                where="remeshing",
                fix="leave out remeshing, or take the states one by one",
            )
        frames: list[FloatArray] = []
        for number, state in enumerate(self.states(range(numbers.stop), rate)):
            if number >= numbers.start:
                frames.append(state.position.double().cpu().numpy().copy())
                if look is not None:
                    look(state)
        return np.stack(frames)

    def _check(self) -> None:
        failed = ~self.state.healthy(speed_limit=self.speed_limit)
        members = torch.nonzero(failed).flatten().tolist()
        if not members:
            return
        if self.divergence is Divergence.REFUSE:
            raise DivergedError(members[0], self.state.time)
        for member in members:
            self.diverged.setdefault(member, self.state.time)
        start = self._start[1]
        if self.system.remeshing is not None:
            self.system, self.state = self._start[0], replace(start, time=self.state.time)
            return
        self.state = _restart_failed(self.state, start, failed)


def after(settle: float, duration: float, rate: float) -> range:
    """Returns the numbers of the frames of a recording that begins one period after the time to
    settle.

    Args:
        settle, duration: [s].
        rate: frames a second [Hz].
    """
    return range(round(settle * rate) + 1, round((settle + duration) * rate) + 1)


def _restart_failed(state: State, start: State, failed: Tensor) -> State:
    return replace(
        state,
        position=torch.where(failed, start.position, state.position),
        velocity=torch.where(failed, 0.0, state.velocity),
        memory=tuple(
            torch.where(failed, old, new)
            for old, new in zip(start.memory, state.memory, strict=True)
        ),
    )
