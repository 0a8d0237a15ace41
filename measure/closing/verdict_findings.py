"""Remarks on the recordings of a verdict: which end it, and which stand in its words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from flagdata.core.findings import Finding, Severity
from flagdata.errors import InputError

if TYPE_CHECKING:
    from measure.verdict.verdict_record import Verdict

_DOUBTFUL = ("inertia-does-not-fit", "wind-does-not-fit", "flies-aside", "still-away-from-pins")
"""Kinds of findings that look like an effect."""


def check_findings(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Returns the findings, none of which is an error: what is wrong with the data must not come
    out as an effect.

    Raises:
        InputError: the first that is one.
    """
    for finding in findings:
        if finding.severity is Severity.ERROR:
            raise InputError(
                finding.what, where=finding.where, fix=finding.fix or "correct the data"
            )
    return tuple(findings)


def finding_text(finding: Finding) -> str:
    """Words a finding: where it was found, and what; a warning with what to do."""
    where = f"{finding.where}: " if finding.where else ""
    fix = f" ({finding.fix})" if finding.fix and finding.severity is Severity.WARNING else ""
    return f"{where}{finding.what}{fix}"


def with_warnings(verdict: Verdict, findings: Sequence[Finding]) -> Verdict:
    """Adds to the verdict the remarks on its data; with those in its words that may themselves be
    what was found."""
    warnings = [finding_text(finding) for finding in findings if finding.kind in _DOUBTFUL]
    beware = (
        " The data themselves may be wrong, which would look like an effect: "
        f"{'; '.join(warnings)}."
        if warnings
        else ""
    )
    return replace(
        verdict,
        words=verdict.words + beware,
        findings=tuple((f.kind, finding_text(f)) for f in findings),
    )
