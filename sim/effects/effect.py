"""The kinds of effects on the cloth. Each kind says where it enters the equations of motion.

An effect is a frozen dataclass, pure, and at the null value of its strengths changes nothing, to the last bit.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import replace

from torch import Tensor

from sim.cloth import Cloth
from sim.effects.parameter import Parametrised
from sim.state import State
from sim.system import System


class Effect(Parametrised, ABC):
    """Something that acts on cloth and that the base model lacks."""

    @abstractmethod
    def apply(self, system: System, state: State) -> tuple[System, State]:
        """The batch with this effect, and its start."""


class ForceEffect(Effect):
    """An additional force."""

    @abstractmethod
    def force(self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor) -> Tensor:
        """(vertex, 3, batch) [N], for a wind (3, batch) or (vertex, 3, batch) [m/s]."""

    def apply(self, system: System, state: State) -> tuple[System, State]:
        return replace(system, effects=(*system.effects, self)), state


def apply(effects: Iterable[Effect], system: System, state: State) -> tuple[System, State]:
    """The batch with these effects, in order, and its start. Effects at their null value leave it as it is.

    Raises:
        UsageError: parameters for another number of members, or an effect that does not fit the system.
    """
    for effect in effects:
        if not effect.absent:
            fitted = effect.for_batch(system.cloth.batch, dtype=system.cloth.dtype, device=system.cloth.device)
            system, state = fitted.apply(system, state)
    return system, state
