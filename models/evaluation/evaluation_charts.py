"""What the charts of an evaluation show: errors against the true wind, calibration, ranks,
curves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.answer.charts import (
    SERIES,
    Across,
    Axis,
    Band,
    Bins,
    Chart,
    Colour,
    Dots,
    Line,
    Mark,
    Panel,
    Shade,
)
from flagdata.answer.quantity import Quantity
from models.evaluation.curves import LearningPoint
from models.evaluation.evaluation import CalibrationCurve, Expected, WindError
from models.evaluation.predictive_calibration import CURVE, LEVELS, Coverage

_MARKERS = "osD^vPX<>h"
_OPACITY = 0.13
_COLUMNS = 3
_SHARE = Axis(label="share covered", limits=(0, 1))
_NOTHING = Panel(marks=(), framed=False)


@dataclass(frozen=True, kw_only=True)
class Look:
    """How a model is drawn in a chart."""

    colour: Colour
    marker: str


def _look(labels: Iterable[str]) -> dict[str, Look]:
    """Assigns a colour and a marker to each label."""
    return {
        label: Look(
            colour=SERIES[i % len(SERIES)],
            marker=_MARKERS[(i + i // len(SERIES)) % len(_MARKERS)],
        )
        for i, label in enumerate(dict.fromkeys(labels))
    }


def _scores(x: Sequence[float], scores: Sequence[Quantity], label: str, look: Look) -> list[Mark]:
    """Draws scores as a line with their intervals."""
    low, high = np.array([score.interval for score in scores], dtype=float).T
    low, high = (np.where(np.isfinite(ends), ends, np.nan) for ends in (low, high))
    values = [np.nan if score.value is None else score.value for score in scores]
    return [
        Band(x=x, low=low, high=high, colour=look.colour, opacity=_OPACITY),
        Line(x=x, y=values, label=label, colour=look.colour, marker=look.marker),
    ]


def error_against_wind(errors: Sequence[WindError]) -> Chart:
    """Shows RMSE and bias over the true wind, one line a model, with intervals over sequences."""
    look = _look(model.label for model in errors)
    rmse: list[Mark] = []
    bias: list[Mark] = [Across(y=0, width=0.8)]
    for model in errors:
        middle = [sum(b.wind) / 2 for b in model.bins]
        of_model = (model.label, look[model.label])
        rmse += _scores(middle, [b.rmse.quantity for b in model.bins], *of_model)
        bias += _scores(middle, [b.bias.quantity for b in model.bins], *of_model)
    wind = Axis(label="true wind speed [m/s]")
    return Chart(
        rows=[
            [
                Panel(marks=rmse, x=wind, y=Axis(label="RMSE [m/s]", limits=(0, None))),
                Panel(marks=bias, x=wind, y=Axis(label="bias [m/s]")),
            ]
        ],
        height=3.6,
    )


def calibration(curves: Sequence[CalibrationCurve], expected: Sequence[Expected]) -> Chart:
    """Shows covered over nominal shares: a panel a target, and one for all targets together."""
    look = _look(curve.label for curve in curves)
    panels = [
        _coverage_panel(
            target,
            [
                mark
                for curve in curves
                if curve.target == target
                for mark in _coverage(curve.label, curve.coverage, look[curve.label])
            ],
            "nominal level of the central interval",
        )
        for target in dict.fromkeys(curve.target for curve in curves)
    ]
    together = [
        mark
        for curve in expected
        for mark in _coverage(curve.label, curve.coverage, look[curve.label])
    ]
    panels.append(_coverage_panel("all targets together (TARP)", together, "nominal level"))
    columns = min(_COLUMNS, len(panels))
    panels += [_NOTHING] * (-len(panels) % columns)
    rows = [panels[i : i + columns] for i in range(0, len(panels), columns)]
    return Chart(rows=rows, height=3.3)


def _coverage_panel(title: str, marks: Sequence[Mark], label: str) -> Panel:
    return Panel(
        marks=[*marks, Line(x=[0, 1], y=[0, 1], colour=Colour.QUIET, width=0.9, dashed=True)],
        title=title,
        x=Axis(label=label, limits=(0, 1)),
        y=_SHARE,
        equal=True,
    )


def _coverage(label: str, curve: tuple[Coverage, ...], look: Look) -> list[Mark]:
    x = [point.level for point in curve]
    band, line = _scores(
        x, [point.share.quantity for point in curve], label, Look(colour=look.colour, marker="")
    )
    in_table = [point for point in curve if point.level in LEVELS and point.level in CURVE]
    dots = Dots(
        x=[point.level for point in in_table],
        y=[point.share.value for point in in_table],
        colour=look.colour,
        marker=look.marker,
        size=3.5,
    )
    return [band, line, dots]


def ranks(curves: Sequence[CalibrationCurve]) -> Chart:
    """Shows rank histograms, a row a model, a panel a target, with the band of a calibrated
    model."""
    by_label: dict[str, list[CalibrationCurve]] = {}
    for curve in curves:
        by_label.setdefault(curve.label, []).append(curve)
    look = _look(by_label)
    columns = max(map(len, by_label.values()))
    top = 1.15 * max(max(*curve.ranks.share, curve.ranks.high) for curve in curves)
    rows = []
    for number, (label, of_model) in enumerate(by_label.items(), start=1):
        below = "rank of the truth / (draws + 1)" if number == len(by_label) else ""
        panels = [
            Panel(
                marks=[
                    Shade(y=curve.ranks.band, opacity=0.18),
                    Bins(
                        edges=np.linspace(0, 1, len(curve.ranks.share) + 1),
                        heights=curve.ranks.share,
                        colour=look[label].colour,
                        filled=False,
                    ),
                ],
                title=f"{label}: {curve.target}",
                x=Axis(label=below, limits=(0, 1)),
                y=Axis(label="" if position else "share of clips", limits=(0, top)),
            )
            for position, curve in enumerate(of_model)
        ]
        rows.append([*panels, *[_NOTHING] * (columns - len(panels))])
    return Chart(rows=rows, height=2.0)


def learning(points: Sequence[LearningPoint]) -> Chart:
    """Shows RMSE over the number of sequences trained on, logarithmic both."""
    sequences = sorted({point.sequences for point in points})
    return Chart(
        rows=[
            [
                Panel(
                    marks=curves([(p.label, p.sequences, p.score.quantity) for p in points]),
                    x=Axis(label="sequences trained on", logarithmic=True, ticks=sequences),
                    y=Axis(
                        label="wind RMSE [m/s]",
                        logarithmic=True,
                        ticks=_round_ticks([point.score.quantity for point in points]),
                    ),
                )
            ]
        ],
        height=3.6,
    )


def curves(points: Sequence[tuple[str, int, Quantity]]) -> list[Mark]:
    """Draws a line a label through its scores, by what they were given."""
    look = _look(label for label, *_ in points)
    marks: list[Mark] = []
    for label in look:
        given, scores = zip(
            *sorted(
                ((size, score) for of, size, score in points if of == label), key=lambda one: one[0]
            ),
            strict=True,
        )
        marks += _scores(given, scores, label, look[label])
    return marks


def _round_ticks(scores: Sequence[Quantity]) -> list[float]:
    """Chooses ticks: 1, 2, 3 and 5 times powers of ten that span the intervals."""
    ends = np.array([[*score.interval, score.value] for score in scores], dtype=float)
    low, high = (pick(ends[np.isfinite(ends)]) for pick in (np.min, np.max))
    all_ticks = [digit * 10.0**power for power in range(-3, 2) for digit in (1, 2, 3, 5)]
    inside = [tick for tick in all_ticks if low / 1.6 <= tick <= high * 1.6]
    return [round(tick, 6) for tick in inside]
