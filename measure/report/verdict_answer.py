"""A verdict as an answer: what it says aloud, on its first screen, and in quantities; and the
sections of one by markers."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from markupsafe import Markup

from flagdata.answer.answer import Cell, Figure, Head, Part, Section, Table, Tone
from flagdata.answer.circumstances import Circumstances, list_circumstances
from flagdata.answer.closed import Closed
from measure.report import verdict_cells as cells
from measure.report import verdict_sections as sections
from measure.report import verdict_sentences
from measure.report.document import as_document
from measure.report.error_maps import effect_chart, mean_shade, residual_chart, size_shade
from measure.report.lead_sentences import evidence, explained_words, lead, spoken
from measure.report.moving_cloth import moving_figure
from measure.report.recordings_chart import recording_chart
from measure.report.verdict_arrays import arrays_of
from measure.report.verdict_charts import errors_chart, gains_chart, strengths_chart, wind_chart
from measure.report.verdict_sentences import list_names, readable, shorten_list
from measure.report.verdict_words import words
from measure.trajectories.trajectory import Experiment
from measure.verdict import quantity
from measure.verdict.quantity import number, probability
from measure.verdict.verdict_record import Conclusion, Residual, Verdict

TONES = {
    Conclusion.UNTESTED: Tone.OPEN,
    Conclusion.SUFFICIENT: Tone.SETTLED,
    Conclusion.UNDECIDED: Tone.OPEN,
    Conclusion.EFFECT: Tone.SETTLED,
    Conclusion.ONE_OF: Tone.OPEN,
    Conclusion.PARTLY: Tone.OPEN,
    Conclusion.OUTSIDE: Tone.MISSED,
}
_CHART = 620
"""Most that a chart is wide which a telephone shows without scrolling [px]."""
_TERMS = Markup(
    '<span class="small"><a href="#{}">What p, floor and the other terms mean</a></span>'
)


def answer_of_markers(
    verdict: Verdict, *, subject: str = "", experiment: Experiment | None = None
) -> Closed:
    """Makes the answer of a verdict by markers.

    Args:
        subject: what was judged; the names of the recordings where it is empty.
        experiment: whose cloth, wind and tracks are shown beside; None where a verdict is all
            that is known.
    """
    names = [residual.recording for residual in verdict.residuals]
    return closed(
        verdict,
        subject=subject or (list_names(shorten_list(names)) if names else "recordings"),
        words=words(verdict),
        figures=_head_figures(verdict),
        facts={
            **_recorded(verdict.residuals),
            **({} if experiment is None else _facts_of(experiment)),
        },
        make_sections=lambda: _sections(verdict, experiment),
    )


def closed(
    verdict: Verdict,
    *,
    subject: str,
    words: str,
    figures: Sequence[Figure],
    facts: Mapping[str, str],
    make_sections: Callable[[], Sequence[Section]],
) -> Closed:
    """Makes the answer of a verdict of either kind.

    Args:
        subject: what was judged.
        words: the verdict for a terminal.
        figures, facts: of the first screen.
        make_sections: makes what follows there.
    """
    strengths = {
        candidate.effect: replace(candidate.strength, name=candidate.parameter)
        for candidate in verdict_sentences.named_candidates(verdict)
    }
    parameters = {one.name: replace(one.before, name=one.name) for one in verdict.parameters}
    return Closed(
        question="close-loop",
        subject=subject,
        sentence=spoken(verdict),
        tone=TONES[verdict.conclusion],
        quantities={**strengths, **parameters},
        arrays=arrays_of(verdict),
        document=as_document(verdict),
        head=Head(
            figures=figures,
            facts={**facts, **_weighed(verdict)},
            limits=_limits(verdict),
            remarks=[_TERMS.format(sections.GLOSSARY_ANCHOR)],
        ),
        make_sections=make_sections,
        provenance={
            **dict(_flatten(verdict.provenance)),
            "time taken": f"{number(verdict.seconds)} s",
        },
        conclusion=verdict.conclusion.value,
        named=verdict.named,
        words=words,
        p_value=verdict.test.p_value.point,
        strengths=strengths,
    )


def errors_figure(verdict: Verdict, *, unseen: str = "data") -> Figure | None:
    """Makes the figure of errors before and after; None where the base model is alone.

    Args:
        unseen: what the errors are of.
    """
    after = verdict_sentences.after_label(verdict)
    chart = errors_chart(verdict.comparisons, after=after)
    if chart is None:
        return None
    shares = [
        f"{one.what}: {100 * one.after.point / one.before.point:.0f} % {after}"
        for one in verdict.comparisons
        if quantity.known(one.after) and quantity.known(one.before) and one.before.point > 0
    ]
    return Figure(
        title=f"Errors in per cent of the base model's: {'; '.join(shares)}",
        content=chart,
        caption=f"How much it matters: the error on {unseen} that neither model was fitted to.",
        width=_CHART,
    )


def _weighed(verdict: Verdict) -> dict[str, str]:
    """Returns what the first screen says of the evidence."""
    facts: dict[str, str] = {}
    if math.isfinite(verdict.test.p_value.point):
        p = probability(verdict.test.p_value.point)
        facts["evidence"] = f"{evidence(verdict.test)} that anything is missing, p = {p}"
    if share := explained_words(verdict):
        facts[verdict_sentences.after_label(verdict)] = f"the model explains {share}"
    return facts


def _limits(verdict: Verdict) -> list[str]:
    """Lists what limits a verdict, in sentences."""
    power = verdict_sentences.power_mean(verdict)
    rest = verdict.words.removeprefix(lead(verdict)).strip()
    return [
        *([f"{power}."] if power else []),
        *verdict_sentences.error_warnings(verdict),
        *verdict_sentences.control_warnings(verdict),
        *verdict_sentences.reduction_warnings(verdict),
        *([rest] if rest and rest != verdict.words else []),
        *(text for _, text in verdict.findings),
    ]


def _recorded(residuals: Sequence[Residual]) -> dict[str, str]:
    """Returns what the first screen says of the recordings."""
    if not residuals:
        return {}
    winds = [
        f"{one.recording}{', unseen' if one.held_out else ''}"
        + (f" ({number(one.speed, digits=2)} m/s)" if math.isfinite(one.speed) else "")
        for one in residuals
    ]
    facts = {"recordings": list_names(shorten_list(winds))}
    first = residuals[0]
    if first.markers:
        across, up = (max(axis) - min(axis) for axis in zip(*first.markers, strict=True))
        size = f"{len(first.markers)} over {number(across)} m × {number(up)} m"
        facts["markers"] = size
    seconds = [one.times[-1] - one.times[0] for one in residuals if one.times]
    if seconds:
        facts["duration"] = ", ".join(f"{number(one, digits=2)} s" for one in seconds[:4])
    return facts


def _facts_of(experiment: Experiment) -> dict[str, str]:
    """Returns what the first screen says of the cloth and of the wind's log."""
    specimen = experiment.specimen
    weight = number(specimen.material.area_weight)
    cloth = f"{specimen.material.name}, nominally {weight} kg/m²"
    uncertainty = specimen.area_weight_uncertainty
    known = (
        ", its mass not known" if uncertainty is None else f", known to {100 * uncertainty:.2g} %"
    )
    gains, directions, clocks = zip(
        *(recording.wind.uncertainty for recording in experiment.recordings), strict=True
    )
    winds = list_circumstances(
        [
            Circumstances(
                start=one.wind.start,
                seconds=len(one.positions) / one.rate,
                session=one.session,
                sensor=one.wind.sensor,
            )
            for one in experiment.recordings
        ]
    )
    return {
        **winds,
        "cloth": f"{cloth}{known}; held at {len(specimen.held)} points",
        "wind's log": f"known to {number(100 * max(gains), digits=2)} % in speed, "
        f"{number(math.degrees(max(directions)), digits=2)}° in direction and "
        f"{number(max(clocks), digits=2)} s in time",
    }


def _flatten(values: Mapping[str, Any], prefix: str = "") -> Iterable[tuple[str, str]]:
    """Yields (dotted name, value) of nested provenance."""
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _flatten(value, f"{prefix}{name}.")
        else:
            text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
            yield f"{prefix}{name}", text


def _head_figures(verdict: Verdict) -> list[Figure]:
    after = verdict_sentences.after_label(verdict)
    moving = moving_figure(verdict.residuals, after=after)
    return [figure for figure in (moving, errors_figure(verdict)) if figure is not None]


def _sections(verdict: Verdict, experiment: Experiment | None) -> list[Section]:
    """Makes the sections of a verdict by markers."""
    made = [sections.verdict_section(verdict)]
    if verdict.comparisons:
        made.append(_errors(verdict))
    suspected = verdict.test.suspected
    statistic = (
        f"The statistic is how far the recordings go the way of {suspected}, the only direction "
        "that is tested, since it was stated beforehand."
        if suspected
        else verdict_sentences.statistic_text(verdict.test)
    )
    made.append(sections.test_section(verdict, statistic))
    if verdict.power:
        made.append(sections.power_section(verdict, _HOW_SEEN))
    if acting := _effect_figures(verdict):
        made.append(
            Section(title="Where on the cloth it acts", parts=acting, anchor="acts", folded=True)
        )
    if verdict.residuals:
        made.append(_residuals(verdict))
    if verdict.ranking:
        made.append(_ranking(verdict))
    if verdict.parameters:
        made.append(sections.parameters_section(verdict, title="Parameters of the base model"))
    if experiment is not None:
        made.append(_recordings(experiment))
    return [*made, *sections.closing_sections(verdict)]


def _effect_figures(verdict: Verdict) -> list[Figure]:
    """Makes the figures of where what was added acts, a recording each; none where nothing was."""
    after = verdict_sentences.after_label(verdict)
    charts = [(one, effect_chart(one)) for one in verdict.residuals]
    return [
        Figure(
            title=f"Where on the cloth it acts, {one.recording}",
            content=chart,
            caption=f"{one.recording}: by how much the prediction one step ahead {after} differs "
            "from the base model's, on average over the frames in motion (x and y horizontal, z "
            "up).",
        )
        for one, chart in charts
        if chart is not None
    ]


def _recordings(experiment: Experiment) -> Section:
    """Makes the section of what was recorded."""
    figures = [
        Figure(
            title=f"Markers of {one.name} over time",
            content=lambda one=one: recording_chart(one),
            caption=f"{one.name}: {one.positions.shape[1]} markers, "
            f"{len(one.positions)} frames at {one.rate:g} Hz; the brighter, the further.",
        )
        for one in experiment.recordings
    ]
    return Section(title="What was recorded", parts=figures, anchor="recordings", folded=True)


_HOW_SEEN = (
    "The chance of being seen is the share of null experiments that are beyond the critical value "
    "once the effect acts on them at the expected strength, as far as the part of its linear "
    "response that appears in recordings of other meshes, a quarter in the median."
)


def _errors(verdict: Verdict) -> Section:
    has_after = any(quantity.known(c.after) for c in verdict.comparisons)
    has_control = any(quantity.known(c.control) for c in verdict.comparisons)
    level = verdict_sentences.common_level(
        e for c in verdict.comparisons for e in (c.before, c.after, c.floor)
    )
    notes = [
        (
            "Root mean square one-step prediction error on data that "
            f"{'neither model was' if has_after else 'the model was not'} fitted to; intervals at "
            f"{level}. The floor is the model's error on data that were simulated from the model "
            "itself with other numerics. Where errors lie above it, no effect brings them below "
            "it; "
            "where they lie below it, it limits nothing."
        ),
    ]
    if has_after:
        notes.append(
            "E_red = (before − after) / (before − floor): it is 1 where everything that could be "
            "removed was removed."
        )
    if has_control:
        notes.append(
            "The control adds the second-best effect instead; it should improve the fit less."
        )
    return sections.errors_section(
        verdict,
        title="Before and after, on unseen data" if has_after else "Error on unseen data",
        columns=("data", "frames", "floor"),
        notes=notes,
    )


def _residuals(verdict: Verdict) -> Section:
    """Makes the section of where and when the models err."""
    residuals = verdict.residuals
    after = verdict_sentences.after_label(verdict)
    size, mean = size_shade(residuals), mean_shade(residuals)
    parts: list[Part] = []
    some_unseen = any(one.held_out for one in residuals)
    if not some_unseen:
        parts.append("The models of this section were fitted to all recordings.")
    if (against := wind_chart(residuals)) is not None:
        windless = [one.recording for one in residuals if not math.isfinite(one.speed)]
        said = [
            "One point a recording: root mean square over markers and frames.",
            "Hollow: neither model was fitted to it." if some_unseen else "",
            f"Without a logged wind, and left out: {', '.join(windless)}." if windless else "",
        ]
        parts.append(
            Figure(
                title="Prediction error against wind",
                content=against,
                caption=" ".join(filter(None, said)),
                width=_CHART,
            )
        )
    for one in residuals:
        name = f"{one.recording}{', unseen' if one.held_out else ''}"
        parts += [
            Markup("<h3>{}</h3>").format(name),
            Figure(
                title=f"Prediction errors of {name}",
                content=lambda one=one: residual_chart(one, size=size, mean=mean, after=after),
            ),
        ]
    parts.append(
        "Over the cloth: all recordings and both models on one scale; dots are the markers, "
        "hollow where one was never tracked. The mean error is that of the base model (observed − "
        "predicted; x and y horizontal, z up)."
    )
    return Section(
        title="Where and when the model errs", parts=parts, anchor="residual", folded=True
    )


def _ranking(verdict: Verdict) -> Section:
    """Makes the section of the effects that were weighed."""
    named = verdict_sentences.named_candidates(verdict)

    def title(candidate: Any) -> str:
        return verdict_sentences.candidate_title(verdict, candidate)

    rows: list[list[Cell]] = [
        [
            cells.name_cell(one.effect, readable(one.parameter), marked=one in named),
            cells.estimate_cell(one.strength),
            cells.errors_cell(one.z),
            cells.probability_cell(one.p_value),
            cells.probability_cell(one.p_family),
            cells.cell_with_error(one.gain, one.gain_error),
            cells.errors_cell(one.behind),
            cells.probability_cell(one.leftover),
            None if one.heterogeneity is None else cells.probability_cell(one.heterogeneity),
        ]
        for one in verdict.ranking
    ]
    level = verdict_sentences.common_level(c.strength for c in verdict.ranking)
    table = Table(
        columns=[
            "effect",
            "strength",
            "z",
            "p alone",
            "family-wise p",
            "held-out gain [nat]",
            "behind [SE]",
            "p remaining",
            "p for the same in all recordings",
        ],
        rows=rows,
        caption="Best first, those of an unphysical strength last; in bold those that are named. "
        "Effects are in the order of z; of those that predict unseen recordings, those within one "
        "deviation of the largest z are not separated. "
        f"Intervals at {level}.",
    )
    charts = [
        (
            "Held-out gain of each effect, with its standard error",
            gains_chart(verdict.ranking, title=title, named=named),
            _CHART,
        ),
        (
            (
                "Strength on each recording alone; shaded: the interval of all together; the level "
                "line: no effect"
            ),
            strengths_chart(verdict.ranking, title=title),
            None,
        ),
    ]
    figures = [
        Figure(title=said, content=chart, caption=f"{said}.", width=width)
        for said, chart, width in charts
        if chart is not None
    ]
    return Section(
        title="Candidates",
        parts=[table, *figures, _HOW_RANKED, *sections.unseen_effects(verdict)],
        anchor="ranking",
        folded=True,
    )


_HOW_RANKED = (
    "z is how far the recordings go the way of the effect, in standard deviations of nulls; of "
    "gusts, how far the wind's course swings. p alone compares it with that of the nulls. "
    "Family-wise p compares it with the largest of all candidates in each null. Gain is the log "
    "likelihood on unseen data less the base model's, ± its standard error. Behind counts standard "
    "errors of the paired difference to the best. p remaining is that of the same test along all "
    "other effects, this one free. p for the same is that of one strength in all recordings "
    "(Cochran's Q)."
)
