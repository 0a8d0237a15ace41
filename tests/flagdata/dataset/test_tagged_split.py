"""A tag keeps how the clips of its version are divided, and a side of it is decided by that."""

from __future__ import annotations

import json
from typing import Any

import pytest

import flagdata
from flagdata.dataset import HashedSplit, tagged
from flagdata.errors import CorruptError
from flagdata.lake import Artifact, Lake
from tests.flagdata.dataset.test_stated_sides import COUNTS, data_set, film
from tests.program import invoke


def filled(lake: Lake, rows: list[Artifact]) -> Lake:
    with lake.transaction("films") as transaction:
        for row in rows:
            transaction.add(row)
    return lake


@pytest.fixture
def lake(lake_folder: Any) -> Lake:
    return Lake.create(lake_folder)


@pytest.fixture
def lake_folder(tmp_path: Any) -> Any:
    return tmp_path / "lake"


def note(lake: Lake, name: str) -> dict[str, Any]:
    return json.loads(lake.refs.tags()[name].notes[tagged.NOTE])


def test_a_tag_states_what_data_sets_state_and_what_a_hash_gives_the_others(lake: Lake) -> None:
    filled(lake, [*data_set(), *film(20), *film(21)])
    assert invoke("tag", "v1", "--lake", str(lake.path)).code == 0
    kept = note(lake, "v1")
    assert kept["stated"]["datasets"] == ["made"]
    assert {side: of["recordings"] for side, of in kept["stated"]["sides"].items()} == COUNTS
    assert (kept["hashed"]["salt"], kept["hashed"]["fractions"]) == (
        "",
        dict(HashedSplit().fractions),
    )
    assert sum(of["clips"] for of in kept["hashed"]["sides"].values()) == 4
    (listed,) = invoke("tag", "--json", "--lake", str(lake.path)).document["tags"]
    assert json.loads(listed["notes"]["split"]) == kept


def test_a_tag_of_a_call_and_of_a_branch_keeps_it_too_and_one_without_clips_keeps_nothing(
    lake: Lake,
) -> None:
    (empty,) = flagdata.tag("v0", lake=str(lake.path))
    assert empty.notes == {}
    lake.branch("trial")
    with lake.transaction("films", branch="trial") as transaction:
        for row in film(1):
            transaction.add(row)
    flagdata.tag("v1", lake=str(lake.path), at="trial")
    assert list(note(lake, "v1")) == ["hashed"]


def test_a_side_of_a_tag_is_decided_by_the_split_that_it_keeps(lake: Lake) -> None:
    """Whatever the usual shares become."""
    filled(lake, [row for number in range(12) for row in film(number)])
    kept = {"hashed": {"salt": "older", "fractions": {"test": 0.5, "train": 0.5}}}
    lake.tag("old", notes={tagged.NOTE: json.dumps(kept)})
    lake.tag("bare")
    source = flagdata.open(lake.path)
    sizes = source.sides(at="old")
    assert list(sizes) == ["test", "train"]
    assert sizes == source.sides(
        split_by=HashedSplit(salt="older", fractions={"test": 0.5, "train": 0.5})
    )
    assert source.sides(at="bare") == source.sides() == source.sides(split_by=HashedSplit())


@pytest.mark.parametrize(
    "text",
    ["[]", "{", '{"hashed": {"salt": ""}}', '{"hashed": {"salt": "", "fractions": {"a": 2}}}'],
)
def test_a_note_that_is_no_split_is_damage_and_named(lake: Lake, text: str) -> None:
    filled(lake, film(1))
    lake.tag("v1", notes={tagged.NOTE: text})
    with pytest.raises(CorruptError, match="the split that the tag keeps cannot be read"):
        flagdata.open(lake.path).sides(at="v1")
