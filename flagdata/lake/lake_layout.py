"""The lake's own folders: none is a link, all can be written before work begins, and what in them
is no plain file.

Reading follows links, as a copy made of links needs. Whatever writes or deletes refuses a lake
whose folders are not
its own: through a linked store it would change files of another lake.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from flagdata.core.files.durable import SCRATCH, disk_errors
from flagdata.errors import CorruptError, ErrorKind, FlagdataError
from flagdata.storage import Place, RemotePath

STORES = {"mcap": ".mcap", "zarr": ".zarr", "model": ".model"}
STAGING = "staging"
_NOTES = (
    "catalog",
    "catalog/_delta_log",
    "refs",
    "refs/tags",
    "refs/branches",
    "refs/newest",
    "refs/history",
)
FOLDERS = (*_NOTES, STAGING, *STORES)
"""All folders of a lake, each after the one it is in; a store or mark that is missing is made when
needed."""


class LinkError(CorruptError):
    """A link or special file where the lake keeps folders and files of its own."""

    kind = ErrorKind.LINK


def check_own(root: Place) -> None:
    """Checks whether all folders of the lake at `root`, a path without links, are folders of the
    lake itself.

    Raises:
        LinkError: one is a link, or no folder.
    """
    if isinstance(root, RemotePath):  # a bucket has neither folders nor links
        return
    for path in (root / name for name in FOLDERS):
        if os.path.lexists(path) and not stat.S_ISDIR(path.lstat().st_mode):
            raise LinkError(
                "a folder of this lake is a link, or no folder: writing would change what lies "
                "elsewhere",
                where=str(path),
                fix="put the folder itself in its place: move it here, or mount its disk here",
            )


def check_writable(root: Place) -> None:
    """Checks whether this process may write in the lake at `root`, as far as that can be said
    without writing: `flagdata.lake.place_probing` says the rest.

    Raises:
        LinkError: as `check_own`.
        FlagdataError: the disk is mounted read-only, or a permission is missing.
    """
    if isinstance(root, RemotePath):
        return
    check_own(root)
    for path in (root / name for name in FOLDERS):
        folder = next(place for place in (path, *path.parents) if place.exists())
        if not os.access(folder, os.W_OK | os.X_OK):
            mounted = bool(os.statvfs(folder).f_flag & os.ST_RDONLY)
            raise FlagdataError(
                "this lake can be read, but not written",
                where=str(folder),
                fix="mount its disk writable, or copy the lake to one that is"
                if mounted
                else "give yourself write permission on this folder, or copy the lake",
            )


def scratch_files(root: Place) -> Sequence[Place]:
    """Lists what a process left that died while it put a file: the marker, a ref, a mark."""
    if isinstance(root, RemotePath):
        return []
    folders = [root, *(root / name for name in _NOTES)]
    return sorted(
        path for folder in folders for path in folder.glob(".*") if SCRATCH.fullmatch(path.name)
    )


def foreign_entries(root: Place) -> Iterator[Path]:
    """Links and special files anywhere in the lake at `root`, but what lies in its staging; no link
    is followed."""
    if isinstance(root, RemotePath):
        return
    inside = [root]
    while inside:
        folder = inside.pop()
        with (
            disk_errors("looking through the lake", folder),
            suppress(FileNotFoundError),  # of an object that was replaced or collected meanwhile
            os.scandir(folder) as entries,
        ):
            for entry in entries:
                if entry.is_dir(follow_symlinks=False):
                    if entry.path != str(root / STAGING):
                        inside.append(Path(entry.path))
                elif not entry.is_file(follow_symlinks=False):
                    yield Path(entry.path)
