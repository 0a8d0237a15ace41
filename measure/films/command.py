"""`flagdata close-loop` on films with logs and on tables of observables: read and judged."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import replace

from flagdata.caches import user_cache
from flagdata.console import progress, say
from flagdata.errors import UsageError
from flagdata.lake import Lake
from flagdata.stated import Stated
from measure.calibrate.calibrate import Options as Calibrating
from measure.calibrate.fabric import fabric
from measure.calibrate.filmed import Sources
from measure.calibrate.known import known
from measure.calibrate.numerics import effort
from measure.calibrate.prior import AZIMUTH, ELEVATION
from measure.calibrate.simulation import Flag
from measure.calibrate.workload import announced
from measure.closing.artifacts import Answer
from measure.closing.command_line import stage_bars
from measure.closing.sources import distinct
from measure.film.similarity import parse_size
from measure.film.source import Reading, box_of
from measure.films.artifacts import answer_of
from measure.films.command_line import Given
from measure.films.design import PAIRS, TOGETHER, lasting
from measure.films.library import weighable
from measure.films.models import models
from measure.films.run import Options, solve, verdict_of
from measure.forecasting.strengths import Suspicion
from measure.verdict.criteria import CRITERIA

_FEW, _MANY = 64, 128
"""Simulations of the base model for each recording, of one or two and of more."""
_TWO = 2
_RELATIVE = 0.01
"""Standard uncertainty of a weight that is stated without one, as a share."""


def close_films(
    sources: Sequence[str],
    given: Given,
    *,
    lake: Lake | None,
    branch: str,
    name: str | None,
    material: str | None,
    level: float | None,
    nulls: int | None,
    suspect: str | None,
    seed: int,
    workers: int | None,
) -> Answer:
    """Judge recordings of one flag.

    Args:
        material: what the flag is made of; None for any fabric.
        nulls: kinds of numerics.
        suspect: an effect that was suspected before the recordings were looked at, with its sign.

    Raises:
        FlagdataError: sources that cannot be judged; nothing is written then.
    """
    if given.flag_size is None:
        raise UsageError(
            "the flag's size is missing: what is simulated is a flag of its size",
            where="--flag-size",
            fix="give length x height in metres, as in 1.5x1.0",
        )
    begun = time.monotonic()
    size = parse_size(given.flag_size)
    flag = Flag(length=size.length, height=size.height, attachment=given.attachment)
    options = Options(
        calibration=Calibrating(
            flag=flag,
            azimuth=AZIMUTH if given.azimuth is None else known(AZIMUTH, given.azimuth, where="--azimuth"),
            elevation=ELEVATION if given.elevation is None else known(ELEVATION, given.elevation, where="--elevation"),
            distance=given.distance,
            simulations=given.simulations or simulations_of(len(sources)),
            seed=seed,
            material=None if material is None else fabric(material, where="--material"),
        ),
        area_weight=None if given.area_weight is None else weight(given.area_weight),
        level=CRITERIA.level if level is None else level,
        kinds=CRITERIA.film_kinds if nulls is None else nulls,
        suspected=None if suspect is None else Suspicion.parse(suspect, weighable(flag)),
    )
    reading = Reading(crop=box_of(given.crop), flag=given.flag, aspect=size.aspect)
    opened = Sources.open(
        sources,
        size,
        reading,
        lake=lake,
        at=branch,
        first=given.first,
        last=given.last,
        log=given.log,
        offset=given.clock_offset,
    )
    with progress(None, label="observe", unit="window") as advance:
        gathered = opened.read(size, advance=advance)
    recordings = distinct(gathered.recordings)
    processes = workers or len(os.sched_getaffinity(0))
    say(announced(workload([one.duration for one in recordings], options), workers=processes))
    outcome = solve(
        recordings,
        options,
        folder=given.cache or user_cache() / "calibrate",
        workers=processes,
        stage=stage_bars(),
    )
    verdict = verdict_of(outcome)
    left_out = tuple((one.kind, one.what) for one in gathered.left_out)
    verdict = replace(verdict, findings=(*left_out, *verdict.findings), seconds=time.monotonic() - begun)
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
    """Of the base model for each of so many recordings: as many as the covariance of all their summaries asks for."""
    return _FEW if recordings <= _TWO else _MANY


def workload(durations: Sequence[float], options: Options) -> float:
    """Seconds of all flags that are simulated: of the base model, finer, with each effect, and of null experiments.

    Args:
        durations: of the recordings [s].
    """
    each = options.calibration.simulations + TOGETHER * options.kinds
    paired = PAIRS * len(weighable(options.calibration.flag)) * len(durations)
    finer = sum(effort(duration) for duration in durations)
    return each * sum(durations) + finer + paired * lasting(len(durations))


def weight(stated: Stated) -> tuple[float, float]:
    """Mean and standard deviation of a stated area weight [kg/m²]; of a range those of a uniform distribution.

    Raises:
        UsageError: a weight that no cloth has.
    """
    middle = (stated.low + stated.high) / 2
    if not middle > 0:
        raise UsageError(f"{stated.text} kg/m²", where="--area-weight", fix="give one above 0, as in 0.155±0.005")
    return middle, max(stated.sigma, (stated.high - stated.low) / 12**0.5, _RELATIVE * middle)
