"""Frames of a film as one array, and an array as a film."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flagdata.core import html
from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.findings import Finding
from flagdata.errors import InputError, LimitError
from flagdata.ingest.films.film import Film
from flagdata.timebase import NANOSECONDS

LARGEST = 1 << 32
"""Bytes of frames that are given as one array."""
_SHOWN, _SIDE = 50, 240
"""Frames that a notebook shows in motion, and their sides [px]."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Frames:
    """Frames of a film as an array. It is a film itself: `flagdata.measure` and `flagdata.motion`
    take it.

    Attributes:
        images: (n, height, width) uint8 gray, or (n, height, width, 3) sRGB; y down, x right.
        time: (n,) since the first frame, ascending [s].
        name: what people call the film.
        start: instant of the first frame [UTC ns]; None where nobody said.

    Raises:
        InputError: fewer than two frames, shapes that disagree, or times that do not ascend.
    """

    images: UInt8Array
    time: FloatArray
    name: str = "frames"
    start: int | None = None

    def __post_init__(self) -> None:
        shape = np.shape(self.images)
        if len(shape) not in (3, 4) or shape[3:] not in ((), (3,)) or self.images.dtype != np.uint8:
            raise InputError(
                f"frames of shape {shape} and type {self.images.dtype}",
                where=self.name,
                fix="give (n, height, width) or (n, height, width, 3) of type uint8",
            )
        if (
            shape[0] < 2
            or np.shape(self.time) != shape[:1]
            or not bool((np.diff(self.time) > 0).all())
        ):
            raise InputError(
                f"{shape[0]} frames with times of shape {np.shape(self.time)}",
                where=self.name,
                fix="give two frames or more, each with its time, in order",
            )

    def __len__(self) -> int:
        return len(self.images)

    @property
    def rate(self) -> float:
        """Frames a second: the median, where it varies [Hz]."""
        return float(1 / np.median(np.diff(self.time)))

    @property
    def duration(self) -> float:
        """From the first frame to the last [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def width(self) -> int:
        """Of a frame [px]."""
        return self.images.shape[2]

    @property
    def height(self) -> int:
        """Of a frame [px]."""
        return self.images.shape[1]

    def frames(self, first: float, last: float) -> Iterator[tuple[float, UInt8Array]]:
        """Yields (time since the first frame [s], (height, width) gray) from `first` to `last` [s],
        in order."""
        seconds = self.time - self.time[0]
        for index in np.flatnonzero((seconds >= first) & (seconds <= last)).tolist():
            yield float(seconds[index]), gray(self.images[index])

    def findings(self) -> tuple[Finding, ...]:
        """Returns no findings: the frames are as they were given."""
        return ()

    def __repr__(self) -> str:
        colour = "gray" if self.images.ndim == 3 else "colour"
        return (
            f"Frames({self.name}: {len(self)} {colour} frames of {self.width} × {self.height} px, "
            f"{self.duration:.2f} s at {self.rate:.4g} Hz)"
        )

    def _repr_html_(self) -> str:
        from flagdata.pages.page_pictures import moving

        stride = math.ceil(len(self) / _SHOWN)
        picture = moving(self.images[::stride], rate=self.rate / stride, side=_SIDE)
        return html.table(repr(self), {}) + html.image(picture)


def gray(picture: UInt8Array) -> UInt8Array:
    """Computes (height, width) luma by Rec. 601, as everywhere in `flagdata.ingest`, of a gray or
    sRGB picture."""
    if picture.ndim == 2:
        return picture
    return (picture @ np.array([0.299, 0.587, 0.114]) + 0.5).astype(np.uint8)


def collect_frames(film: Film, *, first: float, last: float | None) -> Frames:
    """Collects the frames of a film from `first` to `last` [s] in an array.

    Raises:
        LimitError: more than `LARGEST` bytes.
        InputError: fewer than two frames.
    """
    images: list[UInt8Array] = []
    times: list[float] = []
    size = 0
    for time, image in film.frames(first, film.duration if last is None else last):
        size += image.nbytes
        if size > LARGEST:
            raise LimitError(
                f"the frames from {first:g} s on take more than {LARGEST >> 30} GiB",
                where=film.name,
                fix=f"give an end of {time:.1f} s or less",
            )
        images.append(image)
        times.append(time)
    if len(images) < 2:
        raise InputError(
            f"{len(images)} frames from {first:g} s on",
            where=film.name,
            fix=f"choose a part of its {film.duration:.2f} s",
        )
    start = None if film.start is None else film.start + round(times[0] * NANOSECONDS)
    return Frames(
        images=np.stack(images), time=np.array(times) - times[0], name=film.name, start=start
    )
