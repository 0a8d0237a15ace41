"""Effects from data: terms are selected and fitted on one part of the recordings and tested on the
rest.

Errors are projected on directions whose null distribution is known, because errors of the numerics
could look like a term. The selected model is refitted and tested on data not used before, against
control terms of another direction and against the numerical floor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from measure.forecasting.calibrated_parameters import THETA
from measure.forecasting.regressors import Column, EffectColumn, columns
from measure.forecasting.setting import Setting, Stage
from measure.inference.random_effect import NullModel
from measure.inference.segment_evidence import Evidence, gains
from measure.loop.strength_estimates import estimate
from measure.nulls import null_plan
from measure.nulls.reference import NullBank
from measure.probes.statistics import Statistics
from measure.propose.family import Family
from measure.propose.outcome import Decision, ProposalOutcome, Ranked, Retest, TermStrength
from measure.propose.projected import ProjectedSegments, evidence
from measure.propose.projected_fit import FittedModel, fit
from measure.propose.proposal_split import Split, data_hash, split
from measure.propose.regressor_course import course
from measure.propose.retest import retest
from measure.propose.search import Step, search, wrong
from measure.propose.terms import MASS, TermColumn
from measure.trajectories.trajectory import Experiment
from sim.effects.field import Flat

_CALM = 0.3
"""Wind below which its direction is not known well enough for terms along it [m/s]."""


_MOVES = (0.12, 0.06)
"""By which the places of local terms are improved, as shares of width and height."""
_CLOSE = 0.6
"""A local term with this share of the best one's gain is worth a better place."""


def propose(
    experiment: Experiment,
    candidates: Sequence[EffectColumn],
    *,
    acting_columns: Sequence[EffectColumn] = (),
    controls: Sequence[EffectColumn] = (),
    options: null_plan.NullOptions,
    stage: Stage | None = None,
) -> ProposalOutcome:
    """Seeks terms that a model lacks, and keeps them if they help on recordings that were not
    looked at.

    Args:
        candidates: terms, or strengths of an effect from a file.
        acting_columns: strengths that the model has already.
        controls: terms that are not taken, but may be what a proposal is compared with.
        stage: called with progress.

    Raises:
        InputError: recordings that cannot be used, are too few, or are of calm air.
    """
    torch.set_num_threads(1)
    report = stage or (lambda stage_name, done, total: None)
    setting = made_ready(experiment)
    bank = null_plan.bank_for(setting, options, stage=report)
    return weigh(
        setting,
        candidates,
        bank,
        columns(),
        acting_columns=acting_columns,
        controls=controls,
        options=options,
        stage=report,
    )


def made_ready(experiment: Experiment) -> Setting:
    """Brings the recordings to one frame and cuts them.

    Raises:
        InputError: as `propose`.
    """
    setting = Setting.of(experiment)
    slowest = int(np.argmin(setting.speeds))
    if setting.speeds[slowest] < _CALM:
        raise InputError(
            f"its wind is {setting.speeds[slowest]:.2g} m/s: it has no direction",
            where=f"recording {experiment.recordings[slowest].name!r}",
            fix="leave the calm recording out",
        )
    return setting


def weigh(
    setting: Setting,
    candidates: Sequence[EffectColumn],
    bank: NullBank,
    along: Sequence[Column],
    *,
    acting_columns: Sequence[EffectColumn] = (),
    controls: Sequence[EffectColumn] = (),
    options: null_plan.NullOptions,
    stage: Stage,
) -> ProposalOutcome:
    """Weighs the candidates on recordings, given nulls.

    Args:
        along: the columns that the nulls are known along, the calibrated parameters left out.

    Raises:
        InputError: nulls of segments of another length; too few segments.
    """
    null_plan.check(bank, setting)
    bank = bank.plain()
    stage("terms", 0, 1)
    prepared = _prepare(
        setting,
        bank,
        along,
        candidates,
        acting_columns=acting_columns,
        controls=controls,
        seed=options.seed,
    )
    steps = prepared.search(level=options.level)
    stage("terms", 1, 1)
    tested = None
    if taken := [step for step in steps if step.taken]:
        stage("test on untouched data", 0, 1)
        tested = _test_terms(setting, prepared, taken, seed=options.seed)
        stage("test on untouched data", 1, 1)
    return _outcome(setting, prepared, steps, tested, nulls=bank.words, options=options)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Tested:
    """Terms that were taken: how much they help on untouched segments, and how strong they are."""

    retest: Retest
    strengths: tuple[TermStrength, ...]


def _test_terms(
    setting: Setting, prepared: _Prepared, taken: Sequence[Step], *, seed: int
) -> _Tested:
    """Fits the model with what was taken, and tests it on untouched segments."""
    larger = prepared.fit([*prepared.acting, *(step.column for step in taken)])
    return _Tested(
        retest=_retest_against_control(setting, prepared, taken, larger, seed=seed),
        strengths=_strengths(
            setting, prepared.evidence, prepared.family, taken, prepared.acting, larger
        ),
    )


def _outcome(
    setting: Setting,
    prepared: _Prepared,
    steps: tuple[Step, ...],
    tested: _Tested | None,
    *,
    nulls: str,
    options: null_plan.NullOptions,
) -> ProposalOutcome:
    """States what was found, and on which data.

    Args:
        tested: None where no term was taken.
        nulls: which the terms were compared with, in words.
    """
    if tested is None:
        decision, reason = Decision.REJECTED, steps[0].reason if steps else "no term was given"
    else:
        decision, reason = tested.retest.decision
    untouched = setting.segments.select(np.flatnonzero(~prepared.parts.used))
    return ProposalOutcome(
        decision=decision,
        reason=reason,
        steps=steps,
        tried=prepared.tried,
        ranking=_ranking(prepared.evidence, prepared.family, prepared.labels, prepared.pool),
        strengths=() if tested is None else tested.strengths,
        retest=None if tested is None else tested.retest,
        level=options.level,
        nulls=nulls,
        proposed_from=data_hash(prepared.projected.segments),
        tested_on=data_hash(untouched),
        known=tuple(prepared.effect(column).name for column in prepared.acting),
        seed=options.seed,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Prepared:
    """What terms are chosen and fitted by: the part of the recordings that a proposal is made from.

    A column is a place in the evidence: first the calibrated parameters, then `effects`.

    Attributes:
        parts: which segments are for choosing.
        whole: all segments, projected.
        projected: those for choosing.
        null: model of what numerics leave.
        speeds: (segment,) of the wind, of those for choosing [m/s].
        effects: what is known to act, the controls, the candidates.
        evidence: of all columns.
        family: statistics of all columns in the nulls.
        acting: columns of what is known to act.
        physical: columns of controls and candidates whose fitted strength makes sense.
        pool: those of candidates alone.
        tried: how many candidates there were.
    """

    parts: Split
    whole: ProjectedSegments
    projected: ProjectedSegments
    null: NullModel
    speeds: FloatArray
    effects: tuple[EffectColumn, ...]
    evidence: Evidence
    family: Family
    acting: list[int]
    physical: list[int]
    pool: list[int]
    tried: int

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of all columns."""
        return (*(name for name, _, _ in THETA), *(column.name for column in self.effects))

    def effect(self, column: int) -> EffectColumn:
        """Returns the effect of a column."""
        return self.effects[column - len(THETA)]

    def search(self, *, level: float) -> tuple[Step, ...]:
        """Takes candidates one after the other, while another one is significant."""
        return search(
            self.evidence, self.family, self.labels, self.pool, acting=self.acting, level=level
        )

    def fit(self, columns: Sequence[int]) -> FittedModel:
        """Fits the model that has the effects of these columns."""
        linear = self.evidence.fit(columns)
        start = [linear.of(column)[0] for column in (*range(len(THETA)), *columns)]
        effects = [self.effect(column) for column in columns]
        return fit(self.projected, self.null, self.speeds, effects, start)

    def control(self, taken: Sequence[Step]) -> list[int]:
        """Chooses as many columns as were taken, of other kinds and directions."""
        kinds = {_kind(self.effect(step.column)) for step in taken}
        unlike = [column for column in self.physical if _kind(self.effect(column)) not in kinds]
        return wrong(self.evidence, unlike, [step.column for step in taken], self.acting)


def _prepare(
    setting: Setting,
    bank: NullBank,
    along: Sequence[Column],
    candidates: Sequence[EffectColumn],
    *,
    acting_columns: Sequence[EffectColumn],
    controls: Sequence[EffectColumn],
    seed: int,
) -> _Prepared:
    """Divides the recordings, and computes the evidence of all columns on the part for choosing.

    Raises:
        InputError: too few segments.
    """
    parts = split(setting.segments, setting.speeds)
    null = bank.model(setting.design).under(setting.prior)
    whole = ProjectedSegments.of(setting.forecaster, setting.segments, along)
    projected = whole.select(np.flatnonzero(parts.used))
    speeds = projected.speeds(setting.speeds)
    tried = _try_terms(projected, null, speeds, candidates, [*acting_columns, *controls])
    found = evidence(tried.statistics, speeds, null)
    noise = max(segment.noise for segment in projected.segments.items)
    first = len(THETA) + len(acting_columns)
    acting = list(range(len(THETA), first))
    proposed = list(range(first, len(THETA) + len(tried.columns)))
    physical = [
        column
        for column in proposed
        if _admissible(tried.columns[column - len(THETA)], found, column, acting)
    ]
    return _Prepared(
        parts=parts,
        whole=whole,
        projected=projected,
        null=null,
        speeds=speeds,
        effects=tried.columns,
        evidence=found,
        family=Family.of(bank.nulls, tried.statistics, noise=noise, seed=seed),
        acting=acting,
        physical=physical,
        pool=[column for column in proposed[len(controls) :] if column in physical],
        tried=len(proposed) - len(controls),
    )


def _retest_against_control(
    setting: Setting, prepared: _Prepared, taken: Sequence[Step], larger: FittedModel, *, seed: int
) -> Retest:
    """Tests the larger model on untouched segments, beside the model before and a control.

    Args:
        larger: the model with what was taken.
    """
    instead = prepared.control(taken)
    control = prepared.fit([*prepared.acting, *instead]).model if instead else None
    return retest(
        setting,
        prepared.whole.whitened(prepared.null, setting.speeds),
        prepared.parts.used,
        prepared.fit(prepared.acting).model,
        larger.model,
        words=prepared.parts.words,
        seed=seed,
        control=control,
        control_names=[prepared.labels[column] for column in instead],
    )


def _admissible(
    column: EffectColumn, projected_evidence: Evidence, index: int, acting: Sequence[int]
) -> bool:
    """Returns whether the strength that fits makes sense."""
    return column.described.admits(
        column.described.null + projected_evidence.fit([*acting, index]).of(index)[0]
    )


def _kind(column: EffectColumn) -> str:
    """Returns the field of a term, the effect of another strength: a control is of another."""
    return column.term.field if isinstance(column, TermColumn) else column.effect


@dataclass(frozen=True, kw_only=True, eq=False)
class _Tried:
    """Columns, and their projected statistics after those of the calibrated parameters."""

    columns: tuple[EffectColumn, ...]
    statistics: Statistics


def _try_terms(
    projected: ProjectedSegments,
    null: NullModel,
    speeds: FloatArray,
    candidates: Sequence[EffectColumn],
    fixed: Sequence[EffectColumn],
) -> _Tried:
    """Adds fixed columns, candidates, and the best local candidate at places nearby."""
    columns = (*fixed, *candidates)
    tried = _Tried(columns=columns, statistics=projected.of_columns(columns))
    for size in _MOVES:
        first = len(THETA) + len(fixed)
        gained = gains(
            evidence(tried.statistics, speeds, null),
            [[c] for c in range(first, len(THETA) + len(tried.columns))],
        )
        moved = _move_best_term(
            dict(zip(tried.columns[len(fixed) :], gained.sum(axis=1).tolist(), strict=True)), size
        )
        if not moved:
            break
        added = projected.of_columns(moved).response[:, :, len(THETA) :]
        response = np.concatenate([tried.statistics.response, added], axis=2)
        tried = _Tried(
            columns=(*tried.columns, *moved),
            statistics=replace(tried.statistics, response=response),
        )
    return tried


def _move_best_term(gained: dict[EffectColumn, float], size: float) -> list[TermColumn]:
    """Moves the best local term to places nearby, if it is among the best at all."""
    best = max(gained.values(), default=0.0)
    leading = {
        c: g
        for c, g in gained.items()
        if isinstance(c, TermColumn) and c.term.at.place and g >= _CLOSE * best
    }
    if not leading or best <= 0:
        return []
    term = max(leading, key=lambda column: leading[column]).term
    count = len(term.at.place)
    steps = np.array(np.meshgrid(*[(-size, 0.0, size)] * count)).reshape(count, -1).T
    by_name = {
        column.name: column
        for column in (TermColumn.of(term.moved(*step)) for step in steps.tolist())
    }
    tried = {column.name for column in gained}
    return [column for name, column in by_name.items() if name not in tried]


def _ranking(
    projected_evidence: Evidence, family: Family, names: tuple[str, ...], pool: Sequence[int]
) -> tuple[Ranked, ...]:
    """Ranks all terms, each alone, best first."""
    statistics, gained = (
        family.statistics(projected_evidence),
        gains(projected_evidence, [[column] for column in pool]).sum(axis=1),
    )
    ranked_terms = [
        Ranked(name=names[column], statistic=float(statistics[column]), gain=float(gain))
        for column, gain in zip(pool, gained, strict=True)
    ]
    return tuple(sorted(ranked_terms, key=lambda ranked: -ranked.gain))


def _strengths(
    setting: Setting,
    projected_evidence: Evidence,
    family: Family,
    taken: Sequence[Step],
    acting: Sequence[int],
    after: FittedModel,
) -> tuple[TermStrength, ...]:
    """Estimates strengths beyond the linear; errors are scaled by what makes the nulls' mean
    squared z 1."""
    chosen = [*acting, *(step.column for step in taken)]
    linear = projected_evidence.fit(chosen)
    strengths: list[TermStrength] = []
    for index, step in enumerate(taken, start=len(acting)):
        column, value = after.model.effects[index]
        first, claimed = linear.of(step.column)
        other_columns = [c for c in chosen if c != step.column]
        statistic = float(family.statistics(projected_evidence, other_columns)[step.column])
        scale = max(1.0, abs(first) / math.sqrt(max(statistic, 1e-12)) / claimed)
        error = scale * after.errors[len(THETA) + index]
        strength = estimate(column.described.null + value, error, column.unit)
        words = _words(setting, column, value, after.model.calibration.area_weight)
        strengths.append(
            TermStrength(
                name=column.parameter,
                words=words,
                estimate=strength,
                course=course(setting, after.model, index),
            )
        )
    return tuple(strengths)


def _words(setting: Setting, column: EffectColumn, value: float, weight_factor: float) -> str:
    """Describes what a strength of this sign is; of mass, how much."""
    if not isinstance(column, TermColumn):
        return column.name
    if column.term.field != MASS:
        return column.term.words if value >= 0 else f"the opposite of {column.term.words}"
    specimen = setting.experiment.specimen
    cloth = setting.forecaster.system(setting.segments.select([0]), [setting.calibration])[0].cloth
    share = column.term.at.of(Flat(cloth=cloth))[:, 0, 0].double().numpy()
    added = (
        value
        * weight_factor
        * specimen.material.area_weight
        * float(specimen.mesh.vertex_areas @ share)
    )
    return f"{column.term.words}: {1e3 * added:+.3g} g in all"
