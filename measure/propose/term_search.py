"""Effects from data: terms are selected and fitted on one part of the recordings and tested on the
rest.

Errors are projected on directions whose null distribution is known, because errors of the numerics
could look like a term. The selected model is refitted and tested on data not used before, against
control terms of another direction and against the numerical floor.

What a proposal may see and what it is tested on: divided before anything is fitted.

Gauss–Newton fits of models to projected errors: linearised again at each estimate until it
converges.

Before and after on data that neither the choice of the terms nor the fit of either model used.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.errors import InputError
from measure.forecasting.calibrated_parameters import THETA, Calibration
from measure.forecasting.model import Model
from measure.forecasting.regressors import Column, EffectColumn, columns
from measure.forecasting.segments import Segments
from measure.forecasting.setting import Setting, Stage
from measure.inference.random_effect import NullModel
from measure.inference.segment_evidence import Evidence, gains
from measure.inference.whitened_misfit import WhitenedMisfit
from measure.loop.gauss_newton import ROUNDS, STAYS, cut
from measure.loop.strength_estimates import estimate
from measure.loop.validation import (
    LeftOut,
    a_segment,
    measure_left_out,
    numerical_floor,
    paired_difference,
    root,
    share_removed,
)
from measure.nulls import null_plan
from measure.nulls.reference import NullBank
from measure.probes.statistics import Statistics
from measure.propose.family import Family
from measure.propose.outcome import Decision, ProposalOutcome, Ranked, Retest, TermStrength
from measure.propose.projected import ProjectedSegments, evidence
from measure.propose.regressor_course import course
from measure.propose.search import Step, search, wrong
from measure.propose.terms import MASS, TermColumn
from measure.trajectories.trajectory import Experiment
from sim.effects.field import Flat

_FLOOR_COPIES = 2


def retest(
    setting: Setting,
    whitened: WhitenedMisfit,
    used: BoolArray,
    before: Model,
    after: Model,
    *,
    control: Model | None,
    control_names: Sequence[str],
    words: str,
    seed: int,
) -> Retest:
    """Compares prediction errors of untouched segments by the models, paired by segment, beside
    what numerics leave.

    Args:
        whitened: of all segments.
        used: (segment,) those that the models were fitted to, and that what is left of the numerics
            is fitted to.
        control: the same freedom spent on other terms; None where there are none of another
            direction.
        control_names: which.
        words: which data.
        seed: of the recordings that the floor is of.
    """

    def misfits_left(model: Model) -> LeftOut:
        return measure_left_out(setting.forecaster, setting.segments, [model], whitened, [~used])[0]

    first, second, recording = misfits_left(before), misfits_left(after), setting.recording[~used]
    wrong = None if control is None else misfits_left(control)
    _, floor = numerical_floor(
        setting, np.unique(recording), after, copies=_FLOOR_COPIES, seed=seed
    )
    return Retest(
        what=words,
        segments=int((~used).sum()),
        before=root(first.squared),
        after=root(second.squared),
        reduction=paired_difference(first.squared, second.squared),
        helped=a_segment(first.misfit - second.misfit, recording),
        floor=root(floor),
        share=share_removed(first.squared, second.squared, floor),
        control=None if wrong is None else root(wrong.squared),
        apart=None if wrong is None else a_segment(wrong.misfit - second.misfit, recording),
        control_names=tuple(control_names),
    )


@dataclass(frozen=True, kw_only=True)
class FittedModel:
    """A model with standard errors of its calibrated parameters and strengths, as the null model
    has them."""

    model: Model
    errors: tuple[float, ...]


def fit(
    projected: ProjectedSegments,
    null: NullModel,
    speeds: FloatArray,
    columns: Sequence[EffectColumn],
    start: Sequence[float],
) -> FittedModel:
    """Fits calibrated parameters and strengths, by Gauss and Newton.

    Args:
        speeds: (segment,) of the wind [m/s].
        start: steps from the nominal model to begin with: the linear fit there.
    """
    model = Model(calibration=Calibration(), effects=tuple((column, 0.0) for column in columns))
    step, errors = np.array(cut(np.array(start, dtype=np.float64))), np.zeros(len(start))
    for _ in range(ROUNDS):
        model = model.moved(tuple(step))
        step, errors = _step(projected, null, speeds, model)
        if np.abs(step / errors).max() < STAYS:
            break
    return FittedModel(model=model.moved(tuple(step)), errors=tuple(float(e) for e in errors))


def _step(
    projected: ProjectedSegments, null: NullModel, speeds: FloatArray, model: Model
) -> tuple[FloatArray, FloatArray]:
    """Takes one step of generalised least squares from a model, under the prior about the nominal
    calibration, and returns its standard errors."""
    projected_evidence = evidence(projected.at(model), speeds, null)
    fitted = projected_evidence.fit(
        range(len(THETA), projected_evidence.columns),
        centre=Calibration().steps_from(model.calibration),
    )
    value, error = np.array([fitted.of(column) for column in range(projected_evidence.columns)]).T
    return np.array(cut(value)), error


_LEAST = 3
"""Segments on each side: an interval of a mean wants three."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Split:
    """Segments for choosing and fitting, and segments for the test.

    Attributes:
        used: (segment,) whether a proposal is made from it; the others are for its test.
        words: what the test is on.
    """

    used: BoolArray
    words: str


def split(segments: Segments, speeds: FloatArray) -> Split:
    """Splits off the last third of every recording for the test; of three or more, also the whole
    one of the middle wind.

    Args:
        speeds: (recording,) of the wind [m/s].

    Raises:
        InputError: too few segments.
    """
    recording = segments.recording
    used = np.ones(len(recording), dtype=bool)
    words = "the last third of each recording"
    for index in np.unique(recording):
        of_recording = np.flatnonzero(recording == index)
        used[of_recording[-max(1, len(of_recording) // 3) :]] = False
    if len(speeds) > 2:
        middle = int(np.argsort(speeds, kind="stable")[len(speeds) // 2])
        used[recording == middle] = False
        words = f"all of the recording at {speeds[middle]:.1f} m/s and the last third of the others"
    if min(int(used.sum()), int((~used).sum())) < _LEAST:
        raise InputError(
            f"there are {int(used.sum())} segments to propose from and {int((~used).sum())} to "
            "test on",
            where="propose",
            fix=f"record for longer, or more recordings: {_LEAST} of each are needed, of up to 2 s",
        )
    return Split(used=used, words=words)


def data_hash(segments: Segments) -> str:
    """Hashes the markers, positions and wind of segments, SHA-256, hex."""
    digest = hashlib.sha256(np.ascontiguousarray(segments.markers, dtype="<f8").tobytes())
    for item in segments.items:
        times = np.asarray(
            item.start + np.arange(len(item.positions)) * segments.period, dtype=np.float64
        )
        for values in (item.positions, item.wind.at(times)):
            digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()


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
    steps = search(
        prepared.evidence,
        prepared.family,
        prepared.labels,
        prepared.pool,
        acting=prepared.acting,
        level=options.level,
    )
    stage("terms", 1, 1)
    taken = [step for step in steps if step.taken]
    strengths: tuple[TermStrength, ...] = ()
    tested = None
    decision, reason = Decision.REJECTED, steps[0].reason if steps else "no term was given"
    if taken:
        stage("test on untouched data", 0, 1)
        larger = prepared.fit([*prepared.acting, *(step.column for step in taken)])
        tested = _retest_against_control(setting, prepared, taken, larger, seed=options.seed)
        strengths = _strengths(
            setting, prepared.evidence, prepared.family, taken, prepared.acting, larger
        )
        decision, reason = tested.decision
        stage("test on untouched data", 1, 1)
    untouched = setting.segments.select(np.flatnonzero(~prepared.parts.used))
    return ProposalOutcome(
        decision=decision,
        reason=reason,
        steps=steps,
        tried=prepared.tried,
        ranking=_ranking(prepared.evidence, prepared.family, prepared.labels, prepared.pool),
        strengths=strengths,
        retest=tested,
        level=options.level,
        nulls=bank.words,
        proposed_from=data_hash(prepared.projected.segments),
        tested_on=data_hash(untouched),
        known=tuple(column.name for column in acting_columns),
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
