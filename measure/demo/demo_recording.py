"""A recording as a user would bring it: a camera's film of a flag in gusty wind, and a cup
anemometer's log beside it.

The flag is simulated on a mesh and in steps that no fit uses. What acts on it beside the base
model, what its cloth weighs and by how much the two clocks differ are drawn from the seed and
written nowhere but into the returned `Recording`, so that results can be compared with them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import child_seed, stream
from flagdata.errors import InputError
from flagdata.lake.mesh_sequences import MeshSequence
from flagdata.timebase import NANOSECONDS, from_datetime
from measure.demo.logger import CUP, SENSOR, write_log
from measure.simulated_camera import write_film
from sim.assets import Assets
from sim.cloth import handles
from sim.cloth.handles import Handles
from sim.cloth.material import named_material
from sim.cloth.mesh import Diagonals, Mesh, grid
from sim.cloth.scene import Scene, assemble, roughen_start
from sim.cloth.state import State
from sim.cloth.system import System
from sim.datasets.anemometer import log_of_air, velocities
from sim.effects import EFFECTS, apply
from sim.effects.gusts import Gusts
from sim.integrate.implicit import BackwardEuler
from sim.render import Meshes, RenderParameters, render_prior
from sim.render.staging import stage
from sim.run.simulation_loop import Batch, Divergence, after

BEFORE, AFTER = 120.0, 120.0
"""s of wind that are logged before the camera starts and after it stops."""
START = datetime(2026, 5, 14, 9, 30, tzinfo=UTC)
"""When the camera starts, by its own clock."""
AIR_RATE = 10.0
"""Hz, at which the air is sampled."""
SIZE = "1.5x1.0"
"""Of the flag, as its maker states it [m]."""
MATERIAL = "camel-ponte-roma"
"""Whose measured tables the flag's cloth has, bent more or less easily."""
_SETTLE = 5.0  # s that are simulated before the first frame
_LARGEST_OFFSET = 45.0  # s
_ROUGH = 2e-3  # m, standard deviation of the free vertices' start
CLOCK_SIGMA = 0.5
"""s, standard error with which a person reads the difference of two displays."""
SCALE_SIGMA = 3e-3
"""kg/m², standard error with which a kitchen scale and a tape give the cloth's area weight."""
_SURVEYED = {
    "azimuth": math.radians(3.0),
    "elevation": math.radians(1.0),
    "distance": 0.1,
    "clock": CLOCK_SIGMA,
    "area_weight": SCALE_SIGMA,
}
"""Standard errors with which a person notes down where the camera stood, by compass and tape,
clocks and cloth."""


@dataclass(frozen=True, kw_only=True)
class Acting:
    """Something that acts on the flag beside the base model.

    Attributes:
        effect: a name of `sim.effects.EFFECTS`.
        parameter, strength: its one strength that is not null.
    """

    effect: str
    parameter: str
    strength: float

    @property
    def sentence(self) -> str:
        """Effect, parameter and strength with its unit."""
        unit = EFFECTS[self.effect].parameters()[self.parameter].unit
        return f"{self.effect}, {self.parameter} {self.strength:g}" + (
            "" if unit == "1" else f" {unit}"
        )


HIDDEN = (Acting(effect="hem-mass", parameter="line_density", strength=0.06),)
"""Of which the seed draws one: a rope in the hem weighs as much as the cloth. The flag moves more
in stronger wind all the same, so that its motion shows how the clocks differ."""


@dataclass(frozen=True, kw_only=True)
class RecordingRecipe:
    """What to make.

    Attributes:
        seed: root of all random streams.
        duration: of the film [s].
        rate: frames a second [Hz].
        columns: of the mesh along the flag.
        step: of backward Euler [s].
        length, height: of the flag [m].
        intensity: of the gusts, their standard deviation over the mean wind.
        eddies: length of the largest [m].
        width, rows: of the picture [px].
        samples: of a pixel.
        hidden: what may act beside the base model; none where it is empty.

    Raises:
        InputError: a film too short to be aligned, or no rate.
    """

    seed: int
    duration: float = 150.0
    rate: int = 30
    columns: int = 20
    step: float = 2.5e-3
    length: float = 1.5
    height: float = 1.0
    intensity: float = 0.2
    eddies: float = 60.0
    width: int = 400
    rows: int = 300
    samples: int = 4
    hidden: tuple[Acting, ...] = HIDDEN

    def __post_init__(self) -> None:
        if self.duration < 10 or self.rate < 1:
            raise InputError(
                f"the recording is {self.duration} s long at {self.rate} Hz",
                where="demonstration",
                fix="make it at least 10 s long, at 1 Hz",
            )

    def drawn(self, name: str, low: float, high: float) -> float:
        """Draws a value between two limits from the stream of that name."""
        return float(stream(self.seed, "demo", name).uniform(low, high))

    @property
    def wind(self) -> float:
        """Mean wind [m/s]."""
        return self.drawn("wind", 4.8, 5.2)

    @property
    def mesh(self) -> Mesh:
        """Of the flag: another one than any fit's."""
        rows = max(2, round(self.columns * self.height / self.length))
        return grid(
            width=self.length,
            height=self.height,
            columns=self.columns,
            rows=rows,
            diagonals=Diagonals.FORWARD,
        )

    @property
    def acting(self) -> Acting | None:
        """What acts beside the base model."""
        if not self.hidden:
            return None
        return self.hidden[int(stream(self.seed, "demo", "effect").integers(len(self.hidden)))]


@dataclass(frozen=True, kw_only=True)
class Noted:
    """Where the camera stood, how the clocks differed and what the cloth weighed, as a person notes
    it down.

    Attributes:
        azimuth: of its axis to the wind, 90° from the side [rad].
        elevation: of its axis [rad].
        distance: from the flag [m].
        clock: what the logger's display showed less the camera's [s].
        area_weight: of the cloth, by a scale, before the flag was made of it [kg/m²].
    """

    azimuth: float
    elevation: float
    distance: float
    clock: float
    area_weight: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Recording:
    """Where the files are, what a person who stood beside would know, and the truth.

    Attributes:
        video, log, sensor: the files.
        noted: where the camera stood, by compass and tape, and what a scale showed.
        clock_offset: what must be added to the camera's clock to reach the anemometer's [s].
        wind: true horizontal speed at the flag [m/s] at 10 Hz, from `BEFORE` seconds before the
            first frame on.
        area_weight, damping: of the cloth [kg/m²], [s].
        acting: what acted beside the base model.
    """

    video: Path
    log: Path
    sensor: Path
    noted: Noted
    clock_offset: float
    wind: FloatArray
    area_weight: float
    damping: float
    acting: Acting | None


def make_recording(
    recipe: RecordingRecipe, folder: Path, *, workers: int, advance: Callable[[int], object]
) -> Recording:
    """Write `flag.mp4`, `anemometer.csv` and `cup-logger.toml` into `folder`.

    Args:
        workers: processes that render.
        advance: called with the number of frames that were simulated or filmed: twice each.
    """
    video, log, sensor = folder / "flag.mp4", folder / "anemometer.csv", folder / "cup-logger.toml"
    sensor.write_text(SENSOR, encoding="utf-8")
    system, state = _flag(recipe)
    times = np.arange(round((BEFORE + recipe.duration + AFTER) * AIR_RATE) + 1) / AIR_RATE
    velocity = velocities(system, times)
    offset = _log(recipe, log, times, velocity)
    sequence = _flown(recipe, system, state, advance)
    zeta = look(recipe)
    write_film(
        video,
        sequence,
        zeta,
        rate=recipe.rate,
        start=START,
        seed=child_seed(recipe.seed, "demo", "film"),
        workers=workers,
        advance=advance,
    )
    cloth = _cloth(recipe)
    return Recording(
        video=video,
        log=log,
        sensor=sensor,
        noted=_note_truth(recipe, sequence, zeta, offset),
        clock_offset=offset,
        wind=np.hypot(velocity[:, 0], velocity[:, 1]),
        area_weight=cloth[0],
        damping=cloth[2],
        acting=recipe.acting,
    )


def look(recipe: RecordingRecipe) -> RenderParameters:
    """Draws how it is filmed: as in the data set `outdoor`, from 7 to 9 m away, in daylight, before
    the sky or hills, against which the outline of a flag is found."""
    quantities = {
        "camera_radius": recipe.drawn("radius", 7.0, 9.0),
        "camera_height": recipe.drawn("camera", 1.4, 1.8),
        "camera_angle": math.radians(recipe.drawn("azimuth", 70.0, 110.0)),
        "view_angle": math.radians(recipe.drawn("view", 20.0, 23.0)),
        "exposure_bias": recipe.drawn("exposure", -0.5, 0.1),
        "raster_samples": recipe.samples,
        "width": recipe.width,
        "height": recipe.rows,
    }
    outdoor = render_prior.named_prior("outdoor").with_quantities(
        quantities, source="the demonstration"
    )
    plain = replace(outdoor, textures=("flag", "stripes"), backgrounds=("sky", "hills"))
    return plain.draw(child_seed(recipe.seed, "demo", "look"), Assets())


def _cloth(recipe: RecordingRecipe) -> tuple[float, float, float]:
    """Draws area weight [kg/m²], factor on the bending table and damping [s]."""
    return (
        recipe.drawn("area-weight", 0.16, 0.20),
        math.exp(recipe.drawn("bending", -0.5, 0.5)),
        recipe.drawn("damping", 3e-3, 8e-3),
    )


def _flag(recipe: RecordingRecipe) -> tuple[System, State]:
    """Assembles the flag in its wind, `_SETTLE` before the first frame; the wind's time begins with
    the log."""
    flat = recipe.mesh
    attachment = Handles(vertices=handles.corners(flat.rest))
    area_weight, bending, damping = _cloth(recipe)
    base = named_material(MATERIAL)
    material = replace(
        base.scaled(bending=bending),
        area_weight=area_weight,
        damping=max(damping - recipe.step, 0.0),
    )
    start = np.stack([flat.rest[:, 0], 0 * flat.rest[:, 0], flat.rest[:, 1]], axis=1)
    start = roughen_start(start, attachment, stream(recipe.seed, "demo", "start"), _ROUGH)
    speed = recipe.wind
    scene = Scene(
        mesh=flat, position=start, material=material, handles=attachment, wind=(speed, 0.0, 0.0)
    )
    gusts = Gusts(intensity=recipe.intensity).with_series(
        stream(recipe.seed, "demo", "gusts"),
        batch=1,
        speed=speed,
        length=recipe.eddies,
        duration=BEFORE + recipe.duration + AFTER,
        rate=AIR_RATE,
    )
    acting = recipe.acting
    acting_effects = (
        [] if acting is None else [EFFECTS[acting.effect](**{acting.parameter: acting.strength})]
    )
    system, state = apply([gusts, *acting_effects], *assemble([scene], dtype=torch.float32))
    return system, replace(state, time=BEFORE - _SETTLE)


def _flown(
    recipe: RecordingRecipe, system: System, state: State, advance: Callable[[int], object]
) -> MeshSequence:
    """Simulates the flag in each frame of the film."""
    method = BackwardEuler(step=recipe.step, tolerance=1e-3)
    batch = Batch(system=system, state=state, integrator=method, divergence=Divergence.REFUSE)
    frames = after(_SETTLE, recipe.duration, recipe.rate)
    positions = batch.positions(frames, recipe.rate, look=lambda _: advance(1))
    mesh = recipe.mesh
    return MeshSequence(
        time=np.round(np.arange(len(frames)) / recipe.rate * NANOSECONDS).astype(np.int64),
        positions=positions[..., 0].astype(np.float32),
        faces=mesh.faces.astype(np.int32),
        rest=mesh.rest.astype(np.float32),
        attributes={},
    )


def _log(recipe: RecordingRecipe, path: Path, times: FloatArray, velocity: FloatArray) -> float:
    """Write the anemometer's log; what must be added to the camera's clock to reach the logger's
    [s]."""
    begin = from_datetime(START) - round(BEFORE * NANOSECONDS)
    seed = child_seed(recipe.seed, "demo", "anemometer")
    series = log_of_air(CUP, times, velocity, instrument=seed, seed=seed, begin=begin).series
    offset = recipe.drawn("clock", -_LARGEST_OFFSET, _LARGEST_OFFSET)
    first = (
        int(series.time[0]) - begin
    ) / NANOSECONDS - BEFORE  # by the camera's clock, from its start
    stamp = START + timedelta(seconds=first + offset)
    write_log(
        path,
        series.channels["wind_speed"],
        series.channels["wind_direction"],
        first=stamp,
        quiet=round(BEFORE - _LARGEST_OFFSET),
        seed=recipe.seed,
    )
    return offset


def _note_truth(
    recipe: RecordingRecipe, sequence: MeshSequence, zeta: RenderParameters, offset: float
) -> Noted:
    camera = stage(Meshes.flag(sequence, heading=0.0), zeta).camera
    true = {
        "azimuth": zeta.camera_angle,
        "elevation": math.asin(camera.forward[2]),
        "distance": zeta.camera_radius / math.cos(math.asin(camera.forward[2])),
        "clock": offset,
        "area_weight": _cloth(recipe)[0],
    }
    return Noted(
        **{
            name: value
            + float(stream(recipe.seed, "demo", "noted", name).normal(0.0, _SURVEYED[name]))
            for name, value in true.items()
        }
    )
