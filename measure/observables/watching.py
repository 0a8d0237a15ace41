"""A film that is read as windows, each with the cloth's masks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.errors import RefusedError
from measure.film.conditioned_film import ConditionedFilm
from measure.film.similarity import FlagSize
from measure.observables.film_window import FilmWindow
from measure.observables.observable import WINDOW
from models.conditioning.outline import Outliner
from models.conditioning.stills import halve_picture

CHUNK = 30.0
"""Length of film [s] that one still picture is of: light and shade change over longer ones."""
_EXPECTED = 0.9
"""Least coefficient of Dice with the true silhouette that is expected of a mask. Higher keeps fewer
masks, and better ones."""
_STEADY = 0.4
"""Share by which a mask's area may differ from the window's median: a flag does not change as much
in a window. Lower drops frames in which the flag folds away from the camera; higher keeps masks
that lost a part."""
_LEAST_HOIST = 5.0
"""Length of the hoist in the picture [px] below which nothing is read."""
_FEWEST = 10
"""Frames of a window below which nothing is read."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Watched:
    """Windows of a film.

    Attributes:
        starts: (w,) of the windows [s from the film's first frame].
        windows: (w,) each; None where the hoist or the cloth was not found.
        seconds: length of a window.
    """

    starts: FloatArray
    windows: tuple[FilmWindow | None, ...]
    seconds: float


def count_of(
    film: ConditionedFilm,
    *,
    first: float | None = None,
    last: float | None = None,
    seconds: float = WINDOW,
) -> int:
    """Counts the complete windows of a part of a film; the parameters as for `watch_film`.

    Raises:
        RefusedError: the film has no whole window.
    """
    begin, end = first or 0.0, min(film.duration, math.inf if last is None else last)
    count = int((end - begin + 1 / film.rate) / seconds + 1e-6)
    if count < 1:
        raise RefusedError(
            f"{end - begin:.1f} s of film have no window of {seconds:g} s",
            where=film.name,
            fix="give a longer part of the film",
        )
    return count


def watch_film(
    film: ConditionedFilm,
    size: FlagSize,
    *,
    first: float | None = None,
    last: float | None = None,
    seconds: float = WINDOW,
    advance: Callable[[int], object] | None = None,
) -> Watched:
    """Reads the windows of a film, one after another.

    Args:
        size: of the flag, whose height gives the scale.
        first, last: part of the film [s].
        advance: called with the number of windows that were read.

    Raises:
        RefusedError: the film has no whole window, or no moving cloth.
    """
    begin, count = first or 0.0, count_of(film, first=first, last=last, seconds=seconds)
    windows: list[FilmWindow | None] = []

    def keep(chunk: Sequence[FilmWindow | None]) -> None:
        windows.extend(chunk)
        if advance is not None:
            advance(len(chunk))

    watcher = Watcher(film, size, begin=begin, count=count, seconds=seconds, deliver=keep)
    for time, frame in film.frames(begin, begin + count * seconds):
        watcher.look(time, frame)
    watcher.finish()
    starts = np.array([begin + seconds * k for k in range(count)])
    return Watched(starts=starts, windows=tuple(windows), seconds=seconds)


class Watcher:
    """Makes windows of frames that it is shown one after another, and holds no more than a still
    picture is of.

    Args:
        film: that the frames are read from.
        size: of the flag.
        begin: of the first window [s].
        count: of windows.
        seconds: length of a window.
        found: called with the windows of each still picture, in order.
    """

    def __init__(
        self,
        film: ConditionedFilm,
        size: FlagSize,
        *,
        begin: float,
        count: int,
        seconds: float,
        deliver: Callable[[Sequence[FilmWindow | None]], object],
    ) -> None:
        self._film, self._size, self._found = film, size, deliver
        self._begin, self._count, self._seconds = begin, count, seconds
        self._a_chunk = max(1, round(CHUNK / seconds))
        self._done = 0
        self._held: list[tuple[float, UInt8Array]] = []

    def look(self, time: float, frame: UInt8Array) -> None:
        """Take the next frame, conditioned, and its time [s]; frames before the first window are
        left out."""
        if time < self._begin:
            return
        self._held.append((time, frame))
        if time >= self._begin + (self._done + self._a_chunk) * self._seconds:
            self._read(self._held[:-1], self._a_chunk)
            self._held = self._held[-1:]

    def finish(self) -> None:
        """Make what is left of the windows.

        Raises:
            RefusedError: nothing moves like cloth.
        """
        self._read(self._held, self._count - self._done)
        self._held = []
        if self._film.found is None or self._film.found.region is None:
            raise RefusedError(
                "no motion like cloth's was found in the film",
                where=self._film.name,
                fix="give another film, or --crop around the flag",
            )

    def _read(self, frames: Sequence[tuple[float, UInt8Array]], count: int) -> None:
        count = min(count, self._count - self._done)
        if count > 0:
            begin = self._begin + self._done * self._seconds
            self._done += count
            self._found(_chunk(self._film, frames, begin, count, self._seconds, self._size))


def _chunk(
    film: ConditionedFilm,
    timed_frames: Sequence[tuple[float, UInt8Array]],
    begin: float,
    count: int,
    seconds: float,
    size: FlagSize,
) -> list[FilmWindow | None]:
    """Outlines the windows of one chunk of the film, from its still picture."""
    nothing: list[FilmWindow | None] = [None] * count
    if film.found is None or not timed_frames:
        return nothing
    frames = np.stack([halve_picture(frame) for _, frame in timed_frames])
    outliner = Outliner.of(frames)
    if outliner is None or outliner.hoist[1, 1] - outliner.hoist[0, 1] < _LEAST_HOIST:
        return nothing
    times = np.array([time for time, _ in timed_frames])
    cloth, expected = outliner.masks(frames)
    hoist = outliner.hoist
    windows: list[FilmWindow | None] = []
    for k in range(count):
        inside = (times >= begin + k * seconds - 1e-6) & (times < begin + (k + 1) * seconds - 1e-6)
        if inside.sum() < _FEWEST:
            windows.append(None)
            continue
        area = cloth[inside].sum(axis=(1, 2))
        usual = np.abs(area - np.median(area)) <= _STEADY * np.median(area)
        windows.append(
            FilmWindow(
                times=times[inside],
                frames=frames[inside],
                masks=cloth[inside],
                shown=(expected[inside] >= _EXPECTED) & usual,
                scale=float(hoist[1, 1] - hoist[0, 1]) / size.height,
                hoist=hoist,
                side=outliner.side,
                length=size.length,
                height=size.height,
            )
        )
    return windows
