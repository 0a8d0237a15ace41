"""What a page says of a measured film: its first screen, and the sections below."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from flagdata.answer import Figure, Gallery, Head, Quantity, Section, Table
from flagdata.answer.answer import Part
from flagdata.answer.circumstances import Circumstances, list_circumstances
from flagdata.answer.wind_elsewhere import WindComparison
from flagdata.core.findings import Finding, Severity
from flagdata.pages.page_pictures import moving
from measure.estimate import measurement_charts
from measure.estimate.film_answer import FORMS, HEADLINE, SHORT, form_of
from measure.estimate.film_measuring import Measurement
from measure.estimate.measurement_pictures import steps
from measure.estimate.nearest import Neighbour
from measure.estimate.wind_by_window import Beside
from measure.film.film_source import Subject

_SIDE = 220  # px of a clip
FindNeighbours = Callable[[], tuple[Sequence[Neighbour], int]]
"""Seeks the simulated clips nearest to a film, and says among how many."""


def make_head(
    measured: Measurement,
    series: Beside,
    subject: Subject,
    *,
    anyway: bool,
    rate: float,
    circumstances: Circumstances | None = None,
    elsewhere: WindComparison | None = None,
) -> Head:
    """Makes the first screen: the film, its winds beside the anemometer's, and the facts about
    them.

    Args:
        anyway: whether estimates are shown although the gate refused the film. Where there is
            nothing to measure, none are.
        rate: of the network's frames [Hz].
        circumstances: when, where and with what it was recorded; None for those of the film alone.
        elsewhere: the comparison with a wind from elsewhere; None where none was stated.
    """
    shown, film = measured.shown(anyway=anyway), subject.film
    stated = circumstances or subject.circumstances(None)
    spacing = measured.windows[0].end - measured.windows[0].start
    clip_rate = (len(measured.clip) - 1) / spacing if spacing > 0 else rate
    figures = [
        Figure(
            title="The film, as the network sees it",
            content=lambda: moving(measured.clip, rate=clip_rate, side=_SIDE),
            caption="The film, as the network sees it.",
            width=_SIDE,
        )
    ]
    if shown and (len(series.time) > 1 or series.logged is not None):
        logged = None if subject.record is None else subject.record.wind_1hz()
        chart = measurement_charts.winds(
            measured, series, start=film.start, logged=logged, zone_name=stated.zone
        )
        figures.append(
            Figure(
                title="Wind of each window of the film, beside the anemometer's"
                if series.logged is not None
                else "Wind of each window of the film",
                content=chart,
            )
        )
    elif (picture := _steps_figure(subject)) is not None:
        figures.append(picture)
    compared = {} if elsewhere is None else {"wind elsewhere": _sentence(elsewhere.sentence)}
    facts = {
        **list_circumstances([replace(stated, seconds=measured.duration)]),
        "film": f"{measured.duration:.3g} s at {measured.rate:.4g} frames a second",
        "size of the flag": _size(measured),
        **(_cloth(measured) if shown else {}),
        **({} if measured.gusts is None or not shown else {"gusts": measured.gusts.words}),
        "like the training": _windows(measured),
        **compared,
        **_simulated(subject.known or {}),
    }
    remarks = [] if elsewhere is None else [_sentence(elsewhere.advice)]
    return Head(
        figures=figures, facts=facts, limits=_limits(measured, anyway=anyway), remarks=remarks
    )


def make_sections(
    measured: Measurement,
    series: Beside,
    subject: Subject,
    *,
    anyway: bool,
    rate: float,
    neighbours: FindNeighbours | None = None,
    more: Sequence[Section] = (),
) -> list[Section]:
    """Makes the sections below, all folded.

    Args:
        anyway, rate: as of `make_head`.
        neighbours: seeks the nearest simulated clips; None where there is no lake.
        more: sections of others, such as a refinement's.
    """
    sections: list[Section] = []
    if measured.shown(anyway=anyway):
        sections.append(_quantities(measured))
        if series.logged is not None:
            sections.append(_beside(series))
    sections += more
    if neighbours is not None and (near := _neighbours(*neighbours(), rate)):
        sections.append(near)
    in_head = not measured.shown(anyway=anyway) or (len(series.time) < 2 and series.logged is None)
    if (picture := _steps_figure(subject)) is not None and not in_head:
        sections.append(
            Section(title="How the film was made fit", parts=[picture], anchor="fit", folded=True)
        )
    verdict = measured.verdict
    judged: list[Part] = [_sentence(verdict.sentence)]
    if not verdict.refused:
        judged += [_sentence(reason.what) for reason in verdict.reasons]
    sections.append(
        Section(title="Whether the network can judge it", parts=judged, anchor="gate", folded=True)
    )
    return sections


def _limits(measured: Measurement, *, anyway: bool) -> list[Finding]:
    """Selects what limits the answer, or why there is none: the gate's reasons, warnings, and what
    is part of the answer."""
    verdict = measured.verdict
    reasons = [reason.finding for reason in verdict.reasons] if verdict.refused else []
    said = {reason.kind for reason in reasons}
    parts = measured.bounds if measured.shown(anyway=anyway) else ()
    return reasons + [
        one
        for one in measured.notices(anyway=anyway)
        if one.kind not in said and (one.severity is not Severity.NOTE or one in parts)
    ]


def _sentence(text: str) -> str:
    """Makes a sentence of words: a capital before, a full stop behind."""
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."


def _size(measured: Measurement) -> str:
    size = measured.options.size
    if size is not None:
        return f"{size.length:g} m × {size.height:g} m, as given"
    return "several are considered, as none was given"


def _cloth(measured: Measurement) -> dict[str, str]:
    """Returns the cloth's weight where the sentence does not state it."""
    for quantity in measured.quantities:
        if quantity.name == HEADLINE[1] and not (
            quantity.constrained and not measured.verdict.refused
        ):
            return {SHORT[quantity.name]: _words(quantity)}
    return {}


def _words(quantity: Quantity) -> str:
    form = form_of(quantity)
    if quantity.constrained:
        return f"{_value(quantity)} {_interval(quantity)}{form.suffix}".strip()
    low, high = map(form.number, quantity.assumed or quantity.interval)
    ends = (low if low == high else f"{low} to {high}") + form.suffix
    return f"{ends}, as given" if quantity.given else f"not constrained by this film ({ends})"


def _windows(measured: Measurement) -> str:
    strange, count = measured.verdict.strange_count, len(measured.verdict.window_p)
    familiar = f"{count - strange} of {count} windows" if strange else f"all {count} windows"
    apart = measured.combined < count - strange and not measured.verdict.refused
    return familiar + (f"; the answer rests on {measured.combined} that are apart" if apart else "")


def _simulated(known: Mapping[str, float]) -> dict[str, str]:
    truths = [
        f"{form.title} {known[name]:.3g}{form.suffix}"
        for name, form in FORMS.items()
        if name in HEADLINE and name in known
    ]
    return {"simulated with": ", ".join(truths)} if truths else {}


def _quantities(measured: Measurement) -> Section:
    percent = f"{measured.options.level * 100:.3g} %"
    columns = ["quantity", "value", percent, "before the film", "learned from it [nat]"]
    rows = [
        [
            form_of(quantity).title,
            *_cells(quantity),
            "" if quantity.information is None else f"{quantity.information:.2f}",
        ]
        for quantity in measured.quantities
    ]
    combined, alike = measured.combined, measured.dependence
    rests = f"The answer rests on {combined} of {len(measured.verdict.window_p)} windows"
    if combined > 1:
        in_wind = "" if measured.gusts is not None else f"{alike.wind:.2f} in wind and "
        rests += (
            f": one cloth, a wind for each. Their errors count as correlated by {in_wind}"
            f"{alike.cloth:.2f} in cloth ({alike.source})"
        )
    corner = Figure(
        title="Joint posterior of the quantities",
        content=lambda: measurement_charts.corner(measured),
        caption="Draws of all quantities, and of their pairs. Shaded: the interval. Gray: not "
        "constrained by the film.",
    )
    return Section(
        title="All quantities",
        parts=[
            Table(columns=columns, rows=rows),
            f"{rests}.",
            corner,
        ],
        anchor="quantities",
        folded=True,
    )


def _cells(quantity: Quantity) -> list[str]:
    """Returns value, interval and what was assumed, in the quantity's unit."""
    form = form_of(quantity)
    low, high = map(form.number, quantity.assumed or quantity.interval)
    assumed = f"{low if low == high else f'{low} to {high}'}{form.suffix}"
    if not quantity.constrained:
        return ["", "as given" if quantity.given else "not constrained", assumed]
    return [_value(quantity), _interval(quantity), assumed]


def _value(quantity: Quantity) -> str:
    form = form_of(quantity)
    return "" if quantity.value is None else f"{form.number(quantity.value)}{form.suffix}"


def _interval(quantity: Quantity) -> str:
    form, span = form_of(quantity), quantity.span
    if span.bound is None:
        return span.word(form.number)
    return f"{span.word(form.number, form.suffix)} ({span.percent})"


def _beside(series: Beside) -> Section:
    parts: list[Part] = []
    for title, agreement in (("over the window", series.window), ("minute mean", series.of_minute)):
        said = "the anemometer was silent" if agreement is None else agreement.sentence
        parts.append(f"Against the anemometer, {title}: {said}.")
    if series.delay is not None:
        parts.append(f"Clocks: {series.delay.sentence}.")
    if series.spectrum is not None:
        spectrum = series.spectrum
        parts += [
            Figure(
                title="Spectra and coherence of film and anemometer",
                content=lambda: measurement_charts.spectra(spectrum),
            ),
            f"{spectrum.sentence}.",
        ]
    return Section(
        title="The film beside the anemometer", parts=parts, anchor="anemometer", folded=True
    )


def _neighbours(neighbours: Sequence[Neighbour], compared: int, rate: float) -> Section | None:
    if not neighbours:
        return None
    note = (
        f"The nearest of {compared} simulated clips drawn from the lake, by the distance of the "
        "summaries that the network makes of them."
    )
    return Section(
        title="The simulated clips nearest to the film",
        parts=[
            Gallery(figures=[_neighbour(one, rate) for one in neighbours]),
            note,
        ],
        anchor="nearest",
        folded=True,
    )


def _neighbour(neighbour: Neighbour, rate: float) -> Figure:
    known = ", ".join(
        f"{SHORT[name]} {FORMS[name].number(neighbour.known[name])}{FORMS[name].suffix}"
        for name in HEADLINE
        if name in neighbour.known
    )
    return Figure(
        title="Simulated clip",
        content=lambda: moving(neighbour.frames, rate=rate, side=_SIDE),
        caption=f"Simulated: {known}; {neighbour.distance:.1f} standard deviations away.",
        width=_SIDE,
    )


def _steps_figure(subject: Subject) -> Figure | None:
    picture = steps(subject.film)
    if picture is None:
        return None
    return Figure(
        title="A frame with the moving cloths numbered and the square that is judged",
        content=picture,
        caption="A frame of the film. Rust: all places that the cloth visits; outside of them the "
        "film is frozen. Blue: other moving cloths, which --flag chooses by their numbers. Yellow: "
        "the square that is judged.",
    )
