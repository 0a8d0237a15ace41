"""Films of flags whose geometry is known, by a renderer of the project, and what is read of them
against it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.errors import FlagdataError
from flagdata.ingest.films.film_array import Frames
from flagdata.record import decode
from measure.cloth import OBSERVED, Flag
from measure.film import ConditionedFilm, FlagSize
from measure.observables import OBSERVABLES, ClothWindow, FilmWindow, edges_of, watch_film
from sim.assets import Assets
from sim.cloth.mesh import Mesh
from sim.datasets import encode_pictures, load, settings
from sim.render import Meshes, RenderParameters, render_prior, stage

RATE = 25.0
"""Frames a second [Hz]."""
SIZE = (480, 360)
"""Of a film's picture [px]."""
_CAMERA = "outdoor"
"""Data set whose cameras' noise and coding films get."""
_WIDE = (0.35, 0.62)
"""Share of the picture's width that the flat flag would take."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where a flag is filmed from.

    Attributes:
        azimuth, elevation: of the camera's axis, as `measure.observables.View` has them; the air
            goes to the left where the azimuth is negative [rad].
        distance: [m].
        wide: share of the picture's width that the flat flag would take.
    """

    azimuth: float
    elevation: float
    distance: float
    wide: float

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Place:
        """One of 40 to 140 degrees to the wind, nearly level, 5 to 20 m away, on either side."""
        side = 1.0 if rng.random() < 0.5 else -1.0
        return cls(
            azimuth=side * math.radians(rng.uniform(40.0, 140.0)),
            elevation=float(np.clip(rng.normal(0.0, math.radians(5.0)), -0.2, 0.2)),
            distance=float(rng.uniform(5.0, 20.0)),
            wide=float(rng.uniform(*_WIDE)),
        )

    def put(
        self, zeta: RenderParameters, positions: FloatArray, upper: int, length: float
    ) -> RenderParameters:
        """A look with its camera here: the axis goes through the middle of the flag's box.

        Args:
            positions: (frame, vertex, 3) [m].
            upper: vertex of the hoist's upper end.
            length: of the flag [m].
        """
        box = np.stack([positions.min(axis=(0, 1)), positions.max(axis=(0, 1))]).mean(axis=0)
        below = float(positions[0, upper, 2] - box[2])
        return replace(
            zeta,
            camera_angle=self.azimuth,
            camera_radius=self.distance * math.cos(self.elevation),
            camera_height=zeta.mesh_height - below - self.distance * math.sin(self.elevation),
            view_angle=2 * math.atan(length / self.wide / 2 / self.distance),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Filmed:
    """A film and what it shows.

    Attributes:
        pixels, geometry: (window, observable of `OBSERVED`); NaN where a window does not show one.
        windows: of the film; None where nothing was found.
        found: the film as it was made fit.
    """

    pixels: FloatArray
    geometry: FloatArray
    windows: tuple[FilmWindow | None, ...]
    found: ConditionedFilm


def look(seed: int, *, light: int) -> RenderParameters:
    """A look that is drawn: all of one seed, but for the sun and the sky, which are of another."""
    own, other = (render_prior.named_prior("outdoor").draw(one, Assets()) for one in (seed, light))
    shown = {
        name: getattr(other, name)
        for name in (
            "sun_height",
            "sun_radius",
            "sun_azimuth",
            "sun_strength",
            "sun_softness",
            "sky_strength",
        )
    }
    width, height = SIZE
    return replace(
        own,
        **shown,
        width=width,
        height=height,
        raster_samples=4,
        cycles_samples=4,
        cycles_bounces=2,
    )


def meshes_of(positions: FloatArray, mesh: Mesh) -> Meshes:
    """Of (frame, vertex, 3) [m] in a wind along +x."""
    uv = torch.tensor(mesh.rest / mesh.rest.max(axis=0), dtype=torch.float32)
    hoist, _ = edges_of(mesh.rest)
    return Meshes.fixed(
        positions=torch.as_tensor(positions, dtype=torch.float32),
        faces=torch.tensor(mesh.faces, dtype=torch.int64),
        uv=uv,
        anchor=tuple(positions[0, hoist[0]].tolist()),
        rate=RATE,
    )


def filmed(
    positions: FloatArray,
    mesh: Mesh,
    flag: Flag,
    zeta: RenderParameters,
    *,
    render: Callable[[Meshes, RenderParameters], Tensor],
    seed: int,
) -> Filmed | None:
    """Film a flag (frame, vertex, 3) [m], and read the film; None where it is refused.

    Args:
        seed: of the camera's noise and coding.
    """
    meshes = meshes_of(positions, mesh)
    with torch.no_grad():
        colour = render(meshes, zeta).numpy()
    camera = load(_CAMERA).camera
    pictures = np.stack(
        decode(
            encode_pictures(colour, settings(camera, seed=seed), camera, seed=seed),
            where="a filmed flag",
        )
    )
    return read(pictures, places(meshes, zeta), mesh, flag)


def read(pictures: UInt8Array, projected: FloatArray, mesh: Mesh, flag: Flag) -> Filmed | None:
    """Read pictures (frame, height, width), and the geometry (frame, vertex, 2) [px] of the same
    windows."""
    times = np.arange(len(pictures)) / RATE
    film = ConditionedFilm(Frames(images=pictures, time=times), aspect=flag.length / flag.height)
    try:
        seen = watch_film(film, FlagSize(length=flag.length, height=flag.height))
    except FlagdataError:
        return None
    if all(window is None for window in seen.windows):
        return None
    pixels, geometry = (np.full((len(seen.windows), len(OBSERVED)), np.nan) for _ in range(2))
    for number, (start, window) in enumerate(zip(seen.starts.tolist(), seen.windows, strict=True)):
        within = (times >= start - 1e-6) & (times < start + seen.seconds - 1e-6)
        cloth = window_of(projected[within], times[within], mesh, flag)
        geometry[number] = [OBSERVABLES[name].of_cloth(cloth).value for name in OBSERVED]
        if window is not None:
            pixels[number] = [OBSERVABLES[name].of_film(window).value for name in OBSERVED]
    return Filmed(pixels=pixels, geometry=geometry, windows=seen.windows, found=film)


def places(meshes: Meshes, zeta: RenderParameters) -> FloatArray:
    """(frame, vertex, 2) in the picture [px], the first pixel's middle at 0.5."""
    placed = stage(meshes, zeta)
    world = meshes.positions.double() + torch.tensor(placed.shift).double()
    return placed.camera.project(world)[0].numpy().reshape(len(meshes), -1, 2)


def window_of(projected: FloatArray, times: FloatArray, mesh: Mesh, flag: Flag) -> ClothWindow:
    """Of (frame, vertex, 2) in the picture [px], its scale from the hoist's known height."""
    hoist, free = edges_of(mesh.rest)
    points = projected * np.array([1.0, -1.0])
    height = float((points[:, hoist[0], 1] - points[:, hoist[-1], 1]).mean())
    return ClothWindow(
        times=times,
        points=points * flag.height / height,
        faces=np.asarray(mesh.faces, np.int64),
        hoist=hoist,
        free=free,
        length=flag.length,
        height=flag.height,
    )
