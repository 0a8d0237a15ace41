"""What the notes of the log say: how branches came to be, why rows went, and the labels of
artifacts.

All branches share one sequence of versions. A commit on a branch notes its name; a merge also notes
which branch it took in, and at which version. So for a branch at a version it is known which
commits of which branches went into it, and for two branches what they last had in common. A name
that was deleted and used again is another branch: each is identified by the version that deleted
the one before it.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pyarrow as pa

from flagdata.core.files.durable import HEAL
from flagdata.errors import CorruptError, NotFoundError
from flagdata.lake.refs import DELETED, MAIN, Entry, Slice, View, view_from
from flagdata.recipes.documents import from_json

Life = tuple[str, int]
"""A branch, and the version that deleted the last one of its name; -1 for the first."""


def noted_labels(entry: Entry) -> Mapping[str, Mapping[str, Any]]:
    """Maps the artifacts that a commit put labels on to name → value, `None` where it takes one
    off.

    Raises:
        CorruptError: the note cannot be read.
    """
    with _reading(entry):
        noted = {
            artifact: dict(values.items()) for artifact, values in from_json(entry[LABELS]).items()
        }
        if any(
            isinstance(value, list | dict) for values in noted.values() for value in values.values()
        ):
            raise ValueError("the value of a label is a list or table")
        return noted


LABELS = "labels"
"""Note of a commit that puts labels on artifacts: artifact → name → value, `null` where it takes
one off."""


HIDDEN_ON = "hidden_on"
"""Note of a commit by which rows leave several branches: each but the first → the rows of its base
that it hides."""


def _noted_merge(entry: Entry) -> Slice:
    with _reading(entry):
        return Slice(branch=entry["merged"], version=int(entry["merged_version"]))


def _further_branches(entry: Entry) -> frozenset[str]:
    return Removal(entry).branches if HIDDEN_ON in entry else frozenset()


@contextmanager
def _reading(entry: Entry) -> Iterator[None]:
    try:
        yield
    except (ValueError, KeyError, TypeError, AttributeError):
        raise CorruptError(
            f"what version {entry['version']} notes of branches cannot be read",
            where="the catalog's log",
            fix=f"run flagdata verify; {HEAL}",
        ) from None


@dataclass(frozen=True)
class Removal:
    """A commit by which rows, or the data of rows, went for a reason: withdrawn from a branch or
    hidden on it, erased everywhere, shown by a tag or branch that was deleted, or of versions that
    expired. Notes of the log are read as they are asked for.

    Raises:
        CorruptError: the note that is asked for cannot be read.
    """

    entry: Entry

    NOTES = ("withdrawn", "hidden", "erased", "deleted", "expired")
    """Notes of a commit of which at least one says that it is a removal."""

    @property
    def version(self) -> int:
        """Returns the version that the commit made."""
        return int(self.entry["version"])

    @property
    def branch(self) -> str:
        """Returns the branch that it is on, the first of several; "" for one of a tag or of
        versions."""
        return str(self.entry.get("branch", ""))

    @property
    def reason(self) -> str:
        """Returns the message that the user gave to it."""
        return str(self.entry.get("message", ""))

    @property
    def withdrawn(self) -> bool:
        """Returns whether it took rows off the table."""
        return "withdrawn" in self.entry

    @property
    def branches(self) -> frozenset[str]:
        """Returns the branches that do not show some rows any more; none for one of a tag or of
        versions."""
        return frozenset({self.branch} - {""}) | self._hidden_elsewhere().keys()

    def hidden(self, branch: str) -> frozenset[str]:
        """Returns the ids of the rows of its base that it hides on a branch."""
        with _reading(self.entry):
            noted = from_json(self.entry.get("hidden", "[]")) if branch == self.branch else []
            return frozenset(map(str, noted)) | self._hidden_elsewhere().get(branch, frozenset())

    def _hidden_elsewhere(self) -> Mapping[str, frozenset[str]]:
        """Reads what it hides on further branches than its own, with those of which it hides
        nothing."""
        with _reading(self.entry):
            noted = from_json(self.entry.get(HIDDEN_ON, "{}"))
            return {
                Slice(branch=branch, version=0).branch: frozenset(map(str, ids))
                for branch, ids in noted.items()
            }

    @property
    def erased(self) -> Mapping[str, str | None]:
        """Returns the artifacts that it erased from all refs, with the object of each."""
        with _reading(self.entry):
            noted = dict(from_json(self.entry.get("erased", "{}")).items())
            if not all(name is None or isinstance(name, str) for name in noted.values()):
                raise ValueError("the name of an object is not a text")
            return noted

    @property
    def deleted(self) -> str:
        """Returns the tag or branch that it deleted, as "tag v1"; "" where it deleted none."""
        return str(self.entry.get(DELETED, ""))

    @property
    def view(self) -> View:
        """Returns what the tag showed that it deleted, or what the branch began from."""
        with _reading(self.entry):
            return view_from(from_json(self.entry["view"]))

    @property
    def expired(self) -> tuple[int, frozenset[str]]:
        """Returns the newest version that it let expire, with all before it, and the names of the
        objects that went; -1 and none where it let none expire."""
        if "expired" not in self.entry:
            return -1, frozenset()
        with _reading(self.entry):
            noted = from_json(self.entry["expired"])
            return int(noted["up_to"]), frozenset(str(name) for name in noted["objects"])


def removals(history: Iterable[Entry]) -> list[Removal]:
    """Returns the removals among the commits of the log, in their order."""
    return [Removal(entry) for entry in history if any(note in entry for note in Removal.NOTES)]


class Lineage:
    """The branches at the head.

    Args:
        history: of the catalog, in any order.
        forks: what each branch that there is began from.
    """

    def __init__(self, history: Iterable[Entry], forks: Mapping[str, View]) -> None:
        self._entries: dict[str, list[Entry]] = {}
        for entry in sorted(history, key=lambda entry: entry["version"]):
            for branch in {entry.get("branch"): None, **dict.fromkeys(_further_branches(entry))}:
                if branch is None:
                    continue
                if branch not in self._entries:
                    with _reading(entry):
                        Slice(
                            branch=branch, version=entry["version"]
                        )  # whether that is a branch's name
                self._entries.setdefault(branch, []).append(entry)
        self._forks = {**forks, MAIN: ()}

    def fork(self, part: Slice) -> View | None:
        """Finds what the branch that had a name at a version began from; nothing for main, and
        `None` where its ref is
        lost: it is not there, though nobody deleted it."""
        later = (
            entry for entry in self._entries.get(part.branch, ()) if entry["version"] > part.version
        )
        for entry in later:
            if DELETED in entry:
                return Removal(entry).view
        return self._forks.get(part.branch)

    def view(self, part: Slice) -> View:
        """Finds what a branch shows at a version.

        Raises:
            NotFoundError: its ref is lost.
        """
        fork = self.fork(part)
        if fork is None:
            raise NotFoundError(f"there is no branch {part.branch!r}", fix="run flagdata doctor")
        return (part, *fork)

    def life(self, part: Slice) -> Life:
        """Finds which of the branches of that name had it at a version."""
        deleted = (e["version"] for e in self._entries.get(part.branch, ()) if DELETED in e)
        return (
            part.branch,
            max((version for version in deleted if version <= part.version), default=-1),
        )

    def commits(self, part: Slice) -> Sequence[Entry]:
        """Lists the commits of a branch up to a version, oldest first; those of an earlier one of
        that name are not its."""
        begin = self.life(part)[1]
        return [
            e for e in self._entries.get(part.branch, ()) if begin < e["version"] <= part.version
        ]

    def hidden(self, part: Slice) -> frozenset[str]:
        """Ids of rows of its base that a branch does not show, since they were withdrawn from
        it."""
        return frozenset(
            artifact
            for entry in self.commits(part)
            for artifact in Removal(entry).hidden(part.branch)
        )

    def labels(self, part: Slice) -> dict[str, dict[str, Any]]:
        """Returns the labels of each artifact, after all commits that went into a branch at a
        version.

        Raises:
            CorruptError: what a commit notes cannot be read.
        """
        labelled = [
            e
            for branch, entries in self._entries.items()
            for e in entries
            if LABELS in e and e["branch"] == branch
        ]
        newest_versions = self._newest(part) if labelled else {}
        labels: dict[str, dict[str, Any]] = {}
        for entry in sorted(labelled, key=lambda entry: entry["version"]):
            life = self.life(Slice(branch=entry["branch"], version=entry["version"]))
            for artifact, values in (
                noted_labels(entry).items()
                if entry["version"] <= newest_versions.get(life, -1)
                else ()
            ):
                merged = {**labels.get(artifact, {}), **values}
                labels[artifact] = {
                    name: value for name, value in merged.items() if value is not None
                }
        return {artifact: values for artifact, values in labels.items() if values}

    def knows(self, part: Slice, other_part: Slice) -> bool:
        """Checks whether all commits that went into `other_part` went into `part` too."""
        newest_versions = self._newest(part)
        return all(
            newest_versions.get(life, -1) >= version
            for life, version in self._newest(other_part).items()
        )

    def merge_base(self, first_part: Slice, second_part: Slice) -> Slice | None:
        """Finds what two branches last had in common: of the branches whose commits went into both,
        the one that took in most of the others; `None` where they share no commit."""
        first, second = self._newest(first_part), self._newest(second_part)
        common = {life: min(first[life], second[life]) for life in first.keys() & second.keys()}
        points = [Slice(branch=branch, version=version) for (branch, _), version in common.items()]

        def rank(point: Slice) -> tuple[int, int]:
            newest_versions = self._newest(point)
            return sum(
                newest_versions.get(life, -1) >= version for life, version in common.items()
            ), point.version

        return max(points, key=rank, default=None)

    def _newest(self, part: Slice) -> dict[Life, int]:
        """Maps each branch whose commits went into `part` to the newest of these."""
        newest: dict[Life, int] = {}
        begun: set[Life] = set()
        parts = [part]
        while parts:
            part = parts.pop()
            life = self.life(part)
            fresh = [e for e in self.commits(part) if e["version"] > newest.get(life, -1)]
            parts += [_noted_merge(entry) for entry in fresh if "merged" in entry]
            if fresh:
                newest[life] = fresh[-1]["version"]
            if life not in begun:
                begun.add(life)
                parts += self.fork(part) or ()
        return newest


_BESIDE = b"flagdata.labels"
"""Key of the labels in the metadata of the schema of a table of rows."""


def with_labels(rows: pa.Table, labels: Mapping[str, Mapping[str, Any]]) -> pa.Table:
    """Returns the rows, with the labels of artifacts beside them."""
    if not labels:
        return rows
    text = json.dumps(labels, ensure_ascii=False, sort_keys=True)
    return rows.replace_schema_metadata({**(rows.schema.metadata or {}), _BESIDE: text.encode()})


def labels_of(rows: pa.Table) -> dict[str, dict[str, Any]]:
    """Returns the labels of each artifact, of a table of rows that `Store.table` gave, whole or
    filtered."""
    text = (rows.schema.metadata or {}).get(_BESIDE)
    return {} if text is None else json.loads(text)
