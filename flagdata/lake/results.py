"""Results that a program infers, in versions: what other code makes of the same inputs is another
version of it.

Data are the same whichever code wrote them, so that a repeated ingest or simulation adds nothing. A
measurement or a verdict may have been wrong until the code was mended:
docs/decisions/057-versions-of-a-result.md. The recipe of a later version states what it revises and
the code that inferred it, which gives it an identity of its own; that of the first version states
neither.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import pyarrow.compute as pc

from flagdata.core.printable import SHORT
from flagdata.core.schema import Kind
from flagdata.lake.artifact import Artifact
from flagdata.lake.lake import Lake
from flagdata.lake.naming import REVISION, first_revised
from flagdata.lake.refs import MAIN
from flagdata.lake.remaking import Remade, present
from flagdata.lake.store import Store


@dataclass(frozen=True, kw_only=True)
class Placed:
    """A result among its versions.

    Attributes:
        artifact: its row; without its object where it was not on the branch.
        others: versions that were on the branch, in the order of their commits; `artifact` itself
            where it was.
        new: whether it was not there.
        healed: what was done where it was there, and its object damaged or missing.
    """

    artifact: Artifact
    others: tuple[Artifact, ...]
    new: bool
    healed: Remade | None = None

    @property
    def version(self) -> int:
        """Its number, from 1."""
        return (
            len(self.others) + 1
            if self.new
            else [version.id for version in self.others].index(self.artifact.id) + 1
        )

    @property
    def sentence(self) -> str:
        """What became of it, as the end of a line that begins with its id and what it is."""
        if self.new and not self.others:
            return "committed"
        newest = self.others[-1]
        by = f"version {len(self.others)}, {newest.id[:SHORT]}, is by code {newest.code_version}"
        if self.new:
            return f"committed as version {self.version} of {self.artifact.name!r}; {by}"
        if newest.id == self.artifact.id:
            outcome = "there already"
        else:
            outcome = f"there already as version {self.version} of {self.artifact.name!r}; {by}"
        return outcome if self.healed is None else f"{outcome}; {self.healed.sentence}"


def versions(lake: Store, result: Artifact, *, at: str | None = None) -> tuple[Artifact, ...]:
    """Lists the versions of a measurement that a ref shows, in the order of their commits; none of
    another kind."""
    if result.kind is not Kind.MEASUREMENT:
        return ()
    first = first_revised(result.recipe) or result.id
    mentioned = pc.match_substring(pc.field("recipe"), first)  # type: ignore[attr-defined]
    wanted = (pc.field("kind") == result.kind.value) & ((pc.field("artifact") == first) | mentioned)
    rows = sorted(lake.meeting(lake.view(at), wanted).to_pylist(), key=lambda row: row["created"])
    return tuple(
        version
        for version in map(Artifact.from_row, rows)
        if first in (version.id, first_revised(version.recipe))
    )


def place_result(lake: Store, result: Artifact, *, branch: str = MAIN) -> Placed:
    """Finds where a result goes that this code inferred: it is there already if the same code's is,
    else it is new.

    Args:
        result: its row as a first version, without its object.
    """
    present_versions = versions(lake, result, at=branch)
    for version in present_versions:
        if version.code_version == result.code_version:
            return Placed(artifact=version, others=present_versions, new=False)
    if present_versions:
        result = replace(
            result,
            recipe={**result.recipe, REVISION: {"of": result.id, "code": result.code_version}},
        )
    return Placed(artifact=result, others=present_versions, new=True)


def keep(
    lake: Lake,
    result: Artifact,
    write: Callable[[Path], object],
    message: str,
    *,
    branch: str = MAIN,
    derived: Callable[[Artifact], Iterable[Artifact]] = lambda kept: (),
) -> Placed:
    """Commits a result where it is new (see `place_result`), or its object damaged or missing, with
    what was derived from it.

    Args:
        result: its row as a first version, without its object.
        write: writes its object, a Zarr folder that is not there yet.
        derived: rows made from it, by its row as it is kept.

    Raises:
        FlagdataError: as `Lake.transaction`.
    """
    with lake.transaction(message, branch=branch) as transaction:
        placement = place_result(lake, result, branch=branch)
        if placement.new or present(lake, placement.artifact).whole is None:
            staged = transaction.staging(".zarr")
            write(staged)
            transaction.add(replace(placement.artifact, object=transaction.put(staged)))
            for row in derived(placement.artifact):
                transaction.add(row)
    if (
        placement.new and placement.artifact.id not in transaction.result.added
    ):  # another process was faster
        return place_result(lake, result, branch=branch)
    return replace(placement, healed=transaction.result.healed.get(placement.artifact.id))
