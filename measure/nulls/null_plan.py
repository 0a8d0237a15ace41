"""Null recordings for an experiment: a bank that is given, or one simulated for it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.files.caches import user_cache
from flagdata.core.rng import child_seed
from flagdata.errors import InputError, UsageError
from measure.forecasting.setting import Setting, Stage
from measure.nulls import bank as banks
from measure.nulls import tracks, winds
from measure.nulls.conformal import GroupedConformal, kinds_needed
from measure.nulls.null_simulation import NullBatch
from measure.nulls.reference import NullBank
from measure.verdict.criteria import CRITERIA

_CARRIED = ", carried along the recordings' own ways from other instants on"
_FIRST_LOOK = 8
"""Kinds by which a verdict reports a first p; they decide nothing."""
FEWEST_NULLS = CRITERIA.simulated_kinds * banks.WINDS
"""So many at least are simulated: each kind of numerics is a batch, and p-values count the
kinds."""


@dataclass(frozen=True, kw_only=True)
class NullOptions:
    """By which nulls is tested, and at which level.

    Attributes:
        seed: of the nulls.
        level: of the test.
        nulls: null recordings simulated where no bank is given, in whole batches; at least
            `FEWEST_NULLS`. A verdict simulates half as many, or fewer, where these show that the
            base model is not rejected (see `first_round`).
        bank: a folder of nulls of this design: its cloth, markers, noise and rate; None simulates
            them.
        workers: processes for the nulls, then threads for what is fitted.
        scheduler: address of a Dask scheduler whose workers simulate the nulls; None for processes
            of this machine.

    Raises:
        UsageError: a level or counts that make no sense.
    """

    seed: int = 0
    level: float = CRITERIA.level
    nulls: int = FEWEST_NULLS
    bank: Path | None = None
    workers: int = 1
    scheduler: str | None = None

    def __post_init__(self) -> None:
        if not 0 < self.level < 1:
            raise UsageError(
                f"the level is {self.level!r}", where="nulls", fix="give one between 0 and 1"
            )
        if self.nulls < FEWEST_NULLS or self.workers < 1:
            raise UsageError(
                f"{self.nulls} nulls cannot be made by {self.workers} workers",
                where="nulls",
                fix=f"give {FEWEST_NULLS} or more, and 1 or more",
            )


def bank_for(
    setting: Setting, options: NullOptions, *, nulls: int | None = None, stage: Stage
) -> NullBank:
    """Returns the bank of a folder where one is named; else nulls that are simulated for an
    experiment.

    Args:
        nulls: how many are simulated; None for as many as the options have.

    Raises:
        FlagdataError: as `load_bank`.
    """
    if options.bank is not None:
        return load_bank(options.bank, setting)
    return simulate_bank(
        setting,
        nulls=options.nulls if nulls is None else nulls,
        seed=options.seed,
        workers=options.workers,
        scheduler=options.scheduler,
        stage=stage,
    )


def first_round(options: NullOptions) -> int:
    """Nulls with which a verdict begins, for a first answer that decides nothing."""
    return min(_FIRST_LOOK * banks.WINDS, options.nulls)


def more_nulls(
    nulls: int,
    wanted: int,
    most: int,
    conformal: GroupedConformal,
    statistic: float,
    *,
    level: float,
    stage: Stage,
) -> int | None:
    """Reports p by so many nulls; returns how many are needed where these leave open what the test
    decides, None where they decide it.

    The first that can end the test are `Criteria.first_kinds` kinds, or as many as the level needs;
    then twice as many each time.

    Below `wanted` that is where the interval of p is not wholly above the level: the base model is
    only ever rejected by that many or more, and p of so many is valid whether fewer would have
    ended the test or not. Beyond, up to `most`, it is where p is within `Criteria.near` of the
    level and its interval includes the level.
    """
    p, (low, high) = conformal.p(statistic), conformal.interval(statistic, level=CRITERIA.interval)
    stage(f"p = {p:.2g} by {nulls // banks.WINDS} of {wanted // banks.WINDS} kinds", 1, 1)
    first = min(max(CRITERIA.first_kinds, kinds_needed(level)) * banks.WINDS, wanted)
    if nulls < first:
        return first
    if nulls < wanted:
        return min(2 * nulls, wanted) if low <= level else None
    borderline = level / CRITERIA.near <= p <= CRITERIA.near * level and low <= level <= high
    return min(2 * nulls, most) if borderline and nulls < most else None


def load_bank(folder: Path, setting: Setting) -> NullBank:
    """Loads the bank of a folder, made as `measure.nulls.bank` does.

    Raises:
        InputError: it is of another design; see `check`.
        FlagdataError: as `measure.nulls.bank.load`.
    """
    bank = banks.load(folder, words=f"of this design, from {folder.name}")
    check(bank, setting, where=str(folder))
    kinds, needed = len(np.unique(bank.nulls.numerics)), kinds_needed(1 - CRITERIA.interval)
    if kinds < needed:
        raise InputError(
            f"the nulls are of {kinds} kinds of numerics, which leave intervals without an end",
            where=str(folder),
            fix=f"build a bank of {needed} or more, or leave it out",
        )
    return replace(bank, words=bank.words + _CARRIED) if bank.carried else bank


def check(bank: NullBank, setting: Setting, *, where: str = "null bank") -> None:
    """Refuses nulls of another design than the recordings'. How nulls scatter differs between
    cloths, noises and rates, so that those of others hide most effects.

    Raises:
        InputError: segments of another length or frame interval, anchors known in another way,
            cloths held in another way, another nominal cloth, another number of markers, or
            markers of another noise.
    """
    nulls, design = bank.nulls, setting.design
    known = ("taken from where recordings show the attachments", "that are given")
    held = ("held still", "carried")
    anchors, carried = setting.experiment.specimen.anchors_given, setting.experiment.carried
    counts = nulls.statistics.marker_error.shape[1], len(setting.segments.markers)
    lengths = bank.duration, setting.segments.duration
    compared = (
        (bank.anchors_given == anchors, "anchors {}", known[bank.anchors_given], known[anchors]),
        (bank.carried == carried, "cloths that are {}", held[bank.carried], held[carried]),
        (_alike(*lengths), "segments of {} s", *(f"{length:.2g}" for length in lengths)),
        (counts[0] == counts[1], "{} markers", *counts),
        (
            bool((nulls.cloth == design.cloth).all()),
            "the nominal cloth {}",
            ", ".join(str(cloth)[:8] for cloth in np.unique(nulls.cloth)),
            design.cloth[:8],
        ),
        _compared("frames {} ms apart", nulls.period, design.period),
        _compared("markers with a noise of {} mm", nulls.noise, design.noise),
    )
    for same, what, of_bank, of_recordings in compared:
        if not same:
            raise InputError(
                f"the bank has {what.format(of_bank)}, the recordings have "
                f"{what.format(of_recordings)}",
                where=where,
                fix="simulate nulls for these recordings: leave the bank out",
            )


def _compared(what: str, of_nulls: FloatArray, own: float) -> tuple[bool, str, str, str]:
    """Compares intervals [s] or noises [m] of nulls with that of the recordings, in thousandths."""
    values = np.unique(of_nulls)
    return (
        all(_alike(value, own) for value in values),
        what,
        ", ".join(f"{1e3 * value:.3g}" for value in values),
        f"{1e3 * own:.3g}",
    )


def _alike(own: float, other: float) -> bool:
    """Whether two lengths, intervals or noises belong to one design: they differ by a tenth at
    most."""
    return abs(own - other) <= 0.1 * max(own, other)


def batches(setting: Setting, *others: Setting, kinds: int, seed: int) -> list[NullBatch]:
    """Draws nulls over the priors of the cloth, of the winds of an experiment and carried as it is:
    a batch for each kind of numerics. Those of one cloth hold as many segments as the data, and are
    as noisy as the noisiest of its recordings.

    Args:
        others: experiments of the same design, whose winds are gone through too.
    """
    segments, experiments = setting.segments, (setting, *others)
    recordings = [own for one in experiments for own in one.experiment.recordings]
    speeds = np.concatenate([one.speeds for one in experiments])
    drawn = [
        banks.prior_batch(
            setting.experiment.specimen,
            markers=segments.markers,
            rate=1 / segments.period,
            noise=setting.design.noise,
            duration=segments.cut.lasting(
                banks.segments_of_each(max(len(one.segments) for one in experiments))
            ),
            speeds=banks.around(float(speeds.min()), float(speeds.max())),
            seed=child_seed(seed, "null", index),
        )
        for index in range(kinds)
    ]
    return [
        replace(
            batch,
            winds=winds.like(recordings, batch.speeds, duration=batch.duration, seed=batch.seed),
            tracks=tracks.like(
                recordings,
                setting.experiment.specimen.seats,
                len(batch.speeds),
                duration=batch.duration,
                seed=batch.seed,
            ),
        )
        for batch in drawn
    ]


def simulate_bank(
    setting: Setting,
    *,
    nulls: int,
    seed: int,
    workers: int,
    stage: Stage,
    scheduler: str | None = None,
) -> NullBank:
    """Simulates a bank of `batches`, kept in the user's cache folder, each by the hash of all that
    shapes it: what is there already is not simulated anew, and a build that was stopped goes on."""
    wanted = batches(setting, kinds=math.ceil(nulls / banks.WINDS), seed=seed)
    total, done = sum(batch.effort for batch in wanted), 0

    def count(finished: int) -> None:
        nonlocal done
        done += finished
        stage(f"nulls of {len(wanted)} kinds", done, total)

    folder = user_cache() / "nulls"
    banks.build(folder, wanted, workers=workers, scheduler=scheduler, progress=count)
    words = (
        f"{banks.WINDS * len(wanted)} recordings of {len(wanted)} meshes and methods, over the "
        "priors of the cloth"
    )
    words += _CARRIED if setting.experiment.carried else ""
    return banks.load(folder, words=words, batches=wanted)
