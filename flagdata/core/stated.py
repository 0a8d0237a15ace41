"""A number as a user states it: 0.284, 0.284±0.01, or a range such as 0.27:0.30."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from flagdata.errors import UsageError

if TYPE_CHECKING:
    import numpy as np

    from flagdata.core.arrays import FloatArray

_NUMBER = r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*"
_ALONE = re.compile(_NUMBER)
_SIGMA = re.compile(rf"{_NUMBER}(?:±|\+-|\+/-){_NUMBER}")
_RANGE = re.compile(rf"{_NUMBER}:{_NUMBER}")
FORMS = (
    "a number alone, as in 0.28, with its standard deviation, as in 0.28±0.01, or a range, as in "
    "0.27:0.30"
)


@dataclass(frozen=True, kw_only=True)
class Stated:
    """What a user states about a number.

    Attributes:
        low, high: ends of the range in which it lies; equal where one value is stated.
        sigma: standard deviation of the one value that is stated, of a normal distribution; 0 of an
            exact value.

    Raises:
        UsageError: ends that are not in order, a standard deviation below 0 or of a range, numbers
            that are not finite.
    """

    low: float
    high: float
    sigma: float = 0.0

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.low, self.high, self.sigma))):
            raise UsageError(f"{self.text} is not finite", fix=f"give {FORMS}")
        if self.low > self.high or self.sigma < 0 or (self.sigma > 0 and self.low < self.high):
            raise UsageError(
                f"{self.text} is not a number that can be stated",
                fix=f"give {FORMS}, the lower end of a range first",
            )

    @classmethod
    def of(cls, value: Stated | float | tuple[float, float] | str) -> Stated:
        """Makes a statement from a number, a range (low, high), or a text of one of the three
        forms."""
        if isinstance(value, Stated):
            return value
        if isinstance(value, str):
            return parse(value)
        low, high = value if isinstance(value, tuple) else (value, value)
        return cls(low=float(low), high=float(high))

    @property
    def middle(self) -> float:
        """The value, or the middle of the range."""
        return (self.low + self.high) / 2

    @property
    def deviation(self) -> float:
        """The standard deviation; of a range that of a uniform distribution over it."""
        return self.sigma or (self.high - self.low) / math.sqrt(12)

    @property
    def exact(self) -> bool:
        """Whether one value is stated, without an uncertainty."""
        return self.low == self.high and not self.sigma

    @property
    def text(self) -> str:
        """As it is written on the command line."""
        if self.sigma:
            return f"{self.low:g}±{self.sigma:g}"
        return f"{self.low:g}" if self.low == self.high else f"{self.low:g}:{self.high:g}"

    def within(self, deviations: float) -> tuple[float, float]:
        """Returns the range, or the value less and plus so many standard deviations."""
        return self.low - deviations * self.sigma, self.high + deviations * self.sigma

    def draw(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Draws (count,) values that it allows: from a normal distribution, uniform over a
        range."""
        if self.low < self.high:
            return rng.uniform(self.low, self.high, count)
        return self.low + self.sigma * rng.standard_normal(count)

    def recipe(self) -> Any:
        """Returns the JSON value: a number, a list of two of a range, or value and sigma."""
        if self.sigma:
            return {"value": self.low, "sigma": self.sigma}
        return self.low if self.low == self.high else [self.low, self.high]


def parse(text: str) -> Stated:
    """Parses the statement that a text makes.

    Raises:
        UsageError: a text of none of the three forms.
    """
    if match := _ALONE.fullmatch(text):
        return Stated(low=float(match[1]), high=float(match[1]))
    if match := _SIGMA.fullmatch(text):
        if not float(match[2]) > 0:
            raise UsageError(f"{text!r} has no standard deviation above 0", fix=f"give {FORMS}")
        return Stated(low=float(match[1]), high=float(match[1]), sigma=float(match[2]))
    if (match := _RANGE.fullmatch(text)) and float(match[1]) < float(match[2]):
        return Stated(low=float(match[1]), high=float(match[2]))
    raise UsageError(
        f"{text!r} cannot be read as a number with its uncertainty",
        fix=f"give {FORMS}, the lower end of a range first",
    )
