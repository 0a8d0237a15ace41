"""Findings about data that went or is to go: erased, expired, collected, or not quite gone."""

from __future__ import annotations

from collections.abc import Collection

from flagdata.core.findings import Finding, Severity
from flagdata.errors import FlagdataError
from flagdata.lake.lake import Lake
from flagdata.lake.lineage import removals
from flagdata.lake.marking import Marked
from flagdata.lake.removal import Unfinished, erased_objects
from flagdata.lake.removal import left as rows_left


def findings_of_removed(lake: Lake, marked: Marked, stored: Collection[str]) -> list[Finding]:
    """Notes on data that went: erased, expired, collected.

    Raises:
        CorruptError: what the log notes of it cannot be read.
    """
    return [
        *_erased_findings(lake, marked),
        *_expired_findings(lake, marked, stored),
        *_collected_findings(lake, marked, stored),
    ]


def _erased_findings(lake: Lake, marked: Marked) -> list[Finding]:
    """Notes each tag or branch that lists rows whose data were erased."""
    gone = {name: why for name, why in erased_objects(lake).items() if name not in marked.objects}
    findings = []
    for ref, table in marked.refs.items():
        names = [name for name in table["object"].to_pylist() if name in gone]
        if names:
            version, message = max(gone[name] for name in names)
            findings.append(
                Finding.of(
                    "erased",
                    f"{len(names)} rows have no data any more: they were erased, the last by "
                    f"version {version} "
                    f"({message})",
                    count=len(names),
                    where=f"ref {ref}",
                    fix="none needed; exports of this ref leave them out by --where, or fail",
                )
            )
    return findings


def unfinished_finding(lake: Lake, left: Unfinished) -> Finding:
    """Warns of a commit that was cut off before all of its data were gone."""
    where = str(lake.objects.path(left.name))
    rest = f"what {left.name} holds ({left.reason}), and its bytes are still there: "
    if left.kind == "erasure":
        return Finding.of(
            "erasure-unfinished",
            f"version {left.version} erased {rest}the erasure was interrupted, or the disk refused "
            "it",
            where=where,
            fix="run flagdata gc, which deletes it at once; or the same flagdata withdraw "
            "--everywhere again",
        )
    return Finding.of(
        "expiry-unfinished",
        f"version {left.version} let expire {rest}the expiry was interrupted, or the disk refused "
        "it",
        where=where,
        fix="run flagdata gc: what expired goes at once, whatever its age",
    )


def _expired_findings(lake: Lake, marked: Marked, stored: Collection[str]) -> list[Finding]:
    """Notes each commit that let versions expire, of which data went."""
    return [
        Finding.of(
            "expired",
            f"{len(gone)} of the objects that these versions show went when they expired, by "
            "version "
            f"{removal.version} ({removal.reason})",
            count=len(gone),
            where=f"versions up to {up_to}",
            fix=f"none needed; all branches and tags, and versions from {removal.version} on, are "
            "whole without them",
        )
        for removal in removals(lake.catalog.history())
        for up_to, objects in (removal.expired,)
        if (gone := objects - _needed_objects(marked) - frozenset(stored))
    ]


def _collected_findings(lake: Lake, marked: Marked, stored: Collection[str]) -> list[Finding]:
    """Notes where data were erased, or gc has deleted what was withdrawn, so that older versions
    show rows without data."""
    try:
        gone = lake.catalog.objects() - _needed_objects(marked) - frozenset(stored)
        removed = removals(lake.catalog.history())
        gone -= {name for removal in removed for name in removal.expired[1]}
        erased = {name: why for name, why in erased_objects(lake).items() if name in gone}
        gone -= erased.keys()
        last = (
            next((r for r in removed if not gone.isdisjoint(rows_left(lake, r).values())), None)
            if gone
            else None
        )
    except FlagdataError as error:  # a file of which older versions are made
        kind = "catalog-file-unreadable"
        return [
            Finding(
                kind=kind,
                severity=Severity.ERROR,
                what=error.what,
                where=error.where,
                fix=error.fix,
            )
        ]
    findings = []
    if erased:
        version, message = max(erased.values())
        findings.append(
            Finding.of(
                "erased",
                f"{len(erased)} of the objects that older versions show were erased, the last by "
                f"version {version} ({message})",
                where=f"versions before {version}",
                count=len(erased),
                fix=f"none needed; all tags, and versions from {version} on, are whole without "
                "them",
            )
        )
    if last is None:
        return findings
    return [
        *findings,
        Finding.of(
            "withdrawn-collected",
            f"gc deleted what was withdrawn: {len(gone)} of the objects that older versions show; "
            "the last were"
            f" withdrawn by version {last.version} ({last.reason})",
            where=f"versions before {last.version}",
            count=len(gone),
            fix=f"none needed; all tags, and versions from {last.version} on, are whole without "
            "them",
        ),
    ]


def _needed_objects(marked: Marked) -> frozenset[str]:
    """Names of the objects that a branch or tag shows."""
    return frozenset(
        name for table in marked.refs.values() for name in table["object"].drop_null().to_pylist()
    )
