"""Records that flagdata wrote come back: an exported record becomes the artifact that it was.

`flagdata export mcap` writes the rows of what it exports beside the records (`ROWS`). With its row,
and with the artifacts that it was made from on the branch, a record is restored with its identity,
name and report, a recording with its clips. Without its row, what the record itself states is
taken. Where what it was made from is absent, a recording comes in without parents; the part of one
that a clip covers is a recording of its own. Both keep to a session, that of the original or one
named after what they came from, so that no split puts their frames on two sides.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.align.film_recording import truth_window
from flagdata.core.clock_model import ClockModel
from flagdata.core.files.bounded_parquet import read_parquet
from flagdata.core.findings import Finding, quality_flags
from flagdata.core.json_values import json_values
from flagdata.core.printable import SHORT
from flagdata.core.schema import CATALOG, TOPIC_IMAGE, TOPIC_WIND, Kind
from flagdata.dataset.clips import clip_rows
from flagdata.errors import CorruptError, InputError
from flagdata.ingest.artifacts_present import IngestResult, Labels, find_same, kept, result_of
from flagdata.ingest.ingest_report import REPORT_SCHEMA
from flagdata.ingest.source_file import Source
from flagdata.lake import Artifact, Lake
from flagdata.recipes.documents import column_json, from_json
from flagdata.record import Record
from flagdata.record.metadata import CLOCK, PROVENANCE, ROWS, SAMPLE
from flagdata.timebase import NANOSECONDS, iso

_AT_ONCE = 64
_OF_A_SAMPLE = (
    "name",
    "seed",
    "session",
    "dataset",
    "side",
    "day",
    "rate",
    "clock_method",
    "clock_offset",
    "clock_drift",
    "clock_sigma",
    "quality",
)
"""Columns that the recording of an exported clip takes from its label."""


def is_ours(path: Path) -> bool:
    """Checks whether an MCAP file holds a record with its provenance.

    Raises:
        CorruptError: it cannot be read.
    """
    return PROVENANCE in Record.open(path).metadata


def ingest_record(
    lake: Lake, path: Path, *, labels: Labels | None = None, branch: str = "main"
) -> IngestResult:
    """Brings in a record that `flagdata export mcap` wrote, or that was copied out of a lake.

    Raises:
        CorruptError: the record, or the table of rows beside it, is damaged.
        InputError: a record that is of neither a camera, a wind log nor a recording.
        ConflictError: it is in the lake under another name or session than the one asked for.
    """
    labels = labels or Labels()
    source = Source.of(path)
    record = Record.open(path)
    _check(record)
    row = _row_beside(path, source.hash)
    artifact, findings = _artifact(record, row, source, labels)
    absent = sorted(
        set(artifact.parents)
        - set(lake.rows(at=branch, columns=["artifact"])["artifact"].to_pylist())
    )
    if absent:
        artifact = _alone(artifact, source)
        findings = (*findings, _without(absent))
    artifact = replace(
        artifact,
        name=labels.name or artifact.name,
        session=labels.session or artifact.session,
        quality=sorted({*artifact.quality, *quality_flags(findings)}),
    )
    report = _report(artifact, record, findings)
    if artifact.report is None:
        artifact = replace(artifact, report=json.dumps(report, allow_nan=False, ensure_ascii=False))
    artifact_in_lake = find_same(lake, artifact.id, labels, branch=branch).whole
    if artifact_in_lake is not None:
        return replace(kept(artifact_in_lake), report=report)
    with lake.transaction(f"ingest record {source.name}", branch=branch) as transaction:
        artifact = replace(artifact, object=transaction.put(path))
        source.check_unchanged()
        transaction.add(artifact)
        if artifact.kind is Kind.RECORDING:
            for clip in clip_rows(record, artifact, window=truth_window(artifact.recipe)):
                transaction.add(clip)
    return result_of(transaction, artifact, report, labels)


def _check(record: Record) -> None:
    """Compare all frames and samples with their checksums."""
    if TOPIC_IMAGE in record.topics:
        count = record.frame_count
        for first in range(0, count, _AT_ONCE):
            record.timestamps(first, min(_AT_ONCE, count - first))
    record.wind()


def _row_beside(path: Path, sha256: str) -> dict[str, Any] | None:
    """Reads the row of a record in the table beside it; `None` where there is no table, or it does
    not have this record."""
    rows = path.parent / ROWS
    if not rows.is_file():
        return None
    try:
        table = read_parquet(rows)
        missing = [name for name in CATALOG if name not in table.column_names]
        for name in missing:
            table = table.append_column(name, pa.nulls(table.num_rows, CATALOG[name].type))
        rows_of_record = table.filter(pc.field("artifact") == path.stem).to_pylist()
    except (pa.ArrowException, OSError) as error:
        raise CorruptError(
            f"the table of rows beside the record cannot be read: {error}",
            where=str(rows),
            fix="export again, or move the record to a folder of its own to ingest it without its "
            "row",
        ) from None
    is_whole = rows_of_record and rows_of_record[0]["frame_first"] is None
    if not rows_of_record or (is_whole and rows_of_record[0]["object"] != f"mcap/{sha256}"):
        return None
    return {name: rows_of_record[0][name] for name in CATALOG}


def _artifact(
    record: Record, row: Mapping[str, Any] | None, source: Source, labels: Labels
) -> tuple[Artifact, tuple[Finding, ...]]:
    """Builds what a record was, with its former parents; of a clip's part the recording that it is
    now."""
    if SAMPLE in record.metadata:
        return _of_sample(record, row, source), ()
    if row is not None:
        return replace(Artifact.from_row(row), branch="main", created=None, object=None), ()
    return _of_metadata(record, source), (_unreported_finding(labels),)


def _of_sample(record: Record, row: Mapping[str, Any] | None, source: Source) -> Artifact:
    where = str(record.path)
    try:
        label = from_json(record.metadata[SAMPLE]["label"])
        labels = {column: label[column] for column in _OF_A_SAMPLE}
        original, recording = label["artifact"], label["recording"]
        parameters = (
            None if label["parameters"] is None else json.dumps(label["parameters"], sort_keys=True)
        )
    except (ValueError, KeyError, TypeError) as error:
        raise CorruptError(
            f"the label of the sample is damaged: {error}", where=where, fix="export it again"
        ) from None
    recipe = (
        column_json(row["recipe"], "recipe", artifact=row["artifact"])
        if row and row["recipe"]
        else {}
    )
    window = {"truth": {"window": recipe["window"]}} if "window" in recipe else {}
    times = record.frame_times
    return Artifact(
        kind=Kind.RECORDING,
        source_hash=source.hash,
        source_name=source.name,
        parameters=parameters,
        recipe={"ingest": "record", "artifact": original, **window},
        start=int(times[0]),
        end=int(times[-1]),
        frame_count=len(times),
        clock_model=_clock(record)[0],
        **{**labels, "session": labels["session"] or f"recording {str(recording)[:SHORT]}"},
    )


def _of_metadata(record: Record, source: Source) -> Artifact:
    """Builds an artifact from what a record says of itself; the name and the session are not in
    it."""
    where = str(record.path)
    provenance = dict(record.metadata[PROVENANCE])
    try:
        recipe = from_json(provenance["recipe"])
    except (ValueError, KeyError):
        raise InputError(
            "the record does not state its recipe", where=where, fix="export it again"
        ) from None
    filmed, windy = TOPIC_IMAGE in record.topics, TOPIC_WIND in record.topics
    parents = [provenance[role] for role in ("camera", "wind", "sequence") if role in provenance]
    of_a_device = "source_hash" in provenance
    if not (filmed or windy) or (of_a_device and filmed and windy):
        raise InputError(
            "the record is of neither a device nor a recording",
            where=where,
            fix="see flagdata doctor",
        )
    kind = Kind.RECORDING if not of_a_device else Kind.CAMERA if filmed else Kind.WIND
    series = record.wind()
    times = (
        record.frame_times if filmed else series.time if series is not None else record.frame_times
    )
    clock, middle = _clock(record)
    model = ClockModel.from_json(clock) if clock is not None else None
    span = int(times[-1] - times[0])
    return Artifact(
        kind=kind,
        name=Path(provenance.get("source_name", source.name)).stem,
        recipe=recipe,
        parents=parents,
        source_hash=provenance.get("source_hash"),
        source_name=provenance.get("source_name"),
        start=int(times[0]),
        end=int(times[-1]),
        day=iso(int(times[0]))[:10],
        frame_count=record.frame_count if filmed else None,
        rate=(len(times) - 1) * NANOSECONDS / span if span else None,
        clock_model=clock,
        clock_method=model.method if model is not None else None,
        clock_offset=float(model.to_common(middle) - middle) / NANOSECONDS
        if model is not None
        else None,
        clock_drift=model.segments[0].drift if model is not None else None,
        clock_sigma=float(model.sigma(middle)) if model is not None else None,
    )


def _clock(record: Record) -> tuple[str | None, int]:
    """Reads the clock model of the camera in a record, as JSON, and the middle of the film on the
    camera's clock."""
    models = [
        values["model"] for name, values in record.metadata.items() if name.startswith(f"{CLOCK}/")
    ]
    if len(models) != 1 or TOPIC_IMAGE not in record.topics:
        return None, 0
    device = record.device_frame_times
    return models[0], int(device[0] + (device[-1] - device[0]) // 2)


def _alone(artifact: Artifact, source: Source) -> Artifact:
    """Builds a recording without its parents: its recipe names what it was, its session holds
    together what came of one."""
    recipe = {"ingest": "record", "artifact": artifact.id, **artifact.recipe}
    session = artifact.session or f"camera {artifact.parents[0][:SHORT]}"
    return replace(
        artifact,
        parents=(),
        recipe=recipe,
        session=session,
        source_hash=source.hash,
        source_name=source.name,
    )


def _without(absent: list[str]) -> Finding:
    return Finding.of(
        "parents-absent",
        "what it was made from is not on the branch "
        f"({', '.join(parent[:SHORT] for parent in absent)}): it came in as "
        "a recording without parents",
        count=len(absent),
        fix="to restore it whole, export and ingest the camera and the wind first, then withdraw "
        "this one",
    )


def _unreported_finding(labels: Labels) -> Finding:
    unknown = [
        label
        for label, value in (("name", labels.name), ("session", labels.session))
        if value is None
    ]
    fix = (
        "take it off (flagdata withdraw), then ingest the file in the folder that flagdata export "
        "wrote"
    )
    return Finding.of(
        "report-absent",
        f"there is no {ROWS} with its row beside the record: unknown are its "
        f"{', '.join([*unknown, 'side'])} and "
        "quality flags",
        fix=fix
        + (f", or give {' and '.join(f'--{label}' for label in unknown)}" if unknown else ""),
    )


def _report(artifact: Artifact, record: Record, findings: tuple[Finding, ...]) -> dict[str, Any]:
    """Reports what came in, for people and for --json."""
    start, end = artifact.start or 0, artifact.end or 0
    return {
        "schema": REPORT_SCHEMA,
        "kind": "record",
        "format": f"a record of flagdata ({artifact.kind})",
        "reasons": [],
        "start": iso(start),
        "end": iso(end),
        "span": (end - start) / NANOSECONDS,
        "frames": record.frame_count if TOPIC_IMAGE in record.topics else 0,
        "rate": artifact.rate,
        "wind": TOPIC_WIND in record.topics,
        "findings": json_values(findings),
    }
