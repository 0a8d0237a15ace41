"""A film: frames at their instants, from a video file, a folder of images, or a record of a
lake."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from flagdata.core.arrays import UInt8Array
from flagdata.core.findings import Finding
from flagdata.errors import InputError
from flagdata.ingest.camera import CameraOptions, open_camera, probe
from flagdata.record import Record
from flagdata.storage import Place
from flagdata.timebase import NANOSECONDS

_AT_ONCE = 64  # frames read from a record together
_NO_START = 0  # a file's own clock begins with its first frame
_LONGEST = 1920
"""Longer side [px] to which frames of files are averaged down: a flag of a tenth of it fills a
network's picture."""
_OF_PADDING = frozenset({"letterboxed"})
"""Findings on the padding about an oblong picture, which is left away."""


class Film(Protocol):
    """Frames on one clock, read any number of times."""

    @property
    def name(self) -> str:
        """What people call it."""
        ...

    @property
    def rate(self) -> float:
        """Frames a second: the median, where it varies [Hz]."""
        ...

    @property
    def duration(self) -> float:
        """From the first frame to the last [s]."""
        ...

    @property
    def start(self) -> int | None:
        """Instant of the first frame [UTC ns]; None where nobody said."""
        ...

    def frames(self, first: float, last: float) -> Iterator[tuple[float, UInt8Array]]:
        """Yields (time since the first frame [s], (height, width) gray) from `first` to `last` [s],
        in order."""
        ...

    def findings(self) -> tuple[Finding, ...]:
        """Returns what was noticed; complete when its frames were read."""
        ...


class CameraFilm:
    """A video file or a folder of images: the whole picture.

    Args:
        path: of it.
        true_fps: rate at which a high-speed camera really ran [Hz].
        sequence_fps: rate of images without stamps [Hz].

    Attributes:
        width, height: of the upright picture in the file [px]; frames may be smaller.

    Raises:
        FlagdataError: see `flagdata.ingest.camera.open_camera`.
    """

    def __init__(
        self, path: Path, *, true_fps: float | None = None, sequence_fps: float | None = None
    ) -> None:
        self.path = path
        options = CameraOptions(
            start=_NO_START, rate="native", true_fps=true_fps, sequence_fps=sequence_fps
        )
        facts = probe(path, options)
        self.width, self.height = facts.width, facts.height
        self._options = replace(
            options, crop="whole", size=min(_LONGEST, max(8, facts.width, facts.height))
        )
        slower = 1.0 if true_fps is None else facts.rate / true_fps
        self._rate = facts.rate / slower
        self._duration = facts.duration * slower
        self._findings = facts.findings

    @property
    def name(self) -> str:
        return self.path.name

    @property
    def rate(self) -> float:
        return self._rate

    @property
    def duration(self) -> float:
        return self._duration

    @property
    def start(self) -> int | None:
        return None

    def frames(self, first: float, last: float) -> Iterator[tuple[float, UInt8Array]]:
        with open_camera(self.path, self._options) as stream:
            try:
                for frame in stream.unpadded_frames():
                    time = frame.time / NANOSECONDS
                    if time > last:
                        break
                    if time >= first:
                        yield time, frame.image
            finally:
                self._findings = tuple(
                    finding for finding in stream.findings if finding.kind not in _OF_PADDING
                )

    def findings(self) -> tuple[Finding, ...]:
        return self._findings


class RecordFilm:
    """Frames of a record of a lake: a recording, one of its clips, or a camera's.

    Args:
        path: of the record's object.
        name: of the artifact.
        first, count: the frames that belong to it; all by default.

    Attributes:
        width, height: of its frames [px].

    Raises:
        InputError: fewer than two frames.
        NotFoundError, CorruptError: see `flagdata.record.Record`.
    """

    def __init__(self, path: Place, *, name: str, first: int = 0, count: int | None = None) -> None:
        self.record = Record.open(path)
        self._name, self._first = name, first
        count = self.record.frame_count - first if count is None else count
        if count < 2:
            raise InputError(
                f"{count} frames", where=name, fix="name a recording or clip with frames"
            )
        self.times = self.record.times(first, count)
        self._seconds = (self.times - self.times[0]) / NANOSECONDS
        self.height, self.width = self.record.frames(first, 1).shape[1:]

    @property
    def name(self) -> str:
        return self._name

    @property
    def rate(self) -> float:
        return float(NANOSECONDS / np.median(np.diff(self.times)))

    @property
    def duration(self) -> float:
        return float(self._seconds[-1])

    @property
    def start(self) -> int | None:
        return int(self.times[0])

    def frames(self, first: float, last: float) -> Iterator[tuple[float, UInt8Array]]:
        low = int(np.searchsorted(self._seconds, first, side="left"))
        high = int(np.searchsorted(self._seconds, last, side="right"))
        for begin in range(low, high, _AT_ONCE):
            count = min(_AT_ONCE, high - begin)
            pictures = self.record.frames(self._first + begin, count)
            yield from zip(self._seconds[begin : begin + count].tolist(), pictures, strict=True)

    def findings(self) -> tuple[Finding, ...]:
        return ()
