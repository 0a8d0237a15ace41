"""`flagdata close-loop` on films with logs and on tables of observables: read, judged, and made an
answer."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from flagdata.core.console import progress, say
from flagdata.errors import UsageError
from flagdata.lake import Lake
from measure.closing.model_recipes import NamedModel, acting, acting_effects, fitted_parameters
from measure.closing.null_options import stage_bars
from measure.closing.verdict_artifacts import ClosedLoop
from measure.closing.verdict_sources import distinct
from measure.cloth.calibrate_call import folder_of, options_of, sources_of
from measure.cloth.design import PAIRS, TOGETHER, announce_simulations, lasting, weighable
from measure.cloth.film_options import JudgingFilms
from measure.cloth.films_statement import words
from measure.cloth.films_verdict import verdict_of
from measure.cloth.flag_simulation import COLUMNS, SETTLE, VERSION, mean_bending
from measure.cloth.loop import FilmLoopOptions, SolvedLoop, solve
from measure.cloth.numerics import effort
from measure.cloth.verdict_page import answer_of_films
from measure.film.film_source import FilmReading
from measure.film.similarity import FlagSize
from measure.forecasting.strengths import Suspicion
from measure.verdict.criteria import CRITERIA
from measure.verdict.verdict_record import Candidate, Verdict
from sim.cloth.material import named_material

ANSWER = 4
"""Raised when the same recordings and options get another answer."""


def answer_of(
    verdict: Verdict,
    outcome: SolvedLoop,
    *,
    name: str,
    models: tuple[NamedModel, ...],
    reading: Mapping[str, Any],
    parents: tuple[str, ...],
) -> ClosedLoop:
    """Makes the answer of films and of tables of observables.

    Args:
        name: what the measurement is called.
        models: of the verdict.
        reading: how films were read, JSON values.
        parents: artifacts that the recordings were read from; none for tables.
    """
    recordings = outcome.recordings
    recipe = {
        "close-loop-on-films": ANSWER,
        "simulations": VERSION,
        "sources": [recording.source for recording in recordings],
        "spans": [[recording.first, recording.duration] for recording in recordings],
        **reading,
        **outcome.options.recipe(),
    }
    return ClosedLoop(
        name=name,
        verdict=verdict,
        models=models,
        effects=acting(verdict)[:1],
        findings=outcome.findings,
        answer=answer_of_films(verdict, outcome, subject=name, words=words(verdict)),
        recipe=recipe,
        parents=parents,
        seed=outcome.options.calibration.seed,
    )


FABRIC = "camel-ponte-roma"
"""Whose tables are multiplied where it is not stated of which fabric a flag is."""
_STEP = 4e-3
_FRAMES, _RATE = 100, 25.0
_ROUGH = 1e-3


def models(verdict: Verdict, outcome: SolvedLoop, *, name: str) -> tuple[NamedModel, ...]:
    """Returns the base model as calibrated and, where an effect is named, the larger one.

    Args:
        name: that theirs begin with.
    """
    recipes = [
        NamedModel(name=f"{name}-base", content=_content(verdict, outcome, f"{name}-base", ()))
    ]
    if effects := acting(verdict)[:1]:
        larger = f"{name}-{effects[0].effect}"
        recipes.append(NamedModel(name=larger, content=_content(verdict, outcome, larger, effects)))
    return tuple(recipes)


def _content(
    verdict: Verdict, outcome: SolvedLoop, title: str, effects: Sequence[Candidate]
) -> Mapping[str, Any]:
    calibration, cloth = outcome.options.calibration, fitted_parameters(verdict, effects)
    speeds = [float(recording.speed.mean()) for recording in outcome.recordings]
    fabric = FABRIC if calibration.material is None else calibration.material.tables[0]
    speed: Any = (
        speeds[0] if min(speeds) == max(speeds) else {"low": min(speeds), "high": max(speeds)}
    )
    return {
        "title": title,
        "seed": calibration.seed,
        "batch": 1,
        "scene": {
            "shape": "flag",
            "width": calibration.flag.length,
            "height": calibration.flag.height,
            "columns": COLUMNS,
            "attachment": calibration.flag.attachment,
            "start-noise": _ROUGH,
        },
        "wind": {"speed": speed},
        "integrator": {"name": "implicit", "step": _STEP},
        "time": {"settle": SETTLE, "frames": _FRAMES, "rate": _RATE},
        "material": {
            "name": fabric,
            "area-weight": cloth["area_weight"],
            "bending-factor": cloth["bending"] / mean_bending(named_material(fabric)),
            "damping": max(cloth["damping"] - _STEP, 0.0),
        },
        **acting_effects(effects),
    }


LEVEL = 0.9
"""Level of the intervals of the calibration behind a verdict."""
_FEW, _MANY = 64, 128
"""Simulations of the base model for each recording, of one or two and of more."""
_TWO = 2


def close_films(
    sources: Sequence[str],
    chosen: JudgingFilms,
    *,
    lake: Lake | None,
    branch: str,
    name: str | None,
    level: float | None,
) -> ClosedLoop:
    """Judges recordings of one flag.

    Args:
        name: of the measurement; None for that of the first recording.
        level: of the test; None for the usual one.

    Raises:
        FlagdataError: sources that cannot be judged; nothing is written then.
    """
    if chosen.flag_size is None:
        raise UsageError(
            "the flag's size is missing: what is simulated is a flag of its size",
            where="--flag-size",
            fix="give length x height in metres, as in 1.5x1.0",
        )
    begun = time.monotonic()
    size = FlagSize.of(chosen.flag_size)
    calibration = options_of(
        chosen,
        size,
        simulations=chosen.simulations or simulations_of(len(sources)),
        level=LEVEL,
        seed=chosen.seed,
    )
    options = FilmLoopOptions(
        calibration=calibration,
        area_weight=chosen.area_weight,
        level=CRITERIA.level if level is None else level,
        kinds=CRITERIA.film_kinds if chosen.nulls is None else chosen.nulls,
        suspected=None
        if chosen.suspect is None
        else Suspicion.parse(chosen.suspect, weighable(calibration.flag)),
    )
    reading = FilmReading.of(chosen, size)
    opened = sources_of(sources, chosen, size, lake, at=branch)
    with progress(None, label="observe", unit="window") as advance:
        gathered = opened.read(size, advance=advance)
    recordings = distinct(gathered.recordings)
    say(
        announce_simulations(
            workload([recording.duration for recording in recordings], options),
            workers=chosen.processes,
        )
    )
    outcome = solve(
        recordings,
        options,
        folder=folder_of(chosen),
        workers=chosen.processes,
        stage=stage_bars(),
    )
    verdict = verdict_of(outcome)
    left_out = tuple((finding.kind, finding.what) for finding in gathered.left_out)
    verdict = replace(
        verdict, findings=(*left_out, *verdict.findings), seconds=time.monotonic() - begun
    )
    called = name or recordings[0].name
    return answer_of(
        verdict,
        outcome,
        name=called,
        models=models(verdict, outcome, name=called),
        reading=reading.recipe(),
        parents=gathered.parents,
    )


def simulations_of(recordings: int) -> int:
    """Counts simulations of the base model for each of so many recordings: as many as the
    covariance of all their summaries asks for."""
    return _FEW if recordings <= _TWO else _MANY


def workload(durations: Sequence[float], options: FilmLoopOptions) -> float:
    """Seconds of all flags that are simulated: of the base model, finer, with each effect, and of
    null experiments.

    Args:
        durations: of the recordings [s].
    """
    flags = options.calibration.simulations + TOGETHER * options.kinds
    paired = PAIRS * len(weighable(options.calibration.flag)) * len(durations)
    finer = sum(effort(duration) for duration in durations)
    return flags * sum(durations) + finer + paired * lasting(len(durations))
