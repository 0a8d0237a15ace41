"""Films of one flag and of two, simulated and drawn for the rules on what may not be answered
(decision 081).

A shot is a flag on its pole before a background. Two shots of one camera give a pair: the second
flag, with its pole, is laid over the first film by its silhouette. Everything follows from one
seed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch

from flagdata.core.arrays import BoolArray, FloatArray, UInt8Array
from flagdata.core.rng import child_seed, stream
from flagdata.lake import MeshSequence
from sim.assets import Assets
from sim.datasets.camera_picture import noisy
from sim.render import Meshes, Raster, RenderParameters, render_prior, stage
from sim.run import Crew, Stepper, recipe_of, run

RATE, COUNT = 25.0, 150
"""Hz and frames of a film: six seconds."""
WIDTH, HEIGHT = 480, 320
"""Of the picture [px]."""
LOWEST, HIGHEST = 3.0, 10.0
"""Winds [m/s]."""
_SCENE = "flag-outdoor-damped"
_NOISE = {"camera.read_noise": 0.8, "camera.shot_noise": 1.5}
"""Of the camera, in 8-bit steps."""
_APART = (0.35, 0.9)
"""Distance of the poles of a pair, in lengths of the flag as the picture shows it."""
_LOWER = 0.25
"""How much lower or higher the second flag is at most, in heights of the flag."""
_FRONT = (math.radians(55.0), math.radians(125.0))
"""Angle from the wind to the camera's axis; half of the films are mirrored [rad]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Flight:
    """A simulated flag.

    Attributes:
        wind: mean speed [m/s].
        area_weight: of the cloth [kg/m²].
        sequence: `COUNT` meshes.
    """

    wind: float
    area_weight: float
    sequence: MeshSequence


@dataclass(frozen=True, kw_only=True, eq=False)
class Shot:
    """A film of a flag.

    Attributes:
        pictures: (n, `HEIGHT`, `WIDTH`) gray.
        cloth: (n, `HEIGHT`, `WIDTH`) where the cloth is.
        pole: (`HEIGHT`, `WIDTH`) where the pole is.
    """

    pictures: UInt8Array
    cloth: BoolArray
    pole: BoolArray


def flights(seed: int, count: int) -> list[Flight]:
    """Simulates flags of 1.5 × 1 m, of any bending and damping of the scene, with 0.08 to 0.3
    kg/m²."""
    given = {
        "seed": seed,
        "count": count,
        "batch": count,
        "scene": {"columns": 15},
        "material": {
            "area-weight": {"low": 0.08, "high": 0.3, "scale": "log"},
            "damping": {"low": 2e-3, "high": 10e-3, "scale": "log"},
        },
        "wind": {"speed": {"low": LOWEST, "high": HIGHEST}},
        "time": {"settle": 2.0, "frames": COUNT, "rate": RATE},
        "integrator": {"step": 4e-3},
    }
    crew = Crew(recipe_of(_SCENE, given))
    members = [crew.member(k) for k in range(count)]
    found = []
    for member, outcome in zip(
        members, run(crew, Stepper.of(crew, members[0].base), members, size=count), strict=True
    ):
        if outcome.sequence is None:
            raise RuntimeError(
                f"flag {member.index} of seed {seed} was not simulated: {outcome.failure}"
            )
        weight = float(str(member.parameters["area_weight"]))
        found.append(Flight(wind=member.wind_speed, area_weight=weight, sequence=outcome.sequence))
    return found


def look(seed: int) -> RenderParameters:
    """Draws camera, light, texture and background."""
    zeta = render_prior.named_prior("outdoor").draw(child_seed(seed, "look"), Assets())
    rng = stream(seed, "kinds", "camera")
    return replace(
        zeta,
        camera_angle=float(rng.uniform(*_FRONT)),
        camera_radius=float(rng.uniform(6.0, 9.0)),
        camera_height=float(rng.uniform(1.2, 2.5)),
        view_angle=math.radians(float(rng.uniform(28.0, 34.0))),
        frame_offset_x=0.0,
        frame_offset_y=0.0,
        width=WIDTH,
        height=HEIGHT,
        raster_samples=2,
    )


def shot(flight: Flight, zeta: RenderParameters, seed: int) -> Shot:
    """Films a flag."""
    meshes = Meshes.flag(flight.sequence, heading=0.0)
    with torch.no_grad():
        colour = Raster(assets=Assets()).render(meshes, zeta).numpy()
    rng = stream(seed, "kinds", "noise")
    cloth, pole = silhouettes(flight, zeta)
    gray = np.stack(
        [
            noisy(np.asarray(cv2.cvtColor(one, cv2.COLOR_RGB2GRAY), np.uint8), _NOISE, rng)
            for one in colour
        ]
    )
    return Shot(pictures=gray, cloth=cloth, pole=pole)


def silhouettes(flight: Flight, zeta: RenderParameters) -> tuple[BoolArray, BoolArray]:
    """Draws where the cloth is in each frame (n, `HEIGHT`, `WIDTH`), and where the pole is
    (`HEIGHT`, `WIDTH`)."""
    meshes = Meshes.flag(flight.sequence, heading=0.0)
    placed = stage(meshes, zeta)

    def places(points: torch.Tensor) -> FloatArray:
        return placed.camera.project(points.double())[0].numpy()

    vertices = meshes.positions.reshape(-1, meshes.vertex_offset[1], 3).double()
    cloth = places(vertices + torch.tensor(placed.shift).double())
    pole = _filled(places(placed.pole_positions), placed.pole_faces.numpy())
    return np.stack([_filled(one, flight.sequence.faces) for one in cloth]), pole


def pair(first: Flight, second: Flight, seed: int) -> Shot:
    """Films two flags whose cloths overlap in the picture; which one is in front is drawn.

    `cloth` and `pole` are those of the flag in front.
    """
    rng = stream(seed, "kinds", "pair")
    zeta = look(seed)
    alone, _ = silhouettes(first, zeta)
    columns, rows = np.flatnonzero(alone.any(axis=(0, 1))), np.flatnonzero(alone.any(axis=(0, 2)))
    across = float(rng.choice([-1, 1]) * rng.uniform(*_APART)) * len(columns) / WIDTH
    down = float(rng.uniform(-_LOWER, _LOWER)) * len(rows) / WIDTH
    other = render_prior.named_prior("outdoor").draw(child_seed(seed, "second"), Assets())
    back = shot(first, replace(zeta, frame_offset_x=-across / 2), seed)
    front = shot(
        second,
        replace(zeta, texture=other.texture, frame_offset_x=across / 2, frame_offset_y=down),
        child_seed(seed, "front"),
    )
    over = front.cloth | front.pole
    return Shot(
        pictures=np.where(over, front.pictures, back.pictures), cloth=front.cloth, pole=front.pole
    )


def mirrored(pictures: UInt8Array, seed: int) -> UInt8Array:
    """Half of the films, left for right."""
    return (
        np.ascontiguousarray(pictures[:, :, ::-1])
        if stream(seed, "kinds", "mirror").random() < 0.5
        else pictures
    )


def upside_down(pictures: UInt8Array) -> UInt8Array:
    """Turns a film by 180°."""
    return np.ascontiguousarray(pictures[:, ::-1, ::-1])


def on_its_side(pictures: UInt8Array, turns: int) -> UInt8Array:
    """Turns a film by a quarter, counter-clockwise for 1 and clockwise for −1."""
    return np.ascontiguousarray(np.rot90(pictures, turns, axes=(1, 2)))


def _filled(places: FloatArray, faces: Sequence[Sequence[int]] | np.ndarray) -> BoolArray:
    """Masks the triangles (face, 3) between places (vertex, 2) [px]."""
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    corners = np.rint((places - 0.5) * 16).astype(np.int32)
    for face in faces:
        cv2.fillConvexPoly(mask, corners[face], 1, shift=4)
    return mask > 0
