"""Writing that survives a crash: flush file, then folder; put a file only if its name is free.

Once a name is public nothing takes it back: what the disk refuses after that is a warning (the
logger "flagdata"), never an error, since an error means to the caller that nothing was published.
"""

from __future__ import annotations

import errno
import logging
import os
import re
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from flagdata.errors import CorruptError, FlagdataError, RefusedError
from flagdata.storage import Place, RemotePath, StoreError
from flagdata.storage.connection import COLOUR

HEAL = "flagdata heal FROM, a clone or a backup of this lake"
"""What puts back a file of a lake that is damaged or missing."""
SCRATCH = re.compile(r"\.[0-9a-f]{32}")
"""Names of files that are written before they are linked under their own."""
_LOG = logging.getLogger("flagdata")


LACKS = frozenset(
    {
        errno.EBADF,
        errno.EINVAL,
        errno.EMLINK,
        errno.ENOLCK,
        errno.ENOSYS,
        errno.ENOTSUP,
        errno.EOPNOTSUPP,
        errno.EXDEV,
    }
)
"""What a file system answers where it lacks what it was asked for: a link, a lock, a flush."""
DENIED = frozenset({errno.EACCES, errno.EPERM})
"""What it answers where it lacks that (exFAT and FAT32 so refuse links; CIFS and FUSE as their
servers do), and what it answers to a user who may not."""


def lacks(error: OSError, folder: Path) -> bool:
    """Checks whether a file system refused something in a folder since it lacks that: not where it
    takes no new file from this user either, which is a matter of permissions."""
    if error.errno not in DENIED:
        return error.errno in LACKS
    scratch = folder / f".{uuid.uuid4().hex}"
    try:
        scratch.touch(exist_ok=False)
        scratch.unlink()
    except OSError:
        return False
    return True


def lacking(lack: str, where: Path, *, error: OSError | None = None) -> RefusedError:
    """Returns the error for a disk that cannot do what writing that survives a crash, or other
    processes, takes.

    Args:
        lack: goes on with "this disk".
        error: by which it said so.
    """
    said = "" if error is None else f" ({error.strerror})"
    return RefusedError(
        f"this disk {lack}{said}",
        where=str(where),
        fix="use a disk of this machine that is formatted as ext4, XFS, Btrfs or APFS, or for a "
        "lake a bucket "
        "(s3://bucket/prefix); what lies here can be read, and copied there",
    )


def flush_file(path: Path) -> None:
    """Forces a file's bytes to the disk.

    Raises:
        RefusedError: the disk does not say when they are there.
        OSError: whatever else it refused.
    """
    _flush(path, "a file")


def flush_folder(path: Path) -> None:
    """Forces a folder's entries (names that were added, renamed, removed) to the disk; raises as
    `flush_file`."""
    _flush(path, "a folder")


def _flush(path: Path, noun: str) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if not lacks(error, path if path.is_dir() else path.parent):
            raise
        raise lacking(f"does not confirm that {noun} has reached it", path, error=error) from error
    finally:
        os.close(descriptor)


def make_folders(*paths: Place) -> None:
    """Makes folders, and those above them that are missing; their names are on the disk when this
    returns.

    Raises:
        FileExistsError: there is a file of that name.
        RefusedError, OSError: as `flush_file`.
    """
    holding: dict[Path, None] = {}
    for path in paths:
        if isinstance(path, RemotePath):  # a bucket has no folders
            continue
        holding |= dict.fromkeys(
            folder.parent for folder in (path, *path.parents) if not folder.exists()
        )
        path.mkdir(parents=True, exist_ok=True)
    for folder in holding:
        flush_folder(folder)


def flush_tree(path: Path) -> None:
    """Forces a file, or all that is in a folder, to the disk."""
    for folder, _, names in os.walk(path):
        for name in names:
            flush_file(Path(folder, name))
        flush_folder(Path(folder))
    if not path.is_dir():
        flush_file(path)


@cache
def boot() -> str | None:
    """Identifies this machine since it was started; `None` where it does not say."""
    with suppress(OSError):
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    return None


def write_durably(path: Place, data: bytes) -> None:
    """Write a new file; its bytes and its name are on the disk when this returns."""
    path.write_bytes(data)
    if isinstance(path, Path):
        flush_file(path)
        flush_folder(path.parent)


def put_if_absent(path: Place, data: bytes, *, noun: str | None = None) -> bool:
    """Create `path` with all of `data`, or leave what is there; False when the name was taken.

    The bytes are written and flushed beside it under another name, then linked: the name appears
    whole or not at all.

    Args:
        noun: is published by it, for a warning; the file by its name if `None`.

    Raises:
        RefusedError: the disk has no hard links, or does not confirm what is written; the name was
            not taken.
        OSError: whatever else the disk refused; the name was not taken.
    """
    if isinstance(path, RemotePath):
        return path.create(data)
    scratch = path.with_name(f".{uuid.uuid4().hex}")
    try:
        scratch.write_bytes(data)
        flush_file(scratch)
        link(scratch, path)
    except FileExistsError:
        scratch.unlink(missing_ok=True)
        return False
    except BaseException:
        with suppress(OSError):  # what is left is a collection's
            scratch.unlink(missing_ok=True)
        raise
    noun = noun or f"the file {path.name}"
    with confirming(noun, path):
        flush_folder(path.parent)
    with confirming(noun, path):
        scratch.unlink(missing_ok=True)
    return True


def link(file: Path, path: Path) -> None:
    """Gives a file a second name.

    Raises:
        FileExistsError: the name is taken.
        RefusedError: the disk has no hard links.
        OSError: whatever else it refused.
    """
    try:
        os.link(file, path)
    except OSError as error:
        if not lacks(error, path.parent):
            raise
        lack = "has no hard links, as exFAT and FAT32 have none"
        if error.errno in DENIED:
            lack += ", or lets this user make none"
        raise lacking(lack, path.parent, error=error) from error


def replace_durably(path: Place, data: bytes) -> None:
    """Put a file in place of what is there, or of nothing; durable when it returns.

    The bytes are written and flushed beside it, so that the name has all of them or what it had
    before.

    Raises:
        OSError: what the disk refused; the name has what it had before.
    """
    if isinstance(path, RemotePath):
        path.write_bytes(data)
        return
    scratch = path.with_name(f".{uuid.uuid4().hex}")
    try:
        scratch.write_bytes(data)
        flush_file(scratch)
        scratch.replace(path)
    except BaseException:
        with suppress(OSError):  # what is left is a collection's
            scratch.unlink(missing_ok=True)
        raise
    flush_folder(path.parent)


@contextmanager
def confirming(noun: str, where: Place) -> Iterator[None]:
    """Works on `noun` after it was published: what the disk refuses is a warning, since it stays
    published."""
    try:
        yield
    except (OSError, FlagdataError) as error:
        refused = isinstance(error, OSError)
        refusal = (error.strerror or str(error)) if refused else error.what
        _LOG.warning(
            "flagdata: warning: %s is published, but the disk did not confirm it (%s)\n  where: "
            "%s\n  fix:   %s",
            noun,
            " ".join(refusal.split()),
            (error.filename if refused else error.where) or where,
            "check the disk, then run flagdata doctor: until it confirms, a power cut may lose it",
        )


@contextmanager
def disk_errors(doing: str, where: Place) -> Iterator[None]:
    """Turn what the operating system refuses (no space, no permission, read-only) into a clear
    error.

    Raises:
        FlagdataError: for any OSError inside the block.
    """
    try:
        yield
    except OSError as error:
        text = " ".join(COLOUR.sub("", error.strerror or str(error)).split())
        number = error.errno or (
            int(number_in_text[1] or number_in_text[2])
            if (number_in_text := _NUMBER.search(text))
            else 0
        )
        fix = error.fix if isinstance(error, StoreError) else _FIXES.get(number, "check the disk")
        raise FlagdataError(
            f"{doing} failed: {text}",
            where=str(error.filename or where),
            fix=f"{fix}, then do it again",
        ) from error


def unreadable(noun: str, where: Place, error: OSError) -> FlagdataError:
    """Returns the error for a file of the lake that cannot be read: damaged or closed to this user
    on a disk; in a bucket, what the store says and its remedy, since the file itself may be whole.

    Args:
        noun: is read.
    """
    message = f"{noun} cannot be read: {error.strerror}"
    if isinstance(error, StoreError):
        return FlagdataError(message, where=str(where), fix=error.fix)
    return CorruptError(
        message, where=str(where), fix=f"give yourself read permission on it, or {HEAL}"
    )


_NUMBER = re.compile(r"\(os error (\d+)\)|\bOs \{ code: (\d+)")  # as the Delta library writes it
_FIXES = {
    errno.ENOSPC: "free some space, or move the lake to a larger disk",
    errno.EDQUOT: "free some space, or ask for a larger quota",
    errno.EFBIG: "raise the file size limit (ulimit -f)",
    errno.EACCES: "give yourself read and write permission on the folder",
    errno.EPERM: "make the folder and what is in it your own, and nothing of it immutable",
    errno.EROFS: "mount the disk writable",
}
