"""Taking rows off a branch: what goes along by itself, and what has to be named.

The branch's own rows leave the table; rows of its base, which its parent goes on to show, are hidden by a note of the
commit, see `flagdata.lake.lineage`.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.errors import ConflictError, NotFoundError
from flagdata.lake.catalog import persist
from flagdata.lake.durable import disk_errors
from flagdata.lake.leases import keeping_collectors_out
from flagdata.lake.matching import made_from, matching
from flagdata.lake.refs import Slice
from flagdata.lake.store import Store
from flagdata.schema import Kind, catalog_schema

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


def withdraw(lake: Store, artifacts: Collection[str], message: str, *, branch: str) -> Withdrawal:
    """See `Lake.withdraw`."""
    asked = frozenset(artifacts)

    def attempt() -> Withdrawal:
        head = lake.catalog.head()
        shown = lake.columns(lake.refs.view(branch, head), _COLUMNS)
        clips = clips_of(shown, asked)
        leaving = asked | clips
        check_leaving(shown, leaving, branch=branch, where=str(lake.path))
        info = {"message": message, "branch": branch, "withdrawn": str(len(leaving))}
        version = take_off(lake, leaving, branch=branch, base=head, info=info)
        return Withdrawal(version=version, asked=tuple(sorted(asked)), clips=tuple(sorted(clips)))

    lake.check_writable()
    with disk_errors("withdrawing", lake.path), keeping_collectors_out(lake.staging):
        return persist(attempt, where=lake.catalog.path)


def take_off(
    lake: Store,
    leaving: Collection[str],
    *,
    branch: str,
    base: int,
    info: Mapping[str, str],
    fresh: pa.Table | None = None,
) -> int:
    """Commit that a branch does not show the rows `leaving` any more; its version.

    Args:
        fresh: rows that the same commit adds.

    Raises:
        Moved: `base` is no longer the newest version; nothing was published.
    """
    own: set[str] = set()
    if leaving:
        own = set(leaving).intersection(lake.identities((Slice(branch=branch, version=base),)).to_pylist())
    hidden = sorted(set(leaving) - own)
    fresh = catalog_schema().empty_table() if fresh is None else fresh
    noted = {**info, "hidden": json.dumps(hidden)} if hidden else info
    if not own:
        return lake.catalog.append(fresh, base=base, info=noted)
    going = (pc.field("branch") == branch) & pc.field("artifact").isin(pa.array(sorted(own), pa.string()))
    return lake.catalog.drop(going, fresh=fresh, base=base, info=noted)


def clips_of(shown: pa.Table, artifacts: Collection[str]) -> frozenset[str]:
    """Ids of the clips that are slices of the objects of `artifacts` themselves, so that they mean nothing without."""
    named = matching(shown, {"artifact": list(artifacts)}).select(_COLUMNS).to_pylist()
    objects = {row["artifact"]: row["object"] for row in named}
    made = matching(made_from(shown, objects), {"kind": Kind.CLIP}).select(_COLUMNS).to_pylist()
    return frozenset(
        row["artifact"]
        for row in made
        if row["object"] is not None and any(objects.get(parent) == row["object"] for parent in row["parents"])
    ) - frozenset(artifacts)


def descendants(shown: pa.Table, artifacts: Collection[str]) -> frozenset[str]:
    """Ids of all rows that were made from `artifacts`, or from what was made from them; without `artifacts`."""
    found, newest = set(artifacts), set(artifacts)
    while newest:
        newest = set(made_from(shown, newest)["artifact"].to_pylist()) - found
        found |= newest
    return frozenset(found - set(artifacts))


def check_leaving(shown: pa.Table, leaving: Collection[str], *, branch: str, where: str) -> None:
    """Whether the rows `leaving` can go.

    Raises:
        NotFoundError: one that the branch does not show.
        ConflictError: a row that stays on the branch was made from one of them.
    """
    there = matching(shown, {"artifact": list(leaving)})["artifact"].to_pylist()
    if foreign := set(leaving) - set(there):
        raise NotFoundError(
            f"{', '.join(sorted(foreign))} is not on branch {branch!r}",
            where=where,
            fix=f"give ids of rows that flagdata ls --at {branch} shows",
        )
    made = made_from(shown, leaving).select(_COLUMNS).to_pylist()
    staying = [row for row in made if row["artifact"] not in leaving]
    if staying:
        first = f"{staying[0]['kind']} {staying[0]['name']!r} ({staying[0]['artifact']})"
        more = f", and {len(staying) - 1} more," if len(staying) > 1 else ""
        raise ConflictError(
            f"{first}{more} would stay, made from what would be withdrawn",
            where=where,
            fix="withdraw all that was made from it too: flagdata withdraw --with-descendants",
        )
