"""Where a result comes from: canonical JSON, its hash, and the version of the code."""

from __future__ import annotations

import functools
import hashlib
import json
import os
import subprocess
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.arrays import AnyArray
from flagdata.core.files.regular_files import open_regular
from flagdata.storage import Place

_CHUNK = 1 << 20


def canonical(value: Mapping[str, Any]) -> str:
    """Writes JSON with sorted keys and no blanks; NaN is refused (ValueError), since it has no JSON
    form."""
    return json.dumps(
        value, sort_keys=True, separators=(",", ":"), allow_nan=False, ensure_ascii=False
    )


def digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def recipe_hash(recipe: Mapping[str, Any]) -> str:
    """Computes the SHA-256 of the canonical JSON of all options that shape a result."""
    return digest(canonical(recipe))


def array_hash(content: Mapping[str, Any], arrays: Iterable[AnyArray]) -> str:
    """Computes the SHA-256 of plain values and of arrays with their types and shapes, hex."""
    total = hashlib.sha256()
    total.update(canonical(content).encode())
    for values in arrays:
        array = np.ascontiguousarray(values)
        total.update(f"{array.dtype.str}{array.shape}".encode())
        total.update(array.tobytes())
    return total.hexdigest()


def file_hash(path: Place) -> str:
    """Computes the SHA-256 of a file's bytes, hex.

    Raises:
        OSError: as `open_regular`.
    """
    with open_regular(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


@functools.cache
def code_version() -> str:
    """Returns package version, and the commit when run from a checkout: "0.1.0+3f2a9c1". With
    uncommitted changes it is "0.1.0+3f2a9c1-dirty.5d41e0b", whose last part is a hash of them,
    files that git does not track aside."""
    release, commit = version("flagdata"), commit_of(Path(__file__).resolve().parents[2])
    return release if commit is None else f"{release}+{commit}"


def commit_of(root: Path) -> str | None:
    """Returns the commit of a checkout with a hash of what was changed since, as in `code_version`;
    `None` where it is none."""
    if not (root / ".git").exists():
        return None
    described = _git(root, "describe", "--always", "--dirty", "--abbrev=7", "--exclude=*")
    if described is None:
        return None
    commit = described.decode().strip()
    changes = _git(root, "diff", "HEAD") if commit.endswith("-dirty") else None
    return commit if changes is None else f"{commit}.{hashlib.sha256(changes).hexdigest()[:7]}"


def _git(root: Path, *arguments: str) -> bytes | None:
    """Asks git about the checkout at `root` and no other: what git sets for its hooks names
    theirs."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    done = subprocess.run(
        ["git", *arguments], cwd=root, env=environment, capture_output=True, check=False
    )
    return done.stdout if done.returncode == 0 else None
