"""Closing the loop on films with logs of the wind: from recordings to all that a verdict is made
of.

`recordings` are `measure.cloth.observed_recording.Observed`, of a film or a table of observables
(`measure.cloth.flag_recordings`), or built directly; `calibration` are the options of `flagdata
calibrate`. Simulations are kept in the folder by their
design: a run that was interrupted goes on, and a second one simulates nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.core.stated import Stated
from flagdata.errors import InputError, UsageError
from measure.cloth.design import CalibrationOptions, Weighable, weighable
from measure.cloth.emulator import TAKEN_APART
from measure.cloth.flag_prior import CLOTH
from measure.cloth.flag_simulation import OBSERVED
from measure.cloth.model_evidence import (
    Experiments,
    Fit,
    Sight,
    Weighing,
    fit_model,
    hypothesis,
    misfits,
    weigh,
)
from measure.cloth.observed_recording import Observed, constant_wind
from measure.cloth.score_test import Judged, directions, judge, score
from measure.cloth.simulations import (
    Simulations,
    deviation_of,
    of_base,
    of_nulls,
    of_recordings,
    shown_by,
    simulate_all,
)
from measure.cloth.unseen_windows import Halves, halve_recordings
from measure.forecasting.setting import Stage
from measure.forecasting.strengths import Suspicion
from measure.verdict.criteria import CRITERIA


@dataclass(frozen=True, kw_only=True)
class Departure:
    """An observable's mean beside that of the base model as calibrated.

    Attributes:
        recording, observable: which.
        off: observed less predicted, in the observable's unit.
        deviations: the same in standard deviations of replicates.
    """

    recording: str
    observable: str
    off: float
    deviations: float


def departures(
    recordings: Sequence[Observed], sights: Sequence[Sight], base: Fit
) -> tuple[Departure, ...]:
    """Lists departures of each recording's observables that are used, the farthest first.

    Args:
        base: the base model fitted to the recordings.
    """
    departed = []
    cloth, places, _ = hypothesis(sights, None).values(base.scores[0])
    for recording, sight, view in zip(recordings, sights, places, strict=True):
        mean, _ = sight.predict({**cloth, **view})
        off = recording.summary[sight.used] - base.weights[0] @ mean
        columns = np.flatnonzero(sight.used).tolist()
        departed += [
            Departure(
                recording=recording.name,
                observable=OBSERVED[column],
                off=float(size),
                deviations=float(size / sigma),
            )
            for column, size, sigma in zip(columns, off, sight.emulator.deviations, strict=True)
            if column < len(OBSERVED)
        ]
    return tuple(sorted(departed, key=lambda departure: -abs(departure.deviations)))


def root_mean_square(departing: Sequence[Departure]) -> float:
    """Takes the root mean square of departures, in standard deviations of replicates."""
    return float(np.sqrt(np.mean(np.square([departure.deviations for departure in departing]))))


STRONG = 0.9
"""Share of the prior of strengths at which an effect counts as strong."""
_BEYOND = 2.0
"""Factor by which a stated area weight may lie beyond those of the null experiments: fewer and
fewer are as heavy."""
_DIFFERENCE = 1e-3


def sensitivity(
    sights: Sequence[Sight], effects: Sequence[Weighable], base: Fit, observed: Experiments
) -> FloatArray:
    """Returns (effect,) standard errors by which the strong effect moves the summaries, what a
    change of cloth, view and anemometer makes up for left out.

    Args:
        base: the base model fitted to the recordings, about whose cloth and view it is found.
        observed: the recordings.
    """
    base_model = hypothesis(sights, None)
    at = base.weights[:1] @ base.scores[0]
    moved = np.concatenate([at, at + _DIFFERENCE * np.eye(at.shape[1])])
    mean, _, weight = base_model.predicted(moved)
    off = observed.repeated(len(moved)).off(weight)
    slopes = (
        np.concatenate(
            [base_model.scatter.white @ (mean[1:] - mean[0]).T, (off[1:] - off[0])[None]]
        )
        / _DIFFERENCE
    )
    # What the prior lets them make up for: ridge regression on slopes, the scores' prior being
    # standard normal.
    unexplained = np.eye(len(slopes)) - slopes @ np.linalg.solve(
        slopes.T @ slopes + np.eye(slopes.shape[1]), slopes.T
    )
    cloth, places, _ = base_model.values(at)
    errors = []
    for effect in effects:
        strength = effect.prior.at(np.array([STRONG]))
        parts = []
        for sight, view in zip(sights, places, strict=True):
            with_it, _ = sight.predict({**cloth, **view}, effect.name, strength)
            without, _ = sight.predict({**cloth, **view})
            parts.append((with_it - without)[0])
        column = np.concatenate([base_model.scatter.white @ np.concatenate(parts), [0.0]])
        errors.append(float(np.sqrt(column @ unexplained @ column)))
    return np.array(errors)


@dataclass(frozen=True, kw_only=True)
class FilmLoopOptions:
    """How the loop is closed.

    Attributes:
        calibration: the flag, its view, the number of simulations and the seed, as for `flagdata
            calibrate`.
        area_weight: of a cloth that was weighed [kg/m²]; None for the prior of all cloths.
        level: of the test.
        kinds: of numerics among null experiments.
        only: names of the effects that are weighed; empty for all.
        suspected: the effect with its sign that was suspected before the recordings were looked at,
            along which alone is looked; None to look along all.

    Raises:
        UsageError: a level, a number or a weight that makes no sense, or an effect that is not
            weighed.
    """

    calibration: CalibrationOptions
    area_weight: Stated | None = None
    level: float = CRITERIA.level
    kinds: int = CRITERIA.film_kinds
    only: tuple[str, ...] = ()
    suspected: Suspicion | None = None

    def __post_init__(self) -> None:
        if not 0 < self.level < 1 or self.kinds < CRITERIA.fewest_kinds:
            raise UsageError(
                f"{self.kinds} kinds of numerics cannot test at a level of {self.level!r}",
                where="close-loop",
                fix=f"give a level between 0 and 1, and {CRITERIA.fewest_kinds} kinds or more",
            )
        (ends,) = (uncertain.ends for uncertain in CLOTH if uncertain.name == "area_weight")
        low, high = ends or (0.0, math.inf)
        if (
            self.area_weight is not None
            and not low / _BEYOND < self.area_weight.middle < high * _BEYOND
        ):
            raise UsageError(
                f"an area weight of {self.area_weight.text} kg/m²; null experiments have flags of "
                f"{low:g} to {high:g}",
                where="--area-weight",
                fix="give kg/m² (155 g/m² is 0.155)",
            )
        names = [effect.name for effect in weighable(self.calibration.flag)]
        if unknown := set(self.only) - set(names):
            raise UsageError(
                f"{', '.join(sorted(unknown))}: not weighed on films",
                fix=f"give {', '.join(names)}",
            )

    @property
    def effects(self) -> tuple[Weighable, ...]:
        """Returns the effects that are weighed."""
        return tuple(
            effect
            for effect in weighable(self.calibration.flag)
            if not self.only or effect.name in self.only
        )

    def recipe(self) -> dict[str, Any]:
        """Returns JSON values."""
        return {
            **self.calibration.recipe(),
            "area_weight": None
            if self.area_weight is None
            else [self.area_weight.middle, deviation_of(self.area_weight)],
            "test_level": self.level,
            "kinds": self.kinds,
            "only": list(self.only),
            "suspected": None if self.suspected is None else self.suspected.words,
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class SolvedLoop:
    """All that a verdict was made from.

    Attributes:
        options, recordings, simulations, sights: what went in.
        weighing: of the recordings.
        judged: what was decided.
        base: the base model fitted to the recordings.
        best: the most probable effect's model fitted to them; None where nothing was weighed.
        departures: of the observables from the base model, the farthest first.
        sensitivity: (effect,) standard errors by which each moves the recordings where it is
            strong.
        together: whether what is unknown of the cloth was taken as the same in all recordings.
        left_out: a warning for each recording whose simulations do not show what it shows.
    """

    options: FilmLoopOptions
    recordings: tuple[Observed, ...]
    simulations: Simulations
    sights: tuple[Sight, ...]
    weighing: Weighing
    judged: Judged
    base: Fit
    best: tuple[Weighable, Fit] | None
    departures: tuple[Departure, ...]
    sensitivity: FloatArray
    together: bool
    left_out: tuple[Finding, ...] = ()

    @property
    def halves(self) -> tuple[Halves, ...]:
        """Returns the halves of the recordings that have two, which predict each other."""
        return self._halves_of_recordings[0]

    @cached_property
    def _halves_of_recordings(self) -> tuple[tuple[Halves, ...], tuple[Finding, ...]]:
        return halve_recordings(self.recordings, self.simulations)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Returns the findings on the recordings."""
        of_recordings = (finding for recording in self.recordings for finding in recording.findings)
        of_scatter = [] if self.together else [TAKEN_APART]
        return (
            *self.left_out,
            *self._halves_of_recordings[1],
            *constant_wind(self.recordings),
            *of_recordings,
            *of_scatter,
        )


def solve(
    recordings: Sequence[Observed],
    options: FilmLoopOptions,
    *,
    folder: Path,
    workers: int = 1,
    stage: Stage | None = None,
) -> SolvedLoop:
    """Finds what a verdict is made from; as `close_loop`."""
    if not recordings:
        raise InputError("no recordings are given", where="close-loop", fix="give one or more")
    effects, seed = options.effects, options.calibration.seed
    # All simulations, read where they were made before.
    simulations = simulate_all(
        recordings,
        options.calibration,
        effects,
        kinds=options.kinds,
        folder=folder,
        workers=workers,
        stage=stage,
    )
    # A model of what each recording shows, by its simulations; recordings without one are left out.
    recordings, simulations, sights, left_out = shown_by(recordings, simulations)
    effects = tuple(
        effect for effect in effects if all(effect.name in sight.responses for sight in sights)
    )
    # Null experiments, the base model's simulations and the recordings, in the same form.
    null, kinds = of_nulls(sights, recordings, simulations, options.area_weight, seed=seed)
    model = of_base(sights, recordings, simulations, options.area_weight, seed=seed)
    experiment = of_recordings(sights, recordings, options.area_weight)
    scored = score(
        experiment,
        model,
        null,
        kinds,
        directions(sights, effects, options.suspected),
        level=options.level,
    )
    base = fit_model(sights, experiment, None, seed=seed)
    departing = departures(recordings, sights, base)
    weighing = weigh(sights, experiment, effects, seed=seed)
    decision = judge(
        weighing,
        misfits(sights, null, effects),
        kinds,
        scored,
        level=options.level,
        departure=root_mean_square(departing),
    )
    best = None
    if effects:
        first = effects[decision.confident[0]]
        best = first, fit_model(sights, experiment, first, seed=seed)
    return SolvedLoop(
        options=options,
        recordings=recordings,
        left_out=left_out,
        simulations=simulations,
        sights=sights,
        weighing=weighing,
        judged=decision,
        base=base,
        best=best,
        departures=departing,
        sensitivity=sensitivity(sights, effects, base, experiment),
        together=hypothesis(sights, None).scatter.together,
    )
