"""What is simulated for a verdict on a film: the base model, each effect, and null experiments of other numerics.

The base model's simulations are those of `flagdata calibrate`, so that a loop after a calibration makes none of them
anew. Those with an effect are pairs of some of these: the same cloth, place and turbulence, so that the difference is
the effect's and chaos's alone. Null experiments are of the same minutes of wind, of cloths and places over the same
priors, each kind of numerics a batch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flagdata.arrays import FloatArray, IntArray
from flagdata.rng import child_seed, stream
from measure.calibrate.design import Design
from measure.calibrate.discretisation import LITTLE, Discretisation
from measure.calibrate.prior import CLOTH, draws
from measure.calibrate.simulation import Batch
from measure.films.library import Weighable
from measure.observables.observable import WINDOW

TOGETHER = 8
"""Flags of a batch: eight take as long as one, and sixteen take 2.7 times as long."""
PAIRS = 16
"""Flags with each effect, for each recording."""
LONGEST_PAIRS = 120.0
"""s of all recordings together in which flags with an effect are simulated, a minute of each at most."""
MINUTE = 60.0
FEWEST_WINDOWS = 8
_DAMPING = next(one for one in CLOTH if one.name == "damping")


def lasting(recordings: int) -> float:
    """s of each of so many recordings in which flags with an effect are simulated: a whole number of windows."""
    most = min(MINUTE, LONGEST_PAIRS / recordings)
    return WINDOW * max(FEWEST_WINDOWS, int(most / WINDOW + 1e-9))


@dataclass(frozen=True, kw_only=True, eq=False)
class Pairs:
    """Flags with one effect, each a pair of one without.

    Attributes:
        effect: which.
        places: (pair,) among the design's simulations.
        strengths: (pair,) beyond the null value.
        batches: of them, in that order.
    """

    effect: Weighable
    places: IntArray
    strengths: FloatArray
    batches: tuple[Batch, ...]


def pairs(design: Design, effect: Weighable, *, until: float) -> Pairs:
    """The flags of a recording's design that are simulated with an effect, those of its longest steps.

    Args:
        until: part of the film that is simulated [s].
    """
    candidates = design.damped()
    rng = stream(design.seed, "films", "pairs", effect.name)
    count = min(PAIRS, len(candidates))
    places = np.sort(rng.choice(candidates, count, replace=False))
    shares = (rng.permutation(count) + rng.random(count)) / count
    strengths = effect.prior.at(shares)
    batches = []
    for begin in range(0, count, TOGETHER):
        part = places[begin : begin + TOGETHER]
        batches.append(
            replace(
                design.batch(part),
                until=min(until, design.duration),
                effects=((effect.column, strengths[begin : begin + TOGETHER]),),
            )
        )
    return Pairs(effect=effect, places=places, strengths=strengths, batches=tuple(batches))


def nulls(designs: Sequence[Design], places: Sequence[int], *, kinds: int, seed: int) -> list[list[Batch]]:
    """Null experiments: for each recording a batch a kind of numerics, of `TOGETHER` cloths each. A cloth is the same
    in all recordings, its place and anemometer are not.

    Args:
        places: for each recording the first one of its place.
    """
    count = kinds * TOGETHER
    cloths = draws(designs[0].cloth, count, seed=seed, name="null cloths")
    found = []
    for number, design in zip(places, designs, strict=True):
        own = {
            one.name: one.at(stream(seed, "films", "null places", number, one.name).random(count))
            for one in design.quantities()
        }
        own |= cloths
        if design.log.distance is not None:
            own["distance_constant"] = np.full(count, design.log.distance)
        seen = np.stack([own["azimuth"], own["elevation"], np.full(count, design.distance)], axis=1)
        first = design.batches()[0]
        batches = []
        for kind in range(kinds):
            part = np.arange(kind * TOGETHER, (kind + 1) * TOGETHER)
            numerics = Discretisation.drawn(stream(seed, "films", "kind", kind), explicit=_little())
            values = {name: own[name][part] for name in first.values}
            values["damping"] = _damping(values["damping"], explicit=numerics.step is None)
            batches.append(
                replace(
                    first,
                    values=values,
                    places=seen[part][:, None],
                    discretisation=numerics,
                    seeds=tuple(child_seed(seed, "films", "null", design.recording, int(place)) for place in part),
                )
            )
        found.append(batches)
    return found


def _little() -> float:
    """Share of the cloths that damp less than what leapfrog is for."""
    low, high = _DAMPING.at(np.array([0.0, 1.0])).tolist()
    return math.log(max(LITTLE / low, 1.0)) / math.log(high / low)


def _damping(drawn: FloatArray, *, explicit: bool) -> FloatArray:
    """Dampings of the prior as those of the part below `LITTLE`, or of the part above it [s]."""
    low, high = _DAMPING.at(np.array([0.0, 1.0])).tolist()
    shares, edge = np.log(drawn / low) / math.log(high / low), _little()
    return _DAMPING.at(shares * edge if explicit else edge + shares * (1 - edge))
