"""Draws charts: as SVG that takes its colours from the page, or as the file of a picture.

The one place that knows matplotlib.
"""

from __future__ import annotations

import io
import re
import textwrap
from collections.abc import Callable, Sequence
from functools import singledispatch
from itertools import groupby
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator, StrMethodFormatter

from flagdata.answer.charts import (
    Across,
    Axis,
    Band,
    Bars,
    Bins,
    Cells,
    Chart,
    Cloud,
    Colour,
    Dots,
    Line,
    Mark,
    Note,
    Panel,
    Shade,
)
from flagdata.errors import InputError

_VALUES = {
    Colour.INK: "#1c2326",
    Colour.QUIET: "#56646b",
    Colour.RULE: "#d5dbde",
    Colour.FILM: "#1f6f9d",
    Colour.LOG: "#b4531b",
    Colour.FIRST: "#1f6f9c",
    Colour.SECOND: "#b4531a",
    Colour.THIRD: "#7a4a9a",
    Colour.FOURTH: "#2f8068",
    Colour.FIFTH: "#97700d",
    Colour.SIXTH: "#a8402d",
    Colour.SEVENTH: "#5b6fb8",
    Colour.EIGHTH: "#a84a7e",
    Colour.NINTH: "#58702a",
    Colour.TENTH: "#6b5848",
}
"""Each differs from all others, so that it can be found in an SVG again."""
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "flagdata",
    "font.size": 9,
    "font.family": "DejaVu Sans",
    "text.parse_math": False,
    "text.color": _VALUES[Colour.INK],
    "axes.edgecolor": _VALUES[Colour.QUIET],
    "axes.labelcolor": _VALUES[Colour.INK],
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "xtick.color": _VALUES[Colour.QUIET],
    "ytick.color": _VALUES[Colour.QUIET],
    "grid.color": _VALUES[Colour.RULE],
    "grid.linewidth": 0.6,
    "legend.frameon": False,
}
_LEGEND_COLUMNS = 4
_PLACES = re.compile(r'\b(?:d|x|y)="[^"]*"')
_DIGITS = re.compile(r"(\d\.\d\d)\d+")
"""Digits beyond a hundredth of a point, of which an inch has 72."""
_DOTS = re.compile(r'<use ([^>]*) style="([^"]*)"/>\n(?:<use [^>]* style="\2"/>\n)+')
"""Dots of one style, which states it for each."""
_HANDLE, _LETTER = 0.5, 0.066
"""What an entry of a legend takes beside its text, and a letter of it [inch]."""
_NARROW = 6.0
"""Width of a chart [inch] up to which its texts can be read on a telephone; a wider one is scrolled
there."""
_NAME = 24
"""Characters of a line of a bar's name."""


def svg(chart: Chart, *, name: str, title: str = "") -> Markup:
    """Draws a chart as an element of a page.

    Args:
        name: with which its ids begin, so that several fit into one page.
        title: what it shows, for who does not see it.
    """
    target = io.StringIO()
    with mpl.rc_context(_STYLE):
        _draw(chart).savefig(target, format="svg", transparent=True, metadata={"Date": None})
    text = target.getvalue()
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    head, tail = text.split(">", 1)
    text = re.sub(r' (width|height|version|xmlns[^=]*)="[^"]*"', "", head) + ">" + tail
    text = _PLACES.sub(lambda places: _DIGITS.sub(r"\1", places[0]), text)
    text = _DOTS.sub(_group_dots, re.sub(r"\n\s+", "\n", text))
    text = re.sub(r"(\bid=\"|url\(#|href=\"#)", rf"\g<1>{name}-", text)
    for colour, value in _VALUES.items():
        text = text.replace(value, f"var(--{colour.value}, {value})")
    kind = Markup(' class="wide"') if chart.width > _NARROW else ""
    about = Markup('<svg role="img" aria-label="{}"{}').format(title, kind)
    return about + Markup(text.removeprefix("<svg"))


def _group_dots(dots: re.Match[str]) -> str:
    """States the style of dots once, for all of them."""
    style = dots[2]
    alone = dots[0].replace(f' style="{style}"', "").replace("xlink:href", "href")
    return f'<g style="{style}">\n{alone}</g>\n'


def encode(chart: Chart, path: Path) -> bytes:
    """Draws a chart in the format of a file's suffix (.png, .svg, .pdf).

    Raises:
        InputError: see `check_format`.
    """
    check_format(path)
    target = io.BytesIO()
    with mpl.rc_context(_STYLE):
        _draw(chart).savefig(target, format=path.suffix.lower().removeprefix("."), dpi=120)
    return target.getvalue()


def check_format(path: Path) -> None:
    """Refuses a picture that cannot be drawn.

    Raises:
        InputError: a suffix of no format that is drawn.
    """
    formats = FigureCanvasAgg.get_supported_filetypes()
    if path.suffix.lower().removeprefix(".") not in formats:
        raise InputError(
            f"no picture of format {path.suffix or path.name!r} is drawn",
            where=str(path),
            fix="name a .png file",
        )


def _draw(chart: Chart) -> Figure:
    heights = list(chart.heights) or [chart.height] * len(chart.rows)
    figure = Figure(figsize=(chart.width, sum(heights)), layout="constrained")
    FigureCanvasAgg(figure)
    if chart.title:
        figure.suptitle(chart.title, x=0.01, ha="left", fontsize=10, wrap=True)
    drawn: list[Axes] = []
    rows = list(zip(chart.rows, heights, strict=True))
    grids = [list(alike) for _, alike in groupby(rows, key=lambda row: len(row[0]))]
    totals = [sum(height for _, height in alike) for alike in grids]
    parts = figure.subfigures(len(grids), 1, squeeze=False, height_ratios=totals)[:, 0]
    for part, alike in zip(parts, grids, strict=True):
        count = len(alike[0][0])
        grid = part.subplots(
            len(alike),
            count,
            squeeze=False,
            width_ratios=list(chart.widths) if len(chart.widths) == count else [1.0] * count,
            height_ratios=[height for _, height in alike],
        )
        for line, (row, _) in zip(grid, alike, strict=True):
            for axes, panel in zip(line, row, strict=True):
                _draw_panel(axes, panel)
                drawn.append(axes)
    if chart.legend:
        _draw_legend(figure, drawn)
    return figure


def _draw_panel(axes: Axes, panel: Panel) -> None:
    if panel.x.logarithmic:
        axes.set_xscale("log")
    if panel.y.logarithmic:
        axes.set_yscale("log")
    for mark in panel.marks:
        _draw_mark(mark, axes)
    axes.set_title(panel.title)
    _set_axis(axes, panel.x, axes.set_xlabel, axes.set_xlim, axes.xaxis)
    _set_axis(axes, panel.y, axes.set_ylabel, axes.set_ylim, axes.yaxis)
    if panel.equal:
        axes.set_aspect("equal")
    if not panel.framed:
        axes.set_axis_off()


def _set_axis(
    axes: Axes,
    about: Axis,
    set_label: Callable[..., Any],
    set_limits: Callable[..., Any],
    axis: Any,
) -> None:
    set_label(about.label)
    if any(end is not None for end in about.limits):
        set_limits(*about.limits)
    if about.ticks is not None:
        texts = list(about.texts) or [f"{tick:,g}" for tick in about.ticks]
        axis.set_ticks(list(about.ticks), texts)
        axis.set_minor_locator(NullLocator())
    elif about.logarithmic:
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_minor_locator(NullLocator())


def _draw_legend(figure: Figure, drawn: Sequence[Axes]) -> None:
    entries: dict[str, Any] = {}
    for axes in drawn:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if entries:
        widest = _HANDLE + _LETTER * max(map(len, entries))
        columns = max(1, min(_LEGEND_COLUMNS, int(figure.get_figwidth() / widest)))
        figure.legend(
            list(entries.values()),
            list(entries),
            loc="outside lower center",
            ncols=min(columns, len(entries)),
            fontsize=8,
        )


@singledispatch
def _draw_mark(mark: Mark, axes: Axes) -> None:
    raise TypeError(f"no mark of a chart: {type(mark).__name__}")


@_draw_mark.register
def _(mark: Line, axes: Axes) -> None:
    axes.plot(
        mark.x,
        mark.y,
        color=_VALUES[mark.colour],
        linewidth=mark.width,
        linestyle="--" if mark.dashed else "-",
        marker=mark.marker,
        markersize=3.5,
        label=mark.label or None,
    )


@_draw_mark.register
def _(mark: Band, axes: Axes) -> None:
    axes.fill_between(
        mark.x,
        mark.low,
        mark.high,
        color=_VALUES[mark.colour],
        alpha=mark.opacity,
        linewidth=0,
        label=mark.label or None,
    )


@_draw_mark.register
def _(mark: Dots, axes: Axes) -> None:
    x, y = np.asarray(mark.x, float), np.asarray(mark.y, float)
    hollow = np.array(mark.hollow, bool) if len(mark.hollow) else np.zeros(len(x), bool)
    colour = _VALUES[mark.colour]
    if len(mark.low):
        _draw_intervals(axes, x, np.asarray(mark.low, float), np.asarray(mark.high, float), colour)
    for which, face in ((~hollow, colour), (hollow, "none")):
        if which.any() or (face != "none" and not len(x)):
            axes.plot(
                x[which],
                y[which],
                linestyle="none",
                marker=mark.marker,
                markersize=mark.size,
                markerfacecolor=face,
                markeredgecolor=colour,
                label=(mark.label or None) if face != "none" or hollow.all() else None,
            )


def _draw_intervals(axes: Axes, x: Any, low: Any, high: Any, colour: str) -> None:
    """Draws vertical intervals; a triangle at the end that is known where the other is not."""
    both = np.isfinite(low) & np.isfinite(high)
    axes.vlines(x[both], low[both], high[both], color=colour, linewidth=1.0)
    for known, direction in ((low, 1), (high, -1)):
        for at, end in zip(x[~both], known[~both], strict=True):
            if np.isfinite(end):
                marker = "^" if direction > 0 else "v"
                axes.plot([at], [end], marker=marker, color=colour, linestyle="none", markersize=6)


@_draw_mark.register
def _(mark: Bins, axes: Axes) -> None:
    axes.stairs(
        mark.heights,
        mark.edges,
        fill=mark.filled,
        color=_VALUES[mark.colour],
        linewidth=1.4,
        label=mark.label or None,
    )


@_draw_mark.register
def _(mark: Bars, axes: Axes) -> None:
    count = len(mark.names)
    rows = np.arange(count)[::-1] - mark.offset
    colour = _VALUES[mark.colour]
    axes.barh(
        rows,
        mark.lengths,
        height=mark.thickness,
        color=colour,
        alpha=mark.opacity,
        label=mark.label or None,
    )
    if len(mark.low):
        axes.hlines(rows, mark.low, mark.high, color=_VALUES[Colour.INK], linewidth=1.0)
    ends = np.maximum(mark.lengths, mark.high) if len(mark.high) else np.asarray(mark.lengths)
    for at, end, text in zip(rows, ends, mark.texts, strict=False):
        axes.annotate(
            text, (end, at), xytext=(4, 0), textcoords="offset points", va="center", fontsize=8
        )
    names = ["\n".join(textwrap.wrap(name, _NAME)) for name in mark.names]
    axes.set_yticks(np.arange(count)[::-1], names)
    axes.grid(visible=False, axis="y")


@_draw_mark.register
def _(mark: Cells, axes: Axes) -> None:
    values = np.asarray(mark.values, float)
    finite = values[np.isfinite(values)]
    low = mark.low if mark.low is not None else (finite.min() if finite.size else 0.0)
    high = mark.high if mark.high is not None else (finite.max() if finite.size else 1.0)
    if mark.diverging:
        high = max(abs(low), abs(high))
        low = -high
    palette = "RdBu_r" if mark.diverging else "viridis"
    if len(mark.triangles):
        corners = np.stack([np.asarray(mark.x, float), np.asarray(mark.y, float)], axis=1)
        shaded = PolyCollection(
            corners[np.asarray(mark.triangles)],  # pyright: ignore[reportArgumentType]  (n, 3, 2)
            array=values,
            cmap=palette,
            edgecolors="none",
        )
        axes.add_collection(shaded)
        axes.autoscale_view()
    else:
        ends = (float(mark.x[0]), float(mark.x[-1]), float(mark.y[0]), float(mark.y[-1]))
        shaded = axes.imshow(
            values, origin="lower", extent=ends, aspect="auto", cmap=palette, interpolation="none"
        )
    shaded.set_clim(low, high)
    axes.grid(visible=False)
    if mark.label:
        _draw_palette(axes, shaded, mark.label)


@_draw_mark.register
def _(mark: Cloud, axes: Axes) -> None:
    points = axes.scatter(
        mark.x, mark.y, c=mark.values, s=9, cmap="viridis", linewidths=0, rasterized=True
    )
    _draw_palette(axes, points, mark.label)


def _draw_palette(axes: Axes, shaded: Any, label: str) -> None:
    bar = axes.figure.colorbar(shaded, ax=axes, label=label)
    bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]


@_draw_mark.register
def _(mark: Across, axes: Axes) -> None:
    place = {"color": _VALUES[mark.colour], "linewidth": mark.width, "label": mark.label or None}
    style = "--" if mark.dashed else "-"
    if mark.x is not None:
        axes.axvline(mark.x, linestyle=style, **place)
    if mark.y is not None:
        axes.axhline(mark.y, linestyle=style, **place)


@_draw_mark.register
def _(mark: Shade, axes: Axes) -> None:
    place: dict[str, Any] = {
        "color": _VALUES[mark.colour],
        "alpha": mark.opacity,
        "linewidth": 0,
        "label": mark.label or None,
    }
    if mark.x is not None:
        axes.axvspan(*mark.x, **place)
    if mark.y is not None:
        axes.axhspan(*mark.y, **place)


@_draw_mark.register
def _(mark: Note, axes: Axes) -> None:
    axes.text(
        mark.x,
        mark.y,
        mark.text,
        color=_VALUES[mark.colour],
        fontsize=8,
        ha="right" if mark.end else "left",
        va="center",
    )
