"""Rows are selected by values, of which none is read as SQL."""

from __future__ import annotations

import pyarrow as pa
import pytest

from flagdata.core.schema import Kind, catalog_schema
from flagdata.errors import UnknownNameError, UsageError
from flagdata.lake import Artifact, Lake, Request, Selection
from flagdata.lake.matching import matching

NAMES = ("plain", "o'brien", "100%", "a_b", "x' or '1' = '1")
ROWS = [
    Artifact(kind=Kind.CLIP if k % 2 else Kind.WIND, name=name, seed=k if k < 3 else None)
    for k, name in enumerate(NAMES)
]
TABLE = pa.Table.from_pylist([row.row() for row in ROWS], schema=catalog_schema())


def test_a_name_finds_its_own_row_whatever_is_in_it() -> None:
    for name in NAMES:
        assert matching(TABLE, {"name": name})["name"].to_pylist() == [name]
        assert Selection(TABLE, Request(where={"name": name})).table()["name"].to_pylist() == [name]


def test_rows_have_all_of_the_values_and_one_of_several() -> None:
    wanted: list[tuple[dict[str, object], tuple[str, ...]]] = [
        ({}, NAMES),
        ({"kind": Kind.CLIP}, NAMES[1::2]),
        ({"kind": [Kind.CLIP, Kind.WIND]}, NAMES),
        ({"kind": (Kind.CLIP,), "seed": 1}, NAMES[1:2]),
        ({"seed": None}, NAMES[3:]),
        ({"seed": {None, 0}}, (NAMES[0], *NAMES[3:])),
        ({"name": []}, ()),
    ]
    assert [tuple(matching(TABLE, values)["name"].to_pylist()) for values, _ in wanted] == [
        rows for _, rows in wanted
    ]


def test_what_no_column_holds_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'recording'"):
        matching(TABLE, {"recordin": "a"})
    with pytest.raises(UsageError, match="seed cannot hold 'one'"):
        matching(TABLE, {"seed": "one"})


def test_a_lake_gives_its_rows_by_values(tmp_path) -> None:
    lake = Lake.create(tmp_path / "lake")
    with lake.transaction("two") as transaction:
        for row in ROWS[:2]:
            transaction.add(row)
    assert lake.rows({"name": "o'brien"}, columns=["seed"]).to_pylist() == [{"seed": 1}]
