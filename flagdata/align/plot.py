"""A picture of an estimated alignment: when film and log ran, motion and wind on one clock, and the
search that found it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from flagdata.align.bins import normal_scores
from flagdata.align.drift import ClockLine
from flagdata.align.lag import LagEstimate
from flagdata.align.methods import Evidence
from flagdata.align.session_chart import HEIGHTS, break_at_gaps, session_panels
from flagdata.answer.charts import Across, Axis, Chart, Colour, Dots, Line, Mark, Panel, Shade
from flagdata.core.clock_model import NINETY
from flagdata.core.files.outputs import check_file, write_file
from flagdata.record.signals import Series
from flagdata.timebase import NANOSECONDS, iso

_COMMAND = "align"
_MARGIN = 30.0  # s of wind shown either side of the film


def check(path: Path) -> None:
    """Refuse a picture that cannot be drawn or written, before anything is searched for it.

    Raises:
        InputError: a suffix of no format that is drawn, or no folder to write into.
        ConflictError: another file is there.
    """
    from flagdata.pages.chart_drawing import check_format

    check_format(path)
    check_file(path, command=_COMMAND)


def draw(evidence: Evidence, path: Path, *, title: str) -> None:
    """Write the picture; its format is that of the file's suffix (.png, .svg, .pdf).

    Raises:
        InputError, ConflictError: as `check`.
        FlagdataError: the disk refuses it.
    """
    from flagdata.pages.chart_drawing import encode

    check(path)
    write_file(path, encode(chart(evidence, title=title), path), command=_COMMAND)


def chart(evidence: Evidence, *, title: str) -> Chart:
    """Shows an alignment, from the top down: when film and log ran; motion energy, in bins like the
    wind's and shifted by the estimate, and the wind, both as normal scores; the evidence at every
    offset tried, with the band that unrelated winds seldom leave, and the score around the peak
    with its 90 % interval; where the drift was measured, the offsets of the parts with their 90 %
    intervals, and the line through them."""
    verdict = "refused: " + "; ".join(evidence.reasons) if evidence.reasons else "accepted"
    when, blowing = session_panels(
        evidence.motion.time + round(_shift(evidence) * NANOSECONDS),
        evidence.wind,
        clock="the log's clock",
    )
    rows = [
        [when],
        [blowing],
        [_series(evidence)],
        [_search(evidence.estimate), _peak(evidence.estimate)],
    ]
    heights = [*HEIGHTS, 3.2, 3.2]
    if evidence.line is not None and evidence.line.parts:
        rows.append([_parts(evidence.line)])
        heights.append(2.4)
    return Chart(rows=rows, heights=heights, widths=(2, 1), width=10, title=f"{title}: {verdict}")


def _shift(evidence: Evidence) -> float:
    """Computes what brings the motion's instants onto the wind [s]; 0 where nothing was found."""
    offset = evidence.estimate.offset
    return offset - evidence.response if math.isfinite(offset) else 0.0


def _series(evidence: Evidence) -> Panel:
    wind, motion = evidence.wind, evidence.motion
    origin = int(wind.time[0]) // NANOSECONDS * NANOSECONDS
    wind_time = (wind.time - origin) / NANOSECONDS - wind.period / 2
    middles, energy = _bin_values(
        (motion.time - origin) / NANOSECONDS + _shift(evidence), motion.energy, wind.period
    )
    marks: list[Mark] = []
    if len(middles):
        in_view = (wind_time >= middles[0] - _MARGIN) & (wind_time <= middles[-1] + _MARGIN)
        x, y = break_at_gaps(wind_time[in_view], normal_scores(wind.speed[in_view]), wind.period)
        marks = [
            Line(x=x, y=y, colour=Colour.LOG, width=1.1, label="wind speed"),
            Line(
                x=middles,
                y=normal_scores(energy),
                colour=Colour.FILM,
                width=1.1,
                label="motion of the flag",
            ),
        ]
    return Panel(
        marks=marks,
        x=Axis(label=f"time on the log's clock [s since {iso(origin)}]"),
        y=Axis(label="normal score"),
    )


def _search(estimate: LagEstimate) -> Panel:
    curve = estimate.curve
    chance: list[Mark] = []
    if math.isfinite(curve.chance_score):
        chance = [
            Shade(y=(-curve.chance_score, curve.chance_score), opacity=0.12),
            Across(y=curve.chance_score, dashed=True),
        ]
    return _curve(
        estimate,
        curve.evidence,
        label="evidence z",
        title="all offsets tried; unrelated winds stay within the gray",
        below=chance,
    )


def _peak(estimate: LagEstimate) -> Panel:
    title, limits = "", (None, None)
    if math.isfinite(estimate.offset):
        half = max(10.0, 6 * min(estimate.sigma, 5.0))
        low, high = estimate.interval
        limits = (estimate.offset - half, estimate.offset + half)
        title = f"{estimate.offset:+.2f} s [{low:.2f}, {high:.2f}] 90 %"
    return _curve(estimate, estimate.curve.score, label="score z", title=title, limits=limits)


def _curve(
    estimate: LagEstimate,
    values: Series,
    *,
    label: str,
    title: str,
    below: list[Mark] | None = None,
    limits: tuple[float | None, float | None] = (None, None),
) -> Panel:
    name = "offset added to the camera's clock [s]"
    if not np.any(np.isfinite(values)):
        nothing = Axis(label=name, ticks=())
        return Panel(
            marks=(), title="nothing was searched", x=nothing, y=Axis(label=label, ticks=())
        )
    marks = [*(below or ()), Line(x=estimate.curve.offset, y=values, colour=Colour.INK, width=1.0)]
    if math.isfinite(estimate.offset):
        if all(map(math.isfinite, estimate.interval)):
            marks.append(Shade(x=estimate.interval, colour=Colour.FILM, opacity=0.25))
        marks.append(Across(x=estimate.offset, colour=Colour.FILM, width=1.0))
    return Panel(marks=marks, title=title, x=Axis(label=name, limits=limits), y=Axis(label=label))


def _parts(line: ClockLine) -> Panel:
    at = np.array([(part.at - line.origin) / NANOSECONDS / 60 for part in line.parts])
    offset = np.array([part.offset for part in line.parts])
    half = np.array([NINETY * part.sigma_statistical for part in line.parts])
    ends = np.array([at.min(), at.max()])
    through = line.offset + line.drift * 60 * ends
    return Panel(
        marks=[
            Dots(x=at, y=offset, low=offset - half, high=offset + half, colour=Colour.FILM),
            Line(x=ends, y=through, colour=Colour.INK, width=1.0),
        ],
        title=f"drift {1e6 * line.drift:+.0f} ± {1e6 * line.sigma_drift:.0f} ppm",
        x=Axis(label=f"time on the camera's clock [min from {iso(line.origin)[:19]}Z]"),
        y=Axis(label="offset [s]"),
    )


def _bin_values(time: Series, values: Series, period: float) -> tuple[Series, Series]:
    """Middles [s] and means of bins of `period` [s]; bins without a value are left out."""
    finite = np.isfinite(values)
    index = np.floor(time[finite] / period).astype(np.int64)
    first = int(index.min()) if len(index) else 0
    count = np.bincount(index - first)
    total = np.bincount(index - first, weights=values[finite])
    filled = np.flatnonzero(count)
    return np.asarray((filled + first + 0.5) * period, dtype=np.float64), total[filled] / count[
        filled
    ]
