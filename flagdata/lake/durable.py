"""Writing that survives a crash: flush file, then folder; put a file only if its name is free."""

from __future__ import annotations

import errno
import os
import re
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from flagdata.errors import FlagdataError


def flush_file(path: Path) -> None:
    """Force a file's bytes to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def flush_folder(path: Path) -> None:
    """Force a folder's entries (names that were added, renamed, removed) to the disk."""
    flush_file(path)


def put_if_absent(path: Path, data: bytes) -> bool:
    """Create `path` with all of `data`, or leave what is there; False when the name was taken.

    The bytes are written and flushed beside it under another name, then linked: the name appears whole or not at all.
    """
    scratch = path.with_name(f".{uuid.uuid4().hex}")
    try:
        scratch.write_bytes(data)
        flush_file(scratch)
        try:
            os.link(scratch, path)
        except FileExistsError:
            return False
    finally:
        scratch.unlink(missing_ok=True)
    flush_folder(path.parent)
    return True


@contextmanager
def disk_errors(doing: str, where: Path) -> Iterator[None]:
    """Turn what the operating system refuses (no space, no permission, read-only) into a clear error.

    Raises:
        FlagdataError: for any OSError inside the block.
    """
    try:
        yield
    except OSError as error:
        text = " ".join(_COLOUR.sub("", error.strerror or str(error)).split())
        number = error.errno or (int(found[1]) if (found := _NUMBER.search(text)) else 0)
        raise FlagdataError(
            f"{doing} failed: {text}",
            where=str(error.filename or where),
            fix=f"{_FIXES.get(number, 'check the disk that holds the lake')}, then do it again",
        ) from error


_COLOUR = re.compile(r"\x1b\[\d+m")
_NUMBER = re.compile(r"\(os error (\d+)\)")  # as the Delta library writes it
_FIXES = {
    errno.ENOSPC: "free some space, or move the lake to a larger disk",
    errno.EDQUOT: "free some space, or ask for a larger quota",
    errno.EFBIG: "raise the file size limit (ulimit -f)",
    errno.EACCES: "give yourself write permission on the lake's folder",
    errno.EPERM: "give yourself write permission on the lake's folder",
    errno.EROFS: "mount the disk writable",
}
