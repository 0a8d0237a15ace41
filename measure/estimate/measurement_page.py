"""A measurement as one HTML file that refers to no other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from flagdata.answer import Quantity
from flagdata.answer.wind_elsewhere import WindComparison
from flagdata.core.provenance import code_version
from flagdata.pages.page_pictures import moving
from flagdata.pages.render import render
from measure.estimate import measurement_pictures
from measure.estimate.film_answer import SHORT
from measure.estimate.film_measuring import Measurement
from measure.estimate.nearest import Neighbour
from measure.estimate.wind_by_window import Agreement, Beside

_SIDE = 220  # px of a clip


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of the page that another program made, such as a refinement by simulation.

    Attributes:
        anchor: its id in the page.
        title: its heading.
        body: HTML, already escaped.
    """

    anchor: str
    title: str
    body: Markup


@dataclass(frozen=True, kw_only=True, eq=False)
class Context:
    """What the page says of where a measurement is from.

    Attributes:
        provenance: rows of a table, in order.
        known: what a simulated film states of itself; empty for a real one.
        neighbours, compared: the nearest simulated clips, of so many; none where no lake was given.
        rate: of the network's frames [Hz].
        steps: picture of how the film was made fit, as a URL; None where it was too short for it.
        figures: what was measured for that, in sentences.
        elsewhere: the comparison with a wind from elsewhere; None where none was stated or no
            estimate is shown.
    """

    provenance: Mapping[str, str]
    known: Mapping[str, float]
    neighbours: Sequence[Neighbour]
    compared: int
    rate: float
    steps: str | None = None
    figures: Sequence[str] = ()
    elsewhere: WindComparison | None = None


def page(
    measured: Measurement,
    series: Beside,
    context: Context,
    *,
    anyway: bool,
    sections: Sequence[Section] = (),
) -> str:
    """Renders the page.

    Args:
        anyway: whether estimates are shown although the gate refused the film; they are marked
            then. Where there is nothing to measure, none are shown.
        sections: what comes between the answer and its provenance, each under its own heading.
    """
    shown, noticed = measured.shown(anyway=anyway), measured.notices(anyway=anyway)
    rows = [_row(quantity, context.known) for quantity in measured.quantities]
    spacing = measured.windows[0].end - measured.windows[0].start
    clip_rate = (len(measured.clip) - 1) / spacing if spacing > 0 else context.rate
    values = {
        "film": measured.film,
        "shown": shown,
        "refused": measured.verdict.refused,
        "gate": measured.verdict.sentence,
        "reasons": [reason.what for reason in measured.verdict.reasons],
        "answer": measured.sentence,
        "rows": rows,
        "unconstrained": [row for row in rows if not row["constrained"]],
        "wind": next(
            (row for row in rows if row["name"] == SHORT["wind_speed"] and row["constrained"]), None
        ),
        "simulated": bool(context.known),
        "level": f"{measured.options.level * 100:.3g} %",
        "clip": moving(measured.clip, rate=clip_rate, side=_SIDE),
        "neighbours": [_neighbour(one, context.rate) for one in context.neighbours],
        "compared": context.compared,
        "steps": context.steps,
        "figures": list(context.figures),
        "elsewhere": context.elsewhere,
        "corner": measurement_pictures.corner(measured) if shown else None,
        "series": measurement_pictures.series(series, level=measured.verdict.level)
        if shown and len(series.time) > 1
        else None,
        "spectra": None
        if series.spectrum is None or not shown
        else measurement_pictures.spectra(series.spectrum),
        "coherence": None if series.spectrum is None or not shown else series.spectrum.sentence,
        "agreement": [
            _agreement("over the window", series.window),
            _agreement("minute mean", series.of_minute),
        ]
        if series.logged is not None and shown
        else [],
        "delay": _delay(series) if shown else None,
        "windows": len(measured.verdict.window_p),
        "combined": measured.combined,
        "dependence": measured.dependence,
        "gusts": None if measured.gusts is None or not shown else measured.gusts.sentence,
        "findings": [{"severity": f.severity.value, "what": f.what, "fix": f.fix} for f in noticed],
        "sections": list(sections),
        "provenance": {**context.provenance, "code": code_version()},
    }
    return render("measure.estimate", "page.html.j2", values)


def _row(quantity: Quantity, truths: Mapping[str, float]) -> dict[str, str | bool]:
    digits = 3 if quantity.name == "area_weight" else 2
    truth = truths.get(quantity.name)
    bound_level = "" if quantity.bound is None else f" ({quantity.span.percent})"
    low, high = quantity.assumed or quantity.interval
    return {
        "name": SHORT[quantity.name],
        "unit": "" if quantity.unit == "1" else quantity.unit,
        "constrained": quantity.constrained,
        "value": "" if quantity.value is None else f"{quantity.value:.{digits}f}",
        "interval": quantity.span.phrase(digits) + bound_level,
        "assumed": f"{low:.{digits}f} to {high:.{digits}f}",
        "information": "" if quantity.information is None else f"{quantity.information:.2f}",
        "range": quantity.span.phrase(digits),
        "level": quantity.span.percent,
        "known": "" if truth is None else f"{truth:.{digits}f}",
    }


def _neighbour(neighbour: Neighbour, rate: float) -> dict[str, str]:
    figures = [
        f"{SHORT[name]} {neighbour.known[name]:.{digits}f} {unit}"
        for name, digits, unit in (("wind_speed", 1, "m/s"), ("area_weight", 3, "kg/m²"))
        if name in neighbour.known
    ]
    return {
        "name": neighbour.name,
        "image": moving(neighbour.frames, rate=rate, side=_SIDE),
        "known": ", ".join(figures),
        "distance": f"{neighbour.distance:.1f}",
    }


def _agreement(title: str, agreement: Agreement | None) -> dict[str, str]:
    if agreement is None:
        return {"title": title, "text": "the anemometer was silent"}
    return {"title": title, "text": agreement.sentence}


def _delay(series: Beside) -> str | None:
    if series.delay is None:
        return None
    if series.delay.offset is None or series.delay.reasons:
        return (
            "no delay between film and anemometer could be estimated: "
            f"{'; '.join(series.delay.reasons)}"
        )
    sigma = "" if series.delay.sigma is None else f" ± {series.delay.sigma:.2f} s (1 σ)"
    return (
        f"{series.delay.offset:+.2f} s{sigma} are to be added to the film's clock to reach the "
        "anemometer's"
    )
