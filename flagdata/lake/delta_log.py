"""The Delta log's entries as files: that none is missing between the first and the newest one ever
acknowledged.

Entries are numbered from 0 without holes and never expire, so a hole is damage, and not noticed by
a reader that takes what comes before it for all there is. The loss of the last entries leaves no
hole; therefore each commit, once its entry is on the disk, also puts its number as a file name in
the folder `refs/newest/`, outside the log, and takes lower ones away. The number to believe is the
highest, so writers need no lock for it, and it never falls.

Each entry notes the SHA-256 of the one before it, and the mark that of the newest, so that a change
in any is found when entries are read in a row, and by `verify`.

A number that a name states may be anything, in a damaged listing or a lake of other users. Nothing
is counted up to it.
"""

from __future__ import annotations

import json
import os
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import count, islice, pairwise, takewhile
from pathlib import Path
from typing import Any

from flagdata.core.files.durable import HEAL, make_folders, put_if_absent, unreadable
from flagdata.core.files.regular_files import open_regular
from flagdata.core.numbered import read_bounded
from flagdata.core.provenance import digest, file_hash
from flagdata.errors import CorruptError, ErrorKind, FlagdataError
from flagdata.recipes.documents import from_json
from flagdata.storage import Place

FILE_HASH = "flagdata.file_sha256"
"""Key of a commit's info: SHA-256 of the one file of rows that the commit added."""

PREVIOUS_HASH = "flagdata.previous_sha256"
"""Key of a commit's info: SHA-256 of the log entry before it."""

_ACTIONS = {"add", "remove", "metaData", "protocol", "commitInfo", "txn", "cdc", "domainMetadata"}
_FILE = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*")
"""Names of files of rows: none leads out of the catalog's folder, also where a lake of somebody
else is copied."""
_NAME = "{:020d}.json"
_ENTRY = re.compile(r"([0-9]{20})\.json").fullmatch
CHECKPOINT = ".checkpoint.parquet"
"""How the names of checkpoints end."""

_CHECKPOINT = re.compile(r"([0-9]{20})" + re.escape(CHECKPOINT)).fullmatch
_MARK = re.compile(r"[0-9]{1,20}").fullmatch
NEWEST_NUMBER = 10**20 - 1
"""Highest version that the name of an entry, a checkpoint or a mark states."""
_COUNT = re.compile(r"[0-9]{1,18}").fullmatch
_LATEST = 253_402_300_800_000  # ms since 1970: the year 10000
_NAMED = 3  # missing entries that a message names
_AT_ONCE = 16  # entries of a bucket that are read at the same time


class LogGapError(CorruptError):
    """An entry of the catalog's log is missing, so what was committed is not known."""

    kind = ErrorKind.LOG_GAP


@dataclass(frozen=True, kw_only=True)
class Entry:
    """An entry of the log, as it was read.

    Attributes:
        files: names of the files that it adds.
        info: what the writer said of its commit.
        hash: SHA-256 of the entry.
    """

    files: Sequence[str]
    info: Mapping[str, Any]
    hash: str


class Log:
    """The entries in `folder` (`_delta_log`), and the marks of the newest acknowledged one in the
    folder `marks`."""

    def __init__(self, folder: Place, marks: Place) -> None:
        self.folder = folder
        self.marks = marks
        self._filled: set[int] = set()
        self._numbers: dict[
            str, int
        ] = {}  # name of what was in the folder → its version, -1 of no entry
        self._put = (-1, "")

    def path(self, version: int) -> Place:
        """Returns where the entry of a version is."""
        return self.folder / _NAME.format(version)

    def head(self) -> int:
        """Finds the newest version.

        Raises:
            LogGapError: an entry before it, or one that was acknowledged after it, is missing, or
                there is none.
            CorruptError: an entry is empty or cannot be read.
        """
        acknowledged = self.acknowledged()  # first: all entries up to it were on the disk before
        present = self.present()
        if not present:
            raise LogGapError("the catalog's log is gone", where=str(self.folder), fix=HEAL)
        newest = max(present)
        missing = list(islice(self._missing(present, upto=max(newest, acknowledged)), _NAMED))
        if missing:
            raise self._gap(missing, present, acknowledged=acknowledged)
        for version in sorted(present.keys() - self._filled):
            entry = self.path(version)
            if isinstance(entry, Path):
                if not _is_filled(entry):
                    self._text(version)  # raises what is wrong with it
            elif present[version] == 0:  # a store shows an entry whole or not at all
                raise self.damaged(version)
        self._filled = set(present)
        return max(newest, acknowledged)

    def _missing(self, present: Mapping[int, object], *, upto: int) -> Iterator[int]:
        """Yields the versions that have no entry, each looked for as it is asked for."""
        if len(present) == upto + 1:
            return
        for before, after in pairwise([-1, *sorted(present), upto + 1]):
            for version in takewhile(after.__gt__, count(before + 1)):
                if not self.path(
                    version
                ).exists():  # a listing may leave out an entry that came while it was made
                    yield version

    def files(self) -> dict[str, str | None]:
        """Name of each file that some version is made of → the SHA-256 that its commit noted,
        `None` in older lakes.

        Raises:
            CorruptError: an entry that cannot be read, by its name.
        """
        files: dict[str, str | None] = {}
        for version in sorted(self.present()):
            added, info = self._content(version)
            for name in added:
                files.setdefault(name, info.get(FILE_HASH))
        return files

    def changed_entries(self) -> list[Place]:
        """Entries that are not any more what the next entry, or the mark, says they were; of older
        lakes' none.

        Raises:
            CorruptError: an entry that cannot be read, by its name.
        """
        noted: dict[int, str] = {}
        if (marked := self.marked(newest := self.acknowledged())) is not None:
            noted[newest] = marked
        present = self.present()
        for version in sorted(present):
            previous = self._content(version)[1].get(PREVIOUS_HASH)
            if previous is not None:
                noted[version - 1] = previous
        return [
            self.path(v)
            for v in sorted(present.keys() & noted.keys())
            if file_hash(self.path(v)) != noted[v]
        ]

    def put(self, version: int, actions: Sequence[Mapping[str, Any]]) -> bool:
        """Publish the entry of `version`, one action a line; False when another writer has
        published it.

        This is a commit's point of no return: one link, after the entry's bytes are on the disk.

        Raises:
            OSError: what the disk refused; there is no such entry.
        """
        text = "\n".join(
            json.dumps(action, ensure_ascii=False, separators=(",", ":")) for action in actions
        )
        if not put_if_absent(self.path(version), text.encode(), noun=f"version {version}"):
            return False
        self._put = (version, digest(text))
        return True

    def hash(self, version: int) -> str:
        """Returns the SHA-256 of an entry, which is not read if this process has just put it."""
        return self._put[1] if self._put[0] == version else file_hash(self.path(version))

    def entry(self, version: int) -> tuple[bytes, list[str]]:
        """Reads the bytes of an entry, and the names of the files that it adds.

        Raises:
            CorruptError: it cannot be read.
        """
        return self._text(version).encode(), self._content(version)[0]

    def entries(self, versions: Sequence[int], *, head: int) -> list[Entry]:
        """Reads the entries of consecutive versions, each of which is what the next one, or the
        mark, says that it is.

        Args:
            head: the newest version of all.

        Raises:
            CorruptError: one cannot be read, or has changed since it was written.
        """
        if isinstance(self.folder, Path) or len(versions) < _AT_ONCE:
            read_entries = [self._read(version) for version in versions]
        else:
            with ThreadPoolExecutor(_AT_ONCE) as pool:
                read_entries = list(pool.map(self._read, versions))
        for version, entry, following in zip(
            versions, read_entries, read_entries[1:], strict=False
        ):
            if following.info.get(PREVIOUS_HASH, entry.hash) != entry.hash:
                raise self.disagreeing(version, self.path(version + 1))
        if (
            versions
            and versions[-1] == head
            and self.marked(head) not in (None, read_entries[-1].hash)
        ):
            raise self.disagreeing(head, self.marks / str(head))
        return read_entries

    def _read(self, version: int) -> Entry:
        text = self._text(version)
        files, info = self._parse_entry(version, text)
        return Entry(files=files, info=info, hash=digest(text))

    def marked(self, version: int) -> str | None:
        """Reads the SHA-256 of an entry that its mark notes, if there is one."""
        try:
            return _content_of(self.marks / str(version)).strip() or None
        except FileNotFoundError:  # another commit has just replaced it
            return None

    def disagreeing(self, version: int, noting: Place) -> CorruptError:
        """Returns the error for an entry whose SHA-256 is not the one that the next entry, or its
        mark, notes."""
        path = self.path(version)
        fix = f"{HEAL}; where nothing is taken, "
        fix += f"delete {noting}" if noting.parent == self.marks else "another one"
        return CorruptError(
            f"the log entry {path.name} is not what {noting.name} says: one of the two has changed "
            "since it was "
            "written",
            where=str(path),
            fix=fix,
        )

    def noted_of(self, version: int, entry: bytes) -> str | None:
        """Reads the SHA-256 that an entry, which may be of another lake, notes of its file.

        Raises:
            CorruptError: it cannot be read.
        """
        return self._parse_entry(version, entry.decode(errors="replace"))[1].get(FILE_HASH)

    def adopt(self, version: int, entry: bytes) -> bool:
        """Put an entry of another lake of the same history; False where there is another one of
        that version."""
        path = self.path(version)
        if put_if_absent(path, entry, noun=f"version {version}"):
            return True
        return _content_of(path).encode() == entry

    def _content(self, version: int) -> tuple[list[str], dict[str, str]]:
        """Names of the files that an entry adds, and its commit info."""
        return self._parse_entry(version, self._text(version))

    def _parse_entry(self, version: int, text: str) -> tuple[list[str], dict[str, str]]:
        try:
            # Not splitlines: a message may hold one of the other line ends of Unicode.
            actions = [from_json(line) for line in text.split("\n") if line]
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
        """Reads what an entry holds; the Delta library would take an empty one for a commit of
        nothing."""
        try:
            text = _content_of(self.path(version))
        except FileNotFoundError as error:  # a link that leads nowhere
            raise _unreadable(self.path(version), error) from None
        if not text:
            raise self.damaged(version)
        return text

    def damaged(self, version: int) -> CorruptError:
        """Returns the error of a reader to whom the entry of `version` makes no sense."""
        path = self.path(version)
        fix = HEAL
        if (
            version == max(self.present()) and version - 1 == self.acknowledged()
        ):  # as a power cut may leave it
            fix += ", or delete it: its commit was never acknowledged"
        return CorruptError(f"the log entry {path.name} is damaged", where=str(path), fix=fix)

    def acknowledge(self, version: int) -> None:
        """Notes for good that the entry of `version` is on the disk; durable when it returns."""
        make_folders(self.marks)
        put_if_absent(self.marks / str(version), f"{self.hash(version)}\n".encode())
        for lower in self._marks():
            if lower < version:
                (self.marks / str(lower)).unlink(missing_ok=True)

    def acknowledged(self) -> int:
        """Finds the newest version that was acknowledged; -1 in a lake that has had no commit since
        marks are made."""
        return max(self._marks(), default=-1)

    def checkpoints(self) -> list[int]:
        """Versions at which the Delta library finds all that is in the entries before."""
        matches = map(_CHECKPOINT, _sizes_in(self.folder))
        return [
            version
            for match in matches
            if match and (version := read_bounded(match[1], most=NEWEST_NUMBER)) is not None
        ]

    def present(self) -> dict[int, int | None]:
        """Maps the version of each entry to its size, where a listing states it."""
        sizes = _sizes_in(self.folder)
        for name in sizes.keys() - self._numbers.keys():
            match = _ENTRY(name)
            version = read_bounded(match[1], most=NEWEST_NUMBER) if match else None
            self._numbers[name] = -1 if version is None else version
        return {
            version: size for name, size in sizes.items() if (version := self._numbers[name]) >= 0
        }

    def _marks(self) -> list[int]:
        return [
            version
            for name in _sizes_in(self.marks)
            if (version := self._marked_by(name)) is not None
        ]

    @staticmethod
    def _marked_by(name: str) -> int | None:
        return read_bounded(name, most=NEWEST_NUMBER) if _MARK(name) else None

    def _gap(
        self, missing: Sequence[int], present: Mapping[int, object], *, acknowledged: int
    ) -> LogGapError:
        newest = max(present)
        names = ", ".join(self.path(version).name for version in missing)
        further = max(newest, acknowledged) + 1 - len(present) - len(missing)
        message = (
            "an entry of the catalog's log is missing: "
            f"{names}{f' and {further} more' if further > 0 else ''}"
        )
        fix = f"{HEAL}; run neither gc nor another program on the lake before"
        if missing[0] > newest:  # what is left is a whole, older catalog
            mark = next(
                path for path in self.marks.iterdir() if self._marked_by(path.name) == acknowledged
            )
            message += f"; {mark} says that version {acknowledged} was committed"
            fix += (
                f"; if it never was, or to give up what was committed after version {newest}, "
                f"delete {mark}"
            )
        elif newest - missing[0] >= len(
            present
        ):  # more of them than there are: rather is the last name wrong
            message += f", before {self.path(newest).name}"
            fix += f"; if this lake never had so many versions, move {self.path(newest)} away"
        return LogGapError(message, where=str(self.path(missing[0])), fix=fix)


def is_stated(version: object, number: int) -> bool:
    """Checks whether this is what `Catalog.history` says of the version of that number, as a file
    that states it may not."""
    if not isinstance(version, dict) or version.get("version") != number:
        return False
    when, files = version.get("timestamp"), version.get("files", [])
    texts = [
        value for key, value in version.items() if key not in ("version", "timestamp", "files")
    ]
    return (
        isinstance(when, int)
        and 0 <= when < _LATEST
        and isinstance(files, list)
        and all(isinstance(text, str) for text in (*texts, *files))
        and isinstance(version.get("operation"), str)
        and all(_COUNT(version.get(key, "0")) for key in ("rows", "withdrawn"))
        and ("commit" not in version or "branch" in version)
    )


def names_in(folder: Place) -> list[str]:
    """Names of what is in a folder; nothing if the folder is not there."""
    return list(_sizes_in(folder))


def _sizes_in(folder: Place) -> dict[str, int | None]:
    """Name of what is in a folder → its size where the listing states it; nothing if the folder is
    not there."""
    try:
        if isinstance(folder, Path):
            return dict.fromkeys(os.listdir(folder))  # noqa: PTH208 — ten times faster
        return {path.name: path.stat().st_size for path in folder.iterdir()}
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise _unreadable(folder, error) from None


def _is_filled(path: Path) -> bool:
    """Checks whether there is a file that is not empty."""
    try:
        status = path.stat()
    except OSError:
        return False
    return stat.S_ISREG(status.st_mode) and status.st_size > 0


def _content_of(path: Place) -> str:
    """Reads the text of a file, which is damaged if it is not UTF-8.

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
