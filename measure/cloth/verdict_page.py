"""The report of a verdict on films as one page that refers to no other file.

A window of a film is beside flags that the models simulate in its wind, seen from the fitted place,
in motion. The models are fitted to the first half of each recording, and the window is of the
second one. Turbulence that is quicker than the log is drawn anew in each simulation, so that single
waves differ, and how high the flag flies, how far it reaches and how it beats can be compared.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.rng import child_seed, stream
from flagdata.pages.page_pictures import moving, still
from flagdata.pages.render import render
from measure.cloth.calibration_page import Band, against_wind
from measure.cloth.design import Weighable
from measure.cloth.films_statement import level_of
from measure.cloth.flag_simulation import OBSERVED, RATE, FlagBatch
from measure.cloth.loop import SolvedLoop
from measure.cloth.model_evidence import Fit, Sight, fit_model, hypothesis
from measure.cloth.observed_recording import Observed
from measure.cloth.simulations import of_recordings
from measure.observables import View
from measure.observables.film_window import FilmWindow
from measure.observables.observable import WINDOW
from measure.observables.tracked_cloth import ClothWindow, edges_of, seen_from
from measure.report import figures, verdict_sentences
from measure.report.report_page import FILTERS, TONES, opening
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


_DRAWS = 400
_BEFORE, _AFTER, _DOT = "#b4531a", "#1f6f9c", "#444444"


def verdict_page(verdict: Verdict, outcome: SolvedLoop) -> str:
    """Writes the page, HTML."""
    after = verdict_sentences.after_label(verdict) if verdict.named else ""
    values = {
        "verdict": verdict,
        "tone": TONES[verdict.conclusion],
        **opening(verdict),
        "test_sentence": verdict_sentences.test_sentence(verdict),
        "remark": verdict_sentences.test_remark(verdict.test),
        "named": verdict_sentences.named_candidates(verdict),
        "after_label": after,
        "level": level_of(verdict),
        "has_control": any(quantity.known(c.control) for c in verdict.comparisons),
        "null": figures.null_distribution(verdict.test),
        "whole": outcome.judged.scored.whole,
        "title": lambda c: verdict_sentences.candidate_title(verdict, c),
        "recordings": [
            {
                "name": recording.name,
                "windows": len(recording.readings),
                "wind": f"{recording.speed.mean():.1f}",
                "picture": _against_wind(outcome, number, with_effect=bool(verdict.named)),
                "beside": side_by_side(outcome, number, after=after),
            }
            for number, recording in enumerate(outcome.recordings)
        ],
        "provenance": [
            (name, value if isinstance(value, str) else json.dumps(value))
            for name, value in {
                **verdict.provenance.get("options", {}),
                **verdict.provenance,
            }.items()
            if name != "options"
        ],
    }
    return render("measure.report", "films.html.j2", values, filters=FILTERS)


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


def _against_wind(outcome: SolvedLoop, index: int, *, with_effect: bool) -> str:
    """Draws each observable of a recording's windows against the wind, with both models' bands."""
    recording, sight = outcome.recordings[index], outcome.sights[index]
    models: list[tuple[Weighable | None, Fit, str]] = [(None, outcome.base, _BEFORE)]
    if with_effect and outcome.best is not None:
        models.append((*outcome.best, _AFTER))
    drawn = []
    for effect, fit, colour in models:
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
        drawn.append(Band(limits=band, colour=colour))
    names = [
        name
        for column, name in enumerate(OBSERVED)
        if np.isfinite(drawn[0].limits[:, :, column]).all()
    ]
    return against_wind(recording, names, drawn, dots=_DOT, opacity=0.25)
