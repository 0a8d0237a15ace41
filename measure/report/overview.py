"""One chart for a verdict: the error of the base model, with what was added, and the floor, on unseen data."""

from __future__ import annotations

import math
from collections.abc import Sequence

from markupsafe import Markup, escape

from measure.report.chart import Linear, drawing
from measure.verdict.quantity import known, number
from measure.verdict.record import Comparison, Estimate

_WIDTH, _LEFT, _RIGHT = 640.0, 190.0, 70.0
_ROW, _BAR = 46.0, 12.0
_MOST = 8
"""Comparisons that are drawn: the first ones."""


def overview(comparisons: Sequence[Comparison], *, after: str) -> Markup:
    """Bars of each comparison in per cent of the base model's error, the floor shaded; empty where there is none.

    Args:
        after: what the model after is called, "with lift".
    """
    drawn = [c for c in comparisons if known(c.before) and c.before.value > 0][:_MOST]
    if not drawn:
        return Markup("")
    ends = [100 * v / c.before.value for c in drawn for e in (c.before, c.after, c.floor) for v in (e.value, e.high)]
    scale = Linear(0.0, max(110.0, *(min(v, 250.0) for v in ends if math.isfinite(v))), _LEFT, _WIDTH - _RIGHT)
    height = _ROW * len(drawn) + 24
    parts = [_axis(scale, height - 18)]
    said = []
    for place, one in enumerate(drawn):
        parts += _row(one, scale, 6 + _ROW * place)
        share = f"{100 * one.after.value / one.before.value:.0f} % {after}" if known(one.after) else "base model alone"
        said.append(f"{one.what}: {share}")
    title = "Errors on unseen data in per cent of the base model's"
    return drawing(_WIDTH, height, title, "; ".join(said), "".join(parts))


def _row(one: Comparison, scale: Linear, top: float) -> list[str]:
    """What is compared, its bars, and the floor behind them."""
    parts = [f'<text class="label" x="{_LEFT - 8:g}" y="{top + 17:g}" text-anchor="end">{_short(one.what)}</text>']
    if known(one.floor):
        width = scale(min(100 * one.floor.value / one.before.value, scale.high)) - _LEFT
        parts.append(f'<rect class="floor" x="{_LEFT:g}" y="{top - 3:g}" width="{width:.1f}" height="36"/>')
    parts.append(_bar(one.before, one.before.value, scale, top, "before"))
    if known(one.after):
        parts.append(_bar(one.after, one.before.value, scale, top + 15, "after"))
    return parts


def _bar(estimate: Estimate, unit: float, scale: Linear, top: float, kind: str) -> str:
    """A bar from 0 with its interval and its figure."""
    value, low, high = (
        scale(min(100 * v / unit if math.isfinite(v) else scale.high, scale.high))
        for v in (estimate.value, estimate.low, estimate.high)
    )
    middle, width = top + _BAR / 2, value - scale.start
    bounded = math.isfinite(estimate.low) and math.isfinite(estimate.high)
    whisker = f'<path class="line" d="M{low:.1f} {middle:.1f}H{high:.1f}"/>' if bounded else ""
    text = f"{number(100 * estimate.value / unit, digits=2)} %"
    return (
        f'<rect class="bar {kind}" x="{scale.start:g}" y="{top:g}" width="{width:.1f}" height="{_BAR:g}"/>{whisker}'
        f'<text x="{(max(value, high) if bounded else value) + 5:.1f}" y="{middle + 4:.1f}">{text}</text>'
    )


def _axis(scale: Linear, bottom: float) -> str:
    ticks = [value for value in (0, 50, 100, 150, 200) if value <= scale.high]
    lines = (f'<path class="grid" d="M{scale(v):.1f} 0V{bottom:g}"/>' for v in ticks)
    labels = (f'<text x="{scale(v):.1f}" y="{bottom + 14:g}" text-anchor="middle">{v} %</text>' for v in ticks)
    return "".join([*lines, *labels])


def _short(text: str) -> str:
    """What fits beside a bar."""
    return str(escape(text if len(text) <= 30 else f"{text[:29]}…"))
