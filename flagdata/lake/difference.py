"""What changed between two refs: rows and objects added and removed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import pyarrow as pa

from flagdata.lake.lake import Lake


@dataclass(frozen=True, kw_only=True)
class Difference:
    """From one ref to another.

    Attributes:
        added, removed: rows of the catalog, whole.
        objects_added, objects_removed: names, sorted; an object that several rows share counts when the last one goes.
    """

    added: pa.Table
    removed: pa.Table
    objects_added: tuple[str, ...]
    objects_removed: tuple[str, ...]


def difference(lake: Lake, before: str | None, after: str | None) -> Difference:
    """What `after` shows that `before` does not, and the other way round; rows are compared by identity.

    Raises:
        NotFoundError: no such ref.
    """
    old, new = lake.rows(at=before), lake.rows(at=after)
    old_objects, new_objects = _objects(old), _objects(new)
    return Difference(
        added=_without(new, old),
        removed=_without(old, new),
        objects_added=tuple(sorted(new_objects - old_objects)),
        objects_removed=tuple(sorted(old_objects - new_objects)),
    )


def added_since(lake: Lake, branch: str) -> Callable[[], str]:
    """What a branch has gained since this call, in words, such as "on branch main: camera 2, recording 1"; "" if
    nothing. For `flagdata.console.in_steps`.

    Raises:
        NotFoundError: no such branch.
    """
    before = lake.rows(at=branch, columns=["artifact", "kind"])

    def words() -> str:
        added = Counter(_without(lake.rows(at=branch, columns=["artifact", "kind"]), before)["kind"].to_pylist())
        kinds = ", ".join(f"{kind} {count}" for kind, count in sorted(added.items()))
        return f"on branch {branch}: {kinds}" if kinds else ""

    return words


def _without(table: pa.Table, other: pa.Table) -> pa.Table:
    known = set(other["artifact"].to_pylist())
    return table.filter(
        pa.array([identity not in known for identity in table["artifact"].to_pylist()], type=pa.bool_())
    )


def _objects(table: pa.Table) -> set[str]:
    return set(table["object"].drop_null().to_pylist())
