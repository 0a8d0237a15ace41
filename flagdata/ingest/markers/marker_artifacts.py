"""From a marker table to artifacts of the lake, one a recording, in one commit."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from flagdata.core.files.durable import disk_errors
from flagdata.core.findings import Finding, quality_flags
from flagdata.core.json_values import json_values
from flagdata.core.schema import Kind
from flagdata.ingest.artifacts_present import IngestResult, Labels, find, kept, result_of
from flagdata.ingest.ingest_report import REPORT_SCHEMA
from flagdata.ingest.markers.marker_table import MarkerOptions, read_table
from flagdata.ingest.source_file import Source
from flagdata.lake import Artifact, Lake
from flagdata.lake.marker_sequences import MarkerSequence, write_markers
from flagdata.timebase import NANOSECONDS


def ingest_markers(
    lake: Lake,
    path: Path,
    options: MarkerOptions | None = None,
    *,
    labels: Labels | None = None,
    branch: str = "main",
    reasons: Sequence[str] = (),
) -> tuple[IngestResult, ...]:
    """Ingest a table of tracked points.

    Args:
        labels: of a table with several recordings the name goes before theirs.
        reasons: why the file is taken to be markers, for the report.

    Raises:
        FlagdataError: as `read_table`; the lake is unchanged.
        ConflictError: the file changed while it was read, or is in the lake under other labels.
    """
    options, labels = options or MarkerOptions(), labels or Labels()
    source = Source.of(path)
    recordings = read_table(path, options)
    source.check_unchanged()
    labels_of: dict[str, Labels] = {}
    new: dict[str, tuple[Artifact, dict[str, Any]]] = {}
    present: dict[str, IngestResult] = {}
    with lake.transaction(f"ingest markers {source.name}", branch=branch) as transaction:
        for name, sequence in recordings.items():
            stem = labels.name or source.stem
            labels_of[name] = Labels(name=f"{stem} {name}".strip(), session=labels.session)
            recipe = {"ingest": "markers", "recording": name, **options.recipe()}
            asked = labels_of[name] if labels.name is not None else Labels(session=labels.session)
            artifact_in_lake = find(lake, Kind.MARKERS, source, recipe, asked, branch=branch).whole
            if artifact_in_lake is not None:
                present[name] = kept(artifact_in_lake)
                continue
            findings = _findings(sequence)
            report = _report(sequence, findings, reasons)
            staged = transaction.staging(".zarr")
            with disk_errors("writing markers", staged):
                write_markers(staged, sequence)
            artifact = Artifact(
                kind=Kind.MARKERS,
                name=labels_of[name].name or source.stem,
                object=transaction.put(staged),
                source_hash=source.hash,
                source_name=source.name,
                recipe=recipe,
                session=labels.session,
                frame_count=len(sequence.time),
                rate=report["rate"],
                quality=quality_flags(findings),
                report=json.dumps(report, allow_nan=False, ensure_ascii=False),
            )
            transaction.add(artifact)
            new[name] = (artifact, report)
    return tuple(
        present[name] if name in present else result_of(transaction, *new[name], labels_of[name])
        for name in recordings
    )


def _findings(sequence: MarkerSequence) -> tuple[Finding, ...]:
    total = len(sequence.time) * len(sequence.names)
    lost = total - sequence.tracked
    if not lost:
        return ()
    return (
        Finding.of(
            "markers-not-tracked",
            f"{lost} of {total} positions were not tracked",
            count=lost,
            value=lost / total,
        ),
    )


def _report(
    sequence: MarkerSequence, findings: Sequence[Finding], reasons: Sequence[str]
) -> dict[str, Any]:
    span = int(sequence.time[-1]) / NANOSECONDS
    return {
        "schema": REPORT_SCHEMA,
        "kind": Kind.MARKERS.value,
        "format": "marker table",
        "reasons": list(reasons),
        "frames": len(sequence.time),
        "span": span,
        "rate": (len(sequence.time) - 1) / span if span else None,
        "markers": len(sequence.names),
        "tracked": sequence.tracked,
        "findings": json_values(findings),
    }
