"""A catalog whose JSON columns are nested deeper than any parser goes is refused by the row's name,
by every reader."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import pyarrow as pa
import pytest

from flagdata.core.schema import Kind, catalog_schema
from flagdata.dataset import COLUMNS, PairTable
from flagdata.errors import CorruptError, InputError
from flagdata.export.export_source import Entry
from flagdata.lake import Artifact, Lake, doctor, with_data_sets
from flagdata.record import Record
from tests.program import invoke

DEEP = "[" * 100_000 + "]" * 100_000


def row(kind: Kind, column: str) -> dict[str, Any]:
    artifact = Artifact(kind=kind, name="train-train-00001", source_hash="1" * 64, seed=3)
    return {**artifact.row(), "branch": "main", "format_version": 1, column: DEEP}


@pytest.mark.parametrize("column", ["parameters", "clock_model", "report"])
def test_an_artifact_takes_no_nested_column(column: str) -> None:
    given: dict[str, Any] = {column: DEEP}
    with pytest.raises(InputError, match="deep"):
        Artifact(kind=Kind.WIND, name="log", **given)


@pytest.mark.parametrize("column", ["recipe", "parameters"])
def test_a_nested_row_is_refused_by_its_name(column: str) -> None:
    with pytest.raises((CorruptError, InputError), match="deep"):
        Artifact.from_row(row(Kind.WIND, column))


def test_older_films_pairs_and_labels_name_the_row() -> None:
    film = row(Kind.RECORDING, "recipe")
    clip = {
        **row(Kind.CLIP, "parameters"),
        "object": f"mcap/{'0' * 64}.mcap",
        "frame_first": 0,
        "frame_count": 1,
        "start": 0,
        "end": 1,
    }
    readers = [
        lambda: with_data_sets(pa.Table.from_pylist([film], schema=catalog_schema())),
        lambda: PairTable.of(pa.Table.from_pylist([clip], schema=catalog_schema()).select(COLUMNS)),
        lambda: Entry(row=clip, record=cast("Record", None), first=0, count=1).parameters,
    ]
    for read, where in zip(readers, (film, clip, clip), strict=True):
        with pytest.raises(CorruptError, match="deep") as caught:
            read()
        assert str(where["artifact"]) in str(caught.value.where)


@pytest.mark.parametrize(
    "arguments", [("ls",), ("show", "train-train-00001"), ("show", "train-train-00001", "--json")]
)
def test_commands_on_a_nested_row_end_with_an_error_that_names_it(
    arguments: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    artifact = Artifact(kind=Kind.WIND, name="train-train-00001", source_hash="1" * 64)
    stated = Artifact.row
    monkeypatch.setattr(
        Artifact, "row", lambda self: {**stated(self), "report": DEEP}
    )  # as another program may write
    with Lake.create(tmp_path / "lake").transaction("made by another program") as transaction:
        transaction.add(artifact)
    ended = invoke(*arguments, "--lake", tmp_path / "lake")
    error = ended.err + ended.out * ("--json" in arguments)
    assert ended.code == 1
    assert "deep" in error
    assert "unforeseen" not in error
    assert artifact.id in error or artifact.name in error


@pytest.mark.parametrize("column", ["recipe", "report"])
def test_a_nested_row_is_withdrawn_as_doctor_says(
    column: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    artifact = Artifact(kind=Kind.WIND, name="log", source_hash="1" * 64)
    stated = Artifact.row
    monkeypatch.setattr(Artifact, "row", lambda self: {**stated(self), column: DEEP})
    lake = Lake.create(tmp_path / "lake")
    with lake.transaction("made by another program") as transaction:
        transaction.add(artifact)
    (found,) = doctor(lake)
    assert (found.kind, "withdraw" in str(found.fix)) == ("row-malformed", True)
    ended = invoke("withdraw", artifact.id[:12], "-m", "malformed", "--lake", lake.path)
    assert ended.code == 0, ended.err
    assert not doctor(Lake.open(lake.path))
