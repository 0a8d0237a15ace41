"""A picture of an estimated alignment: motion and wind on one clock, and the search that found
it."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flagdata.align.bins import normal_scores
from flagdata.align.drift import ClockLine
from flagdata.align.lag import LagEstimate
from flagdata.align.methods import Evidence
from flagdata.core.clock_model import NINETY
from flagdata.core.files.outputs import check_file, write_file
from flagdata.errors import InputError
from flagdata.record.signals import Series
from flagdata.timebase import NANOSECONDS, iso

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COMMAND = "align"
_MARGIN = 30.0  # s of wind shown either side of the film
_MOTION, _WIND, _MARK = "#b5541c", "#1f5f8b", "#444444"


def check(path: Path) -> None:
    """Refuse a picture that cannot be drawn or written, before anything is searched for it.

    Raises:
        InputError: a suffix of no format that is drawn, or no folder to write into.
        ConflictError: another file is there.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    formats = FigureCanvasAgg.get_supported_filetypes()
    if path.suffix.lower().removeprefix(".") not in formats:
        raise InputError(
            f"no picture of format {path.suffix or path.name!r} is drawn",
            where=str(path),
            fix="name a .png file",
        )
    check_file(path, command=_COMMAND)


def draw(evidence: Evidence, path: Path, *, title: str) -> None:
    """Write the picture; its format is that of the file's suffix (.png, .svg, .pdf).

    Above: motion energy, in bins like the wind's and shifted by the estimate, and the wind, both as
    normal scores.
    Below left: the evidence at every offset tried, and the band that unrelated winds seldom leave.
    Below right: the score around the peak, and the 90 % interval. At the bottom, where the drift
    was measured: the offsets of the parts with their 90 % intervals, and the line through them.

    Raises:
        InputError, ConflictError: as `check`.
        FlagdataError: the disk refuses it.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    check(path)
    line = evidence.line if evidence.line is not None and evidence.line.parts else None
    figure = Figure(figsize=(10, 6.4 if line is None else 8.8), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2 if line is None else 3, 2, width_ratios=(2, 1))
    verdict = "refused: " + "; ".join(evidence.reasons) if evidence.reasons else "accepted"
    figure.suptitle(f"{title}: {verdict}", x=0.01, ha="left", fontsize=10, wrap=True)
    _draw_series(figure.add_subplot(grid[0, :]), evidence)
    _draw_search(figure.add_subplot(grid[1, 0]), evidence.estimate)
    _draw_peak(figure.add_subplot(grid[1, 1]), evidence.estimate)
    if line is not None:
        _draw_parts(figure.add_subplot(grid[2, :]), line)
    picture = io.BytesIO()
    figure.savefig(picture, dpi=120, format=path.suffix.lower().removeprefix("."))
    write_file(path, picture.getvalue(), command=_COMMAND)


def _draw_series(axes: Axes, evidence: Evidence) -> None:
    wind, motion, offset = evidence.wind, evidence.motion, evidence.estimate.offset
    origin = int(wind.time[0]) // NANOSECONDS * NANOSECONDS
    wind_time = (wind.time - origin) / NANOSECONDS - wind.period / 2
    shift = offset - evidence.response if math.isfinite(offset) else 0.0
    middles, energy = _bin_values(
        (motion.time - origin) / NANOSECONDS + shift, motion.energy, wind.period
    )
    if len(middles):
        in_view = (wind_time >= middles[0] - _MARGIN) & (wind_time <= middles[-1] + _MARGIN)
        x, y = _broken(wind_time[in_view], normal_scores(wind.speed[in_view]), wind.period)
        axes.plot(x, y, color=_WIND, lw=1.1, label="wind speed")
        axes.plot(middles, normal_scores(energy), color=_MOTION, lw=1.1, label="motion of the flag")
        axes.legend(loc="lower right", bbox_to_anchor=(1, 1), frameon=False, ncols=2)
    axes.set(xlabel=f"time on the wind's clock [s since {iso(origin)}]", ylabel="normal score")


def _draw_search(axes: Axes, estimate: LagEstimate) -> None:
    curve = estimate.curve
    _draw_curve(axes, estimate, curve.evidence, label="evidence z")
    if math.isfinite(curve.chance_score):
        axes.axhline(curve.chance_score, color=_MARK, ls=":", lw=1)
        axes.axhspan(-curve.chance_score, curve.chance_score, color=_MARK, alpha=0.07, lw=0)
    axes.set_title(
        "all offsets tried; unrelated winds stay within the gray", loc="left", fontsize=9
    )


def _draw_peak(axes: Axes, estimate: LagEstimate) -> None:
    _draw_curve(axes, estimate, estimate.curve.score, label="score z")
    if math.isfinite(estimate.offset):
        half = max(10.0, 6 * min(estimate.sigma, 5.0))
        low, high = estimate.interval
        axes.set_xlim(estimate.offset - half, estimate.offset + half)
        axes.set_title(
            f"{estimate.offset:+.2f} s [{low:.2f}, {high:.2f}] 90 %", loc="left", fontsize=9
        )


def _draw_curve(axes: Axes, estimate: LagEstimate, values: Series, *, label: str) -> None:
    axes.set(xlabel="offset added to the camera's clock [s]", ylabel=label)
    if not np.any(np.isfinite(values)):
        axes.set(xticks=[], yticks=[])
        axes.text(
            0.5, 0.5, "nothing was searched", ha="center", va="center", transform=axes.transAxes
        )
        return
    axes.plot(estimate.curve.offset, values, color=_MARK, lw=1)
    if math.isfinite(estimate.offset):
        if all(map(math.isfinite, estimate.interval)):
            axes.axvspan(*estimate.interval, color=_MOTION, alpha=0.25, lw=0)
        axes.axvline(estimate.offset, color=_MOTION, lw=1)


def _draw_parts(axes: Axes, line: ClockLine) -> None:
    at = np.array([(part.at - line.origin) / NANOSECONDS / 60 for part in line.parts])
    offset = np.array([part.offset for part in line.parts])
    half = np.array([NINETY * part.sigma_statistical for part in line.parts])
    axes.errorbar(at, offset, yerr=half, fmt="o", color=_MOTION, lw=1, ms=4)
    ends = np.array([at.min(), at.max()])
    axes.plot(ends, line.offset + line.drift * 60 * ends, color=_MARK, lw=1)
    axes.set(
        xlabel=f"time on the camera's clock [min from {iso(line.origin)[:19]}Z]",
        ylabel="offset [s]",
    )
    axes.set_title(
        f"drift {1e6 * line.drift:+.0f} ± {1e6 * line.sigma_drift:.0f} ppm", loc="left", fontsize=9
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


def _broken(time: Series, values: Series, period: float) -> tuple[Series, Series]:
    """Returns the same line with NaN where bins are missing, so that gaps show."""
    gaps = np.flatnonzero(np.diff(time) > 1.5 * period) + 1
    return np.insert(time, gaps, np.nan), np.insert(values, gaps, np.nan)
