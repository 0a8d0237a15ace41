"""What the tests' statistics are when nothing is missing: groups of null recordings that the null model did not see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from flagdata.rng import stream
from measure.loop.inference import Evidence, NullModel, Nulls

Floats = NDArray[np.float64]
_GROUPS = 400
_LEAST = 24
_KINDS = 4
"""Null recordings below which no test at 2 % can be held."""


@dataclass(frozen=True, kw_only=True, eq=False)
class NullBank:
    """Null recordings.

    Attributes:
        nulls: their segments.
        columns: names of the columns.
        words: how they were made.

    Raises:
        InputError: too few of them, or all of the same numerics.
    """

    nulls: Nulls
    columns: tuple[str, ...]
    words: str

    def __post_init__(self) -> None:
        count, kinds = len(np.unique(self.nulls.statistics.recording)), len(np.unique(self.nulls.numerics))
        if count < _LEAST or kinds < _KINDS:
            raise InputError(
                f"{count} null recordings of {kinds} numerics", where="null bank",
                fix=f"simulate at least {_LEAST} of {_KINDS}, better 200 of 12",
            )  # fmt: skip

    def model(self) -> NullModel:
        """Learnt from all."""
        return NullModel.fit(self.nulls)

    def reference(self, segments: Sequence[int], *, seed: int) -> Reference:
        """Statistics of groups like the data: so many recordings, of so many segments each, of one kind of numerics."""
        rng = stream(seed, "null", "groups")
        drops, left = [], []
        kinds = np.unique(self.nulls.numerics)
        for fold in range(2):
            inside = np.isin(self.nulls.numerics, kinds[fold::2])
            model = NullModel.fit(self.nulls.select(inside))
            outside = self.nulls.select(~inside)
            evidence = Evidence.of_nulls(outside, model)
            places = [
                [
                    np.flatnonzero(evidence.recording == r)
                    for r in np.unique(evidence.recording[outside.numerics == kind])
                ]
                for kind in np.unique(outside.numerics)
            ]
            for _ in range(_GROUPS // 2):
                own = places[rng.integers(len(places))]
                group = rng.choice(len(own), size=len(segments), replace=len(segments) > len(own))
                chosen = [rng.permutation(np.resize(own[g], n)) for g, n in zip(group, segments, strict=True)]
                picked = evidence.select(np.concatenate(chosen))
                drops.append(picked.drops())
                left.append(picked.fit(()).left)
        spread = np.maximum(np.mean(drops, axis=0), 1e-9)
        largest = [float((own / spread).max()) for own in drops]
        return Reference(drops=np.array(drops), spread=spread, largest=np.array(largest), left=np.array(left))


@dataclass(frozen=True, kw_only=True, eq=False)
class Reference:
    """Null distributions.

    Attributes:
        drops: (group, column) see `Evidence.drops`.
        spread: (column,) their mean: 1 if Σ were known and errors normal.
        largest: (group,) largest of drops/spread.
        left: (group,) squared distance the base model leaves.
    """

    drops: Floats
    spread: Floats
    largest: Floats
    left: Floats

    def p_family(self, drop: float, column: int) -> float:
        """Share of the groups whose largest scaled drop is at least this one's."""
        return _p(self.largest, drop / self.spread[column])

    def p_alone(self, drop: float, column: int) -> float:
        """The same for the column alone."""
        return _p(self.drops[:, column], drop)

    def p_left(self, left: float) -> float:
        """Share of the groups in which the base model leaves at least this."""
        return _p(self.left, left)

    def p_global(self, drops: Floats, left: float) -> tuple[float, float]:
        """Statistic and p-value of the global test: the stronger of largest scaled drop and what is left, doubled."""
        largest = float((drops / self.spread).max())
        return largest, min(1.0, 2 * min(_p(self.largest, largest), self.p_left(left)))


def _p(null: Floats, value: float) -> float:
    return float((1 + (null >= value).sum()) / (1 + len(null)))
