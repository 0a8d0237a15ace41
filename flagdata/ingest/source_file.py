"""A file or folder that is ingested: its identity, and whether it stayed what it was."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flagdata.core.files.regular_files import check_input, is_beside, is_folder, is_lerobot
from flagdata.core.provenance import canonical, digest, file_hash, recipe_hash
from flagdata.errors import ConflictError, InputError


@dataclass(frozen=True, kw_only=True)
class Source:
    """A file, or a folder of files, as it was when its hash was taken.

    Attributes:
        hash: SHA-256 of the file, or of the names and hashes of the folder's files; see
            `files.is_beside` for those that do not count.
        state: name, size and time of change of each file.
        further: each further file of the source, with its state.
    """

    path: Path
    hash: str
    state: tuple[tuple[str, int, int], ...]
    further: tuple[tuple[Path, tuple[tuple[str, int, int], ...]], ...] = ()

    @property
    def name(self) -> str:
        """The file's name as text; bytes that are no UTF-8 are shown as \\xNN."""
        return os.fsencode(self.path.name).decode("utf-8", "backslashreplace")

    @property
    def stem(self) -> str:
        return Path(self.name).stem

    @classmethod
    def of(cls, path: Path, *, with_files: Sequence[Path] = ()) -> Source:
        """Returns the source as it is now.

        Args:
            with_files: that make one source with it, in order; they are hashed with it.

        Raises:
            InputError: it cannot be read, or is empty, a pipe or a device; or two of several files
                are the same.
        """
        for file in (path, *with_files):
            if with_files or not is_folder(file):
                check_input(file)
        before = _state(path)
        if with_files:
            parts = [file_hash(file) for file in (path, *with_files)]
            _check_distinct((path, *with_files), parts)
            return cls(
                path=path, hash=digest("\n".join(parts)), state=before, further=_states(with_files)
            )
        if path.is_dir():
            parts = [f"{os.fsencode(name).hex()} {file_hash(path / name)}" for name, _, _ in before]
            return cls(path=path, hash=digest("\n".join(parts)), state=before)
        try:
            return cls(path=path, hash=file_hash(path), state=before)
        except OSError as error:
            raise InputError(
                f"cannot be read: {error.strerror}", where=str(path), fix="check the path"
            ) from None

    def check_unchanged(self) -> None:
        """Make sure that nothing was written to it since.

        Raises:
            ConflictError: something was.
        """
        for path, state in ((self.path, self.state), *self.further):
            if _state(path) != state:
                raise ConflictError(
                    "the file changed while it was read",
                    where=str(path),
                    fix="ingest it when it is complete",
                )

    def provenance(self, recipe: Mapping[str, Any], *, code: str) -> dict[str, str]:
        """Returns the source's facts for the metadata of a record.

        Args:
            code: version of the code that made it.
        """
        return {
            "source_name": self.name,
            "source_hash": self.hash,
            "recipe": canonical(recipe),
            "recipe_hash": recipe_hash(recipe),
            "code_version": code,
        }


def _check_distinct(paths: Sequence[Path], hashes: Sequence[str]) -> None:
    first: dict[str, Path] = {}
    for path, content_hash in zip(paths, hashes, strict=True):
        if content_hash in first:
            raise InputError(
                f"its bytes are those of {first[content_hash].name}",
                where=str(path),
                fix="name each part of a recording once",
            )
        first[content_hash] = path


def _states(paths: Sequence[Path]) -> tuple[tuple[Path, tuple[tuple[str, int, int], ...]], ...]:
    return tuple((path, _state(path)) for path in paths)


def _state(path: Path) -> tuple[tuple[str, int, int], ...]:
    """Name, size and time of change of the file, or of each file in the folder that counts, see
    `files.is_beside`; of a LeRobot data set, of each below it."""
    try:
        if not is_folder(path):
            status = path.stat()
            return ((path.name, status.st_size, status.st_mtime_ns),)
        if is_lerobot(path):
            files = [
                file for file in path.rglob("*") if file.is_file() and not is_beside(file.name)
            ]
            states = [(str(file.relative_to(path)), file.stat()) for file in files]
        else:
            with os.scandir(path) as entries:
                states = [
                    (e.name, e.stat()) for e in entries if e.is_file() and not is_beside(e.name)
                ]
        return tuple(sorted((name, status.st_size, status.st_mtime_ns) for name, status in states))
    except OSError as error:
        raise InputError(
            f"cannot be read: {error.strerror}", where=str(path), fix="check the path"
        ) from None
