"""A side that rows state is their side: what is taken, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pyarrow as pa
import pytest

from flagdata.core.schema import Kind, catalog_schema
from flagdata.dataset import ExplicitSplit, HashedSplit
from flagdata.dataset.sides import Division, clips_of, divide, select_columns, stated_sides
from flagdata.errors import RefusedError, UnknownNameError
from flagdata.lake import Artifact

COUNTS = {"train": 3, "validation": 2, "test": 2}


def film(number: int, **columns: Any) -> list[Artifact]:
    """A recording of a day of its own, and its two clips."""
    day = {"day": f"2026-05-{number + 1:02d}"} if "seed" not in columns else {}
    recording = Artifact(
        kind=Kind.RECORDING, name=f"film {number}", recipe={"number": number}, **{**day, **columns}
    )
    clips = [
        replace(
            recording,
            kind=Kind.CLIP,
            parents=(recording.id,),
            recording=recording.id,
            frame_first=30 * k,
        )
        for k in range(2)
    ]
    return [recording, *clips]


def data_set(name: str = "made", first: int = 0, **columns: Any) -> list[Artifact]:
    rows: list[Artifact] = []
    for side, count in COUNTS.items():
        for _ in range(count):
            rows += film(first, dataset=name, side=side, **columns)
            first += 1
    return rows


def catalog(*rows: Artifact) -> pa.Table:
    return pa.Table.from_pylist([row.row() for row in rows], schema=catalog_schema())


def of(rows: list[Artifact], where: Any = None, split_by: Any = None) -> Division:
    table = catalog(*rows)
    return divide(table, clips_of(table, where), split_by, hashed=HashedSplit())


def test_each_clip_is_on_the_side_that_it_states() -> None:
    rows = data_set()
    found = of(rows)
    clips = [row for row in rows if row.kind is Kind.CLIP]
    assert found.rule == "stated"
    assert {side: set(on) for side, on in found.artifacts.items()} == {
        side: {clip.id for clip in clips if clip.side == side} for side in COUNTS
    }
    assert found.statement == {
        "rule": "stated",
        "datasets": ["made"],
        "sides": {
            side: {"clips": 2 * n, "recordings": n, "groups": n} for side, n in COUNTS.items()
        },
    }


def test_a_narrower_filter_moves_nothing_and_still_names_every_side() -> None:
    rows = data_set()
    whole, part = of(rows), of(rows, "day = '2026-05-06'")
    assert list(part.artifacts) == list(whole.artifacts) == list(COUNTS)
    assert part.on("train") == frozenset()
    assert len(part.on("test")) == 2
    assert part.on("test") < whole.on("test")


def test_a_recording_is_on_its_own_side_with_or_without_clips() -> None:
    rows = [row for row in data_set() if row.kind is Kind.RECORDING]
    table = catalog(*rows)
    assert (
        len(divide(table, select_columns(table), hashed=HashedSplit()).on("train"))
        == COUNTS["train"]
    )


def test_a_side_that_no_data_set_states_is_unknown() -> None:
    found = of(film(0, dataset="made", side="train") + film(1, dataset="made", side="test"))
    with pytest.raises(UnknownNameError, match="unknown split 'validation'"):
        found.on("validation")


def test_rows_that_state_a_side_and_rows_that_state_none_are_not_divided_together() -> None:
    rows = [*data_set(), *film(20), *film(21)]
    with pytest.raises(
        RefusedError, match=r"14 of 18 rows state a side, of 'made', and the others none"
    ) as refused:
        of(rows)
    assert "side is not null" in refused.value.fix
    assert of(rows, "side is not null").rule == "stated"
    assert of(rows, "side is null").rule == "hashed"


@pytest.mark.parametrize(
    "split_by", [HashedSplit(), HashedSplit(salt="x"), HashedSplit(fractions={"train": 1.0})]
)
def test_a_hashed_split_beside_stated_sides_is_refused_not_ignored(split_by: HashedSplit) -> None:
    with pytest.raises(
        RefusedError,
        match="'made' states the side of each row, and a hashed split is given beside it",
    ):
        of(data_set(), None, split_by)


@pytest.mark.parametrize(
    "where",
    [
        {"train": "day < '2026-05-06'", "test": "day >= '2026-05-06'"},
        {"train": {"dataset": "made", "side": "test"}},
        {"fit": "side = 'train'"},
    ],
)
def test_filters_that_take_a_clip_to_another_side_than_it_states_are_refused(where: Any) -> None:
    with pytest.raises(RefusedError, match="that state another side"):
        of(data_set(), None, ExplicitSplit(where=where))


def test_filters_may_name_the_stated_sides_and_divide_what_states_none() -> None:
    split = ExplicitSplit(
        where={"train": "side = 'train' or day = '2026-05-21'", "test": {"side": "test"}}
    )
    found = of([*data_set(), *film(20)], None, split)
    assert {side: len(on) for side, on in found.artifacts.items()} == {"train": 8, "test": 4}


@pytest.mark.parametrize("shared", [{"session": "barn"}, {"seed": 7}, {"day": "2026-05-01"}])
def test_relatives_on_two_sides_are_refused_whatever_is_selected(shared: dict[str, Any]) -> None:
    rows = [
        *film(0, dataset="made", side="train", **shared),
        *film(1, dataset="made", side="test", **shared),
        *film(2, dataset="made", side="test"),
        *film(3, dataset="other", side="test"),
    ]
    (tie,) = (f"{name} {value}" for name, value in shared.items())
    for where in (None, {"dataset": "made"}, "day = '2026-05-03'"):
        with pytest.raises(RefusedError, match=f"the split leaks: {tie} is in train and in test"):
            of(rows, where)
    assert of(rows, {"dataset": "other"}).rule == "stated"


def test_a_clip_on_another_side_than_its_recording_is_refused() -> None:
    recording, first, second = film(0, dataset="made", side="test")
    with pytest.raises(RefusedError, match=f"recording {recording.id} is in train and in test"):
        of([recording, replace(first, side="train"), second])


def test_one_camera_on_two_sides_is_refused() -> None:
    camera = Artifact(kind=Kind.CAMERA, name="camera", source_hash="a" * 64)
    rows = [
        *film(0, dataset="made", side="train", parents=(camera.id,)),
        *film(1, dataset="made", side="test", parents=(camera.id,)),
    ]
    with pytest.raises(RefusedError, match=r"camera a+ is in train and in test"):
        of([camera, *rows])


def test_films_of_one_folder_that_states_their_sides_are_no_relatives() -> None:
    """As the episodes of a LeRobot data set, whose hash all have in common."""
    rows: list[Artifact] = []
    for number, side in enumerate(["train", "train", "test"]):
        camera = Artifact(
            kind=Kind.CAMERA,
            name="set",
            source_hash="a" * 64,
            dataset="set",
            side=side,
            recipe={"episode": number},
            object=f"mcap/{number:064x}",
        )
        rows += [camera, *film(number, dataset="set", side=side, parents=(camera.id,))]
    found = of(rows)
    assert {side: size.groups for side, size in found.sizes.items()} == {"train": 1, "test": 1}


def test_what_a_hash_divides_is_no_relative_of_another_side() -> None:
    """A field recording of the session of a data set's test film cannot be learned from."""
    stated = film(0, dataset="made", side="kept", session="barn")
    field, other = film(1, session="barn"), film(2)
    with pytest.raises(RefusedError, match="session barn is in"):
        of([*stated, *field, *other], {"side": None})
    assert of([*stated, *field, *other], "day = '2026-05-03' and side is null").rule == "hashed"


def test_what_is_stated_is_described_even_where_relatives_are_on_two_sides() -> None:
    rows = [
        *film(0, dataset="made", side="train", session="barn"),
        *film(1, dataset="made", side="test", session="barn"),
    ]
    table = catalog(*rows, *film(2))
    found = stated_sides(table, select_columns(table))
    assert found is not None
    assert {side: size.clips for side, size in found.sizes.items()} == {"train": 2, "test": 2}
    assert stated_sides(table, select_columns(catalog(*film(2)))) is None
