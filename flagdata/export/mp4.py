"""MP4 + CSV: H.264 with the frames' own times, and the wind beside it, for people and for any video
tool.

Frame times become presentation times in whole microseconds after the first frame (an MP4 track
counts its steps in 32 bits, so nanoseconds would overflow at a gap of 4.3 s); <artifact>.frames.csv
has them exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, ClassVar

import av
import numpy as np
from av.video.codeccontext import VideoCodecContext
from av.video.reformatter import ColorRange
from av.video.stream import VideoStream

from flagdata.core.arrays import IntArray, UInt8Array
from flagdata.core.schema import CATALOG, CHANNELS, FRAME_RATE, Kind
from flagdata.errors import InputError, UsageError
from flagdata.export.csv_text import cell, write_csv
from flagdata.export.export_source import FILMED, IDENTITY, TRUTH, Entry, ExportRows
from flagdata.timebase import iso

MICROSECOND = Fraction(1, 1_000_000)
WIND_HEADER = ("time", "wind_speed [m/s]", "wind_sigma [m/s]", "wind_direction [rad]", "samples")
FRAMES_HEADER = ("frame", "pts [us]", "time", "device_time")
INDEX_COLUMNS = (*(name for name in IDENTITY if name != "parents"), "start", "end", *TRUTH)


@dataclass(frozen=True, kw_only=True)
class Mp4:
    """Files <artifact>.mp4, <artifact>.frames.csv, <artifact>.wind.csv (where there is wind), and
    index.csv.

    Attributes:
        crf: constant rate factor of x264: 0 is lossless, 51 is worst.
    """

    kinds: ClassVar[frozenset[Kind]] = FILMED

    crf: int = 18

    def __post_init__(self) -> None:
        if not 0 <= self.crf <= 51:
            raise UsageError(
                f"H.264 has no rate factor of {self.crf}",
                where="--crf",
                fix="give 0 (lossless) to 51",
            )

    def write(
        self, source: ExportRows, folder: Path, advance: Callable[[int], None]
    ) -> Mapping[str, Any]:
        frames = 0
        index: list[list[Any]] = []
        for entry in source.entries():
            if not entry.count:
                raise InputError(
                    "a record without frames makes no video",
                    where=entry.key,
                    fix="leave it out by --where",
                )
            name = f"{entry.key}.mp4"
            _encode(entry, folder / name, self.crf)
            write_csv(folder / f"{entry.key}.frames.csv", FRAMES_HEADER, _frame_rows(entry))
            wind = _wind_rows(entry)
            if wind is not None:
                write_csv(folder / f"{entry.key}.wind.csv", WIND_HEADER, wind)
            index.append([name, *(cell(entry.row[column]) for column in INDEX_COLUMNS)])
            frames += entry.count
            advance(1)
        header = [
            "file",
            *(f"{c} [{CATALOG[c].unit}]" if CATALOG[c].unit else c for c in INDEX_COLUMNS),
        ]
        write_csv(folder / "index.csv", header, index)
        return {
            "videos": len(source),
            "frames": frames,
            "time_base": "1/1000000 s from the first frame",
            "wind_direction": CHANNELS["wind_direction"].frame,
        }


def presentation_times(times: IntArray) -> IntArray:
    """Microseconds (n,) after the first frame, rounded; `times` (n,) in UTC ns.

    Raises:
        InputError: two frames within one microsecond.
    """
    pts = (times - times[0] + 500) // 1000
    if np.any(np.diff(pts) <= 0):
        raise InputError(
            "frames closer than a microsecond", fix="export to MCAP, which keeps nanoseconds"
        )
    return pts


def _encode(entry: Entry, path: Path, crf: int) -> None:
    pts = presentation_times(entry.frame_times)
    steps = np.diff(pts)
    # Nominal, for the encoder's own planning; the frames' times are `pts`.
    rate = (
        Fraction(MICROSECOND.denominator, round(float(np.median(steps))))
        if len(steps)
        else Fraction(FRAME_RATE)
    )
    options = {"movflags": "+faststart", "video_track_timescale": str(MICROSECOND.denominator)}
    with av.open(str(path), "w", format="mp4", options=options) as container:
        container.metadata["creation_time"] = iso(int(entry.frame_times[0]))
        container.metadata["comment"] = f"flagdata artifact {entry.key}"
        stream: VideoStream | None = None
        instants = iter(pts.tolist())
        for images in entry.images():
            if stream is None:
                stream = container.add_stream("libx264", rate=rate.limit_denominator(1001))
                _configure(stream, images.shape[1:], crf, where=entry.key)
            for image in images:
                frame = _luma_frame(image)
                frame.pts = next(instants)
                container.mux(stream.encode(frame))
        if stream is not None:
            container.mux(stream.encode(None))


def _configure(stream: VideoStream, shape: Sequence[int], crf: int, *, where: str) -> None:
    height, width = shape
    if height % 2 or width % 2:
        raise InputError(
            f"frames of {width}×{height}",
            where=where,
            fix="H.264 needs even sizes; ingest with one",
        )
    context: VideoCodecContext = stream.codec_context
    context.width, context.height, context.pix_fmt = width, height, "yuv420p"
    context.time_base = MICROSECOND
    context.color_range = ColorRange.JPEG
    # One thread: the bytes then do not depend on the machine. No B-frames: packets are in order of
    # presentation.
    context.options = {"crf": str(crf), "preset": "veryfast", "bf": "0", "threads": "1"}


def _luma_frame(image: UInt8Array) -> av.VideoFrame:
    """Converts a gray image (height, width) to the full-range luma of a picture without colour."""
    height, width = image.shape
    planar = np.full((height * 3 // 2, width), 128, dtype=np.uint8)
    planar[:height] = image
    frame = av.VideoFrame.from_ndarray(planar, format="yuv420p")
    frame.color_range = ColorRange.JPEG
    frame.time_base = MICROSECOND
    return frame


def _frame_rows(entry: Entry) -> Iterable[Sequence[object]]:
    times, device = entry.frame_times, entry.device_frame_times
    pts = presentation_times(times)
    for index, (at, time, device_time) in enumerate(
        zip(pts.tolist(), times.tolist(), device.tolist(), strict=True)
    ):
        yield index, at, iso(time), iso(device_time)


def _wind_rows(entry: Entry) -> list[tuple[object, ...]] | None:
    wind = entry.record.wind_1hz()
    if wind is None:
        return None
    begin, end = entry.wind_span
    inside = np.nonzero((wind.time >= begin) & (wind.time <= end))[0]
    return [
        (
            iso(int(wind.time[i])),
            *(cell(float(v[i])) for v in (wind.speed, wind.sigma, wind.direction)),
            wind.count[i],
        )
        for i in inside.tolist()
    ]
