"""Procedural textures of cloth: plain weave, stripes, checks, prints, all with the unevenness of
yarns."""

from __future__ import annotations

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from sim.assets.colour import hue
from sim.assets.seeded import Seeded
from sim.assets.smooth_fields import fractal

_SIZE = 512  # px


def _dyes(rng: np.random.Generator, count: int) -> FloatArray:
    """Draws (count, 3) colours, from undyed to bright."""
    return np.array([hue(rng, (0.0, 1.0), (0.0, 0.8), (0.15, 0.95)) for _ in range(count)])


def _yarn(rng: np.random.Generator) -> FloatArray:
    """Draws (row, column, 1) brightness of a plain weave with uneven yarns."""
    period = rng.uniform(2.0, 4.0)
    x, y = np.meshgrid(np.arange(_SIZE), np.arange(_SIZE))
    over = np.sin(np.pi * x / period) * np.sin(np.pi * y / period)
    uneven = fractal(rng, _SIZE, _SIZE, slope=0.6, stretch=6.0) + fractal(
        rng, _SIZE, _SIZE, slope=0.6, stretch=1 / 6
    )
    return (1 + 0.06 * np.sign(over) * np.abs(over) ** 0.5 + 0.03 * uneven)[:, :, None]


def _weave(rng: np.random.Generator) -> FloatArray:
    return _dyes(rng, 1)[0] * _yarn(rng)


def _bands(rng: np.random.Generator) -> IntArray:
    """Draws (512,) index of the colour along a repeat of uneven bands."""
    count = int(rng.integers(2, 7))
    widths = rng.uniform(0.3, 1.0, count)
    repeats = int(rng.integers(2, 9))
    edges = np.cumsum(widths) / widths.sum()
    return np.searchsorted(edges, (np.arange(_SIZE) + 0.5) * repeats / _SIZE % 1.0, side="right")


def _stripes(rng: np.random.Generator) -> FloatArray:
    bands = _dyes(rng, 8)[_bands(rng)]
    upright = rng.random() < 0.5
    return (bands[None, :] if upright else bands[:, None]) * _yarn(rng)


def _checks(rng: np.random.Generator) -> FloatArray:
    warp, weft = _dyes(rng, 8), _dyes(rng, 8)
    return (warp[_bands(rng)][None, :] + weft[_bands(rng)][:, None]) / 2 * _yarn(rng)


def _print(rng: np.random.Generator) -> FloatArray:
    colours = _dyes(rng, 4)
    image = np.broadcast_to(colours[0], (_SIZE, _SIZE, 3)).copy()
    x, y = np.meshgrid(np.arange(_SIZE), np.arange(_SIZE))
    for _ in range(int(rng.integers(8, 60))):
        cx, cy = rng.uniform(0, _SIZE, 2)
        a, b = rng.uniform(8, 50, 2)
        turn = rng.uniform(0, np.pi)
        u = (x - cx) * np.cos(turn) + (y - cy) * np.sin(turn)
        v = (y - cy) * np.cos(turn) - (x - cx) * np.sin(turn)
        image[(u / a) ** 2 + (v / b) ** 2 < 1] = colours[1 + int(rng.integers(3))]
    return image * _yarn(rng)


WEAVE = Seeded(kind="weave", paint=_weave)
STRIPES = Seeded(kind="stripes", paint=_stripes)
CHECKS = Seeded(kind="checks", paint=_checks)
PRINT = Seeded(kind="print", paint=_print)
