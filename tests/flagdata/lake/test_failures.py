"""Full disks, forbidden folders and bad names: a clear error, and a lake that is whole."""

from __future__ import annotations

import errno
import json
import multiprocessing
import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Sequence
from datetime import timedelta
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from deltalake import DeltaTable
from deltalake.exceptions import TableNotFoundError

from flagdata.core.findings import Severity
from flagdata.core.schema import Kind
from flagdata.errors import (
    ConflictError,
    CorruptError,
    FlagdataError,
    InputError,
    NotFoundError,
    UsageError,
)
from flagdata.lake import Artifact, Lake, collect, doctor
from tests.flagdata.lake.conftest import LINKS, put_text

NOW = timedelta(0)

# A process that may not write more than so many bytes to one file: the kernel refuses, as a full
# disk does.
_LIMITED = """
import resource, sys
from flagdata.errors import FlagdataError
from flagdata.lake import Artifact, Lake
lake = Lake.open(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]),) * 2)
source = open(sys.argv[3], "rb")
try:
    with lake.transaction("too large") as tx:
        import pathlib
        tx.add(Artifact(kind="wind", name="x", object=tx.put(pathlib.Path(sys.argv[3]))))
except FlagdataError as error:
    print(error.what, "|", error.fix)
"""


@pytest.mark.disk("a bucket has no limit of the size of files")
@pytest.mark.parametrize(("limit", "doing"), [(50_000, "storing an object"), (1_000, "committing")])
def test_a_write_that_the_kernel_refuses_is_a_clear_error_and_publishes_nothing(
    lake: Lake, tmp_path: Path, limit: int, doing: str
) -> None:
    put_text(lake, "before")
    source = tmp_path / "large.mcap"
    source.write_bytes(b"x" * (100_000 if doing == "storing an object" else 500))
    command = [sys.executable, "-c", _LIMITED, str(lake.path), str(limit), str(source)]
    ended = subprocess.run(command, capture_output=True, text=True, check=True, timeout=500)
    assert ended.stdout.startswith(f"{doing} failed: ")
    assert "ulimit" in ended.stdout
    assert lake.rows()["name"].to_pylist() == ["before"]
    collect(lake, grace=NOW)
    assert doctor(lake, grace=NOW) == ()


def test_a_disk_that_refuses_the_folder_of_the_catalog_is_a_clear_error_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the Delta library says where the folder of a new table cannot be made; it does so in
    another class of error than for files."""

    def refused(*_: object, **__: object) -> None:
        raise TableNotFoundError(
            "Could not create local directory: file:///x Error: "
            'Os { code: 28, kind: StorageFull, message: "No space left on device" }'
        )

    monkeypatch.setattr(DeltaTable, "create", refused)
    with pytest.raises(FlagdataError, match="No space left") as caught:
        Lake.create(tmp_path / "new")
    assert caught.value.fix is not None
    assert "free some space" in caught.value.fix
    assert list((tmp_path / "new").iterdir()) == []


@pytest.mark.disk("it is about a full disk")
def test_a_disk_that_fills_at_any_step_leaves_a_whole_lake_and_ingesting_again_succeeds(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_text(lake, "before")
    flush = os.fsync
    for step in range(100):
        calls = 0

        def full(descriptor: int, step: int = step) -> None:
            nonlocal calls
            calls += 1
            if calls > step:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            flush(descriptor)

        monkeypatch.setattr(os, "fsync", full)
        fix = ""
        try:
            put_text(lake, f"step {step}")
        except FlagdataError as error:
            fix = error.fix
        finally:
            monkeypatch.setattr(os, "fsync", flush)
        if not fix:
            break
        assert "free some space" in fix
        assert [f for f in doctor(lake, grace=NOW) if f.severity is Severity.ERROR] == []
        put_text(lake, f"step {step}")
    assert (
        step >= 4
    )  # object, its folder, rows, their folder; what follows the log entry is a warning
    collect(lake, grace=NOW)
    assert doctor(lake, grace=NOW) == ()
    assert lake.rows()["name"].to_pylist() == ["before", *(f"step {i}" for i in range(step + 1))]


@pytest.mark.disk(LINKS)
def test_a_folder_that_may_not_be_written_is_a_clear_error(lake: Lake) -> None:
    store = lake.path / "mcap"
    store.chmod(0o555)
    if os.access(store, os.W_OK):
        pytest.skip("this user may write everywhere")
    try:
        with pytest.raises(FlagdataError, match="write permission"):
            put_text(lake, "a")
    finally:
        store.chmod(0o755)
    assert lake.rows().num_rows == 0
    assert doctor(lake, grace=NOW) == ()


def taken(
    error: type[FlagdataError], *uses: Callable[[str], object], names: Sequence[str]
) -> list[str]:
    """Of the names, those that any of the uses does not refuse with this error."""

    def refused(use: Callable[[str], object], name: str) -> bool:
        try:
            use(name)
        except error:
            return True
        return False

    return [name for name in names if not all(refused(use, name) for use in uses)]


def test_object_names_cannot_reach_out_of_the_stores(lake: Lake) -> None:
    names = [
        "../lake.json",
        "mcap/../lake.json",
        "/etc/passwd",
        "mcap/" + "0" * 63,
        "mcap/" + "G" * 64,
        "mcap/" + "0" * 64 + "\n",
        "blob/" + "0" * 64,
        "",
    ]
    made = partial(Artifact, kind=Kind.WIND, name="x")
    assert taken(InputError, lake.object_path, lambda name: made(object=name), names=names) == []


def test_names_that_are_paths_versions_or_commits_are_refused_for_tags_and_branches(
    lake: Lake,
) -> None:
    paths = [
        "",
        ".",
        "..",
        "../v1",
        "a/b",
        "a\\b",
        "-v",
        ".v",
        "v 1",
        "v1\n",
        "é",
        "a" * 101,
        "v1.json",
    ]
    before = sorted((lake.path / "refs").rglob("*"))
    assert taken(UsageError, lake.tag, lake.branch, names=[*paths, "17", "c" + "0" * 16]) == []
    assert sorted((lake.path / "refs").rglob("*")) == before


def test_a_name_is_a_tag_or_a_branch_but_not_both_and_main_is_taken(lake: Lake) -> None:
    lake.tag("one")
    lake.branch("two")
    for name in ("one", "two", "main"):
        with pytest.raises(ConflictError):
            lake.tag(name)
        with pytest.raises(ConflictError):
            lake.branch(name)


def test_links_and_foreign_files_are_no_objects(lake: Lake, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret")
    folder = tmp_path / "with-link.zarr"
    folder.mkdir()
    (folder / "zarr.json").write_text("{}")
    (folder / "link").symlink_to(tmp_path / "secret")
    empty = tmp_path / "empty.mcap"
    empty.touch()
    with lake.transaction("none of these") as tx:
        for path in (folder, empty, tmp_path / "secret"):
            with pytest.raises(InputError):
                tx.put(path)
        with pytest.raises(NotFoundError):
            tx.put(tmp_path / "absent.mcap")
    assert list(lake.objects) == []


def test_a_file_from_elsewhere_is_copied_and_stays(lake: Lake, tmp_path: Path) -> None:
    source = tmp_path / "mine.mcap"
    source.write_text("mine")
    with lake.transaction("copy") as tx:
        name = tx.put(source)
        tx.add(Artifact(kind=Kind.WIND, name="mine", object=name))
    assert source.read_text() == "mine"
    assert lake.object_path(name).read_text() == "mine"


@pytest.mark.disk(LINKS)
def test_a_read_only_folder_is_copied_to_one_that_can_be_moved_and_collected(
    lake: Lake, tmp_path: Path
) -> None:
    source = tmp_path / "mine.zarr"
    (source / "inner").mkdir(parents=True)
    (source / "inner" / "zarr.json").write_text("{}")
    for folder in (source / "inner", source):
        folder.chmod(0o555)
    with lake.transaction("copy") as tx:
        path = lake.objects.path(tx.put(source))
    assert all(folder.stat().st_mode & 0o200 for folder in (path, path / "inner"))
    assert oct((path / "inner" / "zarr.json").stat().st_mode)[-3:] == "444"
    assert len(collect(lake, grace=NOW).objects) == 1
    assert list(lake.objects) == []
    for folder in (source, source / "inner"):
        folder.chmod(0o755)


def test_a_child_without_its_parent_is_refused(lake: Lake) -> None:
    with lake.transaction("orphan") as tx, pytest.raises(NotFoundError, match="parent"):
        tx.add(Artifact(kind=Kind.CLIP, name="clip", parents=("0" * 32,)))
    assert lake.rows().num_rows == 0


MALFORMED: list[tuple[str, object]] = [
    ("kind", "flag"),
    ("name", " "),
    ("parents", ("abc",)),
    ("source_hash", "abc"),
    ("frame_count", -1),
    ("frame_count", 1.5),
    ("wind", float("nan")),
    ("wind", "4"),
    ("seed", 2**63),
    ("name", "two\nlines"),
    ("name", "not unicode \udce9"),
    ("source_name", "not unicode \udce9"),
    ("session", 7),
    ("parameters", "{"),
    ("report", "not json"),
]


def test_a_malformed_value_is_refused_by_its_column() -> None:
    for column, value in MALFORMED:
        arguments: dict[str, object] = {"kind": Kind.WIND, "name": "x", column: value}
        with pytest.raises(InputError, match=column):
            Artifact(**arguments)


def test_numbers_of_numpy_have_the_identity_of_python_s(lake: Lake) -> None:
    python = Artifact(kind=Kind.CLIP, name="a", frame_first=0, frame_count=30, seed=7, wind=4.5)
    values = {
        "frame_first": np.int64(0),
        "frame_count": np.uint8(30),
        "seed": np.int32(7),
        "wind": np.float32(4.5),
    }
    numpy = Artifact(kind=Kind.CLIP, name="a", **values)
    assert numpy.id == python.id
    with lake.transaction("numpy") as tx:
        tx.add(numpy)
    assert lake.artifact(python.id).wind == 4.5


def test_a_lake_is_not_made_where_something_is(lake: Lake, tmp_path: Path) -> None:
    with pytest.raises(ConflictError, match="a lake"):
        Lake.create(lake.path)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "file").touch()
    with pytest.raises(ConflictError, match="something else"):
        Lake.create(tmp_path / "other")
    with pytest.raises(ConflictError):
        Lake.create(tmp_path / "other" / "file")


def test_a_lake_that_could_not_be_made_leaves_an_empty_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(FlagdataError, match="creating a lake failed"):
            Lake.create(tmp_path / "lake")
    assert list((tmp_path / "lake").iterdir()) == []
    assert Lake.create(tmp_path / "lake").rows().num_rows == 0


def test_of_several_processes_that_make_a_lake_at_once_one_does(tmp_path: Path) -> None:
    code = "import sys; from flagdata.cli import main; main(['init', sys.argv[1]])"
    command = [sys.executable, "-c", code, str(tmp_path / "lake")]
    started = [
        subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for _ in range(4)
    ]
    assert sorted(process.wait(timeout=500) for process in started) == [0, 1, 1, 1]
    assert doctor(Lake.open(tmp_path / "lake"), grace=NOW) == ()


def test_a_folder_without_a_lake_is_an_error_with_a_fix(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="flagdata init"):
        Lake.open(tmp_path)


def test_a_damaged_checkpoint_is_reported_with_a_fix_that_works(lake: Lake) -> None:
    for i in range(40):
        put_text(lake, str(i))
    log = lake.path / "catalog" / "_delta_log"
    checkpoints = list(log.glob("*.checkpoint.parquet"))
    assert checkpoints
    for path in checkpoints:
        path.write_bytes(b"")
    fresh = Lake.open(lake.path)
    with pytest.raises(CorruptError, match="delete _last_checkpoint"):
        fresh.rows()
    assert "ref-unreadable" in {f.kind for f in doctor(fresh)}
    for path in (*checkpoints, log / "_last_checkpoint"):
        path.unlink()
    assert Lake.open(lake.path).rows().num_rows == 40


def test_a_process_that_died_between_a_checkpoint_and_its_hint_stops_no_commit(lake: Lake) -> None:
    count = 0
    while not lake.catalog.is_due_for_tidying():
        put_text(lake, str(count))
        count += 1
    log = lake.path / "catalog" / "_delta_log"
    DeltaTable(
        lake.catalog.path.as_uri(), storage_options=lake.catalog._errors.options
    ).create_checkpoint()
    (log / "_last_checkpoint").unlink()
    (left,) = log.glob("*.checkpoint.parquet")
    later = Lake.open(lake.path)
    for i in range(count, 2 * count + 1):
        put_text(later, str(i))
    newest = max(log.glob("*.checkpoint.parquet"))
    assert newest > left
    assert json.loads((log / "_last_checkpoint").read_bytes())["version"] == int(
        newest.name.split(".")[0]
    )
    assert Lake.open(lake.path).rows().num_rows == 2 * count + 1
    assert doctor(later, grace=NOW) == ()


def test_a_lake_travels_by_pickle(lake: Lake) -> None:
    put_text(lake, "a")
    lake.rows()
    assert pickle.loads(pickle.dumps(lake)).rows()["name"].to_pylist() == ["a"]


def _rows_in_child(lake: Lake, queue: multiprocessing.SimpleQueue) -> None:
    try:
        lake.rows()
    except FlagdataError as error:
        queue.put(error.what)


def test_the_catalog_refuses_to_work_in_a_forked_child(lake: Lake) -> None:
    lake.rows()
    context = multiprocessing.get_context("fork")
    queue = context.SimpleQueue()
    child = context.Process(target=_rows_in_child, args=(lake, queue))
    child.start()
    child.join(timeout=500)
    assert child.exitcode == 0
    assert "before this process was forked" in queue.get()
