"""The report of a verdict on films as one page that refers to no other file."""

from __future__ import annotations

import json

import numpy as np

from flagdata.arrays import FloatArray
from flagdata.pages.render import render
from flagdata.rng import stream
from measure.calibrate.observed import Observed
from measure.calibrate.panels import Band, against_wind
from measure.calibrate.simulation import OBSERVED
from measure.films.evidence import Fit, Sight
from measure.films.library import Weighable
from measure.films.run import Outcome
from measure.films.side_by_side import side_by_side
from measure.films.weigh import hypothesis
from measure.films.words import level_of
from measure.report import figures, sentences
from measure.report.report_page import FILTERS, TONES, opening
from measure.verdict import quantity
from measure.verdict.criteria import CRITERIA
from measure.verdict.record import Verdict

_DRAWS = 400
_BEFORE, _AFTER, _DOT = "#b4531a", "#1f6f9c", "#444444"


def page(verdict: Verdict, outcome: Outcome) -> str:
    """The page, HTML."""
    after = sentences.after_label(verdict) if verdict.named else ""
    values = {
        "verdict": verdict,
        "tone": TONES[verdict.conclusion],
        **opening(verdict),
        "test_sentence": sentences.test_sentence(verdict),
        "remark": sentences.test_remark(verdict.test),
        "named": sentences.named_candidates(verdict),
        "after_label": after,
        "level": level_of(verdict),
        "has_control": any(quantity.known(c.control) for c in verdict.comparisons),
        "null": figures.null_distribution(verdict.test),
        "whole": outcome.judged.scored.whole,
        "title": lambda c: sentences.candidate_title(verdict, c),
        "recordings": [
            {
                "name": one.name,
                "windows": len(one.readings),
                "wind": f"{one.speed.mean():.1f}",
                "picture": _against_wind(outcome, place, named=bool(verdict.named)),
                "beside": side_by_side(outcome, place, after=after),
            }
            for place, one in enumerate(outcome.recordings)
        ],
        "provenance": [
            (name, value if isinstance(value, str) else json.dumps(value))
            for name, value in {**verdict.provenance.get("options", {}), **verdict.provenance}.items()
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
    """(3, window, observable) lower end, middle and upper end of what a model of the posterior shows in the windows'
    winds, without the scatter among windows; NaN of observables that are not used. A change with the wind that is not
    used is drawn as none.

    Args:
        values: name → (draw,) of cloth and place; `weights` of the draws.
        strength: (draw,) of the effect.
    """
    rng = stream(seed, "films", "bands")
    rows = rng.choice(len(weights), _DRAWS, p=weights / weights.sum())
    mean, stretch = sight.model.predict(
        {name: own[rows] for name, own in values.items()},
        None if effect is None else effect.name,
        None if strength is None else strength[rows],
    )
    mean = mean + (rng.standard_normal(mean.shape) @ sight.model.base.factor.T) * np.sqrt(stretch)[:, None]
    whole = np.full((_DRAWS, len(sight.model.used)), np.nan)
    whole[:, len(OBSERVED) :] = 0.0  # changes that nothing predicts are none
    whole[:, sight.model.used] = mean
    windows = observed.projection.at(whole.reshape(_DRAWS, -1, len(OBSERVED)))
    tail = (1 - CRITERIA.interval) / 2
    return np.asarray(np.quantile(windows, [tail, 0.5, 1 - tail], axis=0))


def _against_wind(outcome: Outcome, place: int, *, named: bool) -> str:
    """Each observable of a recording's windows against the wind, with both models' bands."""
    one, sight = outcome.recordings[place], outcome.sights[place]
    both: list[tuple[Weighable | None, Fit, str]] = [(None, outcome.base, _BEFORE)]
    if named and outcome.best is not None:
        both.append((*outcome.best, _AFTER))
    drawn = []
    for effect, fit, colour in both:
        cloth, places, strength = hypothesis(outcome.sights, effect).values(fit.scores[0])
        found = bands(
            sight,
            one,
            {**cloth, **places[place]},
            fit.weights[0],
            effect,
            strength,
            seed=outcome.options.calibration.seed,
        )
        drawn.append(Band(found=found, colour=colour))
    names = [name for column, name in enumerate(OBSERVED) if np.isfinite(drawn[0].found[:, :, column]).all()]
    return against_wind(one, names, drawn, dots=_DOT, opacity=0.25)
