"""Records with a row for each segment."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import UsageError
from measure.probes import StatisticRows


@dataclass(frozen=True, kw_only=True, eq=False)
class Inner(StatisticRows):
    size: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Outer(StatisticRows):
    _WHOLE: ClassVar = frozenset({"count"})

    place: IntArray
    count: int
    inner: Inner | None = None


def outer(*places: int) -> Outer:
    return Outer(place=np.array(places), count=7, inner=Inner(size=np.array(places) / 2))


def test_rows_of_all_arrays_are_selected_alike_and_may_repeat() -> None:
    some = outer(10, 20, 30).select(np.array([2, 0, 2]))
    assert some.place.tolist() == [30, 10, 30]
    assert some.inner is not None
    assert some.inner.size.tolist() == [15.0, 5.0, 15.0]
    assert some.count == 7
    assert replace(outer(1), inner=None).select(np.array([True])).inner is None


def test_parts_are_joined_in_order() -> None:
    whole = Outer.joined([outer(1, 2), outer(3)])
    assert whole.place.tolist() == [1, 2, 3]
    assert whole.inner is not None
    assert whole.inner.size.tolist() == [0.5, 1.0, 1.5]
    assert whole.count == 7


def test_what_is_looked_at_in_some_parts_alone_is_refused() -> None:
    with pytest.raises(UsageError, match="only some parts have inner"):
        Outer.joined([outer(1), replace(outer(2), inner=None)])
    with pytest.raises(UsageError, match="nothing to join"):
        Outer.joined([])
