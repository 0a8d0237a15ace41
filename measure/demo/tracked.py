"""A tracked flag as a user would bring it: a table of markers from three winds, and a recipe that
says what is known.

What acts on the cloth beside the base model is drawn here and written nowhere but into the returned
`Tracks`, so that closing the loop can be compared with it. Mesh, step and method are none of those
that the fit uses.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.errors import InputError
from measure.trajectories.interpolation import onto
from sim.cloth import handles
from sim.cloth.handles import Handles
from sim.cloth.material import named_material
from sim.cloth.mesh import Diagonals, Mesh, grid
from sim.cloth.scene import Scene, assemble, roughen_start
from sim.effects import EFFECTS, apply
from sim.integrate.symplectic import Symplectic
from sim.run.simulation_loop import Batch, Divergence, after

MATERIAL = "camel-ponte-roma"
_OUTER = 2e-3  # s, time step of the force beside the base model
_ROUGH = 2e-3  # m, standard deviation of the free vertices' start
RECIPE = """\
title = "tracked"

[cloth]
width = {width}
height = {height}
vertices = {vertices}

[material]
name = "{material}"

[attachment]
at = "hoist-corners"
{recordings}"""
_RECORDING = """
[[recording]]
source = "tracks.csv"
take = "{name}"
rate = {rate:g}
noise = {noise:g}
wind = {{ speed = {speed:g} }}
"""


@dataclass(frozen=True, kw_only=True)
class TrackedRecipe:
    """The experiment that is simulated.

    Attributes:
        seed: root of all random streams.
        effect, parameter, strength: what acts on the cloth and is not in the recipe file.
        speeds: of the wind, one a recording [m/s].
        duration: of each recording [s], after `settle` [s] that are not kept.
        rate: of the cameras [Hz].
        noise: standard deviation of a marker's coordinate [m].
        width, height: of the flag [m].
        area_weight, bending: of the cloth, as factors on the catalog's; hidden from the fit.
        damping: of the cloth [s].
        vertices: of the mesh that the fit must use.
    """

    seed: int
    effect: str = "lift"
    parameter: str = "coefficient"
    strength: float = 2.0
    speeds: tuple[float, ...] = (4.0, 5.5, 7.0)
    duration: float = 6.0
    settle: float = 3.0
    rate: float = 25.0
    noise: float = 5e-4
    width: float = 0.9
    height: float = 0.6
    area_weight: float = 1.1
    bending: float = 0.8
    damping: float = 8e-4
    vertices: int = 90

    def __post_init__(self) -> None:
        if self.duration < 5 or not self.speeds or min(self.speeds) <= 0:
            raise InputError(
                f"recordings of {self.duration} s at {self.speeds} m/s",
                where="demonstration",
                fix="make them at least 5 s long, in some wind",
            )


@dataclass(frozen=True, kw_only=True)
class Tracks:
    """Where the files are, and the truth about them.

    Attributes:
        table: of the markers.
        recipe: of the experiment.
        effect, parameter, strength: what acted.
        unit: of the strength.
    """

    table: Path
    recipe: Path
    effect: str
    parameter: str
    strength: float
    unit: str


def make_tracks(recipe: TrackedRecipe, folder: Path, *, advance: Callable[[int], object]) -> Tracks:
    """Simulates the flag and writes `tracks.csv` and `tracked.toml` into `folder`.

    Args:
        advance: called with the number of frames done.
    """
    flat = grid(
        width=recipe.width, height=recipe.height, columns=17, rows=11, diagonals=Diagonals.FORWARD
    )
    markers = grid(width=recipe.width, height=recipe.height, columns=9, rows=6).rest
    observed = np.einsum("mv,fvcb->bfmc", onto(flat.rest, markers), _flight(recipe, flat, advance))
    observed = observed + recipe.noise * stream(recipe.seed, "tracked", "noise").standard_normal(
        observed.shape
    )
    names = [f"{speed:g} m-s" for speed in recipe.speeds]
    table, recipe_file = folder / "tracks.csv", folder / "tracked.toml"
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["recording", "frame", "marker", "u", "v", "x", "y", "z"])
        for name, positions in zip(names, observed, strict=True):
            for frame, at in enumerate(positions):
                for marker, ((u, v), (x, y, z)) in enumerate(zip(markers, at, strict=True)):
                    writer.writerow(
                        [
                            name,
                            frame,
                            f"m{marker:02d}",
                            f"{u:.4f}",
                            f"{v:.4f}",
                            f"{x:.5f}",
                            f"{y:.5f}",
                            f"{z:.5f}",
                        ]
                    )
    recordings = "".join(
        _RECORDING.format(name=name, rate=recipe.rate, noise=recipe.noise, speed=speed)
        for name, speed in zip(names, recipe.speeds, strict=True)
    )
    recipe_file.write_text(
        RECIPE.format(
            width=recipe.width,
            height=recipe.height,
            vertices=recipe.vertices,
            material=MATERIAL,
            recordings=recordings,
        ),
        encoding="utf-8",
    )
    unit = EFFECTS[recipe.effect].parameters()[recipe.parameter].unit
    return Tracks(
        table=table,
        recipe=recipe_file,
        effect=recipe.effect,
        parameter=recipe.parameter,
        strength=recipe.strength,
        unit=unit,
    )


def _flight(recipe: TrackedRecipe, flat: Mesh, advance: Callable[[int], object]) -> FloatArray:
    """Simulates positions (frame, vertex, 3, recording) [m]."""
    nominal = named_material(MATERIAL)
    material = replace(
        nominal.scaled(area_weight=recipe.area_weight, bending=recipe.bending),
        damping=recipe.damping,
    )
    attachment = Handles(vertices=handles.corners(flat.rest))
    scenes = []
    for index, speed in enumerate(recipe.speeds):
        start = np.stack([flat.rest[:, 0], 0 * flat.rest[:, 0], flat.rest[:, 1]], axis=1)
        start = roughen_start(
            start, attachment, stream(recipe.seed, "tracked", "start", index), _ROUGH
        )
        scenes.append(
            Scene(
                mesh=flat,
                position=start,
                material=material,
                handles=attachment,
                wind=(speed, 0.0, 0.0),
            )
        )
    effect = EFFECTS[recipe.effect](**{recipe.parameter: recipe.strength})
    method = Symplectic(outer=_OUTER)
    system, state = apply([effect], *assemble(scenes))
    batch = Batch(system=system, state=state, integrator=method, divergence=Divergence.REFUSE)
    frames = after(recipe.settle, recipe.duration, recipe.rate)
    run = batch.positions(range(1, frames.stop), recipe.rate, look=lambda _: advance(1))
    return run[frames.start - 1 :]
