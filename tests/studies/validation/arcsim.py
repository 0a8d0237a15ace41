"""Beside ArcSim 0.2.1: its runs of the same flag, where the folder of reference data is there.

Vertex by vertex while the motion is predictable, then in the statistics of replicates.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.rng import stream
from sim.cloth.scene import assemble, flag
from sim.integrate import AirShape, BackwardEuler, Integrator, Symplectic
from tests.evidence import ABSENT, REFERENCE
from tests.studies.validation.flags_runs import CAMEL, one_core
from tests.verification.motion import edge_motion

RATE = 25.0
RUNS = {
    ("0.5 ms", 0.0): "flag_w0_dt05",
    ("0.5 ms", 4.0): "flag_w4_dt05",
    ("5 ms", 0.0): "flag_w0_dt5",
    ("5 ms", 4.0): "flag_w4_dt5",
    ("5 ms", 8.0): "flag_w8_dt5",
}
SHORT = 25
"""Frames in which vertices are compared one by one: later the motion is chaotic."""
FIRST, LAST = 50, 151
"""Frames of the statistics: the length of the shorter reference runs."""
DAMPINGS = (0.0, 0.1e-3, 0.25e-3, 0.5e-3)
REPLICATES = 16
NOISE = {True: (1e-4, torch.float32), False: (1e-9, torch.float64)}
"""Of the starts [m], and the precision, whether there is wind. In wind the noise is forgotten.
Without, a flag falls in its plane until noise folds it, and the sooner that is, the less motion is
left: the reference starts without any."""
ACCEPTANCE = {5: 5e-3, 10: 15e-3}
"""Through these frames, the mean vertex distance accepted [m]."""


@dataclass(frozen=True, kw_only=True)
class ReferenceMotion:
    """One run of the reference: its wind [m/s], step, and (5,) statistics as `Ensemble.statistics`
    has them."""

    wind: float
    step: str
    statistics: FloatArray


def folder() -> Path | None:
    """Where the reference runs are; None where they are absent."""
    runs = REFERENCE / "arcsim"
    return runs if all((runs / f"{name}.npz").is_file() for name in RUNS.values()) else None


def _positions(runs: Path, name: str) -> FloatArray:
    with np.load(runs / f"{name}.npz") as content:
        return content["positions"].astype(np.float64)


def _edge() -> IntArray:
    rest = flag(material=CAMEL, wind_speed=0.0).mesh.rest
    return np.flatnonzero(rest[:, 0] > rest[:, 0].max() - 1e-6)


def _statistics(edge: NDArray[np.floating]) -> FloatArray:
    motion = edge_motion(edge, rate=RATE)
    return np.array([*motion.position, motion.speed, motion.frequency])


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Distances, statistics and their picture; what is missing where the reference runs are."""
    runs = folder()
    if runs is None:
        return dict(ABSENT)
    with one_core():
        result = {"mean_vertex_distance_m": distances(runs), "settled": settled(runs, seed)}
    draw_reference(result["mean_vertex_distance_m"], result["settled"], out / "validate-arcsim.png")
    return result


def motions(runs: Path) -> list[ReferenceMotion]:
    """The reference's free edge, over all frames from 2 s on that a run has."""
    return [
        ReferenceMotion(
            wind=wind, step=step, statistics=_statistics(_positions(runs, name)[FIRST:, _edge()])
        )
        for (step, wind), name in RUNS.items()
    ]


def distances(runs: Path) -> dict[str, dict[str, list[float | None]]]:
    """Mean vertex distance to the reference, run → method → frame 1 … `SHORT` [m]; None where ours
    has diverged.

    The 0.5 ms runs are followed with leapfrog, the 5 ms runs with backward Euler.
    """
    result: dict[str, dict[str, list[float | None]]] = {}
    for wind in (0.0, 4.0):
        expected = _positions(runs, RUNS["0.5 ms", wind])
        label = f"0.5 ms, {wind:g} m/s"
        result[label] = {}
        for damping in DAMPINGS:
            gaps = _gaps(expected, wind, damping, Symplectic())
            result[label][f"d = {1e3 * damping:g} ms"] = gaps
        result[label]["moved so far"] = _travel(expected)
    for wind in (0.0, 4.0, 8.0):
        expected = _positions(runs, RUNS["5 ms", wind])
        label = f"5 ms, {wind:g} m/s"
        result[label] = {
            f"air at the {shape.value} shape": _gaps(
                expected, wind, 0.0, BackwardEuler(air_shape=shape)
            )
            for shape in (AirShape.PREVIOUS, AirShape.CURRENT)
        }
        result[label]["moved so far"] = _travel(expected)
    return result


def _gaps(
    expected: FloatArray, wind: float, damping: float, method: Integrator
) -> list[float | None]:
    scene = flag(material=replace(CAMEL, damping=damping), wind_speed=wind)
    system, state = assemble([scene], dtype=torch.float64)
    gaps: list[float | None] = []
    for frame in range(1, SHORT + 1):
        state = method.advance(system, state, 1 / RATE)
        gap = float(np.linalg.norm(state.position[..., 0].numpy() - expected[frame], axis=1).mean())
        gaps.append(gap if bool(state.healthy()) else None)
    return gaps


def _travel(expected: FloatArray) -> list[float | None]:
    return np.linalg.norm(expected[1 : SHORT + 1] - expected[0], axis=2).mean(axis=1).tolist()


def settled(runs: Path, seed: int) -> dict[str, Any]:
    """Replicates of the reference's runs, over the same frames: name → quantity → ours, theirs."""
    pairs = (("0.5 ms", 4.0), ("5 ms", 0.0), ("5 ms", 4.0), ("5 ms", 8.0))
    return {f"{step}, {wind:g} m/s": _replicated(runs, step, wind, seed) for step, wind in pairs}


def _replicated(runs: Path, step: str, wind: float, seed: int) -> dict[str, Any]:
    small = step == "0.5 ms"
    method = Symplectic() if small else BackwardEuler(air_shape=AirShape.PREVIOUS, tolerance=1e-4)
    scene = flag(material=CAMEL if small else replace(CAMEL, damping=0.0), wind_speed=wind)
    size, dtype = NOISE[wind > 0]
    generator = stream(seed, "validate-flags", "reference", step, f"{wind:g}")
    noise = generator.normal(0, size, (REPLICATES, *scene.position.shape))
    system, state = assemble(
        [replace(scene, position=scene.position + n) for n in noise], dtype=dtype
    )
    edge, track = _edge(), []
    for _ in range(LAST):
        track.append(state.position[edge].numpy())
        state = method.advance(system, state, 1 / RATE)
    ours = np.array([_statistics(np.stack(track)[FIRST:, ..., b]) for b in range(REPLICATES)])
    return _compared(ours, _statistics(_positions(runs, RUNS[step, wind])[FIRST:LAST, edge]))


def _compared(ours: FloatArray, theirs: FloatArray) -> dict[str, Any]:
    rows: dict[str, Any] = {
        "position_off_m": float(np.linalg.norm(ours[:, :3].mean(0) - theirs[:3])),
        "position_deviation_m": float(np.linalg.norm(ours[:, :3].std(0, ddof=1))),
        "replicates": len(ours),
    }
    for index, name in enumerate(("x", "y", "z", "speed", "frequency")):
        rows[name] = {"reference": float(theirs[index]), "runs": ours[:, index].tolist()}
    for name in ("speed", "frequency"):
        runs = np.array(rows[name]["runs"])
        rows[name]["off"] = float(runs.mean() / rows[name]["reference"] - 1)
        rows[name]["deviation"] = float(runs.std(ddof=1) / rows[name]["reference"])
    return rows


def draw_reference(
    gaps: Mapping[str, Mapping[str, list[float | None]]], compared: Mapping[str, Any], path: Path
) -> None:
    """Above: vertex distances against frame. Below: settled statistics of replicates, and the
    reference's one run."""
    figure = Figure(figsize=(12.5, 7.4), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=(1.25, 1))
    for axes, (run, methods) in zip(upper.subplots(1, 5, sharey=True), gaps.items(), strict=True):
        for (name, values), colour in zip(methods.items(), _colours(methods), strict=True):
            style = ":" if name.startswith("moved") else "-"
            axes.semilogy(
                range(1, SHORT + 1),
                1e3 * np.array(values, dtype=np.float64),
                style,
                color=colour,
                lw=1.2,
                label=name,
            )
        start = 1
        for frame, band in ACCEPTANCE.items():
            axes.plot([start, frame], [1e3 * band] * 2, color="black", lw=2)
            start = frame
        axes.set(
            xlabel="frame of 40 ms",
            title=f"ArcSim {run};\n{'leapfrog' if run.startswith('0.5') else 'backward Euler'}",
            xlim=(0, SHORT),
            ylim=(1e-5, 3e3),
        )
        axes.title.set_fontsize(9)
        axes.legend(frameon=False, fontsize=6.5, loc="lower right")
    upper.axes[0].set_ylabel("mean vertex distance [mm]\n(bars: accepted)")
    panels = lower.subplots(1, 5)
    labels = {
        "x": "mean x (downwind) [m]",
        "y": "mean y (across) [m]",
        "z": "mean z (up) [m]",
        "speed": "mean |v| [m/s]",
        "frequency": "frequency [Hz]",
    }
    for axes, (name, label) in zip(panels, labels.items(), strict=True):
        for place, rows in enumerate(compared.values()):
            values = np.array(rows[name]["runs"])
            axes.plot(np.full(len(values), place), values, ".", color="#b5541c", alpha=0.4)
            axes.errorbar(
                place + 0.15,
                values.mean(),
                yerr=values.std(ddof=1),
                fmt="o",
                color="#b5541c",
                ms=4,
                capsize=3,
                label="replicates" if not place else None,
            )
            axes.plot(
                place - 0.15,
                rows[name]["reference"],
                "D",
                color="black",
                mfc="none",
                label="ArcSim, its one run" if not place else None,
            )
            band = {"speed": 0.15, "frequency": 0.20}.get(name)
            half = band * rows[name]["reference"] if band else 0.05
            axes.plot(
                [place - 0.15] * 2,
                [rows[name]["reference"] - half, rows[name]["reference"] + half],
                "k-",
                lw=0.8,
            )
        axes.set(ylabel=f"free edge, {label}", xlim=(-0.5, len(compared) - 0.5))
        axes.set_xticks(
            range(len(compared)), [run.replace(", ", "\n") for run in compared], fontsize=8
        )
    panels[3].legend(frameon=False, fontsize=8)
    lower.suptitle(
        f"Settled, frames {FIRST} to {LAST - 1}, {REPLICATES} starts with 0.1 mm of noise (1 nm "
        "without wind); black "
        "bars: accepted (5 cm, 15 %, 20 %), coloured: standard deviation of one run",
        fontsize=9,
    )
    upper.suptitle(
        "The same flag, mesh, material and wind; contact and strain limits off", fontsize=10
    )
    figure.savefig(path, dpi=95)


def _colours(methods: Mapping[str, Any]) -> list[str]:
    palette = (
        ["#999999", "#6a8f3c", "#b5541c", "#1f5f8b", "#444444"]
        if len(methods) == 5
        else ["#b5541c", "#1f5f8b", "#444444"]
    )
    return palette[: len(methods)]
