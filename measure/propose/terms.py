"""The terms that are tried: a shape on the flat cloth times a field, as a force per mass or as a
share of mass.

Shapes and fields are those of `sim.effects.field`. A local shape is named by its place in
hundredths: `near_70_30`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

from torch import Tensor

from flagdata.core.numbered import read_bounded
from flagdata.errors import UsageError
from measure.forecasting.regressors import EffectColumn
from sim.cloth.cloth_batch import Cloth
from sim.effects import Effect
from sim.effects.effect import ClothEffect
from sim.effects.field import FieldEffect, Flat, Seen, heavier
from sim.effects.parameter import EVERYTHING, NOT_NEGATIVE, Parameter, Role, Value, strength

MASS = "mass"
"""The field of terms that are no forces: the cloth is heavier."""
_LIGHTEST = -0.9
"""Share of mass that a term may take away."""
_SOURCE = "none: to be found from what a model leaves"


@dataclass(frozen=True, kw_only=True)
class TermShape:
    """Where a term is.

    Attributes:
        method: of `sim.effects.field.Flat`.
        place: its arguments; () for a property.
        words: where it is.
    """

    method: str
    place: tuple[float, ...] = ()
    words: str

    @property
    def code(self) -> str:
        """As an attribute of a `Flat`, in Python."""
        return (
            f"{self.method}({', '.join(f'{p:g}' for p in self.place)})"
            if self.place
            else self.method
        )

    def of(self, flat: Flat) -> Tensor:
        """Computes the shape on a flat cloth, (vertex, 1, 1)."""
        attribute = getattr(flat, self.method)
        return attribute(*self.place) if self.place else attribute


SHAPES: dict[str, str] = {
    "everywhere": "all over the cloth",
    "hoist": "growing from fly to hoist",
    "fly": "growing from hoist to fly",
    "upper": "on the upper half",
    "lower": "on the lower half",
    "upper_fly": "at the upper fly corner",
    "lower_fly": "at the lower fly corner",
}
"""Names of shapes of the size of the cloth, and where they are. Local ones: see `shape_named`."""
_LOCAL = re.compile(r"(near|stripe|band)_(\d{1,3})(?:_(\d{1,3}))?")
_LOCAL_WORDS = {
    "near": "near {0:.2f} of the width from the hoist and {1:.2f} of the height from below",
    "stripe": "along a line from bottom to top at {0:.2f} of the width from the hoist",
    "band": "along a line from hoist to fly at {0:.2f} of the height from below",
}


def shape_named(name: str) -> TermShape:
    """Parses a shape of `SHAPES`, or near_U_V, stripe_U, band_V with shares of the width and the
    height in hundredths.

    Raises:
        UsageError: no such shape.
    """
    if name in SHAPES:
        return TermShape(method=name, words=SHAPES[name])
    match = _LOCAL.fullmatch(name)
    numbers = (
        []
        if match is None
        else [read_bounded(part, most=100) for part in match.groups()[1:] if part is not None]
    )
    arguments = tuple(number / 100 for number in numbers if number is not None)
    if match is None or len(arguments) != (2 if match[1] == "near" else 1):
        raise UsageError(
            f"there is no shape {name!r}",
            where="terms",
            fix=f"take one of {', '.join(SHAPES)}, or near_U_V, stripe_U, band_V in hundredths "
            "from 0 to 100",
        )
    return TermShape(
        method=match[1], place=arguments, words=_LOCAL_WORDS[match[1]].format(*arguments)
    )


def local(method: str, *shares: float) -> str:
    """Names a local shape at shares of the width and the height."""
    return "_".join([method, *(f"{round(100 * share):02d}" for share in shares)])


@dataclass(frozen=True, kw_only=True)
class TermField:
    """Description of a field.

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


_CORNERS = (local("near", 1, 0), local("near", 1, 1))
_ALL = (*SHAPES, *_CORNERS)
_QUARTERS = ("everywhere", "fly", "upper", "lower")
_HALVES = ("everywhere", "hoist", "fly", "upper", "lower")
_FLY = ("everywhere", "fly", "upper_fly", "lower_fly", *_CORNERS)
_PLACES = tuple(local("near", u, v) for u in (0.25, 0.5, 0.75, 1.0) for v in (0.0, 0.33, 0.67, 1.0))
_STRIPES = tuple(local("stripe", u) for u in (0.2, 0.4, 0.6, 0.8, 1.0))
_BANDS = tuple(local("band", v) for v in (0.0, 0.25, 0.5, 0.75, 1.0))

FIELDS: dict[str, TermField] = {
    "downwind": TermField(unit="m/s²", step=0.5, words="a steady push downwind", shapes=_ALL),
    "leftward": TermField(
        unit="m/s²", step=0.5, words="a steady push across the wind, to its left", shapes=_ALL
    ),
    "upward": TermField(unit="m/s²", step=0.5, words="a steady push upward", shapes=_ALL),
    "downwind_squared": TermField(
        unit="1/m", step=0.02, words="a push downwind as the square of the wind", shapes=_QUARTERS
    ),
    "leftward_squared": TermField(
        unit="1/m",
        step=0.02,
        words="a push to the left as the square of the wind",
        shapes=_QUARTERS,
    ),
    "upward_squared": TermField(
        unit="1/m", step=0.02, words="a push upward as the square of the wind", shapes=_QUARTERS
    ),
    "to_pole": TermField(
        unit="m/s²", step=0.5, words="a steady pull to the pole, horizontally", shapes=_HALVES
    ),
    "toward_pole": TermField(
        unit="1/s²", step=1.0, words="a spring to the pole, horizontally", shapes=_FLY
    ),
    "toward_height": TermField(
        unit="1/s²", step=1.0, words="a spring to the height of the attachments", shapes=_FLY
    ),
    "against_motion": TermField(
        unit="1/s", step=0.5, words="a resistance to motion", shapes=_QUARTERS
    ),
    "against_normal_motion": TermField(
        unit="1/s", step=0.5, words="a resistance to normal motion", shapes=_QUARTERS
    ),
    "left_of_motion": TermField(
        unit="1/s",
        step=0.5,
        words="a push to the left of the motion, as in a turning frame",
        shapes=("everywhere",),
    ),
    "across": TermField(
        unit="1/s",
        step=0.2,
        words="a pressure in proportion to the wind across it",
        shapes=_QUARTERS,
    ),
    "across_squared": TermField(
        unit="1/m",
        step=0.1,
        words="a pressure as the square of the wind across it",
        shapes=("hoist", "fly", "upper", "lower", "upper_fly", "lower_fly"),
    ),
    "across_even": TermField(
        unit="1/m",
        step=0.1,
        words="a pressure as the square of the wind across it, always toward one side of the cloth",
        shapes=_QUARTERS,
    ),
    "rising": TermField(
        unit="1/s", step=0.2, words="the pressure of a wind that also blows upward", shapes=_HALVES
    ),
    "crossing": TermField(
        unit="1/s",
        step=0.2,
        words="the pressure of a wind that also blows to the left",
        shapes=_HALVES,
    ),
    "along": TermField(
        unit="1/s",
        step=0.05,
        words="a friction in proportion to the wind along it",
        shapes=_QUARTERS,
    ),
    "along_squared": TermField(
        unit="1/m",
        step=0.01,
        words="a friction as the square of the wind along it",
        shapes=_QUARTERS,
    ),
    "along_width": TermField(
        unit="1/s",
        step=0.1,
        words="a friction in proportion to the wind along its width",
        shapes=("everywhere", "fly"),
    ),
    "along_height": TermField(
        unit="1/s",
        step=0.1,
        words="a friction in proportion to the wind along its height",
        shapes=("everywhere", "fly"),
    ),
    MASS: TermField(
        unit="1",
        step=0.5,
        words="more mass, as a share of the cloth's",
        shapes=(*_PLACES, *_STRIPES, *_BANDS),
    ),
}
"""Names of fields. The wind's whole pressure and the whole mass are left out: those are the
calibrated model's own."""


@dataclass(frozen=True, kw_only=True)
class Term:
    """A shape times a field.

    Attributes:
        shape: name of a shape, see `shape_named`.
        field: of `FIELDS`.

    Raises:
        UsageError: names that are not there.
    """

    shape: str
    field: str

    def __post_init__(self) -> None:
        if self.field not in FIELDS:
            raise UsageError(
                f"there is no field {self.field!r}",
                where="terms",
                fix=f"take one of {', '.join(FIELDS)}",
            )
        shape_named(self.shape)

    @classmethod
    def named(cls, name: str) -> Term:
        """Parses the term of a name.

        Raises:
            UsageError: not a term's.
        """
        # The longest field that fits: "across_squared_fly" is no shape "squared_fly" of "across".
        field = max((f for f in FIELDS if name.startswith(f"{f}_")), key=len, default="")
        if not field:
            raise UsageError(f"{name!r} is no term", where="terms", fix="give field_shape")
        return cls(field=field, shape=name.removeprefix(f"{field}_"))

    @property
    def name(self) -> str:
        """As a Python name."""
        return f"{self.field}_{self.shape}"

    @property
    def words(self) -> str:
        """What it is, and where."""
        return f"{FIELDS[self.field].words}, {self.at.words}"

    @property
    def at(self) -> TermShape:
        """Its shape."""
        return shape_named(self.shape)

    def moved(self, *steps: float) -> Term:
        """Moves the term to a place of the cloth nearby, by shares of the width and the height."""
        shifted = (
            min(1.0, max(0.0, p + step)) for p, step in zip(self.at.place, steps, strict=True)
        )
        return replace(self, shape=local(self.at.method, *shifted))


@dataclass(frozen=True, kw_only=True)
class TermEffect(FieldEffect):
    """The force of a term: coefficient × shape × field, per mass.

    Attributes:
        coefficient: in the unit of the field's.
        term: which.
    """

    coefficient: Annotated[
        Value, strength(unit="of the field", prior=(-1.0, 1.0), source=_SOURCE)
    ] = 0.0
    term: Term

    def acceleration(self, seen: Seen) -> Tensor:
        return self.coefficient * (self.term.at.of(seen) * getattr(seen, self.term.field))


@dataclass(frozen=True, kw_only=True)
class TermMass(ClothEffect):
    """The mass of a term: 1 + coefficient × shape times the cloth's.

    Attributes:
        coefficient: as a share.
        term: which.
    """

    coefficient: Annotated[
        Value,
        strength(unit="1", prior=(-0.5, 2.0), admissible=(_LIGHTEST, float("inf")), source=_SOURCE),
    ] = 0.0
    term: Term

    def cloth(self, cloth: Cloth) -> Cloth:
        return heavier(cloth, self.coefficient * self.term.at.of(Flat(cloth=cloth)))


@dataclass(frozen=True, kw_only=True)
class TermColumn(EffectColumn):
    """A term as a direction of the model."""

    effect: str = "proposed"
    parameter: str = "coefficient"
    step: float = 0.0
    term: Term

    @classmethod
    def of(cls, term: Term) -> TermColumn:
        """Makes the column of a term, with the step of its field."""
        return cls(term=term, parameter=term.name, step=FIELDS[term.field].step)

    @property
    def kind(self) -> type[TermMass] | type[TermEffect]:
        return TermMass if self.term.field == MASS else TermEffect

    @cached_property
    def described(self) -> Parameter:
        admissible = (
            NOT_NEGATIVE if self.term.field == MASS else EVERYTHING
        )  # nothing takes mass away
        return Parameter(
            role=Role.STRENGTH,
            unit=FIELDS[self.term.field].unit,
            prior=(-self.step, self.step),
            source=_SOURCE,
            admissible=admissible,
            null=0.0,
        )

    def at(self, coefficient: float | Tensor) -> Effect:
        return self.kind(coefficient=coefficient, term=self.term)


def dictionary() -> tuple[TermColumn, ...]:
    """Lists all terms that are tried."""
    return columns_of(
        [Term(shape=shape, field=name) for name, entry in FIELDS.items() for shape in entry.shapes]
    )


def columns_of(terms: Sequence[Term]) -> tuple[TermColumn, ...]:
    """Makes the columns of terms."""
    return tuple(TermColumn.of(term) for term in terms)
