"""Labels where branches come together: merged name by name, refused where that is not right, never
unreadable."""

from __future__ import annotations

import json
import shlex
from typing import Any

import pytest

from flagdata.core.schema import catalog_schema
from flagdata.errors import ConflictError
from flagdata.lake import Lake, columns, doctor, is_healthy, labels_of, select
from flagdata.lake.lineage import LABELS
from tests.flagdata.lake.conftest import put_text
from tests.program import invoke


def labels(lake: Lake, at: str | None = None) -> dict[str, dict[str, Any]]:
    """The labels of each artifact, by its name."""
    rows = lake.rows(at=at)
    names = dict(zip(rows["artifact"].to_pylist(), rows["name"].to_pylist(), strict=True))
    return {names[artifact]: values for artifact, values in labels_of(rows).items()}


@pytest.fixture
def forked(lake: Lake) -> tuple[Lake, str, str]:
    """A lake with two rows and a branch `side`; the ids of the rows."""
    one, two = put_text(lake, "one"), put_text(lake, "two")
    lake.label([one.id], {"n": 1, "kept": "as it was"}, "before the branch")
    lake.branch("side")
    return lake, one.id, two.id


@pytest.mark.parametrize(
    ("here", "there", "merged"),
    [
        ([], [2], 2),
        ([2], [], 2),
        ([2], [2], 2),
        ([3, 1], [2], 2),
        ([2], [3, 1], 2),
        ([None], [], None),
        ([], [None], None),
        ([True], [], True),
    ],
)
def test_what_one_branch_changed_counts(
    forked: tuple[Lake, str, str], here: list[Any], there: list[Any], merged: Any
) -> None:
    lake, one, _ = forked
    for value in here:
        lake.label([one], {"n": value}, "on main")
    for value in there:
        lake.label([one], {"n": value}, "on side", branch="side")
    put_text(lake, "new", branch="side")
    lake.merge("side", "all of it")
    found = labels(lake)["one"]
    assert (found.get("n"), type(found.get("n"))) == (merged, type(merged))
    assert found["kept"] == "as it was"
    assert lake.merge("main", "and back", into="side").added == ()
    assert labels(lake, "side") == labels(lake)


@pytest.mark.parametrize(
    ("here", "there"), [(2, 3), (2, None), (None, 3), (True, "red"), ("a b", "it's")]
)
def test_what_both_changed_is_refused_until_they_agree_as_the_remedy_says(
    forked: tuple[Lake, str, str], here: Any, there: Any
) -> None:
    lake, one, _ = forked
    lake.label([one], {"n": here}, "on main")
    lake.label([one], {"n": there}, "on side", branch="side")
    head = lake.catalog.head()
    with pytest.raises(ConflictError, match="both branches changed the label n") as refused:
        lake.merge("side", "all of it")
    assert lake.catalog.head() == head
    command = shlex.split(str(refused.value.fix).partition(": ")[2].partition("; then")[0])
    assert command[:2] == ["flagdata", "label"]
    assert invoke(*command[1:], "--lake", lake.path).code == 0
    lake.merge("side", "all of it")
    assert labels(lake)["one"].get("n") == here


def test_two_names_that_are_one_column_are_refused_with_what_takes_one_off(
    forked: tuple[Lake, str, str],
) -> None:
    lake, one, two = forked
    lake.label([one], {"note": "a"}, "on main")
    lake.label([two], {"Note": "b"}, "on side", branch="side")
    with pytest.raises(ConflictError, match="one column in SQL") as refused:
        lake.merge("side", "both")
    command = shlex.split(str(refused.value.fix).partition("; ")[2].partition(" takes")[0])
    assert invoke(*command[1:], "--lake", lake.path).code == 0
    lake.merge("side", "one of them")
    assert (
        len({name for values in labels(lake).values() for name in values if name.lower() == "note"})
        == 1
    )
    assert invoke("ls", "--lake", lake.path).code == 0


def test_values_of_two_types_are_refused_with_what_takes_one_off(
    forked: tuple[Lake, str, str],
) -> None:
    lake, _, two = forked
    lake.label([two], {"n": None}, "not here")
    lake.branch("texts", at="0")
    three = put_text(lake, "three", branch="texts")
    lake.label([three.id], {"n": "three"}, "a text", branch="texts")
    with pytest.raises(ConflictError, match=r"n is a .* on some artifacts") as refused:
        lake.merge("texts", "both")
    commands = str(refused.value.fix).partition("; ")[2].partition(" takes")[0].split(" and ")
    for command in commands:
        assert invoke(*shlex.split(command)[1:], "--lake", lake.path).code == 0
    lake.merge("texts", "one of them")
    assert select(lake, columns=["label_n"]).num_rows == 3


def test_an_artifact_that_comes_anew_begins_without_labels(forked: tuple[Lake, str, str]) -> None:
    lake, one, two = forked
    lake.withdraw([one], "wrong")
    lake.label([two], {"n": "a text now"}, "no number is shown any more")
    put_text(lake, "one")
    assert labels(lake) == {"two": {"n": "a text now"}}


def test_labels_that_an_earlier_version_let_come_together_are_read_and_can_be_put_right(
    forked: tuple[Lake, str, str],
) -> None:
    lake, one, two = forked
    three = put_text(lake, "three")
    noted = {one: {"note": "a", "n": 1}, two: {"Note": "b", "n": "two"}, three.id: {"NOTE": True}}
    info = {"message": "m", "branch": "main", LABELS: json.dumps(noted)}
    lake.catalog.append(catalog_schema().empty_table(), base=lake.catalog.head(), info=info)
    found = columns(lake.rows())
    assert {name: values.to_pylist() for name, values in found.items() if name != "label_kept"} == {
        "label_NOTE": [None, None, True],
        "label_Note_2": [None, "b", None],
        "label_note_3": ["a", None, None],
        "label_n": ["1", "two", None],
    }
    for command in (["ls"], ["query", "--where", "label_n = '1'"], ["verify"]):
        assert invoke(*command, "--lake", lake.path).code == 0
    kinds = {finding.kind for finding in doctor(lake)}
    assert kinds == {"labels-clash"}
    lake.tag("v9")
    put_text(lake, "more")
    lake.label([two], {"Note": None, "n": 2}, "one step")
    lake.label([three.id], {"NOTE": None}, "another")
    assert is_healthy(doctor(lake))
    with pytest.raises(ConflictError):
        lake.label([two], {"Note": "again"}, "no longer")
