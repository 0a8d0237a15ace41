"""The kinds of effects on the cloth. Each kind says where it enters the equations of motion.

An effect is a frozen dataclass, pure, and at the null value of its strengths changes nothing, to
the last bit.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import torch
from torch import Tensor

from flagdata.errors import UsageError
from sim.cloth.air import AirForce, QuadraticNormal, face_wind
from sim.cloth.cloth_batch import Cloth
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects.cloth_geometry import origin
from sim.effects.parameter import Parametrised
from sim.effects.weighing import Copied, Need
from sim.kernel.effect_code import Given
from sim.wind import Wind


class Effect(Parametrised, ABC):
    """Something that acts on cloth and that the base model lacks.

    Attributes:
        revision: raised where the same strengths act otherwise than before, so that what was
            simulated is made anew.
        needs: what recordings have to have so that a verdict weighs it, and why.
        unweighed: why no verdict weighs it; empty where verdicts do.
        weighed_shapes: name → value of the shapes with which it is weighed, where they are not the
            usual ones.
        double: whether its small steps are predicted in double precision, as those of how cloth
            bends are. In single precision a prediction of 40 ms rounds to 0.2 to 1.6 µm, and these
            move predictions by 3 to 80 µm a step, less where cloth is soft, heavy or damped: their
            sensitivities were rounding to 1, 0.3, 4 and 36 %, all others' to 0.4 % or less
            (ArcSim's flag with 0.5 ms of damping). Longer steps are no way out: where rounding is
            below 0.5 %, what is not linear in the step is above.
        effect_class: of `sim.effects.weighing.CLASSES`; empty for a class of its own.
        copied: how the base model copies it; None where it does not.
    """

    revision: ClassVar[int] = 1
    needs: ClassVar[Mapping[Need, str]] = {}
    unweighed: ClassVar[str] = ""
    weighed_shapes: ClassVar[Mapping[str, float]] = {}
    double: ClassVar[bool] = False
    effect_class: ClassVar[str] = ""
    copied: ClassVar[Copied | None] = None

    @abstractmethod
    def apply(self, system: System, state: State) -> tuple[System, State]:
        """Returns the batch with this effect, and its start.

        Raises:
            UsageError: the effect does not fit the system.
        """

    def given(self, cloth: Cloth) -> Given:
        """Lists what its C++ reads, if there is any beside its class: its parameters, in order."""
        return Given(
            of=type(self), numbers=tuple(getattr(self, name) for name in self.parameters())
        )


def apply(effects: Iterable[Effect], system: System, state: State) -> tuple[System, State]:
    """Applies these effects to a batch, in order, and to its start. Effects at their null value
    leave it as it is.

    Raises:
        UsageError: parameters for another number of members, or an effect that does not fit the
            system.
    """
    for effect in effects:
        if not effect.absent:
            fitted = effect.for_batch(
                system.cloth.batch, dtype=system.cloth.dtype, device=system.cloth.device
            )
            system, state = fitted.apply(system, state)
    return system, state


class ForceEffect(Effect):
    """An additional force."""

    @abstractmethod
    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        """Computes forces (vertex, 3, batch) [N], for a wind (3, batch) or (vertex, 3, batch)
        [m/s]."""

    def apply(self, system: System, state: State) -> tuple[System, State]:
        return replace(system, effects=(*system.effects, self)), state


class PressureEffect(Effect):
    """A factor on the base model's normal force."""

    @abstractmethod
    def factor(self, density: float, across: Tensor) -> Tensor:
        """Computes a factor that broadcasts to (face, 1, batch).

        Args:
            density: ρ of the base model's force ρ a |w_n| w_n [kg/m³].
            across: (face, 1, batch) the relative wind along the normal w_n [m/s].
        """

    def apply(self, system: System, state: State) -> tuple[System, State]:
        base = pressing(self, system.air)
        before = system.air.effects if isinstance(system.air, FactoredNormal) else ()
        return replace(system, air=FactoredNormal(base=base, effects=(*before, self))), state


def pressing(effect: Effect, air: AirForce) -> QuadraticNormal:
    """Returns the normal force of the base model's air, which an effect changes.

    Raises:
        UsageError: the air has none.
    """
    if isinstance(air, FactoredNormal):
        return air.base
    if isinstance(air, QuadraticNormal):
        return air
    raise UsageError(
        f"{type(effect).__name__} changes a normal force, which {type(air).__name__} has none of",
        where="effects",
        fix="use the quadratic-normal wind force",
    )


@dataclass(frozen=True, kw_only=True)
class FactoredNormal:
    """The base model's air with factors on its normal part."""

    base: QuadraticNormal
    effects: tuple[PressureEffect, ...]

    @property
    def plain(self) -> QuadraticNormal:
        """Without the factors."""
        return self.base

    @property
    def factors(self) -> tuple[PressureEffect, ...]:
        """All that it has more."""
        return self.effects

    def force(self, cloth: Cloth, position: Tensor, velocity: Tensor, wind: Tensor) -> Tensor:
        """Computes forces (vertex, 3, batch) [N] for a wind (3, batch) or (vertex, 3, batch)
        [m/s]."""
        return self.base.force(cloth, position, velocity, wind) + self.beyond(
            cloth, position, velocity, wind
        )

    def beyond(self, cloth: Cloth, position: Tensor, velocity: Tensor, wind: Tensor) -> Tensor:
        """Computes what the factors add to the force: (vertex, 3, batch) [N] for a wind as `force`
        has it."""
        relative = face_wind(cloth, position, velocity, wind)
        factor = torch.ones_like(relative.across)
        for effect in self.effects:
            factor = factor * effect.factor(self.base.density, relative.across)
        size = (cloth.areas / 3)[:, None, None] * self.base.density * (factor - 1)
        return cloth.shared_out(size * relative.across.abs() * relative.across * relative.normal)


class WindEffect(Effect):
    """A change of the wind that is the same everywhere."""

    @abstractmethod
    def velocity(self, time: float, wind: Tensor) -> Tensor:
        """Computes the wind (3, batch) [m/s] at a time [s], for the wind (3, batch) so far."""

    def apply(self, system: System, state: State) -> tuple[System, State]:
        return replace(system, wind=ChangedWind(base=system.wind, effect=self)), state


@dataclass(frozen=True, kw_only=True)
class ChangedWind:
    """A wind with an effect."""

    base: Wind
    effect: WindEffect

    def velocity(self, time: float) -> Tensor:
        """Computes the wind (3, batch) [m/s] at a time [s]."""
        return self.effect.velocity(time, self.base.velocity(time))


class FlowEffect(Effect):
    """A change of the wind that differs from place to place."""

    @abstractmethod
    def field(self, time: float, offset: Tensor, wind: Tensor) -> Tensor:
        """Computes the air at the vertices: (vertex, 3, batch) [m/s].

        Args:
            time: [s].
            offset: (vertex, 3, batch) from the middle of the attachments at the start to the
                vertices [m].
            wind: (3, batch) or (vertex, 3, batch) so far [m/s].
        """

    def apply(self, system: System, state: State) -> tuple[System, State]:
        return replace(
            system, flows=(*system.flows, PlacedFlow(effect=self, origin=origin(system, state)))
        ), state


@dataclass(frozen=True, kw_only=True)
class PlacedFlow:
    """A flow effect about a place (3, batch) [m]."""

    effect: FlowEffect
    origin: Tensor

    def field(self, time: float, position: Tensor, wind: Tensor) -> Tensor:
        """Computes the air at the vertices: (vertex, 3, batch) [m/s]."""
        return self.effect.field(time, position - self.origin, wind)

    def given(self, cloth: Cloth) -> Given:
        """Lists what its C++ reads: the origin, and the effect's parameters."""
        parameters = self.effect.given(cloth)
        return replace(parameters, numbers=(*self.origin, *parameters.numbers))


class ClothEffect(Effect):
    """A change of the cloth itself: mass, stiffness, damping."""

    @abstractmethod
    def cloth(self, cloth: Cloth) -> Cloth:
        """Changes the cloth."""

    def apply(self, system: System, state: State) -> tuple[System, State]:
        return replace(system, cloth=self.cloth(system.cloth)), state
