"""Closing the loop on films with logs of the wind: from recordings to all that a verdict is made of.

`recordings` are `measure.cloth.recording.Observed`, of a film or a table of observables (`measure.cloth.sources`), or
built directly; `calibration` are the options of `flagdata calibrate`. Simulations are kept in the folder by their
design: a run that was interrupted goes on, and a second one simulates nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.arrays import FloatArray
from flagdata.errors import InputError, UsageError
from flagdata.findings import Finding
from measure.cloth.calibration import CalibrationOptions
from measure.cloth.design import Weighable, weighable
from measure.cloth.emulator import TAKEN_APART
from measure.cloth.evidence import Experiments, Fit, Sight, Weighing, fitted, hypothesis, misfits, weigh
from measure.cloth.recording import Observed, constant_wind
from measure.cloth.score_test import Judged, directions, judge, score
from measure.cloth.simulation import OBSERVED
from measure.cloth.simulations import Simulations, gathered, of_base, of_nulls, of_recordings, shown_by
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


def departures(recordings: Sequence[Observed], sights: Sequence[Sight], base: Fit) -> tuple[Departure, ...]:
    """Computes the departures of all observables that each recording uses, the farthest first.

    Args:
        base: the base model fitted to the recordings.
    """
    all_departures = []
    cloth, places, _ = hypothesis(sights, None).values(base.scores[0])
    for recording, sight, place_values in zip(recordings, sights, places, strict=True):
        mean, _ = sight.predict({**cloth, **place_values})
        off = recording.summary[sight.used] - base.weights[0] @ mean
        columns = np.flatnonzero(sight.used).tolist()
        all_departures += [
            Departure(
                recording=recording.name, observable=OBSERVED[column], off=float(size), deviations=float(size / sigma)
            )
            for column, size, sigma in zip(columns, off, sight.emulator.deviations, strict=True)
            if column < len(OBSERVED)
        ]
    return tuple(sorted(all_departures, key=lambda departure: -abs(departure.deviations)))


def root_mean_square(departing: Sequence[Departure]) -> float:
    """Computes the root mean square of departures, in standard deviations of replicates."""
    return float(np.sqrt(np.mean(np.square([departure.deviations for departure in departing]))))


STRONG = 0.9
"""Share of the prior of strengths at which an effect counts as strong."""
_DIFFERENCE = 1e-3


def sensitivity(sights: Sequence[Sight], effects: Sequence[Weighable], base: Fit, observed: Experiments) -> FloatArray:
    """(effect,) standard errors by which the strong effect moves the summaries, what a change of cloth, view and
    anemometer makes up for left out.

    Args:
        base: the base model fitted to the recordings, about whose cloth and view it is found.
        observed: the recordings.
    """
    base_model = hypothesis(sights, None)
    at = base.weights[:1] @ base.scores[0]
    moved = np.concatenate([at, at + _DIFFERENCE * np.eye(at.shape[1])])
    mean, _, weight = base_model.predicted(moved)
    off = observed.repeated(len(moved)).off(weight)
    slopes = np.concatenate([base_model.scatter.white @ (mean[1:] - mean[0]).T, (off[1:] - off[0])[None]]) / _DIFFERENCE
    # What the prior lets them make up for: ridge regression on slopes, the scores' prior being standard normal.
    residual_maker = np.eye(len(slopes)) - slopes @ np.linalg.solve(
        slopes.T @ slopes + np.eye(slopes.shape[1]), slopes.T
    )
    cloth, places, _ = base_model.values(at)
    sensitivities = []
    for effect in effects:
        strength = effect.prior.at(np.array([STRONG]))
        parts = []
        for sight, place_values in zip(sights, places, strict=True):
            with_it, _ = sight.predict({**cloth, **place_values}, effect.name, strength)
            without, _ = sight.predict({**cloth, **place_values})
            parts.append((with_it - without)[0])
        column = np.concatenate([base_model.scatter.white @ np.concatenate(parts), [0.0]])
        sensitivities.append(float(np.sqrt(column @ residual_maker @ column)))
    return np.array(sensitivities)


@dataclass(frozen=True, kw_only=True)
class FilmLoopOptions:
    """How the loop is closed.

    Attributes:
        calibration: the flag, its view, the number of simulations and the seed, as for `flagdata calibrate`.
        area_weight: mean and standard deviation of a cloth that was weighed [kg/m²]; None for the prior of all cloths.
        level: of the test.
        kinds: of numerics among null experiments.
        only: names of the effects that are weighed; empty for all.
        suspected: the effect with its sign that was suspected before the recordings were looked at, along which alone
            is looked; None to look along all.

    Raises:
        UsageError: a level or number that makes no sense, or an effect that is not weighed.
    """

    calibration: CalibrationOptions
    area_weight: tuple[float, float] | None = None
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
        offered = [effect.name for effect in weighable(self.calibration.flag)]
        if unknown := set(self.only) - set(offered):
            raise UsageError(f"{', '.join(sorted(unknown))}: not weighed on films", fix=f"give {', '.join(offered)}")

    @property
    def effects(self) -> tuple[Weighable, ...]:
        """That are weighed."""
        return tuple(effect for effect in weighable(self.calibration.flag) if not self.only or effect.name in self.only)

    def recipe(self) -> dict[str, Any]:
        """Returns JSON values."""
        return {
            **self.calibration.recipe(),
            "area_weight": None if self.area_weight is None else list(self.area_weight),
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
        sensitivity: (effect,) standard errors by which each moves the recordings where it is strong.
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
    def findings(self) -> tuple[Finding, ...]:
        """On the recordings."""
        recorded = (finding for recording in self.recordings for finding in recording.findings)
        of_scatter = [] if self.together else [TAKEN_APART]
        return (*self.left_out, *constant_wind(self.recordings), *recorded, *of_scatter)


def solve(
    recordings: Sequence[Observed],
    options: FilmLoopOptions,
    *,
    folder: Path,
    workers: int = 1,
    stage: Stage | None = None,
) -> SolvedLoop:
    """Simulates and judges: returns what a verdict is made from; as `close_loop`."""
    if not recordings:
        raise InputError("no recordings", where="close-loop", fix="give one or more")
    effects, seed = options.effects, options.calibration.seed
    simulations = gathered(
        recordings, options.calibration, effects, kinds=options.kinds, folder=folder, workers=workers, stage=stage
    )
    recordings, simulations, sights, left_out = shown_by(recordings, simulations)
    effects = tuple(effect for effect in effects if all(effect.name in sight.responses for sight in sights))
    null, kinds = of_nulls(sights, recordings, simulations, options.area_weight, seed=seed)
    model = of_base(sights, recordings, simulations, options.area_weight, seed=seed)
    observed = of_recordings(sights, recordings, options.area_weight)
    scored = score(observed, model, null, kinds, directions(sights, effects, options.suspected), level=options.level)
    base = fitted(sights, observed, None, seed=seed)
    departing = departures(recordings, sights, base)
    weighing = weigh(sights, observed, effects, seed=seed)
    judgement = judge(
        weighing,
        misfits(sights, null, effects),
        kinds,
        scored,
        level=options.level,
        departure=root_mean_square(departing),
    )
    best = None
    if effects:
        first = effects[judgement.confident[0]]
        best = first, fitted(sights, observed, first, seed=seed)
    return SolvedLoop(
        options=options,
        recordings=recordings,
        left_out=left_out,
        simulations=simulations,
        sights=sights,
        weighing=weighing,
        judged=judgement,
        base=base,
        best=best,
        departures=departing,
        sensitivity=sensitivity(sights, effects, base, observed),
        together=hypothesis(sights, None).scatter.together,
    )
