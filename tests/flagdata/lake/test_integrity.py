"""Numbers in a lake that cannot be right, bits that flip in what is read, and files that an
operating system adds."""

from __future__ import annotations

import json
import os
import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from flagdata.core.files.checksums import content_hash
from flagdata.core.provenance import digest
from flagdata.core.schema import Kind, catalog_schema
from flagdata.errors import CorruptError, FlagdataError, LimitError, NotFoundError
from flagdata.lake import (
    Artifact,
    Lake,
    Log,
    catalog,
    clone,
    collect,
    doctor,
    is_healthy,
    lake_locks,
    object_names,
    transfer,
    usage,
    verify,
    verify_catalog,
)
from flagdata.storage import Place, RemotePath
from tests.flagdata.lake.conftest import LINKS, overwrite, put_older_ref, put_text
from tests.flagdata.lake.test_transfer import no_bar

NOW = timedelta(0)
HUGE = ("9" * 20, str(2**63), str(10**12), "0" * 15 + "77777")


@pytest.fixture
def filled(lake: Lake) -> Lake:
    """A lake of three commits, a tag and a branch."""
    for text in "abc":
        put_text(lake, text)
    lake.tag("v1")
    lake.branch("side")
    return lake


def refused(act: Callable[[], object]) -> CorruptError:
    with pytest.raises(CorruptError) as caught:
        act()
    return caught.value


def readers(lake: Lake, tmp_path: Path) -> Iterator[Callable[[], object]]:
    """What reads a lake, each by a process that has not read it before."""
    yield lambda: Lake.open(lake.path).rows()
    yield lambda: Lake.open(lake.path).catalog.history()
    yield lambda: clone(Lake.open(lake.path), tmp_path / "copy", bars=no_bar)
    yield lambda: collect(Lake.open(lake.path), grace=NOW)


@pytest.mark.parametrize("number", HUGE)
def test_a_mark_of_a_version_that_cannot_be_is_named_at_once_and_its_deletion_heals(
    filled: Lake, tmp_path: Path, number: str
) -> None:
    mark = filled.path / "refs" / "newest" / number
    mark.write_bytes(b"0\n")
    for read in readers(filled, tmp_path):
        error = refused(read)
        assert str(mark) in error.what
        assert f"delete {mark}" in error.fix
    assert [finding.kind for finding in doctor(Lake.open(filled.path), grace=NOW)] == ["log-gap"]
    mark.unlink()
    assert is_healthy(doctor(Lake.open(filled.path), grace=NOW))
    assert Lake.open(filled.path).rows().num_rows == 3


@pytest.mark.parametrize("number", HUGE)
def test_an_entry_of_a_version_that_cannot_be_is_named_at_once_and_moving_it_away_heals(
    filled: Lake, tmp_path: Path, number: str
) -> None:
    log = filled.path / "catalog" / "_delta_log"
    entry = log / f"{int(number):020d}.json"
    entry.write_bytes((log / f"{2:020d}.json").read_bytes())
    for read in readers(filled, tmp_path):
        error = refused(read)
        assert f"move {entry} away" in error.fix
    entry.unlink()
    assert Lake.open(filled.path).rows().num_rows == 3


@pytest.mark.parametrize("number", HUGE)
def test_a_push_to_a_lake_with_a_mark_that_cannot_be_is_refused(
    filled: Lake, tmp_path: Path, number: str
) -> None:
    copy, _ = clone(filled, tmp_path / "copy", bars=no_bar)
    (copy.path / "refs" / "newest" / number).write_bytes(b"0\n")
    assert refused(lambda: transfer(filled, Lake.open(copy.path), bars=no_bar)).kind == "log-gap"


@pytest.mark.parametrize("number", [*HUGE, "9" * 5000])
def test_a_ref_of_a_version_that_cannot_be_is_named(filled: Lake, number: str) -> None:
    for kind in ("tags", "branches"):
        path = filled.path / "refs" / kind / "odd.json"
        text = '{"name": "odd", "created": "2026", "view": [{"branch": "main", "version": %s}]}'
        path.write_bytes((text % (number.lstrip("0"))).encode())
        error = refused(lambda: Lake.open(filled.path).rows(at="odd"))
        assert error.where == str(path)
        assert "ref-unreadable" in {
            finding.kind for finding in doctor(Lake.open(filled.path), grace=NOW)
        }
        path.unlink()


@pytest.mark.parametrize("at", ["7" * 5000, "9" * 20, "6"])
def test_a_version_beyond_the_newest_is_not_there_however_many_digits_it_has(
    filled: Lake, at: str
) -> None:
    with pytest.raises(NotFoundError, match="the newest is 5") as caught:
        filled.rows(at=at)
    assert len(caught.value.what) < 200
    assert filled.rows(at="0" * 5000 + "5").num_rows == 3


def test_a_listing_of_a_bucket_with_a_flipped_digit_ends_in_an_error(
    remote_lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_text(remote_lake, "a")
    listed = RemotePath.iterdir

    def flipped(self: RemotePath) -> Iterator[RemotePath]:
        for path in listed(self):
            name = (
                path.name.replace("0000000001.json", "9000000001.json") if path.suffix else "8" * 19
            )
            yield RemotePath(path.bucket, f"{self.key}/{name}", status=path.stat())

    for folder in ("newest", "_delta_log"):
        monkeypatch.setattr(
            RemotePath,
            "iterdir",
            lambda self, folder=folder: flipped(self) if self.name == folder else listed(self),
        )
        assert refused(lambda: Lake.open(remote_lake.path).rows()).kind == "log-gap"
    monkeypatch.setattr(RemotePath, "iterdir", listed)
    assert Lake.open(remote_lake.path).rows().num_rows == 1


def test_a_lock_of_a_bucket_that_states_a_long_life_is_void_after_an_hour(
    remote_lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    staging = remote_lake.path / "staging"
    assert isinstance(staging, RemotePath)
    owner = {**lake_locks.owner(), "machine": "another"}
    for life in (1e300, "nan", "inf"):
        (staging / "collect").write_bytes(json.dumps({**owner, "life": life}).encode())
        written = (staging / "collect").stat().st_mtime
        for later, counts in ((0.0, True), (3700.0, False)):
            monkeypatch.setattr(RemotePath, "now", lambda self, at=written + later: at)
            assert (lake_locks.living(staging / "collect", staging) is not None) == counts


def summary(lake: Lake, content: dict[str, Any], first: int, last: int) -> Place:
    """A summary of the log whose checksum is right."""
    text = json.dumps(content)
    folder = lake.path / "refs" / "history"
    folder.mkdir(exist_ok=True)
    path = folder / f"{first:020d}-{last:020d}-{digest(text)}.json"
    path.write_bytes(text.encode())
    return path


STATED = {"version": 0, "timestamp": 1, "operation": "WRITE"}


ODD = [{**STATED, "version": 1}, {**STATED, "timestamp": -1}, {**STATED, "rows": "many"}, "x"]


@pytest.mark.parametrize("versions", [[], [STATED] * 2, 7, *([one] for one in ODD)])
def test_a_summary_that_states_other_versions_than_its_name_is_refused(
    filled: Lake, versions: Any
) -> None:
    content = {"schema": "flagdata.history/1", "before": "", "end": "", "versions": versions}
    path = summary(filled, content, 0, 0)
    error = refused(lambda: Lake.open(filled.path).rows())
    assert error.where == str(path)
    path.unlink()
    assert Lake.open(filled.path).rows().num_rows == 3


def test_a_file_of_rows_that_states_more_than_its_bytes_can_hold_is_refused_before_it_is_decoded(
    filled: Lake, tmp_path: Path
) -> None:
    count = 3_000_000
    schema = catalog_schema()
    rows = pa.Table.from_arrays(
        [pa.nulls(count, field.type) for field in schema], names=schema.names
    )
    pq.write_table(rows, tmp_path / "rows.parquet", compression="zstd")
    content = (tmp_path / "rows.parquet").read_bytes()
    path = next(iter((filled.path / "catalog").glob("*.parquet")))
    overwrite(path, content)
    files = Lake.open(filled.path).catalog._files
    files._noted = lambda name: ()
    for read in (files.read, lambda name: files.scan([name])):
        with pytest.raises(LimitError, match="3000000 rows"):
            read(path.name)


def copied(lake: Lake, tmp_path: Path, name: str) -> Place:
    copy, _ = clone(lake, tmp_path / name, bars=no_bar)
    return copy.path


@pytest.mark.disk("it reads a lake hundreds of times")
def test_a_bit_that_flips_in_a_file_of_rows_is_refused_and_a_clone_heals(
    filled: Lake, tmp_path: Path
) -> None:
    copy = copied(filled, tmp_path, "copy")
    draw = random.Random(5)
    for path in sorted((filled.path / "catalog").glob("*.parquet")):  # type: ignore[type-var]
        content = path.read_bytes()
        for _ in range(20):
            changed = bytearray(content)
            changed[draw.randrange(len(content))] ^= 1 << draw.randrange(8)
            overwrite(path, bytes(changed))
            for read in (
                lambda: Lake.open(filled.path).rows(),
                lambda: Lake.open(filled.path).rows("kind = 'wind'"),
            ):
                error = refused(read)
                assert error.where == str(path)
                assert "flagdata heal FROM" in error.fix
        overwrite(path, (copy / "catalog" / path.name).read_bytes())
    assert Lake.open(filled.path).rows().num_rows == 3


@pytest.mark.disk("it reads a lake hundreds of times")
def test_a_bit_that_flips_in_an_entry_of_the_log_is_refused_and_a_clone_heals(
    filled: Lake, tmp_path: Path
) -> None:
    copy = copied(filled, tmp_path, "copy")
    log = filled.path / "catalog" / "_delta_log"
    draw = random.Random(6)
    for path in sorted(log.glob("*.json")):  # type: ignore[type-var]
        content = path.read_bytes()
        for _ in range(20):
            changed = bytearray(content)
            changed[draw.randrange(len(content))] ^= 1 << draw.randrange(8)
            overwrite(path, bytes(changed))
            refused(lambda: Lake.open(filled.path).rows())
            refused(lambda: Lake.open(filled.path).catalog.history())
        overwrite(path, (copy / "catalog" / "_delta_log" / path.name).read_bytes())
    assert Lake.open(filled.path).rows().num_rows == 3


def test_a_mark_that_has_changed_is_named_and_its_deletion_heals(filled: Lake) -> None:
    mark = filled.path / "refs" / "newest" / "5"
    overwrite(mark, mark.read_bytes().replace(mark.read_bytes()[:1], b"g"))
    error = refused(lambda: Lake.open(filled.path).rows())
    assert f"delete {mark}" in error.fix
    mark.unlink()
    assert Lake.open(filled.path).rows().num_rows == 3


@pytest.mark.disk("it reads a lake hundreds of times")
def test_a_bit_that_flips_in_a_ref_is_refused_or_changes_nothing(filled: Lake) -> None:
    for kind in ("tags", "branches"):
        path = put_older_ref(filled, kind, "older")
        name, content = "older", path.read_bytes()
        right = Lake.open(filled.path).view(name)
        harmless = 0
        for position in range(len(content)):
            for bit in range(8):
                changed = bytearray(content)
                changed[position] ^= 1 << bit
                overwrite(path, bytes(changed))
                with suppress(CorruptError):
                    assert Lake.open(filled.path).view(name) == right
                    harmless += 1
        assert harmless < len(content)  # of 8 times so many: the key of the checksum, and blanks
        path.unlink()


def test_a_ref_under_another_name_is_refused(filled: Lake) -> None:
    folder = filled.path / "refs" / "tags"
    (folder / "v9.json").write_bytes((folder / "v1.json").read_bytes())
    assert refused(lambda: Lake.open(filled.path).rows(at="v9")).where == str(folder / "v9.json")


def test_refs_without_a_checksum_as_older_lakes_have_are_read(filled: Lake) -> None:
    path = put_older_ref(filled, "tags", "older")
    content = json.loads(path.read_bytes())
    del content["sha256"]
    overwrite(path, json.dumps(content).encode())
    assert Lake.open(filled.path).rows(at="older").num_rows == 3


@pytest.mark.disk("it reads a lake hundreds of times")
def test_a_bit_that_flips_in_a_checkpoint_is_refused_and_the_deletion_heals(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(catalog, "_TIDY_EVERY", 4)
    for number in range(9):
        put_text(lake, str(number))
    log = lake.path / "catalog" / "_delta_log"
    newest = max(log.glob("*.checkpoint.parquet"))  # type: ignore[type-var]
    content = newest.read_bytes()
    for position in range(0, len(content), len(content) // 40):
        changed = bytearray(content)
        changed[position] ^= 4
        overwrite(newest, bytes(changed))
        refused(lambda: Lake.open(lake.path).rows())
    for path in (*log.glob("*.checkpoint.parquet"), log / "_last_checkpoint"):
        path.unlink()
    assert Lake.open(lake.path).rows().num_rows == 9


def test_rows_of_a_lake_whose_summaries_name_no_files_are_compared_with_what_was_noted(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(catalog, "_TIDY_EVERY", 4)
    for number in range(6):
        put_text(lake, str(number))
    (path,) = (lake.path / "refs" / "history").iterdir()
    content = json.loads(path.read_bytes())
    for version in content["versions"]:
        del version["files"]
    path.unlink()
    summary(lake, content, 0, len(content["versions"]) - 1)
    fresh = Lake.open(lake.path)
    assert fresh.rows().num_rows == 6
    name = fresh.catalog.history()[2]
    assert "files" in name
    old = next(one for one in fresh.catalog._entries.entry(2)[1])
    file = lake.path / "catalog" / old
    overwrite(file, file.read_bytes()[:-9] + b"x" + file.read_bytes()[-8:])
    refused(lambda: Lake.open(lake.path).rows(at="2"))


def beside(folder: Path) -> None:
    """What macOS and Windows put into a folder."""
    for path in [folder, *(entry for entry in folder.rglob("*") if entry.is_dir())]:
        for entry in [entry for entry in path.iterdir() if not entry.name.startswith(".")]:
            entry.with_name(f"._{entry.name}").write_bytes(b"\0\5\x16\7" + bytes(100))
        for name in (".DS_Store", "Thumbs.db", "desktop.ini"):
            (path / name).write_bytes(b"\0\0\0\1Bud1")


@pytest.mark.disk("an operating system puts none into a bucket")
def test_files_of_an_operating_system_in_all_folders_of_a_lake_are_passed_over(
    lake: Lake, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert isinstance(lake.path, Path)
    monkeypatch.setattr(catalog, "_TIDY_EVERY", 2)
    for text in "abc":
        put_text(lake, text)
    with lake.transaction("a folder") as tx:
        folder = tx.staging(".zarr")
        (folder / "positions").mkdir(parents=True)
        (folder / "positions" / "0").write_text("0")
        name = tx.put(folder)
        tx.add(Artifact(kind=Kind.MESHES, name="m", object=name, source_hash="0" * 64))
    lake.tag("v1")
    lake.branch("side")
    lake.objects.existing(name).chmod(0o755)
    before = content_hash(lake.objects.existing(name))
    beside(lake.path)
    fresh = Lake.open(lake.path)
    assert content_hash(fresh.objects.existing(name)) == before
    findings = doctor(fresh, grace=NOW)
    assert [finding.kind for finding in findings] == ["files-beside"]
    assert is_healthy(findings)
    assert verify(fresh, object_names(fresh)) == verify_catalog(fresh) == ()
    assert fresh.rows(at="v1").num_rows == fresh.rows(at="side").num_rows == 4
    assert collect(fresh, grace=NOW).objects == ()
    put_text(fresh, "d")
    copy, _ = clone(fresh, tmp_path / "copy", bars=no_bar)
    assert copy.rows().num_rows == 5


@pytest.mark.disk("an operating system puts none into a bucket")
def test_a_lake_can_be_made_where_an_operating_system_put_its_files(tmp_path: Path) -> None:
    (tmp_path / "new").mkdir()
    (tmp_path / "new" / ".DS_Store").write_bytes(b"x")
    assert Lake.create(tmp_path / "new").rows().num_rows == 0


NOTES = ("rows", "withdrawn", "merged_version", "expired", "labels", "hidden", "erased", "view")


@pytest.mark.parametrize("key", NOTES)
@pytest.mark.parametrize(
    "value",
    ["9" * 5000, '{"up_to": 1e999, "objects": []}', "[[]]", '{"a": ["b"]}', '{"a": {"b": [1]}}'],
)
def test_notes_of_the_log_that_cannot_be_read_are_never_unforeseen(
    filled: Lake, key: str, value: str
) -> None:
    info = {
        "commit": "c" + "0" * 16,
        "message": "m",
        "branch": "main",
        "merged": "side",
        key: value,
    }
    filled.catalog.append(catalog_schema().empty_table(), base=filled.catalog.head(), info=info)
    acts: list[Callable[[], object]] = [
        lambda: Lake.open(filled.path).rows(),
        lambda: doctor(Lake.open(filled.path), grace=NOW),
        lambda: collect(Lake.open(filled.path), grace=NOW),
        lambda: Lake.open(filled.path).view("c" + "0" * 16),
        lambda: Lake.open(filled.path).merge("side", "m"),
    ]
    outcomes = set()
    for act in acts:  # any other exception would be "unforeseen"
        try:
            act()
        except FlagdataError as error:
            outcomes.add(error.kind)
    assert "unforeseen" not in outcomes
    found = doctor(Lake.open(filled.path), grace=NOW)
    assert (key in ("rows", "withdrawn", "expired")) <= (not is_healthy(found))


def test_the_log_counts_up_to_no_number_that_a_name_states(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked: list[int] = []
    path = Log.path
    monkeypatch.setattr(
        Log, "path", lambda self, version: looked.append(version) or path(self, version)
    )
    (lake.path / "refs" / "newest" / ("8" * 19)).write_bytes(b"0\n")
    refused(lake.catalog.head)
    assert len(looked) < 20


@pytest.mark.parametrize("end", ["\u2028", "\u2029", "\x85", "\x0b", "\x1c", "\n", "\r"])
def test_a_message_with_any_line_end_of_unicode_is_read_as_it_was_written(
    lake: Lake, end: str
) -> None:
    put_text(lake, "a")
    message = f"first{end}second"
    with lake.transaction(message) as tx:
        tx.add(Artifact(kind=Kind.MEASUREMENT, name="m", recipe={"of": "m"}))
    assert Lake.open(lake.path).catalog.history()[0]["message"] == message
    assert Lake.open(lake.path).rows().num_rows == 2
    assert doctor(Lake.open(lake.path), grace=NOW) == ()


@pytest.mark.disk("it changes files behind the lake's back")
def test_a_clone_takes_no_damaged_entry_and_no_damaged_file(
    lake: Lake, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(
        catalog, "_TIDY_EVERY", 3
    )  # so that no reader of the head needs what is old
    for number in range(7):
        put_text(lake, str(number))
    entry = lake.path / "catalog" / "_delta_log" / f"{1:020d}.json"
    name = lake.catalog.history()[-2]["files"][0]
    for place, old, new in (
        (entry, b"ingest 0", b"ingest 1"),
        (lake.path / "catalog" / name, b"PAR1", b"PAR2"),
    ):
        content = place.read_bytes()
        overwrite(place, content.replace(old, new))
        assert Lake.open(lake.path).rows().num_rows == 7
        with pytest.raises(CorruptError) as caught:
            clone(Lake.open(lake.path), tmp_path / old.decode(), bars=no_bar)
        assert caught.value.where == str(place)
        overwrite(place, content)
    copy, _ = clone(Lake.open(lake.path), tmp_path / "whole", bars=no_bar)
    assert copy.rows().num_rows == 7


ADDED: dict[str, Any] = {"size": "x", "partitionValues": 5, "modificationTime": -(10**30)}
MADE: dict[str, Any] = {"schemaString": "{", "partitionColumns": 7}


@pytest.mark.disk("it changes files behind the lake's back")
@pytest.mark.parametrize(("key", "value"), [*ADDED.items(), *MADE.items()])
def test_an_entry_that_the_delta_library_cannot_read_is_named(
    filled: Lake, key: str, value: Any
) -> None:
    number, action = (2, "add") if key in ADDED else (0, "metaData")
    path = filled.path / "catalog" / "_delta_log" / f"{number:020d}.json"
    lines = [json.loads(line) for line in path.read_bytes().decode().split("\n") if line]
    next(line[action] for line in lines if action in line)[key] = value
    overwrite(path, "\n".join(map(json.dumps, lines)).encode())
    fresh = Lake.open(filled.path)
    fresh.catalog._entries.entries = partial(
        unchained, fresh.catalog._entries
    )  # as of users who know the hashes
    error = refused(fresh.rows)
    assert error.where == str(path)
    assert "Kernel" not in error.what
    assert "flagdata heal FROM" in error.fix


def unchained(log: Log, versions: Sequence[int], *, head: int) -> list[Any]:
    """Entries as they are read, not compared with one another."""
    return [log._read(version) for version in versions]


@pytest.mark.disk("it changes files behind the lake's back")
def test_an_entry_that_a_summary_covers_is_compared_where_an_old_version_is_read_from_it(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(catalog, "_TIDY_EVERY", 5)
    for number in range(7):
        put_text(lake, str(number))
    path = lake.path / "catalog" / "_delta_log" / f"{3:020d}.json"
    content = path.read_bytes()
    right = [Lake.open(lake.path).rows(at=at).num_rows for at in ("3", "4", None)]
    overwrite(path, content.replace(b'"add":{', b'"cdc":{'))
    for at in ("3", "4"):
        assert refused(lambda at=at: Lake.open(lake.path).rows(at=at)).where == str(path)
    assert Lake.open(lake.path).rows().num_rows == right[-1]
    overwrite(path, content)
    assert [Lake.open(lake.path).rows(at=at).num_rows for at in ("3", "4", None)] == right


@pytest.mark.disk(LINKS)
@pytest.mark.timeout(60)
def test_a_pipe_in_place_of_what_the_delta_library_reads_is_named_and_nobody_waits(
    lake: Lake,
) -> None:
    put_text(lake, "gusts")
    hint = lake.path / "catalog" / "_delta_log" / "_last_checkpoint"
    hint.unlink(missing_ok=True)
    os.mkfifo(hint)
    for _ in range(2):
        with pytest.raises(
            CorruptError, match="_last_checkpoint of the catalog's log is no regular file"
        ) as error:
            Lake.open(lake.path).rows()
    assert error.value.where == str(hint)
    assert str(error.value.fix).startswith("delete _last_checkpoint")
    hint.unlink()
    assert Lake.open(lake.path).rows()["name"].to_pylist() == ["gusts"]


@pytest.mark.disk("names of files that a bucket does not take")
@pytest.mark.parametrize("name", ["a\nb", "\x1b[2J.json", "\x7f", os.fsdecode(b"\xff")])
def test_a_name_in_the_log_that_the_delta_library_does_not_take_is_named_and_moving_it_away_heals(
    filled: Lake, tmp_path: Path, name: str
) -> None:
    stray = filled.path / "catalog" / "_delta_log" / name
    stray.write_bytes(b"{}")
    for read in (
        lambda: Lake.open(filled.path).rows(),
        lambda: clone(filled, tmp_path / "copy", bars=no_bar),
    ):
        error = refused(read)
        assert (error.where, error.fix.startswith("move it away")) == (str(stray), True)
    assert str(stray) in {finding.where for finding in doctor(Lake.open(filled.path), grace=NOW)}
    stray.unlink()
    assert is_healthy(doctor(Lake.open(filled.path), grace=NOW))


@pytest.mark.disk("a bucket has no locks of the kernel")
def test_a_lease_of_any_bytes_is_that_of_a_dead_owner(filled: Lake) -> None:
    folder = filled.staging / "\x1b[2J"
    folder.mkdir()
    (folder / "lease").write_bytes(b"\xff\xfe\n../../x\n\x1b[2J")
    for look in (doctor, usage, collect):
        look(Lake.open(filled.path), grace=NOW)
    assert not folder.exists()
    assert is_healthy(doctor(Lake.open(filled.path), grace=NOW))
