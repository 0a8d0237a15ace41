"""The user's own columns: typed, versioned, in queries, pairs and exports, and none of an older
reader's business."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner
from deltalake import DeltaTable

from flagdata.cli import root
from flagdata.core.schema import CATALOG
from flagdata.dataset import Source
from flagdata.errors import ConflictError, NotFoundError, UnknownNameError, UsageError
from flagdata.export import Export, export
from flagdata.lake import Lake, given, select
from tests.flagdata.export.conftest import known as known
from tests.flagdata.lake.conftest import put_text


def test_a_value_is_a_number_a_truth_value_or_a_text() -> None:
    assert [
        given(text)[1]
        for text in ("a=4", "a=-0.5", "a=true", "a=red", 'a="5"', "a=", "a=2026-05-01")
    ] == [
        4,
        -0.5,
        True,
        "red",
        "5",
        None,
        "2026-05-01",
    ]
    for wrong in ("a", "=1", "1a=1", "a-b=1", "a=1e999", f"a={'9' * 400}"):
        with pytest.raises(UsageError):
            given(wrong)


def test_labels_are_columns_of_queries_with_their_type_and_of_their_version(lake: Lake) -> None:
    one, two = put_text(lake, "one"), put_text(lake, "two")
    lake.label([one.id], {"rating": 4, "colour": "red", "usable": True}, "looked at")
    lake.tag("v1")
    lake.label([one.id, two.id], {"rating": 2.5, "colour": None}, "again")
    rows = select(
        lake, "label_rating > 2", columns=["name", "label_rating", "label_usable"], order="name"
    ).to_pylist()
    assert rows == [
        {"name": "one", "label_rating": 2.5, "label_usable": True},
        {"name": "two", "label_rating": 2.5, "label_usable": None},
    ]
    before = select(
        lake, "label_colour = 'red'", at="v1", columns=["name", "label_rating"]
    ).to_pylist()
    assert before == [{"name": "one", "label_rating": 4.0}]
    with pytest.raises(UnknownNameError, match="label_colour"):
        select(lake, columns=["label_colour"])
    assert lake.rows("label_usable", columns=["name"])["name"].to_pylist() == ["one"]


def test_a_name_keeps_its_type_and_an_artifact_has_to_be_there(lake: Lake) -> None:
    one, two = put_text(lake, "one"), put_text(lake, "two")
    lake.label([one.id], {"rating": 4}, "a number")
    with pytest.raises(
        ConflictError,
        match="rating is a number on some artifacts, as 4, and a text on others, as 'good'",
    ):
        lake.label([two.id], {"rating": "good"}, "a text")
    lake.label([one.id], {"rating": "good"}, "the only one may change")
    with pytest.raises(NotFoundError):
        lake.label(["0" * 32], {"rating": "good"}, "absent")
    lake.withdraw([one.id], "wrong")
    lake.label([two.id], {"rating": 4}, "no artifact that is shown has a text any more")


def test_no_name_hides_another_or_leaves_its_column(lake: Lake) -> None:
    one, two = put_text(lake, "one"), put_text(lake, "two")
    lake.label([one.id], {"Cloth": 1}, "a capital")
    with pytest.raises(ConflictError, match="one column in SQL"):
        lake.label([two.id], {"cloth": 2}, "a small letter")
    lake.label([two.id], {"cloth": None}, "nothing to take off")
    for wrong in ({'a" FROM stored --': 1}, {"a": float("nan")}, {"a": "x" * 1001}):
        with pytest.raises(UsageError):
            lake.label([one.id], wrong, "of a program")
    assert select(lake, columns=["label_Cloth"], order="name").to_pylist() == [
        {"label_Cloth": 1.0},
        {"label_Cloth": None},
    ]


def test_labels_of_a_branch_stay_there_until_it_is_merged(lake: Lake) -> None:
    one = put_text(lake, "one")
    lake.branch("b")
    lake.label([one.id], {"rating": 4}, "on b", branch="b")
    assert select(lake, "label_rating = 4", at="b", columns=["name"]).num_rows == 1
    with pytest.raises(UsageError):
        select(lake, "label_rating = 4")
    put_text(lake, "new", branch="b")
    lake.merge("b", "rows and labels")
    assert select(lake, "label_rating = 4", columns=["name"])["name"].to_pylist() == ["one"]


def test_the_stored_catalog_stays_what_older_programs_read(lake: Lake) -> None:
    one = put_text(lake, "one")
    lake.label([one.id], {"rating": 4}, "looked at")
    table = DeltaTable(lake.catalog.path.as_uri(), storage_options=lake.catalog._errors.options)
    assert [field.name for field in table.schema().fields] == list(CATALOG)
    assert table.to_pyarrow_table().num_rows == 1


def test_clips_of_a_labelled_recording_are_pairs_with_its_numbers_and_exports_have_them(
    known: Any, tmp_path: Path
) -> None:
    lake = known.lake
    version = lake.catalog.head()
    lake.label([known.recording], {"rating": 4, "colour": "red", "usable": True}, "looked at")
    (pairs,) = [Source(lake).pairs("label_rating = 4 and frame_first = 0")]
    assert pairs[0].parameters["label.rating"] == 4
    assert pairs[0].parameters["label.usable"] == 1
    export(lake, Export(format="parquet", where="kind = 'clip'"), tmp_path / "rows")
    table = pq.read_table(tmp_path / "rows" / "rows")
    assert table["label_colour"].to_pylist() == ["red"] * 3
    assert table["label_rating"].to_pylist() == [4.0] * 3
    export(
        lake,
        Export(format="parquet", where="kind = 'clip'", options={"frames": "jpg"}),
        tmp_path / "frames",
    )
    assert pq.read_table(tmp_path / "frames" / "rows")["label_usable"].to_pylist() == [True] * 3
    export(
        lake, Export(format="parquet", where="kind = 'clip'", at=str(version)), tmp_path / "before"
    )
    assert pq.read_table(tmp_path / "before" / "rows").column_names == list(CATALOG)


def test_the_command_labels_by_name_and_show_prints_them(lake: Lake) -> None:
    put_text(lake, "one")
    run, where = CliRunner(), ["--lake", str(lake.path)]
    done = run.invoke(root, ["label", "one", "rating=4", "colour=red", *where])
    assert done.exit_code == 0, done.output
    shown = json.loads(run.invoke(root, ["show", "one", "--json", *where]).stdout)
    assert shown["labels"] == {"rating": 4, "colour": "red"}
    assert run.invoke(root, ["label", "one", *where]).exception is not None
