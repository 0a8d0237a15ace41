"""A disk that lacks what a lake relies on is refused before the first write; new folders outlive a
power cut."""

from __future__ import annotations

import errno
import fcntl
import os
import shutil
import stat
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from flagdata.core.files.durable import DENIED
from flagdata.core.files.file_locks import alone_in, check_locks
from flagdata.core.schema import Kind
from flagdata.errors import FlagdataError, RefusedError
from flagdata.lake import Artifact, Lake, clone, doctor, place_probing
from flagdata.lake.lake_layout import FOLDERS
from tests.flagdata.lake.conftest import put_text

pytestmark = pytest.mark.disk("it is about disks")
LACKS = [
    errno.EPERM,
    errno.EACCES,
    errno.EOPNOTSUPP,
    errno.ENOSYS,
    errno.EMLINK,
    errno.EINVAL,
    errno.EXDEV,
]
"""What file systems answer to a hard link that they cannot make."""


def _refusing(number: int) -> Callable[..., Any]:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    return refuse


def _flushing(number: int, *, folders: bool) -> Callable[[int], None]:
    flush = os.fsync

    def refuse(descriptor: int) -> None:
        if stat.S_ISDIR(os.fstat(descriptor).st_mode) == folders:
            raise OSError(number, os.strerror(number))
        flush(descriptor)

    return refuse


def _overwriting(source: Path, target: Path, **_: object) -> None:
    target.write_bytes(source.read_bytes())


def _keeping(source: Path, _: Path) -> None:
    source.unlink()


DISKS: dict[str, tuple[object, str, Callable[..., Any], str]] = {
    **{
        f"no links, {errno.errorcode[n]}": (os, "link", _refusing(n), "no hard links, as exFAT")
        for n in LACKS
    },
    "links that overwrite": (os, "link", _overwriting, "gives a name that is taken away again"),
    "locks refused": (fcntl, "flock", _refusing(errno.ENOLCK), "refuses locks"),
    "locks unknown": (fcntl, "flock", _refusing(errno.ENOSYS), "refuses locks"),
    "locks for everybody": (fcntl, "flock", lambda *_: None, "grants a lock to everybody"),
    "files not flushed": (
        os,
        "fsync",
        _flushing(errno.EINVAL, folders=False),
        "confirm that a file has reached it",
    ),
    "folders not flushed": (
        os,
        "fsync",
        _flushing(errno.EINVAL, folders=True),
        "that a folder has reached it",
    ),
    "no rename over a file": (os, "replace", _refusing(errno.EEXIST), "does not replace a name"),
    "a rename that keeps the old file": (os, "replace", _keeping, "does not replace a name"),
    "no rename over a folder": (
        os,
        "rename",
        _refusing(errno.ENOTEMPTY),
        "does not replace a name",
    ),
}
"""What a disk lacks → what stands for that, and what is reported."""


@pytest.fixture(params=DISKS)
def lack(request: pytest.FixtureRequest, lake: Lake, monkeypatch: pytest.MonkeyPatch) -> str:
    """A disk that lacks something from now on, with a lake that was copied to it; what is reported
    of it."""
    module, name, stand_in, said = DISKS[request.param]
    put_text(lake, "before")
    place_probing.probe.cache_clear()
    monkeypatch.setattr(module, name, stand_in)
    return said


def test_a_disk_that_lacks_what_a_lake_relies_on_is_refused_by_name(
    lack: str, lake: Lake, tmp_path: Path
) -> None:
    writes: list[Callable[[], object]] = [
        lambda: Lake.create(tmp_path / "new"),
        lambda: Lake.adopt(tmp_path / "clone", lake),
        lambda: put_text(lake, "after"),
        lambda: lake.tag("v1"),
        lambda: lake.withdraw([lake.rows()["artifact"][0].as_py()], "no"),
    ]
    for write in writes:
        with pytest.raises(RefusedError, match=lack) as refused:
            write()
        assert "ext4, XFS, Btrfs or APFS" in refused.value.fix
        assert "permission" not in refused.value.fix
    for folder in (tmp_path / "new", tmp_path / "clone"):
        assert not folder.exists() or list(folder.iterdir()) == []
    assert Lake.open(lake.path).rows()["name"].to_pylist() == ["before"]
    assert [path for path in lake.staging.iterdir() if path.is_dir()] == []


def test_a_place_is_tried_once_by_a_process(lake: Lake, monkeypatch: pytest.MonkeyPatch) -> None:
    place_probing.probe.cache_clear()
    tried: list[Path] = []
    monkeypatch.setattr(place_probing, "_probe_disk", tried.append)
    put_text(lake, "a")
    put_text(lake, "b")
    lake.tag("v1")
    assert tried == [lake.staging]


def test_a_probe_leaves_nothing_and_takes_milliseconds(lake: Lake) -> None:
    durations = []
    for _ in range(9):
        place_probing.probe.cache_clear()
        begun = time.process_time()
        lake.check_writable()
        durations.append(time.process_time() - begun)
    assert sorted(durations)[4] < 0.02
    assert [path for path in lake.staging.iterdir() if not path.name.startswith(".")] == []
    assert doctor(lake) == ()


def test_a_process_that_died_in_a_probe_leaves_what_a_collection_takes(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    place_probing.probe.cache_clear()
    monkeypatch.setattr("flagdata.lake.lake_locks.FileNote.close", lambda note: note._file.close())
    lake.check_writable()
    assert {finding.kind for finding in doctor(lake)} == {"staging-left"}


def test_a_full_disk_is_no_disk_that_lacks_something(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    place_probing.probe.cache_clear()
    monkeypatch.setattr(os, "fsync", _refusing(errno.ENOSPC))
    with pytest.raises(FlagdataError, match=r"No space left.*free some space"):
        put_text(lake, "a")


@pytest.mark.parametrize("number", sorted(DENIED))
@pytest.mark.parametrize(("module", "name"), [(os, "link"), (os, "replace"), (fcntl, "flock")])
def test_what_this_user_may_not_do_is_no_disk_that_lacks_something(
    module: object, name: str, number: int, lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder is closed to this user between the file that is written there and its name."""
    place_probing.probe.cache_clear()
    check_locks.cache_clear()

    def close(*_: object, **__: object) -> None:
        monkeypatch.setattr(Path, "touch", _refusing(number))
        _refusing(number)()

    monkeypatch.setattr(module, name, close)
    with pytest.raises(FlagdataError) as refused:
        put_text(lake, "a")
    assert not isinstance(refused.value, RefusedError)
    assert os.strerror(number) in refused.value.what
    assert {errno.EACCES: "write permission", errno.EPERM: "your own"}[number] in refused.value.fix


@pytest.mark.parametrize("number", sorted(DENIED))
def test_a_disk_that_takes_files_and_denies_links_is_not_said_for_sure_to_have_none(
    number: int, lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    place_probing.probe.cache_clear()
    monkeypatch.setattr(os, "link", _refusing(number))
    with pytest.raises(RefusedError, match=r"no hard links, .*, or lets this user make none"):
        put_text(lake, "a")
    assert [path for path in lake.staging.iterdir() if path.is_dir()] == []


def test_a_network_that_locks_for_one_alone_what_that_one_may_write_carries_a_lake(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Linux's NFS client: flock(2), of exclusive locks."""
    place_probing.probe.cache_clear()
    flock = fcntl.flock

    def as_nfs(file: Any, mode: int) -> None:
        opened = fcntl.fcntl(file, fcntl.F_GETFL) & os.O_ACCMODE
        if opened == {fcntl.LOCK_EX: os.O_RDONLY, fcntl.LOCK_SH: os.O_WRONLY}.get(
            mode & ~fcntl.LOCK_NB
        ):
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        flock(file, mode)

    monkeypatch.setattr(fcntl, "flock", as_nfs)
    with lake.transaction("one that lives") as transaction:
        assert doctor(lake) == ()
        staged = transaction.staging(".mcap")
        staged.write_text("a")
        transaction.add(Artifact(kind=Kind.WIND, name="a", object=transaction.put(staged)))
    assert lake.rows()["name"].to_pylist() == ["a"]


@pytest.mark.parametrize("stand_in", [_refusing(errno.ENOLCK), lambda *_: None])
def test_a_folder_that_one_process_works_in_is_refused_without_locks(
    stand_in: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    check_locks.cache_clear()
    monkeypatch.setattr(fcntl, "flock", stand_in)
    with (
        pytest.raises(RefusedError, match="lock"),
        alone_in(tmp_path / "models", occupied=lambda: None),
    ):
        raise AssertionError("it was let in")


def _made_and_flushed(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Path]]:
    """Records the folders that are made and flushed, as they are."""
    seen: list[tuple[str, Path]] = []
    make, flush = os.mkdir, os.fsync

    def making(path: Any, *rest: Any, **more: Any) -> None:
        make(path, *rest, **more)
        seen.append(("made", Path(path)))

    def flushing(descriptor: int) -> None:
        flush(descriptor)
        seen.append(("flushed", Path(f"/proc/self/fd/{descriptor}").readlink()))

    monkeypatch.setattr(os, "mkdir", making)
    monkeypatch.setattr(os, "fsync", flushing)
    return seen


def _lost(seen: list[tuple[str, Path]], root: Path) -> list[Path]:
    """Lists the folders whose names a power cut would take, but transactions' own."""
    made = [
        (at, path)
        for at, (what, path) in enumerate(seen)
        if what == "made" and path.is_relative_to(root)
    ]
    return [
        path
        for at, path in made
        if path.parent.name != "staging" and ("flushed", path.parent) not in seen[at:]
    ]


def test_the_folders_of_a_new_lake_and_of_a_clone_outlive_a_power_cut(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_text(lake, "a")
    seen = _made_and_flushed(monkeypatch)
    root = tmp_path / "above" / "new"
    Lake.create(root)
    made = {path for what, path in seen if what == "made"}
    assert {root.parent, root, *(root / name for name in FOLDERS)} <= made
    clone(lake, tmp_path / "clone", bars=lambda *_: _bar())
    assert _lost(seen, tmp_path) == []


class _bar:  # noqa: N801  a context manager that reports to nobody
    def __enter__(self) -> Callable[[int], None]:
        return lambda _: None

    def __exit__(self, *_: object) -> None: ...


def test_the_folders_that_a_copy_came_without_outlive_a_power_cut(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = Path(str(lake.path))
    for name in ("model", "mcap", "zarr", "staging"):
        shutil.rmtree(root / name)
    place_probing.probe.cache_clear()
    seen = _made_and_flushed(monkeypatch)
    put_text(lake, "a")
    assert {path.name for what, path in seen if what == "made"} >= {"mcap", "staging"}
    assert _lost(seen, root) == []
