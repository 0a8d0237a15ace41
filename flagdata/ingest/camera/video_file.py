"""Video files through PyAV: a survey of the packets, then decoding that survives damage and says
what it skipped.

The recording time that AVCHD camcorders (MTS files) write into the video stream itself.

An H.264 message of unregistered user data (ITU-T H.264, D.1.6) with the identifier below holds
"MDPM", a count, and entries of a tag and four bytes, after the packs of DV (IEC 61834-4): 0x18 is a
zone byte, century, year, month; 0x19 is day, hour, minute, second, all as binary-coded decimals.
The zone byte is left aside: many cameras leave it at zero whatever zone they are set to. So the
time is wall-clock time without a zone.

What the delays of a GIF say of its frames' rate: whole hundredths of a second, and nothing at all
below two.

GIF89a counts delays in hundredths (section 23, Graphic Control Extension). Programs write 0 or 1
for "as fast as possible"; browsers play both as 10, a demuxer plays 1 as 1: a camera of unknown
rate would count as one of 100 Hz.
"""

from __future__ import annotations

import heapq
import math
import re
import struct
from collections.abc import Iterator
from contextlib import suppress
from datetime import datetime
from fractions import Fraction
from functools import partial
from itertools import islice
from pathlib import Path
from typing import cast

import av
import av.error
import numpy as np
from av.container import InputContainer
from av.sidedata.sidedata import SideData, Type
from av.video.stream import VideoStream

from flagdata.core.findings import Finding
from flagdata.core.shell import command_line
from flagdata.errors import InputError, TimeError
from flagdata.ingest.camera.boxes import edits, is_cut
from flagdata.ingest.camera.camera_options import CameraOptions
from flagdata.ingest.camera.container_clock import COUNTERS
from flagdata.ingest.camera.damage import Damage
from flagdata.ingest.camera.frame_stamps import Timing
from flagdata.ingest.camera.gpmf import GpsTimes, gps_times, telemetry_of
from flagdata.ingest.camera.luma import luma_of_frame
from flagdata.ingest.camera.picture_geometry import Orientation
from flagdata.ingest.camera.picture_source import Picture, SourceFacts
from flagdata.ingest.camera.video_container import (
    BY_DECODE_ORDER,
    UNTIMED,
    check_file,
    open_container,
    packets,
    survey_file,
)

CONTAINER = "gif"
SHORTEST = 2
"""The shortest delay that is taken for a statement [hundredths of a second]."""
HALF = Fraction(1, 200)
"""What rounding to hundredths leaves open [s]."""
LOOKED_AT = 16 * 1024**2
"""Bytes of the file whose delays are read."""
# The extension's label, its size, flags, the delay, an index, the end; a picture or another
# extension follows.
_DELAY = re.compile(rb"\x21\xf9\x04.(..).\x00[\x21\x2c]", re.DOTALL)


def delays(path: Path) -> list[int]:
    """Delays that a GIF states, as far as `LOOKED_AT` [hundredths of a second]."""
    with path.open("rb") as stream:
        head = stream.read(LOOKED_AT)
    return [struct.unpack("<H", match)[0] for match in _DELAY.findall(head)]


def check(path: Path, timing: Timing, *, true_fps: float | None) -> list[Finding]:
    """Reports what is open about the rate of a GIF with `timing`; nothing where the user named the
    camera's.

    Raises:
        TimeError: its delays say nothing, and no rate was named.
    """
    if true_fps is not None:
        return []
    period = timing.period * timing.tick
    waits = delays(path)
    if waits and float(np.median(waits)) < SHORTEST:
        raise TimeError(
            f"the GIF states delays of {float(np.median(waits)):g} hundredths of a second, which "
            'stands for "as fast '
            "as possible\": the camera's rate is not known",
            where=str(path),
            fix="give the rate at which the camera ran, --true-fps HZ, or the film that the GIF "
            "was made of",
        )
    if timing.variable or period.denominator > 100:
        return []  # delays of 3, 3 and 4 hundredths keep a mean
    low, high = float(1 / (period + HALF)), float(1 / (period - HALF))
    return [
        Finding.of(
            "gif-delays",
            f"a GIF states times in hundredths of a second: delays of {float(period):g} s say that "
            "the rate is "
            f"between {low:.3g} and {high:.3g} Hz, and {float(1 / period):.4g} Hz is assumed",
            value=float(1 / period),
            fix="if the camera's rate is known, give it: --true-fps HZ",
        )
    ]


_IDENTIFIER = bytes.fromhex("17ee8c60f84d11d98cd60800200c9a66") + b"MDPM"


def recording_time(message: bytes) -> str | None:
    """Reads ISO 8601 wall-clock time, to the second and without a zone, of one user-data message;
    `None` if it has none."""
    if not message.startswith(_IDENTIFIER):
        return None
    body = message[len(_IDENTIFIER) :]
    entries = {body[i]: body[i + 1 : i + 5] for i in range(1, len(body) - 4, 5)}
    if not {0x18, 0x19} <= entries.keys():
        return None
    digits = (entries[0x18][1:] + entries[0x19]).hex()
    try:
        # A wall-clock time; the caller attaches the camera's zone.
        return datetime.strptime(digits, "%Y%m%d%H%M%S").isoformat()  # noqa: DTZ007
    except ValueError:
        return None


_CAPTURE_RATE = "com.android.capture.fps"
_RATES_AGREE = 0.1
"""Part by which the rate that a phone states and that of the stamps differ where neither is slow
motion."""
_FARTHEST = 1000  # frames decoded in vain to reach a place between key frames


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
        self._damage = Damage()
        check_file(path, options.limits)
        timing, surveyed = survey_file(path, options)
        self._timing = timing
        self._gps = self._gps_times()
        self._container, self._stream = self._open()
        try:
            self._decoded = self._decode()
            first = next(self._decoded, None)
            if first is None:
                raise self._frameless()
            self._first = first
            self.facts = self._describe(first[1], [*surveyed, *self._stream_findings(first[1])])
        except BaseException:
            self._container.close()
            raise

    def _frameless(self) -> InputError:
        """Returns the error of a file of which no frame came."""
        packets_there, damaged = (
            self._timing.count + self._timing.missing,
            "copy it from the camera again",
        )
        if packets_there:
            message = f"not one frame could be decoded of {packets_there} packets"
            fix = f"the file is damaged beyond reading; {damaged}"
        elif self._stream.frames and edits(self._path, self._stream.id) and not is_cut(self._path):
            message = f"the file's edit list shows none of its {self._stream.frames} frames"
            fix = "write the film without it: ffmpeg -ignore_editlist 1 -i IN -c copy OUT"
        else:
            message, fix = (
                "the file ends before its first frame",
                f"the rest of it is missing; {damaged}",
            )
        return InputError(message, where=str(self._path), fix=fix)

    def _open(self) -> tuple[InputContainer, VideoStream]:
        options = self._options
        return open_container(
            self._path, options.limits, threads=options.threads, wanted=options.stream
        )

    def _gps_times(self) -> GpsTimes | None:
        container, _ = self._open()
        with container:
            telemetry = telemetry_of(container)
            if telemetry is None:
                return None
            return gps_times(container, telemetry, origin=self._timing.origin * self._timing.tick)

    def _describe(self, first: av.VideoFrame, findings: list[Finding]) -> SourceFacts:
        context = self._stream.codec_context
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
            metadata=self._metadata(),
            recorded=_recording_time(first),
            sequence=self._container.format.name in UNTIMED,
            findings=tuple(findings),
            gps=self._gps,
        )

    def _metadata(self) -> dict[str, str]:
        """Returns what the container and the stream state, keys lower-cased; the stream's win."""
        return {
            k.lower(): v for k, v in {**self._container.metadata, **self._stream.metadata}.items()
        }

    def _stream_findings(self, first: av.VideoFrame) -> list[Finding]:
        findings = []
        if self._container.format.name == CONTAINER:
            findings += check(self._path, self._timing, true_fps=self._options.true_fps)
        if first.interlaced_frame:
            findings.append(
                Finding.of(
                    "interlaced",
                    "the video is interlaced: each frame mixes two instants, half a frame period "
                    "apart; it was "
                    "not deinterlaced",
                )
            )
        if _orientation(first).mirrored:
            findings.append(Finding.of("mirrored", "the file asks to be shown mirrored"))
        if not _orientation(first).exact:
            findings.append(
                Finding.of(
                    "odd-rotation",
                    "the file asks for a rotation that is not a multiple of 90°; the nearest one "
                    "was taken",
                )
            )
        if int(first.color_trc) in (16, 18):
            findings.append(
                Finding.of(
                    "hdr-transfer",
                    "the video is HDR (PQ or HLG): its grays are not those of an ordinary camera",
                )
            )
        if (
            _has_alpha(first) or self._metadata().get("alpha_mode") == "1"
        ):  # VP8 and VP9 code it beside
            findings.append(
                Finding.of(
                    "alpha-ignored", "transparency was left aside: the picture below it is read"
                )
            )
        findings += self._capture_findings()
        further_streams = len(self._container.streams.video) - 1
        if further_streams:
            findings.append(
                Finding.of(
                    "more-video-streams",
                    f"stream {self._stream.index} was taken, {further_streams} other video streams "
                    "were not",
                    count=further_streams,
                    fix="choose another with --stream",
                )
            )
        if (
            self._options.start is None
            and telemetry_of(self._container) is not None
            and self._gps is None
        ):
            findings.append(
                Finding.of(
                    "telemetry-without-time",
                    "the telemetry in the file (GPMF) states no GPS time with a fix; the start is "
                    "the camera's own"
                    " clock",
                    fix="if that clock was not set, give --start",
                )
            )
        return findings

    def _capture_findings(self) -> list[Finding]:
        """Reports a phone's statement of the rate at which it took the frames, where it is not that
        of the stamps."""
        if self._options.true_fps is not None:
            return []
        try:
            taken = float(self._metadata().get(_CAPTURE_RATE, "nan"))
        except ValueError:
            return []
        stamp_rate = float(self._timing.rate)
        if not math.isfinite(taken) or taken <= 0 or abs(taken / stamp_rate - 1) <= _RATES_AGREE:
            return []
        return [
            Finding.of(
                "capture-rate",
                f"the file says that the camera took {taken:g} frames a second, its time stamps "
                f"say {stamp_rate:.4g}: "
                f"time runs {taken / stamp_rate:.3g} times too slow in it",
                value=taken,
                fix=f"give the camera's rate: {command_line('--true-fps', f'{taken:g}')}",
            )
        ]

    def pictures(self) -> Iterator[Picture]:
        codec = self.facts.codec
        stamp, frame = self._first
        yield Picture(stamp=stamp, luma=partial(luma_of_frame, frame, codec=codec))
        for stamp, frame in self._decoded:
            if (frame.width, frame.height) != (self.facts.width, self.facts.height):
                self._damage.resized += 1
                continue
            yield Picture(stamp=stamp, luma=partial(luma_of_frame, frame, codec=codec))

    def samples(self, runs: int, count: int, stride: int) -> Iterator[list[Picture]]:
        container, stream = self._open()
        with container:
            keys: set[int | None] = set()
            for run in range(runs):
                target = self._timing.origin + self._timing.span * run // runs
                pictures: list[Picture] = []
                # Where no seek finds its place, the runs follow one another.
                if self._seekable:
                    with suppress(av.error.FFmpegError):
                        container.seek(target, stream=stream)
                # A spot that cannot be decoded is no loss to a sample; what came before it counts.
                with suppress(av.error.FFmpegError):
                    for frame in _run(container.decode(stream), keys, target=target, stride=stride):
                        if (frame.width, frame.height) == (self.facts.width, self.facts.height):
                            luma = partial(luma_of_frame, frame, codec=self.facts.codec)
                            pictures.append(Picture(stamp=frame.pts, luma=luma))
                        if len(pictures) == count:
                            break
                if pictures:
                    yield pictures

    @property
    def _seekable(self) -> bool:
        """Whether the file has stamps, and they increase all through it."""
        length = COUNTERS.get(self.facts.container, math.inf)
        is_complete = self._timing.end is None and self._timing.origin + self._timing.span < length
        return is_complete and not self.facts.sequence

    def _decode(self) -> Iterator[tuple[int | None, av.VideoFrame]]:
        """Yields (stamp, frame) in order of presentation."""
        form = self._container.format.name
        ordered = _DecodeOrderStamps(self._timing) if form in BY_DECODE_ORDER else None
        damaged = False
        flagged: set[int | None] = set()
        count = 0
        for packet in packets(self._container, self._stream, end=self._timing.end):
            count += 1
            stamp = packet.pts if packet.pts is not None else packet.dts
            # Where another take begins, transport packets are not numbered on, for which FFmpeg
            # marks one of the last two frames before it.
            joint = self._timing.end is not None and count >= self._timing.end - 1
            if packet.is_corrupt and not joint:
                # It is decoded all the same, since others refer to it; the frame it makes is left
                # out.
                flagged.add(stamp)
                damaged = True
            try:
                if ordered is not None:
                    ordered.sent(stamp)
                frames = packet.decode()
            except av.error.FFmpegError:
                self._damage.refuse(count)
                if ordered is not None:
                    ordered.lost(stamp)
                damaged = True
                continue
            for frame in frames:
                if not isinstance(frame, av.VideoFrame):
                    continue
                packet_stamp = frame.pts if frame.pts is not None else frame.dts
                presented = ordered.shown(packet_stamp) if ordered is not None else packet_stamp
                if form in UNTIMED:  # FFmpeg's numbers are at its own rate, or none
                    presented = self._damage.decoded + self._damage.packets
                self._damage.decoded += 1
                if frame.is_corrupt or (flagged and packet_stamp in flagged):
                    self._damage.corrupt += 1
                    continue
                damaged = damaged and not frame.key_frame
                self._damage.suspect += damaged
                yield presented, frame

    def damage(self) -> list[Finding]:
        return self._damage.findings(expected=self._timing.count + self._timing.missing)

    def close(self) -> None:
        self._container.close()


def _run(
    frames: Iterator[av.VideoFrame], keys: set[int | None], *, target: int, stride: int
) -> Iterator[av.VideoFrame]:
    """Yields every `stride`-th of the frames after a seek, from the key frame it landed on.

    Where an earlier run began with that frame, from `target` on. Adds the first frame's stamp to
    `keys`.
    """
    first = next(frames, None)
    if first is None:
        return
    if first.pts in keys:
        first = next(
            (frame for frame in islice(frames, _FARTHEST) if (frame.pts or 0) >= target), None
        )
    if first is not None:
        keys.add(first.pts)
        yield first
        yield from islice(frames, stride - 1, None, stride)


class _DecodeOrderStamps:
    """Stamps for containers that number frames in decoding order: presentation takes them in
    increasing order."""

    def __init__(self, timing: Timing) -> None:
        self._reach = 17 * timing.period
        self._waiting: list[int] = []

    def sent(self, stamp: int | None) -> None:
        if stamp is not None:
            heapq.heappush(self._waiting, stamp)

    def lost(self, stamp: int | None) -> None:
        """Notes that the packet with `stamp` gives no frame."""
        if stamp in self._waiting:
            self._waiting.remove(stamp)
            heapq.heapify(self._waiting)

    def shown(self, packet_stamp: int | None) -> int | None:
        """Returns the stamp of the frame shown next, whose packet carried `packet_stamp`; drops
        those of lost frames."""
        while (
            self._waiting
            and packet_stamp is not None
            and self._waiting[0] < packet_stamp - self._reach
        ):
            heapq.heappop(self._waiting)
        return heapq.heappop(self._waiting) if self._waiting else packet_stamp


def _has_alpha(frame: av.VideoFrame) -> bool:
    """Checks whether a frame states transparency: in a component of its own, or in its palette."""
    if frame.format.has_palette and len(frame.planes) > 1:
        return bool((np.frombuffer(memoryview(frame.planes[1]), dtype=np.uint8)[3::4] < 255).any())
    return any(component.is_alpha for component in frame.format.components)


def _pixel_aspect(stream: VideoStream) -> Fraction:
    aspect = stream.sample_aspect_ratio or stream.codec_context.sample_aspect_ratio
    return Fraction(aspect) if aspect and aspect > 0 else Fraction(1)


def _side_data(frame: av.VideoFrame) -> list[SideData]:
    # The container iterates over its items, although it is declared a mapping of them.
    return cast(list[SideData], list(frame.side_data))


def _orientation(frame: av.VideoFrame) -> Orientation:
    for data in _side_data(frame):
        if data.type is Type.DISPLAYMATRIX:
            return Orientation.of_display_matrix(
                np.frombuffer(memoryview(data), dtype="<i4").tolist()
            )
    return Orientation()


def _recording_time(frame: av.VideoFrame) -> str | None:
    for data in _side_data(frame):
        if data.type is Type.SEI_UNREGISTERED:
            text = recording_time(bytes(memoryview(data)))
            if text is not None:
                return text
    return None
