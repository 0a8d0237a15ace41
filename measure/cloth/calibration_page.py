"""Each observable of a recording against the wind, as the page of a verdict on films shows it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.pages.page_pictures import figure_url
from measure.cloth.flag_simulation import OBSERVED
from measure.cloth.observed_recording import Observed
from measure.observables import OBSERVABLES


@dataclass(frozen=True, kw_only=True, eq=False)
class Band:
    """The range of each observable that a model predicts, drawn as a band.

    Attributes:
        limits: (3, window, observable): low, middle and high.
        colour: of the band and of its middle.
    """

    limits: FloatArray
    colour: str


def against_wind(
    observed: Observed, names: Sequence[str], bands: Sequence[Band], *, dots: str, opacity: float
) -> str:
    """Draws each observable against the wind, a panel for each, and returns the picture as a data
    URL.

    Args:
        names: of the observables.
        dots: colour of the windows.
        opacity: of the bands.
    """
    from matplotlib.figure import Figure

    columns = min(4, len(names))
    rows = math.ceil(len(names) / columns)
    figure = Figure(figsize=(2.75 * columns, 2.5 * rows), layout="constrained")
    cells = figure.subplots(rows, columns, squeeze=False).ravel()
    speed = observed.speed
    order = np.argsort(speed)
    for axes, name in zip(cells, names, strict=False):
        column = OBSERVED.index(name)
        for band in bands:
            low, middle, high = band.limits[:, order, column]
            axes.fill_between(speed[order], low, high, color=band.colour, alpha=opacity)
            axes.plot(speed[order], middle, color=band.colour)
        axes.plot(speed, observed.readings[:, column], ".", color=dots)
        unit = OBSERVABLES[name].unit
        axes.set_title(name if unit == "1" else f"{name} [{unit}]", fontsize=10)
        axes.set_xlabel("wind [m/s]")
    for axes in cells[len(names) :]:
        axes.remove()
    return figure_url(figure)
