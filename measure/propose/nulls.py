"""Null recordings seen along the terms that are tried: what those statistics are when nothing is missing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import torch

from flagdata.rng import child_seed
from measure.loop.bank import BATCH, WINDS, prior_batch
from measure.loop.close import Setting, Stage
from measure.loop.columns import THETA, Calibration, Column
from measure.loop.forecast import Forecaster, Segments
from measure.loop.inference import Nulls
from measure.loop.nulls import NullBatch
from measure.loop.reference import NullBank
from measure.loop.statistics import Statistics
from measure.propose.sensitivities import statistics
from sim.integrate.split import SplitEuler

_KINDS = 12


def names(columns: Sequence[Column]) -> tuple[str, ...]:
    """Of the calibrated parameters and some columns."""
    return (*(name for name, _, _ in THETA), *(column.name for column in columns))


def batches(setting: Setting, *, nulls: int, seed: int) -> list[NullBatch]:
    """Null recordings over the priors of the cloth, of the winds of an experiment; of 12 numerics or more."""
    first = setting.experiment.recordings[0]
    segments = setting.segments
    each = max(2, math.ceil(len(segments) / WINDS))
    return [
        prior_batch(
            setting.experiment.specimen, markers=first.markers, rate=first.rate, noise=first.noise,
            duration=(each * round(segments.duration / segments.period) + segments.first + 1) * segments.period,
            speeds=(0.9 * float(setting.speeds.min()), 1.1 * float(setting.speeds.max())),
            seed=child_seed(seed, "null", index),
        )
        for index in range(max(_KINDS, round(nulls / BATCH)))
    ]  # fmt: skip


def bank(planned: Sequence[NullBatch], columns: Sequence[Column], *, workers: int, stage: Stage) -> NullBank:
    """Simulate batches, and take their statistics along some columns."""
    parts: list[Nulls] = []
    durations: list[float] = []
    with ProcessPoolExecutor(
        max_workers=workers, mp_context=get_context("spawn"), initializer=torch.set_num_threads, initargs=(1,)
    ) as pool:
        running = [pool.submit(evaluate, batch, index, tuple(columns)) for index, batch in enumerate(planned)]
        for done, one in enumerate(running, start=1):
            nulls, duration = one.result()
            parts.append(nulls)
            durations.append(duration)
            stage("nulls", done, len(planned))
    words = f"{BATCH * len(planned)} recordings of {len(planned)} meshes and methods, over the priors of the cloth"
    return NullBank(nulls=joined(parts), columns=names(columns), duration=durations[0], words=words)


def evaluate(batch: NullBatch, numerics: int, columns: Sequence[Column]) -> tuple[Nulls, float]:
    """Simulate a batch and take its statistics along columns, from the nominal calibration; with the duration of a
    segment [s]."""
    segments = Segments.of(batch.simulate())
    forecaster = Forecaster(specimen=batch.specimen, markers=batch.markers, integrator=SplitEuler())
    found = statistics(forecaster, segments, columns)
    offsets = np.array([c.steps_from(Calibration()) for c in batch.calibrations])
    nulls = Nulls(
        statistics=found, speeds=np.array(batch.speeds)[found.recording], offsets=offsets[found.recording],
        numerics=np.full(len(found.recording), numerics),
    )  # fmt: skip
    return nulls, segments.duration


def joined(parts: Sequence[Nulls]) -> Nulls:
    """Nulls of several numerics, one after another; recordings are numbered through."""
    own: list[Statistics] = []
    count = 0
    for part in parts:
        own.append(replace(part.statistics, recording=part.statistics.recording + count))
        count = int(own[-1].recording.max()) + 1
    return Nulls(
        statistics=Statistics.joined(own), speeds=np.concatenate([p.speeds for p in parts]),
        offsets=np.concatenate([p.offsets for p in parts]), numerics=np.concatenate([p.numerics for p in parts]),
        noise=np.concatenate([p.noise for p in parts]),
    )  # fmt: skip
