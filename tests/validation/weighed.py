"""The cloth weighed from geometry: flags of other numerics, of which `measure.calibrate` is shown only observables.

**Registered** before any result was looked at (seed and rules are this file's). One wind of von Kármán's spectrum blows
along one log of a cup: 1 Hz, lag, noise, steps of 0.1 m/s. Each truth has its own gain of it, its own place, size
error, fabric of the catalog with another bending, and damping; its mesh is finer (16 × 11, other diagonals), its steps
shorter (backward Euler of 1 ms) than the fit's. What is stated is the azimuth, ± 7°. Reported: the median error of the
area weight (aim: 10 %), the share of weights inside their 90 % intervals (aim: 84 to 96 %), and the same of the fit's
own simulations that were left out. Nothing here is filmed: it is geometry seen from a place.

`python -m tests.validation weighed`; the simulations are kept in FLAGDATA_WEIGHED, by default a new folder.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.rng import stream
from measure.calibrate.calibrate import Options, left_out, with_errors
from measure.calibrate.design import Design, simulated
from measure.calibrate.emulator import Emulator, Sight, weighed
from measure.calibrate.observed import Observed
from measure.calibrate.prior import Floats, Normal, Uncertain
from measure.calibrate.simulation import BATCH, OBSERVED, RATE, Flag, windows
from measure.calibrate.wind import Log
from measure.forecasting.observer import SegmentWind
from measure.observables import View
from sim import handles
from sim.effects.anemometer_lag import AnemometerLag
from sim.handles import Handles
from sim.integrate.implicit import BackwardEuler
from sim.material import MATERIALS, named
from sim.mesh import Diagonals, Mesh, grid
from sim.scene import Scene, assemble
from sim.wind.spectral import VonKarman

SEED = 20261127
TRUTHS = 16
WEIGHTS = (0.08, 0.35)  # kg/m²
DURATION = 60.0  # s
SIMULATIONS = 64
FINER = 18
"""Columns of the mesh that the fit's is compared with."""
_BEFORE, _SETTLE = 64.0, 4.0  # s
_MEAN, _INTENSITY, _LENGTH = 5.0, 0.2, 60.0  # m/s, 1, m
_AZIMUTH = Normal(mean=math.radians(70.0), sigma=math.radians(7.0))
_COLUMNS, _ROWS, _STEP = 16, 11, 1e-3
_WIND_RATE = 10.0  # Hz
FLAG = Flag(length=1.5, height=1.0)


def wind() -> tuple[Floats, Floats]:
    """Times (n,) since the film's first frame [s], and (n, 3) the wind at the anemometer [m/s]."""
    rng = stream(SEED, "weighed", "wind")
    count = round((_BEFORE + DURATION + 2) * _WIND_RATE)
    columns = []
    for ratio, length in ((1.0, _LENGTH), (0.78, _LENGTH / 2), (0.52, _LENGTH / 2)):
        spectrum = VonKarman(mean=_MEAN, intensity=_INTENSITY * ratio, length=length)
        columns.append(spectrum.series(rng, duration=count / _WIND_RATE, rate=_WIND_RATE)[:count] - _MEAN)
    velocity = np.stack(columns, axis=1)
    velocity[:, 0] += _MEAN
    return np.arange(count) / _WIND_RATE - _BEFORE, velocity


def log() -> Log:
    """What the cup logs of it."""
    times, velocity = wind()
    rng = stream(SEED, "weighed", "cup")
    speed = torch.from_numpy(np.hypot(velocity[:, 0], velocity[:, 1])[:, None])
    lagged = AnemometerLag(distance=float(rng.uniform(1.5, 5.0))).read(torch.from_numpy(times), speed).numpy()[:, 0]
    at = np.arange(-60.0, DURATION + 1.0)
    read = np.interp(at, times, lagged) + 0.05 * rng.standard_normal(len(at))
    return Log(times=at, speed=np.round(read, 1))


def design() -> Design:
    """What is simulated to weigh them."""
    azimuth = Uncertain(name="azimuth", unit="rad", prior=_AZIMUTH, source="stated")
    return Design(
        flag=FLAG, log=log().cut(0.0, DURATION), duration=DURATION, azimuth=azimuth, count=SIMULATIONS, seed=SEED
    )


def truths() -> list[Mapping[str, Any]]:
    """What each is."""
    order = stream(SEED, "weighed", "order").permutation(TRUTHS)
    fabrics = sorted(MATERIALS.names())
    fabrics = [name for name in fabrics if name not in ("aluminium", "paper")]
    found = []
    for number, place in enumerate(order.tolist()):
        rng = stream(SEED, "weighed", "truth", number)
        low, high = WEIGHTS
        found.append({
            "area_weight": low * (high / low) ** ((place + rng.random()) / TRUTHS),
            "fabric": fabrics[int(rng.integers(len(fabrics)))], "bending_factor": 0.3 * (4 / 0.3) ** rng.random(),
            "damping": 1e-3 * 20 ** rng.random(), "gain": 1 + 0.03 * rng.standard_normal(),
            "scale": 1 + 0.01 * rng.standard_normal(), "azimuth": float(_AZIMUTH.at(rng.random(1))[0]),
            "elevation": math.radians(5) * rng.standard_normal(), "distance": rng.uniform(8, 25),
            "seed": int(rng.integers(2**31)),
        })  # fmt: skip
    return found


def readings() -> Floats:
    """(truth, window, observable) of all truths, simulated together."""
    mesh = grid(
        width=FLAG.length, height=FLAG.height, columns=_COLUMNS, rows=_ROWS, diagonals=list(Diagonals)[1]
    )  # fmt: skip
    held = handles.corners(mesh.rest)
    drawn = truths()
    scenes = [_scene(mesh, held, truth) for truth in drawn]
    system, state = assemble(scenes)
    times, velocity = wind()
    blowing = velocity[times >= -_SETTLE - 1e-9]
    samples = np.stack([blowing * truth["gain"] for truth in drawn], axis=-1)
    system = replace(
        system, wind=SegmentWind(period=1 / _WIND_RATE, samples=torch.as_tensor(samples, dtype=torch.float32))
    )
    integrator = BackwardEuler(step=_STEP, tolerance=1e-3)
    frames = []
    with torch.no_grad():
        for frame in range(round((_SETTLE + DURATION) * RATE)):
            state = integrator.advance(system, state, 1 / RATE)
            if frame >= round(_SETTLE * RATE):
                frames.append(state.position.double().numpy().copy())
    positions = np.stack(frames)
    return np.stack([
        windows(
            positions[..., place] * truth["scale"], mesh=mesh, flag=FLAG, rate=RATE, observables=OBSERVED,
            view=View(azimuth=truth["azimuth"], elevation=truth["elevation"], distance=truth["distance"]),
        )
        for place, truth in enumerate(drawn)
    ])  # fmt: skip


def _scene(mesh: Mesh, held: tuple[int, ...], truth: Mapping[str, Any]) -> Scene:
    base = named(truth["fabric"])
    material = replace(
        base, density=truth["area_weight"], bending=base.bending * truth["bending_factor"],
        damping=max(truth["damping"] - _STEP, 0.0),
    )  # fmt: skip
    along = mesh.rest[:, 0]
    start = np.stack([along * math.cos(0.2), along * math.sin(0.2), mesh.rest[:, 1]], axis=1)
    rough = np.random.default_rng(truth["seed"]).normal(0.0, 1e-3, start.shape)
    rough[list(held)] = 0.0
    return Scene(mesh=mesh, position=start + rough, material=material, handles=Handles(vertices=held))


def kept(folder: Path) -> Floats:
    """The readings of all truths, from the folder or simulated into it."""
    path = folder / "truths.npy"
    if not path.exists():
        np.save(path, readings())
    return np.load(path)


def folder() -> Path:
    """Where simulations are kept."""
    path = Path(os.environ.get("FLAGDATA_WEIGHED") or mkdtemp(prefix="weighed-"))
    path.mkdir(parents=True, exist_ok=True)
    return path


def finer(design: Design) -> tuple[Floats, NDArray[np.int64]]:
    """(flag, window, observable) of every third flag beyond the first batch on a finer mesh, and their places in the
    design's order. The first batch is left out: its steps are shorter."""
    places = np.arange(BATCH, design.count, 3)[:BATCH]
    values, (first, *_) = design.values(), design.batches()
    shared = {name: values[name][places] for name in first.values}
    seen = np.stack([values["azimuth"], values["elevation"], np.full(design.count, design.distance)], axis=1)[places]
    seeds = tuple(seed for batch in design.batches() for seed in batch.seeds)
    batch = replace(
        first, values=shared, places=seen[:, None], seeds=tuple(seeds[place] for place in places), columns=FINER
    )
    return batch.read()[:, 0], places


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Weigh all truths. The design has its own seed."""
    del seed, out
    own, kept_at = design(), folder()
    readings_of = simulated(own, folder=kept_at / "batches", workers=len(os.sched_getaffinity(0)))
    found = kept(kept_at)
    blank = Observed(name="truths", source="", readings=found[0], log=own.log)
    summaries = with_errors(blank, readings_of, seed=SEED)
    used = np.ones(summaries.shape[1], dtype=bool)
    emulator = Emulator.fit(own.values(), summaries, used)
    observed = blank.projection.of(found).reshape(len(found), -1)
    sight = Sight(emulator=emulator, observed=observed[0], azimuth=own.azimuth, elevation=own.elevation)
    draws = weighed(sight, observed, seed=SEED)["area_weight"]
    drawn = truths()
    truth = np.array([one["area_weight"] for one in drawn])
    low, middle, high = np.quantile(draws, [0.05, 0.5, 0.95], axis=1)
    options = Options(flag=FLAG, azimuth=own.azimuth, simulations=own.count, seed=SEED)
    check = left_out([(blank, own.values(), summaries, used)], options)
    fine, places = finer(own)
    change = blank.projection.of(fine) - blank.projection.of(readings_of[places])
    return {
        "mesh": {"bias": change.mean(axis=0).tolist(), "sigma": change.std(axis=0, ddof=1).tolist()},
        "truths": len(truth), "median_error": float(np.median(np.abs(middle / truth - 1))),
        "held": int(((low <= truth) & (truth <= high)).sum()), "left_out": check.as_dict(),
        "emulator_error": emulator.error.tolist(), "observables": list(OBSERVED), "seconds_of_film": DURATION,
        "flags": [
            {**one, "value": float(m), "low": float(a), "high": float(b)}
            for one, a, m, b in zip(drawn, low, middle, high, strict=True)
        ],
    }  # fmt: skip
