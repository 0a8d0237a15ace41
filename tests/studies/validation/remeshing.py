"""The paper's flag, remeshed while it is simulated, beside ArcSim's run of it: faces, positions and
cost.

The criteria are in docs/decisions/076-remeshing.md. Layers do not meet in the frames that there
are, so that contact is
left out: with it fixed meshes do the same after forty times as long.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import torch
from matplotlib.figure import Figure
from matplotlib.tri import LinearTriInterpolator, Triangulation

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.ingest import read_folder
from sim.arcsim import SWEEPS, read_scene
from sim.cloth.scene import Scene, assemble, flag
from sim.integrate import AirShape, BackwardEuler
from sim.remeshing import remesh_state
from sim.run.simulation_loop import Batch, Divergence
from tests.evidence import ABSENT, REFERENCE

RATE = 25.0
FACES = (0.7, 1.3)
"""Accepted count of faces, of ArcSim's."""
GRIDS = {"grid of 25 cm": 12, "grid of 10 cm": 30}
"""Fixed meshes → columns of 3 m."""
PLACES = np.stack(
    np.meshgrid(np.linspace(0.05, 2.95, 13), np.linspace(0.05, 1.95, 9)), axis=-1
).reshape(-1, 2)
"""(place, 2) on the cloth at which shapes are compared [m]."""

Frame: TypeAlias = tuple[FloatArray, FloatArray, IntArray]
"""Positions (vertex, 3) and rest (vertex, 2) [m], faces (face, 3)."""


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Compares the runs; nothing is drawn by chance, so that the seed is without effect."""
    folder = REFERENCE / "arcsim" / "raw_remeshed"
    if not folder.is_dir():
        return dict(ABSENT)
    torch.set_num_threads(1)
    sequence = read_folder(folder)
    theirs = [
        (
            mesh.positions.astype(np.float64),
            mesh.rest.astype(np.float64),
            mesh.faces.astype(np.int64),
        )
        for mesh in map(sequence.frame, range(len(sequence)))
    ]
    scene = papers_scene()
    ours, cost = simulated(scene, len(theirs))
    fixed = {
        name: simulated(on_grid(scene, columns), len(theirs))[0] for name, columns in GRIDS.items()
    }
    counts = {
        name: [len(faces) for _, _, faces in frames]
        for name, frames in (("arcsim", theirs), ("ours", ours))
    }
    ratios = (np.array(counts["ours"]) / np.array(counts["arcsim"])).tolist()
    positions = compared(theirs, ours, list(fixed.values()))
    draw(theirs, ours, counts, out / "validate-remeshing.png")
    result = {
        "frames": len(theirs) - 1,
        "faces": {
            **counts,
            "ratio": ratios,
            "passed": all(FACES[0] <= ratio <= FACES[1] for ratio in ratios[1:]),
        },
        "positions": positions,
        "cost": cost,
    }
    (out / "validate-remeshing.md").write_text(page(result), encoding="utf-8")
    return result


def papers_scene() -> Scene:
    """The scene of the reference, put together as its user had it, without contact."""
    folder = REFERENCE / "arcsim" / "raw_remeshed"
    with tempfile.TemporaryDirectory() as scratch:
        for kind, file in (
            ("meshes", folder / "flag.obj"),
            ("materials", REFERENCE / "materials" / "camel-ponte-roma.json"),
            (".", folder / "conf.json"),
        ):
            (Path(scratch) / kind).mkdir(exist_ok=True)
            shutil.copy(file, Path(scratch) / kind)
        scene = read_scene(
            Path(scratch) / "conf.json", accept=("collision", "separation", "popfilter")
        ).scene
    return replace(scene, contact=None)


def on_grid(scene: Scene, columns: int) -> Scene:
    """The scene on a mesh that stays."""
    sheet = flag(
        material=scene.material, wind_speed=scene.wind[0], width=3.0, height=2.0, columns=columns
    )
    limits = None if scene.limits is None else replace(scene.limits, sweeps=SWEEPS)
    return replace(
        scene,
        mesh=sheet.mesh,
        position=sheet.position,
        handles=sheet.handles,
        limits=limits,
        remeshing=None,
    )


def simulated(scene: Scene, frames: int) -> tuple[list[Frame], dict[str, Any]]:
    """The frames of a scene, and the seconds that each took, of which remeshing."""
    system, state = assemble([scene], dtype=torch.float64)
    method = BackwardEuler(air_shape=AirShape.PREVIOUS)
    batch = Batch(system=system, state=state, integrator=method, divergence=Divergence.REFUSE)
    kept: list[Frame] = []
    seconds: list[float] = []
    remeshing: list[float] = []
    begun = time.perf_counter()
    for reached in batch.states(range(frames), RATE):
        seconds.append(time.perf_counter() - begun)
        mesh = batch.system.cloth.mesh
        kept.append((reached.position[..., 0].numpy().copy(), mesh.rest, mesh.faces))
        begun = time.perf_counter()
        remesh_state(batch.system, reached)  # once more, for its time
        remeshing.append(time.perf_counter() - begun)
        begun = time.perf_counter()
    cost = {"seconds": sum(seconds), "of_frames": seconds, "remeshing_seconds": sum(remeshing)}
    return kept, cost


def compared(
    theirs: Sequence[Frame], ours: Sequence[Frame], fixed: Sequence[Sequence[Frame]]
) -> dict[str, Any]:
    """Distances, root mean square over the frames after the first [m], and whether ours is within
    the scatter."""
    result: dict[str, Any] = {}
    figures = {
        "centre": centre,
        "droop": lambda frame: centre(frame)[2:],
        "tip": tip,
        "shape": shape,
    }
    for name, figure in figures.items():
        runs = [
            np.array([figure(frame) for frame in frames[1:]]) for frames in (theirs, ours, *fixed)
        ]
        reference, remeshed_, coarse, fine = runs
        scatter = {
            "coarse to arcsim": distance(coarse, reference),
            "fine to arcsim": distance(fine, reference),
            "coarse to fine": distance(coarse, fine),
        }
        off = distance(remeshed_, reference)
        moved = distance(reference, np.broadcast_to(reference[:1], reference.shape))
        result[name] = {
            "off_m": off,
            "scatter_m": scatter,
            "moved_m": moved,
            "passed": off <= max(scatter.values()),
        }
    return result


def distance(first: FloatArray, second: FloatArray) -> float:
    """Root mean square over frames and places of the distance (frame, …, axis)."""
    return float(np.sqrt(((first - second) ** 2).sum(axis=-1).mean()))


def centre(frame: Frame) -> FloatArray:
    """(3,) centre of mass [m]."""
    positions, rest, faces = frame
    (a, b), (c, d) = (rest[faces[:, k]].T - rest[faces[:, 0]].T for k in (1, 2))
    return np.average(positions[faces].mean(axis=1), axis=0, weights=np.abs(a * d - b * c))


def tip(frame: Frame) -> FloatArray:
    """(3,) mean of the two free corners [m]."""
    positions, rest, _ = frame
    corners = [
        int(np.linalg.norm(rest - corner, axis=1).argmin()) for corner in ((3.0, 0.0), (3.0, 2.0))
    ]
    return positions[corners].mean(axis=0)


def shape(frame: Frame) -> FloatArray:
    """(place, 3) positions of `PLACES` of the cloth [m]."""
    positions, rest, faces = frame
    net = Triangulation(rest[:, 0], rest[:, 1], faces)
    return np.stack(
        [LinearTriInterpolator(net, axis)(*PLACES.T).filled(np.nan) for axis in positions.T], axis=1
    )


def page(result: Mapping[str, Any]) -> str:
    """The sheet."""
    faces, cost = result["faces"], result["cost"]
    lines = [
        "# Remeshing while simulating, beside ArcSim 0.2.1",
        "",
        "The paper's flag of 3 × 2 m at 6 m/s, from the same first mesh, without contact.",
        "Criteria: [decision 076](../decisions/076-remeshing.md).",
        "",
        "| frame | ArcSim's faces | ours | ratio | s |",
        "|---|---|---|---|---|",
    ]
    rows = zip(faces["arcsim"], faces["ours"], faces["ratio"], cost["of_frames"], strict=True)
    lines += [
        f"| {n} | {theirs} | {ours} | {ratio:.2f} | {s:.1f} |"
        for n, (theirs, ours, ratio, s) in enumerate(rows)
    ]
    verdict = {True: "met", False: "**not met**"}
    lines += [
        "",
        (
            f"Faces within {FACES[0]} and {FACES[1]} of ArcSim's at every frame: "
            f"{verdict[faces['passed']]}."
        ),
        "",
        "| figure | to ArcSim [mm] | accepted [mm] | moved [mm] | |",
        "|---|---|---|---|---|",
    ]
    for name, row in result["positions"].items():
        accepted = 1e3 * max(row["scatter_m"].values())
        off, moved = 1e3 * row["off_m"], 1e3 * row["moved_m"]
        lines.append(
            f"| {name} | {off:.1f} | {accepted:.1f} | {moved:.0f} | {verdict[row['passed']]} |"
        )
    lines += [
        "",
        f"Cost: {cost['seconds']:.0f} s on one core for {result['frames']} frames.",
        f"Of these, {cost['remeshing_seconds']:.0f} s are remeshing; most are strain limits.",
        "",
        "![Faces over time; both meshes in the cloth's plane and in space](validate-remeshing.png)",
        "",
    ]
    return "\n".join(lines)


def draw(
    theirs: Sequence[Frame], ours: Sequence[Frame], counts: Mapping[str, Sequence[int]], path: Path
) -> None:
    """Draws the counts, and both last meshes: above on the cloth, below from the side."""
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    axes = figure.subplot_mosaic("aabc;aade")
    for (name, values), colour in zip(counts.items(), ("black", "#b5541c"), strict=True):
        axes["a"].plot(
            values, "o-", color=colour, label={"arcsim": "ArcSim 0.2.1", "ours": "flagdata"}[name]
        )
    axes["a"].fill_between(
        range(len(counts["arcsim"])),
        *(np.outer(FACES, counts["arcsim"])),
        color="black",
        alpha=0.08,
        lw=0,
    )
    axes["a"].set(xlabel="frame of 40 ms", ylabel="faces")
    axes["a"].legend(frameon=False)
    for (flat, space), frames, title in (("bd", theirs, "ArcSim"), ("ce", ours, "flagdata")):
        positions, rest, faces = frames[-1]
        axes[flat].triplot(rest[:, 0], rest[:, 1], faces, lw=0.25, color="#444444")
        axes[space].triplot(positions[:, 0], positions[:, 2], faces, lw=0.25, color="#444444")
        axes[flat].set_title(f"{title}, frame {len(frames) - 1}", fontsize=8)
        for name in (flat, space):
            axes[name].set_aspect("equal")
            axes[name].tick_params(labelsize=7)
    figure.savefig(path, dpi=75)
