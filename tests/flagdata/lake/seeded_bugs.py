"""Defects that a lake had, put back one at a time, each with the operations among which it
shows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import pytest

from flagdata.errors import ConflictError
from flagdata.lake import (
    collection,
    commits,
    copying,
    health,
    label_columns,
    merging,
    objects,
    ref_commits,
    refs,
    removal,
    store,
)

_CLASHES = label_columns.clashes
_CHECK_LABELS = commits.check_labels
_CHECK_REFS = copying._check_refs
_COMMIT = commits.commit
_UNFINISHED = removal.find_unfinished


@dataclass(frozen=True, kw_only=True)
class Bug:
    """A defect.

    Attributes:
        put: puts it into the product.
        among: names of the operations that are tried.
        seed: of operations among which it shows early.
    """

    put: Callable[[pytest.MonkeyPatch], None]
    among: frozenset[str]
    seed: int = 1


def _unchecked_at_a_merge(names: int) -> Callable[[pytest.MonkeyPatch], None]:
    """Labels clash by so many names: two that differ by capitals, or one of two types."""

    def check(before: Any, after: Any, *, homes: Mapping[str, Any]) -> None:
        with pytest.MonkeyPatch.context() as patches:
            if len(homes) > 1:
                patches.setattr(label_columns, "clashes", others)
            _CHECK_LABELS(before, after, homes=homes)

    def others(labels: Any) -> Iterator[Any]:
        return (clash for clash in _CLASHES(labels) if len(clash.names) != names)

    return lambda patches: patches.setattr(commits, "check_labels", check)


def _last_label_wins(patches: pytest.MonkeyPatch) -> None:
    patches.setattr(merging, "merge_labels", lambda *arguments, **named: {})
    patches.setattr(merging, "amended_labels", lambda *arguments: {})


def _made_again_is_another(patches: pytest.MonkeyPatch) -> None:
    def check(source: Any, target: Any) -> None:
        _CHECK_REFS(source, target)
        for one, other in (
            (source.refs.tags(), target.refs.tags()),
            (source.refs.branches(), target.refs.branches()),
        ):
            if any(other.get(name, ref) != ref for name, ref in one.items()):
                raise ConflictError(
                    "both lakes have it, and not the same",
                    where="refs",
                    fix="delete one of the two",
                )

    patches.setattr(copying, "_check_refs", check)


def _erased_branch_by_branch(patches: pytest.MonkeyPatch) -> None:
    def commit(lake: Any, change: commits.Change, *, base: int) -> int:
        for branch, ids in change.leaving.items():
            base = _COMMIT(lake, replace(change, leaving={branch: ids}), base=base)
        return base

    patches.setattr(removal, "commit", commit)


def _deleted_by_two_commits(patches: pytest.MonkeyPatch) -> None:
    def commit(lake: Any, change: commits.Change, *, base: int) -> int:
        if any(change.leaving.values()):
            base = _COMMIT(lake, replace(change, deleted=None, notes={}), base=base)
        return _COMMIT(lake, replace(change, leaving=dict.fromkeys(change.leaving, ())), base=base)

    patches.setattr(ref_commits, "commit", commit)


def _deletions_not_flushed(patches: pytest.MonkeyPatch) -> None:
    patches.setattr(objects.Objects, "_flush_stores", lambda self, stores: None)


def _refs_are_files(patches: pytest.MonkeyPatch) -> None:
    patches.setattr(refs.Refs, "lives", lambda self: {})


def _tag_names_are_free_again(patches: pytest.MonkeyPatch) -> None:
    patches.setattr(ref_commits, "_check_reuse", lambda lake, name, view: None)


def _never_tidied(patches: pytest.MonkeyPatch) -> None:
    patches.setattr(store.Store, "tidy", lambda self: None)


def _silent(kind: str) -> Callable[[pytest.MonkeyPatch], None]:
    """What is unfinished of this kind is neither reported nor finished."""

    def unfinished(lake: Any, needed: Any) -> list[Any]:
        return [left for left in _UNFINISHED(lake, needed) if left.kind != kind]

    def put(patches: pytest.MonkeyPatch) -> None:
        patches.setattr(health, "find_unfinished", unfinished)
        patches.setattr(collection, "find_unfinished", unfinished)

    return put


BUGS = {
    "labels-by-capitals": Bug(
        put=_unchecked_at_a_merge(2), among=frozenset({"label", "merge"}), seed=3
    ),
    "labels-by-type": Bug(
        put=_unchecked_at_a_merge(1), among=frozenset({"label", "merge"}), seed=6
    ),
    "last-label-wins": Bug(put=_last_label_wins, among=frozenset({"label", "merge"}), seed=9),
    "made-again": Bug(
        put=_made_again_is_another, among=frozenset({"branch", "delete", "transfer"}), seed=8
    ),
    "erased-by-branch": Bug(put=_erased_branch_by_branch, among=frozenset({"erase", "ingest"})),
    "deleted-by-two": Bug(
        put=_deleted_by_two_commits, among=frozenset({"ingest", "branch", "delete"}), seed=11
    ),
    "not-flushed": Bug(put=_deletions_not_flushed, among=frozenset({"erase", "ingest"})),
    "refs-are-files": Bug(
        put=_refs_are_files, among=frozenset({"branch", "tag", "lose_refs"}), seed=6
    ),
    "tag-names-free": Bug(
        put=_tag_names_are_free_again, among=frozenset({"ingest", "tag", "delete"}), seed=2
    ),
    "never-tidied": Bug(put=_never_tidied, among=frozenset({"label", "withdraw"}), seed=5),
    "silent-expiry": Bug(put=_silent("expiry"), among=frozenset({"withdraw", "delete", "expire"})),
    "silent-erasure": Bug(put=_silent("erasure"), among=frozenset({"erase", "ingest"})),
}
