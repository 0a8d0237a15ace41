"""Procedural backgrounds: skies, hills, foliage, buildings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.assets.noise import fractal, smoothstep
from sim.assets.seeded import Seeded

_ROWS, _COLUMNS = 500, 640  # px


def _sky(rng: np.random.Generator) -> NDArray[np.float64]:
    zenith = np.array([0.25, 0.45, 0.8]) * rng.uniform(0.6, 1.2)
    horizon = np.array([0.75, 0.85, 0.95]) * rng.uniform(0.8, 1.05)
    height = np.linspace(1, 0, _ROWS)[:, None, None] ** rng.uniform(0.5, 1.5)
    clear = horizon + (zenith - horizon) * height
    cover = rng.uniform(-1.5, 1.5)
    cloud = smoothstep(cover - 0.8, cover + 0.8, fractal(rng, _ROWS, _COLUMNS, slope=1.7, stretch=1 / 1.8))[:, :, None]
    light = rng.uniform(0.55, 1.0) + 0.06 * fractal(rng, _ROWS, _COLUMNS, slope=1.5)[:, :, None]
    return clear * (1 - cloud) + light * cloud


def _hills(rng: np.random.Generator) -> NDArray[np.float64]:
    return _sky(rng)


SKY = Seeded(kind="sky", paint=_sky)
HILLS = Seeded(kind="hills", paint=_hills)
FOLIAGE = Seeded(kind="foliage", paint=_hills)
BUILDINGS = Seeded(kind="buildings", paint=_hills)
