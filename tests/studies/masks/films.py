"""Short films of simulated flags, made fit as any film is, with the cloth's silhouette in each
picture.

A film is one camera before one to four runs of flags of one shape in winds of their own, so that
its still picture is of calm and of gusty moments. Runs come from a data set's sequences; camera,
light, texture and background are drawn anew, the frames get a camera's noise and H.264's losses,
and the pictures are what `models.conditioning` makes of them. The silhouette is the projection of
the mesh, brought into the picture by the same cut.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.core.arrays import Float32Array, FloatArray, UInt8Array
from flagdata.core.rng import child_seed, stream
from flagdata.lake import MeshSequence
from flagdata.record import decode
from models.conditioning import HALVED, Conditioning, Stills, condition_film, framing, halve_picture
from models.conditioning.camera_motion import STILL
from sim.assets import Assets
from sim.datasets import encode_pictures, load, settings
from sim.render import Meshes, Raster, RenderParameters, render_prior, stage

_CAMERA = "outdoor"
"""Data set whose cameras' noise and coding films get."""
PICTURES = 10
"""Of a film, that are kept."""
_EVERY = 3
"""Frames of a run of which one is filmed."""
_FINE = 4
"""By how much a silhouette is drawn larger than the film."""
_SHOWN = 0.02
"""Least share of the picture that the cloth takes on average."""
_APART = 5.0
"""Time between runs [s]."""
_BARE, _DRIFTING, _DRIFT = 0.15, 0.3, 0.12
"""Share of films without a pole, and of films whose light changes, by up to this share."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Example:
    """Pictures of a film and what they show, all at half the conditioned picture's size.

    Attributes:
        pictures: (n, size, size) gray.
        stills: of the whole film.
        cloth: (n, size, size) share of the pixel that the cloth covers, in 1/255.
        hoist: (n, 2, 2) upper and lower end of the hoist: column and row, the first pixel's middle
            at 0.5 [px].
    """

    pictures: UInt8Array
    stills: Stills
    cloth: UInt8Array
    hoist: Float32Array


def example(runs: Sequence[MeshSequence], *, seed: int, assets: Assets) -> Example | None:
    """Film some runs of one mesh; None where no region of cloth is found, the camera is taken to
    move, or the flag is hardly in the picture.

    Args:
        runs: of one mesh and one rate, each of a dozen frames or more, in a wind along +x.
        seed: of everything that is drawn.
    """
    rng = stream(seed, "masks")
    zeta = _look(rng, child_seed(seed, "look"), assets)
    meshes = Meshes.flag(_joined(runs), heading=0.0)
    lengths = [len(range(0, len(run), _EVERY)) for run in runs]
    ends = np.cumsum([0, *lengths])
    # The first and the last frame of a run would be blurred towards another run.
    picked = [k for a, b in itertools.pairwise(ends) for k in range(a + 1, b - 1)]
    times = np.array(
        [k / meshes.rate + _APART * float(np.searchsorted(ends, k, side="right")) for k in picked]
    )
    with torch.no_grad():
        colour = Raster(assets=assets).render(meshes, zeta).numpy()[picked]
    film = _coded(_lit(colour, rng), rng)
    found = condition_film(film, times).found
    if found.region is None or found.camera.moves:
        return None
    small = np.stack([halve_picture(found.show(frame, STILL)) for frame in film])
    kept = np.sort(rng.choice(len(picked), size=min(PICTURES, len(picked)), replace=False))
    places = _places(meshes, zeta, [picked[k] for k in kept])
    cloth = np.stack([_cloth(one, runs[0].faces, zeta, found) for one in places])
    if cloth.mean() / 255 < _SHOWN:
        return None
    return Example(
        pictures=small[kept],
        stills=Stills.of(small),
        cloth=cloth,
        hoist=_hoist(places, runs[0].rest, found),
    )


def _look(rng: np.random.Generator, seed: int, assets: Assets) -> RenderParameters:
    look = render_prior.named_prior("outdoor").draw(seed, assets)
    width, height = ((640, 360), (480, 480), (480, 360))[int(rng.integers(3))]
    bare = {"pole_radius": 0.0} if rng.random() < _BARE else {}
    return replace(look, width=width, height=height, raster_samples=4, **bare)


def _joined(runs: Sequence[MeshSequence]) -> MeshSequence:
    """Every third frame of each, one run after another."""
    first = runs[0]
    step = int(first.time[_EVERY] - first.time[0])
    positions = np.concatenate([run.positions[::_EVERY] for run in runs])
    return MeshSequence(
        time=np.arange(len(positions), dtype=np.int64) * step,
        positions=positions,
        faces=first.faces,
        rest=first.rest,
    )


def _lit(colour: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """Frames in a light that stays, or in one that changes evenly."""
    if rng.random() >= _DRIFTING:
        return colour
    begin, end = rng.uniform(-_DRIFT, _DRIFT, 2).tolist()
    gain = 1 + np.linspace(begin, end, len(colour))[:, None, None, None]
    return np.clip(np.rint(colour * gain), 0, 255).astype(np.uint8)


def _coded(colour: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """(n, height, width) gray of frames (n, height, width, 3) after the noise and the coding of the
    data set's cameras."""
    camera = load(_CAMERA).camera
    seed = int(rng.integers(2**31))
    return np.stack(
        decode(
            encode_pictures(colour, settings(camera, seed=seed), camera, seed=seed),
            where="a simulated film",
        )
    )


def _places(meshes: Meshes, zeta: RenderParameters, picked: Sequence[int]) -> FloatArray:
    """(n, vertex, 2) of the film's pixels, the first pixel's middle at 0.5."""
    placed = stage(meshes, zeta)
    each = [meshes.positions[meshes.vertex_offset[k] : meshes.vertex_offset[k + 1]] for k in picked]
    return placed.camera.project(torch.stack(each).double() + torch.tensor(placed.shift).double())[
        0
    ].numpy()


def _cloth(
    places: FloatArray, faces: NDArray[np.int32], zeta: RenderParameters, found: Conditioning
) -> UInt8Array:
    fine = np.zeros((zeta.height * _FINE, zeta.width * _FINE), np.uint8)
    corners = np.rint((places * _FINE - 0.5) * 16).astype(np.int32)
    for face in faces:
        cv2.fillConvexPoly(fine, corners[face], 255, shift=4)
    film = cv2.resize(fine, (zeta.width, zeta.height), interpolation=cv2.INTER_AREA)
    picture = framing.cut(np.asarray(film, np.uint8), found.square, found.size)
    return halve_picture(picture)


def _hoist(places: FloatArray, rest: Float32Array, found: Conditioning) -> Float32Array:
    hoist = np.flatnonzero(rest[:, 0] <= rest[:, 0].min() + 1e-4)
    ends = hoist[[int(rest[hoist, 1].argmax()), int(rest[hoist, 1].argmin())]]
    corner = np.array([found.square.x, found.square.y])
    return ((places[:, ends] - corner) * found.size / found.square.side / HALVED).astype(np.float32)
