"""The cloth weighed: twenty flags of other numerics and of MuJoCo, as geometry and, some of them, filmed.

**Registered** before any truth was simulated (seed, list and aims are this file's). One wind of von Kármán's spectrum
blows for one minute along one log of a cup (1 Hz, lag, noise, steps of 0.1 m/s), so that one set of 128 simulations
serves all truths; two minutes, which were asked for, cost twice as much processor as there was. Each truth has its
own gain of the log, its own place, size error, bending, stretching and damping, from 0.25 to 20 ms. Fourteen are of
the kernel: fabrics of the catalog on a finer mesh with other diagonals (16 × 11), by leapfrog below 1 ms of damping
and by backward Euler of 0.5 ms above. Six are of MuJoCo: isotropic cloth of constant stiffness on 16 × 11. What is
stated is the azimuth (± 7°), the elevation (± 5°) and the distance (8 m, where it is 7 to 9 m). All are weighed as
geometry seen from their place; those of `FILMED` are filmed by the raster renderer as well, before sky, hills,
foliage or buildings, and weighed from the coded film (`weighed_films`).

Aims: median error of the area weight 10 %, 84 to 96 % of the weights in their intervals of 90 %. A flag whose weight is
withheld has no error; it counts as a weight that is not given, and their number is reported beside.

`python -m tests.validation weighed`; the simulations are kept in FLAGDATA_WEIGHED, by default a new folder.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.rng import stream
from measure.calibrate.calibrate import Options, answered
from measure.calibrate.design import Design, simulated
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
from sim.integrate.symplectic import Symplectic
from sim.material import MATERIALS, named
from sim.mesh import Diagonals, Mesh, grid
from sim.scene import Scene, assemble
from sim.wind.spectral import VonKarman
from tests.validation import environments
from tests.validation.mujoco.cloth import Air, Integrator, Method, Sheet, Wind, fly
from tests.validation.mujoco.experiments import NOMINAL
from tests.validation.weighed_films import SIGMA, filmed

Row = dict[str, Any]

SEED = 20261128
TRUTHS = 20
MUJOCO = (1, 4, 8, 11, 15, 18)
FILMED = (0, 3, 7, 10, 12, 16)
WEIGHTS = (0.08, 0.35)  # kg/m²
DURATION = 60.0  # s
SIMULATIONS = 128
FINER = 18
"""Columns of the mesh that the fit's is compared with."""
FILM_RATE = 25.0  # Hz
DISTANCE = 8.0  # m
_BEFORE, _SETTLE = 64.0, 4.0  # s
_MEAN, _INTENSITY, _LENGTH = 5.0, 0.2, 60.0  # m/s, 1, m
_AZIMUTH = Normal(mean=math.radians(75.0), sigma=math.radians(7.0))
_ELEVATION = Normal(mean=math.radians(12.0), sigma=math.radians(5.0))
_COLUMNS, _ROWS = 16, 11
_EXPLICIT, _STEP = 1e-3, 0.5e-3  # s
_GENTLE, _IMPLICIT = 0.6e-3, 1e-3  # s, of MuJoCo
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
    elevation = Uncertain(name="elevation", unit="rad", prior=_ELEVATION, source="stated")
    return Design(
        flag=FLAG, log=log().cut(0.0, DURATION), duration=DURATION, azimuth=azimuth, elevation=elevation,
        count=SIMULATIONS, seed=SEED, distance=DISTANCE,
    )  # fmt: skip


def truths() -> list[Mapping[str, Any]]:
    """What each is."""
    order = stream(SEED, "weighed", "order").permutation(TRUTHS)
    fabrics = [name for name in sorted(MATERIALS.names()) if name not in ("aluminium", "paper")]
    found = []
    for number, place in enumerate(order.tolist()):
        rng = stream(SEED, "weighed", "truth", number)
        (low, high), mujoco = WEIGHTS, number in MUJOCO
        found.append({
            "number": number, "code": "mujoco" if mujoco else "kernel",
            "area_weight": low * (high / low) ** ((place + rng.random()) / TRUTHS),
            "fabric": "isotropic" if mujoco else fabrics[int(rng.integers(len(fabrics)))],
            "bending_factor": 0.3 * (4 / 0.3) ** rng.random(), "stretching_factor": 0.6 * (1.6 / 0.6) ** rng.random(),
            "damping": 2.5e-4 * 80 ** rng.random(), "gain": 1 + 0.03 * rng.standard_normal(),
            "scale": 1 + 0.01 * rng.standard_normal(), "azimuth": float(_AZIMUTH.at(rng.random(1))[0]),
            "elevation": float(_ELEVATION.at(rng.random(1))[0]), "distance": rng.uniform(7, 9),
            "seed": int(rng.integers(2**31)),
        })  # fmt: skip
    return found


def mesh() -> Mesh:
    """Of the truths."""
    return grid(width=FLAG.length, height=FLAG.height, columns=_COLUMNS, rows=_ROWS, diagonals=list(Diagonals)[1])


def moved(truth: Mapping[str, Any]) -> Floats:
    """(frame, vertex, 3) of a truth at `FILM_RATE` from the film's first frame on [m]."""
    return by_mujoco(truth) if truth["code"] == "mujoco" else by_kernel(truth)


def by_kernel(truth: Mapping[str, Any]) -> Floats:
    """As `moved`."""
    own, explicit = mesh(), truth["damping"] < _EXPLICIT
    system, state = assemble([_scene(own, truth, damped=0.0 if explicit else _STEP)])
    times, velocity = wind()
    samples = torch.as_tensor(velocity[times >= -_SETTLE - 1e-9, :, None] * truth["gain"], dtype=torch.float32)
    system = replace(system, wind=SegmentWind(period=1 / _WIND_RATE, samples=samples))
    integrator = Symplectic() if explicit else BackwardEuler(step=_STEP, tolerance=1e-3)
    frames = []
    with torch.no_grad():
        for frame in range(round((_SETTLE + DURATION) * FILM_RATE)):
            state = integrator.advance(system, state, 1 / FILM_RATE)
            if frame >= round(_SETTLE * FILM_RATE):
                frames.append(state.position[..., 0].numpy().copy())
    return np.stack(frames)


def by_mujoco(truth: Mapping[str, Any]) -> Floats:
    """As `moved`; bending and stretching of the nominal cloth times the truth's factors."""
    own = mesh()
    gentle = truth["damping"] <= _GENTLE
    method = Method() if gentle else Method(integrator=Integrator.DISCRETE, step=_IMPLICIT)
    sheet = Sheet(
        mesh=own, held=handles.corners(own.rest), density=truth["area_weight"],
        stretching=NOMINAL.stretching * truth["stretching_factor"], poisson=NOMINAL.poisson,
        bending=NOMINAL.bending * truth["bending_factor"],
        damping=max(truth["damping"] - (0.0 if gentle else method.step), 0.0),
    )  # fmt: skip
    flat = np.stack([own.rest[:, 0], np.zeros(len(own.rest)), own.rest[:, 1]], axis=1)
    times, velocity = wind()
    flight = fly(
        environments.MUJOCO.find(), sheet, start=_start(own, truth), reference=flat, air=Air(), method=method,
        wind=Wind(times=times, velocity=velocity * truth["gain"]), rate=FILM_RATE,
        frames=round(DURATION * FILM_RATE), settle=round(_SETTLE * FILM_RATE),
    )  # fmt: skip
    return flight.positions


def readings(positions: Floats, truth: Mapping[str, Any]) -> Floats:
    """(window, observable) of a truth seen from its place."""
    view = View(azimuth=truth["azimuth"], elevation=truth["elevation"], distance=truth["distance"])
    every = round(FILM_RATE / RATE)
    return windows(
        positions[::every] * truth["scale"], mesh=mesh(), flag=FLAG, view=view, rate=RATE, observables=OBSERVED
    )


def _start(own: Mesh, truth: Mapping[str, Any]) -> Floats:
    along = own.rest[:, 0]
    start = np.stack([along * math.cos(0.2), along * math.sin(0.2), own.rest[:, 1]], axis=1)
    rough = np.random.default_rng(truth["seed"]).normal(0.0, 1e-3, start.shape)
    rough[list(handles.corners(own.rest))] = 0.0
    return start + rough


def _scene(own: Mesh, truth: Mapping[str, Any], *, damped: float) -> Scene:
    base = named(truth["fabric"])
    material = replace(
        base, density=truth["area_weight"], bending=base.bending * truth["bending_factor"],
        stretching=base.stretching * truth["stretching_factor"], damping=max(truth["damping"] - damped, 0.0),
    )  # fmt: skip
    held = Handles(vertices=handles.corners(own.rest))
    return Scene(mesh=own, position=_start(own, truth), material=material, handles=held)


def kept(path: Path, make: Callable[[], Floats]) -> Floats:
    """An array from a file, or made into it."""
    if not path.exists():
        made = make()
        with path.with_suffix(".part").open("wb") as file:
            np.save(file, made)
        path.with_suffix(".part").replace(path)
    return np.load(path)


def folder() -> Path:
    """Where simulations are kept."""
    path = Path(os.environ.get("FLAGDATA_WEIGHED") or mkdtemp(prefix="weighed-"))
    path.mkdir(parents=True, exist_ok=True)
    return path


def simulations(at: Path) -> Floats:
    """(simulation, window, observable) of the design."""
    return simulated(design(), folder=at / "batches", workers=int(os.environ.get("FLAGDATA_WORKERS", "1")))


def positions(truth: Mapping[str, Any], at: Path) -> Floats:
    """`moved`, kept."""
    return kept(at / f"truth-{truth['number']}.npy", lambda: moved(truth))


def finer(design: Design) -> tuple[Floats, NDArray[np.int64]]:
    """(flag, window, observable) of flags of the fourth to the last batch on a finer mesh, and their
    places in the design's order. Those before have shorter steps."""
    places = np.arange(4 * BATCH, design.count, 4)[:BATCH]
    values, (first, *_) = design.values(), design.batches()
    shared = {name: values[name][places] for name in first.values}
    seen = np.stack([values["azimuth"], values["elevation"], np.full(design.count, design.distance)], axis=1)[places]
    seeds = tuple(seed for batch in design.batches() for seed in batch.seeds)
    batch = replace(
        first, values=shared, places=seen[:, None], seeds=tuple(seeds[place] for place in places), columns=FINER,
    )  # fmt: skip
    return batch.read()[:, 0], places


def options() -> Options:
    """What is stated."""
    own = design()
    return Options(
        flag=FLAG, azimuth=own.azimuth, elevation=own.elevation, distance=DISTANCE, simulations=own.count, seed=SEED
    )


def weigh(name: str, found: Floats, base: Floats, *, sigma: Floats, truth: Mapping[str, Any]) -> Row:
    """What `measure.calibrate` answers to a truth's readings (window, observable).

    Args:
        base: readings of the design's simulations.
        sigma: of the truth's.
    """
    one = Observed(name=name, source="", readings=found, log=design().log, sigma=sigma)
    answer = answered([(one, design().values(), base)], options())
    (fitted,), weight = answer.recordings, answer.weight
    low, high = weight.interval
    return {
        "name": name, "truth": truth["area_weight"], "value": weight.value, "low": low, "high": high,
        "misfit": fitted.misfit, "withheld": answer.withheld, "damping": truth["damping"], "code": truth["code"],
        "check": answer.check.as_dict(),
    }  # fmt: skip


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Weigh all truths. The design has its own seed."""
    del seed
    at = folder()
    base = simulations(at)
    rows, films = [], []
    for truth in truths():
        name = f"truth-{truth['number']}"
        seen = kept(at / f"geometry-{truth['number']}.npy", lambda: readings(positions(truth, at), truth))  # noqa: B023
        rows.append(weigh(name, seen, base, sigma=np.zeros(len(OBSERVED)), truth=truth))
        if truth["number"] in FILMED:
            film = kept(at / f"film-{truth['number']}.npy", lambda: filmed(truth, positions(truth, at), mesh(), at))  # noqa: B023
            films.append(weigh(f"{name}, filmed", film, base, sigma=SIGMA, truth=truth))
    fine, places = finer(design())
    blank = Observed(name="", source="", readings=fine[0], log=design().log)
    change = blank.projection.of(fine) - blank.projection.of(base[places])
    sheet = {
        "mesh": {"bias": change.mean(axis=0).tolist(), "sigma": change.std(axis=0, ddof=1).tolist()},
        "geometry": {**score(rows), "flags": rows}, "films": {**score(films), "flags": films},
        "left_out": rows[0]["check"], "observables": list(OBSERVED), "seconds": DURATION,
    }  # fmt: skip
    (out / "validate-weighed.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def score(rows: Sequence[Row]) -> dict[str, Any]:
    """Median error of the weights that are given, and how many are in their intervals."""
    given = [row for row in rows if row["value"] is not None]
    errors = [abs(row["value"] / row["truth"] - 1) for row in given]
    return {
        "flags": len(rows), "withheld": len(rows) - len(given),
        "median_error": float(np.median(errors)) if errors else None,
        "held": sum(row["low"] <= row["truth"] <= row["high"] for row in given),
    }  # fmt: skip


def page(sheet: Mapping[str, Any]) -> str:
    """The sheet in Markdown."""
    lines = ["# Twenty simulated flags weighed", ""]
    lines += ["| seen as | flags | weight withheld | median error | in the 90 % interval |", "|---|---|---|---|---|"]
    for name in ("geometry", "films"):
        own = sheet[name]
        error = "" if own["median_error"] is None else f"{own['median_error']:.1%}"
        lines.append(
            f"| {name} | {len(own['flags'])} | {own['withheld']} | {error} | {own['held']} of "
            f"{len(own['flags']) - own['withheld']} |"
        )
    check, heading = sheet["left_out"], "| flag | code | damping [ms] | weight [kg/m²] | found | interval | p |"
    left_out = f"Of {check['count']} simulations left out {check['held']} lie in their intervals, median error "
    lines += ["", f"{left_out}{check['median_error']:.1%}.", "", heading, "|---|---|---|---|---|---|---|"]
    for row in (*sheet["geometry"]["flags"], *sheet["films"]["flags"]):
        found = "withheld" if row["value"] is None else f"{row['value']:.3f}"
        lines.append(
            f"| {row['name']} | {row['code']} | {row['damping'] * 1e3:.2f} | {row['truth']:.3f} | {found} | "
            f"{row['low']:.3f} to {row['high']:.3f} | {row['misfit']:.2g} |"
        )
    return "\n".join(lines) + "\n"
