"""Video files through PyAV: a survey of the packets, then decoding that survives damage and says what it skipped."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import cast

import av
import av.error
import av.stream
import numpy as np
from av.container import InputContainer
from av.sidedata.sidedata import SideData, Type
from av.video.stream import VideoStream

from flagdata.errors import InputError, LimitError, NotFoundError, TimeError, UsageError
from flagdata.findings import Finding, Severity
from flagdata.ingest.camera.geometry import Orientation
from flagdata.ingest.camera.luma import luma_of_frame
from flagdata.ingest.camera.options import CameraOptions, Limits, exact
from flagdata.ingest.camera.source import Picture, SourceFacts
from flagdata.ingest.camera.stamps import Timing, survey

# Containers of one file's own frames. Playlists and scripts that name other files or addresses (HLS, DASH, concat, SDP)
# are not among them.
_FORMATS = (
    "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,mpegts,avi,mpeg,mpegvideo,h264,hevc,m4v,mjpeg,mxf,flv,asf,ogg,gif,apng,dv,ivf,"
    "yuv4mpegpipe,nut,wtv"
)
_UNTIMED = frozenset({"h264", "hevc", "mjpeg", "m4v", "mpegvideo"})
_BY_DECODE_ORDER = frozenset({"avi"})
_DECODE_ERRORS = (av.error.FFmpegError, ValueError, OSError)


class VideoSource:
    """One video file. See `Source`.

    Raises:
        NotFoundError: no such file.
        InputError: not a video, or not one frame of it can be decoded.
        LimitError: larger than `options.limits`, found before decoding.
        TimeError: a raw stream without time stamps and no `sequence_fps`.
    """

    def __init__(self, path: Path, options: CameraOptions) -> None:
        self._path = path
        self._options = options
        self._bad_packets = 0
        self._first_bad: int | None = None
        self._corrupt_frames = 0
        self._suspect_frames = 0
        self._resized = 0
        if not path.is_file():
            raise NotFoundError("there is no such file", where=str(path), fix="check the path")
        if path.stat().st_size == 0:
            raise InputError("the file is empty", where=str(path), fix="copy it from the camera again")
        timing, surveyed = _survey(path, options)
        self._timing = timing
        self._container, self._stream = _open(path, options.limits, threads=options.threads)
        try:
            self._decoded = self._decode()
            first = next(self._decoded, None)
            if first is None:
                raise InputError(
                    f"not one frame could be decoded of {timing.count + timing.missing} packets",
                    where=str(path), fix="the file is damaged beyond reading; copy it from the camera again",
                )  # fmt: skip
            self._first = first
            self.facts = self._describe(first[1], [*surveyed, *self._stream_findings(first[1])])
        except BaseException:
            self._container.close()
            raise

    def _describe(self, first: av.VideoFrame, findings: list[Finding]) -> SourceFacts:
        context = self._stream.codec_context
        metadata = {k.lower(): v for k, v in {**self._container.metadata, **self._stream.metadata}.items()}
        return SourceFacts(
            container=self._container.format.name,
            codec=context.name,
            pixel_format=first.format.name,
            width=first.width,
            height=first.height,
            aspect=_pixel_aspect(self._stream),
            orientation=_orientation(first),
            interlaced=bool(first.interlaced_frame),
            timing=self._timing,
            metadata=metadata,
            recorded=None,
            sequence=self._container.format.name in _UNTIMED,
            findings=tuple(findings),
        )

    def _stream_findings(self, first: av.VideoFrame) -> list[Finding]:
        found = []
        if first.interlaced_frame:
            found.append(
                Finding(
                    kind="interlaced", severity=Severity.WARNING,
                    what="the video is interlaced: each frame mixes two instants, half a frame period apart; it was "
                    "not deinterlaced",
                )
            )  # fmt: skip
        if _orientation(first).mirrored:
            found.append(Finding(kind="mirrored", severity=Severity.NOTE, what="the file asks to be shown mirrored"))
        if not _orientation(first).exact:
            found.append(
                Finding(
                    kind="odd-rotation", severity=Severity.WARNING,
                    what="the file asks for a rotation that is not a multiple of 90°; the nearest one was taken",
                )
            )  # fmt: skip
        if int(first.color_trc) in (16, 18):
            found.append(
                Finding(
                    kind="hdr-transfer", severity=Severity.WARNING,
                    what="the video is HDR (PQ or HLG): its grays are not those of an ordinary camera",
                )
            )  # fmt: skip
        if any(c.is_alpha for c in first.format.components):
            found.append(Finding(kind="alpha-ignored", severity=Severity.WARNING, what="transparency was left aside"))
        others = len(self._container.streams.video) - 1
        if others:
            found.append(
                Finding(
                    kind="more-video-streams", severity=Severity.NOTE,
                    what=f"stream {self._stream.index} was taken, {others} other video streams were not", count=others,
                )
            )  # fmt: skip
        return found

    def pictures(self) -> Iterator[Picture]:
        codec = self._stream.codec_context.name
        stamp, frame = self._first
        yield Picture(stamp=stamp, luma=partial(luma_of_frame, frame, codec=codec))
        for stamp, frame in self._decoded:
            if (frame.width, frame.height) != (self.facts.width, self.facts.height):
                self._resized += 1
                continue
            yield Picture(stamp=stamp, luma=partial(luma_of_frame, frame, codec=codec))

    def samples(self, runs: int, length: int) -> Iterator[list[Picture]]:
        container, stream = _open(self._path, self._options.limits, threads=self._options.threads)
        with container:
            codec = stream.codec_context.name
            seen: set[int | None] = set()
            for run in range(runs):
                target = self._timing.origin + self._timing.span * run // runs
                run_pictures: list[Picture] = []
                try:
                    container.seek(target, stream=stream)
                    for frame in container.decode(stream):
                        if (frame.width, frame.height) == (self.facts.width, self.facts.height):
                            luma = partial(luma_of_frame, frame, codec=codec)
                            run_pictures.append(Picture(stamp=frame.pts, luma=luma))
                        if len(run_pictures) == length:
                            break
                except _DECODE_ERRORS:
                    # A spot that cannot be decoded is no loss to a sample; what came before it counts.
                    pass
                if run_pictures and run_pictures[0].stamp not in seen:
                    seen.add(run_pictures[0].stamp)
                    yield run_pictures

    def _decode(self) -> Iterator[tuple[int | None, av.VideoFrame]]:
        """(stamp, frame) in order of presentation."""
        ordered = _DecodeOrderStamps(self._timing) if self._container.format.name in _BY_DECODE_ORDER else None
        damaged = False
        count = 0
        for packet in _packets(self._container, self._stream):
            count += 1
            stamp = packet.pts if packet.pts is not None else packet.dts
            if packet.is_corrupt:
                self._bad(count)
                damaged = True
                continue
            try:
                if ordered is not None:
                    ordered.sent(stamp)
                frames = packet.decode()
            except _DECODE_ERRORS:
                self._bad(count)
                damaged = True
                continue
            for frame in frames:
                if not isinstance(frame, av.VideoFrame):
                    continue
                own = frame.pts if frame.pts is not None else frame.dts
                shown = ordered.shown(own) if ordered is not None else own
                damaged = damaged and not frame.key_frame
                if frame.is_corrupt:
                    self._corrupt_frames += 1
                    continue
                self._suspect_frames += damaged
                yield shown, frame

    def _bad(self, count: int) -> None:
        self._bad_packets += 1
        if self._first_bad is None:
            self._first_bad = count

    def damage(self) -> list[Finding]:
        found = []
        if self._bad_packets:
            found.append(
                Finding(
                    kind="corrupt-packets", severity=Severity.ERROR,
                    what=f"{self._bad_packets} packets could not be decoded and were skipped",
                    where=f"packet {self._first_bad}", count=self._bad_packets,
                )
            )  # fmt: skip
        if self._corrupt_frames:
            found.append(
                Finding(
                    kind="corrupt-frames", severity=Severity.ERROR,
                    what=f"{self._corrupt_frames} frames came out damaged and were left out",
                    count=self._corrupt_frames,
                )
            )  # fmt: skip
        if self._suspect_frames:
            found.append(
                Finding(
                    kind="damaged-references", severity=Severity.WARNING,
                    what=f"{self._suspect_frames} frames between damage and the next key frame may show traces of it",
                    count=self._suspect_frames,
                )
            )  # fmt: skip
        if self._resized:
            found.append(
                Finding(
                    kind="size-changed", severity=Severity.ERROR,
                    what=f"{self._resized} frames have another size than the first and were left out",
                    count=self._resized,
                )
            )  # fmt: skip
        return found

    def close(self) -> None:
        self._container.close()


class _DecodeOrderStamps:
    """Stamps for containers that number frames in decoding order: presentation takes them in increasing order."""

    def __init__(self, timing: Timing) -> None:
        self._reach = 17 * timing.period
        self._waiting: list[int] = []

    def sent(self, stamp: int | None) -> None:
        if stamp is not None:
            heapq.heappush(self._waiting, stamp)

    def shown(self, own: int | None) -> int | None:
        """The stamp of the frame shown next, whose packet carried `own`; those of frames that never came go."""
        while self._waiting and own is not None and self._waiting[0] < own - self._reach:
            heapq.heappop(self._waiting)
        return heapq.heappop(self._waiting) if self._waiting else own


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    try:
        yield
    except (av.error.FFmpegError, ValueError, OSError, MemoryError) as error:
        if isinstance(error, av.error.FileNotFoundError):
            raise NotFoundError("there is no such file", where=str(path), fix="check the path") from error
        raise InputError(
            f"the file cannot be opened as a video ({error.__class__.__name__}: {_reason(error)})",
            where=str(path),
            fix=_advice(path),
        ) from error


def _reason(error: BaseException) -> str:
    return str(getattr(error, "strerror", None) or error)


def _advice(path: Path) -> str:
    """What to do about a file that will not open; an unfinished MP4 is the common case."""
    with path.open("rb") as stream:
        head = stream.read(12)
    if head[4:8] in (b"ftyp", b"mdat", b"wide", b"free"):
        return (
            "an MP4 or MOV whose index (moov) is missing was cut off or not closed by the camera: repair it with a "
            "recovery tool and an intact file of the same camera"
        )
    return "give a video that a player opens: MP4, MOV, MTS, AVI or MKV, or a folder of PNG or JPEG images"


def _open(path: Path, limits: Limits, *, threads: int) -> tuple[InputContainer, VideoStream]:
    """The container and its first real video stream, ready to decode; nothing is decoded yet.

    Raises:
        InputError, LimitError, NotFoundError: see `VideoSource`.
    """
    with _reading(path):
        container = av.open(
            f"file:{path.resolve()}",
            options={
                "protocol_whitelist": "file",
                "format_whitelist": _FORMATS,
                "max_pixels": str(limits.frame_pixels),
            },
            metadata_errors="replace",
        )
    try:
        stream = _choose(container, path)
        context = stream.codec_context
        if context.width * context.height > limits.frame_pixels:
            raise LimitError(
                f"frames of {context.width} × {context.height} px are beyond the limit of {limits.frame_pixels} px",
                where=str(path), fix="raise the limit if the file is to be trusted",
            )  # fmt: skip
        context.options = {"max_pixels": str(limits.frame_pixels)}
        context.thread_count = threads
        context.thread_type = "FRAME" if threads > 1 else "SLICE"
    except BaseException:
        container.close()
        raise
    return container, stream


def _choose(container: InputContainer, path: Path) -> VideoStream:
    """The first video stream that is not a cover picture."""
    for stream in container.streams.video:
        if not stream.disposition & av.stream.Disposition.attached_pic:
            return stream
    kinds = sorted({stream.type for stream in container.streams}) or ["nothing"]
    raise InputError(f"the file holds {', '.join(kinds)} but no video", where=str(path), fix="give the video file")


def _packets(container: InputContainer, stream: VideoStream) -> Iterator[av.Packet]:
    """Packets of the stream, the flushing one last; damage of the container ends them."""
    try:
        yield from container.demux(stream)
    except _DECODE_ERRORS:
        flush = av.Packet()
        flush.stream = stream
        yield flush


def _survey(path: Path, options: CameraOptions) -> tuple[Timing, list[Finding]]:
    """The timing of a file by its packets, without decoding; refuses what is beyond the limits."""
    limits = options.limits
    container, stream = _open(path, limits, threads=1)
    with container:
        pixels = max(1, stream.codec_context.width * stream.codec_context.height)
        stamps: list[int] = []
        missing = 0
        for packet in _packets(container, stream):
            if packet.size == 0 and packet.pts is None and packet.dts is None:
                continue
            if packet.is_discard:
                continue
            stamp = packet.pts if packet.pts is not None else packet.dts
            if stamp is None:
                missing += 1
            else:
                stamps.append(stamp)
            count = len(stamps) + missing
            if count > limits.frames or count * pixels > limits.total_pixels:
                raise LimitError(
                    f"more than {count - 1} frames of {pixels} px are beyond the limit of {limits.frames} frames and "
                    f"{limits.total_pixels} px in all",
                    where=str(path), fix="cut the file into parts, or raise the limit",
                )  # fmt: skip
        untimed = container.format.name in _UNTIMED
        tick = stream.time_base or Fraction(1, 1000)
        rate = stream.average_rate or None
        stated_frames = stream.frames
    if untimed:
        if options.sequence_fps is None:
            raise TimeError(
                "a raw stream has no time stamps and states no frame rate",
                where=str(path), fix="give the camera's frame rate (sequence_fps), or wrap the stream in a container",
            )  # fmt: skip
        count = len(stamps) + missing
        tick = 1 / exact(options.sequence_fps)
        timing = survey(np.arange(count, dtype=np.int64), tick=tick, missing=0, fallback_rate=1 / tick)
    else:
        if options.sequence_fps is not None:
            raise UsageError(
                "sequence_fps is for image sequences and raw streams; this file has time stamps of its own",
                where=str(path), fix="drop it, or give true_fps if the container lies about a high-speed camera",
            )  # fmt: skip
        timing = survey(np.array(stamps, dtype=np.int64), tick=tick, missing=missing, fallback_rate=rate)
    found = []
    read = timing.count + timing.missing
    if stated_frames > read:
        found.append(
            Finding(
                kind="truncated", severity=Severity.ERROR,
                what=f"the file states {stated_frames} frames and holds {read}: it is cut off", where=f"frame {read}",
                count=stated_frames - read,
            )
        )  # fmt: skip
    return timing, found


def _pixel_aspect(stream: VideoStream) -> Fraction:
    aspect = stream.sample_aspect_ratio or stream.codec_context.sample_aspect_ratio
    return Fraction(aspect) if aspect and aspect > 0 else Fraction(1)


def _side_data(frame: av.VideoFrame) -> list[SideData]:
    # The container iterates over its items, although it is declared a mapping of them.
    return cast(list[SideData], list(frame.side_data))


def _orientation(frame: av.VideoFrame) -> Orientation:
    for data in _side_data(frame):
        if data.type is Type.DISPLAYMATRIX:
            return Orientation.of_display_matrix(np.frombuffer(memoryview(data), dtype="<i4").tolist())
    return Orientation()
