"""What holds for every export format: a folder that is whole or absent, a manifest that is true,
refusals."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import signal
import subprocess
import sys
from datetime import timedelta
from pathlib import Path
from typing import Any

import polars as pl
import pyarrow as pa
import pytest

from flagdata.core.files.outputs import fresh_folder
from flagdata.core.schema import Kind, catalog_schema
from flagdata.errors import ConflictError, CorruptError, NotFoundError, UsageError
from flagdata.export import FORMATS, Export, export
from flagdata.export.export_source import ExportRows
from flagdata.lake import Artifact, Lake, doctor

CLIPS = "kind = 'clip'"
FILMED_FORMATS = [name for name in FORMATS if Kind.CLIP in Export(format=name).exporter().kinds]


@pytest.mark.parametrize("name", FILMED_FORMATS)
def test_the_manifest_names_every_file_with_its_hash(name: str, known: Any, tmp_path: Path) -> None:
    result = export(known.lake, Export(format=name, where=CLIPS), tmp_path / "out")
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest == result.manifest
    listed = {file["path"]: (file["bytes"], file["sha256"]) for file in manifest["files"]}
    found = {
        path.relative_to(tmp_path / "out").as_posix(): (
            path.stat().st_size,
            hashlib.sha256(path.read_bytes()).hexdigest(),
        )
        for path in (tmp_path / "out").rglob("*")
        if path.is_file() and path.name != "manifest.json"
    }
    assert listed == found
    assert (manifest["format"], manifest["where"], manifest["artifacts"]) == (name, CLIPS, 3)
    assert manifest["version"] == known.lake.resolve(None)
    assert manifest["kinds"] == {"clip": 3}
    assert {"schema", "recipe_hash", "code_version", "options"} <= set(manifest)


@pytest.mark.parametrize("name", FILMED_FORMATS)
def test_exporting_the_same_version_again_gives_the_same_bytes_and_progress_counts_every_artifact_once(
    name: str, known: Any, tmp_path: Path
) -> None:
    """The manifest states the hash of each file."""
    request = Export(
        format=name, where=CLIPS, options={"frames": "jpg"} if name == "parquet" else {}
    )
    manifests = []
    for folder in ("a", "b"):
        done: list[int] = []
        export(known.lake, request, tmp_path / folder, advance=done.append)
        manifests.append((tmp_path / folder / "manifest.json").read_bytes())
        assert sum(done) == 3
    assert manifests[0] == manifests[1]


def test_a_folder_that_is_there_is_left_alone(known: Any, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("mine")
    with pytest.raises(ConflictError, match="exists"):
        export(known.lake, Export(format="parquet"), tmp_path / "out")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["mine.txt"]


def test_a_failed_export_leaves_nothing_behind(tmp_path: Path) -> None:
    def interrupted() -> None:
        with fresh_folder(tmp_path / "out") as folder:
            (folder / "half.tar").write_bytes(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert list(tmp_path.iterdir()) == []


def test_a_killed_export_leaves_no_target_and_does_not_hinder_the_next(
    known: Any, tmp_path: Path
) -> None:
    code = """
import os, signal, sys
from pathlib import Path
from flagdata.export import Export, export
from flagdata.lake import Lake

done = []
def advance(count):
    done.append(count)
    if len(done) == 2:
        os.kill(os.getpid(), signal.SIGKILL)

export(Lake.open(sys.argv[1]), Export(format="mcap", where="kind = 'clip'"), Path(sys.argv[2]), advance=advance)
"""
    killed = subprocess.run(
        [sys.executable, "-c", code, str(known.lake.path), str(tmp_path / "out")], check=False
    )
    assert killed.returncode == -signal.SIGKILL
    assert not (tmp_path / "out").exists()
    export(known.lake, Export(format="mcap", where=CLIPS), tmp_path / "out")
    assert len(list((tmp_path / "out").glob("*.mcap"))) == 3


def test_a_target_made_meanwhile_is_not_replaced(tmp_path: Path) -> None:
    def raced() -> None:
        with fresh_folder(tmp_path / "out") as folder:
            (folder / "file").write_bytes(b"x")
            (tmp_path / "out").mkdir()
            (tmp_path / "out" / "mine.txt").write_text("mine")

    with pytest.raises(ConflictError):
        raced()
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["mine.txt"]


@pytest.mark.parametrize(
    ("name", "options"),
    [("webdataset", {}), ("mp4", {}), ("mcap", {}), ("parquet", {"frames": "jpg"})],
)
def test_rows_that_a_format_cannot_hold_are_refused_with_the_filter_to_write(
    name: str, options: dict[str, str], tmp_path: Path
) -> None:
    lake = Lake.create(tmp_path / "lake")
    with lake.transaction("a model") as tx:
        tx.add(Artifact(kind=Kind.MODEL, name="regressor"))
    with pytest.raises(UsageError, match="1 of kind model") as caught:
        export(lake, Export(format=name, options=options), tmp_path / "out")
    assert re.search("kind (= '|in \\(')", caught.value.fix)


@pytest.mark.parametrize("name", ["webdataset", "mp4", "mcap"])
def test_bytes_that_have_changed_in_the_lake_do_not_leave_it(
    name: str, known: Any, tmp_path: Path
) -> None:
    shutil.copytree(known.lake.path, tmp_path / "lake")
    lake = Lake.open(tmp_path / "lake")
    stored = lake.object_path(lake.artifact(known.recording).object or "")
    data = bytearray(stored.read_bytes())
    data[data.index(known.jpegs[45]) + 200] ^= 1  # one bit of one frame
    stored.chmod(0o644)
    stored.write_bytes(data)
    with pytest.raises(CorruptError, match="changed"):
        export(lake, Export(format=name, where=CLIPS), tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["lake"]


NO_IDS = (
    "../elsewhere",
    "/elsewhere",
    "a/b",
    "..",
    ".hidden",
    "-x",
    "",
    "index",
    "a\nb",
    "A" * 32,
    "a" * 300,
    None,
)
"""What a catalog of somebody else may state in place of an id; files would be called by it."""


@pytest.mark.parametrize("name", FORMATS)
def test_an_id_that_could_name_a_file_elsewhere_leaves_no_lake(
    name: str, known: Any, tmp_path: Path
) -> None:
    row = known.lake.artifact(known.recording).row() | {
        "kind": min(Export(format=name).exporter().kinds).value
    }
    table = known.lake.rows()
    for identity in NO_IDS:
        rows = pa.concat_tables(
            [table, pa.Table.from_pylist([row | {"artifact": identity}], schema=table.schema)]
        )
        with pytest.raises(CorruptError, match="is not the id of an artifact") as error:
            ExportRows(lake=known.lake, rows=rows)
        assert repr(identity) in error.value.what

    shutil.copytree(known.lake.path, tmp_path / "lake")
    lake = Lake.open(tmp_path / "lake")
    odd = pa.Table.from_pylist(
        [row | {"artifact": "../elsewhere", "name": "odd"}], schema=catalog_schema()
    )
    lake.catalog.append(
        odd, base=lake.catalog.head(), info={"commit": "c" * 17, "branch": "main", "rows": "1"}
    )
    with pytest.raises(CorruptError, match="is not the id of an artifact"):
        export(lake, Export(format=name, where="name = 'odd'"), tmp_path / "out" / "of it")
    assert [path.name for path in tmp_path.iterdir()] == ["lake"]
    assert "row-malformed" in {finding.kind for finding in doctor(lake, grace=timedelta(0))}


@pytest.mark.parametrize("name", FORMATS)
def test_an_artifact_that_a_catalog_has_twice_leaves_no_lake(
    name: str, known: Any, tmp_path: Path
) -> None:
    shutil.copytree(known.lake.path, tmp_path / "lake")
    lake = Lake.open(tmp_path / "lake")
    row = known.lake.artifact(known.recording).row() | {
        "kind": min(Export(format=name).exporter().kinds).value
    }
    twice = row | {"artifact": "0" * 32, "name": "twice"}
    rows = pa.Table.from_pylist([twice, twice | {"object_bytes": 1}], schema=catalog_schema())
    lake.catalog.append(
        rows, base=lake.catalog.head(), info={"commit": "c" * 17, "branch": "main", "rows": "2"}
    )
    with pytest.raises(CorruptError, match=f"two rows have the identity {'0' * 32} in the catalog"):
        export(lake, Export(format=name, where="name = 'twice'"), tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["lake"]
    assert "identity-twice" in {finding.kind for finding in doctor(lake, grace=timedelta(0))}


def test_nothing_to_export_is_an_error(known: Any, tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="no rows match"):
        export(known.lake, Export(format="parquet", where="wind > 100"), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_filter_by_a_value_that_no_row_has_names_the_nearest(known: Any, tmp_path: Path) -> None:
    for where, said in {
        "kind = 'clpi'": "no row has kind 'clpi'; did you mean 'clip'",
        "wind > 0 and name='it''s'": "no row has name 'it''s'".replace("''", "'"),
    }.items():
        with pytest.raises(NotFoundError) as refused:
            export(known.lake, Export(format="parquet", where=where), tmp_path / "out")
        assert said in str(refused.value.fix).replace('"', "'")


def test_an_export_at_a_tag_does_not_see_later_rows(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    for number in range(2):
        with lake.transaction(f"model {number}") as tx:
            tx.add(Artifact(kind=Kind.MODEL, name=f"model {number}", seed=number))
        if number == 0:
            lake.tag("first")
    manifest = export(lake, Export(format="parquet", at="first"), tmp_path / "out").manifest
    assert pl.read_parquet(tmp_path / "out" / "rows" / "*.parquet")["name"].to_list() == ["model 0"]
    assert manifest["at"] == "first"
