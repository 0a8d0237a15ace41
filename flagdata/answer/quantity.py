"""A quantity with its interval: of a film, of a cloth, of an effect that was missing."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

READ_AS = {"rad": ("°", 180 / math.pi), "N·m": ("µN·m", 1e6)}
"""Unit → the unit in which people read it, and the factor to it; of all others they are the
same."""


def unit_as_read(unit: str) -> tuple[str, float]:
    """Returns the unit in which people read numbers of a unit, and the factor to it."""
    return READ_AS.get(unit, (unit, 1.0))


@dataclass(frozen=True, kw_only=True)
class Form:
    """How a quantity is shown to people whose name, unit or scale is another in tables.

    Attributes:
        title: what they call it.
        unit: "1" of a ratio.
        digits: behind the point; None for two digits in all.
        convert: makes the number that they read.
    """

    title: str
    unit: str
    digits: int | None = None
    convert: Callable[[float], float] = float

    def number(self, value: float) -> str:
        """Writes a value of the quantity."""
        shown = self.convert(value)
        if self.digits is not None:
            return f"{shown:.{self.digits}f}"
        return f"{float(f'{shown:.1e}'):g}"

    @property
    def suffix(self) -> str:
        """The unit behind a number, with the space before it."""
        return "" if self.unit == "1" else f" {self.unit}"


class Bound(StrEnum):
    """Which side of a quantity is known where only one is, or neither."""

    LEAST = "at-least"
    MOST = "at-most"
    NOTHING = "nothing"


@dataclass(frozen=True, kw_only=True)
class Span:
    """An interval, of which an end may lie at infinity.

    Attributes:
        low, high: its ends.
        level: probability that it holds.
        bound: None of an interval with two ends.
        estimated: whether draws beyond the range are impossible, so that their mean is an estimate.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = ("interval", "level", "bound")

    low: float
    high: float
    level: float
    bound: Bound | None
    estimated: bool

    def phrase(self, digits: int, unit: str = "") -> str:
        """Phrases its ends, "at least 9.4 m/s" or "[3.9, 4.8]", without its level.

        Args:
            digits: behind the point.
            unit: of a single end, with the space before it.
        """
        return self.word(lambda value: f"{value:.{digits}f}", unit)

    def word(self, number: Callable[[float], str], unit: str = "") -> str:
        """Phrases the same with ends as `number` writes them."""
        if self.bound is Bound.LEAST:
            return f"at least {number(self.low)}{unit}"
        if self.bound is Bound.MOST:
            return f"at most {number(self.high)}{unit}"
        return "not constrained" if self.bound else f"[{number(self.low)}, {number(self.high)}]"

    @property
    def percent(self) -> str:
        """The level as it is printed: 90 %."""
        return f"{self.level * 100:.3g} %"

    @property
    def interval(self) -> tuple[float, float]:
        """Both ends, of a bound one at infinity or where the quantity ends."""
        return self.low, self.high

    def ends(self) -> list[float | None]:
        """Returns both ends as JSON values; None for one at infinity."""
        return [end if math.isfinite(end) else None for end in self.interval]


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A number of an answer, SI.

    Attributes:
        name: as in tables and JSON: "wind_speed", "area_weight".
        unit: of all numbers; "1" of a ratio.
        value: the posterior's mean or median; None where only a bound is known, or nothing.
        sigma: its standard deviation, likewise.
        span: its interval, or the bound.
        assumed: what was assumed of it, or given, before the recording; None where nothing had to
            be.
        constrained: whether the recording adds anything to that.
        given: whether it was given.
        information: what the recording adds [nat]; None where that is not counted.
        form: in which people read it; None where that follows from its name and unit.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "unit",
        "value",
        "sigma",
        "interval",
        "level",
        "bound",
        "assumed",
        "information",
        "constrained",
        "given",
    )
    JSON_OPTIONAL: ClassVar = frozenset({"assumed", "information"})

    name: str
    unit: str
    value: float | None
    sigma: float | None
    span: Span
    assumed: tuple[float, float] | None = None
    constrained: bool = True
    given: bool = False
    information: float | None = None
    form: Form | None = None

    @property
    def title(self) -> str:
        """What people call it."""
        return self.name.replace("_", " ") if self.form is None else self.form.title

    @classmethod
    def of(
        cls,
        value: float,
        low: float,
        high: float,
        *,
        unit: str,
        level: float = 0.9,
        bound: Bound | None = None,
        name: str = "",
    ) -> Quantity:
        """Makes a quantity of a value with its interval, or of a bound.

        Args:
            value: NaN of one that was not found; of a bound what it is.
            low, high: ends of the interval; of a bound one is infinite, or where the quantity ends.
            level: probability that the interval, or the bound, holds.
            bound: which side is known where only one is, or neither.
            name: empty where what the quantity is part of names it.
        """
        return cls(
            name=name,
            unit=unit,
            value=None if bound in (Bound.LEAST, Bound.MOST) else value,
            sigma=None,
            span=Span(low=low, high=high, level=level, bound=bound, estimated=bound is None),
            constrained=bound is not Bound.NOTHING,
        )

    @property
    def point(self) -> float:
        """One number for it: its value, or what it is at least or at most; NaN where there is
        neither."""
        if self.is_bound:
            return self.low if self.bound is Bound.LEAST else self.high
        return math.nan if self.value is None else self.value

    @property
    def low(self) -> float:
        """The lower end of its interval, of a bound infinite or where the quantity ends."""
        return self.span.low

    @property
    def high(self) -> float:
        """The upper end likewise."""
        return self.span.high

    @property
    def interval(self) -> tuple[float, float]:
        """Its ends, of a bound one at infinity or where the quantity ends."""
        return self.span.interval

    @property
    def level(self) -> float:
        """Probability that the interval, or the bound, holds."""
        return self.span.level

    @property
    def bound(self) -> Bound | None:
        """Which side is known where only one is; None of an interval with two ends."""
        return self.span.bound

    @property
    def is_bound(self) -> bool:
        """Whether only a bound on one side is known of it."""
        return self.value is None and self.span.bound in (Bound.LEAST, Bound.MOST)

    @property
    def suffix(self) -> str:
        """The unit in which people read it, behind a number, with the space before it."""
        if self.form is not None:
            return self.form.suffix
        unit, _ = unit_as_read(self.unit)
        return {"1": "", "°": "°"}.get(unit, f" {unit}")

    def write(self, number: float) -> str:
        """Writes a number of it in its form, or to three digits in the unit in which people read
        it."""
        if self.form is not None:
            return self.form.number(number)
        return f"{number * unit_as_read(self.unit)[1]:.3g}"

    @property
    def text(self) -> str:
        """Value and interval, or the bound with its level; what was given or assumed where the
        recording adds nothing to it.
        """
        if not self.constrained or (self.value is None and not self.is_bound):
            return self._unknown_text
        if self.value is None:
            return f"{self.span.word(self.write, self.suffix)}, {self.span.percent}"
        if self.bound is Bound.NOTHING:
            return f"{self.write(self.value)}{self.suffix}, no interval"
        low, high = map(self.write, self.interval)
        return f"{self.write(self.value)} [{low}, {high}]{self.suffix}"

    @property
    def text_with_level(self) -> str:
        """The same, with the level of an interval too."""
        is_known = self.bound is not Bound.NOTHING
        is_interval = self.constrained and self.value is not None and is_known
        return f"{self.text}, {self.span.percent}" if is_interval else self.text

    @property
    def assumed_text(self) -> str:
        """What was assumed of it or given, "0.05 to 0.45 kg/m²"; empty where nothing had to be."""
        if self.assumed is None:
            return ""
        low, high = map(self.write, self.assumed)
        return f"{low if low == high else f'{low} to {high}'}{self.suffix}"

    @property
    def _unknown_text(self) -> str:
        if self.assumed is None:
            return "not determined"
        assumed = self.assumed_text
        return f"{assumed}, as given" if self.given else f"not determined (assumed: {assumed})"
