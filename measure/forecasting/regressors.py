"""What is varied about the model, one column each: effects of the library, forces, the wind.

A column is a direction in the space of models, known by the change of the predictions along it, its
sensitivity. Those of parameters, of effects, of the corrective field and of the wind are found by
simulation: `StepColumn.system` gives the batch with a small step taken. Forces along the motion and
across it, which are only looked along, are written down.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray
from measure.forecasting.calibrated_parameters import THETA
from sim.cloth.cloth_batch import Cloth
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import EFFECTS, Effect, apply
from sim.effects.cloth_geometry import left_of
from sim.effects.effect import ForceEffect
from sim.effects.gusts import Gusts
from sim.effects.parameter import Parameter
from sim.effects.weighing import Need


class Column(ABC):
    """One direction.

    Attributes:
        name: "lift.coefficient", "field.x.10", "wind.left", "motion.1.20", "across.00".
        unit: of the coefficient.
    """

    name: str
    unit: str


class StepColumn(Column):
    """One whose sensitivity is that of a small step.

    Attributes:
        step: its size.
    """

    step: float

    @property
    def double(self) -> bool:
        """Whether it is predicted in double precision."""
        return False

    def possible(self, recorded: Collection[Need]) -> bool:
        """Returns whether recordings have what it needs."""
        return True

    @abstractmethod
    def system(self, system: System, state: State) -> tuple[System, State]:
        """Takes this step on the batch, and returns it with its start."""


@dataclass(frozen=True, kw_only=True)
class EffectColumn(StepColumn):
    """A strength of an effect of the library, from its null value.

    Attributes:
        effect: its name.
        parameter: the strength.
        shapes: (name, value) of its other parameters, where they are not the usual ones.
    """

    effect: str
    parameter: str
    step: float
    shapes: tuple[tuple[str, float], ...] = ()

    @property
    def name(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        return f"{self.effect}.{self.parameter}"

    @property
    def kind(self) -> type[Effect]:
        """The effect's class."""
        return EFFECTS[self.effect]

    @cached_property
    def described(self) -> Parameter:
        return self.kind.parameters()[self.parameter]

    @property
    def unit(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.described.unit

    @property
    def revision(self) -> int:
        """See `Effect`."""
        return self.kind.revision

    @property
    def double(self) -> bool:
        return self.kind.double

    def possible(self, recorded: Collection[Need]) -> bool:
        return set(self.kind.needs) <= set(recorded)

    def system(self, system: System, state: State) -> tuple[System, State]:
        return self.apply_strength(self.step, system, state)

    def apply_strength(
        self, coefficient: float, system: System, state: State
    ) -> tuple[System, State]:
        """Applies the effect to the batch at a strength `coefficient` beyond its null value."""
        return apply([self.at(coefficient)], system, state)

    def at(self, coefficient: float | Tensor) -> Effect:
        """Makes the effect at a strength `coefficient` beyond its null value, or one for each
        member (batch,)."""
        return self.kind(**dict(self.shapes), **{self.parameter: self.described.null + coefficient})


@dataclass(frozen=True, kw_only=True, eq=False)
class SteadyField(ForceEffect):
    """A steady force per mass: part of a low-rank corrective field.

    Attributes:
        acceleration: (vertex, 3, batch) or (vertex, 3, 1) [m/s²].
    """

    acceleration: Tensor

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        return self.acceleration.to(dtype=cloth.dtype, device=cloth.device) * cloth.mass[:, None]


@dataclass(frozen=True, kw_only=True)
class FieldColumn(StepColumn):
    """A mode b cos(π i u/W) cos(π j v/H) of the corrective field, a force per mass along an axis of
    the world.

    Attributes:
        axis: 0, 1 or 2.
        mode: (i, j).
    """

    axis: int
    mode: tuple[int, int]
    step: float = 0.5

    @property
    def name(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        return f"field.{'xyz'[self.axis]}.{self.mode[0]}{self.mode[1]}"

    @property
    def unit(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        return "m/s²"

    def acceleration(self, rest: FloatArray) -> Tensor:
        """Computes the acceleration (vertex, 3, 1) of a step, at rest coordinates (vertex, 2)
        [m/s²]."""
        field = torch.zeros((len(rest), 3, 1), dtype=torch.float64)
        field[:, self.axis, 0] = self.step * torch.as_tensor(cosine(self.mode, rest, rest))
        return field

    def system(self, system: System, state: State) -> tuple[System, State]:
        return SteadyField(acceleration=self.acceleration(system.cloth.mesh.rest)).apply(
            system, state
        )


@dataclass(frozen=True, kw_only=True)
class WindColumn(StepColumn):
    """A wind that is a share of its mean stronger, turned to its left, or rising.

    Attributes:
        part: 0, 1 or 2.
    """

    part: int
    step: float = 0.05

    @property
    def name(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        return f"wind.{('along', 'left', 'up')[self.part]}"

    @property
    def unit(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        return "1"

    @property
    def share(self) -> Tensor:
        """(part,) of a step."""
        return self.step * torch.eye(3, dtype=torch.float64)[self.part]

    def system(self, system: System, state: State) -> tuple[System, State]:
        return blown(self.share[:, None], system, state)


def blown(shares: Tensor, system: System, state: State) -> tuple[System, State]:
    """Makes the batch's wind stronger, turned and rising by (part, batch) or (part, 1) shares of
    its mean."""
    samples = shares[None].expand(2, -1, -1)
    return apply([Gusts(intensity=1.0, lateral=1.0, vertical=1.0, samples=samples)], system, state)


class WrittenColumn(Column):
    """A force per mass b f cos(π i u/W) cos(π j v/H), f seen in the motion.

    Its change of the predictions is written down, not simulated: T² times the force, T their
    horizon, what it does to a point that is free. As a direction to look along, where only nulls
    say what is usual, it need not be what cloth does.

    Attributes:
        mode: (i, j).
    """

    mode: tuple[int, int]

    def sensitivity(
        self, markers: FloatArray, rest: FloatArray, observed: Tensor, period: float
    ) -> Tensor:
        """Computes the sensitivity (frame − 2, marker, 3, segment) [m per unit] of observed markers
        (frame, marker, 3, segment), from the third frame on.

        Args:
            markers: (marker, 2) [m].
            rest: (vertex, 2) of the cloth [m].
            period: between the frames [s].
        """
        shape = torch.as_tensor(
            cosine(self.mode, markers, rest), dtype=observed.dtype, device=observed.device
        )
        return self._move(observed, period) * shape[None, :, None, None]

    @abstractmethod
    def _move(self, observed: Tensor, period: float) -> Tensor:
        """Computes (frame − 2, marker, 3, segment) T² f [m per unit]."""


@dataclass(frozen=True, kw_only=True)
class MotionColumn(WrittenColumn):
    """Along the observed motion: its velocity, or its acceleration.

    Attributes:
        derivative: 1 for velocity, 2 for acceleration.
    """

    derivative: int
    mode: tuple[int, int]

    @property
    def name(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        return f"motion.{self.derivative}.{self.mode[0]}{self.mode[1]}"

    @property
    def unit(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        return ("1/s", "1")[self.derivative - 1]

    def _move(self, observed: Tensor, period: float) -> Tensor:
        return (
            _travel(observed) * period
            if self.derivative == 1
            else observed[2:] - 2 * observed[1:-1] + observed[:-2]
        )


@dataclass(frozen=True, kw_only=True)
class AcrossColumn(WrittenColumn):
    """Across the observed velocity v, horizontally: z × v, as of a frame that turns about the
    vertical.

    Mirrored in the plane of wind and gravity it changes its sign, and what the base model does
    hardly changes (ArcSim's bending alone knows the faces of a cloth).
    """

    mode: tuple[int, int]

    @property
    def name(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        return f"across.{self.mode[0]}{self.mode[1]}"

    @property
    def unit(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        return "1/s"

    def _move(self, observed: Tensor, period: float) -> Tensor:
        return left_of(_travel(observed), axis=2) * period


def _travel(observed: Tensor) -> Tensor:
    """Computes what the velocity makes of a period between frames, (frame − 2, …), by central
    differences of (frame, …) [m]."""
    return (observed[2:] - observed[:-2]) / 2


def cosine(mode: tuple[int, int], places: FloatArray, rest: FloatArray) -> FloatArray:
    """Computes cos(π i u/W) cos(π j v/H) at rest coordinates (place, 2) of a cloth (vertex, 2) [m],
    (place,)."""
    low = rest.min(axis=0)
    share = (places - low) / (rest.max(axis=0) - low)
    return np.cos(np.pi * mode[0] * share[:, 0]) * np.cos(np.pi * mode[1] * share[:, 1])


TURNED = "direction-change.angle"
"""The column of what the log's direction is off by, which is fitted within its tolerance in every
comparison."""

_MODES = ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0))
_MOTIONS = ((0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (0, 2))


def library() -> tuple[EffectColumn, ...]:
    """Lists the strengths that are weighed on markers and meshes, and `TURNED`; those of installed
    packages last."""
    weighed = {column.name for column in weighed_columns(Need.MARKERS)}
    return tuple(column for column in registered_columns() if column.name in {*weighed, TURNED})


def weighed_columns(kind: Need) -> tuple[EffectColumn, ...]:
    """Lists the strengths of the registry of effects that verdicts on a kind of recordings weigh,
    where these have what an effect needs.

    Args:
        kind: `Need.MARKERS` or `Need.FILMS`.
    """
    never = {Need.MARKERS, Need.FILMS, Need.MAST} - {kind}
    return tuple(
        column
        for column in registered_columns()
        if not column.kind.unweighed and never.isdisjoint(column.kind.needs)
    )


def registered_columns() -> tuple[EffectColumn, ...]:
    """Lists the strengths of all effects of the registry that can be used."""
    return tuple(
        EffectColumn(
            effect=name,
            parameter=parameter,
            step=effect.parameters()[parameter].small_step,
            shapes=tuple(effect.weighed_shapes.items()),
        )
        for name, effect in EFFECTS.usable()
        for parameter in effect.strengths()
    )


def fields() -> tuple[FieldColumn, ...]:
    """Lists the corrective field's modes: steady forces."""
    return tuple(FieldColumn(axis=axis, mode=mode) for axis in range(3) for mode in _MODES)


def winds() -> tuple[WindColumn, ...]:
    """Lists the components of the wind, by which its course is estimated."""
    return tuple(WindColumn(part=part) for part in range(3))


def motions() -> tuple[WrittenColumn, ...]:
    """Forces along the observed motion, and across it."""
    along = (
        MotionColumn(derivative=derivative, mode=mode) for derivative in (1, 2) for mode in _MOTIONS
    )
    return (*along, AcrossColumn(mode=(0, 0)))


def columns() -> tuple[Column, ...]:
    """Lists what is weighed beside the calibrated parameters: the library's strengths, then forces
    along and across the motion."""
    return (*library(), *motions())


def names() -> tuple[str, ...]:
    """Names of all columns of the statistics, the calibrated parameters first."""
    return (*(name for name, _, _ in THETA), *(column.name for column in columns()))
