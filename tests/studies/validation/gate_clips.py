"""Clips that are not what a network of flags was trained on, made by code of its own: ten kinds,
six of each.

The gate's own distortions (`measure.gate.distortions`) are not used here. Films of one flag are
altered as a careless recording would be; trees, people and sheets are drawn or simulated. All of
them then go through the camera of the data
set: H.264 at a rate factor of 18 to 24, so that the coding identifies no kind.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import torch
from PIL import Image, ImageDraw
from scipy import ndimage

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.rng import child_seed, stream
from flagdata.lake import MeshSequence
from flagdata.record import VideoEncoder, decode
from flagdata.timebase import NANOSECONDS
from sim.assets import Assets
from sim.cloth.handles import Handles
from sim.cloth.material import named_material as material
from sim.cloth.mesh import grid
from sim.cloth.scene import Scene, assemble, upright
from sim.integrate import BackwardEuler
from sim.render import Meshes, Raster, plate, to_bytes
from sim.render import named_prior as prior

Films: TypeAlias = Sequence[UInt8Array]
SIZE, FRAMES, RATE = 300, 30, 25.0
_BACKGROUNDS = ("sky", "hills", "foliage", "buildings")
_WHITE = 255.0


def no_flag(films: Films, rng: np.random.Generator) -> UInt8Array:
    """A landscape without a flag, with the camera's noise and, in every other, light that changes
    as clouds pass."""
    clouds = 1 + rng.choice([0.0, 0.03]) * np.sin(
        2 * np.pi * 0.3 * np.arange(FRAMES) / RATE + rng.uniform(0, 6)
    )
    return _filmed(_landscape(rng)[None] * clouds[:, None, None], rng)


def cut_off(films: Films, rng: np.random.Generator) -> UInt8Array:
    """The picture ends in the middle of what moves."""
    film = _one(films, rng)
    top, bottom, left, right = _box(film)
    side = int(min(SIZE, 1.5 * max(bottom - top, right - left, 60)))
    middle_x, middle_y = (left + right) // 2, (top + bottom) // 2
    place = int(rng.integers(4))
    x = {0: middle_x, 1: middle_x - side}.get(place, middle_x - side // 2)
    y = {2: middle_y, 3: middle_y - side}.get(place, middle_y - side // 2)
    x0, y0, x1, y1 = max(x, 0), max(y, 0), min(x + side, SIZE), min(y + side, SIZE)
    part = film[:FRAMES, y0:y1, x0:x1]  # the largest square of it that still ends at the cut
    keep = min(part.shape[1:])
    from_right, from_bottom = place == 1, place == 3
    part = part[:, -keep:] if from_bottom else part[:, :keep]
    return _resized(part[:, :, -keep:] if from_right else part[:, :, :keep])


def moving_camera(films: Films, rng: np.random.Generator) -> UInt8Array:
    """A panning or a hand-held camera: a window of 0.75 of the frame moves over the film."""
    film, side = _one(films, rng), 225
    time = np.arange(FRAMES) / RATE
    if rng.random() < 0.5:
        speed = rng.uniform(12, 45) * rng.choice([-1, 1])  # px/s
        path = np.stack([rng.uniform(-3, 3) * time, speed * (time - time.mean())])
    else:
        path = np.zeros((2, FRAMES))
        for frequency in rng.uniform(0.3, 6.0, 6):
            path += rng.normal(0, 4.0 / (1 + frequency), (2, 1)) * np.sin(
                2 * np.pi * (frequency * time + rng.uniform(0, 1, (2, 1)))
            )
    first = (SIZE - side) / 2 + np.clip(path, -35, 35)
    seen = [
        ndimage.shift(film[k], -first[:, k], order=3, mode="nearest")[:side, :side]
        for k in range(FRAMES)
    ]
    return _resized(np.clip(np.stack(seen), 0, 255).astype(np.uint8))


def ten_frames(films: Films, rng: np.random.Generator) -> UInt8Array:
    """Ten frames: no more, forth and back, in a loop, or then standing still."""
    film = _one(films, rng)[:10]
    index = np.arange(FRAMES)
    kind = int(rng.integers(4))
    if kind == 0:
        return film
    return film[(np.abs((index + 9) % 18 - 9), index % 10, np.minimum(index, 9))[kind - 1]]


def night(films: Films, rng: np.random.Generator) -> UInt8Array:
    """Three to six stops under-exposed, with a sensor's noise at high gain, at times brightened
    afterwards."""
    film = _one(films, rng)[:FRAMES].astype(np.float64)
    light = (film / 255) ** 2.2 * 2.0 ** -rng.uniform(3, 6)
    noise = np.sqrt(0.006**2 + 0.0006 * light) * rng.standard_normal(light.shape)
    code = np.clip(light + noise, 0, 1) * 2.0 ** rng.choice([0.0, 2.0])
    return np.clip(np.rint(255 * np.clip(code, 0, 1) ** (1 / 2.2)), 0, 255).astype(np.uint8)


def ten_hertz(films: Films, rng: np.random.Generator) -> UInt8Array:
    """10 frames a second, shown at 25: every 2.5th frame, held."""
    film = _one(films, rng)
    start = int(rng.integers(len(film) - FRAMES + 1))
    return film[start + (np.floor(np.arange(FRAMES) / 2.5) * 2.5).astype(int)]


def two_flags(films: Films, rng: np.random.Generator) -> UInt8Array:
    """Two films side by side, each cut to its flag; or a second flag before the first one's
    background."""
    one, two = (_one(films, rng) for _ in range(2))
    if rng.random() < 0.5:
        halves = []
        for film in (one, two):
            _, _, left, right = _box(film)
            start = int(np.clip((left + right) // 2 - SIZE // 4, 0, SIZE // 2))
            halves.append(film[:FRAMES, :, start : start + SIZE // 2])
        return np.concatenate(halves, axis=2)
    half = SIZE // 2
    behind = _landscape(rng)
    clip = np.repeat(np.clip(behind, 0, 255).astype(np.uint8)[None], FRAMES, axis=0)
    for place, film in enumerate((one, two)):
        small = _resized(film[:FRAMES], half)
        top = int(rng.integers(SIZE - half))
        clip[:, top : top + half, place * half : (place + 1) * half] = small
    return clip


def tree(films: Films, rng: np.random.Generator) -> UInt8Array:
    """A tree in the wind: branches on branches that swing about where they grow, leaves at their
    ends."""
    behind, seed = _landscape(rng, kinds=("sky", "hills")), int(rng.integers(1 << 31))
    gust, leaf = rng.uniform(0.03, 0.12), rng.uniform(3, 7)
    dark = rng.uniform(20, 90)
    return _filmed(
        np.stack(
            [
                _tree(behind, t / RATE, np.random.default_rng(seed), gust, leaf, dark)
                for t in range(FRAMES)
            ]
        ),
        rng,
    )


def sheet(films: Films, rng: np.random.Generator) -> UInt8Array:
    """A simulated sheet held by its four corners, more or less slack, that billows and then hardly
    moves."""
    mesh = grid(width=1.4, height=1.0, columns=21, rows=15)
    start = upright(mesh)
    corners = [
        int(np.flatnonzero((mesh.rest[:, 0] == u) & (mesh.rest[:, 1] == v))[0])
        for u in (mesh.rest[:, 0].min(), mesh.rest[:, 0].max())
        for v in (mesh.rest[:, 1].min(), mesh.rest[:, 1].max())
    ]
    start = start * np.array([1.0, *rng.uniform(0.8, 0.93, 2)])
    start[:, 0] = 0.25 * np.sin(np.pi * mesh.rest[:, 0] / 1.4) * np.sin(np.pi * mesh.rest[:, 1])
    angle = rng.uniform(-1.2, 1.2)
    speed = rng.uniform(3, 9)
    held = Scene(
        mesh=mesh,
        position=start,
        material=material("camel-ponte-roma"),
        handles=Handles(vertices=tuple(corners)),
        wind=(speed * math.cos(angle), speed * math.sin(angle), 0.0),
    )
    system, state = assemble([held])
    method, positions = BackwardEuler(step=5e-3), []
    for frame in range(50 + FRAMES):
        state = method.advance(system, state, 1 / RATE)
        if frame >= 50:
            positions.append(state.position[..., 0].numpy().copy())
    times = (np.arange(FRAMES) * NANOSECONDS / RATE).astype(np.int64)
    sequence = MeshSequence(
        time=times,
        positions=np.stack(positions).astype(np.float32),
        faces=np.asarray(mesh.faces, dtype=np.int32),
        rest=np.asarray(mesh.rest, dtype=np.float32),
    )
    assets = Assets()
    zeta = replace(
        prior("cloth").draw(int(rng.integers(1 << 31)), assets), camera_radius=2.5, raster_samples=4
    )
    shown = Raster(assets=assets).render(Meshes.hanging(sequence), zeta)
    return _filmed(shown.numpy().astype(np.float64) @ (0.299, 0.587, 0.114), rng)


def person(films: Films, rng: np.random.Generator) -> UInt8Array:
    """A person who waves one arm or both, and shifts from one leg to the other."""
    behind = _landscape(rng)
    rate, both, phase = rng.uniform(0.6, 1.8), rng.random() < 0.5, rng.uniform(0, 6)
    tone, height, x = (
        rng.uniform(20, 220, 3),
        rng.uniform(0.6, 0.85) * SIZE,
        SIZE * rng.uniform(0.4, 0.6),
    )
    frames = [
        _person(
            behind, 2 * np.pi * rate * t / RATE + phase, height=height, x=x, tone=tone, both=both
        )
        for t in range(FRAMES)
    ]
    return _filmed(np.stack(frames), rng)


KINDS: dict[str, tuple[Callable[[Films, np.random.Generator], UInt8Array], tuple[str, ...]]] = {
    "no flag": (no_flag, ("no-motion",)),
    "cut off": (cut_off, ("cut-off",)),
    "moving camera": (moving_camera, ("moving-camera",)),
    "ten frames": (ten_frames, ("repeated-frames", "too-few-frames")),
    "night": (night, ("too-dark",)),
    "10 fps": (ten_hertz, ("low-frame-rate",)),
    "two flags": (two_flags, ("several-flags",)),
    "tree": (tree, ("unlike-cloth",)),
    "sheet held by four corners": (sheet, ("unlike-cloth", "scale", "no-motion")),
    "person": (person, ("unlike-cloth",)),
}
"""Name → what makes it of films (n, 300, 300) that fly one flag each, and the reasons that are
right for it."""


def made(films: Films, *, seed: int, each: int = 6) -> list[tuple[str, UInt8Array]]:
    """Name and clip of every one, coded as the data set's films are."""
    found = []
    for name, (make, _) in KINDS.items():
        for number in range(each):
            rng = stream(seed, "gate", name, number)
            clip = make(films, rng)
            found.append((name, _coded(clip, rate_factor=float(rng.uniform(18, 24)))))
    return found


def _one(films: Films, rng: np.random.Generator) -> UInt8Array:
    return films[int(rng.integers(len(films)))]


def _box(film: UInt8Array) -> tuple[int, int, int, int]:
    """Top, bottom, left and right of what moves [px]."""
    moves = film.astype(np.float32).std(axis=0) > 6
    rows, columns = np.flatnonzero(moves.any(axis=1)), np.flatnonzero(moves.any(axis=0))
    if len(rows) == 0:
        return SIZE // 3, 2 * SIZE // 3, SIZE // 3, 2 * SIZE // 3
    return int(rows[0]), int(rows[-1]), int(columns[0]), int(columns[-1])


def _landscape(rng: np.random.Generator, kinds: Sequence[str] = _BACKGROUNDS) -> FloatArray:
    """(SIZE, SIZE) gray levels of a background of the data set's kinds."""
    assets = Assets()
    zeta = prior("flags").draw(int(rng.integers(1 << 31)), assets)
    zeta = replace(zeta, background=assets.draw_background(kinds, rng))
    colours = to_bytes(torch.from_numpy(plate(assets.background(zeta.background), zeta))).numpy()
    return colours.astype(np.float64) @ (0.299, 0.587, 0.114)


def _filmed(light: FloatArray, rng: np.random.Generator) -> UInt8Array:
    """Gray levels with the data set's read and shot noise."""
    read, shot = rng.uniform(0.3, 1.5), rng.uniform(0.5, 3.0)
    sigma = np.sqrt(read**2 + shot**2 * np.clip(light, 0, None) / _WHITE)
    return np.clip(np.rint(light + sigma * rng.standard_normal(light.shape)), 0, 255).astype(
        np.uint8
    )


def _coded(clip: UInt8Array, *, rate_factor: float) -> UInt8Array:
    encoder = VideoEncoder(height=SIZE, width=SIZE, rate_factor=rate_factor, preset="veryfast")
    return np.stack(decode([encoder.encode(frame) for frame in clip], where="gate clips"))


def _resized(clip: UInt8Array, side: int = SIZE) -> UInt8Array:
    size = (side, side)
    return np.stack(
        [
            np.asarray(Image.fromarray(frame).resize(size, Image.Resampling.BICUBIC))
            for frame in clip
        ]
    )


def _tree(
    behind: FloatArray, time: float, rng: np.random.Generator, gust: float, leaf: float, dark: float
) -> FloatArray:
    """One frame; the generator begins anew in each, so that the tree is the same."""
    picture = Image.fromarray(np.clip(behind, 0, 255).astype(np.uint8)).resize((2 * SIZE, 2 * SIZE))
    draw = ImageDraw.Draw(picture)

    def grow(x: float, y: float, angle: float, length: float, width: float, depth: int) -> None:
        swing = (
            gust
            * (7 - depth) ** 0.8
            * math.sin(
                2 * math.pi * rng.uniform(0.3, 1.0) * (7 - depth) ** 0.7 * time
                + rng.uniform(0, 6.3)
            )
        )
        angle += swing
        end_x, end_y = x + length * math.cos(angle), y - length * math.sin(angle)
        draw.line((x, y, end_x, end_y), fill=int(dark), width=max(1, round(width)))
        if depth == 0:
            for _ in range(4):
                at_x, at_y = end_x + rng.normal(0, 2.5 * leaf), end_y + rng.normal(0, 2.5 * leaf)
                size = leaf * rng.uniform(0.6, 1.4)
                draw.ellipse(
                    (at_x - size, at_y - size, at_x + size, at_y + size),
                    fill=int(dark + rng.uniform(0, 90)),
                )
            return
        for spread in (-0.45, 0.05, 0.5):
            grow(
                end_x,
                end_y,
                angle + spread + rng.normal(0, 0.15),
                length * 0.74,
                width * 0.62,
                depth - 1,
            )

    grow(
        SIZE * rng.uniform(0.8, 1.2),
        2 * SIZE,
        math.pi / 2,
        SIZE * rng.uniform(0.38, 0.5),
        SIZE * 0.06,
        5,
    )
    return np.asarray(picture.resize((SIZE, SIZE), Image.Resampling.BOX), dtype=np.float64)


def _person(
    behind: FloatArray, phase: float, *, height: float, x: float, tone: FloatArray, both: bool
) -> FloatArray:
    picture = Image.fromarray(np.clip(behind, 0, 255).astype(np.uint8)).resize((2 * SIZE, 2 * SIZE))
    draw = ImageDraw.Draw(picture)
    unit, foot = 2 * height / 8, 1.95 * SIZE
    middle = 2 * x + 0.15 * unit * math.sin(phase / 2)
    hip, neck = foot - 4 * unit, foot - 6.6 * unit

    def limb(
        start: tuple[float, float], angle: float, length: float, width: float, fill: float
    ) -> tuple[float, float]:
        end = start[0] + length * math.cos(angle), start[1] - length * math.sin(angle)
        draw.line((*start, *end), fill=int(fill), width=round(width))
        return end

    for side in (-1, 1):
        draw.line(
            (middle, hip, 2 * x + side * 0.7 * unit, foot),
            fill=int(tone[0]),
            width=round(0.8 * unit),
        )
        lively = both or side == 1
        raised = (
            math.pi / 2 - side * (0.7 + 0.3 * math.sin(phase))
            if lively
            else -math.pi / 2 + side * 0.2
        )
        elbow = limb(
            (middle + side * 0.7 * unit, neck + 0.3 * unit),
            raised,
            1.4 * unit,
            0.45 * unit,
            tone[1],
        )
        swing = math.pi / 2 - side * (0.1 + 0.8 * math.sin(phase)) if lively else raised
        limb(elbow, swing, 1.3 * unit, 0.4 * unit, tone[2])
    draw.rectangle(
        (middle - 0.8 * unit, neck, middle + 0.8 * unit, hip + 0.3 * unit), fill=int(tone[1])
    )
    top = neck - 1.3 * unit
    draw.ellipse((middle - 0.5 * unit, top, middle + 0.5 * unit, neck), fill=int(tone[2]))
    return np.asarray(picture.resize((SIZE, SIZE), Image.Resampling.BOX), dtype=np.float64)


def seed_of(seed: int) -> int:
    """The seed of the clips that the gate is judged by."""
    return child_seed(seed, "gate", "clips")
