"""A film that is read as windows, each with the cloth's masks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import RefusedError
from measure.estimate.conditioned import ConditionedFilm
from measure.estimate.similarity import FlagSize
from measure.observables.film import FilmWindow
from measure.observables.observable import WINDOW
from models.conditioning.outline import SAMPLE, Outliner, halved

CHUNK = 30.0
"""Length of film [s] that one still picture is of: light and shade change over longer ones."""
_CLEAR = 0.7
"""Share of a mask's free outline that has to be clear."""
_STEADY = 0.4
"""Share by which a mask's area may differ from the window's median: a flag does not change as much in a window."""
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

    starts: NDArray[np.float64]
    windows: tuple[FilmWindow | None, ...]
    seconds: float


def watched(
    film: ConditionedFilm, size: FlagSize, *, first: float | None = None, last: float | None = None,
    seconds: float = WINDOW, advance: Callable[[int], object] | None = None,
) -> Watched:  # fmt: skip
    """The windows of a film, one after another.

    Args:
        size: of the flag, whose height gives the scale.
        first, last: part of the film [s].
        advance: called with the number of windows that were read.

    Raises:
        RefusedError: the film has no whole window, or no moving cloth.
    """
    begin, end = first or 0.0, min(film.duration, math.inf if last is None else last)
    count = int((end - begin + 1 / film.rate) / seconds + 1e-6)
    if count < 1:
        raise RefusedError(
            f"{end - begin:.1f} s of film have no window of {seconds:g} s", where=film.name,
            fix="give a longer part of the film",
        )  # fmt: skip
    a_chunk = max(1, round(CHUNK / seconds))
    windows: list[FilmWindow | None] = []

    def read(own: Sequence[tuple[float, NDArray[np.uint8]]], some: int) -> None:
        windows.extend(_chunk(film, own, begin + len(windows) * seconds, some, seconds, size))
        if advance is not None:
            advance(some)

    held: list[tuple[float, NDArray[np.uint8]]] = []
    for time, frame in film.frames(begin, begin + count * seconds):
        held.append((time, frame))
        if time >= begin + (len(windows) + a_chunk) * seconds:
            read(held[:-1], a_chunk)
            held = held[-1:]
    if len(windows) < count:
        read(held, count - len(windows))
    if film.found is None or film.found.region is None:
        raise RefusedError(
            "nothing moves like cloth in the film", where=film.name, fix="give another film, or --crop around the flag"
        )
    starts = np.array([begin + seconds * k for k in range(count)])
    return Watched(starts=starts, windows=tuple(windows), seconds=seconds)


def _chunk(
    film: ConditionedFilm, held: Sequence[tuple[float, NDArray[np.uint8]]], begin: float, count: int, seconds: float,
    size: FlagSize,
) -> list[FilmWindow | None]:  # fmt: skip
    """The windows of one still picture."""
    nothing: list[FilmWindow | None] = [None] * count
    if film.found is None or not held:
        return nothing
    outliner = Outliner.of([frame for _, frame in held[:: -(-len(held) // SAMPLE)]], film.found)
    if outliner is None:
        return nothing
    times = np.array([time for time, _ in held])
    frames = np.stack([np.rint(halved(frame)).astype(np.uint8) for _, frame in held])
    masks, clear = zip(*(outliner.mask(frame) for _, frame in held), strict=True)
    cloth, clear = np.stack(masks), np.array(clear)
    hoist = outliner.ends(cloth[clear >= _CLEAR]) if (clear >= _CLEAR).any() else None
    if hoist is None or hoist[1, 1] - hoist[0, 1] < 5:
        return nothing
    found: list[FilmWindow | None] = []
    for k in range(count):
        own = (times >= begin + k * seconds - 1e-6) & (times < begin + (k + 1) * seconds - 1e-6)
        if own.sum() < _FEWEST:
            found.append(None)
            continue
        area = cloth[own].sum(axis=(1, 2))
        usual = np.abs(area - np.median(area)) <= _STEADY * np.median(area)
        found.append(
            FilmWindow(
                times=times[own], frames=frames[own], masks=cloth[own], shown=(clear[own] >= _CLEAR) & usual,
                scale=float(hoist[1, 1] - hoist[0, 1]) / size.height, hoist=hoist,
                side=1.0 if outliner.hoist == "left" else -1.0, length=size.length, height=size.height,
            )
        )  # fmt: skip
    return found
