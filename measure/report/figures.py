"""Charts of the evidence: the error in time, in frequency and against wind, and the test against
simulated nulls."""

from __future__ import annotations

import math
from collections.abc import Sequence

from markupsafe import Markup

from measure.report.chart import Chart, Linear, Logarithmic
from measure.verdict.quantity import display, number
from measure.verdict.verdict_record import NullTest, Residual

_LEFT, _RIGHT, _TOP = 62.0, 628.0, 34.0
_BINS = 24
_FAR = 6.0  # an observed statistic this many times the largest null is shown on a logarithmic axis


def root_mean_square(values: Sequence[float]) -> float:
    """Computes the root mean square of the values that are there; NaN where none is."""
    finite = [v for v in values if math.isfinite(v)]
    return math.sqrt(sum(v * v for v in finite) / len(finite)) if finite else math.nan


def in_time(residual: Residual) -> Markup:
    """Draws the error against time, over the markers."""
    in_unit = display([*residual.in_time, *residual.in_time_after], "m")
    before = [v * in_unit.factor for v in residual.in_time]
    after = [v * in_unit.factor for v in residual.in_time_after]
    chart = Chart(
        title=f"Prediction error in time, {residual.recording}",
        description="root mean square over the markers, frame by frame",
        x=Linear.over(residual.times, _LEFT, _RIGHT),
        y=Linear.over([*before, *after], 194, _TOP, at_least=[0.0]),
        x_label="time [s]",
        y_label=f"error [{in_unit.unit}]",
        height=236,
    )
    chart.line(residual.times, before, "before")
    if after:
        chart.line(residual.times, after, "after")
    return chart.svg()


def in_frequency(residual: Residual) -> Markup:
    """Draws the error's power spectral density, both axes logarithmic."""
    pairs = [(f, p) for f, p in zip(residual.frequencies, residual.spectrum, strict=True) if f > 0]
    chart = Chart(
        title=f"Prediction error in frequency, {residual.recording}",
        description="power spectral density, both axes logarithmic",
        x=Logarithmic.over([f for f, _ in pairs], _LEFT, _RIGHT),
        y=Logarithmic.over([*(p for _, p in pairs), *residual.spectrum_after], 224, _TOP),
        x_label="frequency [Hz]",
        y_label="power spectral density [m²/Hz]",
        height=266,
    )
    chart.line(residual.frequencies, residual.spectrum, "before")
    if residual.spectrum_after:
        chart.line(residual.frequencies, residual.spectrum_after, "after")
    return chart.svg()


def against_wind(residuals: Sequence[Residual]) -> Markup:
    """Draws the error of each recording against its mean logged wind; hollow where the models were
    not fitted to it."""
    placed = [r for r in residuals if math.isfinite(r.speed)]
    before = [root_mean_square(r.in_time) for r in placed]
    after = [root_mean_square(r.in_time_after) for r in placed]
    in_unit = display([*before, *after], "m")
    chart = Chart(
        title="Prediction error against wind",
        description="one point a recording",
        x=Linear.over([r.speed for r in placed], _LEFT, _RIGHT),
        y=Linear.over([v * in_unit.factor for v in (*before, *after)], 194, _TOP, at_least=[0.0]),
        x_label="mean logged wind [m/s]",
        y_label=f"error [{in_unit.unit}]",
        height=236,
    )
    for residual, first, second in zip(placed, before, after, strict=True):
        state = " unseen" if residual.held_out else ""
        chart.point(residual.speed, first * in_unit.factor, f"dot before{state}")
        chart.point(residual.speed, second * in_unit.factor, f"dot after{state}")
    return chart.svg()


def null_distribution(test: NullTest) -> Markup:
    """Draws a histogram of the statistic over simulated nulls, the observed one, and the least that
    would be significant."""
    null = [v for v in test.null if math.isfinite(v)]
    values = [v for v in (*null, test.statistic) if math.isfinite(v)]
    critical = test.critical
    marked = [*values, *([critical] if critical is not None else [])]
    ratio = (
        bool(values)
        and min(values) > 0
        and math.isfinite(test.statistic)
        and test.statistic > _FAR * max(null)
    )
    x = Logarithmic.over(marked, _LEFT, _RIGHT) if ratio else Linear.over(marked, _LEFT, _RIGHT)
    edges, counts = _histogram(null, ratio=ratio)
    chart = Chart(
        title="The statistic under simulated nulls",
        description=f"histogram of {len(null)} nulls, with the observed statistic "
        f"{number(test.statistic)}",
        x=x,
        y=Linear.over([1.05 * max(counts, default=1)], 194, 58, at_least=[0.0]),
        x_label="test statistic (logarithmic)" if ratio else "test statistic",
        y_label="",
        height=236,
    )
    for left, right, count in zip(edges, edges[1:], counts, strict=False):
        chart.bar(left, right, count, "null")
    if critical is not None:
        chart.upright(critical, "critical")
        _label(chart, critical, 14, f"significant from {number(critical)} (level {test.level:g})")
    chart.upright(test.statistic, "observed")
    _label(chart, test.statistic, 30, f"observed {number(test.statistic)}")
    chart.note(_LEFT, 48, "nulls in a bin", "start")
    return chart.svg()


def _label(chart: Chart, value: float, y: float, text: str) -> None:
    """Draws a label above the chart, at the side of `value` where there is room."""
    at = chart.x(value)
    leftward = at > (chart.x.start + chart.x.stop) / 2
    chart.note(at + (4 if leftward else -4), y, text, "end" if leftward else "start")


def _histogram(values: Sequence[float], *, ratio: bool) -> tuple[list[float], list[int]]:
    """Edges and counts of equal bins, of the logarithm where the axis shows ratios."""
    if not values:
        return [], []
    taken = [math.log10(v) for v in values] if ratio else list(values)
    low, high = min(taken), max(taken)
    width = (high - low) / _BINS or 1.0
    counts = [0] * _BINS
    for value in taken:
        counts[min(int((value - low) / width), _BINS - 1)] += 1
    edges = [low + n * width for n in range(_BINS + 1)]
    return [10.0**e if ratio else e for e in edges], counts
