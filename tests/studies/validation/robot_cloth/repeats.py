"""A/A: whether two repeats of one programme can be distinguished by how a model errs on them.

From the instant at which the tool moves, recordings are cut into segments. A segment's errors along
each sensitivity of the model, and their size, are its features. The programme is the same, so that
without a difference between two repeats the features of a pair of segments may be swapped: the test
flips the signs of their differences, all of the 2ⁿ ways. Pairs share recordings, so that how many
of them differ is judged by repeats whose segments were shuffled.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from flagdata.core.arrays import FloatArray
from tests.studies.validation.robot_cloth.calibrate import Linear, weights
from tests.studies.validation.robot_cloth.reading import Swing

SEGMENT = 1.5  # s
_FRAMES = 5  # frames that a segment must have
_MOVED = 5e-3  # m: the tool moves


def features(swing: Swing, model: Linear, lag: float) -> FloatArray:
    """(segment, 5): errors along density, bending, damping and lag, in their units, and the
    logarithm of their size."""
    begun = float(
        swing.tool_times[np.argmax(np.linalg.norm(swing.tool - swing.tool[0], axis=1) > _MOVED)]
    )
    place = np.floor((swing.times - lag - begun) / SEGMENT).astype(np.int64)
    weight = weights(model.error)[..., None]
    error, change = (np.nan_to_num(values) for values in (model.error, model.change))  # of weight 0
    rows: list[FloatArray] = []
    for segment in range(int(place.max()) + 1):
        own = (place == segment) & (weight[:, :, 0].sum(axis=1) > 0)
        if own.sum() < _FRAMES:
            break
        size = (weight[own] * change[:, own] ** 2).sum(axis=(1, 2, 3))
        along = (weight[own] * change[:, own] * error[own]).sum(axis=(1, 2, 3)) / np.maximum(
            size, 1e-30
        )
        spread = (weight[own] * error[own] ** 2).sum() / weight[own].sum()
        rows.append(np.append(along, np.log(spread) / 2))
    return np.array(rows)


def shuffled(repeats: Sequence[FloatArray], rng: np.random.Generator) -> list[FloatArray]:
    """Repeats of one programme whose features (segment, feature) have changed places, segment by
    segment: what they might have been, if they did not differ. All are cut to the shortest."""
    count = min(len(own) for own in repeats)
    stacked = np.stack([own[:count] for own in repeats])
    order = rng.permuted(np.tile(np.arange(len(repeats)), (count, 1)), axis=1).T
    return list(stacked[order, np.arange(count)])


def tail_probability(first: FloatArray, second: FloatArray, scale: FloatArray) -> float:
    """p of no difference between two repeats, by all sign flips of the differences between their
    segments.

    Args:
        first, second: (segment, feature), those that both have are compared.
        scale: (feature,) that differences are measured in.
    """
    count = min(len(first), len(second))
    apart = (first[:count] - second[:count]) / scale
    signs = np.array(list(product((1.0, -1.0), repeat=count)))
    found = ((signs @ apart / count) ** 2).sum(axis=1)
    return float((found >= found[0] * (1 - 1e-12)).mean())
