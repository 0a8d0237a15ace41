"""Intervals of winds from the errors that a fit makes in blocks of time that it was not fitted to.

The interval of a window is conformal (Vovk, Gammerman and Shafer, Algorithmic Learning in a Random
World, 2005): the quantile of the absolute errors of all windows, each predicted without its block
(cross-conformal prediction). It is of what the anemometer would log, whose noise is among the
errors.
"""

from __future__ import annotations

import math

import numpy as np

from flagdata.core.arrays import FloatArray


def half_width(errors: FloatArray, level: float) -> float:
    """Returns half of the interval that contains the wind with probability `level` [m/s], from
    errors (n,); infinite where they are too few."""
    n = len(errors)
    rank = math.ceil(level * (n + 1))
    return math.inf if rank > n else float(np.sort(np.abs(errors))[rank - 1])


def mean_errors(
    errors: FloatArray, *, count: int, length: int, draws: int, generator: np.random.Generator
) -> FloatArray:
    """Draws errors (draw,) of the mean over `count` windows [m/s]: blocks of neighbouring errors
    drawn with replacement (moving blocks: Künsch, Annals of Statistics 17, 1989).

    Args:
        errors: (n,) in the order of time.
        length: windows of a block.
    """
    block = min(length, len(errors), count)
    blocks = -(-count // block)
    starts = generator.integers(len(errors) - block + 1, size=(draws, blocks))
    drawn = errors[starts[:, :, None] + np.arange(block)].reshape(draws, -1)[:, :count]
    return drawn.mean(axis=1)
