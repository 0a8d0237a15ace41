"""Results become JSON values by one rule."""

from __future__ import annotations

import datetime as dt
import json
import math
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from flagdata.core.json_values import json_values
from flagdata.errors import RefusedError


class Side(StrEnum):
    LEFT = "left"


@dataclass(frozen=True, kw_only=True)
class Inner:
    side: Side
    share: float


@dataclass(frozen=True, kw_only=True)
class Outer:
    inner: Inner
    rows: tuple[int, ...]
    hidden: object = None
    JSON_NAMES: ClassVar[tuple[str, ...]] = ("rows", "count", "inner")

    @property
    def count(self) -> int:
        return len(self.rows)


def test_a_dataclass_becomes_an_object_of_its_fields() -> None:
    assert json_values(Inner(side=Side.LEFT, share=0.5)) == {"side": "left", "share": 0.5}


def test_what_json_states_of_a_type_is_named_in_order() -> None:
    outer = Outer(inner=Inner(side=Side.LEFT, share=math.nan), rows=(3, 4), hidden=object())
    expected = {"rows": [3, 4], "count": 2, "inner": {"side": "left", "share": None}}
    assert json_values(outer) == expected
    assert list(json_values(outer)) == list(expected)


def test_arrays_numbers_and_places_are_plain_and_what_is_not_finite_is_null() -> None:
    found = json_values({"a": np.array([[1.0, np.inf]]), 2: np.int64(7), "p": Path("a/b")})
    assert found == {"a": [[1.0, None]], "2": 7, "p": "a/b"}
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert type(json_values(np.bool_(True))) is bool


@dataclass(frozen=True, kw_only=True)
class Bounded:
    inner: Inner | None
    note: str = ""
    later: bool = False
    rows: tuple[int, ...] = ()
    JSON_NAMES: ClassVar = ("share=inner.share", "note", "later", "rows")
    JSON_OPTIONAL: ClassVar = frozenset({"later", "rows"})


def test_what_lies_within_a_part_is_stated_and_null_where_the_part_is() -> None:
    inner = Inner(side=Side.LEFT, share=0.5)
    assert json_values(Bounded(inner=inner)) == {"share": 0.5, "note": ""}
    assert json_values(Bounded(inner=None)) == {"share": None, "note": ""}


def test_what_is_optional_is_stated_where_it_says_something() -> None:
    found = json_values(Bounded(inner=None, later=True, rows=(0,)))
    assert found == {"share": None, "note": "", "later": True, "rows": [0]}


def test_dates_are_iso_text_and_errors_state_their_parts() -> None:
    assert json_values(dt.date(2026, 5, 1)) == "2026-05-01"
    error = RefusedError("a", where="b", fix="c")
    assert json_values(error) == {"kind": "refused", "what": "a", "where": "b", "fix": "c"}


def test_a_type_without_a_form_is_refused() -> None:
    with pytest.raises(TypeError, match="no form of complex"):
        json_values({"z": 1j})
