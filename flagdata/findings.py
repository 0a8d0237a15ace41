"""What an ingest, an alignment or a check found: one type for all reports, for people and for programs."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any


class Severity(StrEnum):
    NOTE = "note"
    """Handled, no effect on the data's meaning."""
    WARNING = "warning"
    """Handled and kept visible: some data is flagged, repaired or less certain."""
    ERROR = "error"
    """Data was lost or is unusable."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing found.

    Attributes:
        kind: stable machine-readable name in kebab-case ("stale-repeats"); also the quality flag in the catalog for
            warnings and errors.
        what: a sentence for people, with the numbers in it.
        where: the first place it occurs ("line 812", "frame 31"), if it has one.
        count: how many rows, frames or seconds it concerns, 1 if it is about the whole.
        value: a number a program may want (the offset found, the worst error), SI.
        fix: what the user can do about it, where something can be done.
    """

    kind: str
    severity: Severity
    what: str
    where: str | None = None
    count: int = 1
    value: float | None = None
    fix: str | None = None

    def as_dict(self) -> dict[str, Any]:
        return {
            "kind": self.kind,
            "severity": self.severity.value,
            "what": self.what,
            "where": self.where,
            "count": self.count,
            "value": self.value,
            "fix": self.fix,
        }


def quality_flags(findings: tuple[Finding, ...]) -> list[str]:
    """The catalog's quality flags: kinds of all warnings and errors, sorted, each once."""
    return sorted({f.kind for f in findings if f.severity is not Severity.NOTE})
