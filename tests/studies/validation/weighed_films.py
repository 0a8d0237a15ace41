"""Films of the flags of `weighed`, by the raster renderer, coded as H.264 and read as any film
is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import av
import numpy as np
import torch

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.rng import stream
from measure.cloth import OBSERVED
from measure.film import FilmReading, FlagSize, subjects
from measure.observables import OBSERVABLES, watch_film
from sim.assets import Assets
from sim.cloth.mesh import Mesh
from sim.render import Meshes, Raster, RenderParameters, render_prior

RATE, SECONDS = 25.0, 120.0  # Hz, s
SIGMA = np.array([OBSERVABLES[name].sigma for name in OBSERVED])
_SIZE = FlagSize(length=1.5, height=1.0)
_WIDE = 0.62
"""Share of the picture's width that the flat flag would take."""
_NOISE = 1.5  # gray levels
_QUALITY = "20"  # constant rate factor


def filmed(truth: Mapping[str, Any], positions: FloatArray, mesh: Mesh, at: Path) -> FloatArray:
    """(window, observable) of a truth's film; NaN where a window does not show one.

    Args:
        positions: (frame, vertex, 3) at `RATE` [m].
        at: folder in which the film is kept.
    """
    path = at / f"film-{truth['number']}.mp4"
    if not path.exists():
        write(
            path, pictures(truth, positions[: round(SECONDS * RATE) + 1], mesh), seed=truth["seed"]
        )
    (subject,) = subjects(
        str(path), query=None, lake=None, at=None, reading=FilmReading(aspect=_SIZE.aspect)
    )
    seen = watch_film(subject.film, _SIZE, last=SECONDS)
    nothing = [math.nan] * len(OBSERVED)
    return np.array(
        [
            nothing
            if window is None
            else [OBSERVABLES[name].of_film(window).value for name in OBSERVED]
            for window in seen.windows
        ]
    )


def pictures(truth: Mapping[str, Any], positions: FloatArray, mesh: Mesh) -> UInt8Array:
    """(frame, height, width, 3) of a look that is drawn, from the truth's place."""
    assets = Assets()
    zeta = placed(
        render_prior.named_prior("flags").draw(truth["seed"], assets), truth, positions, mesh
    )
    count, vertices = positions.shape[:2]
    faces = torch.tensor(mesh.faces, dtype=torch.int64)
    size = mesh.rest.max(axis=0)
    uv = torch.tensor(mesh.rest / size, dtype=torch.float32)
    meshes = Meshes(
        positions=torch.as_tensor(positions.reshape(-1, 3), dtype=torch.float32),
        faces=faces.repeat(count, 1),
        uv=uv.repeat(count, 1),
        vertex_offset=tuple(vertices * k for k in range(count + 1)),
        face_offset=tuple(len(faces) * k for k in range(count + 1)),
        anchor=tuple(positions[0, _upper(mesh)].tolist()),
        rate=RATE,
    )
    with torch.no_grad():
        return Raster(assets=assets).render(meshes, zeta).numpy()


def placed(
    drawn: RenderParameters, truth: Mapping[str, Any], positions: FloatArray, mesh: Mesh
) -> RenderParameters:
    """A look with the camera where the truth has it: the axis goes through the middle of the flag's
    box."""
    box = np.stack([positions.min(axis=(0, 1)), positions.max(axis=(0, 1))]).mean(axis=0)
    below = float(positions[0, _upper(mesh), 2] - box[2])
    away, elevation = truth["distance"], truth["elevation"]
    return replace(
        drawn,
        camera_angle=truth["azimuth"],
        camera_radius=away * math.cos(elevation),
        camera_height=drawn.mesh_height - below - away * math.sin(elevation),
        view_angle=2 * math.atan(_SIZE.length / _WIDE / 2 / away),
        raster_samples=4,
    )


def write(path: Path, frames: UInt8Array, *, seed: int) -> None:
    """A coded film with a camera's noise."""
    rng = stream(seed, "weighed", "noise")
    with av.open(str(path), "w") as container:
        track = container.add_stream("libx264", rate=round(RATE))
        track.height, track.width = frames.shape[1:3]
        track.pix_fmt, track.options = "yuv420p", {"crf": _QUALITY}
        for frame in frames:
            noisy = np.clip(
                np.rint(frame + _NOISE * rng.standard_normal(frame.shape)), 0, 255
            ).astype(np.uint8)
            for packet in track.encode(av.VideoFrame.from_ndarray(noisy, format="rgb24")):
                container.mux(packet)
        for packet in track.encode():
            container.mux(packet)


def _upper(mesh: Mesh) -> int:
    """Vertex of the hoist's upper end."""
    return int(np.lexsort((-mesh.rest[:, 1], mesh.rest[:, 0]))[0])
