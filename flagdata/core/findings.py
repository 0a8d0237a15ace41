"""What an ingest, an alignment or a check found: one type for all reports, for people and for
programs."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


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
        kind: stable machine-readable name in kebab-case ("stale-repeats"); also the quality flag in
            the catalog for warnings and errors.
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

    @classmethod
    def of(
        cls,
        kind: str,
        what: str,
        *,
        where: str | None = None,
        count: int = 1,
        value: float | None = None,
        fix: str | None = None,
    ) -> Finding:
        """Makes a finding of a kind that always has the same severity, that of `SEVERITIES`."""
        return cls(
            kind=kind,
            severity=SEVERITIES[kind],
            what=what,
            where=where,
            count=count,
            value=value,
            fix=fix,
        )

    @property
    def sentence(self) -> str:
        """What was found, as a sentence of its own."""
        return f"{self.what[:1].upper()}{self.what[1:]}."


_KINDS = {
    Severity.NOTE: """
        anemometer-accuracy answers-given bare-dates brightness-flicker camera-moves camera-still
        camera-unknown catalog-unhashed chapter-placed chapters-joined clock-not-set clocks-paired
        clocks-set-back cloth-declared columns-not-read counter-overflow crop-proposed date-given
        days-since-1904 elapsed-time erased expired exposure-unknown files-not-read first-part
        fixed-platform flag-found frames-dropped ingested-before json-lines markers-resampled
        mesh-resampled midnight mirrored mixed-line-ends more-video-streams newest-first north-mark
        not-determined numbered-by-steps parents-absent read-by-description recording-resampled
        ref-file-stale resampled rows-sorted short-rows simulated-with-numerical-damping
        simulated-with-other-stages speed-from-components stamps-at-start start-by-gps
        start-passed-over steady-wind telemetry-without-time topic-read topics-not-read
        topology-changes true-rate units-repaired uploads-unlisted variable-rate vertices-merged
        view-drawn weight-open wind-kinds wind-samples-left-out windows-apart windows-combined
        withdrawn-collected zero-offset-given zone-not-needed
    """,
    Severity.WARNING: """
        above-noise-floor alpha-ignored anemometer-left-out another-size area-weight-contradicted
        aspect-ratio beyond-calibration camera-lost camera-shake capture-rate chapter-not-placed
        chapters-unproven clock-at-limit clock-jump clock-of-wind-assumed clocks-apart
        clocks-hours-apart cloth-assumed-to-end-at-markers cloth-in-pieces cloth-jumps
        cloth-longer-than-rest cloth-not-covered cloth-slit coarse-stamps computed-true-wind
        constant-wind control-characters crop-cuts-motion cut-off damaged-references damping-assumed
        depth-by-content direction-mean-of-numbers doubtful-numbers draft-unconfirmed
        edges-stretched edit-list-passed-over encoding-assumed expiry-unfinished failed-simulations
        few-effective-draws files-missing flag-cut-off flag-size-contradicted
        flies-aside frames-lost frames-missing frames-not-shown frames-repeated frames-undecoded
        gaps gif-delays half-without-readings hdr-transfer hours-off index-damaged
        inertia-does-not-fit interlaced labels-clash leans-on-prior log-disordered markers-astray
        markers-left-out markers-missing markers-not-tracked markers-shared messages-undefined
        narrow-intervals non-data-lines not-a-date nul-bytes odd-rotation one-time order-by-name
        order-by-time orientation-changed pins-move pins-not-observed positions-stuck
        rate-not-as-described rate-unlike-names recording-cut recordings-taken-apart repeated-frames
        report-absent rest-upside-down second-pole-suspected sensor-fault several-anemometers
        several-flags-found several-sheets short-calibration sigma-below-frame size-assumed
        sizes-excluded-by-weight sizes-left-out small-sizes-left-out staging-left stamps-synthetic
        start-unknown start-unsure still-away-from-pins strange-windows stray-file stream-appeared
        t-joints time-backwards timing-uneven true-rate-of-variable unit-from-preamble
        unlike-simulations wind-does-not-fit wind-gap windows-at-end windows-left-out
        zone-contradicts
    """,
    Severity.ERROR: """
        branch-lost clock-reset corrupt-frames corrupt-packets crooked-clock episodes-missing
        erasure-unfinished identity-twice link log-damaged marker-damaged messages-missing no-motion
        no-stamp no-usable-wind pages-not-read ref-unreadable size-changed stamps-disordered
        unreadable-stamps
    """,
}
SEVERITIES = {kind: severity for severity, kinds in _KINDS.items() for kind in kinds.split()}
"""Kind of finding → its severity, of those whose severity does not depend on the data."""


def quality_flags(findings: tuple[Finding, ...]) -> list[str]:
    """Lists the catalog's quality flags: kinds of all warnings and errors, sorted, each once."""
    return sorted({f.kind for f in findings if f.severity is not Severity.NOTE})
