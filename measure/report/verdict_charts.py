"""Charts of a verdict's evidence: errors before and after, the test against simulated nulls, gains
and strengths of effects, errors against wind."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

from flagdata.answer import Quantity
from flagdata.answer.charts import (
    Across,
    Axis,
    Bars,
    Bins,
    Chart,
    Colour,
    Dots,
    Mark,
    Panel,
    Shade,
)
from measure.verdict.quantity import display, known, number
from measure.verdict.verdict_record import Candidate, Comparison, NullTest, Residual

NARROW = 5.2
"""Width of a chart that a telephone shows without scrolling [inch]."""
_MOST = 8
"""Comparisons that are drawn: the first ones."""
_MOST_STRENGTHS = 4
_MOST_GAINS = 14
_LONGEST = 250.0
"""Error that is drawn at most, in per cent of the base model's."""
_BINS = 24
_FAR = 6.0
"""An observed statistic this many times the largest null is shown on a logarithmic axis."""


def errors_chart(comparisons: Sequence[Comparison], *, after: str) -> Chart | None:
    """Draws bars of each comparison of two models in per cent of the base model's error, the floor
    behind them; None where the base model is alone, since all its bars would be 100 % long.

    Args:
        after: what the model after is called, "with lift".
    """
    drawn = [c for c in comparisons if known(c.before) and c.before.point > 0 and known(c.after)]
    drawn = drawn[:_MOST]
    if not drawn:
        return None
    names = [comparison.what for comparison in drawn]
    units = [comparison.before.point / 100 for comparison in drawn]

    def bars(estimates: Sequence[Quantity], label: str, colour: Colour, offset: float) -> Bars:
        values = [_value_in(unit, one) for one, unit in zip(estimates, units, strict=True)]
        ends = [_ends_in(unit, one) for one, unit in zip(estimates, units, strict=True)]
        return Bars(
            names=names,
            lengths=[min(value, _LONGEST) for value in values],
            low=[low for low, _ in ends],
            high=[high for _, high in ends],
            texts=[f"{number(value, digits=2)} %" for value in values],
            label=label,
            colour=colour,
            offset=offset,
            thickness=0.34,
        )

    floors = [_value_in(unit, one.floor) for one, unit in zip(drawn, units, strict=True)]
    marks: list[Mark] = [
        Bars(
            names=names,
            lengths=[min(floor, _LONGEST) if math.isfinite(floor) else 0.0 for floor in floors],
            label="floor, below which no model errs",
            colour=Colour.QUIET,
            thickness=0.9,
            opacity=0.25,
        ),
        bars([one.before for one in drawn], "base model", Colour.LOG, -0.19),
        bars([one.after for one in drawn], after, Colour.FILM, 0.19),
    ]
    longest = max(max([*mark.lengths, *mark.high]) for mark in marks if isinstance(mark, Bars))
    x = Axis(label="error on unseen data [% of the base model's]", limits=(0, 1.2 * longest))
    height = 1.3 + 0.62 * len(drawn)
    return Chart(rows=[[Panel(marks=marks, x=x)]], height=height, width=NARROW)


def _value_in(unit: float, estimate: Quantity) -> float:
    return estimate.point / unit


def _ends_in(unit: float, estimate: Quantity) -> tuple[float, float]:
    """Returns the ends of an interval, or the value twice where they are open."""
    ends = estimate.low / unit, estimate.high / unit
    value = estimate.point / unit
    shown = ends if all(map(math.isfinite, ends)) else (value, value)
    return min(shown[0], _LONGEST), min(shown[1], _LONGEST)


def null_chart(test: NullTest) -> Chart:
    """Draws a histogram of the statistic over simulated nulls, the observed one, and the least that
    would be significant."""
    null = [v for v in test.null if math.isfinite(v)]
    values = [v for v in (*null, test.statistic) if math.isfinite(v)]
    is_ratio = (
        bool(null)
        and min(values) > 0
        and math.isfinite(test.statistic)
        and test.statistic > _FAR * max(null)
    )
    marks: list[Mark] = []
    if null:
        edges, counts = _histogram(null, logarithmic=is_ratio)
        marks.append(Bins(edges=edges, heights=counts, label="nulls", colour=Colour.QUIET))
    if test.critical is not None:
        label = f"significant from {number(test.critical)} (level {test.level:g})"
        marks.append(Across(x=test.critical, dashed=True, colour=Colour.INK, label=label))
    if math.isfinite(test.statistic):
        label = f"observed {number(test.statistic)}"
        marks.append(Across(x=test.statistic, colour=Colour.LOG, width=2.2, label=label))
    name = "test statistic (logarithmic)" if is_ratio else "test statistic"
    panel = Panel(
        marks=marks,
        x=Axis(label=name, logarithmic=is_ratio),
        y=Axis(label="nulls in a bin", limits=(0, None)),
    )
    return Chart(rows=[[panel]], height=3.0, width=7.0)


def _histogram(values: Sequence[float], *, logarithmic: bool) -> tuple[list[float], list[int]]:
    """Edges and counts of equal bins, of the logarithm where the axis shows ratios."""
    taken = [math.log10(v) for v in values] if logarithmic else list(values)
    low, high = min(taken), max(taken)
    width = (high - low) / _BINS or 1.0
    counts = [0] * _BINS
    for value in taken:
        counts[min(int((value - low) / width), _BINS - 1)] += 1
    edges = [low + n * width for n in range(_BINS + 1)]
    return [10.0**e if logarithmic else e for e in edges], counts


def gains_chart(
    candidates: Sequence[Candidate],
    *,
    title: Callable[[Candidate], str],
    named: Sequence[Candidate],
) -> Chart | None:
    """Draws each effect's held-out gain ± its standard error; None where none is known.

    Args:
        title: of an effect.
        named: effects that the verdict names.
    """
    drawn = [c for c in candidates if not math.isnan(c.gain)][:_MOST_GAINS]
    if not drawn:
        return None
    names = [title(candidate) for candidate in drawn]
    marks: list[Mark] = []
    for label, colour, is_named in (
        ("named", Colour.FILM, True),
        ("not named", Colour.QUIET, False),
    ):
        shown = [(one in named) is is_named for one in drawn]
        errors = [0.0 if math.isnan(one.gain_error) else one.gain_error for one in drawn]
        if any(shown):
            marks.append(
                Bars(
                    names=names,
                    lengths=_where(shown, (one.gain for one in drawn)),
                    low=_where(
                        shown, (o.gain - e for o, e in zip(drawn, errors, strict=True)), math.nan
                    ),
                    high=_where(
                        shown, (o.gain + e for o, e in zip(drawn, errors, strict=True)), math.nan
                    ),
                    colour=colour,
                    label=label,
                )
            )
    panel = Panel(marks=[*marks, Across(x=0.0, colour=Colour.INK)], x=Axis(label="gain [nat]"))
    return Chart(rows=[[panel]], height=0.9 + 0.34 * len(drawn), width=7.0)


def _where(shown: Sequence[bool], values: Iterable[float], other: float = 0.0) -> list[float]:
    return [value if is_shown else other for is_shown, value in zip(shown, values, strict=True)]


def strengths_chart(
    candidates: Sequence[Candidate], *, title: Callable[[Candidate], str]
) -> Chart | None:
    """Draws the strength of the first effects on each recording alone, over the interval of all
    together; None where no strength is known by recording.

    Args:
        title: of an effect.
    """
    drawn = [one for one in candidates if known(one.strength) and any(map(known, one.by_recording))]
    panels = [_strengths_panel(one, title(one)) for one in drawn[:_MOST_STRENGTHS]]
    return Chart(rows=[panels], height=2.1, legend=False) if panels else None


def _strengths_panel(candidate: Candidate, title: str) -> Panel:
    ordered = list(enumerate(candidate.by_recording, start=1))
    single = [(place, one) for place, one in ordered if known(one)]
    together = candidate.strength
    marks: list[Mark] = []
    if math.isfinite(together.low) and math.isfinite(together.high):
        marks.append(Shade(y=(together.low, together.high), colour=Colour.FILM))
    marks += [
        Across(y=candidate.null, colour=Colour.INK),
        Dots(
            x=[place for place, _ in single],
            y=[one.point for _, one in single],
            low=[one.low for _, one in single],
            high=[one.high for _, one in single],
            colour=Colour.INK,
        ),
    ]
    unit = "" if together.unit == "1" else f" [{together.unit}]"
    return Panel(
        marks=marks,
        title=f"{title}{unit}",
        x=Axis(
            label="recording",
            ticks=[place for place, _ in ordered],
            limits=(0.5, len(ordered) + 0.5),
        ),
    )


def wind_chart(residuals: Sequence[Residual]) -> Chart | None:
    """Draws the error of each recording against its mean logged wind, hollow where the models were
    not fitted to it; None where no wind is known."""
    placed = [r for r in residuals if math.isfinite(r.speed)]
    if not placed:
        return None
    before = [root_mean_square(r.in_time) for r in placed]
    after = [root_mean_square(r.in_time_after) for r in placed]
    in_unit = display([*before, *after], "m")
    marks = [
        Dots(
            x=[r.speed for r in placed],
            y=[value * in_unit.factor for value in errors],
            hollow=[r.held_out for r in placed],
            colour=colour,
            label=label,
            size=6,
        )
        for errors, colour, label in (
            (before, Colour.LOG, "base model"),
            (after, Colour.FILM, "with what was added"),
        )
        if any(map(math.isfinite, errors))
    ]
    panel = Panel(
        marks=marks,
        x=Axis(label="mean logged wind [m/s]"),
        y=Axis(label=f"error [{in_unit.unit}]", limits=(0, None)),
    )
    return Chart(rows=[[panel]], height=2.6, width=NARROW)


def root_mean_square(values: Sequence[float]) -> float:
    """Computes the root mean square of the values that are there; NaN where none is."""
    finite = [v for v in values if math.isfinite(v)]
    return math.sqrt(sum(v * v for v in finite) / len(finite)) if finite else math.nan
