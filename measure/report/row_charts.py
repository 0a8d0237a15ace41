"""Small charts inside tables: errors before and after, held-out gains, the strength on each
recording."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from markupsafe import Markup

from measure.report.chart import Linear, drawing
from measure.verdict.quantity import estimate_text, known, with_error
from measure.verdict.verdict_record import Candidate, Comparison, Estimate

_WIDTH = 200.0
_INSET = 8.0
_STEP = 13.0


def errors_scale(comparisons: Sequence[Comparison]) -> Linear:
    """Makes one axis for the errors of all comparisons, from zero."""
    errors = [
        e for c in comparisons for e in (c.before, c.after, c.floor, c.control) if e is not None
    ]
    ends = [v for e in errors for v in (e.value, e.low, e.high)]
    return Linear.over(ends, _INSET, _WIDTH - _INSET, at_least=[0.0])


def errors_row(comparison: Comparison, scale: Linear) -> Markup:
    """Draws the errors of one comparison: before, after and control with their intervals; floor
    shaded."""
    estimates = [
        (comparison.before, "before"),
        (comparison.after, "after"),
        (comparison.control, "control"),
    ]
    present = [(e, kind) for e, kind in estimates if e is not None and known(e)]
    height = 15 * len(present) + 3
    parts = []
    if known(comparison.floor):
        edge = scale(min(max(comparison.floor.value, scale.low), scale.high))
        parts.append(
            f'<rect class="floor" x="{scale(0):.1f}" y="0" width="{edge - scale(0):.1f}" '
            f'height="{height}"/>'
        )
    parts += [
        _whisker(estimate, scale, 9.0 + 15 * row, kind)
        for row, (estimate, kind) in enumerate(present)
    ]
    caption = f"before {estimate_text(comparison.before)}, after {estimate_text(comparison.after)}"
    return drawing(_WIDTH, height, f"Errors, {comparison.what}", caption, "".join(parts))


def gain_scale(candidates: Sequence[Candidate]) -> Linear:
    """Makes one axis for all held-out gains."""
    ends = [c.gain + side * c.gain_error for c in candidates for side in (-1, 1)]
    return Linear.over(ends, _INSET, _WIDTH - _INSET, at_least=[0.0])


def gain_row(candidate: Candidate, scale: Linear, kind: str) -> Markup:
    """Draws a candidate's held-out gain ± its standard error."""
    if math.isnan(candidate.gain):
        return Markup("")
    estimate = Estimate(
        value=candidate.gain,
        low=candidate.gain - candidate.gain_error,
        high=candidate.gain + candidate.gain_error,
        unit="1",
    )
    inside = _null(scale, 0.0, 18) + _whisker(estimate, scale, 9, kind)
    caption = with_error(candidate.gain, candidate.gain_error)
    return drawing(_WIDTH, 18, f"Held-out gain of {candidate.effect}", caption, inside)


def strength_row(candidate: Candidate) -> Markup:
    """Draws the strength on each recording alone, top to bottom in their order, over the interval
    of all together."""
    single = [e for e in candidate.by_recording if known(e)]
    if not single or not known(candidate.strength):
        return Markup("")
    ends = _finite(v for e in (candidate.strength, *single) for v in (e.value, e.low, e.high))
    scale = Linear.over(ends, _INSET, _WIDTH - _INSET, at_least=[candidate.null])
    height = _STEP * len(candidate.by_recording) + 6
    low, high = (
        scale(min(max(v, scale.low), scale.high))
        for v in (candidate.strength.low, candidate.strength.high)
    )
    parts = []
    if math.isfinite(low) and math.isfinite(high):
        parts.append(
            f'<rect class="band" x="{low:.1f}" y="0" width="{max(high - low, 1):.1f}" '
            f'height="{height:g}"/>'
        )
    parts.append(_null(scale, candidate.null, height))
    for row, estimate in enumerate(candidate.by_recording):
        if known(estimate):
            parts.append(_whisker(estimate, scale, 9.5 + _STEP * row, "single"))
    caption = "; ".join(estimate_text(e) for e in candidate.by_recording)
    return drawing(
        _WIDTH, height, f"{candidate.effect} on each recording alone", caption, "".join(parts)
    )


def _null(scale: Linear, value: float, height: float) -> str:
    return f'<path class="line zero" d="M{scale(value):.1f} 0V{height:g}"/>'


def _whisker(estimate: Estimate, scale: Linear, y: float, kind: str) -> str:
    """Draws a dot with its interval; an open end runs to the edge."""
    low, high, value = (
        scale(min(max(v if not math.isnan(v) else estimate.value, scale.low), scale.high))
        for v in (estimate.low, estimate.high, estimate.value)
    )
    return (
        f'<path class="line {kind}" d="M{low:.1f} {y:.1f}H{high:.1f}"/>'
        f'<circle class="dot {kind}" cx="{value:.1f}" cy="{y:.1f}" r="3"/>'
    )


def _finite(values: Iterable[float]) -> list[float]:
    return [v for v in values if math.isfinite(v)]
