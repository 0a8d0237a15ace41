"""What a lake still needs: the rows its refs reach, those withdrawn a short while ago, and their
objects."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import timedelta
from math import inf

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.core.files.durable import HEAL
from flagdata.core.findings import Finding, Severity
from flagdata.core.provenance import file_hash
from flagdata.core.shell import command_line
from flagdata.errors import CorruptError, FlagdataError
from flagdata.lake.delta_log import LogGapError
from flagdata.lake.lineage import Removal, removals
from flagdata.lake.refs import ERASED, MAIN, Slice, View, made_by
from flagdata.lake.store import Store
from flagdata.storage import Place

_BEHIND = 86_400.0
"""Most seconds by which a writer's clock is taken to have been behind."""


@dataclass(frozen=True, kw_only=True)
class Marked:
    """What is needed.

    Attributes:
        refs: each ref (main, branches, tags) → its rows, in the catalog's schema.
        objects: names of all objects that a row of a ref points to, or one that was withdrawn, or
            shown by a ref that was deleted, within the grace period; not of rows that were erased
            since.
        findings: refs that cannot be read or are lost; while there are any, nothing may be
            collected.
    """

    refs: dict[str, pa.Table]
    objects: frozenset[str]
    findings: tuple[Finding, ...]

    @property
    def sizes(self) -> dict[str, int]:
        """Bytes of the objects that the rows of refs point to, as far as these state them."""
        return {
            row["object"]: row["object_bytes"]
            for table in self.refs.values()
            for row in table.select(["object", "object_bytes"]).to_pylist()
            if row["object_bytes"] is not None
        }

    def check(self, *further: Finding, outcome: str = "", fix: str | None = None) -> None:
        """Checks that it is known which objects are needed.

        Args:
            further: findings on the catalog's files.
            outcome: what follows, for the message; fix: in place of the remedy of what is damaged.

        Raises:
            CorruptError: a ref cannot be read or is lost, or a file is damaged.
        """
        for finding in (*self.findings, *further):
            if finding.severity is Severity.ERROR:
                message = f"which objects are needed is unknown{outcome}: {finding.what}"
                raise CorruptError(
                    message, where=finding.where, fix=fix or finding.fix or "run flagdata doctor"
                )


def mark(lake: Store, *, grace: timedelta, first: int | None = None) -> Marked:
    """Reads every ref, and what was shown before each withdrawal and deletion younger than `grace`.

    Args:
        first: and what any version from this one on shows.
    """
    refs: dict[str, pa.Table] = {}
    objects: set[str] = set()
    findings: list[Finding] = []
    try:
        lake.catalog.history()
    except FlagdataError as error:
        kind = error.kind if isinstance(error, LogGapError) else "log-damaged"
        finding = Finding(
            kind=kind, severity=Severity.ERROR, what=error.what, where=error.where, fix=error.fix
        )
        return Marked(refs={}, objects=frozenset(), findings=(finding,))
    try:
        names = [MAIN, *lake.refs.branches(), *lake.refs.tags()]
    except FlagdataError as error:
        return Marked(
            refs={}, objects=frozenset(), findings=(_unreadable(error, error.where or "refs"),)
        )
    for name in names:
        try:
            view = lake.view(name)
            refs[name] = lake.table(view)
            objects |= _objects(rows_not_erased(lake, refs[name], view))
        except FlagdataError as error:
            findings.append(_unreadable(error, f"ref {name}"))
    try:
        findings += _lost(lake.catalog.rows(lake.catalog.head()), names, str(lake.path))
        since = lake.now() - grace.total_seconds() if grace else inf
        for table in _withdrawn(
            lake, since=since, first=first
        ):  # one at a time: each may be as long as the catalog
            objects |= _objects(table)
    except FlagdataError as error:
        findings.append(_unreadable(error, "recent versions"))
    return Marked(refs=refs, objects=frozenset(objects), findings=tuple(findings))


def rows_not_erased(lake: Store, rows: pa.Table, view: View) -> pa.Table:
    """Returns the rows that no version after those of a view erased."""
    newest = max(part.version for part in view)
    erased = {
        a
        for removal in removals(lake.catalog.history())
        if removal.version > newest
        for a in removal.erased
    }
    return (
        rows.filter(~pc.field("artifact").isin(pa.array(sorted(erased), pa.string())))
        if erased
        else rows
    )


def _objects(table: pa.Table) -> set[str]:
    return set(table["object"].drop_null().to_pylist())


def catalog_files(lake: Store) -> tuple[Finding, ...]:
    """Hashes the files of the catalog again, of all its versions: an error for each that is missing
    or has changed, a note on how many were written before hashes were noted."""
    try:
        hashes = lake.catalog.file_hashes()
        changed = lake.catalog.changed_entries()
    except FlagdataError as error:
        return (Finding.of("log-damaged", error.what, where=error.where, fix=error.fix),)
    findings = [
        _damaged_finding("log-damaged", "an entry of the catalog's log has changed", path)
        for path in changed
    ]
    for path, noted in sorted(hashes.items(), key=lambda item: str(item[0])):
        try:
            hash_now = file_hash(path)
        except FileNotFoundError:
            findings.append(
                _damaged_finding("catalog-file-missing", "a file of the catalog is missing", path)
            )
            continue
        except OSError as error:
            message = f"a file of the catalog cannot be read: {error.strerror}"
            findings.append(_damaged_finding("catalog-file-unreadable", message, path))
            continue
        if noted is not None and hash_now != noted:
            findings.append(
                _damaged_finding("catalog-file-changed", "a file of the catalog has changed", path)
            )
    unchecked = list(hashes.values()).count(None)
    if unchecked:
        findings.append(
            Finding.of(
                "catalog-unhashed",
                f"{unchecked} of {len(hashes)} files of the catalog were written before their "
                "hashes were noted, "
                "and are not checked",
                where=str(lake.catalog.path),
                count=unchecked,
            )
        )
    return tuple(findings)


def _damaged_finding(kind: str, text: str, path: Place) -> Finding:
    return Finding(kind=kind, severity=Severity.ERROR, what=text, where=str(path), fix=HEAL)


def _lost(head: pa.Table, identities: list[str], where: str) -> list[Finding]:
    rows = Counter(head["branch"].to_pylist())
    return [
        Finding.of(
            "branch-lost",
            f"{count} rows are on branch {name!r}, which is not among the refs: no ref shows them",
            where=f"ref {name}",
            count=count,
            fix="give the flagdata push or pull that was stopped again, which goes on with it (for "
            "a clone: "
            f"{command_line('flagdata', 'pull', 'SOURCE', '--lake', where)}); where there was "
            f"none, {HEAL}",
        )
        for name, count in sorted(rows.items())
        if name not in identities
    ]


def _withdrawn(lake: Store, *, since: float, first: int | None) -> Iterator[pa.Table]:
    for removal in removals(lake.catalog.history()):
        before = removal.version - 1
        recent = _is_recent(lake, removal, since)
        if not recent and (first is None or before < first):
            continue
        if removal.withdrawn:
            yield _rows_with_data(
                lake, lake.catalog.rows(before), (Slice(branch=MAIN, version=before),)
            )
        for branch in removal.branches - _begun_without(removal):
            if removal.hidden(branch):  # rows of a base, which may have left the table long ago
                view = lake.lineage().view(Slice(branch=branch, version=before))
                yield _rows_with_data(lake, lake.table(view), view)
        if recent and removal.deleted:
            yield _rows_with_data(lake, lake.table(removal.view), removal.view)


def _begun_without(removal: Removal) -> frozenset[str]:
    """Lists the branches that a commit began and that never showed what it hides on them: it was
    erased before."""
    return frozenset(
        name for (_, name), ref in made_by(removal.entry).items() if ERASED in ref.notes
    )


def _is_recent(lake: Store, removal: Removal, since: float) -> bool:
    """Returns whether rows went since then: as the writer's clock says, or that of the disk or
    store, since the writer's may be behind."""
    writers_time = removal.entry["timestamp"] / 1000
    return bool(
        writers_time >= since
        or (writers_time >= since - _BEHIND and lake.catalog.written(removal.version) >= since)
    )


def _rows_with_data(lake: Store, rows: pa.Table, view: View) -> pa.Table:
    """Returns the rows that no version after those of a view erased, and whose data did not go
    since: with versions that expired, or with an erased artifact of the same bytes."""
    newest = max(part.version for part in view)
    later = [removal for removal in removals(lake.catalog.history()) if removal.version > newest]
    gone = {
        name
        for removal in later
        for name in (*removal.expired[1], *removal.erased.values())
        if name is not None
    }
    rows = rows_not_erased(lake, rows, view)
    return (
        rows.filter(~pc.field("object").isin(pa.array(sorted(gone), pa.string()))) if gone else rows
    )


def _unreadable(error: FlagdataError, where: str) -> Finding:
    """Reports what is to blame, where the error names a file, else of what was read."""
    at = error.where or where
    return Finding.of("ref-unreadable", error.what, where=at, fix=error.fix)
