"""Local copies of a lake's objects, found by their hash: an object never changes, so a copy needs
no renewal.

The folder is `objects` in the user's cache (see `flagdata.core.files.caches`); it keeps at most
FLAGDATA_CACHE_LIMIT bytes, 20 GB if that is not set, of all lakes together. When it is full, the
copies that were used least recently go, but none that was used within the last 15 minutes, by which
a process may be reading it. Of large objects that are read in parts there are blocks instead,
`<object>.blocks/<block>`, each with its own CRC-32 behind it.

Each copy is compared with its hash, and on the disk, before it appears. Then its stamp is written
beside it, `<object>.stamp`: since when this machine runs, and size, times and inode of each file. A
copy is believed while these are as its stamp says. Any other, as one that a power cut left or
another program changed, is compared again, once, and fetched anew where it is wrong. The stamp's
own time is when the copy was used last.
"""

from __future__ import annotations

import logging
import os
import shutil
import stat
import time
import uuid
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from flagdata.core.files.caches import user_cache
from flagdata.core.files.checksums import content_hash, size_of
from flagdata.core.files.durable import HEAL, boot, flush_folder, flush_tree
from flagdata.core.files.file_locks import LOCK, alone_in
from flagdata.errors import CorruptError, InputError, UsageError

LIMIT = 20 * 10**9
"""Most bytes that are kept where FLAGDATA_CACHE_LIMIT does not say."""
_IN_USE = 900.0  # s
_FILLED = 0.9
"""Share of the limit that is kept once it was reached, so that room is not made for each new copy
alone."""
_PART = "part-"
_TALLY = "tally"
_BLOCKS = ".blocks"
_STAMP = ".stamp"
_CRC = 4  # B
_LOG = logging.getLogger("flagdata")


def copy_of(name: str, suffix: str) -> Path | None:
    """Finds the local copy of the object called `name` ("mcap/<sha256>"), if there is one; it
    counts as used now. One that its stamp does not vouch for is compared with its name, and deleted
    where it is wrong."""
    path = _cached_path(name, suffix)
    stamp = _stamp_of(path)
    with suppress(FileNotFoundError):
        if stamp.read_bytes() == _state(path):
            os.utime(stamp)
            return path
    return path if is_whole(name, suffix) else None


def has_copy(name: str, suffix: str) -> bool:
    """Checks whether there is a local copy of an object, whole or not."""
    return os.path.lexists(_cached_path(name, suffix))


def is_whole(name: str, suffix: str) -> bool:
    """Compares the local copy of an object with its name, and deletes it where it is wrong; false
    where there is none then."""
    path = _cached_path(name, suffix)
    try:
        before = _state(path)
    except FileNotFoundError:
        return False
    content = None
    with suppress(OSError, InputError):  # a sector that cannot be read, a link
        content = content_hash(path)
    if content == name.partition("/")[2]:
        _put_stamp(path, before)
        return True
    with alone_in(path.parent, occupied=lambda: None), suppress(FileNotFoundError):
        if _state(path) == before:  # else another process has fetched it meanwhile
            forget(name, suffix)
            _LOG.warning(
                "flagdata: the local copy of %s had changed, as a power cut may leave it: it was "
                "deleted\n"
                "  where: %s\n  fix:   none needed, it is fetched again",
                name,
                path,
            )
    return False


def fetch_copy(
    name: str, suffix: str, *, size: int, fetch: Callable[[Path], None], where: str
) -> Path:
    """Fetches a local copy of an object anew.

    Args:
        suffix: of its file or folder.
        size: of the object [B]; room is made for it.
        fetch: writes the object, a file or a folder, to a path that is free.
        where: the object is, for messages.

    Raises:
        CorruptError: what was fetched does not hash to its name.
        UsageError: FLAGDATA_CACHE_LIMIT is no number of bytes.
    """
    path = _cached_path(name, suffix)
    folder = path.parent
    _take_room(folder, size)
    part = folder / f"{_PART}{uuid.uuid4().hex}{suffix}"
    try:
        fetch(part)
        if content_hash(part) != name.partition("/")[2]:
            raise CorruptError(
                f"the bytes of {name} have changed since they were written",
                where=where,
                fix=f"run flagdata verify: it names what replaces the object; or {HEAL}",
            )
        try:
            _keep(part, path)
        except OSError:  # a folder that another process has fetched meanwhile
            if not path.exists():
                raise
    finally:
        _remove(part)
    return path


def kept(name: str, suffix: str, finished: Path) -> None:
    """Make the local copy of an object out of the file or folder that was stored, which is
    moved."""
    path = _cached_path(name, suffix)
    _take_room(path.parent, size_of(finished))
    try:
        _keep(finished, path)
    except OSError:  # there is one already, or on another disk
        _remove(finished)


def block_of(name: str, block: str) -> bytes | None:
    """Reads a block of an object as it was kept, if it was; it counts as used now."""
    path = _cached_path(name, _BLOCKS) / block
    try:
        content = path.read_bytes()
        os.utime(path)
    except FileNotFoundError:
        return None
    data, checksum = content[:-_CRC], content[-_CRC:]
    return (
        data if data and checksum == _crc(data) else None
    )  # the machine stopped before its disk had it


def keep_blocks(name: str, blocks: Mapping[str, bytes]) -> None:
    """Keep blocks of an object, by their names.

    Raises:
        UsageError: FLAGDATA_CACHE_LIMIT is no number of bytes.
    """
    folder = _cached_path(name, _BLOCKS)
    _take_room(folder.parent, sum(map(len, blocks.values())) + _CRC * len(blocks))
    folder.mkdir(exist_ok=True)
    for block, data in blocks.items():
        part = folder.parent / f"{_PART}{uuid.uuid4().hex}"
        part.write_bytes(data + _crc(data))
        try:
            part.rename(folder / block)
        except FileNotFoundError:  # another process has forgotten the object
            _remove(part)


def forget(name: str, suffix: str) -> None:
    """Delete what there is of an object on this machine; that is on the disk when this returns."""
    path = _cached_path(name, suffix)
    kept_of_it = [
        entry for entry in (path, _stamp_of(path), _cached_path(name, _BLOCKS)) if _is_left(entry)
    ]
    for entry in kept_of_it:
        _remove(entry)
    if kept_of_it:
        flush_folder(path.parent)


def _keep(part: Path, path: Path) -> None:
    """Give a finished part the name of a copy, after its bytes are on the disk, and write its
    stamp."""
    flush_tree(part)
    part.rename(path)
    flush_folder(path.parent)
    _put_stamp(path, _state(path))


def _put_stamp(path: Path, state: bytes) -> None:
    part = path.with_name(f"{_PART}{uuid.uuid4().hex}")
    part.write_bytes(state)
    part.rename(_stamp_of(path))


def _stamp_of(path: Path) -> Path:
    return path.with_name(path.name + _STAMP)


def _state(path: Path) -> bytes:
    """Writes since when this machine runs, and what the file system says of each file of a copy.

    Raises:
        FileNotFoundError: there is no copy.
    """
    lines = [boot() or "", *sorted(_stated_problems(path))]
    return "\n".join(lines).encode(errors="surrogateescape")


def _stated_problems(path: Path) -> Iterator[str]:
    status = path.lstat()
    if not stat.S_ISDIR(status.st_mode):
        yield _line(path.name, status)
        return
    folders = [path]
    while folders:
        with os.scandir(folders.pop()) as entries:
            for entry in entries:
                if entry.is_dir(follow_symlinks=False):
                    folders.append(Path(entry.path))
                else:
                    yield _line(entry.path, entry.stat(follow_symlinks=False))


def _line(name: str, status: os.stat_result) -> str:
    return f"{status.st_ino} {status.st_size} {status.st_mtime_ns} {status.st_ctime_ns} {name}"


def _crc(data: bytes) -> bytes:
    return zlib.crc32(data).to_bytes(_CRC, "little")


def _cached_path(name: str, suffix: str) -> Path:
    return user_cache() / "objects" / f"{name.replace('/', '-')}{suffix}"


def _limit() -> int:
    text = os.environ.get("FLAGDATA_CACHE_LIMIT")
    if text is None:
        return LIMIT
    if not text.isdecimal():
        raise UsageError(
            f"{text!r} is no number of bytes",
            where="FLAGDATA_CACHE_LIMIT",
            fix="give a whole number",
        )
    return int(text)


def _take_room(folder: Path, size: int) -> None:
    """Delete the copies that were used least recently until there is room; parts that a killed
    process left, too."""
    limit = _limit()
    with alone_in(folder, occupied=lambda: None):
        tally = folder / _TALLY  # counted before the copy is there: it is too high at worst
        text = tally.read_text() if tally.exists() else ""
        total = int(text) + size if text.isdecimal() else None
        if total is None or total > limit:
            total = _swept(folder, size, limit)
        tally.write_text(str(total))


def _swept(folder: Path, size: int, limit: int) -> int:
    """Delete what was used least recently until there is room for `size` more; bytes that are there
    then, with it."""
    old = time.time() - _IN_USE
    entries: list[tuple[float, Path, int]] = []
    for path in folder.iterdir():
        if path.name not in (LOCK, _TALLY) and path.suffix != _STAMP:
            for entry in path.iterdir() if path.suffix == _BLOCKS else (path,):
                with suppress(
                    FileNotFoundError, InputError
                ):  # another process has just renamed its part
                    entries.append((_use(entry), entry, size_of(entry)))
    total = sum(bytes_held for _, _, bytes_held in entries) + size
    room = limit if total <= limit else limit * _FILLED
    for used, path, bytes_held in sorted(entries):
        block = path.parent != folder  # is read as a whole before anything else happens
        if (used < old or block) and (total > room or path.name.startswith(_PART)):
            _remove(path)
            _stamp_of(path).unlink(missing_ok=True)
            total -= bytes_held
    return total


def _use(entry: Path) -> float:
    """Returns when a copy, block or part was used last [s since 1970]."""
    stamp = _stamp_of(entry)
    return (stamp if stamp.exists() else entry).lstat().st_mtime


def _is_left(path: Path) -> bool:
    """Checks whether a copy is there, or what a deletion of it that was cut short left."""
    return os.path.lexists(path) or os.path.lexists(_going(path))


def _going(path: Path) -> Path:
    return path.with_name(f"{_PART}{path.name}")


def _remove(path: Path) -> None:
    """Delete a file or folder; a process that dies meanwhile leaves a part, never a copy that lacks
    files."""
    going = _going(path)
    shutil.rmtree(going, ignore_errors=True)
    if not path.is_dir():
        path.unlink(missing_ok=True)
        return
    with suppress(FileNotFoundError):  # another process was faster
        path.rename(going)
    shutil.rmtree(going, ignore_errors=True)
