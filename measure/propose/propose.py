"""Effects from data: terms sought in a part of recordings, fitted there, and tested on the rest.

Many terms are screened by what they predict of recordings left out, which costs no nulls; a shortlist meets recordings
of the base model itself, whose numerics could look like a term; what is taken is run again on data that nothing has
seen, beside terms of another direction and beside what numerics leave.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from flagdata.errors import InputError, UsageError
from measure.loop.attribution import estimate
from measure.loop.close import Setting, Stage
from measure.loop.columns import THETA, EffectColumn
from measure.loop.inference import Evidence
from measure.loop.reference import GUSTS, NullBank, Reference
from measure.loop.refine import Refined, refine
from measure.observe.trajectory import Experiment
from measure.propose import nulls
from measure.propose.candidates import weighed
from measure.propose.course import course
from measure.propose.outcome import Decision, Outcome, Strength
from measure.propose.retest import retest
from measure.propose.screen import SHORT, Screened, screen
from measure.propose.search import Step, search, wrong
from measure.propose.sensitivities import statistics
from measure.propose.split import data_hash, split
from measure.propose.terms import MASS, TermColumn
from sim.effects.field import Flat

_CALM = 0.3
"""Wind below which its direction is not known well enough for terms along it [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """How to search.

    Attributes:
        seed: of the nulls.
        level: of each step's test against nulls.
        nulls: null recordings simulated, at least.
        workers: processes for them.

    Raises:
        UsageError: values that make no sense.
    """

    seed: int = 0
    level: float = 0.03
    nulls: int = 192
    workers: int = 1

    def __post_init__(self) -> None:
        if not 0 < self.level < 1:
            raise UsageError(f"a level of {self.level!r}", where="propose", fix="give one between 0 and 1")
        if self.nulls < 64 or self.workers < 1:
            raise UsageError(
                f"{self.nulls} nulls by {self.workers} workers", where="propose", fix="give 64 or more, and 1 or more"
            )


def propose(
    experiment: Experiment,
    candidates: Sequence[EffectColumn],
    *,
    known: Sequence[EffectColumn] = (),
    controls: Sequence[EffectColumn] = (),
    options: Options,
    stage: Stage | None = None,
) -> Outcome:
    """Seek terms that a model lacks, and keep them if they help on recordings that were not looked at.

    Args:
        candidates: terms, or strengths of an effect from a file.
        known: strengths that the model has already.
        controls: terms that are not taken, but may be what a proposal is compared with.
        stage: told of progress.

    Raises:
        InputError: recordings that cannot be used, are too few, or are of calm air.
    """
    torch.set_num_threads(1)
    tell = stage or (lambda what, done, total: None)
    setting = made_ready(experiment)
    screened = Screened(columns=tuple(candidates), gains={})
    if len(candidates) > SHORT:
        tell("screening", 0, 1)
        seen = setting.segments.select(np.flatnonzero(split(setting.segments, setting.speeds).seen))
        screened = screen(setting.forecaster, seen, candidates, known)
        tell("screening", 1, 1)
    columns = considered([*screened.columns, *controls], known)
    planned = nulls.batches(setting, nulls=options.nulls, seed=options.seed)
    bank = nulls.bank(planned, columns, workers=options.workers, stage=tell)
    found = weigh(setting, columns, bank, known=known, controls=controls, options=options, stage=tell)
    return replace(found, tried=max(found.tried, len(screened.gains)), screened=screened.gains)


def made_ready(experiment: Experiment) -> Setting:
    """The recordings in one frame and cut.

    Raises:
        InputError: as `propose`.
    """
    setting = Setting.of(experiment)
    slowest = int(np.argmin(setting.speeds))
    if setting.speeds[slowest] < _CALM:
        raise InputError(
            f"its wind is {setting.speeds[slowest]:.2g} m/s: it has no direction",
            where=f"recording {experiment.recordings[slowest].name!r}", fix="leave the calm recording out",
        )  # fmt: skip
    return setting


def considered(candidates: Sequence[EffectColumn], known: Sequence[EffectColumn]) -> tuple[EffectColumn, ...]:
    """All columns of the evidence: the wind's scale (for gusts), effects that are known, candidates."""
    first = {column.name: column for column in (weighed(GUSTS), *known)}
    return (*first.values(), *(column for column in candidates if column.name not in first))


def weigh(
    setting: Setting,
    columns: Sequence[EffectColumn],
    bank: NullBank,
    *,
    known: Sequence[EffectColumn] = (),
    controls: Sequence[EffectColumn] = (),
    options: Options,
    stage: Stage,
) -> Outcome:
    """The outcome for recordings, given nulls along the same columns (see `considered`).

    Raises:
        InputError: nulls of other columns or of segments of another length; too few segments.
    """
    if bank.columns != nulls.names(columns) or abs(bank.duration - setting.segments.duration) > 0.1 * bank.duration:
        raise InputError(
            f"nulls along {len(bank.columns)} columns by {bank.duration:.2g} s, "
            f"data along {len(columns) + len(THETA)} by {setting.segments.duration:.2g} s",
            where="null bank", fix="simulate nulls for these columns and recordings",
        )  # fmt: skip
    names = nulls.names(columns)
    beside = [names.index(column.name) for column in known]
    fixed = {GUSTS, *(column.name for column in known)}
    others = [place for place in range(len(THETA), len(names)) if names[place] not in fixed]
    only = {column.name for column in controls}
    pool = [place for place in others if names[place] not in only]
    parts = split(setting.segments, setting.speeds)
    seen = setting.segments.select(np.flatnonzero(parts.seen))
    stage("terms", 0, 1)
    found = statistics(setting.forecaster, seen, columns)
    null = bank.model()
    speeds = setting.speeds[np.array([s.recording for s in seen.items])]
    evidence = Evidence.of(found, speeds, null)
    reference = bank.reference(
        len(seen), noise=max(s.noise for s in setting.segments.items), seed=options.seed
    )
    steps = search(evidence, reference, names, pool, beside=beside, level=options.level)
    stage("terms", 1, 1)
    taken = [step for step in steps if step.taken]
    chosen = [*beside, *(step.column for step in taken)]
    untouched = setting.segments.select(np.flatnonzero(~parts.seen))

    def fitted(active: Sequence[int]) -> Refined:
        return refine(setting.forecaster, seen, evidence, null, speeds, active, weighed=columns)

    strengths: tuple[Strength, ...] = ()
    tested = None
    decision, reason = Decision.REJECTED, steps[0].reason if steps else "no term was given"
    if taken:
        stage("test on untouched data", 0, 1)
        before, after = fitted(beside), fitted(chosen)
        instead = wrong(evidence, others, [step.column for step in taken], beside)
        tested = retest(
            setting, untouched, before.model, after.model, words=parts.words, seed=options.seed,
            control=fitted([*beside, *instead]).model if instead else None, control_names=[names[c] for c in instead],
        )  # fmt: skip
        strengths = _strengths(setting, evidence, reference, names, taken, beside, after)
        decision, reason = tested.decided
        stage("test on untouched data", 1, 1)
    return Outcome(
        decision=decision, reason=reason, steps=steps, tried=len(pool), screened={}, strengths=strengths,
        retest=tested, level=options.level, nulls=bank.words, proposed_from=data_hash(seen),
        tested_on=data_hash(untouched), known=tuple(column.name for column in known), seed=options.seed,
    )  # fmt: skip


def _strengths(
    setting: Setting,
    evidence: Evidence,
    reference: Reference,
    names: tuple[str, ...],
    taken: Sequence[Step],
    beside: Sequence[int],
    after: Refined,
) -> tuple[Strength, ...]:
    """Fitted beyond the linear; errors are scaled by what makes the nulls' mean squared z 1."""
    chosen = [*beside, *(step.column for step in taken)]
    fit = evidence.fit(chosen)
    made: list[Strength] = []
    for place, step in enumerate(taken, start=len(beside)):
        column, value = after.model.effects[place]
        linear, claimed = fit.of(step.column)
        others = [c for c in chosen if c != step.column]
        statistic = float(reference.statistics(evidence, names, others)[step.column])
        scale = max(1.0, abs(linear) / math.sqrt(max(statistic, 1e-12)) / claimed)
        error = scale * after.errors[len(THETA) + place]
        shown = estimate(column.described.null + value, error, column.unit)
        words = _words(setting, column, value, after.model.calibration.density)
        made.append(
            Strength(name=column.parameter, words=words, estimate=shown, course=course(setting, after.model, place))
        )
    return tuple(made)


def _words(setting: Setting, column: EffectColumn, value: float, density: float) -> str:
    """What a strength is; of mass, how much."""
    if not isinstance(column, TermColumn):
        return column.name
    if column.term.field != MASS:
        return column.term.words
    specimen = setting.experiment.specimen
    cloth = setting.forecaster.system(setting.segments.select([0]), [setting.nominal])[0].cloth
    share = column.term.at.of(Flat(cloth=cloth))[:, 0, 0].double().numpy()
    added = value * density * specimen.material.density * float(specimen.mesh.vertex_areas @ share)
    return f"{column.term.words}: {1e3 * added:+.3g} g in all"
