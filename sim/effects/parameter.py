"""Parameters of effects: a value for all or for each member of a batch, with its unit, null value,
prior and source.

An effect is a frozen dataclass with fields such as

    coefficient: Annotated[Value, strength(unit="1", prior=(0.0, 1.0), source="…")] = 0.0

whose default is the null value.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from typing import Any, Self, TypeAlias, cast, get_type_hints

import numpy as np
import torch
from torch import Tensor

from flagdata.errors import InputError, UsageError

Value: TypeAlias = float | Tensor
"""One number for the whole batch, or a tensor (batch,)."""
EVERYTHING = (-math.inf, math.inf)
NOT_NEGATIVE = (0.0, math.inf)
_REACH = 20.0


class Role(StrEnum):
    """What a parameter does."""

    STRENGTH = "strength"
    """At its null value the effect is not there, whatever its shapes are."""
    SHAPE = "shape"
    """Says how the effect looks where it is there; its null value is the usual one, where a search
    starts."""


@dataclass(frozen=True, kw_only=True)
class Described:
    """A parameter's prior knowledge.

    Attributes:
        role: strength or shape.
        unit: SI.
        prior: (low, high) of the values expected in the field.
        admissible: (least, most) of the values that make sense at all; others are refused.
        source: where the prior is from.
        weighed: (low, high) beyond the null value of the strengths that verdicts weigh; None for
            those of the prior.
        step: beyond the null value, where predictions are near linear; None for a tenth of what is
            weighed.
    """

    role: Role
    unit: str
    prior: tuple[float, float]
    admissible: tuple[float, float]
    source: str
    weighed: tuple[float, float] | None = None
    step: float | None = None

    def admits(self, value: float) -> bool:
        """Returns whether a value makes sense at all."""
        least, most = self.admissible
        return least <= value <= most

    def nearest(self, value: float) -> float:
        """Returns the admissible value that is nearest to one."""
        return float(np.clip(value, *self.admissible))


@dataclass(frozen=True, kw_only=True)
class Parameter(Described):
    """A described parameter with its null value, in the same unit."""

    null: float

    @property
    def weighed_range(self) -> tuple[float, float]:
        """Returns (low, high) beyond the null value of what verdicts weigh: as stated, or the
        prior. Of one that has one sign the least is a twentieth of the most: what a minute of film
        hardly shows."""
        if self.weighed is not None:
            return self.weighed
        low, high = (end - self.null for end in self.prior)
        if low >= 0:
            return max(low, high / _REACH), high
        return (low, min(high, low / _REACH)) if high <= 0 else (low, high)

    @property
    def small_step(self) -> float:
        """Returns the step by which its sensitivity is found, toward where more is weighed."""
        return self.step or max(self.weighed_range, key=lambda end: (abs(end), end)) / 10

    def check(self, value: Value, *, where: str) -> None:
        """Refuses what is not finite or not admissible.

        Raises:
            InputError: with what is admissible.
        """
        values = torch.as_tensor(value).detach()
        if values.ndim > 1 or not values.numel():
            raise InputError(
                f"the value has the shape {tuple(values.shape)}",
                where=where,
                fix="give a number, or (batch,)",
            )
        lowest, highest = (float(v) for v in torch.aminmax(values))
        least, most = self.admissible
        if not (
            math.isfinite(lowest) and math.isfinite(highest) and least <= lowest and highest <= most
        ):
            range_text = f"{lowest:g}" if lowest == highest else f"{lowest:g} to {highest:g}"
            raise InputError(
                f"{range_text}{'' if self.unit == '1' else f' {self.unit}'} is not admissible",
                where=where,
                fix=f"give a value from {least:g} to {most:g}; expected are {self.prior[0]:g} to "
                f"{self.prior[1]:g}",
            )


def strength(
    *,
    unit: str,
    prior: tuple[float, float],
    source: str,
    admissible: tuple[float, float] = EVERYTHING,
    weighed: tuple[float, float] | None = None,
    step: float | None = None,
) -> Described:
    """Annotates a field at whose default the effect is not there."""
    return Described(
        role=Role.STRENGTH,
        unit=unit,
        prior=prior,
        admissible=admissible,
        source=source,
        weighed=weighed,
        step=step,
    )


def shape(
    *,
    unit: str,
    prior: tuple[float, float],
    source: str,
    admissible: tuple[float, float] = EVERYTHING,
) -> Described:
    """Annotates a field that says how the effect looks."""
    return Described(role=Role.SHAPE, unit=unit, prior=prior, admissible=admissible, source=source)


class Parametrised:
    """Base of all effects: checks and describes the fields annotated by `strength` and `shape`."""

    def __post_init__(self) -> None:
        for name, entry in self.parameters().items():
            entry.check(getattr(self, name), where=f"{type(self).__name__}.{name}")

    @classmethod
    def parameters(cls) -> Mapping[str, Parameter]:
        """Returns name → description, in the order of the fields."""
        return _parameters(cls)

    @classmethod
    def strengths(cls) -> tuple[str, ...]:
        """Names of the parameters that together switch the effect off."""
        return tuple(
            name for name, entry in cls.parameters().items() if entry.role is Role.STRENGTH
        )

    @property
    def absent(self) -> bool:
        """Whether every strength is at its null value, and no gradient of it is wanted."""
        for name in self.strengths():
            value = torch.as_tensor(getattr(self, name))
            if value.requires_grad or bool((value != self.parameters()[name].null).any()):
                return False
        return True

    def for_batch(self, batch: int, *, dtype: torch.dtype, device: torch.device) -> Self:
        """Moves the effect's tensors to a batch's device and type.

        Raises:
            UsageError: values for another number of members.
        """
        moved: dict[str, Any] = {}
        for entry in fields(self):  # pyright: ignore[reportArgumentType]  of each subclass
            value = getattr(self, entry.name)
            if not isinstance(value, Tensor):
                continue
            if value.ndim and value.shape[-1] not in (1, batch):
                raise UsageError(
                    f"the batch has {batch} members, and there are values for {value.shape[-1]}",
                    where=f"{type(self).__name__}.{entry.name}",
                    fix="give one value, or one for each member",
                )
            moved[entry.name] = value.to(dtype=dtype, device=device)
        if not moved:
            return self
        return replace(self, **moved)  # pyright: ignore[reportArgumentType, reportReturnType]

    @classmethod
    def drawn(cls, rng: np.random.Generator, *, batch: int) -> Self:
        """Draws from the prior for each member of a batch: every parameter uniform in its range,
        float64."""
        return cls(**draw(cls.parameters(), rng, batch=batch))


def draw(
    parameters: Mapping[str, Parameter], rng: np.random.Generator, *, batch: int
) -> dict[str, Tensor]:
    """Values (batch,) float64 for each parameter, uniform in its prior range."""
    return {
        name: torch.from_numpy(rng.uniform(*entry.prior, size=batch))
        for name, entry in parameters.items()
    }


@functools.cache
def _parameters(cls: type[Any]) -> Mapping[str, Parameter]:
    hints = get_type_hints(cls, include_extras=True)
    parameters: dict[str, Parameter] = {}
    for entry in fields(cls):
        for note in getattr(hints[entry.name], "__metadata__", ()):
            if isinstance(note, Described):
                parameters[entry.name] = Parameter(**vars(note), null=cast("float", entry.default))
    return parameters
