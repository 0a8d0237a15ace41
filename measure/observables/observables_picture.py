"""The observables of a film as one chart: each against time, and against the log's wind where there
is one."""

from __future__ import annotations

import numpy as np

from flagdata.answer.charts import Axis, Chart, Colour, Dots, Note, Panel
from flagdata.answer.quantity import unit_as_read
from flagdata.core.arrays import FloatArray
from measure.observables.observables_by_name import OBSERVABLES
from measure.observables.observables_table import ObservableTable


def chart_of_table(table: ObservableTable) -> Chart:
    """Makes a row an observable: over time on the left, over the wind on the right; bars of one
    sigma of the pixels."""
    rows = []
    for number, name in enumerate(table.readings, start=1):
        last = number == len(table.readings)
        panels = [_panel(table, name, table.time, Colour.FILM, _TIME if last else "")]
        if table.wind is not None:
            panels.append(_panel(table, name, table.wind, Colour.LOG, _WIND if last else ""))
        rows.append(panels)
    return Chart(rows=rows, height=1.7, width=4.8 * len(rows[0]))


_TIME = "time since the first frame [s]"
_WIND = "wind of the log, mean of the window [m/s]"


def _panel(table: ObservableTable, name: str, x: FloatArray, colour: Colour, label: str) -> Panel:
    about = OBSERVABLES[name]
    unit, factor = unit_as_read(about.unit)
    values, sigma = table.values(name) * factor, about.sigma * factor
    marks: list[Dots | Note] = [
        Dots(x=x, y=values, low=values - sigma, high=values + sigma, colour=colour, size=3.0)
    ]
    finite = x[np.isfinite(x)]
    if not np.isfinite(values).any() and len(finite):
        marks.append(Note(x=float(finite[0]), y=0.0, text="not shown"))
    title = name if unit == "1" else f"{name} [{unit}]"
    ends = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    margin = 0.03 * max(ends[1] - ends[0], 1e-9)
    return Panel(
        marks=marks,
        title=title,
        x=Axis(label=label, limits=(ends[0] - margin, ends[1] + margin)),
    )
