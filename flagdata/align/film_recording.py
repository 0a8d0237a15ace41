"""A camera and an anemometer made one recording: one record on the wind's clock, its clips, one
commit.

Frames are copied as the JPEG bytes they are; those of an H.264 archive are decoded and become
JPEGs. The instant of a frame in the record is its instant on the camera's clock taken to the wind's
by the clock model, which goes into the record's metadata and into the catalog with its σ.
"""

from __future__ import annotations

import json
import math
import mimetypes
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from flagdata.align.apart import by_offset
from flagdata.align.film_motion import MotionSeries, motion_energy
from flagdata.align.present import find_made, provenance
from flagdata.core.arrays import IntArray, UInt8Array
from flagdata.core.clock_model import ClockModel
from flagdata.core.findings import Finding, quality_flags
from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical
from flagdata.core.schema import TRUTH_WINDOW, Kind
from flagdata.dataset.clips import clip_rows
from flagdata.errors import InputError, UsageError
from flagdata.lake import Artifact, Lake, Transaction
from flagdata.lake.remaking import Present, Remade
from flagdata.record import Record, RecordWriter
from flagdata.record.metadata import CAMERA, CLOCK, PROVENANCE
from flagdata.record.parent import open_parent
from flagdata.record.signals import WindSeries
from flagdata.timebase import NANOSECONDS, iso

Progress = Callable[[int], object]
REPORT_SCHEMA = "flagdata.align-report/1"
CURVE = "alignment.json"
MARGIN_BEFORE = (
    600.0  # s of wind kept before the first frame, or the ground truth's window: it looks back
)
MARGIN_AFTER = 60.0  # s
LONGEST_WINDOW = 86_400.0  # s, of the ground truth
_FRAMES_AT_ONCE = 64


@dataclass(frozen=True, kw_only=True)
class Alignment:
    """A clock model and how it came about.

    Attributes:
        clock: of the camera on the wind's clock.
        recipe: the options that led to it; with the parents, the recording's identity.
        findings: what the catalog should know of it.
        details: numbers for the report (offset, interval, confidence, …), JSON.
        curve: the search that led to it, a JSON document attached to the record; `None` where
            nothing was searched.
        parameters: known properties of the cloth, by the names that simulated recordings have, SI;
            the recipe has it too.
    """

    clock: ClockModel
    recipe: Mapping[str, Any]
    findings: tuple[Finding, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    curve: bytes | None = None
    parameters: Mapping[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Pair:
    """A camera and a wind artifact of one lake, with their records opened.

    Raises:
        UsageError: artifacts of other kinds.
        CorruptError: a record that is not what was written, now or when its damaged part is read.
    """

    camera: Artifact
    wind: Artifact
    camera_record: Record
    wind_record: Record

    @classmethod
    def of(cls, lake: Lake, camera: str, wind: str, *, at: str | None = None) -> Pair:
        """Look both up, see `Lake.artifact`."""
        artifacts = []
        for identity, kind in ((camera, Kind.CAMERA), (wind, Kind.WIND)):
            artifact = lake.artifact(identity, at=at, kinds=(kind,))
            if artifact.kind is not kind or artifact.object is None:
                raise UsageError(
                    f"{artifact.name!r} is a {artifact.kind}, not a {kind}",
                    where=artifact.id,
                    fix="flagdata align CAMERA WIND takes a camera artifact, then a wind artifact; "
                    "see flagdata ls",
                )
            artifacts.append(artifact)
        return cls.opened(lake, *artifacts)

    @classmethod
    def opened(cls, lake: Lake, camera: Artifact, wind: Artifact) -> Pair:
        """Opens a camera and a wind whose objects are in the lake, whether or not they are
        committed."""
        records = [open_parent(lake, str(artifact.object)) for artifact in (camera, wind)]
        return cls(camera=camera, wind=wind, camera_record=records[0], wind_record=records[1])

    @property
    def parents(self) -> dict[str, Artifact]:
        """Both artifacts by what they are, in the order of a recording's parents."""
        return {"camera": self.camera, "wind": self.wind}

    @property
    def span(self) -> tuple[int, int]:
        """First frame's instant and one past the last's, on the camera's clock [UTC ns]."""
        times = self.camera_record.device_frame_times
        return int(times[0]), int(times[-1]) + 1

    def series(self) -> WindSeries:
        """Reads all samples of the anemometer, on its own clock.

        Raises:
            InputError: the record has none.
        """
        series = self.wind_record.wind()
        if series is None or not len(series):
            raise InputError(
                "the wind artifact holds no samples", where=self.wind.id, fix="ingest the log anew"
            )
        return series

    def motion(self, *, progress: Progress | None = None) -> MotionSeries:
        """Computes the motion energy of the film on the camera's clock.

        Args:
            progress: called with the number of frames read, now and then.
        """
        return motion_energy(self._frames(progress))

    def _frames(self, progress: Progress | None) -> Iterator[tuple[int, UInt8Array]]:
        record = self.camera_record
        times = record.device_frame_times
        for first in range(0, len(times), _FRAMES_AT_ONCE):
            count = min(_FRAMES_AT_ONCE, len(times) - first)
            yield from zip(
                times[first : first + count].tolist(), record.frames(first, count), strict=True
            )
            if progress:
                progress(count)


@dataclass(frozen=True, kw_only=True)
class RecordingResult:
    """What making a recording did.

    Attributes:
        recording: as it is in the lake.
        clips: identities of its clips.
        created: false when it was there already, and its row stayed.
        healed: what was done where its object was damaged or missing.
    """

    recording: Artifact
    clips: tuple[str, ...]
    created: bool
    healed: Remade | None = None
    JSON_NAMES: ClassVar = ("recording=recording.id", "clips", "created", "healed")

    @property
    def line(self) -> str:
        """What was made, for people."""
        done = f"recording {self.recording.id}, {len(self.clips)} clips"
        return done if self.healed is None else f"{done}; {self.healed.sentence}"


def truth_recipe(window: float) -> dict[str, Any]:
    """Returns what the window of the ground truth [s] adds to a recording's recipe: nothing where
    it is the usual one.

    Raises:
        UsageError: no length of time, or one beyond a day.
    """
    if not (math.isfinite(window) and 0 < window <= LONGEST_WINDOW):
        raise UsageError(
            f"the ground truth cannot be averaged over {window:g} s",
            where="--window",
            fix=f"give a length of time above zero, {LONGEST_WINDOW:g} s at most",
        )
    return {} if window == TRUTH_WINDOW else {"truth": {"window": window}}


def truth_window(recipe: Mapping[str, Any]) -> float:
    """Returns the window of the ground truth [s] of a recording's clips, by its recipe."""
    return float(recipe.get("truth", {}).get("window", TRUTH_WINDOW))


def data_set_of(camera: Artifact) -> dict[str, Any]:
    """Returns what a recording has of the data set that its film came in with: its side, and the
    simulation's seed."""
    return {"dataset": camera.dataset, "side": camera.side, "seed": camera.seed}


def session_of(pair: Pair, *, session_given: str | None) -> str | None:
    """Returns the session of a recording: the one given, else the one its parents agree on; `None`
    where neither has one.

    Raises:
        UsageError: the parents name different ones.
    """
    if session_given is not None:
        return session_given
    sessions = {artifact.session for artifact in (pair.camera, pair.wind) if artifact.session}
    if len(sessions) > 1:
        raise UsageError(
            f"camera and wind are of the sessions {pair.camera.session!r} and "
            f"{pair.wind.session!r}",
            where=pair.camera.id,
            fix="say by --session which one the recording is of",
        )
    return sessions.pop() if sessions else None


def find_recording(
    lake: Lake,
    pair: Pair,
    recipe: Mapping[str, Any],
    *,
    name: str | None,
    session: str | None,
    branch: str,
) -> RecordingResult | None:
    """Finds the recording that these parents and options make, if it is on the branch and its
    object is sound.

    Raises:
        ConflictError: it is, under another name or session than the one asked for.
    """
    artifact = _present(lake, pair, recipe, name=name, session=session, branch=branch).whole
    if artifact is None:
        return None
    return RecordingResult(
        recording=artifact, clips=_clips_of(lake, artifact, branch), created=False
    )


def _present(
    lake: Lake,
    pair: Pair,
    recipe: Mapping[str, Any],
    *,
    name: str | None,
    session: str | None,
    branch: str,
) -> Present:
    return find_made(
        lake,
        Kind.RECORDING,
        pair.parents,
        recipe,
        noun="recording",
        name=name,
        session=session,
        branch=branch,
    )


def make_recording(
    lake: Lake,
    pair: Pair,
    alignment: Alignment,
    *,
    name: str | None = None,
    session: str | None = None,
    branch: str = "main",
    progress: Progress | None = None,
) -> RecordingResult:
    """Write the recording and its clips, and publish them in one commit.

    Args:
        name: what people call it; the camera's name if `None`.
        session: one set-up at one place; the parents' if `None`.
        progress: called with 1 for each frame copied.

    Raises:
        UsageError: the parents are of different sessions and `session` is `None`.
        ConflictError: it is there already under another name or session.
        InputError: the clock model folds frames back over a jump, or the wind log has no sample
            near the film.
    """
    present = find_recording(
        lake, pair, alignment.recipe, name=name, session=session, branch=branch
    )
    if present is not None:
        return present
    with lake.transaction(
        f"align {pair.camera.name} with {pair.wind.name}", branch=branch
    ) as transaction:
        recording = add_recording(
            lake,
            transaction,
            pair,
            alignment,
            name=name,
            session=session_of(pair, session_given=session),
            code=_present(
                lake, pair, alignment.recipe, name=name, session=session, branch=branch
            ).code,
            progress=progress,
        )
    return recording_result(transaction, recording)


def add_recording(
    lake: Lake,
    transaction: Transaction,
    pair: Pair,
    alignment: Alignment,
    *,
    name: str | None,
    session: str | None,
    code: str,
    progress: Progress | None,
) -> Artifact:
    """Write the recording and its clips for a transaction; see `make_recording`.

    Args:
        code: version of the code that made it, for its record.
    """
    clock = alignment.clock
    frames = clock.to_common(pair.camera_record.device_frame_times)
    window = truth_window(alignment.recipe)
    before = max(MARGIN_BEFORE, window)
    wind = _around_film(
        pair.series(), int(frames[0]), int(frames[-1]), before=before, where=pair.wind.id
    )
    staged = transaction.staging(".mcap")
    _write(staged, pair, alignment, wind, first=int(frames[0]), code=code, progress=progress)
    recording = _artifact(
        pair, alignment, frames, stored=transaction.put(staged), name=name, session=session
    )
    transaction.add(recording)
    for clip in clip_rows(
        Record.open(lake.record_place(str(recording.object))), recording, window=window
    ):
        transaction.add(clip)
    return recording


def recording_result(transaction: Transaction, recording: Artifact) -> RecordingResult:
    """Returns what a transaction did that has ended and made `recording` and its clips."""
    result = transaction.result
    return RecordingResult(
        recording=result.artifacts[recording.id],
        created=recording.id in result.added,
        healed=result.healed.get(recording.id),
        clips=tuple(
            artifact.id
            for artifact in result.artifacts.values()
            if artifact.recording == recording.id
        ),
    )


def _around_film(
    series: WindSeries, start: int, end: int, *, before: float, where: str
) -> WindSeries:
    """Selects the samples from `before` [s] before the film to `MARGIN_AFTER` after it."""
    low, high = start - round(before * NANOSECONDS), end + round(MARGIN_AFTER * NANOSECONDS)
    is_near = (series.time >= low) & (series.time <= high)
    if not np.any(is_near):
        raise InputError(
            f"no wind sample from {iso(low)} to {iso(high)}, when the film was taken by this clock "
            "model:"
            f" the log runs from {iso(int(series.time[0]))} to {iso(int(series.time[-1]))}",
            where=where,
            fix="check the start times and zones of both, or the offset",
        )
    return WindSeries(
        time=series.time[is_near],
        channels={channel: values[is_near] for channel, values in series.channels.items()},
        flags=series.flags[is_near],
        sensor=series.sensor,
        host_time=None if series.host_time is None else series.host_time[is_near],
    )


def _write(
    path: Path,
    pair: Pair,
    alignment: Alignment,
    wind: WindSeries,
    *,
    first: int,
    code: str,
    progress: Progress | None,
) -> None:
    source, clock = pair.camera_record, alignment.clock
    metadata: dict[str, Mapping[str, str]] = {
        PROVENANCE: provenance(pair.parents, alignment.recipe, code=code),
        f"{CLOCK}/{clock.device}": {"model": clock.to_json()},
    }
    if CAMERA in source.metadata:
        metadata[CAMERA] = source.metadata[CAMERA]
    with RecordWriter(path, metadata=metadata) as record:
        copy_frames(record, source, clock, progress=progress)
        record.wind(wind)
        if alignment.curve is not None:
            record.attach(CURVE, alignment.curve, media_type="application/json", log_time=first)
        for name in pair.wind_record.attachments:
            media_type = mimetypes.guess_type(name)[0] or "application/octet-stream"
            record.attach(
                name,
                pair.wind_record.attachment(name),
                media_type=media_type,
                log_time=int(wind.time[0]),
            )


def copy_frames(
    record: RecordWriter,
    source: Record,
    clock: ClockModel | None,
    *,
    progress: Progress | None = None,
) -> None:
    """Copy all frames of a camera's record as JPEGs, their instants taken to the common clock.

    Args:
        clock: of the camera on the common clock; `None` where its own is all there is.
        progress: called with 1 for each frame copied.
    """
    device = source.device_frame_times
    common = device if clock is None else clock.to_common(device)
    for first in range(0, len(device), _FRAMES_AT_ONCE):
        count = min(_FRAMES_AT_ONCE, len(device) - first)
        stamps = source.timestamps(first, count)
        exposed = stamps if clock is None else clock.to_common(stamps)
        images = source.jpegs(first, count)
        for index in range(first, first + count):
            record.frame(
                log_time=int(common[index]),
                publish_time=int(device[index]),
                timestamp=int(exposed[index - first]),
                image=images[index - first],
            )
            if progress:
                progress(1)


def _artifact(
    pair: Pair,
    alignment: Alignment,
    frames: IntArray,
    *,
    stored: str,
    name: str | None,
    session: str | None,
) -> Artifact:
    clock = alignment.clock
    device = pair.camera_record.device_frame_times
    middle = int(device[0] + (device[-1] - device[0]) // 2)
    start, end = int(frames[0]), int(frames[-1])
    hours_warning = by_offset(
        float(clock.to_common(middle) - middle) / NANOSECONDS,
        names=(pair.camera.name, pair.wind.name),
    )
    findings = (*alignment.findings, *((hours_warning,) if hours_warning is not None else ()))
    new_flags = quality_flags(findings)
    report = {
        "schema": REPORT_SCHEMA,
        "kind": Kind.RECORDING.value,
        "frames": len(frames),
        "start": iso(start),
        "end": iso(end),
        **alignment.details,
        "findings": json_values(findings),
    }
    return Artifact(
        kind=Kind.RECORDING,
        name=name or pair.camera.name,
        object=stored,
        parents=(pair.camera.id, pair.wind.id),
        recipe=alignment.recipe,
        session=session,
        **data_set_of(pair.camera),
        day=iso(start)[:10],
        start=start,
        end=end,
        frame_count=len(frames),
        rate=(len(frames) - 1) * NANOSECONDS / (end - start) if len(frames) > 1 else None,
        clock_method=clock.method,
        clock_offset=float(clock.to_common(middle) - middle) / NANOSECONDS,
        clock_drift=clock.segments[0].drift,
        clock_sigma=float(clock.sigma(middle)),
        clock_model=clock.to_json(),
        parameters=canonical(dict(alignment.parameters)) if alignment.parameters else None,
        quality=sorted({*pair.camera.quality, *pair.wind.quality, *new_flags}),
        report=json.dumps(report, allow_nan=False, ensure_ascii=False),
    )


def _clips_of(lake: Lake, recording: Artifact, branch: str) -> tuple[str, ...]:
    rows = lake.rows(
        {"kind": Kind.CLIP, "recording": recording.id}, at=branch, columns=["artifact"]
    )
    return tuple(rows["artifact"].to_pylist())


def parents_of(
    lake: Lake, recording: str, *, at: str | None = None
) -> tuple[Artifact, Sequence[str]]:
    """Finds a recording by id or name, and its camera's and wind's ids.

    Raises:
        UsageError: it is no recording of a camera and an anemometer.
    """
    artifact = lake.artifact(recording, at=at, kinds=(Kind.RECORDING,))
    if artifact.kind is not Kind.RECORDING or len(artifact.parents) < 2:
        raise UsageError(
            f"{artifact.name!r} is a {artifact.kind} with {len(artifact.parents)} parents, not an "
            "aligned recording",
            where=artifact.id,
            fix="name a recording that flagdata align made; see flagdata ls --kind recording",
        )
    return artifact, artifact.parents[:2]
