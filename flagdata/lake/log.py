"""The Delta log's entries as files: that none is missing between the first and the newest one ever acknowledged.

Entries are numbered from 0 without holes and never expire, so a hole is damage, and not noticed by a reader that takes
what comes before it for all there is. The loss of the last entries leaves no hole; therefore each commit, once its
entry is on the disk, also puts its number as a file name in the folder `refs/newest/`, outside the log, and takes lower
ones away. The number to believe is the highest, so writers need no lock for it, and it never falls.

Each entry notes the SHA-256 of the one before it, and the mark that of the newest, so that a change in any is found.
"""

from __future__ import annotations

import json
import os
import re
import stat
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from flagdata.documents import from_json
from flagdata.errors import CorruptError, FlagdataError
from flagdata.files import open_regular
from flagdata.lake.durable import put_if_absent, unreadable
from flagdata.provenance import digest, file_hash
from flagdata.storage import Place

FILE_HASH = "flagdata.file_sha256"
"""Key of a commit's info: SHA-256 of the one file of rows that the commit added."""

PREVIOUS_HASH = "flagdata.previous_sha256"
"""Key of a commit's info: SHA-256 of the log entry before it."""

_ACTIONS = {"add", "remove", "metaData", "protocol", "commitInfo", "txn", "cdc", "domainMetadata"}
_FILE = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*")
"""Names of files of rows: none leads out of the catalog's folder, also where a lake of somebody else is copied."""
_NAME = "{:020d}.json"
_ENTRY = re.compile(r"(\d{20})\.json").fullmatch
CHECKPOINT = ".checkpoint.parquet"
"""How the names of checkpoints end."""

_MARK = re.compile(r"\d{1,20}")


class LogGapError(CorruptError):
    """An entry of the catalog's log is missing, so what was committed is not known."""

    kind = "log-gap"


class Log:
    """The entries in `folder` (`_delta_log`), and the marks of the newest acknowledged one in the folder `marks`."""

    def __init__(self, folder: Place, marks: Place) -> None:
        self.folder = folder
        self.marks = marks
        self._filled: set[int] = set()
        self._numbers: dict[str, int] = {}  # name of what was in the folder → its version, -1 of no entry
        self._put = (-1, "")

    def path(self, version: int) -> Place:
        """Where the entry of a version is."""
        return self.folder / _NAME.format(version)

    def head(self) -> int:
        """The newest version.

        Raises:
            LogGapError: an entry before it, or one that was acknowledged after it, is missing, or there is none.
            CorruptError: an entry is empty or cannot be read.
        """
        acknowledged = self.acknowledged()  # first: all entries up to it were on the disk before
        present = self._present()
        if not present:
            raise LogGapError("the catalog's log is gone", where=str(self.folder), fix="restore it from a copy")
        newest = max(present)
        # A listing may leave out an entry that came while it was made, hence the second look.
        missing = [v for v in range(max(newest, acknowledged) + 1) if v not in present and not self.path(v).exists()]
        if missing:
            raise self._gap(missing, newest=newest)
        for version in sorted(present.keys() - self._filled):
            entry = self.path(version)
            if isinstance(entry, Path):
                if not _is_filled(entry):
                    self._text(version)  # raises what is wrong with it
            elif present[version] == 0:  # a store shows an entry whole or not at all
                raise self.damaged(version)
        self._filled = set(present)
        return max(newest, acknowledged)

    def files(self) -> dict[str, str | None]:
        """Name of each file that some version is made of → the SHA-256 that its commit noted, `None` in older lakes.

        Raises:
            CorruptError: an entry that cannot be read, by its name.
        """
        files: dict[str, str | None] = {}
        for version in sorted(self._present()):
            added, info = self._content(version)
            for name in added:
                files.setdefault(name, info.get(FILE_HASH))
        return files

    def changed(self) -> list[Place]:
        """Entries that are not any more what the next entry, or the mark, says they were; of older lakes' none.

        Raises:
            CorruptError: an entry that cannot be read, by its name.
        """
        noted: dict[int, str] = {}
        newest = self.acknowledged()
        if newest >= 0:
            with suppress(FileNotFoundError):  # another commit has just replaced it
                noted[newest] = _content_of(self.marks / str(newest)).strip()
        present = self._present()
        for version in sorted(present):
            previous = self._content(version)[1].get(PREVIOUS_HASH)
            if previous is not None:
                noted[version - 1] = previous
        return [self.path(v) for v in sorted(present.keys() & noted.keys()) if file_hash(self.path(v)) != noted[v]]

    def put(self, version: int, actions: Sequence[Mapping[str, Any]]) -> bool:
        """Publish the entry of `version`, one action a line; False when another writer has published it.

        This is a commit's point of no return: one link, after the entry's bytes are on the disk.

        Raises:
            OSError: what the disk refused; there is no such entry.
        """
        text = "\n".join(json.dumps(action, ensure_ascii=False, separators=(",", ":")) for action in actions)
        if not put_if_absent(self.path(version), text.encode(), what=f"version {version}"):
            return False
        self._put = (version, digest(text))
        return True

    def hash(self, version: int) -> str:
        """SHA-256 of an entry, which is not read if this process has just put it."""
        return self._put[1] if self._put[0] == version else file_hash(self.path(version))

    def entry(self, version: int) -> tuple[bytes, list[str]]:
        """The bytes of an entry, and the names of the files that it adds.

        Raises:
            CorruptError: it cannot be read.
        """
        return self._text(version).encode(), self._content(version)[0]

    def info(self, version: int) -> dict[str, Any]:
        """What the writer of an entry said of its commit.

        Raises:
            CorruptError: it cannot be read.
        """
        return self._content(version)[1]

    def adopt(self, version: int, entry: bytes) -> bool:
        """Put an entry of another lake of the same history; False where there is another one of that version."""
        path = self.path(version)
        if put_if_absent(path, entry, what=f"version {version}"):
            return True
        return _content_of(path).encode() == entry

    def _content(self, version: int) -> tuple[list[str], dict[str, str]]:
        """Names of the files that an entry adds, and its commit info."""
        try:
            actions = [from_json(line) for line in self._text(version).splitlines()]
            if not actions or not all(_ACTIONS.issuperset(action.keys()) for action in actions):
                raise self.damaged(version)
            info = next((action["commitInfo"] for action in actions if "commitInfo" in action), {})
            names = [action["add"]["path"] for action in actions if "add" in action]
            if any(not _FILE.fullmatch(name) for name in names):
                raise self.damaged(version)
            return names, dict(info)
        except (ValueError, KeyError, TypeError, AttributeError):
            raise self.damaged(version) from None

    def _text(self, version: int) -> str:
        """What an entry holds; the Delta library would take an empty one for a commit of nothing."""
        try:
            text = _content_of(self.path(version))
        except FileNotFoundError as error:  # a link that leads nowhere
            raise _unreadable(self.path(version), error) from None
        if not text:
            raise self.damaged(version)
        return text

    def damaged(self, version: int) -> CorruptError:
        """The error of a reader to whom the entry of `version` makes no sense."""
        path = self.path(version)
        fix = "restore it from a copy"
        if version == max(self._present()) and version - 1 == self.acknowledged():  # as a power cut may leave it
            fix += ", or delete it: its commit was never acknowledged"
        return CorruptError(f"the log entry {path.name} is damaged", where=str(path), fix=fix)

    def acknowledge(self, version: int) -> None:
        """Note for good that the entry of `version` is on the disk; durable when it returns."""
        self.marks.mkdir(exist_ok=True)
        put_if_absent(self.marks / str(version), f"{self.hash(version)}\n".encode())
        for lower in self._marks():
            if lower < version:
                (self.marks / str(lower)).unlink(missing_ok=True)

    def acknowledged(self) -> int:
        """The newest version that was acknowledged; -1 in a lake that has had no commit since marks are made."""
        return max(self._marks(), default=-1)

    def checkpoints(self) -> list[int]:
        """Versions at which the Delta library finds all that is in the entries before."""
        ends = CHECKPOINT
        return [int(name.removesuffix(ends)) for name in _sizes_in(self.folder) if name.endswith(ends)]

    def _present(self) -> dict[int, int | None]:
        """Version of each entry → its size, where a listing states it."""
        sizes = _sizes_in(self.folder)
        for name in sizes.keys() - self._numbers.keys():
            match = _ENTRY(name)
            self._numbers[name] = int(match[1]) if match else -1
        return {version: size for name, size in sizes.items() if (version := self._numbers[name]) >= 0}

    def _marks(self) -> list[int]:
        return [int(name) for name in _sizes_in(self.marks) if _MARK.fullmatch(name)]

    def _gap(self, missing: list[int], *, newest: int) -> LogGapError:
        names = ", ".join(self.path(version).name for version in missing[:3])
        more = f" and {len(missing) - 3} more" if len(missing) > 3 else ""
        fix = "restore it from a copy, and run neither gc nor another program on the lake before"
        if missing[0] > newest:  # what is left is a whole, older catalog
            fix += f"; to give up what was committed after version {newest} instead, empty the folder {self.marks}"
        return LogGapError(
            f"an entry of the catalog's log is missing: {names}{more}", where=str(self.path(missing[0])), fix=fix
        )


def names_in(folder: Place) -> list[str]:
    """Names of what is in a folder; nothing if the folder is not there."""
    return list(_sizes_in(folder))


def _sizes_in(folder: Place) -> dict[str, int | None]:
    """Name of what is in a folder → its size where the listing states it; nothing if the folder is not there."""
    try:
        if isinstance(folder, Path):
            return dict.fromkeys(os.listdir(folder))  # noqa: PTH208 — a path for each name takes ten times as long
        return {path.name: path.stat().st_size for path in folder.iterdir()}
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise _unreadable(folder, error) from None


def _is_filled(path: Path) -> bool:
    """Whether there is a file that is not empty."""
    try:
        status = path.stat()
    except OSError:
        return False
    return stat.S_ISREG(status.st_mode) and status.st_size > 0


def _content_of(path: Place) -> str:
    """The text of a file, which is damaged if it is not UTF-8.

    Raises:
        FileNotFoundError: it is not there.
        CorruptError: it cannot be read.
    """
    try:
        with open_regular(path) as stream:
            return stream.read().decode(errors="replace")
    except FileNotFoundError:
        raise
    except OSError as error:
        raise _unreadable(path, error) from None


def _unreadable(path: Place, error: OSError) -> FlagdataError:
    return unreadable(f"{path.name} of the catalog's log", path, error)
