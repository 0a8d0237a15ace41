"""Known distortions of simulated films, by which the gate learns what clips look like that are not
like them.

Anau Montel, Alvey and Weniger (Phys. Rev. D 111, 083013, 2025; arXiv 2412.15100) test a simulator
against many stated
distortions of it: each has a classifier of distorted against plain simulations, whose
log-likelihood ratio is the test's statistic. The strengths are drawn anew for each clip, from
hardly visible to gross.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from flagdata.core.arrays import Float32Array, FloatArray, UInt8Array
from measure.gate.clip_statistics import SIDE, ClipStatistics

Film = UInt8Array
Distort = Callable[[Film, Film, np.random.Generator, int], Film]
"""A film (n, height, width), another one, a source of randomness, the frames wanted → a clip of so
many frames."""
Pixels = Float32Array | FloatArray


@dataclass(frozen=True, kw_only=True)
class Distortion:
    """A change that makes a clip unlike the simulated ones.

    Attributes:
        reason: kind of `measure.gate.reasons` that it represents.
        apply: makes it.
    """

    reason: str
    apply: Distort


def _at_rest(film: Film, second: Film, rng: np.random.Generator, count: int) -> Film:
    """Holds the picture at rest, with noise: nothing moves."""
    picture = np.median(film, axis=0)
    return _noisy(np.repeat(picture[None], count, axis=0), rng.uniform(0.5, 4), rng)


def _cut(film: Film, second: Film, rng: np.random.Generator, count: int) -> Film:
    """Cuts the picture through the moving part, on one side or two."""
    side = min(film.shape[1:])
    mass = np.asarray(ndimage.zoom(np.sqrt(ClipStatistics.of(film).excess), side / SIDE, order=1))
    ends = []
    for profile in (mass.sum(axis=0), mass.sum(axis=1)):
        share = np.cumsum(profile) / max(float(profile.sum()), 1e-6)
        ends.append(int(np.searchsorted(share, rng.uniform(0.25, 0.65))))
    size = int(side * rng.uniform(0.4, 0.7))
    x, y = ends
    left, top = rng.choice([x, x - size]), rng.choice([y, y - size])
    if rng.random() < 0.5:
        middle = int(np.clip(y - size // 2, 0, side - size))
        left, top = (
            (left, middle)
            if rng.random() < 0.5
            else (int(np.clip(x - size // 2, 0, side - size)), top)
        )
    left, top = int(np.clip(left, 0, side - size)), int(np.clip(top, 0, side - size))
    return film[:count, top : top + size, left : left + size]


def _camera(film: Film, second: Film, rng: np.random.Generator, count: int) -> Film:
    """Lets the camera drift, sway or shake."""
    time = np.arange(count)
    side = min(film.shape[1:])
    drift = rng.uniform(-0.006, 0.006, (2, 1)) * side * time * rng.choice([0, 1])
    turn = 2 * np.pi * rng.uniform(0.02, 0.15, (2, 1)) * time + rng.uniform(0, 6, (2, 1))
    swing = rng.uniform(0.003, 0.03, (2, 1)) * side * np.sin(turn) * rng.choice([0, 1])
    shake = rng.normal(0, rng.uniform(0.001, 0.01) * side, (2, count))
    path = drift + swing + shake
    margin = int(np.ceil(np.abs(path).max())) + 1
    moved = np.stack([_shift_frames(film[k], path[:, k]) for k in range(count)])
    margin = min(margin, side // 4)
    return moved[:, margin:-margin, margin:-margin]


def _repeat_frames(film: Film, second: Film, rng: np.random.Generator, count: int) -> Film:
    """Repeats a few frames in a loop, forth and back, or followed by the last one."""
    few = int(rng.integers(5, 14))
    order = rng.choice(3)
    index = np.arange(count)
    if order == 0:
        index = index % few
    elif order == 1:
        index = np.abs((index + few - 1) % (2 * few - 2) - (few - 1))
    else:
        index = np.minimum(index, few - 1)
    return _noisy(film[index], rng.uniform(0, 1.5) * rng.choice([0, 1]), rng)


def _low_rate(film: Film, second: Film, rng: np.random.Generator, count: int) -> Film:
    """Lowers the frame rate, each frame shown until the next."""
    step = rng.uniform(1.7, 5)
    index = (np.floor(np.arange(count) / step) * step).astype(int)
    return _noisy(film[index], rng.uniform(0, 1.0) * rng.choice([0, 1]), rng)


def _dark(film: Film, second: Film, rng: np.random.Generator, count: int) -> Film:
    """Removes light: dark, or made bright again with its noise."""
    gain = 10 ** rng.uniform(-1.7, -0.5)
    dark = _noisy(film[:count] * gain, rng.uniform(1, 6), rng)
    lift = rng.choice([1.0, rng.uniform(1, 1 / gain)])
    return np.clip(dark * lift, 0, 255).astype(np.uint8)


def _pair(film: Film, second: Film, rng: np.random.Generator, count: int) -> Film:
    """Puts two films beside or above each other, in one picture."""
    side = min(film.shape[1], second.shape[1])
    first_square, second_square = film[:count, :side, :side], second[:count, :side, :side]
    keep = int(side * rng.uniform(0.6, 0.95))
    low = (side - keep) // 2
    if rng.random() < 0.7:
        joined = np.concatenate(
            [first_square[:, :, low : low + keep], second_square[:, :, low : low + keep]], axis=2
        )
    else:
        joined = np.concatenate(
            [first_square[:, low : low + keep], second_square[:, low : low + keep]], axis=1
        )
    return _square_film(joined)


def _small(film: Film, second: Film, rng: np.random.Generator, count: int) -> Film:
    """Makes the flag small, as from far away, before its own surroundings, still and mirrored."""
    share = rng.uniform(0.2, 0.45)
    small = np.stack([np.asarray(ndimage.zoom(frame, share, order=1)) for frame in film[:count]])
    high, wide = small.shape[1:]
    full = int(min(film.shape[1:]))
    free_y, free_x = full - high, full - wide
    top, left = int(rng.uniform(0.25, 0.75) * free_y), int(rng.uniform(0.25, 0.75) * free_x)
    rest = np.pad(small[0], ((top, free_y - top), (left, free_x - left)), mode="edge")
    clip = np.repeat(rest[None], count, axis=0)
    clip[:, top : top + high, left : left + wide] = small
    return clip


def _swaying(film: Film, second: Film, rng: np.random.Generator, count: int) -> Film:
    """Lets the background sway, each part by itself, as foliage does; nothing flutters."""
    picture = np.median(film, axis=0)
    high, wide = picture.shape
    length = rng.uniform(0.01, 0.08) * high
    where = ndimage.gaussian_filter(rng.normal(size=picture.shape), 0.12 * high)
    mask = ndimage.gaussian_filter(
        (where > np.quantile(where, rng.uniform(0.3, 0.8))).astype(float), 3
    )
    waves = np.zeros((2, count, high, wide))
    for _ in range(3):
        pattern = ndimage.gaussian_filter(rng.normal(size=(2, high, wide)), (0, length, length))
        phase = ndimage.gaussian_filter(rng.normal(size=(high, wide)), 2 * length)
        phase *= rng.uniform(0, 3) / max(float(phase.std()), 1e-9)
        turn = 2 * np.pi * rng.uniform(0.02, 0.25) * np.arange(count)[:, None, None] + phase
        waves += (pattern / pattern.std())[:, None] * np.sin(turn)
    reach = rng.uniform(0.003, 0.02) * high
    grid = np.mgrid[:high, :wide]
    clip = np.stack(
        [
            ndimage.map_coordinates(
                picture, grid + reach * mask * waves[:, k], order=1, mode="nearest"
            )
            for k in range(count)
        ]
    )
    return _noisy(clip, rng.uniform(0.3, 2), rng)


def _patchwork(film: Film, second: Film, rng: np.random.Generator, count: int) -> Film:
    """Takes each patch of the film from a different instant, so that no wave travels from one to
    the next."""
    clip = film[:count].copy()
    size = int(rng.uniform(0.05, 0.15) * film.shape[1])
    there_and_back = np.concatenate([np.arange(len(film)), np.arange(len(film))[-2:0:-1]])
    for top in range(0, film.shape[1], size):
        for left in range(0, film.shape[2], size):
            index = there_and_back[
                (int(rng.integers(len(film))) + np.arange(count)) % len(there_and_back)
            ]
            clip[:, top : top + size, left : left + size] = film[
                index, top : top + size, left : left + size
            ]
    return clip


def _shift_frames(frame: Film, offset: FloatArray) -> Film:
    return np.asarray(ndimage.shift(frame, offset, order=1, mode="nearest"), dtype=np.uint8)


def _noisy(clip: Pixels | Film, sigma: float, rng: np.random.Generator) -> Film:
    noise = rng.standard_normal(clip.shape, dtype=np.float32) * np.float32(sigma)
    return np.clip(np.round(clip + noise), 0, 255).astype(np.uint8)


def _square_film(clip: Film) -> Film:
    """Averages the longer sides down to the shorter one's length."""
    side = min(clip.shape[1:])
    zoom = (1, side / clip.shape[1], side / clip.shape[2])
    blurred = ndimage.gaussian_filter(
        clip.astype(np.float32), (0, 0.4 * (1 / zoom[1] - 1), 0.4 * (1 / zoom[2] - 1))
    )
    return np.clip(np.asarray(ndimage.zoom(blurred, zoom, order=1)), 0, 255).astype(np.uint8)


DISTORTIONS: dict[str, Distortion] = {
    "still": Distortion(reason="no-motion", apply=_at_rest),
    "cut": Distortion(reason="cut-off", apply=_cut),
    "camera": Distortion(reason="moving-camera", apply=_camera),
    "repeated": Distortion(reason="repeated-frames", apply=_repeat_frames),
    "held": Distortion(reason="low-frame-rate", apply=_low_rate),
    "dark": Distortion(reason="too-dark", apply=_dark),
    "pair": Distortion(reason="several-flags", apply=_pair),
    "small": Distortion(reason="scale", apply=_small),
    "swaying": Distortion(reason="unlike-cloth", apply=_swaying),
    "patchwork": Distortion(reason="unlike-cloth", apply=_patchwork),
}
