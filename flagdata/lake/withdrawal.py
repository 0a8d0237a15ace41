"""Taking rows off a branch: what goes along by itself, and what has to be named."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import pyarrow as pa

from flagdata.errors import ConflictError, NotFoundError
from flagdata.schema import Kind

_COLUMNS = ["artifact", "branch", "kind", "name", "object", "parents"]


@dataclass(frozen=True, kw_only=True)
class Withdrawal:
    """What a withdrawal did.

    Attributes:
        version: of the table after it.
        asked: ids that were named, sorted.
        clips: ids of the clips of these that went along, sorted.
    """

    version: int
    asked: tuple[str, ...]
    clips: tuple[str, ...]


def clips_of(shown: pa.Table, artifacts: Collection[str]) -> frozenset[str]:
    """Ids of the clips that are slices of the objects of `artifacts` themselves, so that they mean nothing without."""
    rows = shown.select(_COLUMNS).to_pylist()
    objects = {row["artifact"]: row["object"] for row in rows if row["artifact"] in artifacts}
    return frozenset(
        row["artifact"]
        for row in rows
        if row["kind"] == Kind.CLIP
        and row["object"] is not None
        and any(objects.get(parent) == row["object"] for parent in row["parents"])
    ) - frozenset(artifacts)


def descendants(shown: pa.Table, artifacts: Collection[str]) -> frozenset[str]:
    """Ids of all rows that were made from `artifacts`, or from what was made from them; without `artifacts`."""
    rows = shown.select(["artifact", "parents"]).to_pylist()
    found = set(artifacts)
    grown = True
    while grown:
        more = {row["artifact"] for row in rows if found.intersection(row["parents"])} - found
        found |= more
        grown = bool(more)
    return frozenset(found - set(artifacts))


def check_leaving(shown: pa.Table, leaving: Collection[str], *, branch: str, where: str) -> None:
    """Whether the rows `leaving` can go.

    Raises:
        NotFoundError: one that was not committed on this branch itself (but maybe on its parent).
        ConflictError: a row that stays on the branch was made from one of them.
    """
    rows = shown.select(_COLUMNS).to_pylist()
    foreign = set(leaving) - {row["artifact"] for row in rows if row["branch"] == branch}
    if foreign:
        raise NotFoundError(
            f"{', '.join(sorted(foreign))} was not committed on branch {branch!r}",
            where=where,
            fix="give full ids of rows that flagdata ls shows with this branch",
        )
    staying = [r for r in rows if r["artifact"] not in leaving and set(leaving).intersection(r["parents"])]
    if staying:
        first = f"{staying[0]['kind']} {staying[0]['name']!r} ({staying[0]['artifact']})"
        more = f", and {len(staying) - 1} more," if len(staying) > 1 else ""
        raise ConflictError(
            f"{first}{more} would stay, made from what would be withdrawn",
            where=where,
            fix="withdraw all that was made from it too: flagdata withdraw --with-descendants",
        )
