"""Artifacts whose object was damaged or missing, and was made again.

A branch that has an artifact need not have its data: a disk may have changed them, and somebody may
have deleted them. So what makes an artifact asks for its `Present`, and makes it again where the
data are not sound. The transaction that puts the same bytes back has healed every version. Other
bytes, of another encoder for instance, become the artifact's object on the branch from this version
on; what older versions and tags show cannot be put back by them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from flagdata.core.files.durable import HEAL
from flagdata.core.printable import SHORT
from flagdata.core.provenance import code_version
from flagdata.lake.artifact import Artifact
from flagdata.lake.refs import MAIN
from flagdata.lake.store import Store


@dataclass(frozen=True, kw_only=True)
class Remade:
    """What was done about an artifact's object that was damaged or missing.

    Attributes:
        before: the object's name.
        now: that of the one in its place, with the same bytes where it has the same name.
        refs: that show the one before; none where the bytes are the same.
    """

    before: str
    now: str
    refs: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """What was done, as the end of a line that begins with the artifact."""
        if self.now == self.before:
            return "replaced the damaged or missing object; its bytes are those of before"
        done = (
            f"replaced the damaged or missing object by another one, {self.now}: made again, its "
            "bytes differ"
        )
        if not self.refs:
            return done
        still = (
            f"{', '.join(self.refs)} still need{'s' if len(self.refs) == 1 else ''} {self.before}"
        )
        return f"{done}; {still}: {HEAL}, or delete the ref"


@dataclass(frozen=True, kw_only=True)
class Present:
    """What a branch has of an artifact that is asked for.

    Attributes:
        artifact: its row; `None` where there is none.
        sound: whether its object is there and, as far as `Objects.is_sound` compares it, has its
            bytes.
    """

    artifact: Artifact | None
    sound: bool

    @property
    def whole(self) -> Artifact | None:
        """The artifact where there is nothing to make."""
        return self.artifact if self.sound else None

    @property
    def code(self) -> str:
        """The code that a record of it states: what made it first, or its bytes could not be those
        of before."""
        return code_version() if self.artifact is None else self.artifact.code_version


ABSENT = Present(artifact=None, sound=False)


def present(lake: Store, artifact: Artifact) -> Present:
    """Finds what a lake has of an artifact whose row a branch shows; an artifact without an object
    is sound."""
    sound = artifact.object is None or lake.objects.is_sound(artifact.object, artifact.object_bytes)
    return Present(artifact=artifact, sound=sound)


def unsound(lake: Store, artifacts: Iterable[str], *, at: str | None) -> frozenset[str]:
    """Ids of those of many artifacts whose objects are damaged or missing."""
    columns = ["artifact", "object", "object_bytes"]
    rows = [
        row
        for row in lake.rows({"artifact": list(artifacts)}, at=at, columns=columns).to_pylist()
        if row["object"]
    ]
    damaged = lake.objects.unsound({row["object"]: row["object_bytes"] for row in rows})
    return frozenset(row["artifact"] for row in rows if row["object"] in damaged)


def describe_remade(lake: Store, *, before: str, now: str) -> Remade:
    """Describes what became of an object that was damaged or missing, by the refs that there are
    now."""
    if before == now:
        return Remade(before=before, now=now)
    refs = (MAIN, *lake.refs.branches(), *lake.refs.tags())
    showing = [
        ref
        for ref in refs
        if before in lake.columns(lake.view(ref), ["object"])["object"].to_pylist()
    ]
    return Remade(before=before, now=now, refs=tuple(showing))


def said(artifact: str, healed: Remade) -> str:
    """Writes what was done about an artifact, in a line for people."""
    return f"{artifact[:SHORT]}: {healed.sentence}"
