"""Films that were built before the catalog had the columns `dataset` and `side` are of the set and
side they state."""

from __future__ import annotations

from dataclasses import replace

import pyarrow as pa

from flagdata.core.schema import Kind, catalog_schema
from flagdata.lake import Artifact, with_data_sets


def catalog(*artifacts: Artifact) -> pa.Table:
    return pa.Table.from_pylist([artifact.row() for artifact in artifacts], schema=catalog_schema())


def film(name: str, *, format_version: int = 2, **changes: object) -> Artifact:
    """A film as `flagdata build` committed it until format 2."""
    own = Artifact(
        kind=Kind.RECORDING,
        name=name,
        seed=3,
        recipe={"film": 2, "begin": 0},
        format_version=format_version,
    )
    return replace(own, **changes)


def sides(table: pa.Table) -> list[tuple[str | None, str | None]]:
    return [(row["dataset"], row["side"]) for row in table.to_pylist()]


CALLED = {
    "X-train-00000": ("X", "train"),
    "X-train-train-00012": ("X-train", "train"),
    "X-train-test-00003": ("X-train", "test"),
    "o'brien-validation-100000": ("o'brien", "validation"),
    "100%-test-00000": ("100%", "test"),
}


def test_a_film_and_its_clips_are_of_what_it_is_called_after() -> None:
    for name, stated in CALLED.items():
        own = film(name)
        clip = Artifact(
            kind=Kind.CLIP, name=name, recording=own.id, parents=(own.id,), seed=3, format_version=2
        )
        rows = with_data_sets(catalog(Artifact(kind=Kind.MESHES, name=name, seed=3), clip, own))
        assert sides(rows) == [(None, None), stated, stated], name
        assert rows.schema.equals(catalog_schema(), check_metadata=True)


def test_what_no_build_made_is_of_no_data_set() -> None:
    others = [
        film("X-train-00000", recipe={"cloth": {}}),  # an aligned recording that a user called so
        film("X-train-00000", seed=None),
        film("X-train-00000", kind=Kind.CAMERA),
        film("X-train-7"),
        film("X-hold-00000"),
        film("-train-00000"),
        film("X-train-00000", format_version=3),  # by then a film of a data set has the columns
    ]
    assert [
        other for other in others if sides(with_data_sets(catalog(other))) != [(None, None)]
    ] == []


def test_what_the_columns_say_stays() -> None:
    kept = film("X-train-00000", format_version=3, dataset="Y", side="test")
    assert sides(with_data_sets(catalog(kept, film("X-train-00001")))) == [
        ("Y", "test"),
        ("X", "train"),
    ]
