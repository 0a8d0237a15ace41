"""Decoded clips on disk, so that an epoch after the first does not decode JPEG. Optional, outside
the lake, disposable.

One file a clip: a header line of JSON (what it holds, its shape and checksum) and the raw frames.
Files are written beside and renamed, so that any number of processes share a cache; one that finds
a clip missing decodes it.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import re
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from flagdata.core.arguments import check_arguments
from flagdata.core.arrays import UInt8Array
from flagdata.core.files.addresses import local_path
from flagdata.core.files.regular_files import is_beside
from flagdata.errors import FlagdataError, UsageError
from flagdata.recipes.documents import from_json

_FORMAT = "flagdata.decoded/1"
_SUFFIX = ".clip"
_NAME = re.compile(r"[0-9a-f]{64}" + re.escape(_SUFFIX))  # of a clip
_WRITING = "writing.part"  # the one file being written; only under the lock
_TALLY = "tally"  # the lock, and in it the bytes of all clips
_MAX_HEADER = 4096  # B
_ROOM = (
    0.9  # eviction goes down to this share of the limit, so that it is not needed at every write
)


@dataclass(frozen=True, kw_only=True)
class _Entry:
    path: Path
    size: int
    read: int
    """When it was last read [ns]."""


class DecodedCache:
    """A folder of decoded clips, at most `limit` bytes.

    A clip is found by its object's content hash and its frames, so a cached clip never goes stale.
    Its checksum is compared the first time a process reads it; a damaged or foreign file is deleted
    and the clip decoded anew. When the folder is full, the clips that were read least recently go.

    Args:
        path: the folder, for the cache alone; made if it is not there. Not inside a lake.
        limit: [B].

    Raises:
        UsageError: no room for anything, a folder inside a lake, or one that holds other files.
    """

    @check_arguments
    def __init__(self, path: Path | str, *, limit: int) -> None:
        self.path = local_path(path).absolute()
        self.limit = limit
        if limit < 1:
            raise UsageError(
                f"the limit of the cache is {limit} bytes", fix="give a limit above zero"
            )
        for folder in (self.path, *self.path.parents):
            if (folder / "lake.json").exists():
                raise UsageError(
                    "the cache would lie inside a lake",
                    where=str(self.path),
                    fix="choose a folder outside it: it is disposable",
                )
        self.path.mkdir(parents=True, exist_ok=True)
        with os.scandir(self.path) as entries:
            for entry in entries:
                is_of_cache = _NAME.fullmatch(entry.name) or entry.name in (_TALLY, _WRITING)
                if not is_of_cache and not is_beside(entry.name):
                    raise UsageError(
                        "the cache lies among other files",
                        where=entry.path,
                        fix="give it a new or empty folder of its own",
                    )
        self._verified: set[str] = set()

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_verified": set()}

    @check_arguments
    def frames(
        self, object_name: str, first: int, count: int, *, decode: Callable[[], UInt8Array]
    ) -> UInt8Array:
        """Frames (count, height, width) of an object, from the cache or else by `decode`, which
        fills it."""
        name = hashlib.sha256(f"{object_name}\n{first}\n{count}".encode()).hexdigest() + _SUFFIX
        identity = {"format": _FORMAT, "object": object_name, "first": first, "count": count}
        frames = self._read(name, identity)
        if frames is None:
            frames = decode()
            self._write(name, identity, frames)
        return frames

    def size(self) -> int:
        """Bytes of the clips in the folder now."""
        return sum(entry.size for entry in self._entries())

    def _read(self, name: str, identity: dict[str, Any]) -> UInt8Array | None:
        path = self.path / name
        try:
            with path.open("rb") as stream:
                line = stream.readline(_MAX_HEADER)
                header = from_json(line)
                shape = tuple(header["shape"])
                data = np.fromfile(stream, dtype=np.uint8)
                with contextlib.suppress(
                    PermissionError
                ):  # a cache that may be read only keeps its order of eviction
                    os.utime(stream.fileno())
            sound = {key: header[key] for key in identity} == identity
            if sound and name not in self._verified:
                sound = zlib.crc32(data.data) == header["crc32"]
            frames = data.reshape(shape)
        except FileNotFoundError:
            self._verified.discard(name)  # evicted; what takes its place is another file
            return None
        except (ValueError, KeyError, TypeError):
            sound, frames = False, None
        if not sound:
            path.unlink(missing_ok=True)
            return None
        self._verified.add(name)
        return frames

    def _write(self, name: str, identity: dict[str, Any], frames: UInt8Array) -> None:
        pixels = np.ascontiguousarray(frames).data
        line = (
            json.dumps(
                {**identity, "shape": list(frames.shape), "crc32": zlib.crc32(pixels)}
            ).encode()
            + b"\n"
        )
        size = len(line) + frames.nbytes
        if size > self.limit:
            return
        try:
            with self._hold_lock() as tally:
                self._take_room(tally, size)
                written = self.path / _WRITING
                with written.open("wb") as stream:
                    stream.write(line)
                    stream.write(pixels)
                written.replace(self.path / name)
        except OSError as error:
            raise FlagdataError(
                f"writing the decoded cache failed: {error.strerror or error}",
                where=str(error.filename or self.path),
                fix="free some space, give a lower limit or another folder, or load pairs without "
                "a cache",
            ) from error

    def _take_room(self, tally: BinaryIO, size: int) -> None:
        """Add `size` to the tally of bytes, evicting when it would exceed the limit. Counted before
        the file is there, so that a crash leaves the tally too high at worst; it is counted anew
        before anything is evicted."""
        text = tally.read()
        entries: list[_Entry] | None = None if text.isdigit() else self._entries()
        total = int(text) if entries is None else sum(entry.size for entry in entries)
        if total + size > self.limit:
            entries = self._entries() if entries is None else entries
            total = sum(entry.size for entry in entries)
            room = self.limit if total + size <= self.limit else _ROOM * self.limit
            for entry in sorted(entries, key=lambda entry: entry.read):
                if total + size <= room:
                    break
                entry.path.unlink(missing_ok=True)
                total -= entry.size
        tally.seek(0)
        tally.truncate()
        tally.write(str(total + size).encode())

    def _entries(self) -> list[_Entry]:
        entries: list[_Entry] = []
        with os.scandir(self.path) as scan:
            for entry in scan:
                if _NAME.fullmatch(entry.name):
                    with contextlib.suppress(FileNotFoundError):
                        status = entry.stat()
                        entries.append(
                            _Entry(
                                path=Path(entry.path), size=status.st_size, read=status.st_mtime_ns
                            )
                        )
        return entries

    @contextlib.contextmanager
    def _hold_lock(self) -> Iterator[BinaryIO]:
        """Lets one writer work at a time, across processes; the lock dies with its holder. Yields
        the tally, at its start."""
        with (self.path / _TALLY).open("a+b") as tally:
            fcntl.flock(tally, fcntl.LOCK_EX)
            tally.seek(0)
            yield tally
