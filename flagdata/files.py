"""Files: text that a reader sees whole or not at all, and opening what is a file for certain."""

from __future__ import annotations

import errno
import os
import stat
from io import BufferedReader
from pathlib import Path


def write_text(path: Path, text: str) -> None:
    """Write `text` as UTF-8 beside `path`, then rename it, so that `path` holds the old text or all of the new one. The
    folder is made where it is missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(path.name + ".part")
    partial.write_text(text, encoding="utf-8", newline="")
    partial.replace(path)


def open_regular(path: Path) -> BufferedReader:
    """A regular file, opened to read its bytes.

    Raises:
        OSError: what the system refused; or a folder, pipe or device, from which one may read without an end.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # a pipe that nobody writes to would wait
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(errno.EINVAL, "not a regular file", str(path))
    return os.fdopen(descriptor, "rb")
