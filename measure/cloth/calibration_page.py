"""A calibration as one HTML file that refers to no other, with each recording's observables against
the wind."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.answer import Quantity
from flagdata.core.arrays import FloatArray
from flagdata.core.provenance import code_version
from flagdata.pages.page_pictures import figure_url, still
from flagdata.pages.render import render
from flagdata.recipes.typed_tables import Range, Scale
from measure.cloth.cloth_calibration import Calibration, Fitted
from measure.cloth.flag_prior import CLOTH
from measure.cloth.flag_simulation import OBSERVED
from measure.cloth.observed_recording import Observed
from measure.estimate.measurement_page import Section
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


_BLUE, _RUST = "#2b6f8f", "#c4622d"
_SIDE = 280
"""Of a film's frame [px]."""
_DEGREES = ("azimuth", "elevation")


def calibration_page(
    calibration: Calibration, provenance: Mapping[str, str], *, sections: Sequence[Section] = ()
) -> str:
    """Returns the page, HTML.

    Args:
        provenance: rows of a table, in order.
        sections: what comes before it, each under its own heading.
    """
    check = calibration.check
    values = {
        "name": ", ".join(recording.observed.name for recording in calibration.recordings),
        "sentence": calibration.sentence,
        "tone": "settled"
        if calibration.weight.value is not None
        else "open"
        if calibration.weighs
        else "missed",
        "findings": [
            {"severity": f.severity.value, "what": f.what, "fix": f.fix}
            for f in calibration.findings
        ],
        "level": f"{calibration.options.level * 100:.3g} %",
        "cloth": [shown_quantity(q) for q in calibration.cloth],
        "stated": calibration.stated,
        "films": [
            {"name": one.name, "picture": still(one.excerpt.window.frames[0], side=_SIDE)}
            for one in (recording.observed for recording in calibration.recordings)
            if one.excerpt is not None
        ],
        "posterior": None if calibration.withheld else _posterior(calibration),
        "recordings": [
            {
                "name": recording.observed.name,
                "windows": len(recording.observed.readings),
                "wind": f"{recording.observed.speed.mean():.1f}",
                "misfit": f"{recording.misfit:.2g}",
                "place": [shown_quantity(q) for q in view],
                "picture": _windows_picture(recording),
            }
            for recording, view in zip(calibration.recordings, calibration.places, strict=True)
        ],
        "check": {"count": check.count, "held": check.contained, "error": f"{check.error:.1%}"},
        "sections": list(sections),
        "provenance": {**provenance, "code": code_version()},
    }
    return render("measure.cloth", "calibration.html.j2", values)


def shown_quantity(quantity: Quantity) -> dict[str, str]:
    """Returns a quantity as text: angles in degrees, and as `interval` what its values can be: both
    ends, or a bound with its level."""
    turn = 180 / math.pi if quantity.name in _DEGREES else 1.0
    least, most = quantity.assumed or quantity.interval
    unit = "" if quantity.unit == "1" else quantity.unit
    interval = quantity.span.word(lambda value: f"{value * turn:.3g}")
    return {
        "name": quantity.name.replace("_", " "),
        "unit": "°" if quantity.name in _DEGREES else unit,
        "value": "" if quantity.value is None else f"{quantity.value * turn:.3g}",
        "bounded": "yes" if quantity.is_bound else "",
        "interval": interval,
        "level": quantity.span.percent,
        "assumed": f"{least * turn:.3g} to {most * turn:.3g}",
    }


def _posterior(calibration: Calibration) -> str:
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    figure = Figure(figsize=(9.0, 2.6), layout="constrained")
    for axes, about in zip(figure.subplots(1, len(CLOTH)), CLOTH, strict=True):
        low, high = about.at(np.array([0.0, 1.0])).tolist()
        logarithmic = isinstance(about.prior, Range) and about.prior.scale is Scale.LOG
        edges = np.geomspace(low, high, 41) if logarithmic else np.linspace(low, high, 41)
        axes.hist(calibration.draws.cloth[about.name], bins=edges, color=_BLUE)
        quantity = next(one for one in calibration.cloth if one.name == about.name)
        if quantity.value is not None or quantity.is_bound:
            ends = max(low, quantity.span.low), min(high, quantity.span.high)
            axes.axvspan(*ends, color=_RUST, alpha=0.15, linewidth=0)
        axes.axhline(
            len(calibration.draws.cloth[about.name]) / 40, color=_RUST
        )  # the prior: the bins have equal shares of it
        if logarithmic:
            axes.set_xscale("log")
            axes.xaxis.set_major_locator(
                LogLocator(subs=(1.0, 2.0, 5.0) if high < 30 * low else (1.0,))
            )
            axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_title(about.name.replace("_", " "), fontsize=11)
        axes.set_xlabel(f"{about.name.replace('_', ' ')} [{about.unit}]")
        axes.set_ylabel("share of draws")
        axes.set_yticks([])
    return figure_url(figure)


def _windows_picture(recording: Fitted) -> str:
    names = [name for name, used in zip(OBSERVED, recording.used, strict=True) if used]
    band = Band(limits=np.stack([recording.low, recording.middle, recording.high]), colour=_RUST)
    return against_wind(recording.observed, names, [band], dots=_BLUE, opacity=0.3)
