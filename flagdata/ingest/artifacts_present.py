"""What a lake holds already of a source, and what an ingest returns of it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import pyarrow.compute as pc

from flagdata.core.provenance import recipe_hash
from flagdata.core.schema import Kind
from flagdata.errors import ConflictError
from flagdata.ingest.source_file import Source
from flagdata.lake import Artifact, Lake, Transaction
from flagdata.lake.remaking import ABSENT, Present, Remade, present


@dataclass(frozen=True, kw_only=True)
class Labels:
    """What people call an artifact; not part of its identity.

    Attributes:
        name: of the artifact; `None` takes the file's name without its suffix.
        session: one set-up at one place; its clips are always on the same side of a split.
    """

    name: str | None = None
    session: str | None = None


@dataclass(frozen=True, kw_only=True)
class IngestResult:
    """What an ingest did.

    Attributes:
        artifact: as it is in the lake.
        created: false when it was there already, and its row stayed.
        report: what was found, see `flagdata.ingest.ingest_report`.
        healed: what was done where its object was damaged or missing.
    """

    artifact: Artifact
    created: bool
    report: Mapping[str, Any]
    healed: Remade | None = None
    JSON_NAMES: ClassVar = (
        *("artifact=artifact.id", "kind=artifact.kind", "name=artifact.name", "created", "healed"),
        *("object=artifact.object", "source_name=artifact.source_name"),
        *("source_hash=artifact.source_hash", "session=artifact.session"),
        *("quality=artifact.quality", "report"),
    )


def find(
    lake: Lake,
    kind: Kind,
    source: Source,
    recipe: Mapping[str, Any],
    labels: Labels,
    *,
    branch: str,
) -> Present:
    """Finds what the branch has of the artifact that this ingest would make.

    Raises:
        ConflictError: it is there, under another name or session than the one asked for.
    """
    return _presence(
        lake, lake.rows(at=branch).filter(of_source(kind, source, recipe)).to_pylist(), labels
    )


def of_source(kind: Kind, source: Source, recipe: Mapping[str, Any]) -> pc.Expression:
    """Builds the condition that the row of an artifact meets that this source and recipe make."""
    return (
        (pc.field("kind") == kind.value)
        & (pc.field("source_hash") == source.hash)
        & (pc.field("recipe_hash") == recipe_hash(recipe))
    )


def find_same(lake: Lake, artifact: str, labels: Labels, *, branch: str) -> Present:
    """Finds what the branch has of the artifact of an identity.

    Raises:
        ConflictError: it is there, under another name or session than the one asked for.
    """
    return _presence(lake, lake.rows({"artifact": artifact}, at=branch).to_pylist(), labels)


def kept(artifact: Artifact) -> IngestResult:
    """Returns the result of an ingest that found its artifact in the lake."""
    return IngestResult(
        artifact=artifact, created=False, report=json.loads(artifact.report or "{}")
    )


def _presence(lake: Lake, rows: Sequence[Mapping[str, Any]], labels: Labels) -> Present:
    if not rows:
        return ABSENT
    artifact = Artifact.from_row(rows[0])
    check_labels(artifact, labels)
    return present(lake, artifact)


def check_labels(artifact: Artifact, labels: Labels) -> None:
    """Refuse labels that the artifact, which is there already, does not have."""
    for label, asked, stored in (
        ("name", labels.name, artifact.name),
        ("session", labels.session, artifact.session),
    ):
        if asked is not None and asked != stored:
            raise ConflictError(
                f"{artifact.source_name} is in the lake with "
                f"{f'the {label} {stored!r}' if stored else f'no {label}'}, "
                f"not {asked!r}",
                where=artifact.id,
                fix=f"leave out --{label}, or take the old one off with flagdata withdraw and "
                "ingest again",
            )


def result_of(
    transaction: Transaction, artifact: Artifact, report: Mapping[str, Any], labels: Labels
) -> IngestResult:
    """Returns what an ingest did whose transaction has ended.

    Raises:
        ConflictError: another process published it meanwhile, under another name or session than
            the one asked for.
    """
    artifact_in_lake = transaction.result.artifacts[artifact.id]
    if artifact.id in transaction.result.added:
        return IngestResult(artifact=artifact_in_lake, created=True, report=report)
    check_labels(artifact_in_lake, labels)
    return replace(kept(artifact_in_lake), healed=transaction.result.healed.get(artifact.id))
