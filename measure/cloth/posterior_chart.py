"""A chart of what a quantity can be after the recordings, beside what was assumed before."""

from __future__ import annotations

import math

import numpy as np

from flagdata.answer import Quantity
from flagdata.answer.charts import Across, Axis, Bins, Colour, Panel, Shade
from flagdata.answer.quantity import unit_as_read
from flagdata.core.arrays import FloatArray
from flagdata.recipes.typed_tables import Range, Scale
from measure.cloth.flag_prior import Uncertain

_BINS = 40
_WIDE = 30.0
"""Ratio of an axis's ends from which on only powers of ten are marked."""


def posterior_panel(about: Uncertain, quantity: Quantity, draws: FloatArray) -> Panel:
    """Makes a panel of a posterior's draws (n,) in bins to which the prior gives equal shares."""
    unit, factor = unit_as_read(about.unit)
    low, high = (about.at(np.array([0.0, 1.0])) * factor).tolist()
    is_logarithmic = isinstance(about.prior, Range) and about.prior.scale is Scale.LOG
    edges = (np.geomspace if is_logarithmic else np.linspace)(low, high, _BINS + 1)
    heights = np.histogram(draws * factor, edges)[0] / len(draws)
    marks: list[Bins | Across | Shade] = [
        Bins(edges=edges, heights=heights, label="after the recordings"),
        Across(y=1 / _BINS, colour=Colour.LOG, label="assumed before"),
    ]
    if quantity.constrained:
        ends = max(low, quantity.span.low * factor), min(high, quantity.span.high * factor)
        label = f"{quantity.span.percent} probability"
        marks.insert(0, Shade(x=ends, label=label))
    name = quantity.name.replace("_", " ")
    ticks = ticks_between(low, high) if is_logarithmic else None
    return Panel(
        marks=marks,
        title=name,
        x=Axis(
            label=name if unit == "1" else f"{name} [{unit}]",
            limits=(low, high),
            logarithmic=is_logarithmic,
            ticks=ticks,
        ),
        y=Axis(ticks=()),
    )


def ticks_between(low: float, high: float) -> list[float]:
    """Lists the marks of a logarithmic axis: 1, 2, 3 and 5 times each power of ten, or 1 of a long
    axis."""
    leading = (1.0,) if high / low > _WIDE else (1.0, 2.0, 3.0, 5.0)
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    marks = [digit * 10.0**power for power in powers for digit in leading]
    return [mark for mark in marks if low <= mark <= high]
