"""Verdicts on flags of other numerics, without and with an effect, of which the loop is shown only observables.

**Registered** before any result of it was looked at (seed and rules are this file's). Two recordings of 30 s, in winds
of von Kármán's spectrum at means of 4 and 6.5 m/s, logged once a second by a cup. Truths are flags as null experiments
are, by other kinds of numerics. Those without an effect are null experiments, each kind judged by all others; those
with one are eight cloths for each effect, its strength from the stronger half of those that are weighed. What is stated
is the azimuth, ± 7°. Reported: how many are rejected at the level, and for those that are, whether the effect is named
alone, among several, as a part, or wrongly.

`python -m tests.validation loop_on_films`; the simulations are kept in FLAGDATA_LOOP_ON_FILMS, by default a new folder.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch

from flagdata.rng import child_seed, stream
from measure.calibrate.design import Design
from measure.calibrate.discretisation import Discretisation
from measure.calibrate.prior import Floats, Normal, Uncertain
from measure.calibrate.simulation import Batch, Flag
from measure.calibrate.wind import Log
from measure.films.design import TOGETHER, nulls
from measure.films.library import Weighable, weighable
from sim.effects.anemometer_lag import AnemometerLag
from sim.wind.spectral import VonKarman

SEED = 20261127
MEANS = (4.0, 6.5)  # m/s
DURATION = 30.0  # s
KINDS = 40
_BEFORE = 64.0  # s
_INTENSITY, _LENGTH, _RATE = 0.18, 50.0, 10.0  # 1, m, Hz
FLAG = Flag(length=1.5, height=1.0)
AZIMUTH = Uncertain(
    name="azimuth", unit="rad", prior=Normal(mean=math.radians(70.0), sigma=math.radians(7.0)), source="stated"
)


def log(mean: float) -> Log:
    """What a cup logs of one minute's wind."""
    rng = stream(SEED, "loop on films", f"{mean:g}")
    count = round((_BEFORE + DURATION + 2) * _RATE)
    spectrum = VonKarman(mean=mean, intensity=_INTENSITY, length=_LENGTH)
    speed = spectrum.series(rng, duration=count / _RATE, rate=_RATE)[:count]
    times = np.arange(count) / _RATE - _BEFORE
    lagged = AnemometerLag(distance=3.0).read(torch.from_numpy(times), torch.from_numpy(speed[:, None])).numpy()[:, 0]
    at = np.arange(-60.0, DURATION + 1.0)
    read = np.interp(at, times, lagged) + 0.05 * rng.standard_normal(len(at))
    return Log(times=at, speed=np.round(read, 1), distance=3.0)


def designs() -> list[Design]:
    """Of both recordings."""
    return [
        Design(flag=FLAG, log=log(mean).cut(0.0, DURATION), duration=DURATION, azimuth=AZIMUTH, seed=SEED)
        for mean in MEANS
    ]


def truths(effect: Weighable, number: int) -> list[list[Batch]]:
    """For each recording the flags with an effect, of one kind of numerics."""
    seed = child_seed(SEED, "truths", number)
    made = nulls(designs(), (0, 1), kinds=1, seed=seed)
    strengths = stronger(effect, seed)
    kind = Discretisation.drawn(stream(seed, "kind"), explicit=0.0)
    return [
        [replace(batch, effects=((effect.column, strengths),), discretisation=kind) for batch in own] for own in made
    ]


def stronger(effect: Weighable, seed: int) -> Floats:
    """(flag,) strengths from the stronger half of those that are weighed."""
    rng = stream(seed, "strengths")
    shares = 0.5 + 0.5 * (np.arange(TOGETHER) + rng.random(TOGETHER)) / TOGETHER
    if effect.low < 0:
        shares = np.where(rng.random(TOGETHER) < 0.5, shares, 1.0 - shares)
        shares = 0.5 + np.sign(shares - 0.5) * (0.25 + np.abs(shares - 0.5) / 2)
    return effect.prior.at(shares)


def all_truths() -> Sequence[tuple[str, list[list[Batch]]]]:
    """Name of the effect, and its flags."""
    return [(one.name, truths(one, number)) for number, one in enumerate(weighable(FLAG), start=1)]
