"""Files at the boundary: what may be read, and opening what is a file for certain."""

from __future__ import annotations

import errno
import os
import stat
from io import BufferedIOBase, BytesIO
from pathlib import Path

from flagdata.errors import InputError, LimitError, NotFoundError
from flagdata.storage import Place, RemotePath

MCAP = b"\x89MCAP0\r\n"
"""First bytes of an MCAP file."""
LEROBOT_INFO = "meta/info.json"
"""File that describes a LeRobot data set, within its folder."""
LEROBOT_OWN = "flagdata"
"""Key of that description with what flagdata states beside LeRobot's own: how the sides were
decided."""
LEROBOT_LABEL = "flagdata/label"
"""Column of a LeRobot data set's table of episodes with what flagdata states of each, as JSON."""
_SHOWN = 300  # letters of a path in a message
_OF_WINDOWS = frozenset({"thumbs.db", "ehthumbs.db", "desktop.ini"})


def is_beside(name: str) -> bool:
    """Checks whether a name is of a file that an operating system puts beside what a user keeps in
    a folder.

    Hidden files are, among them macOS's `.DS_Store` and `._NAME`, and Windows's Thumbs.db and
    desktop.ini.
    """
    return name.startswith(".") or name.casefold() in _OF_WINDOWS


def is_folder(path: Path) -> bool:
    """Checks whether there is a folder at a path; false for what is no path at all, as a name that
    is too long."""
    try:
        return path.is_dir()
    except OSError:
        return False


def is_mcap(path: Path) -> bool:
    """Checks whether there is a file at a path that begins as MCAP files do."""
    try:
        with open_regular(path) as stream:
            return stream.read(len(MCAP)) == MCAP
    except (OSError, ValueError):
        return False


def is_lerobot(path: Path) -> bool:
    """Checks whether there is a folder at a path that has LeRobot's description of a data set."""
    return is_folder(path) and (path / LEROBOT_INFO).is_file()


def check_input(path: Path, *, noun: str = "file", limit: int | None = None) -> None:
    """Make sure that a file can be read to its end, before it is opened.

    Devices and pipes may have no end, and opening a pipe waits for a writer. Files of the kernel,
    as those of /proc, state that they are empty.

    Args:
        noun: what the file is to the reader ("table"), for the messages.
        limit: most bytes that are read; None for any.

    Raises:
        NotFoundError: there is nothing at the path.
        InputError: a folder, a pipe or a device; or an empty file.
        LimitError: more bytes than `limit`.
    """
    short_path = str(path) if len(str(path)) <= _SHOWN else f"{str(path)[:_SHOWN]}…"
    try:
        status = path.stat()
    except (OSError, ValueError) as error:  # a path with a null byte is a ValueError
        why = (
            ""
            if isinstance(error, FileNotFoundError)
            else f" ({getattr(error, 'strerror', None) or error})"
        )
        raise NotFoundError(
            f"there is no such {noun}{why}", where=short_path, fix="check the path"
        ) from None
    if not stat.S_ISREG(status.st_mode):
        message = "a folder" if stat.S_ISDIR(status.st_mode) else "a pipe or device"
        fix = (
            f"give a {noun}"
            if stat.S_ISDIR(status.st_mode)
            else "write what it gives to a file first"
        )
        raise InputError(f"this is {message}, not a {noun}", where=short_path, fix=fix)
    if not status.st_size:
        raise InputError(f"the {noun} is empty", where=short_path, fix="copy or export it again")
    if limit is not None and status.st_size > limit:
        raise LimitError(
            f"the {noun} has {status.st_size} bytes, more than {limit}",
            where=short_path,
            fix="give a smaller file, or split it",
        )


def open_regular(path: Place) -> BufferedIOBase:
    """Opens a regular file to read its bytes; of a bucket, an object's bytes.

    Raises:
        OSError: what the system refused; or a folder, pipe or device, from which one may read
            without an end.
    """
    if isinstance(path, RemotePath):
        return BytesIO(path.read_bytes())
    descriptor = os.open(
        path, os.O_RDONLY | os.O_NONBLOCK
    )  # a pipe that nobody writes to would wait
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(errno.EINVAL, "not a regular file", str(path))
    return os.fdopen(descriptor, "rb")
