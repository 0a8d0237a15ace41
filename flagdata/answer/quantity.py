"""A quantity with its interval: of a film, of a cloth, of an effect that was missing."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any


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

    def as_dict(self) -> dict[str, Any]:
        """Returns JSON values: the interval, whose end is null where nothing bounds it, its level,
        and its bound."""
        return {
            "interval": self.ends(),
            "level": self.level,
            "bound": None if self.bound is None else self.bound.value,
        }

    def ends(self) -> list[float | None]:
        """Returns both ends as JSON values; None for one at infinity."""
        return [end if math.isfinite(end) else None for end in (self.low, self.high)]


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
    """

    name: str
    unit: str
    value: float | None
    sigma: float | None
    span: Span
    assumed: tuple[float, float] | None = None
    constrained: bool = True
    given: bool = False
    information: float | None = None

    @property
    def interval(self) -> tuple[float, float]:
        """Its ends, of a bound one at infinity or where the quantity ends."""
        return self.span.low, self.span.high

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
        """The unit behind a number, with the space before it."""
        return "" if self.unit == "1" else f" {self.unit}"

    @property
    def text(self) -> str:
        """Value and interval, or the bound with its level; what was given or assumed where the
        recording adds nothing to it.
        """
        if not self.constrained or (self.value is None and not self.is_bound):
            return self._assumed_text
        if self.value is None:
            return f"{self.span.word(_short, self.suffix)}, {self.span.percent}"
        low, high = map(_short, self.interval)
        return f"{_short(self.value)} [{low}, {high}]{self.suffix}"

    @property
    def text_with_level(self) -> str:
        """The same, with the level of an interval too."""
        is_interval = self.constrained and self.value is not None
        return f"{self.text}, {self.span.percent}" if is_interval else self.text

    @property
    def _assumed_text(self) -> str:
        if self.assumed is None:
            return "not determined"
        low, high = map(_short, self.assumed)
        assumed = f"{low if low == high else f'{low} to {high}'}{self.suffix}"
        return f"{assumed}, as given" if self.given else f"not determined (assumed: {assumed})"

    def as_dict(self) -> dict[str, Any]:
        """Returns JSON values; an end of the interval that nothing bounds is null."""
        assumed = {} if self.assumed is None else {"assumed": list(self.assumed)}
        information = {} if self.information is None else {"information": self.information}
        return {
            "unit": self.unit,
            "value": self.value,
            "sigma": self.sigma,
            **self.span.as_dict(),
            **assumed,
            **information,
            "constrained": self.constrained,
            "given": self.given,
        }


def _short(number: float) -> str:
    return f"{number:.3g}"
