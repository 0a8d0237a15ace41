"""manifest.json: the list of all files of a folder that a command made, with size and SHA-256 of
each."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from flagdata.core.provenance import file_hash

MANIFEST = "manifest.json"


def _entry(path: Path, folder: Path) -> dict[str, Any]:
    return {
        "path": path.relative_to(folder).as_posix(),
        "bytes": path.stat().st_size,
        "sha256": file_hash(path),
    }


def write_manifest(
    folder: Path,
    about: Mapping[str, Any],
    describe: Callable[[Mapping[str, Any]], Path | None] = lambda content: None,
) -> dict[str, Any]:
    """Writes manifest.json: `about`, and path, size and SHA-256 of every file. Returns its content.

    It holds no time of day, so that the same files give the same bytes.

    Args:
        describe: writes another file about the content, which is then listed as well; returns its
            path.
    """
    content = {
        **about,
        "files": [_entry(path, folder) for path in sorted(folder.rglob("*")) if path.is_file()],
    }
    if (description := describe(content)) is not None:
        content["files"] = sorted(
            [*content["files"], _entry(description, folder)], key=lambda entry: entry["path"]
        )
    text = json.dumps(content, indent=2, allow_nan=False, ensure_ascii=False)
    (folder / MANIFEST).write_text(text + "\n", encoding="utf-8")
    return content


def unlisted_files(folder: Path, *, schema: str) -> list[str]:
    """Paths of what lies in a folder and is not listed in its manifest as it is now: other files,
    changed files, links, and the manifest itself where it cannot be read or is of another schema.
    Missing files and empty folders do not count."""
    listed = _listed_entries(folder / MANIFEST, schema)
    paths = [path for path in sorted(_entries(folder)) if path != MANIFEST or not listed]
    return [path for path in paths if not _same(folder / path, listed.get(path))]


def remove_listed(folder: Path, *, schema: str) -> None:
    """Remove the files that the manifest lists and that are as they were written, then the folders,
    itself among them.

    The manifest goes last, so that a removal that was interrupted can be repeated.

    Raises:
        OSError: the disk refuses it, or something else lies in the folder (see `unlisted_files`).
    """
    listed = _listed_entries(folder / MANIFEST, schema)
    for path in _entries(
        folder
    ):  # never a path of the manifest's own making, which may lead elsewhere
        if _same(folder / path, listed.get(path)):
            (folder / path).unlink()
    for inner, _, _ in os.walk(folder, topdown=False):
        if Path(inner) != folder:
            Path(inner).rmdir()
    (folder / MANIFEST).unlink(missing_ok=True)
    folder.rmdir()


def _listed_entries(manifest: Path, schema: str) -> dict[str, Mapping[str, Any]]:
    """Reads the entries of a manifest by path; none where it is absent, cannot be read or is of
    another schema."""
    try:
        content = json.loads(manifest.read_text(encoding="utf-8"))
        if manifest.is_symlink() or content["schema"] != schema:
            return {}
        return {str(entry["path"]): entry for entry in content["files"]}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return {}


def _entries(folder: Path) -> list[str]:
    """Paths of all that is no folder, and of links to folders."""
    paths: list[str] = []
    for inner, folders, files in os.walk(folder):
        links = [name for name in folders if (Path(inner) / name).is_symlink()]
        paths += [(Path(inner) / name).relative_to(folder).as_posix() for name in (*files, *links)]
    return paths


def _same(path: Path, entry: Mapping[str, Any] | None) -> bool:
    if entry is None or path.is_symlink() or not path.is_file():
        return False
    return path.stat().st_size == entry.get("bytes") and file_hash(path) == entry.get("sha256")
