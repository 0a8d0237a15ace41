"""Opening video files safely: which containers, what their headers get refused, what the packets
say of the timing.

Whether a video file ends before its own header says.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import islice
from os import SEEK_CUR
from pathlib import Path

import av
import av.error
import av.stream
import numpy as np
from av.container import InputContainer
from av.video.stream import VideoStream

from flagdata.core.files.regular_files import check_input
from flagdata.core.findings import Finding, Severity
from flagdata.core.shell import command_line
from flagdata.errors import InputError, LimitError, TimeError, UsageError
from flagdata.ingest.camera.boxes import edit_list_remark, edits, is_cut, is_mp4, whole_part
from flagdata.ingest.camera.camera_options import CameraOptions, Limits, exact
from flagdata.ingest.camera.container_clock import COUNTERS, Counter, restart, restarted_finding
from flagdata.ingest.camera.frame_stamps import Timing, survey

_EBML, _SEGMENT = b"\x1a\x45\xdf\xa3", b"\x18\x53\x80\x67"


def truncation(
    path: Path, container: InputContainer, stream: VideoStream, timing: Timing, *, read: int
) -> list[Finding]:
    """Finds what betrays a file that is cut off: a box or transport packet that is not whole,
    missing frames, missing time.

    A transport stream cut between packets, and a fragmented MP4 cut between fragments, betray
    nothing.

    Args:
        read: packets that could be read, those an edit list hides among them.
    """
    name = container.format.name
    if name.startswith("mov"):
        return _of_mp4(path, stream, read)
    if name.startswith("matroska"):
        return _of_matroska(path, container, timing, read)
    if name == "mpegts":
        return _of_transport_stream(path)
    if stream.frames > read:
        return [
            cut_off(
                f"the file states {stream.frames} frames and holds {read}: it is cut off or "
                "damaged",
                read,
                stream.frames - read,
            )
        ]
    if 0 < stream.frames < read:
        return [
            Finding.of(
                "index-damaged",
                f"the file states {stream.frames} frames and holds {read}: its index is damaged",
                count=read - stream.frames,
            )
        ]
    return []


def cut_off(text: str, read: int, lost: int) -> Finding:
    """Reports that `lost` frames, at least one, are not there after `read` of them."""
    return Finding(
        kind="truncated",
        severity=Severity.ERROR,
        what=text,
        where=f"frame {read}",
        count=lost,
        fix="copy it from the camera again; what was read is kept",
    )


def _of_mp4(path: Path, stream: VideoStream, read: int) -> list[Finding]:
    missing = stream.frames - read
    if is_cut(path):
        counted = f"; {read} of {stream.frames} frames are there" if missing > 0 else ""
        return [
            cut_off(
                f"the file ends inside one of its boxes: it is cut off{counted}",
                read,
                max(1, missing),
            )
        ]
    if missing > 0:
        return [
            Finding.of(
                "frames-not-shown",
                f"the file states {stream.frames} frames; its edit list, or damage of its index, "
                f"leaves {read}",
                count=missing,
            )
        ]
    return []


def _of_matroska(path: Path, container: InputContainer, timing: Timing, read: int) -> list[Finding]:
    """Compares with the stated duration, which is the longest stream's, where the video is alone;
    else with the stated length."""
    if container.duration is not None and len(container.streams) == 1:
        stated_length = Fraction(container.duration, 1_000_000)
        length = (timing.span + timing.period) * timing.tick
        # The last frame's own length is not known where the rate varies.
        step = timing.longest if timing.variable else timing.period
        if stated_length - length > Fraction(3, 4) * step * timing.tick:
            lost = max(1, round((stated_length - length) / (timing.period * timing.tick)))
            return [
                cut_off(
                    f"the file states {float(stated_length):.2f} s and holds {float(length):.2f} s",
                    read,
                    lost,
                )
            ]
    stated_end, end = _segment_end(path), path.stat().st_size
    if stated_end is None or stated_end <= end:
        return []
    return [
        cut_off(
            f"the file states a length of {stated_end} B and has {end} B: it is cut off", read, 1
        )
    ]


def _segment_end(path: Path) -> int | None:
    """Finds where a Matroska file ends by its own statement; None where it makes none, as of a live
    recording.

    Elements are an identifier and a length, each as long as the zeros before its first one bit say
    (RFC 8794, 4).
    """
    with path.open("rb") as stream:
        for identifier in (_EBML, _SEGMENT):
            if stream.read(4) != identifier:
                return None
            first = stream.read(1)
            if first in (b"", b"\0"):
                return None
            width = 9 - first[0].bit_length()
            size = int.from_bytes(first + stream.read(width - 1), "big") - (1 << 7 * width)
            if size == (1 << 7 * width) - 1:
                return None
            if identifier == _EBML:
                stream.seek(size, SEEK_CUR)
        return stream.tell() + size


def _of_transport_stream(path: Path) -> list[Finding]:
    """Packets are 188 bytes, or 192 with the time code of a camcorder's M2TS before the sync
    byte."""
    with path.open("rb") as stream:
        length = 192 if stream.read(5)[4:5] == b"\x47" else 188
    if path.stat().st_size % length == 0:
        return []
    return [
        Finding(
            kind="truncated",
            severity=Severity.WARNING,
            what=f"the file is not a whole number of transport packets of {length} B: it is cut "
            "off or damaged",
        )
    ]


# Containers of one file's own frames. Playlists and scripts that name other files or addresses
# (HLS, DASH, concat, SDP) are not among them.
_FORMATS = (
    "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,mpegts,avi,mpeg,mpegvideo,h264,hevc,m4v,mjpeg,"
    "mxf,flv,asf,ogg,gif,apng,dv,ivf,"
    "yuv4mpegpipe,nut,wtv"
)
# Raw streams: FFmpeg numbers their frames at 25 Hz, which is nobody's measurement.
UNTIMED = frozenset({"h264", "hevc", "mjpeg", "m4v", "mpegvideo"})
# Containers that number packets in decoding order.
BY_DECODE_ORDER = frozenset({"avi"})


_UNFINISHED = (
    "an MP4 or MOV whose index (moov) is missing was cut off or not closed by the camera: repair "
    "it with a recovery "
    "tool and an intact file of the same camera"
)


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    try:
        yield
    except (av.error.FFmpegError, ValueError, OSError, MemoryError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"the file cannot be opened as a video ({reason})", where=str(path), fix=_advice(path)
        ) from error


def _advice(path: Path) -> str:
    """Advises what to do about a file that will not open; an unfinished MP4 is the common case."""
    try:
        with path.open("rb") as stream:
            head = stream.read(12)
    except OSError:
        return "check that the file is still there and readable"
    if head[4:8] in (b"ftyp", b"mdat", b"wide", b"free"):
        return _UNFINISHED
    return (
        "give a video that a player opens: MP4, MOV, MTS, AVI or MKV, or a folder of PNG or JPEG "
        "images"
    )


def check_file(path: Path, limits: Limits) -> None:
    """Refuse what is not a file with something in it, and animated pictures whose first bytes state
    an absurd size.

    Raises:
        NotFoundError, InputError, LimitError
    """
    check_input(path, noun="video file")
    try:
        with path.open("rb") as stream:
            head = stream.read(24)
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})", where=str(path), fix="check its rights"
        ) from error
    size = (0, 0)
    if head[:4] == b"GIF8" and len(head) >= 10:
        size = struct.unpack("<HH", head[6:10])
    elif head[:8] == b"\x89PNG\r\n\x1a\n" and len(head) >= 24:
        size = struct.unpack(">II", head[16:24])
    if size[0] * size[1] > limits.frame_pixels:
        raise _too_large(*size, limits, path)


def _too_large(width: int, height: int, limits: Limits, path: Path) -> LimitError:
    return LimitError(
        f"frames of {width} × {height} px are beyond the limit of {limits.frame_pixels} px",
        where=str(path),
        fix="raise the limit if the file is to be trusted",
    )


def open_container(
    path: Path, limits: Limits, *, threads: int, wanted: int | None = None
) -> tuple[InputContainer, VideoStream]:
    """Opens the container and a video stream, ready to decode; nothing is decoded yet.

    Args:
        wanted: number of the stream in the file; None for the first real one.

    Raises:
        InputError: not a video.
        UsageError: no such stream of pictures that can be decoded.
        LimitError: its header states frames beyond the limit.
    """
    container = _open_container(path, limits)
    try:
        stream = _choose(container, path, wanted)
        if stream.id and edit_list_remark(edits(path, stream.id)) is not None:
            container.close()
            container = _open_container(path, limits, ignore_editlist="1")
            stream = _choose(container, path, wanted)
        context = stream.codec_context
        if context.width * context.height > limits.frame_pixels:
            raise _too_large(context.width, context.height, limits, path)
        # The decoder itself refuses frames that turn out larger than the header said; its own count
        # includes padding.
        context.options = {"max_pixels": str(2 * limits.frame_pixels)}
        context.thread_count = threads
        context.thread_type = "FRAME" if threads > 1 else "SLICE"
    except BaseException:
        container.close()
        raise
    return container, stream


def _open_container(path: Path, limits: Limits, **options: str) -> InputContainer:
    """Opens the container; of a file that is cut off, what is whole."""
    with _reading(path):
        end = whole_part(path)
        part = "" if end is None else f"subfile,,start,0,end,{end},,:"
        return av.open(
            f"{part}file:{path.resolve()}",
            options={
                "protocol_whitelist": "file" if end is None else "file,subfile",
                "format_whitelist": _FORMATS,
                "max_pixels": str(2 * limits.frame_pixels),
                # Counters that pass their end are judged by `Counter`.
                "correct_ts_overflow": "0",
                **options,
            },
            metadata_errors="replace",
        )


def _choose(container: InputContainer, path: Path, wanted: int | None) -> VideoStream:
    """Chooses the stream of that number, or the first one, that is not a cover picture and that
    there is a decoder for."""
    streams = []
    for stream in container.streams.video:
        if stream.disposition & av.stream.Disposition.attached_pic:
            continue
        try:
            stream.codec_context  # noqa: B018
        except (RuntimeError, av.error.FFmpegError, AttributeError):
            continue
        if stream.codec_context is not None:
            if wanted in (None, stream.index):
                return stream
            streams.append(str(stream.index))
    if streams:
        raise UsageError(
            f"stream {wanted} is no video that can be decoded",
            where=str(path),
            fix=f"give --stream {' or '.join(map(command_line, streams))}",
        )
    kinds = sorted({stream.type for stream in container.streams if stream.type != "video"})
    if is_cut(path) and is_mp4(path):
        fix = _UNFINISHED
    elif any(
        not stream.disposition & av.stream.Disposition.attached_pic
        for stream in container.streams.video
    ):
        fix = "convert the video, as by ffmpeg -i FILE -c:v libx264 NEW.mp4"
    else:
        fix = "give the video file"
    raise InputError(
        f"the file holds {', '.join(kinds)} but no video that can be decoded"
        if kinds
        else "the file holds no video that can be decoded",
        where=str(path),
        fix=fix,
    )


def packets(
    container: InputContainer, stream: VideoStream, *, end: int | None = None
) -> Iterator[av.Packet]:
    """Packets of the stream, the empty one that flushes the decoder last; damage of the container
    ends them.

    Their stamps run on where a counter passes its end. `survey_file` reports damage. PyAV's
    IndexError comes in place of the flushing packet when a stream appeared in the middle of the
    file.

    Args:
        end: how many of them belong to the recording; None for all.
    """
    counter = _counter(container, stream)
    try:
        for packet in islice(container.demux(stream), end):
            counter.run_on(packet)
            yield packet
        if end is None:
            return
    except (av.error.FFmpegError, IndexError):
        pass
    flush = av.Packet()
    flush.stream = stream
    yield flush


def _counter(container: InputContainer, stream: VideoStream) -> Counter:
    return Counter(length=COUNTERS.get(container.format.name), tick=_tick(stream))


def survey_file(path: Path, options: CameraOptions) -> tuple[Timing, list[Finding]]:
    """Reads the timing of a file by its packets, without decoding, and whether it is cut off or its
    clock started anew.

    Raises:
        InputError: not a video.
        LimitError: more frames or pixels than the limits.
        TimeError: a raw stream and no `sequence_fps`.
        UsageError: `sequence_fps` for a file with stamps of its own.
    """
    container, stream = open_container(path, options.limits, threads=1, wanted=options.stream)
    with container:
        tally = _tally(container, stream, path, options.limits)
        first_part = (
            tally
            if container.format.name in UNTIMED
            else _before_restart(tally, tick=_tick(stream))
        )
        timing = replace(_timing(path, options, container, stream, first_part), end=first_part.end)
        passed_over = edit_list_remark(edits(path, stream.id)) if stream.id else None
        findings = [tally.problem] if tally.problem is not None else []
        if first_part.end is not None:
            after = timing.duration + 1 / float(timing.rate)
            findings.append(
                restarted_finding(
                    frame=first_part.frames, after=after, count=tally.frames - first_part.frames
                )
            )
        findings = findings or truncation(
            path, container, stream, timing, read=tally.frames + tally.discarded
        )
        return timing, findings + ([_edit_list(passed_over)] if passed_over is not None else [])


def _edit_list(shows: str) -> Finding:
    return Finding.of(
        "edit-list-passed-over",
        f"the file's edit list shows {shows}; it was left aside, and each frame is read once, at "
        "the time at "
        "which it was recorded",
        fix="to measure what the edit list shows, export the film from the program that made it",
    )


@dataclass(kw_only=True)
class _PacketStamps:
    """What the packets of a stream state.

    Attributes:
        stamps: of the packets that have one [ticks].
        places: numbers of these packets in the file, from 0.
        missing: numbers of the packets without a stamp.
        discarded: how many packets an edit list discards.
        end: number of the first packet that was left aside since the clock starts anew there.
        problem: why the packets could not be read to the end.
    """

    stamps: array[int] = field(default_factory=lambda: array("q"))
    places: array[int] = field(default_factory=lambda: array("q"))
    missing: array[int] = field(default_factory=lambda: array("q"))
    discarded: int = 0
    end: int | None = None
    problem: Finding | None = None

    @property
    def frames(self) -> int:
        return len(self.stamps) + len(self.missing)


def _tally(
    container: InputContainer, stream: VideoStream, path: Path, limits: Limits
) -> _PacketStamps:
    tally = _PacketStamps()
    pixels = max(1, stream.codec_context.width * stream.codec_context.height)
    counter = _counter(container, stream)
    try:
        for position, packet in enumerate(container.demux(stream)):
            counter.run_on(packet)
            stamp = packet.pts if packet.pts is not None else packet.dts
            if packet.size == 0 and stamp is None:
                continue
            if packet.is_discard:
                tally.discarded += 1
                continue
            if stamp is None:
                tally.missing.append(position)
            else:
                tally.stamps.append(stamp)
                tally.places.append(position)
            if tally.frames > limits.frames or tally.frames * pixels > limits.total_pixels:
                raise LimitError(
                    f"{tally.frames} frames of {pixels} px and perhaps more are beyond the limit "
                    f"of {limits.frames} "
                    f"frames and {limits.total_pixels} px in all",
                    where=str(path),
                    fix="cut the file into parts, or raise the limit",
                )
    except av.error.FFmpegError as error:
        message = f"the container cannot be read any further ({error.strerror})"
        tally.problem = cut_off(message, tally.frames, 1)
    except IndexError:
        tally.problem = Finding.of(
            "stream-appeared",
            "another stream appears in the middle of the file, which is damaged or was joined from "
            "several",
        )
    return tally


def _before_restart(tally: _PacketStamps, *, tick: Fraction) -> _PacketStamps:
    """Returns the packets up to where the clock starts anew; all where it never does."""
    index = restart(np.frombuffer(tally.stamps, dtype=np.int64), tick=tick)
    if index is None:
        return tally
    end = tally.places[index]
    missing = array("q", (position for position in tally.missing if position < end))
    return replace(
        tally, stamps=tally.stamps[:index], places=tally.places[:index], missing=missing, end=end
    )


def _tick(stream: VideoStream) -> Fraction:
    return stream.time_base or Fraction(1, 1000)


def _timing(
    path: Path,
    options: CameraOptions,
    container: InputContainer,
    stream: VideoStream,
    tally: _PacketStamps,
) -> Timing:
    if container.format.name in UNTIMED:
        if options.sequence_fps is None:
            raise TimeError(
                "a raw stream has no time stamps",
                where=str(path),
                fix="give the camera's frame rate, --sequence-fps HZ, or wrap the stream in a "
                "container with stamps",
            )
        rate = exact(options.sequence_fps)
        places = np.arange(tally.frames, dtype=np.int64)
        return survey(places, tick=1 / rate, missing=0, fallback_rate=rate)
    if options.sequence_fps is not None:
        raise UsageError(
            "--sequence-fps is for image sequences and raw streams; this file has time stamps of "
            "its own",
            where=str(path),
            fix="leave it out, or give --true-fps HZ if a high-speed camera stored a wrong rate",
        )
    rate = stream.average_rate or stream.guessed_rate
    stamps = np.frombuffer(tally.stamps, dtype=np.int64)
    return survey(
        stamps,
        tick=_tick(stream),
        missing=len(tally.missing),
        fallback_rate=rate or None,
        where=str(path),
    )
