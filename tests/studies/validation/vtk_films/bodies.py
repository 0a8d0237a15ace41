"""What stands beside a flag, what falls on it, and how the camera is held."""

from __future__ import annotations

import math

import numpy as np

from flagdata.core.arrays import FloatArray
from tests.studies.validation.vtk_films.scene import Body, Light, View

_SIDES = 16


def pole(radius: float, *, top: float, gray: float) -> Body:
    """Along the hoist at x = y = 0, behind it by its radius, from 6 m below."""
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    ring = np.stack(
        [radius * np.cos(angle) - radius, radius * np.sin(angle), np.zeros(_SIDES)], axis=1
    )
    low, high = ring + np.array([0.0, 0.0, -6.0]), ring + np.array([0.0, 0.0, top])
    k, following = np.arange(_SIDES), (np.arange(_SIDES) + 1) % _SIDES
    sides = np.concatenate(
        [
            np.stack([k, following, following + _SIDES], 1),
            np.stack([k, following + _SIDES, k + _SIDES], 1),
        ]
    )
    cap = np.stack([np.full(_SIDES - 2, _SIDES), _SIDES + k[1:-1], _SIDES + k[2:]], axis=1)
    return Body(
        positions=np.concatenate([low, high])[None],
        faces=np.concatenate([sides, cap]),
        colour=(gray, gray, gray),
        gloss=0.3,
    )


def sun(view: View, rng: np.random.Generator) -> list[Light]:
    """One from the camera's half of the sky, a weaker one from the other side."""
    azimuth = math.atan2(view.outward[1], view.outward[0]) + float(rng.uniform(-1.2, 1.2))
    height = float(rng.uniform(0.3, 1.1))
    main = (
        math.cos(azimuth) * math.cos(height),
        math.sin(azimuth) * math.cos(height),
        math.sin(height),
    )
    warm = float(rng.uniform(0.85, 1.0))
    return [
        Light(
            towards=main,
            intensity=float(rng.uniform(0.8, 1.15)),
            colour=(1.0, 0.5 + 0.5 * warm, warm),
        ),
        Light(
            towards=(-main[0], -main[1], 0.4),
            intensity=float(rng.uniform(0.3, 0.6)),
            colour=(0.85, 0.92, 1.0),
        ),
    ]


def smooth(
    times: FloatArray, rng: np.random.Generator, *, slowest: float, fastest: float
) -> FloatArray:
    """(n,) of zero mean and unit deviation: twelve sines, of frequencies [Hz] evenly spread by
    their logarithm."""
    frequency = np.exp(rng.uniform(math.log(slowest), math.log(fastest), 12))
    waves = np.sin(2 * np.pi * (frequency * times[:, None] + rng.random(12))) / frequency**0.5
    total = waves.sum(axis=1)
    return (total - total.mean()) / total.std()


def shaking(times: FloatArray, strength: float, rng: np.random.Generator) -> FloatArray:
    """(n, 3) of a hand: root mean square of each direction [px], and a tenth of a degree of roll
    for each pixel."""
    parts = [smooth(times, rng, slowest=0.2, fastest=6.0) for _ in range(3)]
    return strength * np.stack(parts, axis=1) * np.array([1.0, 1.0, 0.1])


def tree(
    times: FloatArray, view: View, rng: np.random.Generator, *, leaves: int = 1800
) -> list[Body]:
    """One that sways beside the flag, at the picture's edge and behind."""
    aside, inward = view.right, -view.outward
    half = 0.5 * view.extent * view.size[0] / min(view.size) * (view.distance + 4.0) / view.distance
    foot = np.array(view.target) + 4.0 * inward + (0.8 * half) * aside
    crown = rng.normal(size=(leaves, 3)) * np.array([0.28, 0.28, 0.4]) * half * 0.6
    crown[:, 2] += 0.1 * half
    height = np.clip((crown[:, 2] + half) / (2 * half), 0.1, 1.0)
    trunk_sway = 0.06 * half * smooth(times, rng, slowest=0.3, fastest=1.2)[:, None] * height**1.5
    own = np.stack([smooth(times, rng, slowest=0.8, fastest=4.0) for _ in range(24)], axis=1)[
        :, rng.integers(24, size=leaves)
    ]
    middle = foot + crown + (trunk_sway + 0.012 * half * own)[..., None] * aside
    size = 0.03 * half * rng.uniform(0.6, 1.4, (leaves, 1, 1))
    corner = rng.normal(size=(leaves, 3, 3))
    corner /= np.linalg.norm(corner, axis=2, keepdims=True)
    positions = (middle[:, :, None] + (size * corner)[None]).reshape(len(times), -1, 3)
    stem = (
        np.array([[-0.04, 0.0, -2.5], [0.04, 0.0, -2.5], [0.02, 0.0, 0.3], [-0.02, 0.0, 0.3]])
        * half
    )
    stand = foot + stem[:, :1] * aside + stem[:, 2:] * np.array([0.0, 0.0, 1.0])
    return [
        Body(
            positions=positions,
            faces=np.arange(3 * leaves).reshape(-1, 3),
            colour=(0.22, 0.38, 0.14),
        ),
        Body(
            positions=stand[None], faces=np.array([[0, 1, 2], [0, 2, 3]]), colour=(0.3, 0.22, 0.15)
        ),
    ]
