"""A verdict on films as an answer, with its sections.

A window of a film is beside flags that the models simulate in its wind, seen from the fitted place,
in motion. The models are fitted to the first half of each recording, and the window is of the
second one. Turbulence that is quicker than the log is drawn anew in each simulation, so that single
waves differ, and how high the flag flies, how far it reaches and how it beats can be compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from markupsafe import Markup

from flagdata.answer.answer import Cell, Figure, Section, Table
from flagdata.answer.charts import Chart, Colour
from flagdata.answer.circumstances import list_circumstances
from flagdata.answer.closed import Closed
from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.rng import child_seed, stream
from flagdata.pages.page_pictures import moving, still
from measure.cloth.design import Weighable
from measure.cloth.films_statement import level_of
from measure.cloth.flag_simulation import OBSERVED, RATE, FlagBatch
from measure.cloth.loop import SolvedLoop
from measure.cloth.model_evidence import Fit, Sight, fit_model, hypothesis
from measure.cloth.observables_chart import Predicted, chart_against_wind
from measure.cloth.observed_recording import Observed
from measure.cloth.simulations import deviation_of, of_recordings
from measure.observables import View
from measure.observables.film_window import FilmWindow
from measure.observables.observable import WINDOW
from measure.observables.tracked_cloth import ClothWindow, edges_of, seen_from
from measure.report import verdict_cells as cells
from measure.report import verdict_sections as sections
from measure.report import verdict_sentences
from measure.report.verdict_answer import closed, errors_figure
from measure.report.verdict_sentences import list_names, readable, shorten_list
from measure.verdict import quantity
from measure.verdict.criteria import CRITERIA
from measure.verdict.verdict_record import Verdict

_SIDE = 300
"""Pixels that a picture is wide and high."""
_PAPER, _POLE = 236, 120
_BEFORE_RGB, _AFTER_RGB = (180, 83, 26), (31, 111, 156)
"""Colours of the page's two models."""
_SUBPIXEL = 4
"""Binary digits of a pixel in which triangles are given to OpenCV."""


@dataclass(frozen=True, kw_only=True)
class Moving:
    """Pictures in motion, as data URLs.

    Attributes:
        label: what they show.
        url: of all of them.
        first: of the first, for a reader who asks for less motion.
    """

    label: str
    url: str
    first: str


@dataclass(frozen=True, kw_only=True)
class SideBySide:
    """One recording's window.

    Attributes:
        start: of the window in the film [s].
        wind: its logged mean [m/s].
        columns: the film first, then each model.
    """

    start: float
    wind: float
    columns: tuple[Moving, ...]


def side_by_side(outcome: SolvedLoop, index: int, *, after: str) -> SideBySide | None:
    """Returns a recording's window beside what was simulated; None without a film, or where it has
    no two halves.

    Args:
        index: of the recording.
        after: what the model with the effect is called; empty where no effect is named.
    """
    observed = outcome.recordings[index]
    excerpt, halves = observed.excerpt, outcome.halves
    place = next((place for place, pair in enumerate(halves) if pair.number == index), None)
    if excerpt is None or place is None:
        return None
    sights = [pair.first[0] for pair in halves]
    experiment = of_recordings(
        sights, [pair.first[1] for pair in halves], outcome.options.area_weight
    )
    film = excerpt.window
    instants = np.arange(round(WINDOW * RATE)) / RATE
    drawings = [
        _moving(
            "the film",
            [
                film.frames[np.abs(film.times - film.times[0] - at).argmin()]
                for at in instants.tolist()
            ],
        )
    ]
    models: list[tuple[str, Weighable | None, tuple[int, int, int]]] = [
        ("base model", None, _BEFORE_RGB)
    ]
    if after and outcome.best is not None:
        models.append((after, outcome.best[0], _AFTER_RGB))
    for label, effect, colour in models:
        model_fitted = hypothesis(sights, effect)
        fit = fit_model(sights, experiment, effect, seed=outcome.options.calibration.seed)
        cloth, places, strength = model_fitted.values(fit.weights[:1] @ fit.scores[0])
        window, depth = _flown(
            outcome, index, excerpt.number, {**cloth, **places[place]}, effect, strength
        )
        drawings.append(_moving(label, drawn(window, depth, film, colour)))
    return SideBySide(
        start=observed.first + excerpt.number * WINDOW,
        wind=float(observed.speed[excerpt.number]),
        columns=tuple(drawings),
    )


def _flown(
    outcome: SolvedLoop,
    index: int,
    number: int,
    values: dict[str, FloatArray],
    effect: Weighable | None,
    strength: FloatArray | None,
) -> tuple[ClothWindow, FloatArray]:
    """Simulates one flag in the wind of a window, as its place sees it, and how far away (frame,
    vertex) its cloth is [m].

    Args:
        values: name → (1,) of the cloth, the place and the anemometer's gain; what is not among
            them is at the middle of its prior.
    """
    design = outcome.simulations.designs[index]
    middle = {quantity.name: quantity.at(np.array([0.5])) for quantity in design.quantities()}
    if design.log.distance is not None:
        middle["distance_constant"] = np.array([design.log.distance])
    values = middle | values
    view = View(
        azimuth=float(values["azimuth"][0]),
        elevation=float(values["elevation"][0]),
        distance=design.distance,
    )
    start = number * WINDOW
    batch = FlagBatch(
        flag=design.flag,
        log=replace(design.log.cut(start, start + WINDOW), clock=0.0),
        duration=WINDOW,
        values={
            name: numbers
            for name, numbers in values.items()
            if name not in ("azimuth", "elevation")
        },
        places=np.array([[[view.azimuth, view.elevation, view.distance]]]),
        seeds=(child_seed(design.seed, "films", "side by side", number),),
        effects=() if effect is None or strength is None else ((effect.column, strength),),
    )
    mesh = design.flag.mesh(batch.columns)
    positions = batch.positions(mesh)[..., 0] * float(values["scale"][0])
    hoist, free = edges_of(mesh.rest)
    window = seen_from(
        view,
        positions,
        times=np.arange(len(positions)) / RATE,
        faces=mesh.faces,
        hoist=hoist,
        free=free,
        length=design.flag.length,
        height=design.flag.height,
    )
    return window, positions @ view.axes(0.0)[2]


def drawn(
    cloth: ClothWindow, depth: FloatArray, film: FilmWindow, colour: tuple[int, int, int]
) -> list[UInt8Array]:
    """Frames (size, size, 3) of cloth as large and where the film has its own, at a pole.

    Args:
        depth: (n, vertex) distance from the camera, up to a constant [m].
        film: whose scale and hoist are taken.
        colour: of cloth that is seen square on.
    """
    larger = _SIDE / film.frames.shape[1]
    hoist, scale = film.hoist.mean(axis=0) * larger, film.scale * larger
    places = hoist + cloth.points * np.array([film.side, -1.0]) * scale
    # The first pixel's middle is at 0.5 here and at 0 in OpenCV.
    fixed = np.rint((places - 0.5) * 2**_SUBPIXEL).astype(np.int32)
    corners = places[:, cloth.faces]
    edges = corners[:, :, 1:] - corners[:, :, :1]
    area = np.abs(edges[..., 0, 0] * edges[..., 1, 1] - edges[..., 0, 1] * edges[..., 1, 0])
    bright = 0.45 + 0.55 * np.clip(area / np.quantile(area, 0.95), 0.0, 1.0)
    behind = depth[:, cloth.faces].mean(axis=2)
    pole = round(float(hoist[0]))
    pictures = []
    for frame, order in enumerate(np.argsort(-behind, axis=1)):
        picture = np.full((_SIDE, _SIDE, 3), _PAPER, np.uint8)
        top = round(float(places[frame, cloth.hoist, 1].min() - 0.1 * scale * cloth.height))
        cv2.line(picture, (pole, top), (pole, _SIDE), (_POLE,) * 3, 2)
        for face in order:
            shade = tuple(int(part * bright[frame, face]) for part in colour)
            cv2.fillConvexPoly(picture, fixed[frame, cloth.faces[face]], shade, shift=_SUBPIXEL)
        pictures.append(picture)
    return pictures


def _moving(label: str, frames: Sequence[UInt8Array]) -> Moving:
    pictures = np.stack(frames)
    return Moving(
        label=label,
        url=moving(pictures, rate=RATE, side=_SIDE),
        first=still(pictures[0], side=_SIDE),
    )


def answer_of_films(
    verdict: Verdict, outcome: SolvedLoop, *, subject: str = "", words: str = ""
) -> Closed:
    """Makes the answer of a verdict by films.

    Args:
        subject: what was judged; the names of the recordings where it is empty.
        words: the verdict for a terminal.
    """
    after = verdict_sentences.after_label(verdict) if verdict.named else ""
    recordings = outcome.recordings
    names = [recording.name for recording in recordings]
    moving = [
        _moving_figure(outcome, index, after=after)
        for index in range(len(recordings))
        if _is_shown(outcome, index)
    ]
    errors = errors_figure(verdict, unseen="windows")
    return closed(
        verdict,
        subject=subject or list_names(shorten_list(names)),
        words=words,
        figures=[figure for figure in (*moving[:1], errors) if figure is not None],
        facts=_facts(outcome),
        make_sections=lambda: _sections(verdict, outcome, moving[1:]),
    )


def _facts(outcome: SolvedLoop) -> dict[str, str]:
    """Returns what the first screen says of the recordings."""
    recordings, options = outcome.recordings, outcome.options
    winds = [f"{one.name} ({one.speed.mean():.1f} m/s)" for one in recordings]
    weight = options.area_weight
    return {
        "recordings": list_names(shorten_list(winds)),
        **list_circumstances([one.circumstances for one in recordings]),
        "windows": ", ".join(str(len(one.readings)) for one in recordings[:_FEW])
        + f", of {WINDOW:g} s each",
        "flag": options.calibration.flag.words,
        **(
            {}
            if weight is None
            else {"area weight": f"{weight.middle:.3g} ± {deviation_of(weight):.1g} kg/m²"}
        ),
    }


_FEW = 4
_TRIO = Markup(
    '<div style="display: grid; gap: .6rem; grid-template-columns: '
    'repeat(auto-fit, minmax(min(100%, 7rem), 1fr))">{}</div>'
)
_COLUMN = Markup(
    '<figure style="margin: 0"><picture><source media="(prefers-reduced-motion: reduce)" '
    'srcset="{}"><img alt="{}, in motion" src="{}"></picture>'
    "<figcaption>{}</figcaption></figure>"
)


def _is_shown(outcome: SolvedLoop, index: int) -> bool:
    """Returns whether a recording has a film and two halves."""
    has_halves = any(pair.number == index for pair in outcome.halves)
    return has_halves and outcome.recordings[index].excerpt is not None


def _moving_figure(outcome: SolvedLoop, index: int, *, after: str) -> Figure:
    """Makes the figure of a recording's film beside what the models simulate."""

    def draw() -> Markup:
        shown = side_by_side(outcome, index, after=after)
        columns = () if shown is None else shown.columns
        return _TRIO.format(
            Markup("").join(
                _COLUMN.format(one.first, one.label, one.url, one.label) for one in columns
            )
        )

    name = outcome.recordings[index].name
    models = "each model simulates" if after else "the base model simulates"
    return Figure(
        title=f"{name} beside simulations",
        content=draw,
        caption=f"{WINDOW:g} s of {name} beside what {models} in the same wind. Single waves "
        "differ; "
        "compare how high the flag flies, how far it reaches and how much it beats.",
    )


_DRAWS = 400


def _sections(verdict: Verdict, outcome: SolvedLoop, moving: Sequence[Figure]) -> list[Section]:
    """Makes the sections of a verdict by films.

    Args:
        moving: figures of further recordings.
    """
    made = [sections.verdict_section(verdict)]
    if moving:
        made.append(
            Section(title="Films beside the models", parts=[*moving, _HOW_BESIDE], folded=True)
        )
    made.append(_windows(verdict, outcome))
    if verdict.comparisons:
        made.append(_errors(verdict))
    suspected = verdict.test.suspected
    statistic = (
        f"The statistic is z of {suspected}, the only direction that is tested, since it was "
        "stated "
        "beforehand."
        if suspected
        else "The statistic is the largest z of an effect's direction, or that of the whole misfit "
        f"({quantity.number(outcome.judged.scored.whole)}), which sees changes along no effect."
    )
    made.append(
        sections.test_section(
            verdict,
            f"{statistic} Each z is in standard deviations of null flags of kinds that were left "
            "out, about their mean.",
        )
    )
    if verdict.power:
        made.append(sections.power_section(verdict, _HOW_SEEN))
    if verdict.ranking:
        made.append(_ranking(verdict))
    made.append(sections.parameters_section(verdict, title="The cloth"))
    return [*made, *sections.closing_sections(verdict)]


_HOW_BESIDE = (
    "The models were fitted to the first half of each recording; the window is of the second half. "
    "They are seen from the fitted place and at the film's scale. Turbulence quicker than the log "
    "is drawn anew, so that single waves differ."
)
_HOW_SEEN = (
    "The chance of being seen is the share of null flags that are beyond the critical value once "
    "the effect has moved what they show as it does on average at the expected strength, beyond "
    "its null value."
)


def _windows(verdict: Verdict, outcome: SolvedLoop) -> Section:
    """Makes the section of the observables against the wind."""
    both = (
        "the base model (brown) and the larger model (blue) show"
        if verdict.named
        else "the base model shows"
    )
    figures = [
        Figure(
            title=f"Observables of windows of {recording.name} against the wind",
            content=lambda index=index: _against_wind(
                outcome, index, with_effect=bool(verdict.named)
            ),
            caption=f"{recording.name}. Dots: {len(recording.readings)} windows of the film, at a "
            f"mean wind of {recording.speed.mean():.1f} m/s. Bands: what {both} on average, at "
            "90 %, without the scatter among windows.",
        )
        for index, recording in enumerate(outcome.recordings)
    ]
    return Section(title="Observables against the wind", parts=figures, folded=True)


def _errors(verdict: Verdict) -> Section:
    """Makes the section of errors on unseen windows."""
    has_after = any(quantity.known(c.after) for c in verdict.comparisons)
    notes = [
        (
            "Root mean square error of means over windows that "
            f"{'neither model was' if has_after else 'the model was not'} fitted to; intervals at "
            f"{level_of(verdict)} by the scatter of replicates."
        ),
        (
            "Other halves: calibrated on one half of each recording, compared with the other, both "
            "ways. Recordings left out: calibrated on all others. The scatter of replicates is how "
            "far "
            "simulations of one cloth and view scatter: no model predicts better."
        ),
    ]
    if has_after:
        notes.append("E_red = (before − after) / (before − scatter).")
    return sections.errors_section(
        verdict,
        title="Before and after, on unseen windows" if has_after else "Error on unseen windows",
        columns=("observable", "windows", "scatter of replicates"),
        notes=notes,
    )


def _ranking(verdict: Verdict) -> Section:
    """Makes the section of the effects that were weighed."""
    named = verdict_sentences.named_candidates(verdict)
    rows: list[list[Cell]] = [
        [
            cells.name_cell(one.effect, readable(one.parameter), marked=one in named),
            cells.estimate_cell(one.strength),
            cells.share_cell(one.probability),
            cells.number_cell(one.gain),
            cells.errors_cell(one.z),
            cells.probability_cell(one.p_value),
            cells.probability_cell(one.p_family),
            cells.probability_cell(one.leftover),
        ]
        for one in verdict.ranking
    ]
    table = Table(
        columns=[
            "effect",
            "strength if it acts",
            "probability",
            "log Bayes factor [nat]",
            "z",
            "p alone",
            "p of all",
            "p remaining",
        ],
        rows=rows,
        caption="Most probable first, in bold those that are named. Intervals at "
        f"{quantity.level_text(verdict.ranking[0].strength.level)}.",
    )
    parts = [table, _HOW_RANKED, *sections.unseen_effects(verdict)]
    return Section(title="Effects", parts=parts, anchor="ranking", folded=True)


_HOW_RANKED = (
    "The probability is given that one effect of the library is missing, each as probable as "
    "another before. z is how far the recordings lie along the change that the effect makes. p "
    "alone compares it with that of null flags along the same change, p of all with the largest of "
    "all changes. p remaining is that of the misfit which remains with this effect."
)


def bands(
    sight: Sight,
    observed: Observed,
    values: dict[str, FloatArray],
    weights: FloatArray,
    effect: Weighable | None,
    strength: FloatArray | None,
    *,
    seed: int,
) -> FloatArray:
    """Returns (3, window, observable) lower end, middle and upper end of what a model of the
    posterior shows in the windows' winds, without the scatter among windows; NaN of observables
    that are not used. A change with the wind that is not used is drawn as none.

    Args:
        values: name → (draw,) of cloth and place; `weights` of the draws.
        strength: (draw,) of the effect.
    """
    rng = stream(seed, "films", "bands")
    rows = rng.choice(len(weights), _DRAWS, p=weights / weights.sum())
    mean, stretch = sight.predict(
        {name: drawn[rows] for name, drawn in values.items()},
        None if effect is None else effect.name,
        None if strength is None else strength[rows],
    )
    mean = (
        mean
        + (rng.standard_normal(mean.shape) @ sight.emulator.factor.T) * np.sqrt(stretch)[:, None]
    )
    summaries = np.full((_DRAWS, len(sight.used)), np.nan)
    summaries[:, len(OBSERVED) :] = 0.0  # changes that nothing predicts are none
    summaries[:, sight.used] = mean
    windows = observed.projection.at(summaries.reshape(_DRAWS, -1, len(OBSERVED)))
    tail = (1 - CRITERIA.interval) / 2
    return np.asarray(np.quantile(windows, [tail, 0.5, 1 - tail], axis=0))


def _against_wind(outcome: SolvedLoop, index: int, *, with_effect: bool) -> Chart:
    """Makes a chart of a recording's observables against the wind, with both models' bands."""
    recording, sight = outcome.recordings[index], outcome.sights[index]
    models: list[tuple[Weighable | None, Fit, Colour, str]] = [
        (None, outcome.base, Colour.LOG, "base model")
    ]
    if with_effect and outcome.best is not None:
        models.append((*outcome.best, Colour.FILM, "larger model"))
    predicted = []
    for effect, fit, colour, label in models:
        cloth, places, strength = hypothesis(outcome.sights, effect).values(fit.scores[0])
        band = bands(
            sight,
            recording,
            {**cloth, **places[index]},
            fit.weights[0],
            effect,
            strength,
            seed=outcome.options.calibration.seed,
        )
        predicted.append(Predicted(limits=band, colour=colour, label=label))
    names = [
        name
        for column, name in enumerate(OBSERVED)
        if np.isfinite(predicted[0].limits[:, :, column]).all()
    ]
    return chart_against_wind(recording, names, predicted, dots=Colour.INK)
