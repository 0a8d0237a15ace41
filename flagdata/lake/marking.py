"""What a lake still needs: the rows its refs reach, those withdrawn a short while ago, and their objects."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import pyarrow as pa

from flagdata.errors import FlagdataError
from flagdata.findings import Finding, Severity
from flagdata.lake.lake import Lake
from flagdata.lake.refs import MAIN


@dataclass(frozen=True, kw_only=True)
class Marked:
    """What is needed.

    Attributes:
        refs: each ref (main, branches, tags) → its rows, in the catalog's schema.
        objects: names of all objects that a row of a ref, or one withdrawn within the grace period, points to.
        findings: refs that cannot be read or are lost; while there are any, nothing may be collected.
    """

    refs: dict[str, pa.Table]
    objects: frozenset[str]
    findings: tuple[Finding, ...]


def mark(lake: Lake, *, grace: timedelta) -> Marked:
    """Read every ref, and the catalog as it was before each withdrawal younger than `grace`."""
    refs: dict[str, pa.Table] = {}
    recent: list[pa.Table] = []
    findings: list[Finding] = []
    try:
        names = [MAIN, *lake.refs.branches(), *lake.refs.tags()]
    except FlagdataError as error:
        return Marked(refs={}, objects=frozenset(), findings=(_unreadable(error, error.where or "refs"),))
    for name in names:
        try:
            refs[name] = lake.rows(at=name)
        except FlagdataError as error:
            findings.append(_unreadable(error, f"ref {name}"))
    try:
        findings += _lost(lake.catalog.rows(lake.catalog.head()), names)
        recent = [lake.catalog.rows(v - 1) for v in _withdrawals(lake, datetime.now(UTC) - grace)]
    except FlagdataError as error:
        findings.append(_unreadable(error, "recent versions"))
    objects = {name for table in (*refs.values(), *recent) for name in table["object"].drop_null().to_pylist()}
    return Marked(refs=refs, objects=frozenset(objects), findings=tuple(findings))


def _lost(head: pa.Table, known: list[str]) -> list[Finding]:
    rows = Counter(head["branch"].to_pylist())
    return [
        Finding(
            kind="branch-lost",
            severity=Severity.ERROR,
            what=f"{count} rows are on branch {name!r}, which is not among the refs: no ref shows them",
            where=f"ref {name}",
            count=count,
            fix=f"restore refs/branches/{name}.json from a copy",
        )
        for name, count in sorted(rows.items())
        if name not in known
    ]


def _withdrawals(lake: Lake, since: datetime) -> list[int]:
    limit = since.timestamp() * 1000
    return [e["version"] for e in lake.catalog.history() if "withdrawn" in e and e["timestamp"] >= limit]


def _unreadable(error: FlagdataError, where: str) -> Finding:
    return Finding(kind="ref-unreadable", severity=Severity.ERROR, what=error.what, where=where, fix=error.fix)
