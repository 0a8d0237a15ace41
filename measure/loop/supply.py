"""Null recordings for an experiment: a bank that is given, or one simulated for it."""

from __future__ import annotations

import math
from pathlib import Path
from tempfile import TemporaryDirectory

from flagdata.errors import InputError
from flagdata.rng import child_seed
from measure.loop import bank as banks
from measure.loop.reference import NullBank
from measure.loop.setting import Setting, Stage


def given(folder: Path, setting: Setting) -> NullBank:
    """The bank of a folder, made as `measure.loop.bank` does.

    Raises:
        InputError: its segments or anchors are not like the recordings'.
        FlagdataError: as `measure.loop.bank.load`.
    """
    bank = banks.load(folder, words=f"over priors, from {folder.name}")
    check(bank, setting, where=str(folder))
    return bank


def check(bank: NullBank, setting: Setting, *, where: str = "null bank") -> None:
    """Refuse nulls that do not fit the recordings.

    Raises:
        InputError: segments of another length, or anchors known in another way.
    """
    if bank.anchors_told != setting.experiment.specimen.anchors_told:
        ways = ("taken from where the recordings show the attachments", "told")
        raise InputError(
            f"its anchors were {ways[bank.anchors_told]}, those of the recordings are {ways[not bank.anchors_told]}",
            where=where, fix="simulate nulls for these recordings: leave the bank out",
        )  # fmt: skip
    if abs(bank.duration - setting.segments.duration) > 0.1 * bank.duration:
        raise InputError(
            f"its segments last {bank.duration:.2g} s, those of the recordings {setting.segments.duration:.2g} s",
            where=where, fix="simulate nulls for these recordings: leave the bank out; or record for longer",
        )  # fmt: skip


def simulated(setting: Setting, *, nulls: int, seed: int, workers: int, stage: Stage) -> NullBank:
    """Null recordings over the priors of the cloth, of the winds of an experiment; those of one cloth hold as many
    segments as the data, and are as noisy as the noisiest of its recordings."""
    first, segments = setting.experiment.recordings[0], setting.segments
    batches = [
        banks.prior_batch(
            setting.experiment.specimen, markers=first.markers, rate=1 / segments.period, noise=setting.design.noise,
            duration=segments.cut.lasting(banks.each(len(segments))),
            speeds=banks.around(float(setting.speeds.min()), float(setting.speeds.max())),
            seed=child_seed(seed, "null", index),
        )
        for index in range(math.ceil(nulls / banks.WINDS))
    ]  # fmt: skip
    done = 0

    def count(more: int) -> None:
        nonlocal done
        done += more
        stage("nulls", done, len(batches))

    with TemporaryDirectory(prefix="flagdata-nulls-") as folder:
        banks.build(Path(folder), batches, workers=workers, progress=count)
        total = banks.WINDS * len(batches)
        words = f"{total} recordings of {len(batches)} meshes and methods, over the priors of the cloth"
        return banks.load(Path(folder), words=words)
