"""Pictures of a measurement as data URLs: the posterior, the wind series with its spectra."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
from PIL import Image, ImageDraw

from flagdata.pages.page_pictures import figure_url, still
from measure.estimate.film_answer import SHORT
from measure.estimate.film_measuring import Measurement
from measure.estimate.wind_by_window import Beside, Spectrum
from measure.film.conditioned_film import ConditionedFilm

if TYPE_CHECKING:
    pass

_BLUE, _RUST, _GRAY = "#2b6f8f", "#c4622d", "0.6"
_CROP, _BEYOND = "#e3b505", "#d8d8d8"
_SHOWN = 640
"""Longer side [px] of the picture of a film's steps."""


def steps(film: ConditionedFilm) -> str | None:
    """Draws the reference frame with all moving cloths, numbered, the outline of what is not
    frozen, and the square that is judged; None before the film was read."""
    detection, reference = film.found, film.reference
    if detection is None or reference is None:
        return None
    height, width = reference.shape
    square = detection.square
    left, top = min(0, square.x), min(0, square.y)
    right, bottom = max(width, square.x + square.side), max(height, square.y + square.side)
    scale = _SHOWN / max(right - left, bottom - top)
    picture = Image.new(
        "RGB", (round((right - left) * scale), round((bottom - top) * scale)), _BEYOND
    )
    frame = Image.fromarray(reference).resize(
        (round(width * scale), round(height * scale)), Image.Resampling.HAMMING
    )
    picture.paste(frame.convert("RGB"), (round(-left * scale), round(-top * scale)))
    pen = ImageDraw.Draw(picture)

    def at(x: float, y: float) -> tuple[float, float]:
        return (x - left) * scale, (y - top) * scale

    for number, region in enumerate(detection.regions, start=1):
        colour = _RUST if number == detection.chosen + 1 else _BLUE
        lines, _ = cv2.findContours(
            region.mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
        )
        for line in lines:
            points = [at(*vertex) for vertex in (line.reshape(-1, 2) / detection.scale).tolist()]
            pen.line([*points, points[0]], fill=colour, width=2)
        corner = at(region.box[0] / detection.scale, region.box[1] / detection.scale)
        pen.text((corner[0] + 3, corner[1] + 3), str(number), fill=colour, font_size=22)
    pen.rectangle(
        (*at(square.x, square.y), *at(square.x + square.side - 1, square.y + square.side - 1)),
        outline=_CROP,
        width=2,
    )
    return still(picture)


def corner(measured: Measurement) -> str:
    """Draws the joint posterior: each quantity by itself on the diagonal, in pairs below it."""
    from matplotlib.figure import Figure

    names, draws = measured.names, measured.draws
    count = len(names)
    side = 2.1 * count + 0.6
    figure = Figure(figsize=(side, side))
    grid = figure.add_gridspec(
        count,
        count,
        left=0.7 / side,
        right=1 - 0.1 / side,
        bottom=0.5 / side,
        top=1 - 0.1 / side,
        hspace=0.22,
        wspace=0.22,
    )
    for row in range(count):
        for column in range(row + 1):
            axes = figure.add_subplot(grid[row, column])
            if row == column:
                quantity = measured.quantities[row]
                axes.hist(
                    draws[:, row],
                    bins=40,
                    color=_BLUE if quantity.constrained else _GRAY,
                    histtype="stepfilled",
                )
                low, high = np.clip(
                    [quantity.span.low, quantity.span.high],
                    draws[:, row].min(),
                    draws[:, row].max(),
                )
                axes.axvspan(low, high, color=_RUST, alpha=0.15, linewidth=0)
                axes.set_yticks([])
            else:
                axes.hist2d(draws[:, column], draws[:, row], bins=30, cmap="Blues")
            if row == count - 1:
                axes.set_xlabel(_label(measured, column), fontsize=10)
            if column == 0 and row:
                axes.set_ylabel(_label(measured, row), fontsize=10)
            axes.tick_params(labelsize=8)
    return figure_url(figure)


def _label(measured: Measurement, index: int) -> str:
    quantity = measured.quantities[index]
    return SHORT[quantity.name] + ("" if quantity.unit == "1" else f" [{quantity.unit}]")


def series(wind_series: Beside, *, level: float) -> str:
    """Draws the wind by window with its intervals, beside the anemometer where there is one; hollow
    where p ≤ `level`, an arrow where a window gives a bound instead of a value."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.5, 3.0), layout="constrained")
    axes = figure.subplots()
    if wind_series.logged is not None and wind_series.minute is not None:
        axes.plot(
            wind_series.time,
            wind_series.logged,
            color=_BLUE,
            linewidth=1.0,
            label="anemometer, over the window",
        )
        axes.plot(
            wind_series.time,
            wind_series.minute,
            color=_BLUE,
            linewidth=1.6,
            linestyle=":",
            label="anemometer, minute mean",
        )
    bounded = np.isnan(wind_series.wind)
    axes.vlines(
        wind_series.time[~bounded],
        wind_series.low[~bounded],
        wind_series.high[~bounded],
        color=_RUST,
        alpha=0.35,
        linewidth=1.4,
    )
    if bounded.any():
        axes.plot(
            wind_series.time[bounded],
            wind_series.low[bounded],
            "^",
            markersize=5,
            color=_RUST,
            label="film, at least",
        )
    for strange, label in (
        (False, "film, with its interval"),
        (True, "film, window unlike the training data"),
    ):
        selected = ~bounded & ((wind_series.p <= level) == strange)
        if selected.any():
            face = "none" if strange else _RUST
            axes.plot(
                wind_series.time[selected],
                wind_series.wind[selected],
                "o",
                markersize=4,
                color=_RUST,
                mfc=face,
                label=label,
            )
    axes.set_title("Wind read from each window of the film", fontsize=11)
    axes.set(xlabel="time since the first frame [s]", ylabel="wind speed [m/s]", ylim=(0, None))
    axes.legend(loc="best", fontsize=9, ncols=2)
    return figure_url(figure)


def spectra(spectrum: Spectrum) -> str:
    """Draws power densities of both series, and their coherence with what chance reaches."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.5, 3.0), layout="constrained")
    power, coherent = figure.subplots(1, 2)
    power.loglog(spectrum.frequency, spectrum.logged, color=_BLUE, label="anemometer")
    power.loglog(spectrum.frequency, spectrum.estimated, color=_RUST, label="film")
    power.set(xlabel="frequency [Hz]", ylabel="power density [(m/s)²/Hz]")
    power.set_title("Power of the wind's changes", fontsize=11)
    power.legend(fontsize=9)
    coherent.semilogx(spectrum.frequency, spectrum.coherence, color=_RUST)
    coherent.axhline(
        spectrum.chance, color=_GRAY, linestyle=":", label="of unrelated series, 1 in 20"
    )
    coherent.set(xlabel="frequency [Hz]", ylabel="coherence", ylim=(0, 1))
    coherent.set_title("Coherence of film and anemometer", fontsize=11)
    coherent.legend(fontsize=9)
    return figure_url(figure)
