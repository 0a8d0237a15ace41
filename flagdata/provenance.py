"""Where a result comes from: canonical JSON, its hash, and the version of the code."""

from __future__ import annotations

import functools
import hashlib
import json
import subprocess
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flagdata.files import open_regular
from flagdata.storage import Place

_CHUNK = 1 << 20


def canonical(value: Mapping[str, Any]) -> str:
    """JSON with sorted keys and no blanks; NaN is refused (ValueError), since it has no JSON form."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False)


def digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def recipe_hash(recipe: Mapping[str, Any]) -> str:
    """SHA-256 of the canonical JSON of all options that shape a result."""
    return digest(canonical(recipe))


def array_hash(content: Mapping[str, Any], arrays: Iterable[NDArray[Any]]) -> str:
    """SHA-256 of plain values and of arrays with their types and shapes, hex."""
    total = hashlib.sha256()
    total.update(canonical(content).encode())
    for values in arrays:
        array = np.ascontiguousarray(values)
        total.update(f"{array.dtype.str}{array.shape}".encode())
        total.update(array.tobytes())
    return total.hexdigest()


def file_hash(path: Place) -> str:
    """SHA-256 of a file's bytes, hex.

    Raises:
        OSError: as `open_regular`.
    """
    with open_regular(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


@functools.cache
def code_version() -> str:
    """Package version, and the commit when run from a checkout ("0.1.0+3f2a9c1", "-dirty" with uncommitted changes)."""
    release = version("flagdata")
    root = Path(__file__).resolve().parent.parent
    if not (root / ".git").exists():
        return release
    described = subprocess.run(
        ["git", "describe", "--always", "--dirty", "--abbrev=7", "--exclude=*"],
        cwd=root, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return f"{release}+{described.stdout.strip()}" if described.returncode == 0 else release
