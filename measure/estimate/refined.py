"""A measurement refined by simulation: `measure.refine` at the flag's own size.

Refinement simulates flags of the size that the models are trained on. The film's frames were taken
at the instants at which a flag of its own size looks like one of those (`measure.film.similarity`),
so what is found scales back like
what the model says: wind by √s, area weight by s, bending stiffness by s⁴.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from flagdata.core.stated import Stated
from flagdata.errors import UsageError
from measure.estimate.film_measuring import Measurement
from measure.film.film_source import Subject
from measure.film.similarity import LOGARITHMS, POWERS
from measure.refine.refine_command import Clip, run
from measure.refine.refinement import Refined, Refinement
from models.networks.targets import ASPECT, Cloth
from models.trained.estimator import Estimator


def refine_window(
    measured: Measurement, subject: Subject, model: Estimator, *, budget: int, cache: Path | None
) -> Refinement:
    """Refines the first window that counts of a film of a flag whose size is known.

    Where the film's record states how it was simulated and filmed, the simulated clips are filmed
    likewise. Both are conditioned after that, so it does not matter which square of the picture is
    judged.

    Args:
        budget: simulated clips.
        cache: folder for evaluations, so that an interrupted run goes on; None for none.

    Raises:
        UsageError: the model is of no flags.
        InputError: a budget that is too small, see `measure.refine.procedure.refine`.
    """
    if model.cloth is not Cloth.FLAG:
        raise UsageError(
            f"the model {model.name!r} is of {model.cloth.value}, refinement simulates flags",
            where="--refine",
            fix="leave --refine out, or name a model of flags",
        )
    clip = Clip(name=measured.film, frames=measured.clip, recording=subject.artifact)
    options = measured.options
    s = float(measured.sizes.scale[0])
    area_weight = options.area_weight
    refinement = run(
        [clip],
        model,
        budget=budget,
        seed=options.seed,
        level=options.level,
        cache=cache,
        area_weight=None if area_weight is None else _searched_range(area_weight, s),
        aspect=None
        if options.size is None or ASPECT not in options.stated(model)
        else options.size.aspect,
    )
    return scale_refinement(refinement, s)


def _searched_range(area_weight: Stated, s: float) -> Stated:
    """Returns the range of area weights searched for a flag of s times the size [kg/m²]: two
    standard deviations either way of what was stated, or 1 % either way of an exact value, since a
    search needs a width."""
    low, high = area_weight.within(2.0)
    slack = 0.01 * low if low == high else 0.0
    return Stated(low=(low - slack) / s, high=(high + slack) / s)


def scale_refinement(refinement: Refinement, s: float) -> Refinement:
    """Scales a refinement to a flag s times as large as the one simulated."""
    if math.isclose(s, 1.0):
        return refinement
    return replace(
        refinement,
        intervals=_all_scaled(refinement.intervals, s),
        amortised=_all_scaled(refinement.amortised, s),
        bending=refinement.bending * s**4,
        rounds=tuple(
            replace(round_, intervals=_all_scaled(round_.intervals, s))
            for round_ in refinement.rounds
        ),
        scale=s,
    )


def _all_scaled(intervals: tuple[Refined, ...], s: float) -> tuple[Refined, ...]:
    return tuple(_scale_interval(interval, s) for interval in intervals)


def _scale_interval(interval: Refined, s: float) -> Refined:
    name = interval.name.partition(".")[0]
    factor = s ** POWERS.get(name, 0.0)
    shift = LOGARITHMS.get(name, 0.0) * math.log10(s)
    scaled_span = replace(
        interval.span,
        low=interval.span.low * factor + shift,
        high=interval.span.high * factor + shift,
    )
    return replace(
        interval,
        value=None if interval.value is None else interval.value * factor + shift,
        span=scaled_span,
    )
