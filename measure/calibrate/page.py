"""A calibration as one HTML file that refers to no other."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from flagdata.pages.pictures import figure_url
from flagdata.pages.render import render
from flagdata.provenance import code_version
from flagdata.tables import Range, Scale
from measure.calibrate.calibrate import Calibration, Fitted, Quantity
from measure.calibrate.panels import Band, against_wind
from measure.calibrate.prior import CLOTH
from measure.calibrate.simulation import OBSERVED
from measure.estimate.page import Section

_BLUE, _RUST = "#2b6f8f", "#c4622d"
_DEGREES = ("azimuth", "elevation")


def page(found: Calibration, provenance: Mapping[str, str], *, sections: Sequence[Section] = ()) -> str:
    """The page.

    Args:
        provenance: rows of a table, in order.
        sections: what comes before it, each under its own heading.
    """
    check = found.check
    values = {
        "name": ", ".join(one.observed.name for one in found.recordings),
        "sentence": found.sentence,
        "tone": "settled" if found.weight.value is not None else "open" if found.weighs else "missed",
        "findings": [{"severity": f.severity.value, "what": f.what, "fix": f.fix} for f in found.findings],
        "level": f"{found.options.level * 100:.3g} %",
        "cloth": [shown(q) for q in found.cloth],
        "stated": found.stated,
        "posterior": None if found.withheld else _posterior(found),
        "recordings": [
            {
                "name": one.observed.name,
                "windows": len(one.observed.readings),
                "wind": f"{one.observed.speed.mean():.1f}",
                "misfit": f"{one.misfit:.2g}",
                "place": [shown(q) for q in place],
                "picture": _windows(one),
            }
            for one, place in zip(found.recordings, found.places, strict=True)
        ],
        "check": {"count": check.count, "held": check.held, "error": f"{check.error:.1%}"},
        "sections": list(sections),
        "provenance": {**provenance, "code": code_version()},
    }
    return render("measure.calibrate", "page.html.j2", values)


def shown(one: Quantity) -> dict[str, str]:
    """A quantity as text: angles in degrees, and as `interval` what its values can be: both ends, or a bound with its
    level."""
    turn = 180 / math.pi if one.name in _DEGREES else 1.0
    least, most = one.assumed
    unit = "" if one.unit == "1" else one.unit
    known = one.span.worded(lambda value: f"{value * turn:.3g}")
    return {
        "name": one.name.replace("_", " "),
        "unit": "°" if one.name in _DEGREES else unit,
        "value": "" if one.value is None else f"{one.value * turn:.3g}",
        "bounded": "yes" if one.bounded else "",
        "interval": known,
        "level": f"{one.span.level * 100:.3g} %",
        "assumed": f"{least * turn:.3g} to {most * turn:.3g}",
    }


def _posterior(found: Calibration) -> str:
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    figure = Figure(figsize=(9.0, 2.6), layout="constrained")
    for axes, about in zip(figure.subplots(1, len(CLOTH)), CLOTH, strict=True):
        low, high = about.at(np.array([0.0, 1.0])).tolist()
        logarithmic = isinstance(about.prior, Range) and about.prior.scale is Scale.LOG
        edges = np.geomspace(low, high, 41) if logarithmic else np.linspace(low, high, 41)
        axes.hist(found.draws.cloth[about.name], bins=edges, color=_BLUE)
        axes.axhline(len(found.draws.cloth[about.name]) / 40, color=_RUST)
        if logarithmic:
            axes.set_xscale("log")
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 30 * low else (1.0,)))
            axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_xlabel(f"{about.name.replace('_', ' ')} [{about.unit}]")
        axes.set_yticks([])
    return figure_url(figure)


def _windows(one: Fitted) -> str:
    names = [name for name, used in zip(OBSERVED, one.used, strict=True) if used]
    band = Band(found=np.stack([one.low, one.middle, one.high]), colour=_RUST)
    return against_wind(one.observed, names, [band], dots=_BLUE, opacity=0.3)
