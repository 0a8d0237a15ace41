"""Lakes of older formats stay readable and writable; lakes of newer ones are refused by their
version."""

from __future__ import annotations

import json
import tarfile
from datetime import UTC, datetime, timedelta
from pathlib import Path

import deltalake
import numpy as np
import pyarrow as pa
import pytest

from flagdata.core.findings import Severity
from flagdata.core.schema import CATALOG, FORMAT_VERSION, Kind, catalog_schema
from flagdata.errors import ConflictError
from flagdata.lake import (
    Artifact,
    Lake,
    MeshSequence,
    collect,
    doctor,
    object_names,
    read_meshes,
    verify,
    verify_catalog,
)
from flagdata.record import Record
from tests.flagdata.lake.conftest import put_older_ref

ARCHIVES = sorted(Path(__file__).parent.glob("lake_v*.tar.xz"))
NOW = timedelta(0)


@pytest.fixture(params=ARCHIVES, ids=lambda path: path.name.partition(".")[0])
def old(request: pytest.FixtureRequest, tmp_path: Path) -> Lake:
    """A lake as an older version wrote it; see make_lake.py for what is in it."""
    with tarfile.open(request.param) as archive:
        archive.extractall(tmp_path, filter="data")
    return Lake.open(tmp_path / "lake")


def test_there_is_an_archive_of_every_format_version() -> None:
    assert [path.name for path in ARCHIVES] == [
        f"lake_v{i + 1}.tar.xz" for i in range(FORMAT_VERSION)
    ]


def test_an_old_lake_is_whole(old: Lake) -> None:
    assert doctor(old, grace=NOW) == ()
    assert verify(old, object_names(old)) == ()
    assert {(f.kind, f.severity) for f in verify_catalog(old)} <= {
        ("catalog-unhashed", Severity.NOTE)
    }


def test_an_old_lake_shows_its_rows_at_each_ref(old: Lake) -> None:
    assert old.rows(at="v1")["name"].to_pylist() == ["field", "field clip 0"]
    assert old.rows(at="simulated")["name"].to_pylist() == ["field", "field clip 0", "square"]
    measurements = [f"measurement {i}" for i in range(30)]
    assert old.rows()["name"].to_pylist() == ["field", "field clip 0", *measurements]
    assert old.rows("kind = 'clip' and wind between 4 and 5", at="v1")[
        "wind_sigma"
    ].to_pylist() == [0.25]


def test_rows_of_an_old_lake_have_the_identity_they_had(old: Lake) -> None:
    for row in old.rows(at="simulated").to_pylist():
        assert Artifact.from_row(row).id == row["artifact"]
    clip = old.artifact(old.rows("kind = 'clip'")["artifact"][0].as_py())
    assert clip.parents == (clip.recording,)
    assert clip.quality == ("low-coverage",)


def test_the_objects_of_an_old_lake_are_read(old: Lake) -> None:
    rows = old.rows("object is not null", at="simulated").to_pylist()
    record = Record.open(old.object_path(rows[0]["object"]))
    assert len(record.frame_times) == 40
    # frame 12 is gray 60 everywhere; JPEG keeps a flat image within a step
    assert np.abs(record.frames(12, 1).astype(int) - 60).max() <= 1
    wind = record.wind()
    assert wind is not None
    assert wind.channels["wind_speed"][-1] == pytest.approx(
        5.75, abs=1e-6
    )  # stored as float32 or wider
    meshes = read_meshes(old.object_path(rows[2]["object"]))
    assert isinstance(meshes, MeshSequence)
    assert meshes.positions.ravel().tolist() == list(range(36))
    assert meshes.attributes == {"wind": 4.0}


def test_rows_of_an_old_lake_are_of_a_data_set_where_their_format_could_say_so(old: Lake) -> None:
    for row in old.rows(at="v1").to_pylist():
        stated = ("compat", "train") if row["format_version"] >= 3 else (None, None)
        assert (row["dataset"], row["side"]) == stated


def test_an_old_lake_takes_new_rows_and_its_tags_stay(old: Lake) -> None:
    with old.transaction("new") as tx:
        assert tx.add(Artifact(kind=Kind.MODEL, name="new"))
    assert old.rows()["name"].to_pylist()[-1] == "new"
    assert old.rows(at="v1").num_rows == 2
    collect(old, grace=NOW)
    assert doctor(old, grace=NOW) == ()


@pytest.fixture
def narrow(tmp_path: Path) -> Lake:
    """A lake whose catalog was made before the columns `wind_staleness`, `clock_model` and `report`
    existed."""
    early = Artifact(kind=Kind.WIND, name="early", created=datetime(2020, 1, 1, tzinfo=UTC))
    return lake_without(tmp_path / "narrow", {"wind_staleness", "clock_model", "report"}, early)


def lake_without(path: Path, missing: set[str], *artifacts: Artifact) -> Lake:
    """A lake with these rows, tagged v1, whose catalog was made before some columns existed."""
    lake = Lake.create(path)
    table = lake.path / "catalog"
    for path in sorted(table.rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    schema = pa.schema([f for f in catalog_schema() if f.name not in missing])
    deltalake.DeltaTable.create(str(table), schema)
    rows = pa.Table.from_pylist([artifact.row() for artifact in artifacts], schema=schema)
    deltalake.write_deltalake(str(table), rows, mode="append")
    put_older_ref(Lake.open(lake.path), "tags", "v1")
    return Lake.open(lake.path)


def test_columns_that_a_catalog_did_not_have_yet_read_as_null(narrow: Lake) -> None:
    rows = narrow.rows()
    assert rows.schema.equals(catalog_schema(), check_metadata=True)
    assert rows.select(["name", "report", "wind_staleness"]).to_pylist() == [
        {"name": "early", "report": None, "wind_staleness": None}
    ]
    assert doctor(narrow, grace=NOW) == ()


def test_the_first_commit_adds_the_missing_columns_and_the_tag_still_shows_the_old_rows(
    narrow: Lake,
) -> None:
    with narrow.transaction("late") as tx:
        tx.add(Artifact(kind=Kind.WIND, name="late", recipe={"late": True}, report="[]"))
    assert narrow.rows(columns=["name", "report"]).to_pylist() == [
        {"name": "early", "report": None},
        {"name": "late", "report": "[]"},
    ]
    assert narrow.rows(at="v1", columns=["name", "report"]).to_pylist() == [
        {"name": "early", "report": None}
    ]
    assert doctor(Lake.open(narrow.path), grace=NOW) == ()


def test_films_built_before_the_catalog_had_data_sets_are_found_by_theirs_before_and_after_a_commit(
    tmp_path: Path,
) -> None:
    films = [
        Artifact(kind=Kind.RECORDING, name=name, seed=seed, recipe={"film": 2}, format_version=2)
        for seed, name in enumerate(("X-train-00000", "X-train-test-00000", "X-test-00000"))
    ]
    lake = lake_without(tmp_path / "built", {"dataset", "side"}, *films)
    wanted = {"dataset": "X", "side": "train"}
    assert lake.rows(wanted)["name"].to_pylist() == ["X-train-00000"]
    assert lake.rows("dataset = 'X-train'")["name"].to_pylist() == ["X-train-test-00000"]
    with lake.transaction("late") as tx:
        tx.add(Artifact(kind=Kind.WIND, name="late"))
    assert lake.rows(wanted)["name"].to_pylist() == ["X-train-00000"]
    assert doctor(lake, grace=NOW) == ()


def test_a_withdrawal_from_a_narrow_catalog_leaves_the_rest(narrow: Lake) -> None:
    with narrow.transaction("late") as tx:
        tx.add(Artifact(kind=Kind.WIND, name="late", recipe={"late": True}))
    narrow.withdraw(
        [narrow.artifact(narrow.rows("name = 'early'")["artifact"][0].as_py()).id], "test"
    )
    assert narrow.rows()["name"].to_pylist() == ["late"]


def test_a_lake_of_a_newer_format_is_refused_by_its_version(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    marker = lake.path / "lake.json"
    content = json.loads(marker.read_text())
    content["format_version"] = FORMAT_VERSION + 1
    marker.write_text(json.dumps(content))
    with pytest.raises(ConflictError, match=f"format {FORMAT_VERSION + 1}.*install the newer"):
        Lake.open(lake.path)


def test_a_catalog_with_columns_this_version_does_not_know_is_refused_by_their_names(
    tmp_path: Path,
) -> None:
    lake = Lake.create(tmp_path / "lake")
    with lake.transaction("one") as tx:
        tx.add(Artifact(kind=Kind.MODEL, name="m"))
    table = deltalake.DeltaTable(str(lake.path / "catalog"))
    table.alter.add_columns([deltalake.Field("humidity", "double")])
    fresh = Lake.open(lake.path)
    with pytest.raises(ConflictError, match="humidity"):
        fresh.rows()
    with pytest.raises(ConflictError, match="humidity"), fresh.transaction("two"):
        pass


def test_a_column_of_a_later_format_may_be_null_in_older_rows() -> None:
    for name, field in CATALOG.items():
        assert 1 <= field.since <= FORMAT_VERSION, name
        assert field.since == 1 or field.nullable, name
