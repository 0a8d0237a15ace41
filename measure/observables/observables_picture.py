"""The observables of a film as one picture: each against time, and against the log's wind where
there is one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from measure.observables.observables_by_name import OBSERVABLES
from measure.observables.observables_table import ObservableTable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BLUE, _RUST = "#2b6f8f", "#c4622d"


def picture(table: ObservableTable) -> Figure:
    """Draws a row an observable: over time on the left, over the wind on the right; bars of one
    sigma of the pixels."""
    from matplotlib.figure import Figure

    names = list(table.readings)
    columns = 1 if table.wind is None else 2
    figure = Figure(figsize=(4.8 * columns, 1.7 * len(names)), layout="constrained")
    grid = figure.subplots(len(names), columns, squeeze=False, sharex="col")
    for row, name in zip(grid, names, strict=True):
        about, values = OBSERVABLES[name], table.values(name)
        label = name if about.unit == "1" else f"{name} [{about.unit}]"
        row[0].errorbar(table.time, values, about.sigma, fmt="o", ms=3, lw=0.8, color=_RUST)
        row[0].set_ylabel(label, fontsize=8)
        if table.wind is not None:
            row[1].errorbar(table.wind, values, about.sigma, fmt="o", ms=3, lw=0.8, color=_BLUE)
        for axes in row:
            axes.tick_params(labelsize=7)
            if not np.isfinite(values).any():
                axes.text(0.5, 0.5, "not shown", transform=axes.transAxes, ha="center", fontsize=8)
    grid[-1][0].set_xlabel("time since the first frame [s]", fontsize=8)
    if table.wind is not None:
        grid[-1][1].set_xlabel("wind of the log, mean of the window [m/s]", fontsize=8)
    return figure
