"""When camera and anemometer ran, in clock time: both with their gaps, where they overlap, and the
wind."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flagdata.answer.charts import Axis, Colour, Line, Panel, Shade
from flagdata.answer.clock_axis import clock_axis, seconds_of_day
from flagdata.core.arrays import FloatArray, IntArray
from flagdata.record.signals import WindAverage
from flagdata.timebase import NANOSECONDS

HEIGHTS = (0.9, 1.7)
"""Of the two panels [inch]."""
_GAP = 2.5  # times the usual step, beyond which something is missing
_FILM, _LOG = 1.0, 0.0


def session_panels(frames: IntArray, wind: WindAverage, *, clock: str) -> tuple[Panel, Panel]:
    """Shows the stretches of both, and below them the wind with the film's stretches behind it.

    Args:
        frames: (n,) instants of the film on the wind's clock [UTC ns], ascending.
        wind: the log.
        clock: whose clock that is, for the axis.
    """
    film = stretches(frames)
    log = stretches(wind.time)
    ends = [*film, *((low - round(wind.period * NANOSECONDS), high) for low, high in log)]
    start, end = min(low for low, _ in ends), max(high for _, high in ends)
    margin = max((end - start) // 50, NANOSECONDS)
    axis = clock_axis(start - margin, end + margin, name=clock)

    def seconds(instants: IntArray) -> FloatArray:
        return seconds_of_day(instants, start - margin)

    def runs(of: Sequence[tuple[int, int]], height: float, colour: Colour) -> Line:
        x = [value for pair in of for value in (*seconds(np.array(pair)), np.nan)]
        y = [value for _ in of for value in (height, height, np.nan)]
        return Line(x=x, y=y, colour=colour, width=7.0)

    time, speed = break_at_gaps(seconds(wind.time) - wind.period / 2, wind.speed, wind.period)
    shades = [
        Shade(
            x=(float(low), float(high)),
            colour=Colour.FILM,
            label="" if number else "the film runs",
        )
        for number, (low, high) in enumerate(seconds(np.array(film)))
    ]
    when = Panel(
        marks=[runs(film, _FILM, Colour.FILM), runs(log, _LOG, Colour.LOG)],
        title=_overlap(film, log),
        x=Axis(limits=axis.limits, ticks=axis.ticks, texts=[""] * len(axis.texts)),
        y=Axis(label="ran", limits=(-0.7, 1.7), ticks=[_FILM, _LOG], texts=["film", "log"]),
    )
    blowing = Panel(
        marks=[*shades, Line(x=time, y=speed, colour=Colour.LOG, width=1.0, label="wind speed")],
        x=axis,
        y=Axis(label="wind [m/s]", limits=(0, None)),
    )
    return when, blowing


def stretches(instants: IntArray) -> list[tuple[int, int]]:
    """Splits instants (n,) [UTC ns], ascending, where they are farther apart than usual; returns
    the first and last of each stretch."""
    if len(instants) < 2:
        return [(int(instants[0]), int(instants[0]))] if len(instants) else []
    steps = np.diff(instants)
    gaps = np.flatnonzero(steps > _GAP * np.median(steps))
    first = np.concatenate([[0], gaps + 1])
    last = np.concatenate([gaps, [len(instants) - 1]])
    return [(int(instants[i]), int(instants[j])) for i, j in zip(first, last, strict=True)]


def _overlap(film: Sequence[tuple[int, int]], log: Sequence[tuple[int, int]]) -> str:
    """Says how long both ran at the same time, and how many gaps they have."""
    both = sum(
        max(0, min(end, last) - max(start, first)) for start, end in film for first, last in log
    )
    seconds = both / NANOSECONDS
    length = f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.1f} min"
    gaps = [
        f"{name}: {len(of) - 1} {'gap' if len(of) == 2 else 'gaps'}"
        for name, of in (("film", film), ("log", log))
        if len(of) > 1
    ]
    return "; ".join([f"both ran for {length}" if both else "they never ran together", *gaps])


def break_at_gaps(
    time: FloatArray, values: FloatArray, period: float
) -> tuple[FloatArray, FloatArray]:
    """Returns the same line with NaN where bins of `period` [s] are missing, so that gaps show."""
    gaps = np.flatnonzero(np.diff(time) > 1.5 * period) + 1
    return np.insert(time, gaps, np.nan), np.insert(values, gaps, np.nan)
