"""What every commit relies on at the place of a lake, tried before the first one: a disk, or a
bucket.

Of a disk: names that are put whole or not at all (hard links), locks that keep others out, a flush
of files and of folders, and a rename that replaces. Portable disks (exFAT, FAT32) and shares of a
network may lack any of them.

Of a store: the conditions of puts. Some servers take `If-None-Match` and `If-Match` and ignore
them: of two writers at one version both would win, and a commit would be lost without a word.
"""

from __future__ import annotations

import errno
import uuid
from functools import cache
from pathlib import Path

from flagdata.core.files.durable import (
    disk_errors,
    flush_file,
    flush_folder,
    lacking,
    lacks,
    link,
    make_folders,
)
from flagdata.core.files.file_locks import check_locks
from flagdata.errors import FlagdataError, RefusedError
from flagdata.lake.lake_locks import KernelLocks
from flagdata.storage import Place, RemotePath, StoreError
from flagdata.storage.refusals import DeniedError


@cache
def probe(staging: Place) -> None:
    """Tries in a lake's `staging/` what every commit relies on, and leaves nothing there: once a
    process and lake.

    Raises:
        RefusedError: the disk cannot do it, or the store did what it was asked not to do.
        FlagdataError: it cannot be written to.
    """
    if isinstance(staging, RemotePath):
        _probe_store(staging)
    else:
        _probe_disk(staging)


def _probe_disk(staging: Path) -> None:
    """Tries it in the folder of a lease, so that no collection takes it away, and one does if this
    process dies."""
    with disk_errors("preparing to write to the lake", staging):
        make_folders(staging)
        note = KernelLocks(staging).note()
        try:
            check_locks(note.folder)
            _check_names(note.folder)
        except RefusedError as error:
            raise RefusedError(error.what, where=str(staging.parent), fix=error.fix) from error
        finally:
            note.close()


def _check_names(folder: Path) -> None:
    """Gives names by links, also one that is taken, replaces them by renames, and flushes a file
    and the folder once.

    Raises:
        RefusedError: the disk cannot do it.
        OSError: whatever else it refused.
    """
    first, second, name = (folder / letter for letter in "abc")
    first.write_bytes(b"1")
    second.write_bytes(b"2")
    link(first, name)
    try:
        link(second, name)
    except FileExistsError:
        pass
    else:
        raise lacking(
            "gives a name that is taken away again, so that writers would lose each other's "
            "commits",
            folder,
        )
    try:
        second.replace(name)
        for path in (first, second):
            path.unlink(missing_ok=True)
            path.mkdir()
        first.rename(second)
    except OSError as error:
        if error.errno not in {errno.EEXIST, errno.ENOTEMPTY, errno.EISDIR} and not lacks(
            error, folder
        ):
            raise
        raise lacking(
            "does not replace a name that is taken by another in one step", folder, error=error
        ) from error
    if name.read_bytes() != b"2":
        raise lacking("does not replace a name that is taken by another in one step", folder)
    flush_file(name)
    flush_folder(folder)


def _probe_store(folder: RemotePath) -> None:
    """Puts one object twice in `folder`, each time only if its name is free, and replaces it by a
    version it has not.

    Raises:
        RefusedError: the store did what it was asked not to do.
        FlagdataError: it cannot be written to.
    """
    probe_object = folder / f"probe-{uuid.uuid4().hex}"
    try:
        first = probe_object.create(b"1")
        twice = probe_object.create(b"2")
        swapped = probe_object.replace_if('"00000000000000000000000000000000"', b"3") is not None
        content = probe_object.read_bytes()
        probe_object.unlink()
    except DeniedError as error:
        raise FlagdataError(
            f"this lake can be read, but not written: {error.strerror}",
            where=str(folder.parent),
            fix=error.fix,
        ) from None
    except StoreError as error:
        raise FlagdataError(
            f"this lake cannot be written: {error.strerror}",
            where=str(folder.parent),
            fix=f"{error.fix}, then try again",
        ) from None
    if not first or twice or swapped or content != b"1":
        raise RefusedError(
            "the store ignores the conditions of puts, so that writers would lose each other's "
            "commits",
            where=str(folder.parent),
            fix="use a store that keeps If-None-Match and If-Match (S3 itself does), or a lake in "
            "a local folder",
        )
