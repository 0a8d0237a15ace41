"""Queries and commits decode what they use of the catalog's files, and give what the whole table
would."""

from __future__ import annotations

from functools import partial

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from deltalake import DeltaTable

from flagdata.core.schema import Kind, catalog_schema
from flagdata.errors import CorruptError
from flagdata.lake import Artifact, Lake, Scan, select
from flagdata.lake.rowfiles import ROW_ORDER, RowFiles, in_order
from tests.flagdata.lake.conftest import overwrite, put_text
from tests.program import invoke


def test_queries_look_ups_and_commits_do_not_decode_whole_rows(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    identities = [put_text(lake, name).id for name in ("one", "two", "three")]

    def refuse(self: RowFiles, name: str) -> pa.Table:
        raise AssertionError(f"all of {name} was decoded")

    monkeypatch.setattr(RowFiles, "read", refuse)
    lake = Lake.open(lake.path)
    assert select(lake, sql="select kind, count(*) n from catalog group by kind").to_pylist() == [
        {"kind": "wind", "n": 3}
    ]
    assert lake.artifact("two").id == identities[1]
    assert lake.rows({"name": ["three", "one"]})["name"].to_pylist() == ["one", "three"]
    assert put_text(lake, "four").id == lake.rows("name = 'four'")["artifact"][0].as_py()
    with lake.transaction("again") as transaction:
        transaction.add(Artifact(kind=Kind.MEASUREMENT, name="fifth", parents=(identities[0],)))
        assert not transaction.add(lake.artifact("one"))
    assert transaction.result.existing == (identities[0],)
    for branch in ("side", "other"):
        lake.branch(branch)
    with lake.transaction("aside", branch="side") as transaction:
        transaction.add(Artifact(kind=Kind.CLIP, name="clip", parents=(identities[0],), recipe={}))
    lake.withdraw([identities[1]], "not on the side", branch="side")
    assert lake.merge("side", "what was done aside", into="other").added == transaction.result.added
    assert lake.rows(columns=["name"], at="other")["name"].to_pylist() == [
        "one",
        "three",
        "four",
        "fifth",
        "clip",
    ]
    listed = invoke("ls", "--lake", lake.path)
    assert ("two" in listed.out, "5 artifacts" in listed.err) == (True, True)


def test_a_scan_is_the_table_of_every_view(lake: Lake) -> None:
    kept, gone = put_text(lake, "kept"), put_text(lake, "gone")
    lake.branch("side")
    put_text(lake, "aside", branch="side")
    lake.withdraw([kept.id], "not on the side", branch="side")
    lake.withdraw([gone.id], "nor here")
    lake.label([kept.id], {"good": True}, "looked at")
    for at in ("0", "1", "2", None, "side"):
        view = lake.view(at)
        scanned = lake.scan(view)
        rows = scanned.table(catalog_schema().names) if isinstance(scanned, Scan) else scanned
        whole = lake.table(view)
        assert rows.to_pylist() == whole.to_pylist()
        assert lake.columns(view, ["name", "object"]).equals(whole.select(["name", "object"]))
        assert lake.matching(view, {"name": ["aside", "kept"]}).to_pylist() == [
            row for row in whole.to_pylist() if row["name"] in ("aside", "kept")
        ]
    assert select(lake, "label_good", columns=["name"]).to_pylist() == [{"name": "kept"}]


@pytest.mark.disk("it opens the table by the Delta library, which takes options for a bucket")
def test_a_withdrawal_writes_anew_only_the_files_that_have_its_rows(lake: Lake) -> None:
    put_text(lake, "one")
    gone = put_text(lake, "two")
    put_text(lake, "three")
    before = {name for version in range(1, 4) for name in lake.catalog.entry(version)[1]}
    lake.withdraw([gone.id], "wrong")
    assert {path.name for path in lake.catalog.path.glob("*.parquet")} - before == set(
        lake.catalog.entry(4)[1]
    )
    kept = {file.rpartition("/")[2] for file in DeltaTable(str(lake.catalog.path)).file_uris()}
    assert len(kept & before) == 2
    assert lake.rows()["name"].to_pylist() == ["one", "three"]


def test_rows_are_sorted_as_arrow_sorts_them() -> None:
    row = Artifact(kind=Kind.CLIP, name="c", source_hash="a" * 64, recipe={}).row()
    starts: list[tuple[int | None, int | None]] = [
        (2, 1),
        (1, None),
        (1, 3),
        (None, 5),
        (1, 3),
        (2, 0),
    ]
    rows = [
        {**row, "start": s, "end": s, "frame_first": f, "artifact": f"{k:032x}"}
        for k, (s, f) in enumerate(starts)
    ]
    table = pa.Table.from_pylist(rows, schema=catalog_schema())
    ordered = table.sort_by([(name, "ascending") for name in ROW_ORDER])
    assert in_order(table).equals(ordered)
    assert in_order(ordered) is ordered
    swapped = ordered.take([1, 0, 2, 3, 4, 5])  # the two of one start and frame
    assert in_order(swapped).equals(ordered)


def test_a_damaged_column_is_named_by_its_file(lake: Lake) -> None:
    put_text(lake, "gusts")
    (file,) = lake.catalog.path.glob("*.parquet")
    content = bytearray(file.read_bytes())
    group = pq.read_metadata(pa.BufferReader(bytes(content))).row_group(0)
    name = next(
        group.column(k)
        for k in range(group.num_columns)
        if group.column(k).path_in_schema == "name"
    )
    first = name.data_page_offset
    content[first : first + name.total_compressed_size] = b"\xff" * name.total_compressed_size
    overwrite(file, bytes(content))
    lake = Lake.open(lake.path)
    other = partial(select, lake, columns=["kind"])
    for look in (
        other,
        lambda: select(lake, "name = 'gusts'"),
        lambda: lake.artifact("gusts"),
        lake.rows,
    ):
        with pytest.raises(CorruptError, match="has changed") as caught:
            look()
        assert caught.value.where == str(file)


def test_the_files_of_a_version_are_listed_once_however_often_versions_take_turns(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_text(lake, "a")
    lake.tag("v1")
    put_text(lake, "b")
    listed: list[int] = []
    whole = DeltaTable.file_uris

    def counted(self: DeltaTable) -> list[str]:
        listed.append(self.version())
        return whole(self)

    again = Lake.open(lake.path)
    monkeypatch.setattr(DeltaTable, "file_uris", counted)
    names = [again.rows(at=at)["name"].to_pylist() for at in (None, "v1", None, "v1")]
    assert names == [["a", "b"], ["a"], ["a", "b"], ["a"]]
    assert sorted(listed) == [1, 3]  # version 2 is the tag
