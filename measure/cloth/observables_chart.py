"""A chart of a recording's observables against the wind, beside what models predict of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.answer.charts import Axis, Band, Chart, Colour, Dots, Line, Panel
from flagdata.answer.quantity import unit_as_read
from flagdata.core.arrays import FloatArray
from measure.cloth.flag_simulation import OBSERVED
from measure.cloth.observed_recording import Observed
from measure.observables import OBSERVABLES

_COLUMNS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Predicted:
    """The range of each observable that a model predicts.

    Attributes:
        limits: (3, window, observable): low, middle and high.
        colour: of its band and of the line in its middle.
        label: of the model, in the legend.
        opacity: of the band.
    """

    limits: FloatArray
    colour: Colour
    label: str
    opacity: float = 0.25


def chart_against_wind(
    observed: Observed,
    names: Sequence[str],
    models: Sequence[Predicted],
    *,
    dots: Colour,
    label: str = "windows of the recording",
) -> Chart:
    """Makes a chart of observables against the wind, a panel for each.

    Args:
        names: of the observables.
        dots: colour of the windows.
        label: of the windows, in the legend.
    """
    order = np.argsort(observed.speed)
    speed = observed.speed[order]

    def panel(name: str) -> Panel:
        column = OBSERVED.index(name)
        unit, factor = unit_as_read(OBSERVABLES[name].unit)
        marks: list[Band | Line | Dots] = []
        for model in models:
            low, middle, high = model.limits[:, order, column] * factor
            marks.append(
                Band(x=speed, low=low, high=high, colour=model.colour, opacity=model.opacity)
            )
            marks.append(Line(x=speed, y=middle, colour=model.colour, label=model.label))
        read = observed.readings[order, column] * factor
        marks.append(Dots(x=speed, y=read, colour=dots, label=label, size=3.0))
        title = name if unit == "1" else f"{name} [{unit}]"
        return Panel(marks=marks, title=title, x=Axis(label="wind [m/s]"))

    panels = [panel(name) for name in names]
    columns = min(_COLUMNS, max(1, len(panels)))
    rows = [panels[start : start + columns] for start in range(0, len(panels), columns)]
    height = 2.9 if len(panels) == 1 else 2.4
    return Chart(rows=rows, height=height, width=max(4.8, 2.3 * columns))
