"""The three-way merge of labels, artifact by artifact and name by name: what one of two branches
changed since the two last had the same counts. What both changed, to different values, is refused:
nobody but the user knows which is right.
"""

from __future__ import annotations

import json
from collections.abc import Collection
from typing import TypeAlias

from flagdata.core.shell import command_line
from flagdata.errors import ConflictError
from flagdata.lake.label_columns import Labels, Value, kind
from flagdata.lake.refs import MAIN, Slice
from flagdata.lake.store import Store

Merged: TypeAlias = dict[str, dict[str, Value]]
"""Artifact → name → value."""


def merge_labels(
    lake: Store,
    ours: Slice,
    theirs: Slice,
    base: Slice | None,
    *,
    here: Collection[str],
    there: Collection[str],
) -> Merged:
    """Merges the labels of two branches.

    Args:
        ours: the branch that is merged into; theirs: the other one.
        base: what they last had the same, `None` where they share nothing.
        here: ids of the rows that ours has, and keeps.
        there: ids of the rows that theirs has.

    Raises:
        ConflictError: both changed a label of an artifact that both show, to different values.
    """
    lineage = lake.lineage()
    before, own, other = (
        {} if part is None else lineage.labels(part) for part in (base, ours, theirs)
    )
    merged: Merged = {}
    for artifact in sorted(own.keys() | other.keys()):
        mine, its = own.get(artifact, {}), other.get(artifact, {})
        if artifact in here and artifact in there:
            values = _merge_labels(
                artifact, before.get(artifact, {}), mine, its, ours=ours, theirs=theirs
            )
        else:
            values = mine if artifact in here else its
        if values:
            merged[artifact] = dict(values)
    return merged


def amended_labels(
    read: Labels, wanted: Labels, shown: Collection[str]
) -> dict[str, dict[str, Value | None]]:
    """Returns what a merge has to note so that labels come out right.

    Args:
        read: what readers take from the commits of both branches, the later one first where both
            put a label.
        wanted: what `merge_labels` returned.
        shown: ids of the artifacts that are shown afterwards.
    """
    amended: dict[str, dict[str, Value | None]] = {}
    for artifact in sorted((read.keys() | wanted.keys()).intersection(shown)):
        have, want = read.get(artifact, {}), wanted.get(artifact, {})
        names = [
            name
            for name in sorted(have.keys() | want.keys())
            if _typed_value(have.get(name)) != _typed_value(want.get(name))
        ]
        if names:
            amended[artifact] = {name: want.get(name) for name in names}
    return amended


def _merge_labels(
    artifact: str,
    before: dict[str, Value],
    mine: dict[str, Value],
    its: dict[str, Value],
    *,
    ours: Slice,
    theirs: Slice,
) -> dict[str, Value]:
    """Merges the labels of one artifact, name by name."""
    values: dict[str, Value] = {}
    for name in sorted(mine.keys() | its.keys()):
        was, own, other = (_typed_value(labels.get(name)) for labels in (before, mine, its))
        if own != other and was not in (own, other):
            raise _both_changed(
                artifact,
                name,
                mine.get(name),
                its.get(name),
                ours=ours.branch,
                theirs=theirs.branch,
            )
        value = its.get(name) if own == was else mine.get(name)
        if value is not None:
            values[name] = value
    return values


def _typed_value(value: Value | None) -> tuple[str, Value | None]:
    """Returns a value with its type: true is no 1."""
    return ("" if value is None else kind(value), value)


def _both_changed(
    artifact: str, name: str, mine: Value | None, its: Value | None, *, ours: str, theirs: str
) -> ConflictError:
    """Returns the refusal of a merge of two branches that changed a label to different values."""
    given = f"{name}={'' if mine is None else json.dumps(mine, ensure_ascii=False)}"
    where = () if theirs == MAIN else ("--branch", theirs)
    return ConflictError(
        f"both branches changed the label {name}: on {ours!r} it is {_shown(mine)}, on {theirs!r} "
        f"{_shown(its)}",
        where=f"artifact {artifact}",
        fix=f"give both the value of {ours!r}, or another: "
        f"{command_line('flagdata', 'label', artifact, given, *where)}; then merge again",
    )


def _shown(value: Value | None) -> str:
    return "none" if value is None else json.dumps(value, ensure_ascii=False)
