"""The report of closing the loop as one page: HTML that refers to no other file and needs no
network.

One chart for a verdict: the error of the base model, with what was added, and the floor, on unseen
data.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup, escape

from flagdata.pages.glossary import GLOSSARY
from flagdata.pages.render import render
from measure.report import error_maps, figures, moving_cloth, row_charts, verdict_sentences
from measure.report.chart import Linear, drawing
from measure.report.lead_sentences import lead
from measure.report.verdict_sentences import readable
from measure.verdict import quantity
from measure.verdict.quantity import known, number
from measure.verdict.verdict_record import Comparison, Conclusion, Estimate, Residual, Verdict

_WIDTH, _LEFT, _RIGHT = 640.0, 190.0, 70.0
_ROW, _BAR = 46.0, 12.0
_MOST = 8
"""Comparisons that are drawn: the first ones."""


def overview(comparisons: Sequence[Comparison], *, after: str) -> Markup:
    """Draws bars of each comparison of two models in per cent of the base model's error, the floor
    shaded; empty where the base model is alone, since all its bars would be 100 % long.

    Args:
        after: what the model after is called, "with lift".
    """
    drawn = [c for c in comparisons if known(c.before) and c.before.value > 0 and known(c.after)][
        :_MOST
    ]
    if not drawn:
        return Markup("")
    ends = [
        100 * v / c.before.value
        for c in drawn
        for e in (c.before, c.after, c.floor)
        for v in (e.value, e.high)
    ]
    scale = Linear(
        0.0, max(110.0, *(min(v, 250.0) for v in ends if math.isfinite(v))), _LEFT, _WIDTH - _RIGHT
    )
    height = _ROW * len(drawn) + 24
    parts = [_axis(scale, height - 18)]
    captions = []
    for row, comparison in enumerate(drawn):
        parts += _row(comparison, scale, 6 + _ROW * row)
        share = f"{100 * comparison.after.value / comparison.before.value:.0f} % {after}"
        captions.append(f"{comparison.what}: {share}")
    title = "Errors on unseen data in per cent of the base model's"
    return drawing(_WIDTH, height, title, "; ".join(captions), "".join(parts))


def _row(comparison: Comparison, scale: Linear, top: float) -> list[str]:
    """Draws what is compared, its bars, and the floor behind them."""
    parts = [
        (
            f'<text class="label" x="{_LEFT - 8:g}" y="{top + 17:g}" '
            f'text-anchor="end">{_short(comparison.what)}</text>'
        )
    ]
    if known(comparison.floor):
        width = (
            scale(min(100 * comparison.floor.value / comparison.before.value, scale.high)) - _LEFT
        )
        parts.append(
            f'<rect class="floor" x="{_LEFT:g}" y="{top - 3:g}" width="{width:.1f}" height="36"/>'
        )
    parts.append(_bar(comparison.before, comparison.before.value, scale, top, "before"))
    parts.append(_bar(comparison.after, comparison.before.value, scale, top + 15, "after"))
    return parts


def _bar(estimate: Estimate, unit: float, scale: Linear, top: float, kind: str) -> str:
    """Draws a bar from 0 with its interval and its figure."""
    value, low, high = (
        scale(min(100 * v / unit if math.isfinite(v) else scale.high, scale.high))
        for v in (estimate.value, estimate.low, estimate.high)
    )
    middle, width = top + _BAR / 2, value - scale.start
    bounded = math.isfinite(estimate.low) and math.isfinite(estimate.high)
    whisker = f'<path class="line" d="M{low:.1f} {middle:.1f}H{high:.1f}"/>' if bounded else ""
    text = f"{number(100 * estimate.value / unit, digits=2)} %"
    return (
        f'<rect class="bar {kind}" x="{scale.start:g}" y="{top:g}" width="{width:.1f}" '
        f'height="{_BAR:g}"/>{whisker}'
        f'<text x="{(max(value, high) if bounded else value) + 5:.1f}" '
        f'y="{middle + 4:.1f}">{text}</text>'
    )


def _axis(scale: Linear, bottom: float) -> str:
    ticks = [value for value in (0, 50, 100, 150, 200) if value <= scale.high]
    lines = (f'<path class="grid" d="M{scale(v):.1f} 0V{bottom:g}"/>' for v in ticks)
    labels = (
        f'<text x="{scale(v):.1f}" y="{bottom + 14:g}" text-anchor="middle">{v} %</text>'
        for v in ticks
    )
    return "".join([*lines, *labels])


def _short(text: str) -> str:
    """Shortens a text to what fits beside a bar."""
    return str(escape(text if len(text) <= 30 else f"{text[:29]}…"))


TONES = {
    Conclusion.UNTESTED: "open",
    Conclusion.SUFFICIENT: "settled",
    Conclusion.UNDECIDED: "open",
    Conclusion.EFFECT: "settled",
    Conclusion.ONE_OF: "open",
    Conclusion.PARTLY: "open",
    Conclusion.OUTSIDE: "missed",
}


@dataclass(frozen=True, kw_only=True)
class ResidualView:
    """One recording's charts."""

    residual: Residual
    sizes: list[tuple[str, Markup]]
    means: list[tuple[str, Markup]]
    time: Markup
    spectrum: Markup


def page(verdict: Verdict) -> str:
    """Renders the report of `verdict`, HTML."""
    errors = row_charts.errors_scale(verdict.comparisons)
    gains = row_charts.gain_scale(verdict.ranking)
    named_candidates = verdict_sentences.named_candidates(verdict)
    motions = [m for m in map(moving_cloth.motion, verdict.residuals) if m is not None]
    values = {
        "verdict": verdict,
        "tone": TONES[verdict.conclusion],
        **opening(verdict),
        "test_sentence": verdict_sentences.test_sentence(verdict),
        "remark": verdict_sentences.test_remark(verdict.test),
        "named": named_candidates,
        "rejected": verdict_sentences.rejected_candidates(verdict),
        "control_summary": verdict_sentences.control_summary(verdict),
        "has_control": any(quantity.known(c.control) for c in verdict.comparisons),
        "has_shift": any(quantity.known(p.after) for p in verdict.parameters),
        "residual_after": any(r.in_time_after for r in verdict.residuals),
        "level": verdict_sentences.common_level(
            e for c in verdict.comparisons for e in (c.before, c.after, c.floor)
        ),
        "ranking_level": verdict_sentences.common_level(c.strength for c in verdict.ranking),
        "lengths": _lengths(verdict),
        "errors_row": lambda comparison: row_charts.errors_row(comparison, errors),
        "gain_row": lambda c: row_charts.gain_row(
            c, gains, "after" if c in named_candidates else "single"
        ),
        "title": lambda c: verdict_sentences.candidate_title(verdict, c),
        "strength_row": row_charts.strength_row,
        "null": figures.null_distribution(verdict.test),
        "some_unseen": any(r.held_out for r in verdict.residuals),
        "windless": [r.recording for r in verdict.residuals if not math.isfinite(r.speed)],
        "against_wind": figures.against_wind(verdict.residuals),
        **_residuals(verdict.residuals, verdict_sentences.after_label(verdict)),
        **_motions(motions, verdict_sentences.after_label(verdict)),
        "provenance": list(_flatten_values(verdict.provenance)),
    }
    return render("measure.report", "page.html.j2", values, filters=FILTERS)


def opening(verdict: Verdict) -> dict[str, Any]:
    """Returns what the top of a page of markers or films shows: sentence, chart and what speaks
    against them."""
    first = lead(verdict)
    after = verdict_sentences.after_label(verdict)
    return {
        "lead": first,
        "rest": verdict.words.removeprefix(first).strip(),
        "overview": overview(verdict.comparisons, after=after),
        "after_label": after,
        "has_after": any(quantity.known(c.after) for c in verdict.comparisons),
        "against": [
            *verdict_sentences.error_warnings(verdict),
            *verdict_sentences.control_warnings(verdict),
            *verdict_sentences.reduction_warnings(verdict),
            *(text for _, text in verdict.findings),
        ],
        "power": verdict_sentences.power_mean(verdict),
        "glossary": GLOSSARY,
    }


def _lengths(verdict: Verdict) -> quantity.Display:
    """Chooses millimetres or metres for all errors of the table."""
    errors = [
        e
        for c in verdict.comparisons
        for e in (c.before, c.after, c.floor, c.control)
        if e is not None
    ]
    return quantity.display([e.value for e in errors], "m")


def _residuals(residuals: tuple[Residual, ...], after_label: str) -> dict[str, Any]:
    size, mean = error_maps.size_shade(residuals), error_maps.mean_shade(residuals)
    return {
        "residuals": [
            ResidualView(
                residual=r,
                sizes=error_maps.size_maps(r, size, after_label),
                means=error_maps.mean_maps(r, mean),
                time=figures.in_time(r),
                spectrum=figures.in_frequency(r),
            )
            for r in residuals
        ],
        "size_bar": error_maps.colour_bar(size, "root mean square error"),
        "mean_bar": error_maps.colour_bar(mean, "mean error"),
    }


def _motions(motions: list[moving_cloth.MotionClip], after_label: str) -> dict[str, Any]:
    """Returns the player's data, unseen recordings first."""
    ordered = sorted(motions, key=lambda m: not m.held_out)
    stills = [moving_cloth.still(m, after_label) for m in ordered]
    data = {
        "view": moving_cloth.VIEW,
        "list": [
            {**m.as_dict(), "still": str(still)} for m, still in zip(ordered, stills, strict=True)
        ],
    }
    return {
        "motions": ordered,
        "still": stills[0] if stills else "",
        "factors": moving_cloth.FACTORS,
        "motion_data": htmlsafe_json_dumps(data, allow_nan=False, separators=(",", ":")),
    }


def _flatten_values(values: Mapping[str, Any], prefix: str = "") -> Iterable[tuple[str, str]]:
    """Yields (dotted name, value) of nested provenance."""
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _flatten_values(value, f"{prefix}{name}.")
        else:
            yield (
                f"{prefix}{name}",
                value if isinstance(value, str) else json.dumps(value, ensure_ascii=False),
            )


def _data(value: float | None, text: str) -> Markup:
    """Writes a number as people read it, with the number as it is for programs."""
    return (
        Markup(f'<span class="none">{text}</span>')
        if text == quantity.NONE
        else Markup(f'<data value="{value!r}">{escape(text)}</data>')
    )


def _estimate(estimate: Estimate | None, display_as: quantity.Display | None = None) -> Markup:
    """Writes the value over its interval."""
    value, ends = quantity.estimate_parts(estimate, display_as=display_as)
    return _data(estimate.value if estimate else None, value) + Markup(
        '<span class="ends">{}</span>'
    ).format(ends)


def _full(estimate: Estimate) -> Markup:
    """Writes the value, its interval and the interval's level."""
    value, ends = quantity.estimate_parts(estimate)
    ends_text = f"{ends} {quantity.level_text(estimate.level)}" if ends else ""
    return _data(estimate.value, value) + Markup('<span class="ends">{}</span>').format(ends_text)


def _parameter(estimate: Estimate) -> Markup:
    """Writes the parameter, unless the data leave it open."""
    text = verdict_sentences.parameter_text(estimate)
    return _full(estimate) if text == quantity.with_level(estimate) else _data(estimate.value, text)


def _number(value: float | None) -> Markup:
    return _data(value, quantity.number(value))


def _count(value: int) -> Markup:
    return _data(value, str(value))


def _probability(value: float | None) -> Markup:
    return _data(value, quantity.probability(value))


def _in_errors(value: float | None) -> Markup:
    return _data(value, quantity.in_errors(value))


def _share(value: float | None) -> Markup:
    return _data(value, quantity.share(value))


def _with_error(value: float, error: float) -> Markup:
    return _data(value, quantity.with_error(value, error))


FILTERS = {
    "estimate": _estimate,
    "full": _full,
    "parameter": _parameter,
    "number": _number,
    "count": _count,
    "probability": _probability,
    "in_errors": _in_errors,
    "share": _share,
    "with_error": _with_error,
    "known": quantity.known,
    "readable": readable,
}
