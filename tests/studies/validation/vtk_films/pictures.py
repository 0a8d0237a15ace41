"""Textures of flags and what lies behind them, drawn from a seed: nothing of them is in the
project's own assets."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flagdata.core.arrays import FloatArray, UInt8Array

_SIDE = 1024
"""Width and height of a background [px]."""


def _colours(rng: np.random.Generator, count: int) -> FloatArray:
    """(count, 3) colours that differ from each other in lightness or hue."""
    found = [rng.uniform(15, 235, 3)]
    while len(found) < count:
        other = rng.uniform(15, 235, 3)
        if min(float(np.abs(other - one).sum()) for one in found) > 130:
            found.append(other)
    return np.array(found)


def _stripes(rng: np.random.Generator, u: FloatArray, v: FloatArray) -> FloatArray:
    count = int(rng.integers(2, 8))
    place = v if rng.random() < 0.5 else u
    colours = _colours(rng, min(count, 3))
    return colours[(place * count).astype(int).clip(0, count - 1) % len(colours)]


def _cross(rng: np.random.Generator, u: FloatArray, v: FloatArray) -> FloatArray:
    colours, wide, at = _colours(rng, 2), rng.uniform(0.06, 0.12), rng.choice([0.36, 0.5])
    return colours[((np.abs(u - at) < wide / 1.5) | (np.abs(v - 0.5) < wide)).astype(int)]


def _quarters(rng: np.random.Generator, u: FloatArray, v: FloatArray) -> FloatArray:
    return _colours(rng, 4)[2 * (u > 0.5).astype(int) + (v > 0.5)]


def _disc(rng: np.random.Generator, u: FloatArray, v: FloatArray) -> FloatArray:
    colours, size = _colours(rng, 2), rng.uniform(0.15, 0.35)
    return colours[(np.hypot(1.5 * (u - 0.5), v - 0.5) < size).astype(int)]


def _canton(rng: np.random.Generator, u: FloatArray, v: FloatArray) -> FloatArray:
    colours = _colours(rng, 4)
    shown = colours[(v * 9).astype(int) % 2]
    shown[(u < 0.42) & (v < 0.5)] = colours[2]
    stars = (np.hypot((u * 18) % 1 - 0.5, ((v * 14) % 1 - 0.5)) < 0.3) & (u < 0.42) & (v < 0.5)
    shown[stars] = colours[3]
    return shown


def _plain(rng: np.random.Generator, u: FloatArray, v: FloatArray) -> FloatArray:
    return np.broadcast_to(_colours(rng, 1)[0], (*u.shape, 3)).copy()


TEXTURES: dict[str, Callable[[np.random.Generator, FloatArray, FloatArray], FloatArray]] = {
    "stripes": _stripes,
    "cross": _cross,
    "quarters": _quarters,
    "disc": _disc,
    "canton": _canton,
    "plain": _plain,
}


def texture(kind: str, rng: np.random.Generator) -> UInt8Array:
    """(400, 600, 3) of a flag: u from the hoist, v from the top, with the weave's faint
    unevenness."""
    v, u = np.meshgrid((np.arange(400) + 0.5) / 400, (np.arange(600) + 0.5) / 600, indexing="ij")
    shown = TEXTURES[kind](rng, u, v) * (1 + 0.04 * _noise(rng, (400, 600), 1.2)[..., None])
    return _bytes(shown)


def _noise(rng: np.random.Generator, size: tuple[int, int], slope: float) -> FloatArray:
    """Of mean 0 and deviation 1, its spectrum falling with a power of frequency."""
    height, width = size
    frequency = np.hypot(np.fft.fftfreq(height)[:, None], np.fft.rfftfreq(width)[None])
    frequency[0, 0] = np.inf
    phases = rng.normal(size=frequency.shape) + 1j * rng.normal(size=frequency.shape)
    made = np.fft.irfft2(phases / frequency**slope, s=size)
    return (made - made.mean()) / made.std()


def _sky(rng: np.random.Generator) -> FloatArray:
    height = np.linspace(1, 0, _SIDE)[:, None, None]
    top, low = (
        np.array([50, 105, 190]) * rng.uniform(0.8, 1.15),
        np.array([175, 200, 228]) * rng.uniform(0.85, 1.05),
    )
    shown = low + (top - low) * height
    clouds = (
        np.clip(_noise(rng, (_SIDE, _SIDE), rng.uniform(1.5, 2.0)) - rng.uniform(-0.4, 1.2), 0, 1.5)
        / 1.5
    )
    return shown + (np.array([238, 240, 243]) - shown) * clouds[..., None] * 0.9


def _overcast(rng: np.random.Generator) -> FloatArray:
    return (
        np.array([190, 195, 200]) * rng.uniform(0.75, 1.1)
        + 9 * _noise(rng, (_SIDE, _SIDE), 1.8)[..., None]
    )


def _foliage(rng: np.random.Generator, rows: int) -> FloatArray:
    leaves = 0.7 * _noise(rng, (rows, _SIDE), 0.8) + 0.5 * _noise(rng, (rows, _SIDE), 1.6)
    return np.array([58, 88, 42]) * np.clip(1 + 0.4 * leaves, 0.15, 2.2)[..., None]


def _hedge(rng: np.random.Generator) -> FloatArray:
    """Foliage up to an uneven edge, the sky above."""
    shown, green = _sky(rng), _foliage(rng, _SIDE)
    edge = _SIDE * rng.uniform(0.3, 0.75) + 25 * _noise(rng, (1, _SIDE), 1.2)[0]
    below = np.arange(_SIDE)[:, None] > edge[None]
    shown[below] = green[below]
    return shown


def _houses(rng: np.random.Generator) -> FloatArray:
    """Fronts with windows, roofs, and the sky above."""
    shown, left = _overcast(rng) if rng.random() < 0.5 else _sky(rng), 0
    while left < _SIDE:
        wide, high = int(rng.uniform(90, 240)), int(rng.uniform(0.35, 0.75) * _SIDE)
        wall = rng.uniform(70, 210) * rng.uniform(0.85, 1.0, 3) * np.array([1.05, 0.97, 0.88])
        front = np.broadcast_to(wall, (high, wide, 3)) * (
            1 + 0.05 * _noise(rng, (high, wide), 0.6)[..., None]
        )
        y, x = np.meshgrid(np.arange(high), np.arange(wide), indexing="ij")
        front[((x % 45) > 14) & ((x % 45) < 36) & ((y % 62) > 18) & ((y % 62) < 50)] *= rng.uniform(
            0.3, 0.6
        )
        shown[_SIDE - high :, left : left + wide] = front[:, : _SIDE - left]
        left += wide
    return shown


def _field(rng: np.random.Generator) -> FloatArray:
    """A meadow up to the horizon, hills, the sky."""
    shown, horizon = _sky(rng), int(_SIDE * rng.uniform(0.6, 0.85))
    hills = horizon - 60 - 25 * _noise(rng, (1, _SIDE), 1.7)[0]
    shown[(np.arange(_SIDE)[:, None] > hills[None])] = np.array([96, 118, 112]) * rng.uniform(
        0.7, 1.1
    )
    rows = _SIDE - horizon
    shown[horizon:] = np.array([92, 112, 58]) * (
        1 + 0.16 * _noise(rng, (rows, _SIDE), 0.7)[..., None]
    )
    return shown


BACKGROUNDS: dict[str, Callable[[np.random.Generator], FloatArray]] = {
    "sky": _sky,
    "overcast": _overcast,
    "hedge": _hedge,
    "houses": _houses,
    "field": _field,
}


def background(kind: str, rng: np.random.Generator) -> UInt8Array:
    """(1024, 1024, 3) of what lies behind a flag."""
    return _bytes(BACKGROUNDS[kind](rng))


def _bytes(shown: FloatArray) -> UInt8Array:
    return np.clip(np.rint(shown), 0, 255).astype(np.uint8)
