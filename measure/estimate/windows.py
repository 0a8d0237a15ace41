"""A film cut into windows of the network's length, once for each size of flag that is considered.

The frame of an instant is the nearest in time, which at an even rate is at most half a native period away: a frame
stays one exposure, and what the camera did not see is not made up. Uneven stamps may lie half of that further away; a
frame that is missing leaves its window out.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError, UsageError
from flagdata.findings import Finding, Severity

_REACH = 0.75
"""Share of a native period: half, and half of that for uneven stamps. A missing frame is a whole period away."""


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Where windows lie.

    Attributes:
        frames: of a window.
        spacings: (i,) time between their frames, one for each size of flag [s].
        step: from one window's start to the next [s].
        tolerance: how far a frame may be from its instant [s].
        first, last: the part of the film that is used [s from its first frame].
    """

    frames: int
    spacings: tuple[float, ...]
    step: float
    tolerance: float
    first: float
    last: float

    @property
    def length(self) -> float:
        """Time from the first to the last frame of the longest window [s]."""
        return (self.frames - 1) * max(self.spacings)

    @property
    def count(self) -> int:
        """How many windows there are."""
        return int(np.floor((self.last - self.first - self.length + self.tolerance) / self.step + 1e-9)) + 1

    def start(self, index: int) -> float:
        """Start of window `index` [s from the film's first frame]."""
        return self.first + index * self.step


@dataclass(frozen=True, kw_only=True, eq=False)
class Window:
    """Frames of one window.

    Attributes:
        index: its number.
        start: of its first frame [s from the film's first].
        clips: (i, frames, height, width) gray, one for each size of flag.
        worst: farthest frame from its instant [s].
        repeats: frames that show the same source frame as the one before, of all clips.
    """

    index: int
    start: float
    clips: NDArray[np.uint8]
    worst: float
    repeats: int


def lay_out(
    *, frames: int, spacings: tuple[float, ...], rate: float, duration: float, step: float | None,
    first: float | None = None, last: float | None = None,
) -> Layout:  # fmt: skip
    """Windows that follow each other, or start every `step` [s].

    Args:
        rate: of the film [Hz].
        duration: of the film [s].
        step: by default the length of the longest window, so that none overlap.
        first, last: the part of the film to use [s]; by default all.

    Raises:
        UsageError: a part that the film does not have, or a step that is not above 0.
        InputError: the film is shorter than one window.
    """
    begin, end = first if first is not None else 0.0, last if last is not None else duration
    if not 0 <= begin < end or begin >= duration:
        raise UsageError(
            f"from {begin:g} s to {end:g} s of a film of {duration:.2f} s", where="--start, --end",
            fix="give a part that it has",
        )  # fmt: skip
    if step is not None and not step > 0:
        raise UsageError(f"a window every {step:g} s", where="--windows", fix="give a time above 0, as in 1.2s")
    longest = frames * max(spacings)
    layout = Layout(
        frames=frames, spacings=spacings, step=step if step is not None else longest, tolerance=_REACH / rate,
        first=begin, last=min(end, duration),
    )  # fmt: skip
    if layout.count < 1:
        raise InputError(
            f"{layout.last - layout.first:.2f} s of film, a measurement takes {layout.length:.2f} s",
            where="length", fix=f"give at least {layout.length:.2f} s, {frames} frames at {1 / max(spacings):.3g} Hz",
        )  # fmt: skip
    return layout


def cut(frames: Iterable[tuple[float, NDArray[np.uint8]]], layout: Layout) -> Iterator[Window]:
    """The windows of a film, in order; one that lacks a frame within the tolerance is left out.

    Args:
        frames: (time from the film's first frame [s], picture), in order; at most a window of them is held.
    """
    held: deque[tuple[float, NDArray[np.uint8]]] = deque()
    source = iter(frames)
    ended = False
    for index in range(layout.count):
        start = layout.start(index)
        while held and held[0][0] < start - layout.tolerance:
            held.popleft()
        while not ended and (not held or held[-1][0] < start + layout.length + layout.tolerance):
            following = next(source, None)
            if following is None:
                ended = True
            elif following[0] >= start - layout.tolerance:
                held.append(following)
        window = _window(held, layout, index)
        if window is not None:
            yield window


def _window(held: deque[tuple[float, NDArray[np.uint8]]], layout: Layout, index: int) -> Window | None:
    if not held:
        return None
    times = np.array([time for time, _ in held])
    start = layout.start(index)
    chosen = []
    worst, repeats = 0.0, 0
    for spacing in layout.spacings:
        instants = start + spacing * np.arange(layout.frames)
        after = np.searchsorted(times, instants).clip(1, max(len(times) - 1, 1))
        before = after - 1
        after = np.minimum(after, len(times) - 1)
        nearest = np.where(instants - times[before] <= times[after] - instants, before, after)
        away = float(np.abs(times[nearest] - instants).max())
        if away > layout.tolerance:
            return None
        worst = max(worst, away)
        repeats += int(np.count_nonzero(np.diff(nearest) == 0))
        chosen.append(nearest)
    clips = np.stack([np.stack([held[int(place)][1] for place in places]) for places in chosen])
    return Window(index=index, start=start, clips=clips, worst=worst, repeats=repeats)


def findings_of(layout: Layout, *, found: int, worst: float, repeats: int, rate: float) -> tuple[Finding, ...]:
    """What the cutting left out or had to show twice.

    Args:
        found: windows that were whole.
        worst: farthest frame from its instant [s].
        repeats: frames that were shown twice, of all windows and sizes.
        rate: of the film [Hz].
    """
    notes = [
        Finding(
            kind="resampled", severity=Severity.NOTE, value=worst,
            what=f"windows of {layout.frames} frames, "
            + " or ".join(f"{spacing * 1e3:.1f}" for spacing in layout.spacings)
            + f" ms apart, out of a film of {rate:.4g} frames a second; a frame is at most {worst * 1e3:.1f} ms from "
            "its instant",
        )
    ]  # fmt: skip
    if found < layout.count:
        notes.append(
            Finding(
                kind="windows-left-out", severity=Severity.WARNING, count=layout.count - found,
                what=f"{layout.count - found} of {layout.count} windows lack frames and were left out",
            )
        )  # fmt: skip
    if repeats:
        notes.append(
            Finding(
                kind="frames-repeated", severity=Severity.NOTE, count=repeats,
                what=f"{repeats} frames of the windows show the same picture as the one before: the film is a little "
                "slower than the network's frames",
            )
        )  # fmt: skip
    return tuple(notes)
