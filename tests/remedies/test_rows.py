"""Remedies of rows of a catalog that were changed behind the lake's back."""

from __future__ import annotations

import hashlib
import shlex
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake
from tests.flagdata.lake.conftest import overwrite
from tests.remedies.cases import Case, meet
from tests.remedies.user import User

EXPORT = "export mcap --to out --where \"name = 'one'\""


def changed(user: User, kind: Kind, column: str, value: object) -> dict[Path, bytes]:
    """Change a value of the row of a kind that is called `one`, as a program would that wrote it
    wrongly.

    The hashes that the log and the refs state are those of what is there.

    Returns: what the files that were changed held before.
    """
    folder = user.folder / "lake" / "catalog"
    for path in folder.rglob("*.parquet"):
        table = pq.ParquetFile(path).read()
        rows = table.to_pylist()
        hit = [row for row in rows if (row.get("name"), row.get("kind")) == ("one", kind)]
        if hit:
            for row in hit:
                row[column] = value
            entry = max((folder / "_delta_log").glob("*.json"))
            note = user.folder / "lake" / "refs" / "newest" / str(int(entry.stem))
            before = {place: place.read_bytes() for place in (path, entry, note)}
            assert path.name.encode() in before[entry]
            sink = pa.BufferOutputStream()
            pq.write_table(pa.Table.from_pylist(rows, schema=table.schema), sink)
            after = sink.getvalue().to_pybytes()
            overwrite(path, after)
            stated = before[entry].replace(_hash(before[path]), _hash(after))
            stated = stated.replace(_size(before[path]), _size(after))
            overwrite(entry, stated)
            overwrite(note, before[note].replace(_hash(before[entry]), _hash(stated)))
            return before
    raise AssertionError(kind)


def _hash(data: bytes) -> bytes:
    return hashlib.sha256(data).hexdigest().encode()


def _size(data: bytes) -> bytes:
    return b'"size":%d' % len(data)


def add_clip(user: User) -> None:
    """The first frames of the film `first` as a clip `one` of it."""
    lake = Lake.open(user.folder / "lake")
    film = lake.artifact("first")
    with lake.transaction("align") as transaction:
        transaction.hold(str(film.object))
        transaction.add(
            Artifact(
                kind=Kind.CLIP,
                name="one",
                object=film.object,
                parents=[film.id],
                recording=film.id,
                frame_first=0,
                frame_count=3,
                start=film.start,
                end=film.end,
                recipe={"clip": 1},
                parameters="{}",
            )
        )


MADE = {
    Kind.CAMERA: ("ingest", "second.mp4", "--name", "one"),
    Kind.MESHES: ("ingest", "meshes", "--rate", "25", "--name", "one"),
    Kind.CLIP: (),
}
"""What makes each kind that is changed; a clip is `add_clip`'s."""
CHANGES = [
    (Case("export/export_source.py", "run flagdata doctor", EXPORT), Kind.CAMERA, "object", None),
    (
        Case("export/export_source.py", "names the rows that are damaged", EXPORT),
        Kind.CLIP,
        "frame_count",
        9000,
    ),
    (
        Case("export/obj.py", "run flagdata doctor", EXPORT.replace("mcap", "obj")),
        Kind.MESHES,
        "object",
        None,
    ),
    (
        Case(
            "flagdata/recipes/documents.py",
            "run flagdata doctor",
            EXPORT.replace("mcap", "webdataset"),
        ),
        Kind.CLIP,
        "parameters",
        "{",
    ),
    (Case("lake/artifact.py", "run flagdata doctor", "show one"), Kind.CAMERA, "recipe", "{"),
    (Case("lake/artifact.py", "run flagdata doctor", "show one"), Kind.CAMERA, "recipe", "{}"),
]
"""What is met, and the column of which kind's row is changed to what."""


@pytest.mark.parametrize(("case", "kind", "column", "value"), CHANGES)
def test_a_row_that_was_changed_is_named_by_the_check_and_made_anew(
    user: User, case: Case, kind: Kind, column: str, value: object
) -> None:
    made, command = MADE[kind], shlex.split(case.command)
    if made:
        user.succeeds(*made)
    else:
        add_clip(user)
    before = changed(user, kind, column, value)
    meet(user, case)
    said = user.follows("doctor", code=3).out
    if made:
        assert "withdraw the artifact and ingest its source again" in said
        user.succeeds("withdraw", "one", "-m", "its row is damaged")
        user.succeeds(*made)
    else:
        for path, data in before.items():
            overwrite(path, data)
        user.succeeds("verify")
    user.succeeds("doctor", shows="(?m)^healthy")
    user.succeeds(*command)
