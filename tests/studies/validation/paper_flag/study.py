"""The study of a case: base model before, candidates after, on speeds and lengths no fit has seen.

1. Declared: M = ρL/2 and half the tunnel's speed, nothing fitted, each with and without the other
   (two by two).
2. Fitted by linear stability: every candidate, with the logged speed and with a free factor, on the
   frequencies and stop speeds of the group "fit"; errors on the group "held-out", paired with the
   base model's.
3. Crossed: fitted to one kind of measurement alone, predicting the other: what one number of each
   must explain.
4. In time: candidates that flutter, at large amplitude; fitted to the same, judged also by the
   speed of the waves and the amplitude, which nothing was fitted to.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from flagdata.core.arrays import FloatArray
from tests.studies.validation.paper_flag.candidates import Candidate, Load, Shear, effects, tried
from tests.studies.validation.paper_flag.evidence import (
    Condition,
    Interval,
    Kind,
    LinearTable,
    Predictor,
    errors,
    fit,
    paired,
)
from tests.studies.validation.paper_flag.limit_cycle import StripMotion, simulate
from tests.studies.validation.paper_flag.observe import Observations
from tests.studies.validation.paper_flag.recipe import Case, Group
from tests.studies.validation.paper_flag.simulated import Flutter, SimulatedTable, flutters

IN_TIME = (Candidate.REACTIVE, Candidate.LIFT, Candidate.REACTIVE_AND_LIFT)
_FITTED = (Kind.FREQUENCY, Kind.STOP)
_JUDGED = (Kind.WAVE, Kind.AMPLITUDE)


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One of the two-by-two: declared, nothing fitted.

    Attributes:
        errors: kind → of all the whole sheet's clips, or all lengths.
        tips: tunnel speed [m/s] → half the tip's travel over the length, simulated; NaN where it
            diverged.
    """

    load: Load
    factor: float
    errors: Mapping[Kind, FloatArray]
    tips: Mapping[float, float]


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """A fitted model.

    Attributes:
        fitted_to: kinds.
        factors: (least, greatest) s of refits that each leave one condition out.
        fit, held_out: kind → log errors, condition by condition; wave speeds and amplitudes are
            never fitted to.
        others: log errors of the frequencies of other sheets.
        gains: kind → how much smaller held-out errors are than the base model's, paired.
    """

    candidate: Candidate
    shear: Shear
    fitted_to: tuple[Kind, ...]
    load: Load
    factor: float
    factors: tuple[float, float]
    loads: tuple[Load, ...]
    fit: Mapping[Kind, FloatArray]
    held_out: Mapping[Kind, FloatArray]
    others: FloatArray
    gains: Mapping[Kind, Interval]

    def held_out_error(self, kind: Kind) -> float:
        """Mean of |log error|."""
        return float(np.abs(self.held_out[kind]).mean())

    @property
    def score(self) -> float:
        """Mean over the kinds of the mean |log error| on what was not fitted."""
        return float(np.mean([self.held_out_error(kind) for kind in self.held_out]))


@dataclass(frozen=True, kw_only=True)
class Study:
    """Everything in the report.

    Attributes:
        shapes: candidate → the motion of its model in time with a free factor, at the first whole
            clip held out.
        floor: kind → largest |log| by which a coarser mesh moves the best model in time.
    """

    declared: tuple[Cell, ...]
    linear: tuple[Outcome, ...]
    crossed: tuple[Outcome, ...]
    in_time: tuple[Outcome, ...]
    linear_tables: Mapping[Candidate, LinearTable]
    tables: Mapping[Candidate, SimulatedTable]
    shapes: Mapping[Candidate, StripMotion]
    floor: Mapping[Kind, float]


class _Simulated(Protocol):
    """`flutters` for a case; another one of the same sheet may be given."""

    def __call__(
        self, loads: Sequence[Load], speeds: Sequence[float], of: Case = ..., /
    ) -> list[Flutter]: ...


@dataclass(frozen=True, kw_only=True)
class _Evidence:
    """The conditions of each group."""

    case: Case
    seen: Observations

    def of(self, group: Group, kinds: Sequence[Kind]) -> tuple[Condition, ...]:
        return self.seen.conditions(self.case, group, kinds)

    def unseen(self, kind: Kind) -> tuple[Condition, ...]:
        """What no fit has seen of a kind: both groups of the kinds that are never fitted to."""
        held_out = self.of(Group.HELD_OUT, (kind,))
        return (*self.of(Group.FIT, (kind,)), *held_out) if kind in _JUDGED else held_out

    def outcome(
        self,
        candidate: Candidate,
        shear: Shear,
        predictor: Predictor,
        *,
        fitted_to: Sequence[Kind],
        judged_by: Sequence[Kind],
    ) -> Outcome:
        training = self.of(Group.FIT, fitted_to)
        best = fit(predictor, shear, training)
        jack = [
            fit(predictor, shear, training[:i] + training[i + 1 :]) for i in range(len(training))
        ]
        unseen = {
            kind: errors(predictor, best.load, best.factor, self.unseen(kind)) for kind in judged_by
        }
        never = {kind: np.full(len(found), math.log(10.0)) for kind, found in unseen.items()}
        return Outcome(
            candidate=candidate,
            shear=shear,
            fitted_to=tuple(fitted_to),
            load=predictor.loads[best.load],
            factor=best.factor,
            factors=(min(one.factor for one in jack), max(one.factor for one in jack)),
            loads=tuple(dict.fromkeys(predictor.loads[one.load] for one in jack)),
            fit={
                k: errors(predictor, best.load, best.factor, self.of(Group.FIT, (k,)))
                for k in fitted_to
            },
            held_out=unseen,
            others=errors(
                predictor, best.load, best.factor, self.of(Group.OTHER, (Kind.FREQUENCY,))
            ),
            gains={kind: paired(never[kind], found) for kind, found in unseen.items()},
        )


def study(case: Case, seen: Observations, *, keep: Path | None = None) -> Study:
    """Everything of the module's head, about what was seen.

    Args:
        keep: folder of intermediate results; None keeps none.
    """

    def simulated(
        loads: Sequence[Load], speeds: Sequence[float], of: Case = case, /
    ) -> list[Flutter]:
        return flutters(loads, speeds, case=of, keep=keep)

    evidence = _Evidence(case=case, seen=seen)
    lengths = (*case.fit_lengths, *case.held_out_lengths)

    def linear_table(loads: Sequence[Load]) -> LinearTable:
        return LinearTable(loads, bare=case.sheet, density=case.density, lengths=lengths)

    linear: list[Outcome] = []
    crossed: list[Outcome] = []
    linear_tables = {candidate: linear_table(tried(candidate)) for candidate in Candidate}
    for candidate, table in linear_tables.items():
        linear += [
            evidence.outcome(candidate, s, table, fitted_to=_FITTED, judged_by=_FITTED)
            for s in Shear
        ]
        if candidate in IN_TIME:
            crossed += [
                evidence.outcome(candidate, Shear.FREE, table, fitted_to=(k,), judged_by=_FITTED)
                for k in _FITTED
            ]
    tables = _simulated_tables(case, linear_table, simulated)
    in_time = [
        evidence.outcome(
            candidate, shear, tables[candidate], fitted_to=_FITTED, judged_by=(*_FITTED, *_JUDGED)
        )
        for candidate, shear in itertools.product(IN_TIME, Shear)
    ]
    best = min(in_time, key=lambda outcome: outcome.score)
    return Study(
        declared=_declared(case, evidence, linear_table, simulated),
        linear=tuple(linear),
        crossed=tuple(crossed),
        in_time=tuple(in_time),
        linear_tables=linear_tables,
        tables=tables,
        shapes=_shapes(case, in_time),
        floor=_floor(case, best, simulated),
    )


def _simulated_tables(
    case: Case, linear_table: Callable[[Sequence[Load]], LinearTable], simulated: _Simulated
) -> dict[Candidate, SimulatedTable]:
    """The candidates of `IN_TIME` over the recipe's strengths and speeds."""
    loads = {
        Candidate.REACTIVE: [Load(reactive=m) for m in case.shares],
        Candidate.LIFT: [Load(lift=c) for c in case.lifts],
        Candidate.REACTIVE_AND_LIFT: [
            Load(reactive=m, lift=c)
            for m, c in itertools.product(case.pair_shares, case.pair_lifts)
        ],
    }
    return {
        candidate: SimulatedTable(
            part, case.speeds, _over(part, case.speeds, simulated), linear_table(part)
        )
        for candidate, part in loads.items()
    }


def _over(
    loads: Sequence[Load], speeds: Sequence[float], simulated: _Simulated
) -> list[list[Flutter]]:
    """(load, speed) of every pair."""
    pairs = list(itertools.product(loads, speeds))
    found = simulated([load for load, _ in pairs], [speed for _, speed in pairs])
    return [found[start : start + len(speeds)] for start in range(0, len(found), len(speeds))]


def _declared(
    case: Case,
    evidence: _Evidence,
    linear_table: Callable[[Sequence[Load]], LinearTable],
    simulated: _Simulated,
) -> tuple[Cell, ...]:
    """Base and declared loading, at the logged speed and at the declared share of it."""
    loads = (Load(), Load(reactive=case.reactive_share))
    table = linear_table(loads)
    kinds = {
        kind: (*evidence.of(Group.FIT, (kind,)), *evidence.of(Group.HELD_OUT, (kind,)))
        for kind in _FITTED
    }
    speeds = sorted(condition.at for condition in kinds[Kind.FREQUENCY])
    factors = (1.0, case.shear_factor)
    rows = _over(loads, [factor * speed for factor in factors for speed in speeds], simulated)
    return tuple(
        Cell(
            load=load,
            factor=factor,
            errors={kind: errors(table, index, factor, part) for kind, part in kinds.items()},
            tips={
                speed: rows[index][half * len(speeds) + at].tip for at, speed in enumerate(speeds)
            },
        )
        for index, load in enumerate(loads)
        for half, factor in enumerate(factors)
    )


def _shapes(case: Case, in_time: Sequence[Outcome]) -> dict[Candidate, StripMotion]:
    """What the models in time with a free factor do at the speed of a whole clip that is held
    out."""
    models = [outcome for outcome in in_time if outcome.shear is Shear.FREE]
    speed = next(clip.speed for clip in case.of(Group.HELD_OUT) if clip.whole)
    motion = simulate(
        length=case.sheet.length,
        mass=case.sheet.mass,
        rigidity=case.sheet.rigidity,
        density=case.density,
        speeds=[model.factor * speed for model in models],
        effects=effects(
            [model.load for model in models], length=case.sheet.length, density=case.density
        ),
        run=case.run,
    )
    return {
        model.candidate: replace(
            motion, along=motion.along[..., [i]], across=motion.across[..., [i]]
        )
        for i, model in enumerate(models)
    }


def _floor(case: Case, best: Outcome, simulated: _Simulated) -> dict[Kind, float]:
    """Largest |log| by which half as many cells and half the in-plane stiffness move the best
    model, by kind.

    More than what still finer cells would, since a mesh's errors shrink with its cells. Over the
    held-out speeds at which both can be read off; a kind without any is left out.
    """
    speeds = [best.factor * clip.speed for clip in case.of(Group.HELD_OUT)]
    coarse = replace(
        case,
        run=replace(case.run, columns=case.run.columns // 2, stretching=case.run.stretching / 2),
    )
    loads = [best.load] * len(speeds)
    pairs = list(zip(simulated(loads, speeds), simulated(loads, speeds, coarse), strict=True))
    names = {Kind.FREQUENCY: "frequency", Kind.WAVE: "wave", Kind.AMPLITUDE: "amplitude"}
    moved = {
        kind: [getattr(a, name) / getattr(b, name) for a, b in pairs]
        for kind, name in names.items()
    }
    known = {
        kind: [abs(math.log(r)) for r in ratios if math.isfinite(r) and r > 0]
        for kind, ratios in moved.items()
    }
    return {kind: max(sizes) for kind, sizes in known.items() if sizes}
