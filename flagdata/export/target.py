"""The folder an export goes to: whole under its name or not there at all, with a manifest of every file in it."""

from __future__ import annotations

import json
import os
import shutil
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from flagdata.errors import ConflictError
from flagdata.lake.durable import disk_errors
from flagdata.provenance import file_hash

MANIFEST = "manifest.json"
SCHEMA = "flagdata.export/1"


@contextmanager
def fresh_folder(target: Path) -> Iterator[Path]:
    """A scratch folder beside `target` that becomes `target` when the block ends, by one rename after an fsync.

    When the block fails it is removed. A killed process leaves it under a name that starts with a dot.

    Raises:
        ConflictError: `target` is there, before or after the block.
        FlagdataError: no space, no permission, no folder.
    """
    _refuse_existing(target)
    parent = target.absolute().parent
    partial = parent / f".{target.name}.{uuid.uuid4().hex}.partial"
    with disk_errors("writing an export", target):
        parent.mkdir(parents=True, exist_ok=True)
        partial.mkdir()
        try:
            yield partial
            for path in [*partial.rglob("*"), partial]:
                _sync(path)
            _refuse_existing(target)
            partial.rename(target)
            _sync(parent)
        finally:
            shutil.rmtree(partial, ignore_errors=True)


def _refuse_existing(target: Path) -> None:
    if target.exists() or target.is_symlink():
        raise ConflictError(f"{target} exists", fix="export to another folder, or remove this one first")


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def write_manifest(folder: Path, about: Mapping[str, Any]) -> dict[str, Any]:
    """Write manifest.json: `about`, and path, size and SHA-256 of every file. Returns its content.

    It holds no time of day, so that exporting the same version again gives the same bytes.
    """
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    files = [
        {"path": path.relative_to(folder).as_posix(), "bytes": path.stat().st_size, "sha256": file_hash(path)}
        for path in paths
    ]
    content = {"schema": SCHEMA, **about, "files": files}
    text = json.dumps(content, indent=2, allow_nan=False, ensure_ascii=False)
    (folder / MANIFEST).write_text(text + "\n", encoding="utf-8")
    return content
