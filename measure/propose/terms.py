"""The terms that are tried: forces per mass, each a shape on the flat cloth times a field (see `sim.effects.field`)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

from torch import Tensor

from flagdata.errors import UsageError
from measure.loop.columns import EffectColumn
from sim.effects import Effect
from sim.effects.field import FieldEffect, Seen
from sim.effects.parameter import EVERYTHING, Parameter, Role, Value, strength

SHAPES: dict[str, str] = {
    "everywhere": "all over the cloth",
    "fly": "growing from hoist to fly",
    "upper": "on the upper half",
    "lower": "on the lower half",
    "upper_fly": "at the upper fly corner",
    "lower_fly": "at the lower fly corner",
}
"""Names of shapes, and where they are."""


@dataclass(frozen=True, kw_only=True)
class Field:
    """What is known of a field.

    Attributes:
        unit: of its coefficient.
        step: of the coefficient for sensitivities: about 0.5 m/s² on a flag of a metre in 5 m/s.
        words: what it is.
        shapes: where it is tried.
    """

    unit: str
    step: float
    words: str
    shapes: tuple[str, ...]


_ALL = tuple(SHAPES)
_HALVES = ("everywhere", "fly", "upper", "lower")
_CORNERS = ("everywhere", "fly", "upper_fly", "lower_fly")

FIELDS: dict[str, Field] = {
    "downwind": Field(unit="m/s²", step=0.5, words="a steady push downwind", shapes=_ALL),
    "leftward": Field(unit="m/s²", step=0.5, words="a steady push across the wind, to its left", shapes=_ALL),
    "upward": Field(unit="m/s²", step=0.5, words="a steady push upward", shapes=_ALL),
    "downwind_squared": Field(unit="1/m", step=0.02, words="a push downwind as the square of the wind", shapes=_ALL),
    "leftward_squared": Field(unit="1/m", step=0.02, words="a push to the left as the square of the wind", shapes=_ALL),
    "upward_squared": Field(unit="1/m", step=0.02, words="a push upward as the square of the wind", shapes=_ALL),
    "toward_pole": Field(unit="1/s²", step=1.0, words="a spring to the pole, horizontally", shapes=_CORNERS),
    "toward_height": Field(
        unit="1/s²", step=1.0, words="a spring to the height of the attachments", shapes=_CORNERS
    ),
    "against_motion": Field(unit="1/s", step=0.5, words="a resistance to motion", shapes=_HALVES),
    "against_normal_motion": Field(unit="1/s", step=0.5, words="a resistance to normal motion", shapes=_HALVES),
    "across": Field(unit="1/s", step=0.2, words="a pressure in proportion to the wind across it", shapes=_HALVES),
    "across_squared": Field(
        unit="1/m", step=0.1, words="a pressure as the square of the wind across it", shapes=("fly", "upper")
    ),
    "along": Field(unit="1/s", step=0.05, words="a friction in proportion to the wind along it", shapes=_HALVES),
    "along_squared": Field(
        unit="1/m", step=0.01, words="a friction as the square of the wind along it", shapes=_HALVES
    ),
}  # fmt: skip
"""Names of fields. The wind's whole pressure is left out: that is the calibrated model's own."""


@dataclass(frozen=True, kw_only=True)
class Term:
    """A shape times a field.

    Attributes:
        shape: of `SHAPES`.
        field: of `FIELDS`.

    Raises:
        UsageError: names that are not there.
    """

    shape: str
    field: str

    def __post_init__(self) -> None:
        if self.shape not in SHAPES or self.field not in FIELDS:
            raise UsageError(
                f"no term {self.field!r} on {self.shape!r}", where="terms",
                fix=f"take a field of {', '.join(FIELDS)} and a shape of {', '.join(SHAPES)}",
            )  # fmt: skip

    @property
    def name(self) -> str:
        """As a Python name."""
        return f"{self.field}_{self.shape}"

    @property
    def words(self) -> str:
        """What it is, and where."""
        return f"{FIELDS[self.field].words}, {SHAPES[self.shape]}"


@dataclass(frozen=True, kw_only=True)
class TermEffect(FieldEffect):
    """The force of a term: coefficient × shape × field, per mass.

    Attributes:
        coefficient: in the unit of the field's.
        term: which.
    """

    coefficient: Annotated[
        Value, strength(unit="of the field", prior=(-1.0, 1.0), source="none: to be found from what a model leaves")
    ] = 0.0
    term: Term

    def acceleration(self, seen: Seen) -> Tensor:
        return self.coefficient * (getattr(seen, self.term.shape) * getattr(seen, self.term.field))


@dataclass(frozen=True, kw_only=True)
class TermColumn(EffectColumn):
    """A term as a direction of the model."""

    effect: str = "proposed"
    parameter: str = "coefficient"
    step: float = 0.0
    term: Term

    @classmethod
    def of(cls, term: Term) -> TermColumn:
        """With the step of its field."""
        return cls(term=term, parameter=term.name, step=FIELDS[term.field].step)

    @cached_property
    def described(self) -> Parameter:
        return Parameter(
            role=Role.STRENGTH, unit=FIELDS[self.term.field].unit, prior=(-self.step, self.step), admissible=EVERYTHING,
            source="none: to be found from what a model leaves", null=0.0,
        )  # fmt: skip

    def at(self, coefficient: float) -> Effect:
        return TermEffect(coefficient=coefficient, term=self.term)


def dictionary() -> tuple[TermColumn, ...]:
    """All terms that are tried."""
    return tuple(
        TermColumn.of(Term(shape=shape, field=name)) for name, entry in FIELDS.items() for shape in entry.shapes
    )
