"""Films that nobody can measure a wind by, each for one known reason: thirteen kinds, six of each.

Most are made of the films of `designs`, as a careless recording would be; of some VTK draws a scene
of its own. The list was fixed before the first of them was judged. Those of even number are for
choosing thresholds, the others judge.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

from flagdata.core.arrays import BoolArray, UInt8Array
from flagdata.core.rng import stream
from tests.evidence import REFERENCE
from tests.studies.validation.gate_clips import person
from tests.studies.validation.vtk_films.bodies import shaking, tree
from tests.studies.validation.vtk_films.designs import SEED, Design, designs, scene_of
from tests.studies.validation.vtk_films.making import make, path_of
from tests.studies.validation.vtk_films.pictures import background, texture
from tests.studies.validation.vtk_films.runs import read
from tests.studies.validation.vtk_films.scene import Body, Scene, developed, pictures, write

EACH = 6
_SECONDS = 4.0
_MOVES = 12.0
"""Gray levels from the median in time above which a pixel shows cloth that moves."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Source:
    """A film that a defect is made of, or what takes its place."""

    frames: UInt8Array
    rate: Fraction

    def of(self, frames: UInt8Array) -> Source:
        """The same with other frames."""
        return replace(self, frames=frames)


@dataclass(frozen=True, kw_only=True, eq=False)
class Makings:
    """What defects are made of.

    Attributes:
        python: of VTK's environment.
        folder: of the films of `designs`.
        number: of the defect, from 0.
        rng: its own.
    """

    python: Path
    folder: Path
    number: int
    rng: np.random.Generator

    def design(self) -> Design:
        """One of a film in the usual picture and at a rate up to 30 Hz."""
        usual = [
            one
            for one in designs()
            if one.part == "coverage"
            and one.size == (640, 480)
            and float(one.rate) <= 30
            and not one.shutter
        ]
        return usual[int(self.rng.integers(len(usual)))]

    def film(self) -> Source:
        """Its first seconds."""
        design = self.design()
        make([design], folder=self.folder, python=self.python)
        with av.open(str(path_of(design, self.folder))) as container:
            rate = container.streams.video[0].average_rate
            assert rate is not None
            found = []
            for frame in container.decode(video=0):
                if len(found) >= _SECONDS * rate:
                    break
                found.append(frame.to_ndarray(format="rgb24"))
        return Source(frames=np.stack(found), rate=rate)

    def scene(self, **change: object) -> Scene:
        """What a design shows, with something else in it."""
        design = replace(self.design(), duration=3.6, start=0.2, **change)  # type: ignore[arg-type]
        return scene_of(design, read(REFERENCE, design.run))

    def drawn(self, scene: Scene) -> Source:
        """A scene of its own."""
        shown = [developed(one, scene.camera, self.rng) for one in pictures(self.python, scene)]
        return Source(frames=np.stack(shown), rate=scene.rate)


def _moving(frames: UInt8Array) -> BoolArray:
    """(n, height, width) where a frame differs from the median in time."""
    gray = frames.mean(axis=3, dtype=np.float32)
    away = np.abs(gray - np.median(gray[::5], axis=0)) > _MOVES
    return np.stack(
        [
            cv2.morphologyEx(one.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3))) > 0
            for one in away
        ]
    )


def _box(moving: BoolArray) -> tuple[int, int, int, int]:
    """Left, top, right and bottom of what moves in a twentieth of the frames or more."""
    often = moving.mean(axis=0) > 0.05
    rows, columns = np.flatnonzero(often.any(axis=1)), np.flatnonzero(often.any(axis=0))
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


def _even(frames: UInt8Array) -> UInt8Array:
    """With an even height and width, at least 240 px of the smaller one."""
    height, width = frames.shape[1:3]
    finer = max(1.0, 240 / min(height, width))
    size = (2 * round(width * finer / 2), 2 * round(height * finer / 2))
    return np.stack([cv2.resize(one, size, interpolation=cv2.INTER_CUBIC) for one in frames])


def cut_off(makings: Makings) -> Source:
    """The picture ends in the middle of the cloth, on one of four sides."""
    film = makings.film()
    left, top, right, bottom = _box(_moving(film.frames))
    share = makings.rng.uniform(0.35, 0.65)
    side = makings.number % 4
    x, y = round(left + share * (right - left)), round(top + share * (bottom - top))
    part = {
        0: film.frames[:, :, :x],
        1: film.frames[:, :, x:],
        2: film.frames[:, :y],
        3: film.frames[:, y:],
    }[side]
    return film.of(_even(part))


def tip_leaves(makings: Makings) -> Source:
    """The cloth's free end is beyond the picture's edge in a tenth to a half of the frames."""
    film = makings.film()
    moving = _moving(film.frames)
    columns = np.arange(moving.shape[2])
    right = np.array([columns[one.sum(axis=0) > 2].max(initial=0) for one in moving])
    left = np.array([columns[one.sum(axis=0) > 2].min(initial=columns[-1]) for one in moving])
    share = makings.rng.uniform(0.1, 0.5)
    if np.ptp(right) > np.ptp(left):  # the end that moves more is the free one
        return film.of(_even(film.frames[:, :, : int(np.quantile(right, 1 - share))]))
    return film.of(_even(film.frames[:, :, int(np.quantile(left, share)) :]))


def close_up(makings: Makings) -> Source:
    """Cloth fills the picture."""
    film = makings.film()
    left, top, right, bottom = _box(_moving(film.frames))
    wide, high = 0.3 * (right - left), 0.3 * (bottom - top)
    x, y = (left + right) / 2 + makings.rng.uniform(-0.1, 0.1) * wide, (top + bottom) / 2
    part = film.frames[
        :, round(y - high / 2) : round(y + high / 2), round(x - wide / 2) : round(x + wide / 2)
    ]
    return film.of(_even(part))


def moving_camera(makings: Makings) -> Source:
    """A hand-held or a panning camera, and behind the flag an even sky that shows no motion; no
    pole."""
    scene = makings.scene(texture="stripes")
    times = np.arange(scene.frames) / float(scene.rate)
    turned = shaking(times, float(makings.rng.uniform(6, 15)), makings.rng)
    if makings.number % 2:
        turned = np.stack(
            [makings.rng.choice([-1, 1]) * 40 * (times - times.mean()), *turned.T[1:]], axis=1
        )
    sky = np.full((64, 64, 3), makings.rng.uniform(130, 220), dtype=np.uint8)
    view = replace(scene.view, turned=turned)
    return makings.drawn(
        replace(scene, view=view, subframes=1, bodies=[view.plate(sky), scene.bodies[2]])
    )


def repeated(makings: Makings) -> Source:
    """Every picture is shown two to four times, or two of three at random repeat the one before."""
    film = makings.film()
    count = len(film.frames)
    if makings.number % 2:
        times = int(makings.rng.integers(2, 5))
        return film.of(film.frames[np.arange(count) // times * times])
    fresh = makings.rng.random(count) < 1 / 3
    return film.of(film.frames[np.maximum.accumulate(np.where(fresh, np.arange(count), 0))])


def slow(makings: Makings) -> Source:
    """Eight to twelve frames a second."""
    film = makings.film()
    rate = int(makings.rng.integers(8, 13))
    index = np.arange(math.floor(_SECONDS * rate)) * float(film.rate) / rate
    return Source(
        frames=film.frames[np.round(index).astype(int).clip(0, len(film.frames) - 1)],
        rate=Fraction(rate),
    )


def dark(makings: Makings) -> Source:
    """Five to eight stops under-exposed, with a sensor's noise at high gain, at times brightened
    afterwards."""
    film = makings.film()
    stops, gain = makings.rng.uniform(5, 8), 2.0 ** makings.rng.choice([0.0, 3.0])
    shown = []
    for frame in film.frames:
        light = (frame.astype(np.float32) / 255) ** 2.2 * 2.0**-stops
        noise = np.sqrt(0.004**2 + 0.0006 * light) * makings.rng.standard_normal(
            light.shape, dtype=np.float32
        )
        shown.append(np.rint(255 * np.clip((light + noise) * gain, 0, 1) ** (1 / 2.2)))
    return film.of(np.stack(shown).astype(np.uint8))


def overlapping(makings: Makings) -> Source:
    """One flag in front of another, which sticks out behind it."""
    scene = makings.scene(texture="cross")
    cloth = scene.bodies[2]
    aside = float(makings.rng.uniform(0.4, 0.8)) * (1 if makings.number % 2 else -1)
    place = (
        aside * scene.view.right
        - 0.9 * scene.view.outward
        + np.array([0.0, 0.0, makings.rng.uniform(-0.3, 0.3)])
    )
    other = Body(
        positions=cloth.positions[::-1] + place,
        faces=cloth.faces,
        uv=cloth.uv,
        texture=texture("stripes", makings.rng),
    )
    stand = scene.bodies[1]
    return makings.drawn(
        replace(
            scene, bodies=[*scene.bodies, other, replace(stand, positions=stand.positions + place)]
        )
    )


def small(makings: Makings) -> Source:
    """A flag whose length is 12 to 22 px of the picture."""
    return makings.drawn(
        makings.scene(share=float(makings.rng.uniform(12, 22)) / 480, aside=(0.0, 0.0))
    )


def no_flag(makings: Makings) -> Source:
    """Trees in the wind, water, or a person who waves, whose drawing loops."""
    if makings.number % 3 == 0:
        scene = makings.scene()
        times = np.arange(scene.frames) / float(scene.rate)
        trees = [one for _ in range(2) for one in tree(times, scene.view, makings.rng)]
        moved = [
            replace(one, positions=one.positions - 0.7 * scene.view.extent * scene.view.right)
            for one in trees[2:]
        ]
        return makings.drawn(
            replace(scene, subframes=1, bodies=[scene.bodies[0], *trees[:2], *moved])
        )
    if makings.number % 3 == 1:
        return Source(frames=_water(makings.rng), rate=Fraction(25))
    gray = _longer(makings.rng)
    return Source(frames=np.repeat(gray[..., None], 3, axis=3), rate=Fraction(25))


def _longer(rng: np.random.Generator) -> UInt8Array:
    """A person for four seconds: the drawing of `gate_clips` forth and back, three times."""
    once = person([], rng)
    there = np.concatenate([once, once[-2:0:-1]])
    return np.concatenate([there, there])[: round(_SECONDS * 25)]


def _water(rng: np.random.Generator) -> UInt8Array:
    """Waves that run over the lower part of a picture, finer towards the horizon."""
    shown = cv2.resize(background("field", rng), (640, 480), interpolation=cv2.INTER_AREA)
    horizon = int(rng.uniform(0.3, 0.6) * 480)
    y, x = np.meshgrid(
        np.arange(horizon, 480) - horizon + 8.0, np.arange(640) - 320.0, indexing="ij"
    )
    far, across = 4000 / y, 12 * x / y
    frames = []
    waves = [
        (*rng.normal(0, (0.06, 0.5)), rng.uniform(0.4, 2.0), rng.uniform(0, 6)) for _ in range(24)
    ]
    for k in range(round(_SECONDS * 25)):
        level = (
            sum(np.sin(a * far + b * across - 2 * np.pi * f * k / 25 + p) for a, b, f, p in waves)
            / 5
        )
        frame = shown.copy()
        frame[horizon:] = np.clip(np.array([60, 85, 105]) * (1 + 0.35 * level[..., None]), 0, 255)
        frames.append(frame)
    return np.stack(frames)


def still(makings: Makings) -> Source:
    """One picture of a flag, with the camera's noise."""
    film = makings.film()
    noise = makings.rng.standard_normal(
        (len(film.frames), *film.frames.shape[1:3], 1), dtype=np.float32
    )
    return film.of(
        np.clip(film.frames[:1] + makings.rng.uniform(0.5, 2) * noise, 0, 255).astype(np.uint8)
    )


def scenes(makings: Makings) -> Source:
    """A cut to another film every 0.6 to 1 s."""
    one, other = makings.film(), makings.film()
    while (one.frames[0].shape == other.frames[0].shape) and np.array_equal(
        one.frames[0], other.frames[0]
    ):
        other = makings.film()
    count = min(len(one.frames), len(other.frames))
    each = round(float(makings.rng.uniform(0.6, 1.0)) * float(one.rate))
    second = (np.arange(count) // each) % 2 == 1
    return one.of(np.where(second[:, None, None, None], other.frames[:count], one.frames[:count]))


def looped(makings: Makings) -> Source:
    """0.4 to 0.9 s of a film, again and again, or forth and back."""
    film = makings.film()
    length = round(float(makings.rng.uniform(0.4, 0.9)) * float(film.rate))
    index = np.arange(len(film.frames))
    if makings.number % 2:
        return film.of(film.frames[index % length])
    there = index % (2 * length - 2)
    return film.of(film.frames[np.where(there < length, there, 2 * length - 2 - there)])


DEFECTS: Mapping[str, tuple[Callable[[Makings], Source], tuple[str, ...]]] = {
    "cut off": (cut_off, ("cut-off",)),
    "tip leaves": (tip_leaves, ("cut-off",)),
    "close-up": (close_up, ("cut-off", "scale")),
    "moving camera": (moving_camera, ("moving-camera",)),
    "repeated frames": (repeated, ("repeated-frames", "low-frame-rate")),
    "low rate": (slow, ("low-frame-rate",)),
    "dark": (dark, ("too-dark",)),
    "overlapping flags": (overlapping, ("several-flags",)),
    "small": (small, ("scale",)),
    "no flag": (no_flag, ("no-motion", "unlike-cloth", "unlike-training", "repeated-frames")),
    "still": (still, ("no-motion",)),
    "scenes": (scenes, ("scene-cut",)),
    "loop": (looped, ("repeated-frames",)),
}
"""Name → what makes it, and the reasons that are right for it."""


def names() -> Sequence[tuple[str, int]]:
    """Kind and number of each."""
    return [(kind, number) for kind in DEFECTS for number in range(EACH)]


def tuned(number: int) -> bool:
    """Whether thresholds may be chosen by it; it judges otherwise."""
    return number % 2 == 0


def defect(kind: str, number: int, *, folder: Path, python: Path) -> Path:
    """The file of one, made where it is missing.

    Raises:
        UnusableError: VTK failed.
    """
    path = folder / f"defect-{kind.replace(' ', '-')}-{number}.mp4"
    if not path.exists():
        rng = stream(SEED, "films", "defects", kind, number)
        made = DEFECTS[kind][0](Makings(python=python, folder=folder, number=number, rng=rng))
        partial = path.with_suffix(f".{os.getpid()}.part.mp4")
        write(partial, made.frames, rate=made.rate, crf=int(rng.integers(20, 27)))
        partial.replace(path)
    return path
