"""Closing the loop on trajectories: from recordings to a verdict about what the base model lacks.

The steps are those of the method: align, predict one horizon ahead, compare with nulls of other numerics, weigh the
library's effects, judge, and run the chosen model again on what it was not fitted to.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.errors import UsageError
from flagdata.provenance import code_version
from flagdata.rng import child_seed
from measure.loop import bank as banks
from measure.loop.alignment import aligned
from measure.loop.attribution import EQUIVALENT, Judgement, estimate, judge
from measure.loop.columns import THETA, Calibration, FieldColumn
from measure.loop.comparison import Fold, Predictions, compare, fitted_effects, folds, predict
from measure.loop.forecast import Forecaster, Segments
from measure.loop.inference import Evidence
from measure.loop.nulls import NullBatch
from measure.loop.reference import NullBank, Reference
from measure.loop.residuals import residuals
from measure.loop.statistics import statistics
from measure.loop.verdict import Comparison, Conclusion, NullTest, Parameter, Verdict
from measure.loop.words import assumptions, proposal, sentence, separating
from measure.observe.trajectory import Experiment, Trajectory
from sim.effects import apply
from sim.integrate.split import SplitEuler

Floats = NDArray[np.float64]
Stage = Callable[[str, int, int], object]
"""Called with what is under way, how much is done, and of how much."""

_FLOOR_DURATION = 4.5  # s: two segments of each recording
_FLOOR_COPIES = 4
_KINDS = 12


@dataclass(frozen=True, kw_only=True)
class Options:
    """How to close the loop.

    Attributes:
        seed: of the nulls.
        level: of the global test.
        nulls: null recordings simulated where no bank is given.
        bank: a folder of nulls over priors that hold for this design; None simulates nulls about the estimates.
        workers: processes for the nulls.

    Raises:
        UsageError: a level or counts that make no sense.
    """

    seed: int = 0
    level: float = 0.02
    nulls: int = 192
    bank: Path | None = None
    workers: int = 1

    def __post_init__(self) -> None:
        if not 0 < self.level < 1:
            raise UsageError(f"a level of {self.level!r}", where="close-loop", fix="give one between 0 and 1")
        if self.nulls < 64 or self.workers < 1:
            raise UsageError(
                f"{self.nulls} nulls by {self.workers} workers",
                where="close-loop",
                fix="give 64 or more, and 1 or more",
            )


@dataclass(frozen=True, kw_only=True, eq=False)
class Setting:
    """An experiment made ready: in one frame, cut into segments, with the model that predicts them."""

    experiment: Experiment
    segments: Segments
    forecaster: Forecaster
    nominal: Calibration

    @classmethod
    def of(cls, experiment: Experiment) -> Setting:
        """Raises InputError: recordings that cannot be used together, or are too short."""
        turned = aligned(experiment)
        segments = Segments.of(turned.recordings)
        forecaster = Forecaster(specimen=turned.specimen, markers=segments.markers, integrator=SplitEuler())
        return cls(experiment=turned, segments=segments, forecaster=forecaster, nominal=Calibration())

    @property
    def speeds(self) -> Floats:
        """(recording,) mean logged wind [m/s]."""
        return np.array([r.wind.speed for r in self.experiment.recordings])

    @property
    def recording(self) -> NDArray[np.int64]:
        """(segment,) index of each one's recording."""
        return np.array([s.recording for s in self.segments.items])


def close_loop(experiment: Experiment, options: Options, *, stage: Stage | None = None) -> Verdict:
    """The verdict on an experiment.

    Args:
        stage: told of progress.

    Raises:
        InputError: recordings that cannot be used: see `measure.observe.checks` for what is looked at before.
    """
    began = time.perf_counter()
    torch.set_num_threads(1)
    tell = stage or (lambda what, done, total: None)
    setting = Setting.of(experiment)
    tell("sensitivities", 0, 1)
    found = statistics(setting.forecaster, setting.segments, [setting.nominal] * len(setting.segments), banks.columns())
    bank = _bank(setting, options, tell)
    null = bank.model()
    evidence = Evidence.of(found, setting.speeds[setting.recording], null)
    counts = [int((setting.recording == index).sum()) for index in range(len(setting.experiment.recordings))]
    reference = bank.reference(counts, seed=options.seed)
    judgement = judge(evidence, reference, level=options.level)
    comparisons = _comparisons(setting, evidence, judgement, options, tell)
    return _verdict(setting, bank, evidence, reference, judgement, comparisons, options, began)


def _bank(setting: Setting, options: Options, tell: Stage) -> NullBank:
    if options.bank is not None:
        return banks.load(options.bank, words=f"over priors, from {options.bank.name}")
    first: Trajectory = setting.experiment.recordings[0]
    batches = [
        banks.prior_batch(
            setting.experiment.specimen, markers=first.markers, rate=first.rate,
            duration=max(len(r.positions) / r.rate for r in setting.experiment.recordings), noise=first.noise,
            speeds=(0.9 * float(setting.speeds.min()), 1.1 * float(setting.speeds.max())),
            seed=child_seed(options.seed, "null", index),
        )
        for index in range(max(_KINDS, round(options.nulls / 16)))
    ]  # fmt: skip
    done = 0

    def count(more: int) -> None:
        nonlocal done
        done += more
        tell("nulls", done, len(batches))

    with TemporaryDirectory(prefix="flagdata-nulls-") as folder:
        banks.build(Path(folder), batches, workers=options.workers, progress=count)
        words = f"{16 * len(batches)} recordings of {len(batches)} meshes and methods, over the priors of the cloth"
        return banks.load(Path(folder), words=words)


def _comparisons(
    setting: Setting, evidence: Evidence, judgement: Judgement, options: Options, tell: Stage
) -> tuple[Comparison, ...]:
    """Before and after on what was left out, where an effect is named."""
    if not judgement.named or judgement.conclusion is Conclusion.OUTSIDE:
        return ()
    floor = _floor(setting, evidence, judgement.named[:1], options)
    control = next((w for w in judgement.ranking if w.column not in judgement.named and w.admissible), None)
    made: list[Comparison] = []
    left_out = folds(setting.segments, [float(u) for u in setting.speeds])
    for index, fold in enumerate(left_out):
        tell("before and after", index, len(left_out))
        before = _left_out(setting, evidence, (), fold).squared
        after = _left_out(setting, evidence, judgement.named[:1], fold).squared
        wrong = None if control is None else _left_out(setting, evidence, (control.column,), fold).squared
        frames = int(fold.outside.sum()) * (len(setting.segments.items[0].positions) - setting.segments.first)
        own = np.isin(floor[0], np.unique(setting.recording[fold.outside]))
        made.append(
            compare(
                fold, frames=frames, before=before, after=after, control=wrong, floor=floor[1][own],
                control_name="" if control is None else control.candidate.effect,
            )
        )  # fmt: skip
    return tuple(made)


def _left_out(setting: Setting, evidence: Evidence, chosen: Sequence[int], fold: Fold) -> Predictions:
    return predict(setting.forecaster, setting.segments, evidence, setting.nominal, chosen, fold.outside)


def _floor(
    setting: Setting, evidence: Evidence, chosen: Sequence[int], options: Options
) -> tuple[NDArray[np.int64], Floats]:
    """Recording and mean squared error of segments simulated from the fitted model and predicted by it: what its
    numerics alone leave."""
    fit = evidence.fit(chosen)
    effects = fitted_effects(fit, chosen)
    calibration = setting.nominal.moved([float(v) for v in fit.value[: len(THETA)]])
    count = len(setting.experiment.recordings)
    first = setting.experiment.recordings[0]
    batch = NullBatch(
        specimen=setting.experiment.specimen, markers=first.markers, rate=first.rate, duration=_FLOOR_DURATION,
        noise=first.noise, calibrations=(calibration,) * (count * _FLOOR_COPIES),
        speeds=tuple(float(u) for u in np.tile(setting.speeds, _FLOOR_COPIES)),
        seed=child_seed(options.seed, "floor"), effects=effects,
    )  # fmt: skip
    segments = Segments.of(batch.simulate())
    system, state = apply(effects, *setting.forecaster.system(segments, [calibration] * len(segments)))
    squared = (setting.forecaster.errors(system, state, segments) ** 2).sum(2).mean((0, 1)).double().numpy()
    return np.array([s.recording % count for s in segments.items]), squared


def _verdict(
    setting: Setting,
    bank: NullBank,
    evidence: Evidence,
    reference: Reference,
    judgement: Judgement,
    comparisons: tuple[Comparison, ...],
    options: Options,
    began: float,
) -> Verdict:
    named = judgement.named
    before = predict(setting.forecaster, setting.segments, evidence, setting.nominal, (), None)
    after = predict(setting.forecaster, setting.segments, evidence, setting.nominal, named[:1], None) if named else None
    verdict = Verdict(
        conclusion=judgement.conclusion, named=_named(judgement), words="",
        test=NullTest(
            statistic=judgement.statistic, null=[float(v) for v in reference.largest], p_value=judgement.p_value,
            level=options.level, nulls=bank.words,
        ),
        parameters=_parameters(evidence, named[:1], setting.nominal),
        ranking=tuple(w.candidate for w in judgement.ranking), comparisons=comparisons,
        residuals=residuals(setting.experiment, setting.segments, before, after),
        assumptions=assumptions(setting.experiment),
        provenance={
            "seed": options.seed, "code": code_version(),
            "parents": [r.source for r in setting.experiment.recordings if r.source],
        },
    )  # fmt: skip
    smooth = [i + len(THETA) for i, c in enumerate(banks.columns()) if isinstance(c, FieldColumn)]
    return replace(
        verdict, words=sentence(verdict), separating=separating(verdict),
        proposal=proposal(verdict, evidence.fit(smooth), smooth), seconds=time.perf_counter() - began,
    )  # fmt: skip


def _named(judgement: Judgement) -> tuple[str, ...]:
    names: list[str] = []
    for weighed in judgement.ranking:
        if weighed.column in judgement.named:
            names += [weighed.candidate.effect, *EQUIVALENT.get(weighed.candidate.effect, ())]
    return tuple(dict.fromkeys(names))


def _parameters(evidence: Evidence, named: Sequence[int], nominal: Calibration) -> tuple[Parameter, ...]:
    before, after = evidence.fit(()), evidence.fit(named)
    made: list[Parameter] = []
    for place, (name, unit, _) in enumerate(THETA):
        value, error = before.of(place)
        moved, _ = after.of(place)
        shown = f"{unit} from nominal"
        made.append(
            Parameter(
                name=name, before=estimate(value, error, shown),
                after=estimate(moved, after.of(place)[1], shown) if named else None,
                shift=(moved - value) / error if named else None,
            )
        )  # fmt: skip
    return tuple(made)
