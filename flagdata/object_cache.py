"""Local copies of a lake's objects, found by their hash: an object never changes, so a copy needs no renewal.

The folder is `objects` in the user's cache (see `flagdata.caches`); it keeps at most FLAGDATA_CACHE_LIMIT bytes, 20 GB
if that is not set, of all lakes together. When it is full, the copies that were used least recently go, but none that
was used within the last 15 minutes, by which a process may be reading it. Each copy is compared with its hash before it
appears. Of large objects that are read in parts there are blocks instead, `<object>.blocks/<block>`, each with its own
CRC-32 behind it.
"""

from __future__ import annotations

import os
import shutil
import time
import uuid
import zlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

from flagdata.caches import user_cache
from flagdata.checksums import content_hash, size_of
from flagdata.errors import CorruptError, InputError, UsageError
from flagdata.locks import LOCK, alone_in

LIMIT = 20 * 10**9
"""Most bytes that are kept where FLAGDATA_CACHE_LIMIT does not say."""
_IN_USE = 900.0  # s
_FILLED = 0.9
"""Share of the limit that is kept once it was reached, so that room is not made for each new copy alone."""
_PART = "part-"
_TALLY = "tally"
_BLOCKS = ".blocks"
_CRC = 4  # B


def copy_of(name: str, suffix: str) -> Path | None:
    """Finds the local copy of the object called `name` ("mcap/<sha256>"), if there is one; it counts as used now."""
    path = _cached_path(name, suffix)
    try:
        os.utime(path)
    except FileNotFoundError:
        return None
    return path


def fetched(name: str, suffix: str, *, size: int, fetch: Callable[[Path], None], where: str) -> Path:
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
                fix="run flagdata verify: it names what replaces the object; or restore it from a copy",
            )
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
    path = _cached_path(name, suffix)
    _take_room(path.parent, size_of(finished))
    os.utime(finished)  # it was used last now
    try:
        finished.rename(path)
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
    return data if checksum == _crc(data) else None  # the machine stopped before its disk had it


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
    """Delete what there is of an object on this machine."""
    _remove(_cached_path(name, suffix))
    _remove(_cached_path(name, _BLOCKS))


def _crc(data: bytes) -> bytes:
    return zlib.crc32(data).to_bytes(_CRC, "little")


def _cached_path(name: str, suffix: str) -> Path:
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
            for entry in path.iterdir() if path.suffix == _BLOCKS else (path,):
                with suppress(FileNotFoundError, InputError):  # another process has just renamed its part
                    entries.append((entry.lstat().st_mtime, entry, size_of(entry)))
    total = sum(bytes_held for _, _, bytes_held in entries) + size
    room = limit if total <= limit else limit * _FILLED
    for used, path, bytes_held in sorted(entries):
        block = path.parent != folder  # is read as a whole before anything else happens
        if (used < old or block) and (total > room or path.name.startswith(_PART)):
            _remove(path)
            total -= bytes_held
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
