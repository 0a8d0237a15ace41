"""How flags behave against wind, step and method: curves with their sampling error, beside the reference simulator.

Pictures: the flag at 2, 4, 6, 8 and 10 m/s; droop, speed and frequency of the free edge against wind, for small steps
with declared damping and for backward Euler at the paper's 5 ms; the distance to the reference's runs, frame by frame;
the convergence with the step.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.rng import stream
from sim.integrate.implicit import AirShape, BackwardEuler
from sim.integrate.symplectic import Symplectic, advance
from sim.material import named
from sim.motion import edge_motion
from sim.scene import Scene, assemble, flag

mpl.use("Agg")
import matplotlib.pyplot as plt

FRAME = 0.04
FIRST, FRAMES = 75, 250
WINDS = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
MEMBERS = 16
CAMEL = named("camel-ponte-roma")
RUNS = {
    (0, "0.5 ms"): "flag_w0_dt05",
    (4, "0.5 ms"): "flag_w4_dt05",
    (4, "5 ms"): "flag_w4_dt5",
    (8, "5 ms"): "flag_w8_dt5",
}
QUANTITIES = {"droop": "m below mid-hoist", "speed": "m/s", "frequency": "Hz"}


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Curves, pictures and the numbers behind them."""
    torch.set_num_threads(1)
    with torch.no_grad():
        small = {wind: _edge(wind, Symplectic(), CAMEL, seed) for wind in WINDS}
        paper = {wind: _edge(wind, BackwardEuler(tolerance=1e-4), replace(CAMEL, damping=0.0), seed) for wind in WINDS}
        distances = _distances()
        rates = _step_errors()
    reference = _reference_edges()
    _draw_curves(small, paper, reference, out / "simulator-wind.png")
    _draw_distances(distances, out / "simulator-reference.png")
    _draw_steps(rates, out / "simulator-step.png")
    _draw_flags(seed, out / "simulator-flags.png")
    return {
        "members": MEMBERS,
        "seconds": (FRAMES - FIRST) * FRAME,
        "declared_damping": _summary(small),
        "backward_euler_5_ms": _summary(paper),
        "reference": {f"{wind} m/s, {step} steps": _plain(value) for (wind, step), value in reference.items()},
        "distance_to_reference_mm": {name: [round(1e3 * d, 4) for d in values] for name, values in distances.items()},
        "error_against_step_mm": {f"{1e3 * step:.3f} ms": 1e3 * error for step, error in rates},
    }


def _values(positions: NDArray[np.floating]) -> NDArray[np.float64]:
    """Droop below the middle of the hoist, speed and frequency of an edge (frame, vertex, 3)."""
    motion = edge_motion(positions, rate=1 / FRAME)
    return np.array([0.5 - motion.position[2], motion.speed, motion.frequency])


def _edge_of(scene: Scene) -> NDArray[np.int64]:
    return np.flatnonzero(scene.mesh.rest[:, 0] > scene.mesh.rest[:, 0].max() - 1e-6)


def _edge(wind: float, method: Symplectic | BackwardEuler, material: Any, seed: int) -> NDArray[np.float64]:
    """(member, quantity) of settled flags from noisy starts."""
    scene = flag(material=material, wind_speed=wind)
    noise = stream(seed, "start", round(1000 * wind)).normal(0, 1e-4, (MEMBERS, *scene.position.shape))
    system, state = assemble([replace(scene, position=scene.position + n) for n in noise])
    edge, track = _edge_of(scene), []
    for _ in range(FRAMES):
        state = method.advance(system, state, FRAME)
        track.append(state.position[edge].numpy())
    moving = np.stack(track)[FIRST:]
    return np.stack([_values(moving[..., b]) for b in range(MEMBERS)])


def _folder() -> Path:
    return (
        Path(os.environ.get("FLAGDATA_REFERENCE", Path(__file__).resolve().parents[3] / "shared" / "data")) / "arcsim"
    )


def _reference_edges() -> dict[tuple[int, str], NDArray[np.float64]]:
    edges = {}
    scene = flag(material=CAMEL, wind_speed=4)
    for key, name in RUNS.items():
        path = _folder() / f"{name}.npz"
        if path.is_file() and key[0] > 0:
            with np.load(path) as content:
                edges[key] = _values(content["positions"][FIRST:FRAMES, _edge_of(scene)].astype(np.float64))
    return edges


def _distances() -> dict[str, list[float]]:
    """Mean vertex distance to the reference's runs in the first 40 frames [m]."""
    result = {}
    for (wind, step), name in RUNS.items():
        path = _folder() / f"{name}.npz"
        if not path.is_file():
            continue
        with np.load(path) as content:
            expected = content["positions"].astype(np.float64)
        implicit = step == "5 ms"
        method = BackwardEuler(air_shape=AirShape.PREVIOUS) if implicit else Symplectic()
        material = replace(CAMEL, damping=0.0) if implicit else CAMEL
        system, state = assemble([flag(material=material, wind_speed=wind)], dtype=torch.float64)
        values = []
        for frame in range(1, 41):
            state = method.advance(system, state, FRAME)
            values.append(float(np.linalg.norm(state.position[..., 0].numpy() - expected[frame], axis=1).mean()))
        result[f"{wind} m/s, {step} steps"] = values
    return result


def _step_errors() -> list[tuple[float, float]]:
    """Step [s] and mean error of positions after four frames at 4 m/s against a step of 16 µs [m]."""
    system, start = assemble([flag(material=CAMEL, wind_speed=4, columns=12)], dtype=torch.float64)

    def after(steps: int) -> torch.Tensor:
        state = start
        for _ in range(4):
            state = advance(system, state, FRAME, steps=steps)
        return state.position

    exact = after(2560)
    return [(FRAME / n, float((after(n) - exact).norm(dim=1).mean())) for n in (60, 80, 120, 160, 240, 320, 480, 640)]


def _summary(values: dict[float, NDArray[np.float64]]) -> dict[str, Any]:
    return {
        f"{wind} m/s": {
            name: {"mean": float(v[:, i].mean()), "standard_error": float(v[:, i].std(ddof=1) / np.sqrt(len(v)))}
            for i, name in enumerate(QUANTITIES)
        }
        for wind, v in values.items()
    }


def _plain(value: NDArray[np.float64]) -> dict[str, float]:
    return {name: float(v) for name, v in zip(QUANTITIES, value, strict=True)}


def _draw_curves(
    small: dict[float, NDArray[np.float64]],
    paper: dict[float, NDArray[np.float64]],
    reference: dict[tuple[int, str], NDArray[np.float64]],
    path: Path,
) -> None:
    figure, axes = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
    for i, (axis, (name, unit)) in enumerate(zip(axes, QUANTITIES.items(), strict=True)):
        for label, values, colour in (
            ("small steps, d = 0.25 ms", small, "C0"),
            ("backward Euler, 5 ms", paper, "C1"),
        ):
            mean = np.array([v[:, i].mean() for v in values.values()])
            spread = np.array([v[:, i].std(ddof=1) for v in values.values()])
            axis.errorbar(list(values), mean, yerr=spread, label=label, color=colour, capsize=3)
        for (wind, step), value in reference.items():
            axis.plot(wind, value[i], "s" if step == "0.5 ms" else "D", color="k", mfc="none", label=f"ArcSim, {step}")
        axis.set(xlabel="wind [m/s]", ylabel=f"{name} of the free edge [{unit}]")
    handles, labels = axes[0].get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    axes[0].legend(unique.values(), unique.keys())
    figure.suptitle(
        f"flag 1.5 m × 1 m, 651 vertices; {MEMBERS} starts of {(FRAMES - FIRST) * FRAME:.0f} s, bars ±1 σ of one run"
    )
    figure.savefig(path, dpi=120)
    plt.close(figure)


def _draw_distances(distances: dict[str, list[float]], path: Path) -> None:
    figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
    for name, values in distances.items():
        axis.semilogy(range(1, len(values) + 1), 1e3 * np.array(values), label=name)
    axis.plot([1, 5, 5, 10], [5, 5, 15, 15], "k--", lw=1, label="acceptance")
    axis.set(xlabel="frame of 40 ms", ylabel="mean vertex distance to ArcSim [mm]")
    axis.legend()
    figure.savefig(path, dpi=120)
    plt.close(figure)


def _draw_steps(rates: list[tuple[float, float]], path: Path) -> None:
    figure, axis = plt.subplots(figsize=(5, 4), layout="constrained")
    steps, errors = np.array(rates).T
    axis.loglog(1e3 * steps, 1e3 * errors, "o-", label="leapfrog, 4 m/s, frame 4")
    axis.loglog(1e3 * steps, 1e3 * errors[0] * (steps / steps[0]), "k:", label="first order")
    axis.loglog(1e3 * steps, 1e3 * errors[0] * (steps / steps[0]) ** 2, "k--", label="second order")
    axis.set(xlabel="step [ms]", ylabel="mean vertex error [mm]")
    axis.legend()
    figure.savefig(path, dpi=120)
    plt.close(figure)


def _draw_flags(seed: int, path: Path) -> None:
    winds = (2.0, 4.0, 6.0, 8.0, 10.0)
    scenes = [flag(material=CAMEL, wind_speed=wind) for wind in winds]
    noise = stream(seed, "start", "pictures").normal(0, 1e-4, (len(winds), *scenes[0].position.shape))
    system, state = assemble([replace(s, position=s.position + n) for s, n in zip(scenes, noise, strict=True)])
    for _ in range(125):
        state = Symplectic().advance(system, state, FRAME)
    figure = plt.figure(figsize=(15, 3.6), layout="constrained")
    for b, wind in enumerate(winds):
        axis: Any = figure.add_subplot(1, len(winds), b + 1, projection="3d")
        x, y, z = state.position[..., b].numpy().T
        axis.plot_trisurf(x, y, z, triangles=scenes[b].mesh.faces, color="tab:red", edgecolor="k", lw=0.1)
        axis.set(title=f"{wind:.0f} m/s", xlim=(0, 1.5), ylim=(-0.75, 0.75), zlim=(-1.0, 1.0))
        axis.set_box_aspect((1.5, 1.5, 2.0))
        axis.view_init(elev=15, azim=-70)
        axis.set_axis_off()
    figure.savefig(path, dpi=120)
    plt.close(figure)
