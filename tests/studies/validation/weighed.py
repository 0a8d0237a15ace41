"""The cloth weighed: twenty flags of other numerics and of MuJoCo, as geometry and, some of them,
filmed.

**Registered** before any truth was simulated (seed, list and aims are this file's), and anew, still
before any was, when recordings came to be weighed by one covariance: half of the truths are
MuJoCo's now, and films last the two minutes that were asked for.

*Truths.* One wind of von Kármán's spectrum blows for two minutes along one log of a cup (1 Hz, lag,
noise, steps of 0.1 m/s), so that one set of simulations serves all truths. Each truth has its own
gain of the log, its own place, size error, bending, stretching and damping. Ten are of the kernel:
fabrics of the catalog on a finer mesh with other diagonals (16 × 11), damped by 0.25 to 20 ms, by
leapfrog below 1 ms and by backward Euler of 0.5 ms above. Ten are of MuJoCo, whose flags cost half
a second of a core a second: isotropic cloth of constant stiffness on 12 × 8, damped by 0.25 to 0.6
ms.

*Procedure*, that of `flagdata calibrate` at its commit: 128 simulations of the design below, of
fabrics drawn evenly; of each observable its mean and its slope with the wind, those that a linear
regression on cloth, place and gain predicts to 0.8 of their spread; the predictive covariance of
their residuals, S/(n − p − k − 1), with what meshes add (`measure.cloth.numerics`) and, of films,
the sigma of pixels; a multivariate t of 10 degrees of freedom; the posterior by an ensemble of
walkers; withheld below a tail probability of 0.01. What is stated is the azimuth (± 7°), the
elevation (± 5°) and the distance (8 m, where it is 7 to 9 m). All are weighed as geometry seen from
their place; those of `FILMED` are filmed by the raster renderer as well, before sky, hills, foliage
or buildings, and weighed from the coded film (`weighed_films`).

Aims: median error of the area weight of films 20 %, 8 of 10 in their intervals of 90 %. A flag
whose weight is withheld or bounded has no error; it counts as a weight that is not given, and their
number is reported beside. The first twenty truths (seed 20261130) were weighed before intervals
became bounds; these are twenty others.

`python -m tests.studies weighed`; the simulations are kept in FLAGDATA_WEIGHED, by default a new
folder, and a run that was stopped goes on.
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

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.json_values import json_values
from flagdata.core.rng import stream
from measure.cloth import (
    MEASURED,
    OBSERVED,
    RATE,
    TABLES,
    CalibrationOptions,
    Design,
    Flag,
    Log,
    Normal,
    Observed,
    Uncertain,
    simulated_values,
)
from measure.cloth.cloth_calibration import answer_of
from measure.cloth.flag_simulation import BATCH, windows
from measure.observables import View
from sim.cloth import handles
from sim.cloth.handles import Handles
from sim.cloth.material import named_material
from sim.cloth.mesh import Diagonals, Mesh, grid
from sim.cloth.scene import Scene, assemble
from sim.effects import AnemometerLag
from sim.integrate import BackwardEuler, Symplectic
from sim.run.simulation_loop import Batch, Divergence, after
from sim.wind import Beyond, Even, SampledWind, VonKarman
from tests.studies.validation import environments
from tests.studies.validation.mujoco.cloth import Air, Method, Sheet, Wind, fly
from tests.studies.validation.mujoco.experiments import NOMINAL
from tests.studies.validation.weighed_films import SIGMA, filmed

Row = dict[str, Any]

SEED = 20261129
TRUTHS = 20
MUJOCO = (1, 3, 4, 6, 9, 11, 12, 14, 16, 18)
FILMED = (0, 2, 3, 5, 7, 9, 11, 13, 16, 19)
WEIGHTS = (0.08, 0.35)  # kg/m²
DURATION = 120.0  # s
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
_GENTLEST = 2.4
"""Of damping of MuJoCo's flags over 0.25 ms: up to it its explicit steps of half a millisecond are
stable."""
_COARSE = (12, 8)
"""Columns and rows of MuJoCo's flags, of which a second takes a second of a core."""
_WIND_RATE = 10.0  # Hz
FLAG = Flag(length=1.5, height=1.0)


def wind() -> tuple[FloatArray, FloatArray]:
    """Times (n,) since the film's first frame [s], and (n, 3) the wind at the anemometer [m/s]."""
    rng = stream(SEED, "weighed", "wind")
    count = round((_BEFORE + DURATION + 2) * _WIND_RATE)
    columns = []
    for ratio, length in ((1.0, _LENGTH), (0.78, _LENGTH / 2), (0.52, _LENGTH / 2)):
        spectrum = VonKarman(mean=_MEAN, intensity=_INTENSITY * ratio, length=length)
        columns.append(
            spectrum.series(rng, duration=count / _WIND_RATE, rate=_WIND_RATE)[:count] - _MEAN
        )
    velocity = np.stack(columns, axis=1)
    velocity[:, 0] += _MEAN
    return np.arange(count) / _WIND_RATE - _BEFORE, velocity


def log() -> Log:
    """What the cup logs of it."""
    times, velocity = wind()
    rng = stream(SEED, "weighed", "cup")
    speed = torch.from_numpy(np.hypot(velocity[:, 0], velocity[:, 1])[:, None])
    lagged = (
        AnemometerLag(distance=float(rng.uniform(1.5, 5.0)))
        .read(torch.from_numpy(times), speed)
        .numpy()[:, 0]
    )
    at = np.arange(-60.0, DURATION + 1.0)
    read = np.interp(at, times, lagged) + 0.05 * rng.standard_normal(len(at))
    return Log(times=at, speed=np.round(read, 1))


def design() -> Design:
    """What is simulated to weigh them."""
    azimuth = Uncertain(name="azimuth", unit="rad", prior=_AZIMUTH, source="stated")
    elevation = Uncertain(name="elevation", unit="rad", prior=_ELEVATION, source="stated")
    return Design(
        flag=FLAG,
        log=log().cut(0.0, DURATION),
        duration=DURATION,
        azimuth=azimuth,
        elevation=elevation,
        count=SIMULATIONS,
        seed=SEED,
        distance=DISTANCE,
    )


def truths() -> list[Mapping[str, Any]]:
    """What each is."""
    order = stream(SEED, "weighed", "order").permutation(TRUTHS)
    fabrics = sorted(TABLES)
    found = []
    for number, place in enumerate(order.tolist()):
        rng = stream(SEED, "weighed", "truth", number)
        (low, high), mujoco = WEIGHTS, number in MUJOCO
        found.append(
            {
                "number": number,
                "code": "mujoco" if mujoco else "kernel",
                "area_weight": low * (high / low) ** ((place + rng.random()) / TRUTHS),
                "fabric": "isotropic" if mujoco else fabrics[int(rng.integers(len(fabrics)))],
                "bending_factor": 0.3 * (4 / 0.3) ** rng.random(),
                "stretching_factor": 0.6 * (1.6 / 0.6) ** rng.random(),
                "damping": 2.5e-4 * (_GENTLEST if mujoco else 80.0) ** rng.random(),
                "gain": 1 + 0.03 * rng.standard_normal(),
                "scale": 1 + 0.01 * rng.standard_normal(),
                "azimuth": float(_AZIMUTH.at(rng.random(1))[0]),
                "elevation": float(_ELEVATION.at(rng.random(1))[0]),
                "distance": rng.uniform(7, 9),
                "seed": int(rng.integers(2**31)),
            }
        )
    return found


def mesh(code: str) -> Mesh:
    """Of the truths of a code."""
    columns, rows = _COARSE if code == "mujoco" else (_COLUMNS, _ROWS)
    return grid(
        width=FLAG.length,
        height=FLAG.height,
        columns=columns,
        rows=rows,
        diagonals=list(Diagonals)[1],
    )


def by_kernel(*, explicit: bool) -> dict[int, FloatArray]:
    """Number → (frame, vertex, 3) at `FILM_RATE` from the film's first frame on [m], of the
    kernel's truths below 1 ms of damping or of the others, simulated together."""
    own = mesh("kernel")
    some = [
        one
        for one in truths()
        if one["code"] == "kernel" and (one["damping"] < _EXPLICIT) == explicit
    ]
    system, state = assemble(
        [_scene(own, truth, damped=0.0 if explicit else _STEP) for truth in some]
    )
    times, velocity = wind()
    blowing = velocity[times >= -_SETTLE - 1e-9]
    samples = torch.as_tensor(
        np.stack([blowing * truth["gain"] for truth in some], axis=-1), dtype=torch.float32
    )
    even = Even(start=0.0, period=1 / _WIND_RATE, count=len(samples))
    system = replace(system, wind=SampledWind(times=even, samples=samples, beyond=Beyond.HOLD))
    integrator = Symplectic() if explicit else BackwardEuler(step=_STEP, tolerance=1e-3)
    batch = Batch(system=system, state=state, integrator=integrator, divergence=Divergence.KEEP)
    together = batch.positions(after(_SETTLE, DURATION, FILM_RATE), FILM_RATE)
    return {truth["number"]: together[..., place] for place, truth in enumerate(some)}


def by_mujoco(truth: Mapping[str, Any]) -> FloatArray:
    """(frame, vertex, 3) of one of MuJoCo's: bending and stretching are the nominal ones by its
    factors."""
    own = mesh("mujoco")
    sheet = Sheet(
        mesh=own,
        held=handles.corners(own.rest),
        area_weight=truth["area_weight"],
        stretching=NOMINAL.stretching * truth["stretching_factor"],
        poisson=NOMINAL.poisson,
        bending=NOMINAL.bending * truth["bending_factor"],
        damping=truth["damping"],
    )
    flat = np.stack([own.rest[:, 0], np.zeros(len(own.rest)), own.rest[:, 1]], axis=1)
    times, velocity = wind()
    flight = fly(
        environments.MUJOCO.find(),
        sheet,
        start=_start(own, truth),
        reference=flat,
        air=Air(),
        method=Method(),
        wind=Wind(times=times, velocity=velocity * truth["gain"]),
        rate=FILM_RATE,
        frames=round(DURATION * FILM_RATE),
        settle=round(_SETTLE * FILM_RATE),
    )
    return flight.positions


def readings(positions: FloatArray, truth: Mapping[str, Any]) -> FloatArray:
    """(window, observable) of a truth seen from its place."""
    view = View(azimuth=truth["azimuth"], elevation=truth["elevation"], distance=truth["distance"])
    every = round(FILM_RATE / RATE)
    return windows(
        positions[::every] * truth["scale"],
        mesh=mesh(truth["code"]),
        flag=FLAG,
        view=view,
        rate=RATE,
        observables=OBSERVED,
    )


def _start(own: Mesh, truth: Mapping[str, Any]) -> FloatArray:
    along = own.rest[:, 0]
    start = np.stack([along * math.cos(0.2), along * math.sin(0.2), own.rest[:, 1]], axis=1)
    rough = np.random.default_rng(truth["seed"]).normal(0.0, 1e-3, start.shape)
    rough[list(handles.corners(own.rest))] = 0.0
    return start + rough


def _scene(own: Mesh, truth: Mapping[str, Any], *, damped: float) -> Scene:
    base = named_material(truth["fabric"])
    material = replace(
        base,
        area_weight=truth["area_weight"],
        bending=base.bending * truth["bending_factor"],
        stretching=base.stretching * truth["stretching_factor"],
        damping=max(truth["damping"] - damped, 0.0),
    )
    held = Handles(vertices=handles.corners(own.rest))
    return Scene(mesh=own, position=_start(own, truth), material=material, handles=held)


def kept(path: Path, make: Callable[[], FloatArray]) -> FloatArray:
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


def simulations(at: Path) -> FloatArray:
    """(simulation, window, observable) of the design."""
    return simulated_values(
        design(), folder=at / "batches", workers=int(os.environ.get("FLAGDATA_WORKERS", "1"))
    )


def positions(truth: Mapping[str, Any], at: Path) -> FloatArray:
    """(frame, vertex, 3) of a truth, from the folder or simulated into it."""
    path = at / f"truth-{truth['number']}.npy"
    if truth["code"] == "mujoco":
        return kept(path, lambda: by_mujoco(truth))
    if not path.exists():
        for number, made in by_kernel(explicit=truth["damping"] < _EXPLICIT).items():
            np.save(at / f"truth-{number}.npy", made)
    return np.load(path)


def geometry(truth: Mapping[str, Any], at: Path) -> FloatArray:
    """(window, observable) of a truth from its place, kept."""
    return kept(
        at / f"geometry-{truth['number']}.npy", lambda: readings(positions(truth, at), truth)
    )


def film(truth: Mapping[str, Any], at: Path) -> FloatArray:
    """The same of its film."""
    own = mesh(truth["code"])
    return kept(
        at / f"film-{truth['number']}.npy", lambda: filmed(truth, positions(truth, at), own, at)
    )


def finer(design: Design) -> tuple[FloatArray, IntArray]:
    """(flag, window, observable) of flags of the fourth to the last batch on a finer mesh, and
    their places in the design's order. Those before have shorter steps."""
    places = np.arange(4 * BATCH, design.count, 4)[:BATCH]
    values, (first, *_) = design.values(), design.batches()
    shared = {name: values[name][places] for name in first.values}
    seen = np.stack(
        [values["azimuth"], values["elevation"], np.full(design.count, design.distance)], axis=1
    )[places]
    seeds = tuple(seed for batch in design.batches() for seed in batch.seeds)
    batch = replace(
        first,
        values=shared,
        places=seen[:, None],
        seeds=tuple(seeds[place] for place in places),
        columns=FINER,
    )
    return batch.read()[:, 0], places


def options() -> CalibrationOptions:
    """What is stated."""
    own = design()
    return CalibrationOptions(
        flag=FLAG,
        azimuth=own.azimuth,
        elevation=own.elevation,
        distance=DISTANCE,
        simulations=own.count,
        seed=SEED,
    )


def weigh(
    name: str,
    found: FloatArray,
    base: FloatArray,
    *,
    sigma: FloatArray,
    truth: Mapping[str, Any],
    of: tuple[Design, CalibrationOptions],
) -> Row:
    """What `measure.cloth` answers to a truth's readings (window, observable).

    Args:
        base: readings of the design's simulations.
        sigma: of the truth's.
        of: the design, and what is stated.
    """
    own, stated = of
    one = Observed(name=name, source="", readings=found, log=own.log, sigma=sigma)
    answer = answer_of([(one, own.values(), base, MEASURED)], stated)
    (fitted,), weight = answer.recordings, answer.weight
    low, high = weight.span.ends()
    return {
        "name": name,
        "truth": truth["area_weight"],
        "value": weight.value,
        "low": low,
        "high": high,
        "bounded": weight.is_bound,
        "misfit": fitted.misfit,
        "withheld": answer.withheld,
        "damping": truth["damping"],
        "code": truth["code"],
        "check": json_values(answer.check),
    }


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Weigh all truths. The design has its own seed."""
    del seed
    at = folder()
    base, of = simulations(at), (design(), options())
    rows, films = [], []
    for truth in truths():
        name = f"truth-{truth['number']}"
        rows.append(
            weigh(
                name, geometry(truth, at), base, sigma=np.zeros(len(OBSERVED)), truth=truth, of=of
            )
        )
        if truth["number"] in FILMED:
            films.append(
                weigh(f"{name}, filmed", film(truth, at), base, sigma=SIGMA, truth=truth, of=of)
            )
    fine, places = finer(design())
    blank = Observed(name="", source="", readings=fine[0], log=design().log)
    change = blank.projection.of(fine) - blank.projection.of(base[places])
    sheet = {
        "mesh": {
            "bias": change.mean(axis=0).tolist(),
            "sigma": change.std(axis=0, ddof=1).tolist(),
        },
        "geometry": {**score(rows), "flags": rows},
        "films": {**score(films), "flags": films},
        "left_out": rows[0]["check"],
        "observables": list(OBSERVED),
        "seconds": DURATION,
    }
    (out / "validate-weighed.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def score(rows: Sequence[Row]) -> dict[str, Any]:
    """Median error of the weights that are given, how many are in their intervals, and how many
    bounds are true."""
    given = [row for row in rows if row["value"] is not None]
    bounds = [row for row in rows if row["bounded"]]
    errors = [abs(row["value"] / row["truth"] - 1) for row in given]
    return {
        "flags": len(rows),
        "withheld": len(rows) - len(given) - len(bounds),
        "median_error": float(np.median(errors)) if errors else None,
        "held": sum(map(_contained, given)),
        "bounds": len(bounds),
        "bounds_held": sum(map(_contained, bounds)),
    }


def _contained(row: Row) -> bool:
    """Decides whether a row's interval contains its truth; an end that is None is infinite."""
    low, high = row["low"], row["high"]
    return (low is None or low <= row["truth"]) and (high is None or row["truth"] <= high)


def page(sheet: Mapping[str, Any]) -> str:
    """The sheet in Markdown."""
    lines = ["# Simulated flags weighed", "", f"{sheet['seconds']:g} s each.", ""]
    lines += [
        (
            "| seen as | flags | nothing | weights | median error | in the 90 % interval | bounds | "
            "true |"
        )
    ]
    lines += ["|---|---|---|---|---|---|---|---|"]
    for name in ("geometry", "films"):
        own = sheet[name]
        error = "" if own["median_error"] is None else f"{own['median_error']:.1%}"
        given = len(own["flags"]) - own["withheld"] - own["bounds"]
        lines.append(
            f"| {name} | {len(own['flags'])} | {own['withheld']} | {given} | {error} | "
            f"{own['held']} | "
            f"{own['bounds']} | {own['bounds_held']} |"
        )
    check, heading = (
        sheet["left_out"],
        "| flag | code | damping [ms] | weight [kg/m²] | found | interval | p |",
    )
    left_out = (
        f"Of {check['count']} simulations left out {check['held']} lie in their intervals, median "
        "error "
    )
    lines += [
        "",
        f"{left_out}{check['median_error']:.1%}.",
        "",
        heading,
        "|---|---|---|---|---|---|---|",
    ]
    for row in (*sheet["geometry"]["flags"], *sheet["films"]["flags"]):
        found = (
            "a bound"
            if row["bounded"]
            else "nothing"
            if row["value"] is None
            else f"{row['value']:.3f}"
        )
        low, high = ("" if row[end] is None else f"{row[end]:.3f}" for end in ("low", "high"))
        misfit = "" if row["misfit"] is None else f"{row['misfit']:.2g}"
        lines.append(
            f"| {row['name']} | {row['code']} | {row['damping'] * 1e3:.2f} | {row['truth']:.3f} | "
            f"{found} | "
            f"{low} to {high} | {misfit} |"
        )
    return "\n".join(lines) + "\n"
