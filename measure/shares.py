"""Shares with exact bounds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from scipy.stats import beta


def clopper_pearson(hits: float, count: float, *, level: float) -> tuple[float, float]:
    """Computes the interval of a share, each side (1 − level)/2: Clopper and Pearson, Biometrika
    26:404 (1934). 0 to 1 of no cases.

    Args:
        hits, count: in so many of so many; neither has to be a whole number.
        level: of the interval, between 0 and 1.
    """
    tail = (1 - level) / 2
    low = float(beta.ppf(tail, hits, count - hits + 1)) if hits > 0 else 0.0
    high = float(beta.ppf(1 - tail, hits + 1, count - hits)) if hits < count else 1.0
    return low, high


@dataclass(frozen=True, kw_only=True)
class Share:
    """How often something happened.

    Attributes:
        hits, count: in so many of so many.
        low, high: Clopper–Pearson interval at `level`, each side (1 − level)/2.
    """

    hits: int
    count: int
    low: float
    high: float
    level: float

    @property
    def value(self) -> float | None:
        """None of nothing."""
        return self.hits / self.count if self.count else None

    @classmethod
    def of(cls, happened: Iterable[bool], *, level: float = 0.9) -> Share:
        """Counts cases."""
        cases = [bool(case) for case in happened]
        hits, count = sum(cases), len(cases)
        low, high = clopper_pearson(hits, count, level=level)
        return cls(hits=hits, count=count, low=low, high=high, level=level)

    def as_dict(self) -> dict[str, float | int | None]:
        """Returns JSON values."""
        return {
            "value": self.value,
            "low": self.low,
            "high": self.high,
            "level": self.level,
            "hits": self.hits,
            "count": self.count,
        }
