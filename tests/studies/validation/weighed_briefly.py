"""The cloth weighed from half a minute: sixteen flags of other numerics as geometry, five of them
filmed.

**Registered** before any truth was simulated (seed, list and aims are this file's). The simulations
are those of `loop_on_films` in its stronger wind, 128 of 30 s, so that none is made for this:
`weighed`, which asks for more, has not been run. The wind of the truths is what that log's cup
stood in, with a direction and a vertical part of their own. Each truth has its own fabric, bending,
stretching, damping (0.5 to 20 ms), gain, size error and place; its mesh is finer (16 × 11, other
diagonals), its steps are 0.5 ms of backward Euler. Stated are the azimuth (70 ± 7°), a level axis
(± 5°) and a distance of 15 m. Aims as for `weighed`: median error 10 %, 84 to 96 % in intervals of
90 %; half a minute is not expected to reach the first: simulations left out are off by 11 to 23 %
in the median.

`python -m tests.studies weighed-briefly`; FLAGDATA_LOOP_ON_FILMS names the folder of the
simulations, FLAGDATA_WEIGHED that of the truths.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from measure.cloth import (
    MEASURED,
    OBSERVED,
    TABLES,
    CalibrationOptions,
    Emulator,
    Observed,
    Sight,
    informative,
    simulated_values,
    weigh_cloths,
    with_errors,
)
from sim.cloth.scene import assemble
from sim.integrate import BackwardEuler
from sim.run.simulation_loop import Batch, Divergence, after
from sim.wind import Beyond, Even, SampledWind, VonKarman
from tests.studies.validation import loop_on_films as loop
from tests.studies.validation import weighed as large
from tests.studies.validation import weighed_films as films

SEED = 20261129
TRUTHS, FILMED = 16, (0, 3, 7, 10, 14)
WIND = 1
"""Place of the recording among those of `loop_on_films`."""
_SETTLE, _STEP = 4.0, 0.5e-3  # s


def truths() -> list[Mapping[str, Any]]:
    """What each is."""
    order, found, own = (
        stream(SEED, "briefly", "order").permutation(TRUTHS),
        [],
        loop.designs()[WIND],
    )
    fabrics = sorted(TABLES)
    low, high = large.WEIGHTS
    for number, place in enumerate(order.tolist()):
        rng = stream(SEED, "briefly", "truth", number)
        found.append(
            {
                "number": number,
                "code": "kernel",
                "fabric": fabrics[int(rng.integers(len(fabrics)))],
                "area_weight": low * (high / low) ** ((place + rng.random()) / TRUTHS),
                "bending_factor": 0.3 * (4 / 0.3) ** rng.random(),
                "stretching_factor": 0.6 * (1.6 / 0.6) ** rng.random(),
                "damping": 5e-4 * 40 ** rng.random(),
                "gain": 1 + 0.03 * rng.standard_normal(),
                "scale": 1 + 0.01 * rng.standard_normal(),
                "azimuth": float(own.azimuth.at(rng.random(1))[0]),
                "elevation": float(own.elevation.at(rng.random(1))[0]),
                "distance": rng.uniform(13, 17),
                "seed": int(rng.integers(2**31)),
            }
        )
    return found


def wind(number: int) -> FloatArray:
    """(n, 3) from `_SETTLE` before the film on: the horizontal speed behind the log, and a truth's
    own direction."""
    mean = loop.MEANS[WIND]
    count = round((loop._BEFORE + loop.DURATION + 2) * loop._RATE)
    speed = VonKarman(mean=mean, intensity=loop._INTENSITY, length=loop._LENGTH).series(
        stream(loop.SEED, "loop on films", f"{mean:g}"),
        duration=count / loop._RATE,
        rate=loop._RATE,
    )[:count]
    rng = stream(SEED, "briefly", "wind", number)
    across, up = (
        VonKarman(mean=mean, intensity=loop._INTENSITY * ratio, length=loop._LENGTH / 2).series(
            rng, duration=count / loop._RATE, rate=loop._RATE
        )[:count]
        - mean
        for ratio in (0.78, 0.52)
    )
    angle = np.arctan2(across, mean)
    whole = np.stack([speed * np.cos(angle), speed * np.sin(angle), up], axis=1)
    return whole[round((loop._BEFORE - _SETTLE) * loop._RATE) :]


def moved() -> FloatArray:
    """(truth, frame, vertex, 3) at `large.FILM_RATE` from the film's first frame on [m]."""
    own, some = large.mesh("kernel"), truths()
    system, state = assemble([large._scene(own, truth, damped=_STEP) for truth in some])
    samples = np.stack([wind(truth["number"]) * truth["gain"] for truth in some], axis=-1)
    even = Even(start=0.0, period=1 / loop._RATE, count=len(samples))
    blowing = SampledWind(
        times=even, samples=torch.as_tensor(samples, dtype=torch.float32), beyond=Beyond.HOLD
    )
    method = BackwardEuler(step=_STEP, tolerance=1e-3)
    batch = Batch(
        system=replace(system, wind=blowing),
        state=state,
        integrator=method,
        divergence=Divergence.KEEP,
    )
    frames = batch.positions(after(_SETTLE, loop.DURATION, large.FILM_RATE), large.FILM_RATE)
    return np.moveaxis(frames, -1, 0)


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Weigh all truths. The design has its own seed."""
    del seed
    at = Path(os.environ.get("FLAGDATA_WEIGHED") or mkdtemp(prefix="weighed-briefly-"))
    at.mkdir(parents=True, exist_ok=True)
    own, some = loop.designs()[WIND], truths()
    base = simulated_values(
        own, folder=Path(os.environ.get("FLAGDATA_LOOP_ON_FILMS") or at / "batches")
    )
    positions = large.kept(at / "positions.npy", moved)
    seen = large.kept(
        at / "geometry.npy",
        lambda: np.stack(
            [large.readings(p, truth) for p, truth in zip(positions, some, strict=True)]
        ),
    )
    rows, blank = [], Observed(name="", source="", readings=seen[0], log=own.log)
    summaries = with_errors(blank, base, MEASURED, seed=SEED)
    shown = informative(
        own.values(), summaries, np.ones(summaries.shape[1], dtype=bool), name="briefly"
    )
    emulator = Emulator.fit(own.values(), summaries, shown, name="briefly")
    observed = blank.projection.of(seen).reshape(len(seen), -1)
    sight = Sight(emulator=emulator, azimuth=own.azimuth, elevation=own.elevation)
    draws = weigh_cloths([sight], [observed], seed=SEED)["area_weight"]
    low, middle, high = np.quantile(draws, [0.05, 0.5, 0.95], axis=1).tolist()
    for place, truth in enumerate(some):
        rows.append(
            {
                "name": f"truth-{place}",
                "truth": truth["area_weight"],
                "value": middle[place],
                "low": low[place],
                "high": high[place],
                "bounded": False,
                "misfit": None,
                "withheld": None,
                "damping": truth["damping"],
                "code": "kernel",
            }
        )
    options = CalibrationOptions(
        flag=loop.FLAG,
        azimuth=own.azimuth,
        elevation=own.elevation,
        simulations=own.count,
        seed=SEED,
    )
    filmed = []
    for number in FILMED:
        truth, make = some[number], films.filmed
        read = large.kept(
            at / f"film-{number}.npy",
            lambda truth=truth, p=positions[number], make=make: make(
                truth, p, large.mesh("kernel"), at
            ),
        )
        if np.isfinite(read).mean(axis=0).max() < 0.6:
            filmed.append(
                {**rows[number], "name": f"truth-{number}, filmed: no flag found", "value": None}
            )
            continue
        filmed.append(
            large.weigh(
                f"truth-{number}, filmed",
                read,
                base,
                sigma=films.SIGMA,
                truth=truth,
                of=(own, options),
            )
        )
    check = filmed[-1].get("check") or {"count": 0, "held": 0, "median_error": 0.0}
    sheet = {
        "geometry": {**large.score(rows), "flags": rows},
        "films": {**large.score(filmed), "flags": filmed},
        "left_out": check,
        "observables": list(OBSERVED),
        "seconds": loop.DURATION,
    }
    (out / "validate-weighed-briefly.md").write_text(large.page(sheet), encoding="utf-8")
    return sheet
