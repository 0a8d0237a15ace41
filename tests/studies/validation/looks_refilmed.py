"""The fitted flag filmed once: a flag that is nearly the film's, drawn with the film's own colours
before its own background, and read as the film is; what its reading is off by is what the film's
may be off by."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch

from flagdata.core.arrays import BoolArray, FloatArray, UInt8Array
from flagdata.core.rng import stream
from measure.cloth import Flag
from measure.observables import FilmWindow, edges_of
from models.conditioning import HALVED
from sim.assets import Assets
from sim.cloth.mesh import Mesh
from sim.render import Raster, RenderParameters, to_linear
from tests.studies.validation.looks_films import Filmed, Place, meshes_of, places, read

_CELLS = (12, 16)
"""Rows along the hoist and columns away from it of the cloth's colours."""
_EVERY = 5
"""Frames of which one is looked at for the colours."""
_BARE = 0.15
"""Share of the frames that show what is behind at a place, from which on that is taken."""
_NEAR = 5
"""Pixels about the cloth that are not background."""
_LEVEL = 20
"""Frames that the exposure is set by."""


@dataclass(frozen=True, kw_only=True)
class _Own(Assets):
    """A film's own cloth and background, whatever the name."""

    cloth: UInt8Array | None = None
    behind: UInt8Array | None = None

    def texture(self, name: str) -> UInt8Array:
        assert self.cloth is not None
        return self.cloth

    def background(self, name: str) -> UInt8Array:
        assert self.behind is not None
        return self.behind


@dataclass(frozen=True, kw_only=True, eq=False)
class Look:
    """What a film shows of its cloth and of what is behind it.

    Attributes:
        cloth: (rows, columns) gray of the cloth, from its upper hoist corner on.
        behind: (size, size) gray of the picture made fit without the cloth.
        hoist: (2, 2) upper and lower end of the hoist in that picture: column and row [px].
        side: 1 where the flag flies to the right, −1 to the left.
        noise: deviation of the camera's [gray levels].
    """

    cloth: UInt8Array
    behind: UInt8Array
    hoist: FloatArray
    side: float
    noise: float

    @classmethod
    def of(cls, film: Filmed) -> Look:
        """Of a film that was read."""
        some = [window for window in film.windows if window is not None]
        found = film.found.found
        assert found is not None
        return cls(
            cloth=_colours(some),
            behind=_behind(some, found.background),
            hoist=some[0].hoist * HALVED,
            side=some[0].side,
            noise=found.noise,
        )


def refilmed(
    look: Look, positions: FloatArray, mesh: Mesh, flag: Flag, place: Place, *, seed: int
) -> Filmed | None:
    """A flag (frame, vertex, 3) [m] filmed in a look, and read; None where its film is refused."""
    texture = np.repeat(look.cloth[:, :, None], 3, axis=2)
    texture = cv2.resize(texture, (256, 192), interpolation=cv2.INTER_NEAREST)
    own = _Own(
        cloth=np.asarray(texture, np.uint8), behind=np.repeat(look.behind[:, :, None], 3, axis=2)
    )
    side = look.behind.shape[0]
    zeta = RenderParameters(
        background="film/own",
        texture="film/own",
        background_scale=0.6,
        pole_radius=0.0,
        width=side,
        height=side,
        raster_samples=4,
        sky_strength=1.0,
    )
    seen = replace(place, azimuth=math.copysign(place.azimuth, look.side))
    hoist, _ = edges_of(mesh.rest)
    zeta = seen.put(zeta, positions, int(hoist[0]), flag.length)
    zeta = replace(zeta, sun_azimuth=math.remainder(zeta.camera_angle + math.pi, 2 * math.pi))
    meshes = meshes_of(positions, mesh)
    zeta = aimed(
        zeta, lambda one: places(meshes, one)[:, [hoist[0], hoist[-1]]].mean(axis=0), look.hoist
    )
    raster = Raster(assets=own)
    with torch.no_grad():
        few = meshes.part(0, min(_LEVEL, len(meshes)))
        shown = raster.part(meshes, zeta, 0, len(few)).numpy()[..., 0]
        zeta = replace(
            zeta, exposure_bias=_exposure(shown, places(meshes, zeta)[: len(few)], mesh, look)
        )
        pictures = raster.render(meshes, zeta).numpy()[..., 0]
    noise = look.noise * stream(seed, "refilmed").standard_normal(pictures.shape)
    noisy = np.clip(np.rint(pictures + noise), 0, 255).astype(np.uint8)
    return read(noisy, places(meshes, zeta), mesh, flag)


def aimed(
    zeta: RenderParameters, ends: Callable[[RenderParameters], FloatArray], wanted: FloatArray
) -> RenderParameters:
    """With the hoist's ends where they are wanted [px], by the angle of view and the picture's
    place."""
    for _ in range(2):
        now = ends(zeta)
        larger = (wanted[1, 1] - wanted[0, 1]) / (now[1, 1] - now[0, 1])
        zeta = replace(zeta, view_angle=2 * math.atan(math.tan(zeta.view_angle / 2) / larger))
        across, down = (wanted.mean(axis=0) - ends(zeta).mean(axis=0)) / max(
            zeta.width, zeta.height
        )
        zeta = replace(
            zeta,
            frame_offset_x=float(np.clip(zeta.frame_offset_x + across, -1, 1)),
            frame_offset_y=float(np.clip(zeta.frame_offset_y + down, -1, 1)),
        )
    return zeta


def _exposure(shown: UInt8Array, projected: FloatArray, mesh: Mesh, look: Look) -> float:
    """Stops by which pictures of the cloth are to be lighter, so that it is on average as light as
    in the film."""
    levels = []
    for picture, corners in zip(shown, projected, strict=True):
        inside = np.zeros(picture.shape, np.uint8)
        for face in mesh.faces:
            cv2.fillConvexPoly(inside, np.rint(corners[face] - 0.5).astype(np.int32), 1)
        levels.append(to_linear(picture)[inside > 0].mean())
    return float(
        np.clip(math.log2(to_linear(look.cloth).mean() / max(float(np.mean(levels)), 1e-4)), -6, 6)
    )


def _colours(windows: list[FilmWindow]) -> UInt8Array:
    """(rows, columns) mean gray of the cloth's places: shares of its area away from the hoist,
    shares of its height."""
    total, count = np.zeros(_CELLS), np.zeros(_CELLS)
    for window in windows:
        for number in np.flatnonzero(window.shown)[::_EVERY].tolist():
            mask, frame = window.masks[number], window.frames[number].astype(np.float64)
            if window.side < 0:
                mask, frame = mask[:, ::-1], frame[:, ::-1]
            per = mask.sum(axis=0)
            if not per.any():
                continue
            u = ((np.cumsum(per) - per / 2) / per.sum())[None, :] * np.ones_like(frame)
            v = (np.cumsum(mask, axis=0) - 0.5) / np.maximum(per, 1)
            rows = np.clip((v[mask] * _CELLS[0]).astype(int), 0, _CELLS[0] - 1)
            columns = np.clip((u[mask] * _CELLS[1]).astype(int), 0, _CELLS[1] - 1)
            np.add.at(total, (rows, columns), frame[mask])
            np.add.at(count, (rows, columns), 1)
    mean = total.sum() / max(count.sum(), 1)
    return np.rint(np.where(count > 0, total / np.maximum(count, 1), mean)).astype(np.uint8)


def _beyond(window: FilmWindow, shape: tuple[int, ...]) -> BoolArray:
    """(rows, columns) what is beyond the hoist, where no cloth is: the pole among it."""
    return np.broadcast_to(
        window.side * (np.arange(shape[1]) + 0.5 - window.hoist[:, 0].mean()) < 0, shape
    )


def _behind(windows: list[FilmWindow], background: UInt8Array) -> UInt8Array:
    """The picture made fit without its cloth: medians of what is bare, and what surrounds it where
    nothing is."""
    frames = np.concatenate([window.frames[::_EVERY] for window in windows])
    masks = np.concatenate([window.masks[::_EVERY] for window in windows])
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _NEAR + 1, 2 * _NEAR + 1))
    near = np.stack([cv2.dilate(mask.astype(np.uint8), disc) for mask in masks]) > 0
    near &= ~_beyond(windows[0], masks.shape[1:])
    bare = 1 - near.mean(axis=0)
    seen = np.ma.median(np.ma.array(frames, mask=near), axis=0)
    usual = np.asarray(np.ma.filled(seen, 0.0))
    filled = cv2.inpaint(
        usual.astype(np.uint8), (bare < _BARE).astype(np.uint8), 3, cv2.INPAINT_TELEA
    )
    large = (background.shape[1], background.shape[0])
    coarse = cv2.resize(filled, large, interpolation=cv2.INTER_CUBIC)
    often = cv2.resize(bare.astype(np.float32), large, interpolation=cv2.INTER_LINEAR) > 0.7
    return np.where(often, background, coarse).astype(np.uint8)
