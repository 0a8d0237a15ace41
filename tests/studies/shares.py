"""Shares of cases with exact bounds, as sheets of results state them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass

from measure.shares import clopper_pearson


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
        return {"value": self.value, **asdict(self)}
