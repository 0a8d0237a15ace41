"""Where a pixel's samples lie: within the pixel, within the exposure, and on the sun's disc: always
the same."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from sim.render.parameters import RenderParameters

SUNS = 2
"""Points of the sun that each sample sees."""
_ORDERS = 256
_FEW = 64


@dataclass(frozen=True, kw_only=True)
class Samples:
    """The samples of every pixel.

    Each coordinate takes one value in each of as many equal parts as there are samples. Places in
    the pixel keep far from each other; instants and points of the sun are dealt out so that they
    hardly correlate with the places or with each other, since a place that goes with an instant
    would look like motion.

    Attributes:
        jitter: (sample, 2) place in the pixel, in [0, 1) from its upper left corner.
        time: (sample,) instant after the middle of the exposure [s].
        to_sun: (sample, SUNS, 3) unit vectors towards points of the sun.
        sun_weight: irradiance of a surface that faces one of them, so that the sum over all samples
            and points is what the whole sun gives [W/m²].
    """

    jitter: FloatArray
    time: FloatArray
    to_sun: FloatArray
    sun_weight: float

    @classmethod
    def of(cls, parameters: RenderParameters, *, to_sun: tuple[float, float, float]) -> Samples:
        """Draws the samples for ζ, with the middle of the sun in direction `to_sun`."""
        count, radius = parameters.raster_samples, parameters.sun_angular_radius
        jitter = _spread_out(count)
        time = _dealt((np.arange(count) + 0.5)[:, None] / count, jitter, "time")
        sun = _cone(_hammersley(count * SUNS), to_sun, radius)
        sun = _dealt(sun.reshape(count, SUNS * 3), np.concatenate([jitter, time], axis=1), "sun")
        return cls(
            jitter=jitter,
            time=(time[:, 0] - 0.5) * parameters.exposure_time,
            to_sun=sun.reshape(count, SUNS, 3),
            sun_weight=parameters.sun_strength * 2 / ((1 + math.cos(radius)) * count * SUNS),
        )


def _hammersley(count: int) -> FloatArray:
    """Computes (count, 2) points in (0, 1)², each coordinate once in the middle of each of `count`
    equal parts."""
    index, mirrored = np.arange(count), np.zeros(count)
    for bit in range(count.bit_length()):
        mirrored += (index >> bit & 1) * 0.5 ** (bit + 1)
    return (np.stack([index, mirrored.argsort().argsort()], axis=1) + 0.5) / count


@functools.cache
def _spread_out(count: int) -> FloatArray:
    """Spreads (count, 2) points as of `_hammersley`; few ones in that one of some orders that keeps
    them farthest apart, taken as a pattern that repeats, and on no diagonal."""
    points = _hammersley(count)
    if not 3 <= count <= _FEW:
        return points
    rng, best, pattern = stream(0, "render", "samples", "places"), -math.inf, points
    for _ in range(_ORDERS):
        tried = np.stack([points[:, 0], (rng.permutation(count) + 0.5) / count], axis=1)
        gap = np.abs(tried[:, None] - tried)
        gap = np.hypot(*np.moveaxis(np.minimum(gap, 1 - gap), 2, 0)) + 2 * np.eye(count)
        correlation = np.asarray(np.corrcoef(tried.T))[0, 1]
        score = round(float(gap.min() * math.sqrt(count)) - abs(float(correlation)), 9)
        if score > best:
            best, pattern = score, tried
    return pattern


def _dealt(values: FloatArray, reference: FloatArray, name: str) -> FloatArray:
    """Orders the rows of `values` so that, among some orders, their columns correlate least with
    those of `reference`."""
    count, rng = len(values), stream(0, "render", "samples", name)
    if count < 3:
        return values
    orders = [rng.permutation(count) for _ in range(_ORDERS)]
    spread = [np.linalg.norm(part - part.mean(axis=0), axis=0) for part in (values, reference)]
    scale = np.maximum(spread[0][:, None] * spread[1], 1e-9)
    offset = reference - reference.mean(axis=0)
    worst = [np.abs(values[order].T @ offset / scale).max() for order in orders]
    return values[orders[int(np.argmin(np.round(worst, 9)))]]


def _cone(points: FloatArray, middle: tuple[float, float, float], radius: float) -> FloatArray:
    """Spreads directions (point, 3), equally dense in solid angle, within an angular radius [rad]
    of a middle.

    A disc of uniform radiance L gives a surface that faces its middle E = π L sin² radius; a share
    1/n of its solid angle, 2π (1 − cos radius)/n, gives a surface that faces it 2 E/(n (1 + cos
    radius)).
    """
    axis = np.array(middle)
    aside = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.7 else [0.0, 1.0, 0.0])
    aside /= np.linalg.norm(aside)
    binormal = np.cross(axis, aside)
    height = 1 - points[:, :1] * (1 - math.cos(radius))
    turn = 2 * math.pi * points[:, 1:]
    across = np.sqrt(np.maximum(0.0, 1 - height**2))
    return height * axis + across * (np.cos(turn) * aside + np.sin(turn) * binormal)
