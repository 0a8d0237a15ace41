"""Null experiments as a field brings them: what is no effect of the cloth must not reject the base
model.

A flag of 1.5 m × 1.0 m with 70 markers, in three winds of 4, 5 and 6 m/s that fluctuate by 11 %
along their mean, is simulated by the base model on other meshes and by other steps, with density,
bending, stretching and damping that differ from the declared ones. The recordings are then made
worse by one thing each: a log of 1 Hz, a clock that is off, a wrong direction, markers that were
not tracked, more or coloured noise, another frame rate. In two more cases the
simulation itself differs: the cloth is of another material than the declared one, or the turbulence
has three components. Turbulence that a log does not hold is an effect of the library, and is
rightly reported as gusts.

Environment variables: FLAGDATA_STRESSORS (how many nulls of each kind), FLAGDATA_STRESSORS_FOLDER
(where banks, recordings and verdicts are kept; a run that was stopped goes on there).
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import torch
from scipy.signal import lfilter

from flagdata.answer import Quantity
from flagdata.core.arrays import FloatArray
from flagdata.core.json_values import json_values
from flagdata.core.rng import child_seed, stream
from flagdata.errors import InputError
from measure.cloth import TABLES
from measure.forecasting import Setting
from measure.loop import LoopOptions, solve
from measure.nulls import NullBatch, StiffnessFactors, batches
from measure.nulls import bank as banks
from measure.trajectories import (
    Experiment,
    Hold,
    Observation,
    Setup,
    Specimen,
    WindTrack,
    from_arrays,
    observe,
    sheet,
)
from measure.verdict import CRITERIA
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from sim.wind import VonKarman
from tests.studies.shares import Share
from tests.studies.validation.flags_runs import CAMEL

WIDTH, HEIGHT = 1.5, 1.0
SPEEDS = (4.0, 5.0, 6.0)
DURATION = 8.8
RATE, LOG_RATE = 100, 10
VERTICES = 96
ACROSS_MARKERS = 10
INTENSITY, LENGTH = 0.11, 20.0
ACROSS, UPWARD = 0.8, 0.5
"""Deviations of the wind across its mean and upward, over that along it (EN 1991-1-4
literature)."""
NOISE = 1e-3
_COUNT = 40
_SETTLED = 3.5
"""s before the first frame from which winds blow: a simulation begins there."""


@dataclass(frozen=True, kw_only=True)
class Truth:
    """A simulated null.

    Attributes:
        positions: (recording, frame, marker, 3) at 100 Hz, without noise [m].
        winds: (recording, sample, 3) at 10 Hz from `_SETTLED` before the first frame [m/s].
        parameters: density and bending as shares of the declared ones, damping [s].
    """

    positions: FloatArray
    winds: FloatArray
    parameters: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class Recorded:
    """What a user would bring of one recording: markers, their stated noise [m], and a log."""

    positions: FloatArray
    rate: float
    wind: WindTrack
    noise: float = NOISE


Stressor = Callable[[Truth, int, np.random.Generator], Recorded]


def _recorded(
    truth: Truth,
    index: int,
    rng: np.random.Generator,
    *,
    rate: int = 25,
    noise: float = NOISE,
    late: float = 0.0,
    turned: float = 0.0,
    log: float = 0.0,
) -> Recorded:
    """One recording at a frame rate, with white noise, a log that is late [s], turned [rad] or
    averaged [s]."""
    seen = truth.positions[index, :: RATE // rate]
    seen = seen + noise * rng.standard_normal(seen.shape)
    times = np.arange(len(truth.winds[index])) / LOG_RATE - _SETTLED
    wind = truth.winds[index]
    if log:
        every = round(log * LOG_RATE)
        count = len(wind) // every
        wind = wind[: count * every].reshape(count, every, 3).mean(axis=1)
        times = times[: count * every].reshape(count, every).mean(axis=1)
    cos, sin = math.cos(turned), math.sin(turned)
    wind = wind @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return Recorded(
        positions=seen, rate=rate, wind=WindTrack(times=times + late, velocity=wind), noise=noise
    )


def _lost(truth: Truth, index: int, rng: np.random.Generator, *, run: int) -> Recorded:
    """A twentieth of the markers' places lost, each time for so many frames."""
    made = _recorded(truth, index, rng)
    seen = made.positions.copy()
    frames, markers, _ = seen.shape
    starts = rng.random((math.ceil(frames / run), markers)) < 0.05
    seen[np.repeat(starts, run, axis=0)[:frames]] = np.nan
    return replace(made, positions=seen)


def _coloured(truth: Truth, index: int, rng: np.random.Generator) -> Recorded:
    """Noise of 1 mm that is correlated over 0.2 s (first order)."""
    made = replace(_recorded(truth, index, rng, noise=0.0), noise=NOISE)
    kept = math.exp(-1 / (0.2 * made.rate))
    white = rng.standard_normal((100 + len(made.positions), *made.positions.shape[1:]))
    slow = np.asarray(lfilter([math.sqrt(1 - kept**2)], [1, -kept], white, axis=0))[100:]
    return replace(made, positions=made.positions + NOISE * slow)


def _with(**given: Any) -> Stressor:
    return lambda truth, index, rng: _recorded(truth, index, rng, **given)


STRESSORS: Mapping[str, Stressor] = {
    "none": _with(),
    "log of 1 Hz": _with(log=1.0),
    "log late by 0.5 s": _with(late=0.5),
    "log early by 0.5 s": _with(late=-0.5),
    "direction off by 5°": _with(turned=math.radians(5)),
    "direction off by −5°": _with(turned=-math.radians(5)),
    "5 % of markers lost at random": lambda t, i, rng: _lost(t, i, rng, run=1),
    "5 % of markers lost in runs of 0.4 s": lambda t, i, rng: _lost(t, i, rng, run=10),
    "noise of 7 mm": _with(noise=7e-3),
    "coloured noise": _coloured,
    "10 Hz": _with(rate=10),
    "100 Hz": _with(rate=100),
    "another material": _with(),
    "turbulence of three components, log of 10 Hz": _with(),
    "turbulence of three components, log of 1 Hz": _with(log=1.0),
}
_OTHER, _TURBULENT = "another material", "turbulence of three components"
_BANKS = {"noise of 7 mm": "noise of 7 mm", "10 Hz": "10 Hz"}
"""Stressors that are judged by nulls of their own, as a user's design has them; all others by those
of `none`."""


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Verdicts on all nulls, and how many were rejected."""
    count = int(os.environ.get("FLAGDATA_STRESSORS", _COUNT))
    with TemporaryDirectory(prefix="flagdata-stressors-") as temporary:
        folder = Path(os.environ.get("FLAGDATA_STRESSORS_FOLDER", temporary))
        for name in dict.fromkeys(_BANKS.get(stressor, "none") for stressor in STRESSORS):
            first = experiment(_truth(folder, "", 0, seed), name, seed)
            wanted = batches(
                Setting.of(first),
                kinds=CRITERIA.simulated_kinds,
                seed=child_seed(seed, "bank", name),
            )
            banks.build(_bank(folder, name), wanted, workers=len(os.sched_getaffinity(0)))
        judged = partial(_rows, folder, seed)
        with ProcessPoolExecutor(
            len(os.sched_getaffinity(0)), mp_context=get_context("spawn")
        ) as pool:
            rows = [row for own in pool.map(judged, range(count)) for row in own]
    found = {
        "nulls": count,
        "stressors": summary(rows),
        "experiments": rows,
        "criteria": json_values(CRITERIA),
    }
    (out / "validate-stressors.md").write_text(page(found), encoding="utf-8")
    return found


def _bank(folder: Path, name: str) -> Path:
    return folder / f"nulls-{list(STRESSORS).index(name):02d}"


def _rows(folder: Path, seed: int, number: int) -> list[dict[str, Any]]:
    """Verdicts on one null by all stressors, one after another: most of them are of the same
    simulation."""
    torch.set_num_threads(1)
    return [_row(folder, stressor, number, seed) for stressor in STRESSORS]


def _row(folder: Path, stressor: str, number: int, seed: int) -> dict[str, Any]:
    """A verdict on one null, from its file where it was made before."""
    kept = folder / f"row-{list(STRESSORS).index(stressor):02d}-{number:02d}.json"
    if not kept.exists():
        case = (
            _OTHER if stressor == _OTHER else _TURBULENT if stressor.startswith(_TURBULENT) else ""
        )
        truth = _truth(folder, case, number, seed)
        bank = _bank(folder, _BANKS.get(stressor, "none"))
        kept.write_text(json.dumps(_judged(truth, stressor, number, seed, bank)), encoding="utf-8")
    return json.loads(kept.read_text(encoding="utf-8"))


def _judged(truth: Truth, stressor: str, number: int, seed: int, bank: Path) -> dict[str, Any]:
    row: dict[str, Any] = {"stressor": stressor, "number": number, "true": dict(truth.parameters)}
    try:
        found = solve(
            experiment(truth, stressor, child_seed(seed, "noise", number)),
            LoopOptions(bank=bank, seed=seed),
        )
    except InputError as error:
        return {**row, "refused": str(error)}
    verdict = found.verdict
    test = verdict.test
    return {
        **row,
        "said": verdict.conclusion.value,
        "named": list(verdict.named),
        "p": test.p_value.point,
        "statistic": test.statistic,
        "rejected": test.p_value.point <= test.level,
        "lags": list(found.lags),
        "seconds": verdict.seconds,
        "covered": {
            p.name: _holds(p.after or p.before, truth.parameters[p.name])
            for p in verdict.parameters
            if p.name in truth.parameters
        },
    }


def _holds(estimate: Quantity, true: float) -> bool:
    return bool(estimate.low <= true <= estimate.high)


def experiment(
    truth: Truth, stressor: str, seed: int, *, across: int = ACROSS_MARKERS
) -> Experiment:
    """What a user would bring, read as it would be.

    Args:
        across: markers along the flag, as the truth has them.
    """
    rng = stream(seed, stressor, "recorded")
    seen = [STRESSORS[stressor](truth, index, rng) for index in range(len(SPEEDS))]
    setup = Setup(
        material=CAMEL, outline=sheet(WIDTH, HEIGHT), pins=Hold.HOIST_CORNERS, vertices=VERTICES
    )
    rest = markers(across)
    observations = [
        _observation(made, speed, rest) for made, speed in zip(seen, SPEEDS, strict=True)
    ]
    return observe(observations, setup).experiment


def _observation(made: Recorded, speed: float, rest: FloatArray) -> Observation:
    return from_arrays(
        name=f"{speed:g} m-s",
        positions=made.positions,
        rest=rest,
        rate=made.rate,
        wind=made.wind,
        noise=made.noise,
    )


def markers(across: int = ACROSS_MARKERS) -> FloatArray:
    """(70, 2) rest coordinates [m], up to the edges, or with so many along the flag as many as are
    needed."""
    rows = round(across * 7 / ACROSS_MARKERS)
    grid_of = np.meshgrid(
        np.linspace(0, WIDTH, across), np.linspace(0, HEIGHT, rows), indexing="ij"
    )
    return np.stack(grid_of, axis=-1).reshape(-1, 2)


def _truth(folder: Path, case: str, number: int, seed: int) -> Truth:
    """A simulated null, from its file where it was made before."""
    kept = folder / f"truth-{case.replace(' ', '-') or 'plain'}-{number:02d}.npz"
    if not kept.exists():
        folder.mkdir(parents=True, exist_ok=True)
        made = simulated(case, number, seed)
        part = kept.with_suffix(f".{os.getpid()}.npz")
        np.savez(part, positions=made.positions, winds=made.winds, **made.parameters)  # pyright: ignore
        part.replace(kept)
    with np.load(kept) as content:
        parts = {name: content[name] for name in content.files}
    positions, winds = parts.pop("positions"), parts.pop("winds")
    return Truth(
        positions=positions,
        winds=winds,
        parameters={name: float(value) for name, value in parts.items()},
    )


def simulated(case: str, number: int, seed: int, *, across: int = ACROSS_MARKERS) -> Truth:
    """A null, by numerics and cloth drawn by its number.

    Args:
        case: "", or another material or turbulence.
        across: markers along the flag.
    """
    rng = stream(seed, "stressors", case, "truth", number)
    material, parameters = CAMEL, {}
    if case == _OTHER:
        other = named_material(
            str(
                rng.choice(
                    [name for name in sorted((*TABLES, "aluminium", "paper")) if name != CAMEL.name]
                )
            )
        )
        material = replace(
            other.scaled(area_weight=CAMEL.area_weight / other.area_weight), damping=CAMEL.damping
        )
    flat = grid(width=WIDTH, height=HEIGHT, columns=11, rows=7)
    ends = [
        int(np.argmin(np.linalg.norm(flat.rest - corner, axis=1)))
        for corner in ((0.0, 0.0), (0.0, HEIGHT))
    ]
    specimen = Specimen(
        mesh=flat,
        material=material,
        held=tuple(ends),
        anchors=np.array([[0.0, 0.0, 0.0], [0.0, 0.0, HEIGHT]]),
    )
    drawn = banks.prior_batch(
        specimen,
        markers=markers(across),
        rate=RATE,
        duration=DURATION,
        noise=0.0,
        speeds=(SPEEDS[0], SPEEDS[-1]),
        seed=child_seed(seed, "stressors", case, number),
    )
    winds = np.stack([_wind(speed, rng, turbulent=case == _TURBULENT) for speed in SPEEDS])
    times = np.arange(winds.shape[1]) / LOG_RATE - _SETTLED
    batch: NullBatch = replace(
        drawn,
        stiffness=StiffnessFactors(stretching=drawn.stiffness.stretching),
        speeds=SPEEDS,
        calibrations=drawn.calibrations[: len(SPEEDS)],
        winds=tuple(WindTrack(times=times, velocity=wind) for wind in winds),
    )
    own = batch.calibrations[0]
    parameters = {"area_weight": own.area_weight, "damping": own.damping}
    if case != _OTHER:
        parameters["bending"] = own.bending
    positions = np.stack([recording.positions for recording in batch.simulate()])
    return Truth(positions=positions, winds=winds, parameters=parameters)


def _wind(speed: float, rng: np.random.Generator, *, turbulent: bool) -> FloatArray:
    """(sample, 3) from before the first frame to behind the last [m/s]."""
    duration = _SETTLED + DURATION + 1.5
    along = VonKarman(mean=speed, intensity=INTENSITY, length=LENGTH).series(
        rng, duration=duration, rate=LOG_RATE
    )
    rest = np.zeros((2, len(along)))
    if turbulent:
        for place, share in enumerate((ACROSS, UPWARD)):
            spectrum = VonKarman(mean=speed, intensity=share * INTENSITY, length=LENGTH / 2)
            rest[place] = spectrum.series(rng, duration=duration, rate=LOG_RATE) - speed
    return np.stack([along, *rest], axis=-1)


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Of each stressor how many were rejected and refused, what was named, and how often intervals
    cover."""
    results: dict[str, Any] = {}
    for name in dict.fromkeys(row["stressor"] for row in rows):
        own = [row for row in rows if row["stressor"] == name]
        judged = [row for row in own if "refused" not in row]
        wrong = [row for row in judged if row["rejected"]]
        covered = [held for row in judged for held in row["covered"].values()]
        share = Share.of((row["rejected"] for row in judged), level=0.9)
        results[name] = {
            "judged": len(judged),
            "refused": len(own) - len(judged),
            "rejected": len(wrong),
            "bound_95": share.high,
            "gusts": sum(row["named"] == ["gusts"] for row in wrong),
            "named": sorted({effect for row in wrong for effect in row["named"]}),
            "p": [float(v) for v in np.quantile([row["p"] for row in judged], [0.1, 0.5, 0.9])]
            if judged
            else [],
            "covered": sum(covered),
            "intervals": len(covered),
            "seconds": float(np.median([row["seconds"] for row in judged])) if judged else None,
        }
    return results


def page(found: Mapping[str, Any]) -> str:
    """The sheet."""
    said = (
        f"{found['nulls']} simulated null experiments of each kind, of 70 markers in three winds, "
        "judged by 40 kinds "
        "of nulls in steady winds. Three of 40 rejected are what the plan allows. Where the log "
        "does not hold the "
        "turbulence, gusts are the right name."
    )
    heads = (
        "what is worse",
        "judged",
        "refused",
        "rejected (upper bound of 95 %)",
        "of them gusts",
        "named",
        "p, deciles 1, 5 and 9",
        "intervals of 90 % that cover",
        "s",
    )
    lines = [
        "# Nulls as a field brings them",
        "",
        said,
        "",
        _line(heads),
        _line(["---"] * len(heads)),
    ]
    for name, own in found["stressors"].items():
        p = ", ".join(f"{value:.2f}" for value in own["p"])
        seconds = "" if own["seconds"] is None else f"{own['seconds']:.0f}"
        cells = (
            name,
            own["judged"],
            own["refused"],
            f"{own['rejected']} ({own['bound_95']:.2f})",
            own["gusts"],
            ", ".join(own["named"]),
            p,
            f"{own['covered']} of {own['intervals']}",
            seconds,
        )
        lines.append(_line(cells))
    return "\n".join([*lines, ""])


def _line(cells: Iterable[object]) -> str:
    return f"| {' | '.join(str(cell) for cell in cells)} |"
