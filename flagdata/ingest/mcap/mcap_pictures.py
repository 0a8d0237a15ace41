"""A topic of pictures in an MCAP file as a camera's source: compressed images, compressed video,
plain pixels.

Sources: Foxglove's schemas CompressedImage, CompressedVideo and RawImage
(https://docs.foxglove.dev/docs/sdk/schemas); ROS 2's sensor_msgs, whose Image states the bytes of a
row as `step`.
"""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, cast

import av
import av.error
import numpy as np
from PIL import Image

from flagdata.core.findings import Finding
from flagdata.errors import InputError, LimitError, TimeError
from flagdata.ingest.camera import depth
from flagdata.ingest.camera.camera_options import CameraOptions
from flagdata.ingest.camera.container_clock import restart, restarted_finding
from flagdata.ingest.camera.damage import resized_findings, undecoded_findings
from flagdata.ingest.camera.frame_stamps import survey
from flagdata.ingest.camera.luma import BROKEN, DEEP, STILLS, Luma, luma_of_frame, luma_of_image
from flagdata.ingest.camera.picture_geometry import Orientation
from flagdata.ingest.camera.picture_source import Picture, SourceFacts
from flagdata.ingest.mcap.bags import parts_of
from flagdata.ingest.mcap.topics import (
    MOVING,
    RAW,
    STILL,
    Decoded,
    Topic,
    choose,
    index,
    messages,
    topics,
)
from flagdata.timebase import NANOSECONDS

_NANOSECOND = Fraction(1, 1_000_000_000)
_VIDEO = {"h264": "h264", "h265": "hevc", "hevc": "hevc", "av1": "av1", "vp9": "vp9"}
_PLAIN = {  # encoding → (mode for Pillow, how the bytes of a pixel lie)
    "mono8": ("L", "L"),
    "8uc1": ("L", "L"),
    "rgb8": ("RGB", "RGB"),
    "8uc3": ("RGB", "BGR"),
    "bgr8": ("RGB", "BGR"),
    "rgba8": ("RGB", "RGBX"),
    "bgra8": ("RGB", "BGRX"),
}
_DEPTH = re.compile(r"\b(?:16UC1|16SC1|32SC1|32FC1|64FC1|compressedDepth)\b", re.IGNORECASE)
_LOOKED = (5, 4, 1)
"""Runs of pictures, and pictures of each, that are looked at for their brightest gray; see
`TopicSource.samples`."""
_BYTES_OF = {"L": 1, "RGB": 3, "BGR": 3, "RGBX": 4, "BGRX": 4}


def of_pictures(present: Sequence[Topic]) -> tuple[Topic, ...]:
    """Selects the topics that hold pictures."""
    return tuple(topic for topic in present if topic.pictures)


class TopicSource:
    """The pictures of one topic, of a file or of the parts of a bag. See
    `flagdata.ingest.camera.picture_source.PictureSource`.

    A picture's instant is the one that its message states, else the one at which it was logged.
    Pictures come in the order of their instants; compressed video in that in which it was recorded,
    as its decoder needs it.

    Raises:
        InputError: no topic of pictures, several and none is named, or none that can be decoded.
        UnknownNameError: no such topic.
        LimitError: more frames or pixels than `options.limits`.
        TimeError: a rate for pictures that have stamps.
    """

    def __init__(self, path: Path, options: CameraOptions) -> None:
        self._limits = options.limits
        self._where = where = str(path)
        self._path = path
        present = topics(path)
        self._topic = choose(of_pictures(present), options.topic, where=where, noun="pictures")
        if options.sequence_fps is not None:
            raise TimeError(
                "pictures of a topic have stamps of their own",
                where=where,
                fix="leave out --sequence-fps",
            )
        self._kind = self._topic.pictures
        self._broken = self._resized = 0
        messages_index = index(
            self._path, self._topic.name, limit=self._limits.frames, sort=self._kind != MOVING
        )
        if not len(messages_index.stamps):
            raise InputError(
                f"{self._topic.name} has no messages", where=where, fix="choose another topic"
            )
        findings = [
            *_other_topics(present, self._topic),
            *_joined_findings(parts_of(path)),
            *messages_index.findings,
        ]
        end = None if messages_index.in_time else restart(messages_index.stamps, tick=_NANOSECOND)
        if end is not None:
            after = int(messages_index.stamps[end - 1] - messages_index.stamps[0]) / NANOSECONDS
            findings.append(
                restarted_finding(frame=end, after=after, count=len(messages_index.stamps) - end)
            )
        self._index = messages_index = messages_index.part(0, end)
        timing = survey(
            np.sort(messages_index.stamps) if messages_index.in_time else messages_index.stamps,
            tick=_NANOSECOND,
            missing=0,
            fallback_rate=Fraction(1),
            where=where,
        )
        decoded = self._decode_pictures(
            messages(self._path, self._topic.name, picked=messages_index)
        )
        first = next(decoded, None)
        if first is None:
            raise InputError(
                f"none of {len(self._index.stamps)} pictures of {self._topic.name} can be decoded",
                where=where,
                fix="choose another topic: --topic NAME",
            )
        _, width, height, codec, pixel_format, _ = first
        self._size = (width, height)
        self._white: float | None = None
        findings += self._depth(pixel_format)
        self._pictures = decoded
        self._head = first
        self.facts = SourceFacts(
            container=f"mcap {self._topic.schema}",
            codec=codec,
            pixel_format=pixel_format,
            width=width,
            height=height,
            aspect=Fraction(1),
            orientation=Orientation(),
            interlaced=False,
            timing=timing,
            metadata={},
            recorded=None,
            sequence=False,
            findings=tuple(findings),
            stamped=timing.origin,
        )

    def _depth(self, pixel_format: str) -> tuple[Finding, ...]:
        """Settles the white of pictures of 16 bits by the brightest gray of those looked at.

        Raises:
            InputError: they are of fewer bits, but of a form whose white cannot be set.
        """
        if "16" not in pixel_format:
            return ()
        lumas = [picture.luma() for run in self.samples(*_LOOKED) for picture in run]
        brightest = max((int(np.asarray(luma.image).max()) for luma in lumas), default=0)
        which = f"the {len(lumas)} pictures looked at"
        white, findings = depth.white(
            brightest, which=which, otherwise="; if they are depths, choose another topic"
        )
        if findings and not pixel_format.startswith(DEEP):
            message = (
                f"{which} are of 16 bits, and none of their pixels is brighter than {brightest}"
            )
            raise InputError(
                f"{message}: they would be next to black",
                where=self._where,
                fix="write them with 8 bits a colour",
            )
        self._white = white if findings else None
        return findings

    def _picture(self, picture: _Shown) -> Picture:
        if self._white is None:
            return Picture(stamp=picture[0], luma=picture[5])
        white = self._white
        return Picture(stamp=picture[0], luma=lambda: replace(picture[5](), white=white))

    def pictures(self) -> Iterator[Picture]:
        yield self._picture(self._head)
        for picture in self._pictures:
            if picture[1:3] != self._size:
                self._resized += 1
                continue
            yield self._picture(picture)

    def samples(self, runs: int, count: int, stride: int) -> Iterator[list[Picture]]:
        length = len(self._index.stamps)
        first = 0
        for run in range(runs):
            start = max(first, length * run // runs)
            first = min(start + count * stride, length)
            if start >= length:
                return
            part = messages(self._path, self._topic.name, picked=self._index.part(start))
            sound = (
                picture
                for picture in self._decode_pictures(part, tally=False)
                if picture[1:3] == self._size
            )
            pictures = [
                self._picture(picture) for picture in islice(sound, 0, count * stride, stride)
            ]
            if pictures:
                yield pictures

    def damage(self) -> list[Finding]:
        return undecoded_findings(self._broken, total=len(self._index.stamps)) + resized_findings(
            self._resized
        )

    def close(self) -> None:
        """Closes nothing: the file is open only while pictures are read."""

    def _decode_pictures(
        self, decoded: Iterator[Decoded], *, tally: bool = True
    ) -> Iterator[_Shown]:
        decode = {STILL: self._stills, MOVING: self._moving, RAW: self._plain}[str(self._kind)]
        for frame in decode(decoded):
            if frame is None:
                self._broken += tally
                continue
            if frame[1] * frame[2] > self._limits.frame_pixels:
                raise LimitError(
                    f"a picture of {frame[1]} × {frame[2]} px is beyond the limit of "
                    f"{self._limits.frame_pixels} px",
                    where=self._where,
                    fix="raise the limit if the file is to be trusted",
                )
            yield frame

    def _stills(self, decoded: Iterator[Decoded]) -> Iterator[_Shown | None]:
        for message in decoded:
            self._check_no_depth(str(message.values.get("format", "")))
            try:
                image = Image.open(io.BytesIO(_data(message.values) or b""), formats=STILLS)
                if image.width * image.height <= self._limits.frame_pixels:
                    image.load()
            except BROKEN:
                yield None
                continue
            yield (
                message.stamp,
                image.width,
                image.height,
                str(image.format).lower(),
                image.mode,
                partial(luma_of_image, image),
            )

    def _check_no_depth(self, format_stated: str) -> None:
        """Refuse pictures whose format says that their values are distances, as image_transport
        writes it."""
        if _DEPTH.search(format_stated):
            raise InputError(
                f"pictures of the format {format_stated!r} are depths, not grays",
                where=f"{self._where}, {self._topic.name}",
                fix="choose a topic of grays or colours: --topic NAME",
            )

    def _plain(self, decoded: Iterator[Decoded]) -> Iterator[_Shown | None]:
        for message in decoded:
            values = message.values
            encoding = str(values.get("encoding", "")).lower()
            if encoding not in _PLAIN:
                raise InputError(
                    f"pixels of the encoding {encoding!r} are not read",
                    where=f"{self._where}, {self._topic.name}",
                    fix=f"record one of {', '.join(_PLAIN)}, or compressed images",
                )
            mode, layout = _PLAIN[encoding]
            data = _data(values)
            width, height, step = (values.get(name) or 0 for name in ("width", "height", "step"))
            if not all(isinstance(size, int) for size in (width, height, step)):  # of JSON
                yield None
                continue
            step = step or width * _BYTES_OF[layout]
            if (
                data is None
                or width < 1
                or height < 1
                or len(data) < step * height
                or step < width * _BYTES_OF[layout]
            ):
                yield None
                continue
            image = Image.frombytes(
                mode, (width, height), data[: step * height], "raw", layout, step, 1
            )
            yield message.stamp, width, height, "raw", encoding, partial(luma_of_image, image)

    def _moving(self, decoded: Iterator[Decoded]) -> Iterator[_Shown | None]:
        """Frames of a video, each by the stamp of the message that it came in; there are no
        B-frames."""
        context: Any = None
        stamps: dict[int, int] = {}
        name = ""
        for number, message in enumerate(decoded):
            if context is None:
                name = _VIDEO.get(str(message.values.get("format", "")).lower(), "")
                if not name:
                    raise InputError(
                        f"video of the format {message.values.get('format')!r} is not read",
                        where=f"{self._where}, {self._topic.name}",
                        fix=f"record one of {', '.join(_VIDEO)}",
                    )
                context = av.CodecContext.create(name, "r")
                context.thread_count, context.flags = 1, context.flags | 0x00080000  # low delay
                context.options = {"max_pixels": str(2 * self._limits.frame_pixels)}
            data = _data(message.values)
            if data is None:
                yield None
                continue
            stamps[number] = message.stamp
            packet = av.Packet(data)
            packet.pts = packet.dts = number
            yield from self._frames(context, packet, stamps, name)
        if context is not None:
            yield from self._frames(context, None, stamps, name)

    def _frames(
        self, context: Any, packet: Any, stamps: Mapping[int, int], name: str
    ) -> Iterator[_Shown | None]:
        try:
            frames = context.decode(packet)
        except av.error.FFmpegError:
            if packet is not None:
                yield None
            return
        for frame in frames:
            frame = cast(av.VideoFrame, frame)
            if frame.is_corrupt or frame.pts is None or frame.pts not in stamps:
                yield None
                continue
            yield (
                stamps[frame.pts],
                frame.width,
                frame.height,
                name,
                frame.format.name,
                partial(luma_of_frame, frame, codec=name),
            )


_Shown = tuple[int, int, int, str, str, Callable[[], Luma]]
"""A picture: stamp [UTC ns], width, height, codec, pixel format, and what gives its luma."""


def _data(values: Mapping[str, Any]) -> bytes | None:
    """Returns the bytes of a picture's message; in JSON they are base64. None where there are
    none."""
    data = values.get("data")
    try:
        if isinstance(data, str):
            data = base64.b64decode(data)
        return bytes(data) if data and isinstance(data, bytes | list) else None
    except (ValueError, TypeError):
        return None


def _joined_findings(files: Sequence[Path]) -> Iterator[Finding]:
    if len(files) > 1:
        yield Finding.of(
            "chapters-joined",
            f"{len(files)} parts of one recording were joined: "
            f"{', '.join(part.name for part in files[:8])}" + (", …" if len(files) > 8 else ""),
            count=len(files),
        )


def _other_topics(present: tuple[Topic, ...], chosen: Topic) -> Iterator[Finding]:
    unread = [topic for topic in present if topic.name != chosen.name]
    if unread:
        yield Finding.of(
            "topics-not-read",
            f"{chosen.name} was read, {len(unread)} other topics were not: "
            f"{', '.join(map(str, unread[:8]))}",
            count=len(unread),
            fix="ingest the file again with --topic NAME for another",
        )
