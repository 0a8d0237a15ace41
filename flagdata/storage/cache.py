"""Local copies of a lake's objects, found by their hash: an object never changes, so a copy needs no renewal.

The folder is `objects` in the user's cache (see `flagdata.caches`); it keeps at most FLAGDATA_CACHE_LIMIT bytes, 20 GB
if that is not set, of all lakes together. When it is full, the copies that were used least recently go, but none that
was used within the last 15 minutes, by which a process may be reading it. Each copy is compared with its hash before it
appears.
"""

from __future__ import annotations

import os
import shutil
import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from flagdata.caches import user_cache
from flagdata.checksums import content_hash, size_of
from flagdata.errors import CorruptError, InputError, UsageError
from flagdata.locks import LOCK, alone_in

LIMIT = 20 * 10**9
"""Most bytes that are kept where FLAGDATA_CACHE_LIMIT does not say."""
_IN_USE = 900.0  # s
_PART = "part-"
_TALLY = "tally"


def copy_of(name: str, suffix: str) -> Path | None:
    """The local copy of the object called `name` ("mcap/<sha256>"), if there is one; it counts as used now."""
    path = _place(name, suffix)
    try:
        os.utime(path)
    except FileNotFoundError:
        return None
    return path


def fetched(name: str, suffix: str, *, size: int, fetch: Callable[[Path], None], where: str) -> Path:
    """A local copy of an object, fetched anew.

    Args:
        suffix: of its file or folder.
        size: of the object [B]; room is made for it.
        fetch: writes the object, a file or a folder, to a path that is free.
        where: the object is, for messages.

    Raises:
        CorruptError: what was fetched does not hash to its name.
        UsageError: FLAGDATA_CACHE_LIMIT is no number of bytes.
    """
    path = _place(name, suffix)
    folder = path.parent
    _take_room(folder, size)
    part = folder / f"{_PART}{uuid.uuid4().hex}{suffix}"
    try:
        fetch(part)
        if content_hash(part) != name.partition("/")[2]:
            raise CorruptError(
                f"the bytes of {name} have changed since they were written", where=where,
                fix="ingest the source again (it replaces the object), or restore it from a copy",
            )  # fmt: skip
        try:
            part.rename(path)
        except OSError:  # a folder that another process has fetched meanwhile
            if not path.exists():
                raise
    finally:
        _remove(part)
    return path


def kept(name: str, suffix: str, finished: Path) -> None:
    """Make the local copy of an object out of the file or folder that was stored, which is moved."""
    path = _place(name, suffix)
    _take_room(path.parent, size_of(finished))
    os.utime(finished)  # it was used last now
    try:
        finished.rename(path)
    except OSError:  # there is one already, or on another disk
        _remove(finished)


def forget(name: str, suffix: str) -> None:
    """Delete the local copy of an object, if there is one."""
    _remove(_place(name, suffix))


def _place(name: str, suffix: str) -> Path:
    return user_cache() / "objects" / f"{name.replace('/', '-')}{suffix}"


def _limit() -> int:
    text = os.environ.get("FLAGDATA_CACHE_LIMIT")
    if text is None:
        return LIMIT
    if not text.isdecimal():
        raise UsageError(f"{text!r} is no number of bytes", where="FLAGDATA_CACHE_LIMIT", fix="give a whole number")
    return int(text)


def _take_room(folder: Path, size: int) -> None:
    """Delete the copies that were used least recently until there is room; parts that a killed process left, too."""
    limit = _limit()
    with alone_in(folder, occupied=lambda: None):
        tally = folder / _TALLY  # counted before the copy is there: it is too high at worst
        text = tally.read_text() if tally.exists() else ""
        total = int(text) + size if text.isdecimal() else None
        if total is None or total > limit:
            total = _swept(folder, size, limit)
        tally.write_text(str(total))


def _swept(folder: Path, size: int, limit: int) -> int:
    """Delete what was used least recently until there is room for `size` more; bytes that are there then, with it."""
    old = time.time() - _IN_USE
    entries: list[tuple[float, Path, int]] = []
    for path in folder.iterdir():
        if path.name not in (LOCK, _TALLY):
            with suppress(FileNotFoundError, InputError):  # another process has just renamed its part
                entries.append((path.lstat().st_mtime, path, size_of(path)))
    total = sum(held for _, _, held in entries) + size
    for used, path, held in sorted(entries):
        if used < old and (total > limit or path.name.startswith(_PART)):
            _remove(path)
            total -= held
    return total


def _remove(path: Path) -> None:
    """Delete a file or folder; a process that dies meanwhile leaves a part, never a copy that lacks files."""
    if not path.is_dir():
        path.unlink(missing_ok=True)
        return
    part = path.with_name(f"{_PART}{uuid.uuid4().hex}{path.suffix}")
    with suppress(FileNotFoundError):  # another process was faster
        path.rename(part)
    shutil.rmtree(part, ignore_errors=True)
