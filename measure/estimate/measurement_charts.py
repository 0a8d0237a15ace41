"""Charts of a measurement: the winds of its windows, their spectra, the joint posterior."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC

import numpy as np

from flagdata.answer.charts import (
    Across,
    Axis,
    Bins,
    Cells,
    Chart,
    Colour,
    Dots,
    Line,
    Mark,
    Panel,
    Shade,
)
from flagdata.answer.clock_axis import clock_axis, seconds_of_day
from flagdata.core.arrays import FloatArray
from flagdata.record.signals import WindAverage
from flagdata.timebase import NANOSECONDS, zone
from measure.estimate.film_answer import form_of
from measure.estimate.film_measuring import Measurement
from measure.estimate.wind_by_window import Beside, Spectrum

_BINS, _CELLS = 40, 30
_TICKS = (1.0, 2.0, 5.0)
"""Leading digits of ticks."""
_MOST_TICKS = 4


def winds(
    measured: Measurement,
    series: Beside,
    *,
    start: int | None,
    logged: WindAverage | None = None,
    zone_name: str | None = None,
) -> Chart:
    """Charts the wind by window with its intervals, beside the anemometer's log where there is one;
    hollow where the window is strange, an arrow where it gives a bound instead of a value.

    Args:
        start: instant of the film's first frame [UTC ns]; None where nobody said.
        logged: means of the anemometer over a second.
        zone_name: of the clocks at the place; None for UTC.
    """
    marks: list[Mark] = []
    x, first = Axis(label="time since the first frame [s]", limits=(0.0, measured.duration)), 0.0
    if start is not None:
        known = UTC if zone_name is None else zone(zone_name)
        end = start + round(measured.duration * NANOSECONDS)
        x = clock_axis(start, end, zone=known, name="" if zone_name is None else "local time")
        first = float(seconds_of_day(np.array([start]), start, zone=known)[0])
    if start is not None and logged is not None:
        seconds = (logged.time - start) / NANOSECONDS
        during = (seconds >= 0) & (seconds <= measured.duration)
        marks.append(
            Line(
                x=first + seconds[during],
                y=logged.speed[during],
                colour=Colour.LOG,
                label=f"anemometer, means over {logged.period:g} s",
            )
        )
    elif series.logged is not None:
        marks.append(
            Line(
                x=first + series.time,
                y=series.logged,
                colour=Colour.LOG,
                label="anemometer, over the window",
            )
        )
    strange = series.p <= measured.verdict.level
    for chosen, label in (
        (~strange, f"film, with its interval at {100 * measured.options.level:.3g} %"),
        (strange, "film, a window unlike the training"),
    ):
        if chosen.any():
            marks.append(
                Dots(
                    x=first + series.time[chosen],
                    y=series.wind[chosen],
                    low=series.low[chosen],
                    high=series.high[chosen],
                    hollow=strange[chosen].tolist(),
                    label=label,
                )
            )
    panel = Panel(
        marks=marks,
        x=x,
        y=Axis(label="wind [m/s]", limits=(0.0, None)),
    )
    return Chart(rows=[[panel]], height=2.6, width=5.8)


def spectra(spectrum: Spectrum) -> Chart:
    """Charts power densities of both series, and their coherence with what chance reaches."""
    x = Axis(label="frequency [Hz]", logarithmic=True)
    power = Panel(
        marks=[
            Line(x=spectrum.frequency, y=spectrum.logged, colour=Colour.LOG, label="anemometer"),
            Line(x=spectrum.frequency, y=spectrum.estimated, label="film"),
        ],
        title="Power of the wind's changes",
        x=x,
        y=Axis(label="power density [(m/s)²/Hz]", logarithmic=True),
    )
    coherent = Panel(
        marks=[
            Line(x=spectrum.frequency, y=spectrum.coherence, label="film"),
            Across(y=spectrum.chance, dashed=True, label="of unrelated series, 1 in 20"),
        ],
        title="Coherence of film and anemometer",
        x=x,
        y=Axis(label="coherence", limits=(0.0, 1.0)),
    )
    return Chart(rows=[[power, coherent]])


def corner(measured: Measurement) -> Chart:
    """Charts the joint posterior: each quantity by itself on the diagonal, in pairs below it."""
    draws, count = measured.draws, len(measured.names)
    axes = [_axis(measured, column) for column in range(count)]
    bare = Axis(ticks=())
    rows: list[Sequence[Panel]] = []
    for row in range(count):
        panels = []
        for column in range(count):
            below = axes[column] if row == count - 1 else _unlabelled(axes[column])
            if column > row:
                panels.append(Panel(marks=(), framed=False))
            elif column == row:
                panels.append(Panel(marks=_alone(measured, column), x=below, y=bare))
            else:
                beside = axes[row] if column == 0 else _unlabelled(axes[row])
                pair = _pair(draws[:, column], draws[:, row])
                panels.append(Panel(marks=[pair], x=below, y=beside))
        rows.append(panels)
    return Chart(rows=rows, height=9.2 / max(count, 3) * 0.8, legend=False)


def _alone(measured: Measurement, column: int) -> list[Mark]:
    quantity, draws = measured.quantities[column], measured.draws[:, column]
    heights, edges = np.histogram(draws, bins=_BINS)
    low, high = np.clip([quantity.span.low, quantity.span.high], draws.min(), draws.max()).tolist()
    colour = Colour.FILM if quantity.constrained else Colour.QUIET
    return [Shade(x=(low, high)), Bins(edges=edges, heights=heights.astype(float), colour=colour)]


def _pair(x: FloatArray, y: FloatArray) -> Cells:
    counts, x_edges, y_edges = np.histogram2d(x, y, bins=_CELLS)
    return Cells(values=np.where(counts > 0, counts, np.nan).T, x=x_edges, y=y_edges)


def _axis(measured: Measurement, column: int) -> Axis:
    """Makes the axis of a quantity's draws, with ticks in the unit that people use."""
    form, draws = form_of(measured.quantities[column]), measured.draws[:, column]
    title = form.title.replace(", ", ",\n").replace(" over ", "\nover ")
    label = title + ("" if form.unit == "1" else f"\n[{form.unit}]")
    if form.convert is float:
        return Axis(label=label)
    places = np.linspace(draws.min(), draws.max(), 200)
    shown = [form.convert(place) for place in places.tolist()]
    powers = range(int(np.floor(np.log10(shown[0]))), int(np.ceil(np.log10(shown[-1]))) + 1)
    values = [digit * 10.0**power for power in powers for digit in _TICKS]
    inside = [value for value in values if shown[0] <= value <= shown[-1]]
    if len(inside) < 2:
        inside = [float(f"{value:.3g}") for value in (shown[50], shown[150])]
    chosen = inside[:: -(-len(inside) // _MOST_TICKS) or 1]
    ticks = np.interp(chosen, shown, places).tolist()
    return Axis(label=label, ticks=ticks, texts=[f"{value:g}" for value in chosen])


def _unlabelled(axis: Axis) -> Axis:
    return Axis(ticks=axis.ticks, texts=axis.texts)
