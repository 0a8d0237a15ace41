"""What is learned from, and what is judged: sides by the catalog's columns; nothing is on two of
them."""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import pyarrow as pa
import pytest

from flagdata.core.schema import Kind, catalog_schema
from flagdata.dataset import HashedSplit
from flagdata.dataset.sides import clips_of, divide
from flagdata.errors import InputError, NotFoundError, RefusedError, UnknownNameError
from flagdata.lake import Artifact, Lake
from models.evaluation.evaluate_command import refuse_learned
from models.training import DataSpec, parse
from tests.refusals import unrefused

SIDES = ("train", "validation", "test")
RECIPE = (
    '[data]\ndataset = {}\n[input]\nmaps = "wave-maps"\n[network]\nname = "wave"\n[loss]\ntargets '
    '= ["wind_speed"]\n'
)


def films(dataset: str, *, seed: int, sides: dict[str, int] | None = None) -> list[Artifact]:
    """A data set as a build leaves it: mesh sequences, a film of each, and its clip."""
    rows: list[Artifact] = []
    for side, count in (sides or {"train": 4, "validation": 2, "test": 3}).items():
        for index in range(count):
            seed += 1
            name = f"{dataset}-{side}-{index:05d}"
            sequence = Artifact(kind=Kind.MESHES, name=name, seed=seed, recipe={"of": dataset})
            film = Artifact(
                kind=Kind.RECORDING,
                name=name,
                parents=(sequence.id,),
                seed=seed,
                dataset=dataset,
                side=side,
                recipe={"film": 2, "seed": seed},
            )
            clip = replace(film, kind=Kind.CLIP, parents=(film.id,), recording=film.id)
            rows += [sequence, film, clip]
    return rows


def catalog(*rows: Artifact) -> pa.Table:
    return pa.Table.from_pylist([row.row() for row in rows], schema=catalog_schema())


def names(table: pa.Table, clips: Collection[str]) -> list[str]:
    return sorted(row["name"] for row in table.to_pylist() if row["artifact"] in clips)


@pytest.mark.parametrize(
    ("dataset", "other"),
    [
        ("X", "X-train"),
        ("X-train", "X"),
        ("o'brien", "o'brien-test"),
        ("100%", "1000"),
        ("a_b", "a-b"),
    ],
)
def test_a_side_is_that_of_its_own_data_set_alone_whatever_another_is_called(
    dataset: str, other: str
) -> None:
    table = catalog(*films(dataset, seed=0), *films(other, seed=100))
    division = divide(
        table, clips_of(table, DataSpec(datasets=(dataset,)).rows), hashed=HashedSplit()
    )
    taken = {side: names(table, division.on(side)) for side in SIDES}
    assert taken == {
        "train": [f"{dataset}-train-{k:05d}" for k in range(4)],
        "validation": [f"{dataset}-validation-{k:05d}" for k in range(2)],
        "test": [f"{dataset}-test-{k:05d}" for k in range(3)],
    }


def test_two_data_sets_are_learned_from_together() -> None:
    table = catalog(*films("X", seed=0), *films("X-train", seed=100), *films("other", seed=200))
    both = DataSpec(datasets=("X", "X-train")).rows
    assert len(divide(table, clips_of(table, both), hashed=HashedSplit()).on("train")) == 8


def shared(tie: str) -> list[Artifact]:
    """Two data sets that share one sequence, or one session, across sides, under different names
    and seeds."""
    ours, theirs = films("ours", seed=0), films("theirs", seed=100, sides={"test": 1})
    sequence, film, clip = theirs
    if tie == "meshes":
        film = replace(film, parents=(ours[0].id,))
    elif tie == "session":
        ours[0], sequence = replace(ours[0], session="barn"), replace(sequence, session="barn")
    else:
        ours[0], sequence = (replace(row, object=f"zarr/{'a' * 64}") for row in (ours[0], sequence))
    clip = replace(clip, parents=(film.id,), recording=film.id)
    return [*ours, sequence, film, clip]


@pytest.mark.parametrize("tie", ["meshes", "session", "object"])
def test_sides_that_share_a_sequence_are_refused_in_training_and_in_judging(tie: str) -> None:
    table = catalog(*shared(tie))
    both = DataSpec(datasets=("ours", "theirs"))
    with pytest.raises(RefusedError, match=f"{tie} .* is in train and in test"):
        divide(table, clips_of(table, both.rows), hashed=HashedSplit())
    with pytest.raises(RefusedError, match=f"{tie} .* is in test of theirs and in train of ours"):
        refuse_learned(table, [DataSpec(datasets=("ours",))], dataset="theirs", side="test")


def test_a_network_is_judged_by_films_that_it_did_not_learn_from_and_by_its_training_side_as_such() -> (
    None
):
    table = catalog(*films("ours", seed=0), *films("theirs", seed=100))
    ours = DataSpec(datasets=("ours",), sequences=2)
    for dataset, side in (
        ("ours", "test"),
        ("ours", "validation"),
        ("ours", "train"),
        ("theirs", "test"),
    ):
        refuse_learned(table, [ours], dataset=dataset, side=side)


def test_a_data_set_that_the_lake_lacks_is_named_with_the_nearest(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    with lake.transaction("one") as transaction:
        for row in films("flags", seed=0):
            transaction.add(row)
    with pytest.raises(UnknownNameError, match="unknown data set 'flag'; did you mean 'flags'"):
        DataSpec(datasets=("flags", "flag")).check(lake, at=None)
    DataSpec(datasets=("flags",)).check(lake, at=None)


def test_a_lake_without_a_data_set_names_the_command_that_builds_it(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match=r"no clips of a data set, .* 'flags'") as refused:
        DataSpec(datasets=("flags",)).check(Lake.create(tmp_path / "lake"), at=None)
    assert refused.value.fix == "build it first: flagdata build flags"


@pytest.mark.parametrize("name", ["o'brien", "100%", "my set", 'a "b"', "été"])
def test_a_recipe_names_any_data_set_that_can_be_built(name: str) -> None:
    recipe = parse(RECIPE.format(json.dumps(name, ensure_ascii=False)), name="r", where="r.toml")
    assert recipe.data.datasets == (name,)


def test_what_no_data_set_can_be_called_is_refused() -> None:
    cases = ['""', '" "', '"a\\nb"', "3", "[]", '["a", 3]', f'"{"a" * 101}"']
    assert (
        unrefused(
            lambda entry: parse(RECIPE.format(entry), name="r", where="r.toml"),
            zip(cases),
            InputError,
            "the data set is",
        )
        == []
    )
