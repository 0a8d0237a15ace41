"""Where a pixel's samples lie: within the pixel, within the exposure, and on the sun's disc. No chance in it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.render.parameters import RenderParameters

SUNS = 2
"""Points of the sun that each sample sees."""


@dataclass(frozen=True, kw_only=True)
class Samples:
    """The samples of every pixel.

    Each coordinate takes one value in each of as many equal parts as there are samples (a Latin hypercube), in the
    order of the ranks of an additive recurrence, which keeps coordinates apart from each other (M. Roberts 2018, "The
    unreasonable effectiveness of quasirandom sequences").

    Attributes:
        jitter: (sample, 2) place in the pixel, in [0, 1) from its upper left corner.
        time: (sample,) instant after the middle of the exposure [s].
        to_sun: (sample, SUNS, 3) unit vectors towards points of the sun.
        sun_weight: irradiance of a surface that faces one of them, so that the sum over all samples and points is what
            the whole sun gives [W/m²].
    """

    jitter: NDArray[np.float64]
    time: NDArray[np.float64]
    to_sun: NDArray[np.float64]
    sun_weight: float

    @classmethod
    def of(cls, parameters: RenderParameters, *, to_sun: tuple[float, float, float]) -> Samples:
        """The samples for ζ, with the middle of the sun in direction `to_sun`."""
        count = parameters.raster_samples
        jitter, time = _strata(count, 2), _strata(count, 3)[:, 2]
        around = _strata(count * SUNS, 2)
        return cls(
            jitter=jitter,
            time=(time - 0.5) * parameters.exposure_time,
            to_sun=_cone(around, to_sun, parameters.sun_angular_radius).reshape(count, SUNS, 3),
            sun_weight=parameters.sun_strength
            * 2 / ((1 + math.cos(parameters.sun_angular_radius)) * count * SUNS),
        )  # fmt: skip


def _strata(count: int, dimensions: int) -> NDArray[np.float64]:
    """(count, dimensions) points in (0, 1), each coordinate once in the middle of each of `count` equal parts."""
    ratio = 2.0
    for _ in range(64):  # the root of x^(d+1) = x + 1
        ratio = (1 + ratio) ** (1 / (dimensions + 1))
    steps = ratio ** -np.arange(1.0, dimensions + 1)
    points = (0.5 + np.arange(count)[:, None] * steps) % 1.0
    return (points.argsort(axis=0).argsort(axis=0) + 0.5) / count


def _cone(points: NDArray[np.float64], middle: tuple[float, float, float], radius: float) -> NDArray[np.float64]:
    """(point, 3) directions, equally dense in solid angle, within an angular radius [rad] of a middle.

    A disc of uniform radiance L gives a surface that faces its middle E = π L sin² radius; a share 1/n of its solid
    angle, 2π (1 − cos radius)/n, gives a surface that faces it 2 E/(n (1 + cos radius)).
    """
    axis = np.array(middle)
    aside = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.7 else [0.0, 1.0, 0.0])
    aside /= np.linalg.norm(aside)
    other = np.cross(axis, aside)
    height = 1 - points[:, :1] * (1 - math.cos(radius))
    turn = 2 * math.pi * points[:, 1:]
    across = np.sqrt(np.maximum(0.0, 1 - height**2))
    return height * axis + across * (np.cos(turn) * aside + np.sin(turn) * other)
