"""Sound files of a campaign, each written once: by the first example that needs it, for all that
follow."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

_FOLDER = tempfile.TemporaryDirectory()


def sound(name: str, write: Callable[[Path], object]) -> Path:
    """The file or folder of that name.

    Args:
        write: makes it at a path.
    """
    path = Path(_FOLDER.name) / name
    if not path.exists():
        scratch = Path(_FOLDER.name) / str(os.getpid())
        scratch.mkdir(exist_ok=True)
        write(scratch / name)
        (scratch / name).rename(path)
    return path
