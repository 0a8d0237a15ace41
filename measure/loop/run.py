"""Closing the loop on trajectories: from recordings to the numbers of a verdict about what the base
model lacks.

The steps are those of the method: align, predict one horizon ahead, fit the base model, compare
with nulls of other numerics, weigh the library's effects, judge, and run the refitted model on what
it was not fitted to.
"""

from __future__ import annotations

import math
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch

from flagdata.answer import Quantity
from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.json_values import json_values
from flagdata.core.provenance import code_version
from flagdata.core.rng import child_seed
from flagdata.errors import InputError, UsageError
from measure.forecasting.calibrated_parameters import THETA, Calibration
from measure.forecasting.model import Model
from measure.forecasting.regressors import EffectColumn, columns, names
from measure.forecasting.setting import Setting, Stage
from measure.forecasting.strengths import WHERE, Suspicion
from measure.inference.segment_evidence import CoefficientFit, Evidence
from measure.inference.whitened_misfit import WhitenedMisfit
from measure.loop.cloth_parameters import parameters
from measure.loop.corrective_field import Mode, corrective_field
from measure.loop.effect_selection import (
    GUST_COLUMN,
    LibraryJudgement,
    equivalent,
    finalists,
    judge,
    withdrawn,
)
from measure.loop.gauss_newton import Refined, cut
from measure.loop.refit import Fits, Refit, refit
from measure.loop.residuals import residuals
from measure.loop.set_up import SetUp
from measure.loop.strength_estimates import strength
from measure.loop.validation import (
    LeftOut,
    Predictions,
    Trial,
    compare,
    folds,
    numerical_floor,
    predict,
)
from measure.loop.weighed_effects import Weighed
from measure.nulls import bank as banks
from measure.nulls import null_plan
from measure.nulls.conformal import kinds_needed
from measure.nulls.free_run import settled_off
from measure.nulls.null_simulation import NullBatch
from measure.nulls.reference import NullBank, Reference
from measure.probes.lines import SpectralLine
from measure.probes.statistics import Projection, Statistics, projected_statistics
from measure.probes.wind_course import Variation
from measure.probes.wind_log import lags
from measure.trajectories.checks.attachment import hoist_stands_still
from measure.trajectories.trajectory import Experiment
from measure.verdict.criteria import CRITERIA
from measure.verdict.decided import NOT_REJECTED
from measure.verdict.verdict_record import (
    Candidate,
    Comparison,
    Conclusion,
    NullTest,
    Parameter,
    Power,
    Verdict,
)

_FLOOR_COPIES = 4
_LOOKS = 4
"""At most: a damping of 30 ms is reached from 2.5 ms in two or three."""


@dataclass(frozen=True, kw_only=True)
class LoopOptions(null_plan.NullOptions):
    """How to close the loop: by which nulls, at which level of the global test.

    Attributes:
        most_nulls: up to so many are simulated where p is near the level; without effect where a
            bank is given.
        suspected: the effect with its sign that was suspected before the recordings were looked at,
            along which alone is tested; None to test along all.

    Raises:
        UsageError: values that make no sense, or a level that so many nulls cannot test.
    """

    most_nulls: int = 2 * null_plan.FEWEST_NULLS
    suspected: Suspicion | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        needed = banks.WINDS * kinds_needed(self.level)
        if self.bank is None and self.nulls < needed:
            raise UsageError(
                f"{self.nulls} nulls cannot test at a level of {self.level:g}",
                where="close-loop",
                fix=f"give {needed} nulls or more, or a higher level",
            )


@dataclass(frozen=True, kw_only=True, eq=False)
class LoopOutcome:
    """The numerical result of an experiment, without sentences.

    Attributes:
        verdict: all numbers of the verdict; its sentences are empty.
        experiment: in the frame of the fit, with the logs of the wind moved by what they lag.
        lags: (recording,) by how much they were moved [s].
        at_bounds: names of the calibrated parameters that are as small or as large as the model
            holds.
        field: modes of the corrective field; empty where the library has the whole answer.
        whole: whether the field stands for all that the base model lacks, and not for what a larger
            model leaves.
        line: of the errors' spectra that remains beside what is named.
        course: of the wind that remains beside it, and is not turbulence.
    """

    verdict: Verdict
    experiment: Experiment
    lags: tuple[float, ...]
    at_bounds: tuple[str, ...]
    field: tuple[Mode, ...] = ()
    whole: bool = True
    line: SpectralLine | None = None
    course: Variation | None = None


def solve(
    experiment: Experiment, options: LoopOptions, *, stage: Stage | None = None
) -> LoopOutcome:
    """Solves an experiment: tests, fits, validates.

    Args:
        stage: called with progress.

    Raises:
        InputError: recordings that cannot be used (see `measure.trajectories.checks` for what is
            looked at before).
    """
    began = time.perf_counter()
    torch.set_num_threads(1)
    report = stage or (lambda stage_name, done, total: None)
    setting = Setting.of(experiment, workers=options.workers)
    report("sensitivities", 0, 1)
    measured, projection = _looked_at(setting)
    course = measured.course
    late = (0.0,) * len(setting.speeds) if course is None else lags(course, setting.segments)
    if any(late):
        setting = setting.moved(late)
        measured, projection = _looked_at(setting)
    report("sensitivities", 1, 1)
    nominal, suspected = setting, _suspected_effect(measured, options.suspected)

    def test_against(nulls: int) -> tuple[Setting, Fits, NullBank, Reference]:
        bank = null_plan.bank_for(nominal, options, nulls=nulls, stage=report)
        reference = bank.reference(
            len(nominal.segments),
            noise=nominal.design.noise,
            seed=options.seed,
            prior=nominal.prior,
        )
        report("base model", 0, 1)
        fitted, fits = _calibrate_statistics(
            nominal, _fits(nominal, measured, projection, bank), bank
        )
        fits = _settling(fitted, fits, options.seed)
        report("base model", 1, 1)
        reference = reference.at(fitted.calibration)
        return fitted, fits, bank, reference if suspected is None else reference.along(*suspected)

    nulls = null_plan.first_round(options)
    setting, fits, bank, reference = test_against(nulls)
    evidence = fits.whitened.evidence(fits.whitened.statistics)
    while (wanted := _nulls_wanted(options, nulls, reference, evidence, report)) is not None:
        setting, fits, bank, reference = test_against(nulls := wanted)
        evidence = fits.whitened.evidence(fits.whitened.statistics)
    set_up = SetUp(tolerance=setting.tolerance, attached=hoist_stands_still(setting.experiment))
    judgement, refits = (
        judge(evidence, reference, level=options.level, set_up=set_up),
        dict[int, Refit | None](),
    )
    if judgement.conclusion not in NOT_REJECTED:
        report("before and after", 0, 1)
        while new := [column for column in finalists(judgement) if column not in refits]:
            refits |= refit(fits, reference, new, workers=options.workers)
            judgement = judge(
                evidence, reference, level=options.level, refits=refits, set_up=set_up
            )
    solved = Solved(setting=setting, fits=fits, reference=reference, judgement=judgement)
    trial = _trial(solved, options)
    if trial.rises:
        solved, trial = replace(solved, judgement=withdrawn(judgement)), Trial()
    report("before and after", 1, 1)
    return _outcome(solved, bank, trial, options, began, late)


def _nulls_wanted(
    options: LoopOptions, nulls: int, reference: Reference, evidence: Evidence, stage: Stage
) -> int | None:
    """Returns how many nulls to go on with after so many; None where those decide, or are given as
    a bank."""
    if options.bank is not None:
        return None
    tested, most = reference.test(evidence), options.most_nulls
    return null_plan.more_nulls(
        nulls, options.nulls, most, tested.null, tested.statistic, level=options.level, stage=stage
    )


def _suspected_effect(measured: Statistics, suspected: Suspicion | None) -> tuple[int, int] | None:
    """Returns column and sign of an effect that is suspected; None where none is.

    Raises:
        InputError: the cloth cannot have it as it is held, or in its wind.
    """
    if suspected is None:
        return None
    column = names().index(suspected.name)
    if not measured.response[:, column, column].any():
        raise InputError(
            f"{suspected.name} moves nothing of this cloth as it is held and in its wind",
            where=WHERE,
            fix="suspect another effect, or leave it out",
        )
    return column, suspected.sign


@dataclass(frozen=True, kw_only=True, eq=False)
class Solved:
    """A judged experiment, with the models fitted to it beyond the linear."""

    setting: Setting
    fits: Fits
    reference: Reference
    judgement: LibraryJudgement

    @cached_property
    def evidence(self) -> Evidence:
        """The evidence against the base model."""
        return self.fits.whitened.evidence(self.fits.whitened.statistics)

    @property
    def base(self) -> Refined:
        """The base model."""
        return self.fits.base

    @property
    def larger(self) -> Refined | None:
        """Returns the model with the effects that act; None where none does, its course is unknown
        (gusts), or its cloth diverges."""
        columns_acting = self.acting
        return (
            None
            if not columns_acting or GUST_COLUMN in columns_acting
            else self.fits.of(columns_acting)
        )

    @property
    def acting(self) -> tuple[int, ...]:
        """Lists columns of the larger model: all effects named as acting, or the first of those
        that may be; none where its cloth diverges."""
        columns_named = self.judgement.named
        return (
            columns_named if self.judgement.conclusion is Conclusion.EFFECT else columns_named[:1]
        )

    def strength(self, ranked: Weighed, larger: Refined) -> Quantity:
        """Estimates the strength of an acting effect beyond the linear: its error exceeds what Σ
        says as where it is linear."""
        index = self.acting.index(ranked.column)
        column, coefficient = larger.model.effects[index]
        linear = self.evidence.fit([ranked.column]).of(ranked.column)[1]
        error = larger.errors[len(THETA) + index] * ranked.error / linear
        return strength(column.described.null, coefficient, error, column.unit)

    @cached_property
    def control(self) -> tuple[Weighed, Refined] | None:
        """The best effect that was not named, and the model with it."""
        taken = (*self.judgement.named, GUST_COLUMN)
        for wrong in self.judgement.ranking:
            if wrong.column not in taken and wrong.admissible:
                fitted = self.fits.of((wrong.column,))
                if fitted is not None:
                    return wrong, fitted
        return None


def _looked_at(setting: Setting) -> tuple[Statistics, Projection]:
    """Errors of the base model along all columns, and the directions."""
    starts = [setting.calibration] * len(setting.segments)
    return projected_statistics(setting.forecaster, setting.segments, starts, columns())


def _fits(setting: Setting, statistics: Statistics, projection: Projection, bank: NullBank) -> Fits:
    """Prepares models of the experiment, which begin at the one that statistics were taken at."""
    whitened = WhitenedMisfit(
        statistics=statistics,
        projection=projection,
        null=bank.model(setting.design).under(setting.prior),
        speeds=setting.speeds[setting.recording],
        origin=setting.calibration,
    )
    return Fits(forecaster=setting.forecaster, segments=setting.segments, whitened=whitened)


def _calibrate_statistics(setting: Setting, fits: Fits, bank: NullBank) -> tuple[Setting, Fits]:
    """Takes statistics at the base model that all directions lead to, anew until a step is within
    its errors, or leaves
    more than there was before it: beyond that, directions follow what numerics do."""
    for _ in range(_LOOKS):
        fit = _base_fit(setting, fits)
        step, errors = np.array([fit.of(index) for index in range(len(THETA))]).T
        if (np.abs(step) < errors).all():
            break
        moved = replace(setting, calibration=setting.calibration.moved(cut(step)))
        moved_fits = _fits(moved, *_looked_at(moved), bank)
        if _base_fit(moved, moved_fits).remainder > fit.remainder:
            break
        setting, fits = moved, moved_fits
    return setting, fits


def _settling(setting: Setting, fits: Fits, seed: int) -> Fits:
    """Adds what the recordings settle at beside the models, run freely in the same winds."""
    recordings = setting.experiment.recordings
    plain = NullBatch(
        specimen=setting.experiment.specimen,
        markers=setting.segments.markers,
        rate=1 / setting.segments.period,
        duration=max(float(r.times[-1]) for r in recordings),
        noise=0.0,
        calibrations=(setting.calibration,) * len(recordings),
        speeds=tuple(float(u) for u in setting.speeds),
        winds=tuple(r.wind for r in recordings),
        seed=child_seed(seed, "settled"),
    )

    def settling(model: Model) -> FloatArray:
        batch = replace(
            plain, calibrations=(model.calibration,) * len(recordings), effects=model.acting
        )
        return settled_off(recordings, batch)[setting.recording]

    with_settled = replace(
        fits.whitened.statistics, settled=settling(Model(calibration=setting.calibration))
    )
    return replace(
        fits, whitened=replace(fits.whitened, statistics=with_settled), settling=settling
    )


def _base_fit(setting: Setting, fits: Fits) -> CoefficientFit:
    """Fits the base model, linear where statistics were taken."""
    evidence = fits.whitened.evidence(fits.whitened.statistics)
    return evidence.fit((), centre=Calibration().steps_from(setting.calibration))


def _trial(solved: Solved, options: LoopOptions) -> Trial:
    """Compares before and after on what was left out, where an effect is named."""
    setting, larger = solved.setting, solved.larger
    if larger is None:
        return Trial()
    control = solved.control
    fitted = [solved.base, larger, *([] if control is None else [control[1]])]
    all_folds = folds(setting.segments, [float(u) for u in setting.speeds])

    def left_out_by(model: Refined) -> list[LeftOut]:
        return solved.fits.left_out(model, [fold.outside for fold in all_folds])

    with ThreadPoolExecutor(max_workers=options.workers) as pool:
        simulated = pool.submit(
            numerical_floor,
            setting,
            np.arange(len(setting.speeds)),
            larger.model,
            copies=_FLOOR_COPIES,
            seed=options.seed,
        )
        tried = list(pool.map(left_out_by, fitted))
        of_recording, floor = simulated.result()
    comparisons: list[Comparison] = []
    differences: list[FloatArray] = []
    places: list[IntArray] = []
    squared = 0.0
    frames = len(setting.segments.items[0].positions) - setting.segments.first
    for number, (fold, (before, after, *wrong)) in enumerate(
        zip(all_folds, zip(*tried, strict=True), strict=True)
    ):
        same_recording = np.isin(of_recording, np.unique(setting.recording[fold.outside]))
        comparisons.append(
            compare(
                fold,
                recording=setting.recording[fold.outside],
                frames=int(fold.outside.sum()) * frames,
                before=before,
                after=after,
                control=wrong[0] if wrong else None,
                floor=floor[same_recording],
                control_name="" if control is None else control[0].candidate.effect,
            )
        )
        if len(all_folds) == 1 or number < len(
            setting.speeds
        ):  # the late parts are in the recordings as well
            squared += after.squared.sum() - before.squared.sum()
            places.append(np.full(len(after.misfit), number))
            differences += [fitted_wrong.misfit - after.misfit for fitted_wrong in wrong]
    return Trial(
        comparisons=tuple(comparisons),
        apart=np.concatenate(differences) if differences else None,
        recording=np.concatenate(places),
        rises=bool(squared > 0),
    )


def _outcome(
    solved: Solved,
    bank: NullBank,
    trial: Trial,
    options: LoopOptions,
    began: float,
    late: tuple[float, ...],
) -> LoopOutcome:
    setting, larger, judgement = solved.setting, solved.larger, solved.judgement
    before = _unseen(setting, solved.base)
    after = None if larger is None else _unseen(setting, larger)
    verdict = Verdict(
        conclusion=judgement.conclusion,
        named=_effects_named(judgement),
        words="",
        test=_test(solved, bank, options),
        parameters=(
            *parameters(
                solved.base,
                larger,
                solved.reference.reach,
                area_weight_uncertainty=float(setting.prior[0]),
            ),
            *_direction(judgement),
        ),
        ranking=_ranking(solved, larger),
        power=_power(judgement),
        open=judgement.open,
        comparisons=trial.comparisons,
        apart=trial.control,
        residuals=residuals(
            setting.experiment, setting.segments, before, after, held_out=len(setting.speeds) > 1
        ),
        provenance={
            "seed": options.seed,
            "code": code_version(),
            "criteria": json_values(replace(CRITERIA, level=options.level)),
            "parents": [r.source for r in setting.experiment.recordings if r.source],
        },
    )
    beyond = judgement.conclusion in (Conclusion.OUTSIDE, Conclusion.PARTLY)
    rejected = judgement.conclusion not in NOT_REJECTED
    field = _field(solved) if beyond else ()
    fitted = solved.base if larger is None else larger
    return LoopOutcome(
        verdict=replace(verdict, seconds=time.perf_counter() - began),
        experiment=setting.experiment,
        lags=late,
        at_bounds=fitted.model.calibration.at_bounds,
        field=field,
        whole=larger is None,
        line=judgement.line if rejected else None,
        course=judgement.course if rejected and GUST_COLUMN not in judgement.named else None,
    )


def _direction(judgement: LibraryJudgement) -> tuple[Parameter, ...]:
    """Reports by how much the wind is turned from its logs, in degrees."""
    angle = judgement.direction
    if angle is None:
        return ()
    value, low, high = (math.degrees(v) for v in (angle.point, angle.low, angle.high))
    in_degrees = Quantity.of(value=value, low=low, high=high, unit="°", level=angle.level)
    return (
        Parameter(
            name="direction of the wind from its log, counter-clockwise",
            before=in_degrees,
            after=None,
            shift=None,
        ),
    )


def _test(solved: Solved, bank: NullBank, options: LoopOptions) -> NullTest:
    """Reports the global test of the base model, and whether other nulls could decide it
    otherwise."""
    tested, level = solved.judgement.test, options.level
    conformal = tested.null
    low, high = conformal.interval(tested.statistic, level=CRITERIA.interval)
    undecided = low <= level <= high and conformal.tests(level)
    kinds_settling = (
        conformal.settling(tested.statistic, at=level, level=CRITERIA.interval)
        if undecided
        else None
    )
    return NullTest(
        statistic=tested.statistic,
        null=[float(v) for v in conformal.null],
        kinds=conformal.count,
        p_value=Quantity.of(value=tested.p, low=low, high=high, unit="1", level=CRITERIA.interval),
        level=level,
        critical=conformal.critical(level),
        nulls=bank.words,
        open=undecided,
        settling=kinds_settling,
        suspected="" if options.suspected is None else options.suspected.words,
        directed=tested.scores.farthest,
        course=tested.course,
        course_share=None if tested.course is None else CRITERIA.course_share,
    )


def _power(judgement: LibraryJudgement) -> tuple[Power, ...]:
    """Reports the power of each effect that was tested for, the surest first."""
    by_name = {column.name: column for column in columns() if isinstance(column, EffectColumn)}
    return tuple(
        Power(
            effect=by_name[sought.name].effect,
            parameter=by_name[sought.name].parameter,
            strength=sought.expected,
            unit=by_name[sought.name].unit,
            share=share,
        )
        for sought, share in sorted(judgement.power, key=lambda entry: -entry[1])
    )


def _field(solved: Solved) -> tuple[Mode, ...]:
    """Fits the corrective field, of what the larger model leaves where there is one."""
    larger = solved.larger
    errors = None if larger is None else solved.fits.errors(larger)
    return corrective_field(
        solved.setting,
        solved.fits.whitened,
        errors=errors,
        along=() if larger is None else larger.chosen,
    )


def _unseen(setting: Setting, refined: Refined) -> Predictions:
    """Predicts all segments by the model fitted to the other recordings; of a single recording by
    its own."""
    if len(setting.speeds) < 2:
        return predict(setting.forecaster, setting.segments, refined.model)
    parts: list[Predictions] = []
    for index in range(len(setting.speeds)):
        outside = setting.recording == index
        parts.append(
            predict(
                setting.forecaster,
                setting.segments.select(np.flatnonzero(outside)),
                refined.without(outside),
            )
        )
    # Segments are in the order of their recordings.
    return Predictions(
        errors=np.concatenate([p.errors for p in parts], axis=-1),
        predicted=np.concatenate([p.predicted for p in parts], axis=-1),
    )


def _ranking(solved: Solved, larger: Refined | None) -> tuple[Candidate, ...]:
    """Lists the candidates; those of the larger model with their strengths beyond the linear."""
    candidates: list[Candidate] = []
    for ranked in solved.judgement.ranking:
        candidate = ranked.candidate
        alone = candidate.strength.bound is None and ranked.measured is None
        if larger is not None and ranked.column in solved.acting and alone:
            candidate = replace(candidate, strength=solved.strength(ranked, larger))
        candidates.append(candidate)
    return tuple(candidates)


def _effects_named(judgement: LibraryJudgement) -> tuple[str, ...]:
    names: list[str] = []
    for ranked in judgement.ranking:
        if ranked.column in judgement.named:
            candidate = ranked.candidate
            names += [candidate.effect, *equivalent(candidate.effect, candidate.strength)]
    return tuple(dict.fromkeys(names))
