"""What a camera file says of itself, without choosing a start or reading it through the decoder."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import ClassVar

import av.error

from flagdata.core.files.addresses import local_path
from flagdata.core.findings import Finding
from flagdata.errors import TimeError
from flagdata.ingest.camera.camera_options import CameraOptions
from flagdata.ingest.camera.chapters import chapter_of
from flagdata.ingest.camera.picture_geometry import upright_size
from flagdata.ingest.camera.recording_start import Start, find_start
from flagdata.ingest.camera.stream import open_source
from flagdata.ingest.camera.video_container import check_file, open_container, packets

_LOOKED_THROUGH = 1000
"""Packets among which a picture comes, be the file damaged: more than lie between key frames."""


@dataclass(frozen=True, kw_only=True)
class CameraProbe:
    """A camera file as its headers, packets and first frame describe it.

    Attributes:
        width, height: of the upright image with square pixels [px].
        rotation: degrees clockwise that turn the stored picture upright.
        rate: of the container's stamps [Hz]; true_fps is the user's knowledge.
        shortest, longest: steps between neighbouring stamps [s].
        frames: in the file.
        duration: from the first stamp to the last [s].
        start: from the metadata, else `None`.
    """

    container: str
    codec: str
    pixel_format: str
    width: int
    height: int
    rotation: int
    interlaced: bool
    rate: float
    variable_rate: bool
    shortest: float
    longest: float
    frames: int
    duration: float
    start: Start | None
    findings: tuple[Finding, ...]
    JSON_NAMES: ClassVar = (
        *("container", "codec", "pixel_format", "width", "height", "rotation", "interlaced"),
        *("rate", "variable_rate", "shortest", "longest", "frames", "duration"),
        *("start=start.text", "start_from=start.source", "start_sigma=start.sigma", "findings"),
    )


@dataclass(frozen=True, kw_only=True)
class Pictured:
    """The container and the codec of a file that holds pictures, whether or not it says when they
    were taken."""

    container: str
    codec: str


def first_picture(path: Path) -> Pictured | None:
    """Decode the first picture of a file; `None` where none of its packets gives one.

    Raises:
        NotFoundError, InputError, LimitError: as `open_camera`.
    """
    limits = CameraOptions().limits
    check_file(path, limits)
    container, stream = open_container(path, limits, threads=1)
    with container:
        for packet in islice(packets(container, stream), _LOOKED_THROUGH):
            try:
                frames = packet.decode()
            except av.error.FFmpegError:
                continue
            if frames:
                return Pictured(container=container.format.name, codec=stream.codec_context.name)
    return None


def probe(path: Path | str, options: CameraOptions | None = None) -> CameraProbe:
    """Look at a camera file or image sequence: headers, all packets, one decoded frame.

    Raises:
        NotFoundError, InputError, LimitError, TimeError, UsageError: as `open_camera`, but a
            missing start is no error.
    """
    path = local_path(path)
    options = options or CameraOptions()
    source = open_source(path, options)
    try:
        facts, timing = source.facts, source.facts.timing
        try:
            start = find_start(
                options.start,
                facts.metadata,
                recorded=facts.recorded,
                zone_name=options.zone,
                duration=timing.duration,
                where=str(path),
                chapter=chapter_of(path),
                stamped=facts.stamped,
                gps=facts.gps.start(1.0) if facts.gps is not None else None,
            )
        except TimeError:
            start = None
        width, height = upright_size(facts.width, facts.height, facts.aspect, facts.orientation)
        return CameraProbe(
            container=facts.container,
            codec=facts.codec,
            pixel_format=facts.pixel_format,
            width=width,
            height=height,
            rotation=facts.orientation.clockwise,
            interlaced=facts.interlaced,
            rate=float(timing.rate),
            variable_rate=timing.variable,
            shortest=float(timing.shortest * timing.tick),
            longest=float(timing.longest * timing.tick),
            frames=timing.count + timing.missing,
            duration=timing.duration,
            start=start,
            findings=(*facts.findings, *(start.findings if start else ())),
        )
    finally:
        source.close()
