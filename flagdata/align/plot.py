"""A picture of an estimated alignment: motion and wind on one clock, and the search that found it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flagdata.align.bins import normal_scores
from flagdata.align.methods import Evidence
from flagdata.errors import InputError
from flagdata.timebase import NANOSECONDS, iso

_MOTION, _WIND, _MARK = "#b5541c", "#1f5f8b", "#444444"


def draw(evidence: Evidence, path: Path, *, title: str) -> None:
    """Write the picture; its format is that of the file's suffix (.png, .svg, .pdf).

    Above: motion energy, in bins like the wind's and shifted by the estimate, and the wind, both as normal scores.
    Below left: the evidence at every offset tried, and the band that unrelated winds seldom leave. Below right: the
    score around the peak, and the 90 % interval.

    Raises:
        InputError: a suffix that cannot be drawn, or a folder that cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    estimate = evidence.estimate
    figure = Figure(figsize=(10, 6.4), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2, width_ratios=(2, 1))
    series, search, near = (
        figure.add_subplot(grid[0, :]),
        figure.add_subplot(grid[1, 0]),
        figure.add_subplot(grid[1, 1]),
    )

    origin = int(evidence.wind.time[0])
    wind_time = (evidence.wind.time - origin) / NANOSECONDS - evidence.wind.period / 2
    shift = estimate.offset - evidence.response if np.isfinite(estimate.offset) else 0.0
    motion_time = (evidence.motion.time - origin) / NANOSECONDS + shift
    middles, energy = _binned(motion_time, evidence.motion.energy, evidence.wind.period)
    near_film = (wind_time >= middles[0] - 30) & (wind_time <= middles[-1] + 30) if len(middles) else wind_time > -1
    series.plot(*_broken(wind_time[near_film], normal_scores(evidence.wind.speed[near_film]), evidence.wind.period),
                color=_WIND, lw=1.1, label="wind speed")  # fmt: skip
    series.plot(middles, normal_scores(energy), color=_MOTION, lw=1.1, label="motion of the flag")
    series.set(xlabel=f"time on the wind's clock [s since {iso(origin)}]", ylabel="normal score")
    series.legend(loc="upper right", framealpha=0.85, edgecolor="none", ncols=2)
    verdict = "refused: " + "; ".join(evidence.reasons) if evidence.reasons else "accepted"
    series.set_title(f"{title}: {verdict}", loc="left", fontsize=10, wrap=True)

    curve = estimate.curve
    for axes in (search, near):
        axes.plot(curve.offset, curve.evidence if axes is search else curve.score, color=_MARK, lw=1)
        if np.isfinite(estimate.offset):
            axes.axvspan(*estimate.interval, color=_MOTION, alpha=0.25, lw=0)
            axes.axvline(estimate.offset, color=_MOTION, lw=1)
        axes.set_xlabel("offset added to the camera's clock [s]")
    if not np.any(np.isfinite(curve.score)):
        for axes in (search, near):
            axes.set(xticks=[], yticks=[])
            axes.text(0.5, 0.5, "nothing was searched", ha="center", va="center", transform=axes.transAxes)
    if np.isfinite(curve.chance_score):
        search.axhline(curve.chance_score, color=_MARK, ls=":", lw=1)
        search.axhspan(-curve.chance_score, curve.chance_score, color=_MARK, alpha=0.07, lw=0)
    search.set_ylabel("evidence z")
    near.set_ylabel("score z")
    search.set_title("all offsets tried; unrelated winds stay within the gray", loc="left", fontsize=9)
    if np.isfinite(estimate.offset):
        half = max(10.0, 6 * min(estimate.sigma, 5.0))
        near.set_xlim(estimate.offset - half, estimate.offset + half)
        low, high = estimate.interval
        near.set_title(f"{estimate.offset:+.2f} s [{low:.2f}, {high:.2f}] 90 %", loc="left", fontsize=9)
    try:
        figure.savefig(path, dpi=120)
    except (OSError, ValueError) as error:
        raise InputError(f"the plot cannot be written: {error}", where=str(path), fix="name a .png file") from None


def _binned(time: np.ndarray, values: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Middles [s] and means of bins of `period` [s]; bins without a value are left out."""
    finite = np.isfinite(values)
    index = np.floor(time[finite] / period).astype(np.int64)
    first = int(index.min()) if len(index) else 0
    count = np.bincount(index - first)
    total = np.bincount(index - first, weights=values[finite])
    there = np.flatnonzero(count)
    return (there + first + 0.5) * period, total[there] / count[there]


def _broken(time: np.ndarray, values: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """The same line with NaN where bins are missing, so that gaps show."""
    gaps = np.flatnonzero(np.diff(time) > 1.5 * period) + 1
    return np.insert(time, gaps, np.nan), np.insert(values, gaps, np.nan)
