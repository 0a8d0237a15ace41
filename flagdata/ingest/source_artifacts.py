"""From a vendor's file to an artifact of the lake: read, written as a record on the device's own
clock, published.

The identity of an artifact is its source's bytes, the options that shaped it, and of a log what was
understood of it, so that ingesting a file again finds it. Of a log that comes in for a second
session, its session is a part, too. One
source is one transaction: an error, Ctrl-C or a crash leaves the lake as it was.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pyarrow.compute as pc

from flagdata.align.paired import PairedClocks, host_clock
from flagdata.core.findings import Finding, Severity, quality_flags
from flagdata.core.json_values import json_values
from flagdata.core.provenance import digest
from flagdata.core.schema import Kind
from flagdata.errors import FlagdataError, InputError, NothingMeasuredError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.ingest.anemometer.log_confirmation import UNASKED, Confirm, confirm_readings
from flagdata.ingest.anemometer.samples.neighbours import hours_off
from flagdata.ingest.anemometer.sensor_recipe import SENSORS
from flagdata.ingest.artifacts_present import (
    IngestResult,
    Labels,
    check_labels,
    find,
    kept,
    of_source,
    result_of,
)
from flagdata.ingest.before import earlier, other_readings
from flagdata.ingest.camera import CameraOptions
from flagdata.ingest.ingest_report import FrameTimes, camera_report, wind_report
from flagdata.ingest.mcap.bags import is_bag
from flagdata.ingest.source_file import Source
from flagdata.lake import Artifact, Lake, Transaction
from flagdata.lake.remaking import Present
from flagdata.record import Coding, Record, RecordWriter
from flagdata.record.metadata import CAMERA, PROVENANCE, camera_metadata
from flagdata.record.signals import WindLog, WindSeries
from flagdata.record.writer import ATTACHMENT_LIMIT, JPEG_QUALITY
from flagdata.timebase import iso

Progress = Callable[[int], object]
NEIGHBOURS = 3
"""Logs of a session that a new one is compared with: those that share most of its time."""
CROP_PICTURE = "crop.png"
"""Attachment of a camera record whose crop was found from motion: the motion in red, the crop in
yellow."""


@dataclass(frozen=True, kw_only=True)
class CameraIngest:
    """All that shapes a camera artifact: how the file is read, and how its frames are stored."""

    camera: CameraOptions = field(default_factory=CameraOptions)
    coding: Coding = Coding.JPEG

    def recipe(self) -> dict[str, Any]:
        stored: dict[str, Any] = {"coding": self.coding.value}
        if self.coding is Coding.JPEG:
            stored["quality"] = JPEG_QUALITY
        return {"ingest": "camera", "camera": self.camera.recipe(), "stored": stored}


@dataclass(frozen=True, kw_only=True)
class WindIngest:
    """All that shapes a wind artifact."""

    wind: WindOptions = field(default_factory=WindOptions)

    def recipe(self) -> dict[str, Any]:
        """Returns the options; a sensor recipe by its name and content, since its file may change
        or lie elsewhere tomorrow."""
        options = json_values(self.wind)
        if self.wind.recipe is not None:
            options["recipe"] = Path(self.wind.recipe).name
            options["recipe_hash"] = digest(
                SENSORS.find(self.wind.recipe).data.decode(errors="replace")
            )
        return {"ingest": "wind", "wind": options}


def ingest_camera(
    lake: Lake,
    path: Path,
    options: CameraIngest | None = None,
    *,
    labels: Labels | None = None,
    branch: str = "main",
    reasons: Sequence[str] = (),
    progress: Progress | None = None,
    crop_picture: Callable[[bytes], object] | None = None,
) -> IngestResult:
    """Ingest a camera file or a folder of pictures; frames are streamed, in constant memory.

    A crop found from motion is attached as a picture, see `CROP_PICTURE`.

    Args:
        reasons: why the file is taken to be a camera's, for the report.
        progress: called with 1 for each frame written.
        crop_picture: called with the picture (PNG) of a crop found from motion before a frame is
            read; what it raises leaves the lake unchanged. For an artifact that is there already,
            it is called with the attachment.

    Raises:
        FlagdataError: as `open_camera`; the lake is unchanged.
        ConflictError: the file changed while it was read, or is in the lake under other labels.
    """
    from flagdata.ingest.camera import (
        open_camera,
    )  # decoders of video, which a wind's log needs none of
    from flagdata.ingest.camera.chapters import chapter_of

    options, labels = options or CameraIngest(), labels or Labels()
    source = Source.of(path, with_files=options.camera.chapters)
    recipe = options.recipe()
    chapter = chapter_of(path) if options.camera.start is None else None
    if chapter is not None and chapter.before:
        recipe["chapter_before"] = (
            chapter.before
        )  # it comes from other files, and shapes the result
    present = find(lake, Kind.CAMERA, source, recipe, labels, branch=branch)
    if present.whole is not None:
        if crop_picture is not None:
            crop_picture(
                Record.open(lake.record_place(str(present.whole.object))).attachment(CROP_PICTURE)
            )
        return kept(present.whole)
    with lake.transaction(f"ingest camera {source.name}", branch=branch) as transaction:
        staged = transaction.staging(".mcap")
        times = FrameTimes()
        with open_camera(path, options.camera) as stream:
            metadata = {
                CAMERA: camera_metadata(stream.info),
                PROVENANCE: source.provenance(recipe, code=present.code),
            }
            with RecordWriter(
                staged, metadata=metadata, coding=options.coding, quality=JPEG_QUALITY
            ) as record:
                if stream.proposal is not None:
                    if crop_picture is not None:
                        crop_picture(stream.proposal.picture)
                    record.attach(
                        CROP_PICTURE,
                        stream.proposal.picture,
                        media_type="image/png",
                        log_time=stream.info.start,
                    )
                for frame in stream:
                    record.frame(
                        log_time=frame.time,
                        publish_time=frame.time,
                        timestamp=frame.time,
                        image=frame.image,
                    )
                    times.add(frame.time, frame.stamp_error)
                    if progress:
                        progress(1)
            info, findings, data_set = stream.info, stream.findings, stream.data_set
        findings = (
            *findings,
            *other_readings(_present(lake, Kind.CAMERA, branch), source.hash, recipe),
        )
        if not times.count:
            raise InputError("no frame could be read", where=str(path), fix="check the file")
        source.check_unchanged()
        report = camera_report(info, times, findings, reasons)
        artifact = _artifact(
            Kind.CAMERA,
            source,
            recipe,
            labels,
            findings=findings,
            report=report,
            start=times.first,
            end=times.last,
            rate=times.rate,
            frame_count=times.count,
            stored=transaction.put(staged),
        )
        given = {"session": labels.session} if labels.session is not None else {}
        artifact = replace(artifact, **{**data_set, **given})
        transaction.add(artifact)
    return result_of(transaction, artifact, report, labels)


def ingest_wind(
    lake: Lake,
    path: Path,
    options: WindIngest | None = None,
    *,
    labels: Labels | None = None,
    branch: str = "main",
    confirm: Confirm = UNASKED,
) -> IngestResult:
    """Ingest an anemometer's log. The vendor's file, and the sensor recipe that was named, are
    attached.

    Args:
        confirm: asks whether a drafted reading is right; without it a draft is refused.

    Raises:
        FlagdataError: as `read_log`; the lake is unchanged.
        UnconfirmedError: nobody confirmed what the program drafted; the lake is unchanged.
        ConflictError: the file changed while it was read, or is in the lake under other labels.
    """
    readings = [(options or WindIngest(), labels or Labels())]
    (result,) = ingest_winds(lake, path, readings, branch=branch, confirm=confirm)
    if isinstance(result, NothingMeasuredError):
        raise result
    return result


def ingest_winds(
    lake: Lake,
    path: Path,
    readings: Sequence[tuple[WindIngest, Labels]],
    *,
    branch: str = "main",
    confirm: Confirm = UNASKED,
) -> tuple[IngestResult | NothingMeasuredError, ...]:
    """Ingest the anemometers of one log, in one transaction: all that can be used, or none where
    one cannot be read.

    Args:
        readings: the options that read one of them, and its labels.
        confirm: asks once whether the drafted ones among them are right; without it drafts are
            refused.

    Returns:
        for each what became of it, or why none of its values can be used.

    Raises:
        FlagdataError, UnconfirmedError, ConflictError: as `ingest_wind`, of any of them; the lake
            is unchanged.
    """
    source = Source.of(path)
    read = [
        _read(lake, path, source, options, labels, branch=branch) for options, labels in readings
    ]
    new = [reading_of_log for reading_of_log in read if isinstance(reading_of_log, _Read)]
    if not new:
        return tuple(
            reading_of_log for reading_of_log in read if not isinstance(reading_of_log, _Read)
        )
    unseen = [
        (reading_of_log.log, reading_of_log.options.wind)
        for reading_of_log in new
        if reading_of_log.present.artifact is None
    ]
    how = confirm_readings(path, source.hash, unseen, confirm) if unseen else None
    with lake.transaction(f"ingest wind {source.name}", branch=branch) as transaction:
        staged = [
            _stage_log(transaction, path, source, reading_of_log, how) for reading_of_log in new
        ]
        for artifact, _ in staged:
            transaction.add(artifact)
    done = (
        result_of(transaction, artifact, report, reading_of_log.labels)
        for reading_of_log, (artifact, report) in zip(new, staged, strict=True)
    )
    return tuple(
        next(done) if isinstance(reading_of_log, _Read) else reading_of_log
        for reading_of_log in read
    )


@dataclass(frozen=True, kw_only=True)
class _Read:
    """A log that was read, and is to be written.

    Attributes:
        present: what the lake has of it: nothing, or an artifact whose object is damaged or
            missing.
        log: what was read.
        options, labels: of it.
        recipe: of its artifact.
        findings: of the log, of its clocks and of other logs beside it.
        paired: the logging computer's clock against the instrument's; `None` where the log has one
            alone.
    """

    log: WindLog
    options: WindIngest
    labels: Labels
    recipe: Mapping[str, Any]
    findings: tuple[Finding, ...]
    paired: PairedClocks | None
    present: Present


def _read(
    lake: Lake, path: Path, source: Source, options: WindIngest, labels: Labels, *, branch: str
) -> _Read | IngestResult | NothingMeasuredError:
    """Reads a log as it is to be written; or returns what is in the lake already, or why none of
    its values can be used."""
    try:
        log = read_log(path, options.wind)
    except NothingMeasuredError as error:
        return error
    recipe = {**options.recipe(), "plan": dict(log.plan)}
    if _is_of_another_session(lake, source, recipe, labels, branch=branch):
        recipe["session"] = labels.session
    present = find(lake, Kind.WIND, source, recipe, labels, branch=branch)
    if present.whole is not None:
        return kept(present.whole)
    paired = host_clock(log.series)
    findings = (*log.findings, *(paired.findings if paired is not None else ()))
    artifacts = _present(lake, Kind.WIND, branch)
    same = (
        None
        if log.drafted or present.artifact is not None
        else earlier(lake, artifacts, source.hash, recipe, log.series)
    )
    if same is not None:
        check_labels(same, labels)
        return kept(same)
    findings = (*findings, *_shifted_logs(lake, log.series, labels.session, artifacts))
    findings = (*findings, *other_readings(artifacts, source.hash, recipe))
    return _Read(
        log=log,
        options=options,
        labels=labels,
        recipe=recipe,
        findings=findings,
        paired=paired,
        present=present,
    )


def _is_of_another_session(
    lake: Lake, source: Source, recipe: Mapping[str, Any], labels: Labels, *, branch: str
) -> bool:
    """Checks whether the branch has this log for a session, and it is ingested for another one: the
    same constant wind, or counts of seconds from 0, may have been logged beside another film. It is
    another artifact, whose recipe names its session."""
    rows = lake.rows(at=branch).filter(of_source(Kind.WIND, source, recipe)).to_pylist()
    return (
        bool(rows)
        and None not in (labels.session, rows[0]["session"])
        and rows[0]["session"] != labels.session
    )


def _present(lake: Lake, kind: Kind, branch: str) -> list[Artifact]:
    """Lists all artifacts of a kind that are on a branch."""
    rows = lake.rows(at=branch).filter(pc.field("kind") == kind.value).to_pylist()
    return [Artifact.from_row(row) for row in rows]


def _stage_log(
    transaction: Transaction, path: Path, source: Source, reading_of_log: _Read, how: str | None
) -> tuple[Artifact, dict[str, Any]]:
    """Writes the record of a log for a transaction, and returns the artifact and its report.

    Args:
        how: the drafted readings of its file were confirmed; `None` where there are none.

    Raises:
        ConflictError: the file changed while it was read.
    """
    log, findings, recipe = reading_of_log.log, reading_of_log.findings, reading_of_log.recipe
    time = log.series.time
    staged = transaction.staging(".mcap")
    with RecordWriter(
        staged, metadata={PROVENANCE: source.provenance(recipe, code=reading_of_log.present.code)}
    ) as record:
        record.wind(log.series)
        if is_bag(path):
            findings = (*findings, _left_whole(path))
        elif path.stat().st_size <= ATTACHMENT_LIMIT:
            record.attach_file(source.name, path, media_type="text/plain", log_time=int(time[0]))
        else:
            findings = (*findings, _not_attached(path))
        if reading_of_log.options.wind.recipe is not None:
            recipe_file = SENSORS.find(reading_of_log.options.wind.recipe)
            name = f"{recipe_file.name}.recipe.toml"
            record.attach(
                name, recipe_file.data, media_type="application/toml", log_time=int(time[0])
            )
        elif log.drafted:
            drafted = log.drafted.encode()
            record.attach(
                "drafted.recipe.toml", drafted, media_type="application/toml", log_time=int(time[0])
            )
    source.check_unchanged()
    report = wind_report(log, findings, recipe_file=reading_of_log.options.wind.recipe)
    before = (
        {}
        if reading_of_log.present.artifact is None
        else json.loads(reading_of_log.present.artifact.report or "{}")
    )
    if (confirmed_by := before.get("confirmed", how)) is not None:
        report["confirmed"] = confirmed_by
    if reading_of_log.paired is not None:
        report["host_clock"] = json.loads(reading_of_log.paired.model.to_json())
    artifact = _artifact(
        Kind.WIND,
        source,
        recipe,
        reading_of_log.labels,
        findings=findings,
        report=report,
        start=int(time[0]),
        end=int(time[-1]),
        rate=report["rate"],
        frame_count=None,
        stored=transaction.put(staged),
    )
    return artifact, report


def _shifted_logs(
    lake: Lake, series: WindSeries, session: str | None, artifacts: Sequence[Artifact]
) -> tuple[Finding, ...]:
    """Reports other logs, of the same session or of none, whose wind this one is, hours apart."""
    start, end = int(series.time[0]), int(series.time[-1])
    closest = [
        artifact
        for artifact in artifacts
        if artifact.session == session
        and artifact.start is not None
        and artifact.end is not None
        and min(end, artifact.end) - max(start, artifact.start) > 0
    ]
    closest.sort(key=lambda artifact: max(start, artifact.start or 0) - min(end, artifact.end or 0))
    findings: list[Finding] = []
    for artifact in closest[:NEIGHBOURS]:
        try:
            neighbour = Record.open(lake.record_place(str(artifact.object))).wind()
        except FlagdataError:
            continue  # damage of another artifact is found by verify; it does not keep this log out
        finding = (
            hours_off(series, neighbour, name=artifact.name) if neighbour is not None else None
        )
        if finding is not None:
            findings.append(finding)
    return tuple(findings)


def _artifact(
    kind: Kind,
    source: Source,
    recipe: Mapping[str, Any],
    labels: Labels,
    *,
    findings: Sequence[Finding],
    report: Mapping[str, Any],
    start: int,
    end: int,
    rate: float | None,
    frame_count: int | None,
    stored: str,
) -> Artifact:
    return Artifact(
        kind=kind,
        name=labels.name or source.stem,
        object=stored,
        source_hash=source.hash,
        source_name=source.name,
        recipe=recipe,
        session=labels.session,
        day=iso(start)[:10],
        start=start,
        end=end,
        frame_count=frame_count,
        rate=rate,
        quality=quality_flags(tuple(findings)),
        report=json.dumps(report, allow_nan=False, ensure_ascii=False),
    )


def _left_whole(path: Path) -> Finding:
    return Finding(
        kind="log-not-attached",
        severity=Severity.NOTE,
        what=f"{path.name} was not attached: an MCAP file holds other topics as well",
        fix="keep the original: the catalog has its hash",
    )


def _not_attached(path: Path) -> Finding:
    return Finding(
        kind="log-not-attached",
        severity=Severity.WARNING,
        what=f"the log of {path.stat().st_size} bytes is over the limit of {ATTACHMENT_LIMIT} and "
        "was not attached",
        fix="keep the original: the catalog has its hash",
    )
