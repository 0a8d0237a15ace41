"""Which entries of a damaged log are right, and which of another log belong in the place of those
that are not.

An entry is right whose SHA-256 is noted: by the entry after it, or by the mark of the newest. A
hash proves itself, so that a note counts for an entry wherever it is read, also in an entry that is
damaged elsewhere. Against an entry counts only the note of an entry that is right, or of the mark.
So the log is looked at from the newest entry down, and what another log has is taken where its hash
is noted: of an older log, a newer one, or one that went on otherwise.

In lakes of before entries noted hashes, an entry that is missing or makes no sense is taken where
both logs have the same entry after it. Of a log that is gone, mark and all, nothing is known, and
all entries of the other are taken.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from flagdata.core.files.regular_files import open_regular
from flagdata.errors import CorruptError
from flagdata.lake.delta_log import PREVIOUS_HASH, Log
from flagdata.storage import Place, StoreError

_HASH = re.compile(r"[0-9a-f]{64}").fullmatch
_PREVIOUS = re.compile(rb'"' + re.escape(PREVIOUS_HASH).encode() + rb'": ?"([0-9a-f]{64})"')
_ALIKE = 48
"""Of the 64 digits of a hash, so many at least are the same in a mark of it that a few flipped bits
changed."""
_AT_ONCE = 16  # entries of a bucket that are read at the same time


@dataclass(frozen=True, kw_only=True)
class Mending:
    """What is put into a log.

    Attributes:
        entries: version → the entry, as the other log has it.
        missing: those of these versions that the log has not.
        mark: the version whose mark is written, and its SHA-256; `None` where the mark is right, or
            it is not known what it should say.
    """

    entries: Mapping[int, bytes]
    missing: frozenset[int]
    mark: tuple[int, str] | None


def mending(log: Log, other: Log) -> Mending:
    """Finds what a log lacks or has wrongly that another one has rightly.

    Raises:
        CorruptError: of a log that is gone, the other cannot be read.
        StoreError: a store did not answer.
    """
    newest, present = log.acknowledged(), log.present()
    if not present and newest < 0:
        return _all(other)
    mine, theirs = _Entries(log, present), _Entries(other, other.present())
    mine.read(present)
    mark = _mark(log, newest)
    right: dict[int, bytes] = {}
    taken: dict[int, bytes] = {}
    versions = {
        *present,
        *(version for version in theirs.there if version <= max([newest, *present])),
    }
    for version in sorted(versions, reverse=True):
        entry, following = mine.of(version), right.get(version + 1, b"")
        is_newest = version == newest
        against = _previous(following) | ({mark} if is_newest and _HASH(mark) else set())
        noted = against | _previous(mine.of(version + 1))

        def proven(
            candidate: bytes, noted: set[str] = noted, mark: str = mark if is_newest else ""
        ) -> bool:
            return bool(candidate) and (
                _digest(candidate) in noted or _is_like(mark, _digest(candidate))
            )

        if proven(entry):
            right[version] = entry
        elif proven(instead := theirs.of(version)):
            right[version] = taken[version] = instead
        elif mine.makes_sense(version):
            if not against or (
                is_newest and entry == instead
            ):  # else the mark may be what has changed
                right[version] = entry
        elif following and following == theirs.of(version + 1) and theirs.makes_sense(version):
            right[version] = taken[version] = instead
    return Mending(
        entries=taken,
        missing=frozenset(taken.keys() - present.keys()),
        mark=_right_mark(mark, newest, right, theirs_marked=other.acknowledged() >= 0),
    )


def are_of_one_history(log: Log, other: Log) -> bool:
    """Checks whether two logs have an entry in common, or note one, so that they are of one
    lake."""
    mine, theirs = _Entries(log, log.present()), _Entries(other, other.present())
    if any(
        mine.of(version) == theirs.of(version) != b""
        for version in sorted(mine.there & theirs.there)
    ):
        return True
    return not mine.known().isdisjoint(theirs.known())


class _Entries:
    """The bytes of a log's entries, each read once."""

    def __init__(self, log: Log, there: Iterable[int]) -> None:
        self._log = log
        self._known: dict[int, bytes] = {}
        self.there = frozenset(there)

    def read(self, versions: Iterable[int]) -> None:
        """Reads many."""
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            list(pool.map(self.of, versions))

    def of(self, version: int) -> bytes:
        """Reads one; nothing where it is missing, empty, or cannot be read."""
        if version not in self._known:
            self._known[version] = (
                read_bytes(self._log.path(version)) or b"" if version in self.there else b""
            )
        return self._known[version]

    def known(self) -> set[str]:
        """The SHA-256 of the entries, and those that they and the mark note."""
        entries = [entry for entry in map(self.of, self.there) if entry]
        marked = _mark(self._log, self._log.acknowledged())
        return {*map(_digest, entries)}.union(*map(_previous, entries), {marked} if marked else ())

    def makes_sense(self, version: int) -> bool:
        """Checks whether one is there and is an entry of a log."""
        try:
            self._log.noted_of(version, self.of(version))
        except CorruptError:
            return False
        return True


def read_bytes(path: Place) -> bytes | None:
    """Reads the bytes of a file; nothing of what the disk does not give, as of a folder; `None`
    where there is none.

    Raises:
        StoreError: a store did not answer.
    """
    try:
        with open_regular(path) as stream:
            return stream.read()
    except FileNotFoundError:
        return None
    except StoreError:
        raise
    except OSError:
        return b""


def _all(other: Log) -> Mending:
    head = other.head()
    other.entries(range(head + 1), head=head)  # raises where one is not right
    entries = {version: other.path(version).read_bytes() for version in range(head + 1)}
    return Mending(entries=entries, missing=frozenset(entries), mark=(head, _digest(entries[head])))


def _mark(log: Log, newest: int) -> str:
    """Reads what a mark says; nothing where there is none."""
    return (
        (read_bytes(log.marks / str(newest)) or b"").decode(errors="replace").strip()
        if newest >= 0
        else ""
    )


def _right_mark(
    mark: str, newest: int, right: Mapping[int, bytes], *, theirs_marked: bool
) -> tuple[int, str] | None:
    if newest < 0 and theirs_marked and right:  # a lake of before there were marks lacks none
        newest = max(right)
    if newest not in right or _digest(right[newest]) == mark:
        return None
    return newest, _digest(right[newest])


def _is_like(mark: str, entry_hash: str) -> bool:
    """Checks whether a mark said this hash before some of its bits changed."""
    return sum(one == other for one, other in zip(mark, entry_hash, strict=False)) >= _ALIKE


def _previous(entry: bytes) -> set[str]:
    """The SHA-256 that an entry notes of the one before it."""
    return {found.decode() for found in _PREVIOUS.findall(entry)}


def _digest(entry: bytes) -> str:
    return hashlib.sha256(entry).hexdigest()
