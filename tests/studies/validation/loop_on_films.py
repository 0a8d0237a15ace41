"""Verdicts on flags of other numerics, without and with an effect, of which the loop is shown only
observables.

**Registered** before any result of it was looked at (seed and rules are this file's). Two
recordings of 30 s, in winds of von Kármán's spectrum at means of 4 and 6.5 m/s, logged once a
second by a cup. Truths are flags as null experiments are, by other kinds of numerics. Those without
an effect are null experiments, each kind judged by all others; those with one are eight cloths for
each effect, its strength from the stronger half of those that are weighed. What is stated is the
azimuth, ± 7°. Reported: how many are rejected at the level, and for those that are, whether the
effect is named alone, among several, as a part, or wrongly.

`python -m tests.studies loop-on-films`; the simulations are kept in FLAGDATA_LOOP_ON_FILMS, by
default a new folder. FLAGDATA_LOOP_ON_FILMS_EFFECTS names the effects that are weighed and that
act, _KINDS is how many kinds of numerics null experiments have, _RECORDINGS which of the two
recordings are used, as in "1" (all by default), and _SIMULATIONS how many flags of the base model
are simulated for each.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import torch

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.core.rng import child_seed, stream
from measure.cloth import (
    TOGETHER,
    Design,
    Discretisation,
    Experiments,
    Finer,
    Flag,
    FlagBatch,
    Judged,
    Log,
    Normal,
    Observed,
    Simulations,
    Uncertain,
    directions,
    judge,
    lasting,
    nulls,
    of_base,
    of_nulls,
    pairs,
    readings_of,
    score,
    sights_of,
    weighable,
)
from measure.cloth.design import Weighable
from measure.cloth.model_evidence import Weighing, weigh
from sim.effects import AnemometerLag
from sim.wind import VonKarman

SEED = 20261127
MEANS = (4.0, 6.5)  # m/s
DURATION = 30.0  # s
KINDS = int(os.environ.get("FLAGDATA_LOOP_ON_FILMS_KINDS", "20"))
SIMULATIONS = int(os.environ.get("FLAGDATA_LOOP_ON_FILMS_SIMULATIONS", "128"))
LEVEL = 0.05
_BEFORE = 64.0  # s
_INTENSITY, _LENGTH, _RATE = 0.18, 50.0, 10.0  # 1, m, Hz
FLAG = Flag(length=1.5, height=1.0)
AZIMUTH = Uncertain(
    name="azimuth",
    unit="rad",
    prior=Normal(mean=math.radians(70.0), sigma=math.radians(7.0)),
    source="stated",
)


def log(mean: float) -> Log:
    """What a cup logs of one minute's wind."""
    rng = stream(SEED, "loop on films", f"{mean:g}")
    count = round((_BEFORE + DURATION + 2) * _RATE)
    spectrum = VonKarman(mean=mean, intensity=_INTENSITY, length=_LENGTH)
    speed = spectrum.series(rng, duration=count / _RATE, rate=_RATE)[:count]
    times = np.arange(count) / _RATE - _BEFORE
    lagged = (
        AnemometerLag(distance=3.0)
        .read(torch.from_numpy(times), torch.from_numpy(speed[:, None]))
        .numpy()[:, 0]
    )
    at = np.arange(-60.0, DURATION + 1.0)
    read = np.interp(at, times, lagged) + 0.05 * rng.standard_normal(len(at))
    return Log(times=at, speed=np.round(read, 1), distance=3.0)


def chosen() -> tuple[int, ...]:
    """Places of the recordings that are used."""
    return tuple(
        int(place) for place in os.environ.get("FLAGDATA_LOOP_ON_FILMS_RECORDINGS", "0 1").split()
    )


def effects() -> tuple[Weighable, ...]:
    """That are weighed, and that act."""
    wanted = os.environ.get("FLAGDATA_LOOP_ON_FILMS_EFFECTS", "").split()
    return tuple(one for one in weighable(FLAG) if not wanted or one.name in wanted)


def designs() -> list[Design]:
    """Of both recordings."""
    return [
        Design(
            flag=FLAG,
            log=log(mean).cut(0.0, DURATION),
            duration=DURATION,
            azimuth=AZIMUTH,
            count=SIMULATIONS,
            seed=SEED,
        )
        for mean in MEANS
    ]


def truths(effect: Weighable, number: int) -> list[list[FlagBatch]]:
    """For each recording the flags with an effect, of one kind of numerics."""
    seed = child_seed(SEED, "truths", number)
    made = nulls(designs(), (0, 1), kinds=1, seed=seed)
    strengths = stronger(effect, seed)
    kind = Discretisation.drawn(stream(seed, "kind"), explicit=0.0)
    return [
        [
            replace(batch, effects=((effect.column, strengths),), discretisation=kind)
            for batch in own
        ]
        for own in made
    ]


def stronger(effect: Weighable, seed: int) -> FloatArray:
    """(flag,) strengths from the stronger half of those that are weighed."""
    rng = stream(seed, "strengths")
    shares = 0.5 + 0.5 * (np.arange(TOGETHER) + rng.random(TOGETHER)) / TOGETHER
    if effect.low < 0:
        shares = np.where(rng.random(TOGETHER) < 0.5, shares, 1.0 - shares)
        shares = 0.5 + np.sign(shares - 0.5) * (0.25 + np.abs(shares - 0.5) / 2)
    return effect.prior.at(shares)


def simulations(folder: Path) -> Simulations:
    """Of the recordings that are used: the base model, the effects' pairs and null experiments."""
    own, workers = designs(), len(os.sched_getaffinity(0))
    null = nulls(own, (0, 1), kinds=KINDS, seed=SEED)

    def seen(batches: Sequence[FlagBatch]) -> FloatArray:
        return readings_of(batches, folder=folder, workers=workers)[:, 0]

    finer = [Finer.of(own[place]) for place in chosen()]
    base = tuple(seen(own[place].batches()) for place in chosen())
    made = [
        [pairs(design, effect, until=lasting(len(own))) for effect in effects()] for design in own
    ]
    return Simulations(
        designs=tuple(own[place] for place in chosen()),
        base=base,
        pairs=tuple(
            tuple((pair, seen(pair.batches)) for pair in made[place]) for place in chosen()
        ),
        nulls=tuple(seen(null[place]) for place in chosen()),
        kinds=np.repeat(np.arange(KINDS), TOGETHER),
        weights=np.concatenate([batch.values["area_weight"] for batch in null[0]]),
        corrections=tuple(
            one.correction(seen(one.batches), coarse)
            for one, coarse in zip(finer, base, strict=True)
        ),
    )


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Judge all truths. The design has its own seed."""
    del seed, out
    folder = Path(os.environ.get("FLAGDATA_LOOP_ON_FILMS") or mkdtemp(prefix="loop-on-films-"))
    made = simulations(folder)
    recordings = [
        Observed(
            name=f"{MEANS[place]:g} m/s",
            source="",
            readings=np.nanmean(base, axis=0),
            log=design.log,
        )
        for place, base, design in zip(chosen(), made.base, made.designs, strict=True)
    ]
    sights = sights_of(recordings, made)
    null, kinds = of_nulls(sights, recordings, made, None, seed=SEED)
    base = of_base(sights, recordings, made, None, seed=SEED)
    weighed, along = weigh(sights, null, effects(), seed=SEED), directions(sights, effects(), None)

    def found(own: Experiments, weighing: Weighing, place: int, by: BoolArray) -> Judged:
        """One experiment judged by some of the null flags. How far it departs from the base model
        is left out, which moves no rejection."""
        scored = score(
            rows_of(own, [place]), base, rows_of(null, by), kinds[by], along, level=LEVEL
        )
        others = weighed.misfits.rows(np.flatnonzero(by).tolist())
        single = replace(
            weighing, factors=weighing.factors[[place]], misfits=weighing.misfits.rows([place])
        )
        return judge(single, others, kinds[by], scored, level=LEVEL, departure=0.0)

    rows: list[dict[str, Any]] = []
    for number, kind in enumerate(kinds.tolist()):
        rows.append(_row(None, 0.0, found(null, weighed, number, kinds != kind)))
    for number, effect in enumerate(weighable(FLAG), start=1):
        if effect in effects():
            batches = truths(effect, number)
            shown = tuple(readings_of(batches[place], folder=folder)[:, 0] for place in chosen())
            true, whole = of_nulls(
                sights,
                recordings,
                replace(made, nulls=shown, kinds=np.arange(TOGETHER)),
                None,
                seed=SEED + number,
            )
            own = weigh(sights, true, effects(), seed=SEED)
            strengths = stronger(effect, child_seed(SEED, "truths", number))[whole]
            for place, strength in enumerate(strengths.tolist()):
                rows.append(
                    _row(
                        effect,
                        strength,
                        found(true, own, place, np.ones(len(kinds), dtype=np.bool_)),
                    )
                )
    return {
        "recordings": list(chosen()),
        "kinds": KINDS,
        "simulations": SIMULATIONS,
        "effects": [one.name for one in effects()],
        **_summary(rows),
        "rows": rows,
    }


def rows_of(several: Experiments, which: BoolArray | Sequence[int]) -> Experiments:
    """Some of several experiments of cloths that were not weighed."""
    return Experiments(summaries=tuple(own[which] for own in several.summaries))


def _row(effect: Weighable | None, strength: float, found: Judged) -> dict[str, Any]:
    names = [one.name for one in effects()]
    return {
        "effect": None if effect is None else effect.name,
        "strength": strength,
        "p": found.p_value,
        "conclusion": found.conclusion.value,
        "named": [names[place] for place in found.named],
        "statistic": found.scored.statistic,
        "z": found.scored.z.tolist(),
        "whole": found.scored.whole,
        "tail": found.scored.nulls.tail(found.scored.statistic),
        "power": found.scored.power.tolist(),
        "probability": None
        if effect is None
        else float(found.probability[names.index(effect.name)]),
    }


def _summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """How often which became of truths without and with an effect."""
    without, true = (
        [one for one in rows if one["effect"] is None],
        [one for one in rows if one["effect"] is not None],
    )
    rejected = [one for one in true if one["p"] <= LEVEL]
    by_tail = [one["tail"] <= LEVEL for one in without]
    return {
        "without": {
            "count": len(without),
            "rejected": sum(one["p"] <= LEVEL for one in without),
            "rejected by the tail": sum(by_tail),
        },
        "with": {
            "count": len(true),
            "rejected": len(rejected),
            "named alone": sum(one["named"] == [one["effect"]] for one in rejected),
            "one of": sum(
                one["effect"] in one["named"] and len(one["named"]) > 1 for one in rejected
            ),
            "another alone": sum(
                len(one["named"]) == 1 and one["named"] != [one["effect"]] for one in rejected
            ),
            "none": sum(not one["named"] for one in rejected),
        },
    }
