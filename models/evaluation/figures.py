"""The report's charts as SVG that takes its colours from the page, so that they follow its light or dark style."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from models.evaluation import paper
from models.evaluation.calibration import CURVE, LEVELS, Coverage
from models.evaluation.curves import FramesPoint, LearningPoint
from models.evaluation.evaluation import Calibration, Expected, WindError
from models.evaluation.tsne import Layout

_INK, _QUIET, _RULE = "#1c2326", "#56646b", "#d5dbde"
_SERIES = ("#1f6f9c", "#b4531a", "#7a4a9a", "#2f8068", "#97700d", "#a8402d", "#5b6fb8", "#a84a7e", "#58702a", "#6b5848")
_MARKERS = "osD^vPX<>h"
_THEME = {_INK: "--ink", _QUIET: "--quiet", _RULE: "--rule"} | {
    colour: f"--series-{place}" for place, colour in enumerate(_SERIES)
}
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "flagdata",
    "font.size": 9,
    "text.color": _INK,
    "axes.edgecolor": _QUIET,
    "axes.labelcolor": _INK,
    "xtick.color": _QUIET,
    "ytick.color": _QUIET,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": _RULE,
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "axes.titlesize": 9,
    "font.family": "DejaVu Sans",
    "text.parse_math": False,
}
_WIDTH = 9.2  # inches, 72 units each


def _svg(figure: Figure, name: str) -> Markup:
    """The figure as an inline element whose ids start with `name`, so that several fit into one page."""
    target = io.StringIO()
    figure.savefig(target, format="svg", transparent=True, metadata={"Date": None})
    text = target.getvalue()
    head, tail = text[text.index("<svg") :].split(">", 1)
    text = re.sub(r' (width|height)="[^"]*"', "", head) + ">" + tail
    text = re.sub(r"(\bid=\"|url\(#|href=\"#)", rf"\g<1>{name}-", text)
    for colour, variable in _THEME.items():
        text = text.replace(colour, f"var({variable})")
    return Markup(text)


def _panels(count: int, height: float) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(_WIDTH, height), layout="constrained")
    return figure, list(figure.subplots(1, count, squeeze=False)[0])


def _legend(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(4, len(labels)), fontsize=8)


@dataclass(frozen=True, kw_only=True)
class Look:
    """How a model is drawn in a chart."""

    colour: str
    marker: str


def _look(labels: Iterable[str]) -> dict[str, Look]:
    """A colour and a marker for each label."""
    return {
        label: Look(colour=_SERIES[i % len(_SERIES)], marker=_MARKERS[(i + i // len(_SERIES)) % len(_MARKERS)])
        for i, label in enumerate(dict.fromkeys(labels))
    }


def _interval_line(
    axes: Axes,
    x: Sequence[float],
    value: Sequence[float],
    ends: Sequence[tuple[float, float]],
    label: str,
    look: Look,
) -> None:
    low, high = np.array(ends, dtype=float).T
    axes.fill_between(x, low, high, color=look.colour, alpha=0.13, linewidth=0)
    axes.plot(x, value, label=label, markersize=3.5, linewidth=1.3, color=look.colour, marker=look.marker)


def error_against_wind(errors: Sequence[WindError]) -> Markup:
    """RMSE and bias over the true wind, one line a model, with intervals over sequences."""
    with mpl.rc_context(_STYLE):
        figure, (left, right) = _panels(2, 3.6)
        look = _look(one.label for one in errors)
        for one in errors:
            middle = [(b.low + b.high) / 2 for b in one.bins]
            for axes, scores in ((left, [b.rmse for b in one.bins]), (right, [b.bias for b in one.bins])):
                ends = [(s.low, s.high) for s in scores]
                _interval_line(axes, middle, [s.value for s in scores], ends, one.label, look[one.label])
        left.set(xlabel="true wind speed [m/s]", ylabel="RMSE [m/s]", ylim=(0, None))
        right.axhline(0, color=_QUIET, linewidth=0.8)
        right.set(xlabel="true wind speed [m/s]", ylabel="bias [m/s]")
        _legend(figure, left)
        return _svg(figure, "wind")


def calibration(curves: Sequence[Calibration], expected: Sequence[Expected]) -> Markup:
    """Covered over nominal: a panel a target, and one for all targets together."""
    targets = list(dict.fromkeys(one.target for one in curves))
    look = _look(one.label for one in curves)
    with mpl.rc_context(_STYLE):
        columns = min(3, len(targets) + 1)
        lines = -(-(len(targets) + 1) // columns)
        figure = Figure(figsize=(_WIDTH, 3.1 * lines + 0.4), layout="constrained")
        panels = list(figure.subplots(lines, columns, squeeze=False).flat)
        for axes, target in zip(panels, targets, strict=False):
            for one in curves:
                if one.target == target:
                    _coverage(axes, one.label, one.curve, look[one.label])
            axes.set(title=target, xlabel="nominal level of the central interval", ylabel="share covered")
        joint = panels[len(targets)]
        for one in expected:
            _coverage(joint, one.label, one.curve, look[one.label])
        joint.set(title="all targets together (TARP)", xlabel="nominal level", ylabel="expected coverage")
        for axes in panels[: len(targets) + 1]:
            axes.plot([0, 1], [0, 1], color=_QUIET, linewidth=0.9, linestyle="--")
            axes.set(xlim=(0, 1), ylim=(0, 1), aspect="equal")
        for axes in panels[len(targets) + 1 :]:
            axes.set_axis_off()
        _legend(figure, panels[0])
        return _svg(figure, "calibration")


def _coverage(axes: Axes, label: str, curve: tuple[Coverage, ...], look: Look) -> None:
    x = [point.level for point in curve]
    value = [point.share.value for point in curve]
    ends = np.array([(point.share.low, point.share.high) for point in curve])
    axes.fill_between(x, ends[:, 0], ends[:, 1], color=look.colour, alpha=0.13, linewidth=0)
    axes.plot(x, value, label=label, linewidth=1.3, color=look.colour)
    table = [i for i, level in enumerate(x) if level in LEVELS and level in CURVE]
    axes.plot(
        [x[i] for i in table],
        [value[i] for i in table],
        linestyle="none",
        markersize=3.5,
        color=look.colour,
        marker=look.marker,
    )


def ranks(curves: Sequence[Calibration]) -> Markup:
    """Rank histograms, a row a model, a panel a target, with the band of a calibrated model."""
    labels = list(dict.fromkeys(one.label for one in curves))
    columns = max(sum(one.label == label for one in curves) for label in labels)
    look = _look(labels)
    top = 1.15 * max(max(*one.ranks.share, one.ranks.high) for one in curves)
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(_WIDTH, 1.8 * len(labels) + 0.3), layout="constrained")
        grid = figure.subplots(len(labels), columns, squeeze=False, sharey=True)
        for line, label in zip(grid, labels, strict=True):
            own = [one for one in curves if one.label == label]
            for axes, one in zip(line, own, strict=False):
                edges = np.linspace(0, 1, len(one.ranks.share) + 1)
                axes.axhspan(one.ranks.low, one.ranks.high, color=_QUIET, alpha=0.18, linewidth=0)
                axes.stairs(one.ranks.share, edges, color=look[label].colour, linewidth=1.4)
                axes.set(title=f"{label}: {one.target}", xlim=(0, 1), ylim=(0, top))
            line[0].set_ylabel("share of clips")
            for axes in line[len(own) :]:
                axes.set_axis_off()
        for axes in grid[-1]:
            axes.set_xlabel("rank of the truth / (draws + 1)")
        return _svg(figure, "ranks")


def learning(points: Sequence[LearningPoint]) -> Markup:
    """RMSE over the number of sequences trained on, logarithmic both."""
    with mpl.rc_context(_STYLE):
        figure, (axes,) = _panels(1, 3.6)
        look = _look(point.label for point in points)
        for label in look:
            own = sorted((point for point in points if point.label == label), key=lambda point: point.sequences)
            ends = [point.interval for point in own]
            _interval_line(axes, [p.sequences for p in own], [p.rmse for p in own], ends, label, look[label])
        axes.set(xscale="log", yscale="log", xlabel="sequences trained on", ylabel="wind RMSE [m/s]")
        for axis, ticks in (
            (axes.xaxis, sorted({point.sequences for point in points})),
            (axes.yaxis, _round_ticks(points)),
        ):
            axis.set_ticks(ticks, [f"{tick:,g}" for tick in ticks])
            axis.set_minor_locator(NullLocator())
        _legend(figure, axes)
        return _svg(figure, "learning")


def _round_ticks(points: Sequence[LearningPoint]) -> list[float]:
    """1, 2, 3 and 5 times powers of ten that span the intervals."""
    low, high = min(p.interval[0] for p in points), max(p.interval[1] for p in points)
    all_ticks = [digit * 10.0**power for power in range(-3, 2) for digit in (1, 2, 3, 5)]
    inside = [tick for tick in all_ticks if low / 1.6 <= tick <= high * 1.6]
    return [round(tick, 6) for tick in inside]


def frames(points: Sequence[FramesPoint]) -> Markup:
    """Triplet accuracy over the frames a model sees, beside the paper's."""
    with mpl.rc_context(_STYLE):
        figure, (axes,) = _panels(1, 3.2)
        look = _look(point.label for point in points)
        for label in look:
            own = sorted((point for point in points if point.label == label), key=lambda point: point.frames)
            ends = [point.interval for point in own]
            _interval_line(axes, [p.frames for p in own], [p.accuracy for p in own], ends, label, look[label])
        size, accuracy = zip(*paper.TRIPLETS, strict=True)
        axes.plot(size, accuracy, color=_QUIET, linestyle="--", linewidth=1.1, label="SDN, quoted from the paper")
        axes.set(xlabel="frames", ylabel="triplet accuracy", ylim=(None, 1))
        _legend(figure, axes)
        return _svg(figure, "frames")


def t_sne(layout: Layout) -> Markup:
    """The embedding in the plane with the true wind as colour."""
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(6.2, 5.0), layout="constrained", dpi=150)
        axes = figure.subplots()
        drawn = axes.scatter(*layout.places.T, c=layout.wind, s=9, cmap="viridis", linewidths=0, rasterized=True)
        figure.colorbar(drawn, ax=axes, label="true wind speed [m/s]").outline.set_visible(False)
        axes.set(xticks=[], yticks=[], aspect="equal")
        axes.spines[:].set_visible(False)
        return _svg(figure, "t-sne")
