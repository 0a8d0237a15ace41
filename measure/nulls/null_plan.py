"""Null recordings for an experiment: a bank that is given, or one simulated for it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

from flagdata.core.files.caches import user_cache
from flagdata.core.provenance import array_hash, recipe_hash
from flagdata.core.rng import child_seed
from flagdata.errors import InputError, UsageError
from measure.forecasting.setting import Setting, Stage
from measure.nulls import bank as banks
from measure.nulls import tracks, winds
from measure.nulls.conformal import GroupedConformal, kinds_needed
from measure.nulls.null_simulation import NullBatch
from measure.nulls.reference import NullBank
from measure.trajectories.trajectory import describe_cloth
from measure.verdict.criteria import CRITERIA

_CARRIED = ", carried along the recordings' own ways from other instants on"
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
        bank: a folder of nulls over priors that hold for this design; None simulates nulls of this
            cloth, its markers and winds, over the same priors.
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
    """Nulls with which a verdict begins: they can test the level."""
    return min(max(CRITERIA.first_kinds, kinds_needed(options.level)) * banks.WINDS, options.nulls)


def more_nulls(
    nulls: int,
    wanted: int,
    most: int,
    conformal: GroupedConformal,
    statistic: float,
    *,
    level: float,
) -> int | None:
    """Returns twice as many nulls where so many leave open what the test decides; None where they
    decide it.

    Below `wanted` that is where the interval of p is not wholly above the level: the base model is
    only ever rejected by that many or more, and p of so many is valid whether fewer would have
    ended the test or not. Beyond, up to `most`, it is where p is within `Criteria.near` of the
    level and its interval includes the level.
    """
    p, (low, high) = conformal.p(statistic), conformal.interval(statistic, level=CRITERIA.interval)
    if nulls < wanted:
        return min(2 * nulls, wanted) if low <= level else None
    borderline = level / CRITERIA.near <= p <= CRITERIA.near * level and low <= level <= high
    return min(2 * nulls, most) if borderline and nulls < most else None


def load_bank(folder: Path, setting: Setting) -> NullBank:
    """Loads the bank of a folder, made as `measure.nulls.bank` does.

    Raises:
        InputError: its segments or anchors are not like the recordings'.
        FlagdataError: as `measure.nulls.bank.load`.
    """
    bank = banks.load(folder, words=f"over priors, from {folder.name}")
    check(bank, setting, where=str(folder))
    return replace(bank, words=bank.words + _CARRIED) if bank.carried else bank


def check(bank: NullBank, setting: Setting, *, where: str = "null bank") -> None:
    """Refuses nulls that do not fit the recordings.

    Raises:
        InputError: segments of another length or frame interval, anchors known in another way, or
            cloths held in another way.
    """
    if bank.anchors_given != setting.experiment.specimen.anchors_given:
        ways = ("taken from where the recordings show the attachments", "given")
        raise InputError(
            f"the bank's anchors were {ways[bank.anchors_given]}, those of the recordings are "
            f"{ways[not bank.anchors_given]}",
            where=where,
            fix="simulate nulls for these recordings: leave the bank out",
        )
    if bank.carried != setting.experiment.carried:
        ways = ("held still", "carried")
        raise InputError(
            f"the bank's cloths were {ways[bank.carried]}, that of the recordings is "
            f"{ways[not bank.carried]}",
            where=where,
            fix="simulate nulls for these recordings: leave the bank out",
        )
    if abs(bank.duration - setting.segments.duration) > 0.1 * bank.duration:
        raise InputError(
            f"its segments last {bank.duration:.2g} s, those of the recordings "
            f"{setting.segments.duration:.2g} s",
            where=where,
            fix="simulate nulls for these recordings: leave the bank out; or record for longer",
        )
    shortest, longest, period = (
        bank.nulls.period.min(),
        bank.nulls.period.max(),
        setting.segments.period,
    )
    if not 0.9 * shortest < period < 1.1 * longest:
        raise InputError(
            f"its frames are {1e3 * shortest:.3g} to {1e3 * longest:.3g} ms apart, those of the "
            "recordings "
            f"{1e3 * period:.3g} ms",
            where=where,
            fix="simulate nulls for these recordings: leave the bank out",
        )


def batches(setting: Setting, *, kinds: int, seed: int) -> list[NullBatch]:
    """Draws nulls over the priors of the cloth, of the winds of an experiment and carried as it is:
    a batch for each kind of numerics. Those of one cloth hold as many segments as the data, and are
    as noisy as the noisiest of its recordings.
    """
    segments, recordings = setting.segments, setting.experiment.recordings
    drawn = [
        banks.prior_batch(
            setting.experiment.specimen,
            markers=segments.markers,
            rate=1 / segments.period,
            noise=setting.design.noise,
            duration=segments.cut.lasting(banks.segments_of_each(len(segments))),
            speeds=banks.around(float(setting.speeds.min()), float(setting.speeds.max())),
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
    """Simulates a bank of `batches`, kept in the user's cache folder by the hash of its design:
    what is there already is not simulated anew, and a build that was stopped goes on."""
    wanted = batches(setting, kinds=math.ceil(nulls / banks.WINDS), seed=seed)
    done = 0

    def count(finished: int) -> None:
        nonlocal done
        done += finished
        stage(f"nulls of {len(wanted)} kinds", done, len(wanted))

    folder = kept_in(setting, seed=seed)
    banks.build(folder, wanted, workers=workers, scheduler=scheduler, progress=count)
    total = banks.WINDS * len(wanted)
    words = f"{total} recordings of {len(wanted)} meshes and methods, over the priors of the cloth"
    words += _CARRIED if setting.experiment.carried else ""
    return banks.load(folder, words=words, kinds=len(wanted))


def kept_in(setting: Setting, *, seed: int) -> Path:
    """Returns the folder of the nulls of an experiment's design, by a seed and by this version of
    the code."""
    identity = {"design": design_hash(setting), "seed": seed, **banks.version_of_content()}
    return user_cache() / "nulls" / recipe_hash(identity)[:32]


def design_hash(setting: Setting) -> str:
    """Hashes all of an experiment that shapes its nulls, SHA-256: cloth, markers, rate, noise,
    lengths, winds and ways."""
    segments, recordings = setting.segments, setting.experiment.recordings
    content, arrays = describe_cloth(setting.experiment.specimen)
    del content["density-uncertainty"]  # nulls are judged under it, not made by it
    content |= {
        "period": segments.period,
        "noise": setting.design.noise,
        "segments": len(segments),
        "lengths": [float(r.times[-1]) for r in recordings],
    }
    blown = [part for r in recordings for part in (r.wind.times, r.wind.velocity)]
    ways = [r.attachments for r in recordings if r.attachments is not None]
    return array_hash(content, [*arrays, segments.markers, *blown, *ways])
