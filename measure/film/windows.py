"""A film cut into windows of the network's length, once for each size of flag that is considered.

A window starts on a frame. Where no frame is near an instant of the network, its picture is
interpolated between the two frames about it (`models.conditioning.frame_interpolation`); frames
that repeat the one before are left out first. A window in which frames are missing is left out.
Where a film's coding left no noise, some is given back (`models.conditioning.grain`).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import UInt8Array
from flagdata.core.findings import Finding
from flagdata.errors import InputError, UsageError
from flagdata.ingest.films.film import Film
from measure.film.conditioned_film import ConditionedFilm
from measure.film.similarity import spacing
from models.conditioning.frame_interpolation import Interpolator, TimedFrame, at_instants
from models.conditioning.grain import add_grain
from models.conditioning.repeats import Distinct
from models.trained.estimator import Estimator

_BEYOND = 0.05
"""Share of the time between two frames by which an instant may lie beyond the film's last: stamps
are rounded to milliseconds."""
_FEWEST = 0.8
"""Share of the network's frames that a window must have of its own, so that most of its pictures
were taken. Lower lets interpolated pictures make up most of a window; higher drops windows with a
few lost frames."""
_LONGEST = 1.75
"""Longest time between two frames that is interpolated, in periods of the film or of the network's
frames at the largest size considered, whichever is longer: a repeated frame at 30 Hz, but none that
is missing at 25 Hz."""


@dataclass(frozen=True, kw_only=True)
class WindowLayout:
    """Where windows lie.

    Attributes:
        frames: of a window.
        spacings: (i,) time between their frames, one for each size of flag [s].
        step: from one window's start to the next [s].
        period: of the film [s].
        first, last: the part of the film that is used [s from its first frame].
    """

    frames: int
    spacings: tuple[float, ...]
    step: float
    period: float
    first: float
    last: float

    @property
    def length(self) -> float:
        """Time from the first to the last frame of the longest window [s]."""
        return (self.frames - 1) * max(self.spacings)

    @property
    def count(self) -> int:
        """How many windows there are."""
        return (
            int(
                np.floor(
                    (self.last - self.first - self.length + 0.5 * self.period) / self.step + 1e-9
                )
            )
            + 1
        )

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
        interpolated: pictures between two frames, of all clips.
    """

    index: int
    start: float
    clips: UInt8Array
    interpolated: int


def lay_out(
    *,
    frames: int,
    spacings: tuple[float, ...],
    rate: float,
    duration: float,
    step: float | None,
    first: float | None = None,
    last: float | None = None,
) -> WindowLayout:
    """Windows that follow each other, or start every `step` [s].

    Args:
        rate: of the film [Hz].
        duration: of the film [s].
        step: by default the length of the longest window, so that none overlap.
        first, last: the part of the film to use [s]; by default all.

    Raises:
        UsageError: a part that the film does not have, or a step that is not above 0, shorter than
            the time between two frames or longer than the part.
        InputError: the film is shorter than one window.
    """
    begin, end = first if first is not None else 0.0, last if last is not None else duration
    if not 0 <= begin < end or begin >= duration:
        raise UsageError(
            f"the part from {begin:g} s to {end:g} s is not in the film, which lasts "
            f"{duration:.2f} s",
            where="--start, --end",
            fix="give a part that it has",
        )
    if step is not None and not step > 0:
        raise UsageError(
            f"the time between windows is {step:g} s",
            where="--windows",
            fix="give a time above 0, as in 1.2s",
        )
    if step is not None and step * rate < 1 - 1e-6:
        raise UsageError(
            f"the time between windows is {step:g} s, and that between the film's frames "
            f"{1 / rate:.3g} s",
            where="--windows",
            fix=f"give {1 / rate:.3g} s or more, so that each window begins on a frame of its own",
        )
    if step is not None and step > min(end, duration) - begin:
        raise UsageError(
            f"the time between windows is {step:g} s, and {min(end, duration) - begin:.2f} s of "
            "film are used",
            where="--windows",
            fix="give less than that, as in 1.2s; without it windows follow each other",
        )
    longest = frames * max(spacings)
    layout = WindowLayout(
        frames=frames,
        spacings=spacings,
        step=step if step is not None else longest,
        period=1 / rate,
        first=begin,
        last=min(end, duration),
    )
    if layout.count < 1:
        raise InputError(
            f"{layout.last - layout.first:.2f} s of film, a measurement takes {layout.length:.2f} "
            "s",
            where="length of the film",
            fix=f"give at least {layout.length:.2f} s, {frames} frames at {1 / max(spacings):.3g} "
            "Hz; "
            "if the film lasts longer, check the rate that was given",
        )
    return layout


class WindowReader:
    """Reads a film once, window by window, for a network.

    Attributes:
        layout: of the windows.
        distinct: the frames, with how many were read and how many repeat the one before.
        lacks: start of a window that was left out [s] → what it lacks.
        look: called with each frame and its time before the windows are cut, where someone else
            looks as well.
    """

    def __init__(
        self,
        film: Film,
        model: Estimator,
        scales: Sequence[float],
        *,
        step: float | None = None,
        first: float | None = None,
        last: float | None = None,
    ) -> None:
        """Lays the windows out.

        Args:
            scales: of the sizes of flag that are considered.
            step, first, last: see `lay_out`, which also says what is raised.
        """
        rate = model.front_end.rate
        self.layout = lay_out(
            frames=model.front_end.frames,
            spacings=tuple(spacing(scale, rate=rate) for scale in scales),
            rate=film.rate,
            duration=film.duration,
            step=step,
            first=first,
            last=last,
        )
        if isinstance(film, ConditionedFilm):
            film.piece = (
                self.layout.length + self.layout.step
            )  # wherever it begins, a window lies in it
        self.lacks: dict[float, str] = {}
        self.look: Callable[[float, UInt8Array], object] | None = None
        margin = 2 * self.layout.period
        self.distinct = Distinct(
            self._shown(film.frames(self.layout.first - margin, self.layout.last + margin))
        )

    def windows(self, advance: Callable[[int, int], None] | None = None) -> Iterator[Window]:
        """Yields the windows, in order; one in which frames are missing is left out.

        Args:
            advance: called after each window with how many there are and 1.
        """
        for window in cut(self.distinct, self.layout, lacks=self.lacks):
            yield window
            if advance is not None:
                advance(self.layout.count, 1)

    def _shown(self, frames: Iterable[TimedFrame]) -> Iterator[TimedFrame]:
        for time, frame in frames:
            if self.look is not None:
                self.look(time, frame)
            yield time, frame


def cut(
    frames: Iterable[TimedFrame], layout: WindowLayout, *, lacks: dict[float, str] | None = None
) -> Iterator[Window]:
    """Cuts out the windows of a film, in order; one in which frames are missing is left out.

    Args:
        frames: (time from the film's first frame [s], picture), in order; at most a window of them
            is held.
        lacks: takes start → what it lacks of each window that is left out.
    """
    buffer: deque[TimedFrame] = deque()
    source, interpolator = iter(frames), Interpolator()
    margin = 2 * layout.period
    ended = False
    for index in range(layout.count):
        start = layout.start(index)
        while len(buffer) > 1 and buffer[1][0] < start - margin:
            buffer.popleft()
        while not ended and (not buffer or buffer[-1][0] < start + layout.length + margin):
            following = next(source, None)
            if following is None:
                ended = True
            else:
                buffer.append(following)
        window = _window(buffer, layout, index, interpolator)
        if isinstance(window, Window):
            yield window
        elif lacks is not None:
            lacks[start] = window


def _window(
    buffer: deque[TimedFrame], layout: WindowLayout, index: int, interpolator: Interpolator
) -> Window | str:
    """Returns a window, or what it lacks."""
    if len(buffer) < 2:
        return "there are no frames"
    times = np.array([time for time, _ in buffer])
    start = float(times[np.abs(times - layout.start(index)).argmin()])
    if abs(start - layout.start(index)) > _LONGEST * layout.period:
        return "there is no frame at its start"
    allowed = _LONGEST * max(*layout.spacings, layout.period)
    clips, interpolated = [], 0
    for interval in layout.spacings:
        instants = start + interval * np.arange(layout.frames)
        before = np.searchsorted(times, instants, side="right").clip(1, len(times) - 1) - 1
        gaps = times[before + 1] - times[before]
        fractions = (instants - times[before]) / gaps
        if fractions.max() > 1 + _BEYOND:
            return "the frames end before it does"
        if gaps.max() > allowed:
            return (
                f"{gaps.max() * 1e3:.0f} ms lie between two pictures, and at most "
                f"{allowed * 1e3:.0f} ms can be "
                "interpolated"
            )
        within = np.count_nonzero((times >= start - 1e-6) & (times < instants[-1]))
        if within < _FEWEST * (layout.frames - 1):
            return (
                f"{within} pictures were taken in it, of {layout.frames - 1} at least "
                f"{_FEWEST:.0%} must be"
            )
        clip, between = at_instants(
            buffer, instants, period=layout.period, interpolator=interpolator
        )
        clips.append(add_grain(clip, seed=index))
        interpolated += between
    return Window(index=index, start=start, clips=np.stack(clips), interpolated=interpolated)


def findings_of(
    layout: WindowLayout, *, windows_read: int, interpolated: int, frames: int, repeated: int
) -> tuple[Finding, ...]:
    """Reports what the cutting left out or made between frames.

    Args:
        windows_read: windows that were whole.
        interpolated: pictures between two frames, of all windows and sizes.
        frames: of the film that were read.
        repeated: of these, that repeat the one before.
    """
    frames_made = windows_read * layout.frames * len(layout.spacings)
    notes = [
        Finding.of(
            "resampled",
            f"windows of {layout.frames} frames, "
            + " or ".join(f"{spacing * 1e3:.1f}" for spacing in layout.spacings)
            + f" ms apart, out of a film of {1 / layout.period:.4g} frames a second; "
            f"{interpolated} of {frames_made} "
            "lie "
            "between two frames and were interpolated by the motion of the picture",
            value=interpolated / max(frames_made, 1),
            count=interpolated,
        )
    ]
    if windows_read < layout.count:
        notes.append(
            Finding.of(
                "windows-left-out",
                f"{layout.count - windows_read} of {layout.count} windows lack frames and were "
                "left out",
                count=layout.count - windows_read,
            )
        )
    if repeated:
        notes.append(
            Finding.of(
                "frames-repeated",
                f"{repeated} of {frames} frames ({repeated / frames:.0%}) repeat the one before "
                "and were left "
                f"out: {(1 - repeated / frames) / layout.period:.3g} different pictures a second "
                "are left",
                count=repeated,
                value=repeated / frames,
            )
        )
    return tuple(notes)
