"""What recordings show beside what the base model that was fitted to them shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from measure.calibrate.observed import Observed
from measure.calibrate.simulation import OBSERVED
from measure.films.evidence import Fit, Sight
from measure.films.weigh import hypothesis


@dataclass(frozen=True, kw_only=True)
class Departure:
    """An observable's mean beside that of the base model as calibrated.

    Attributes:
        recording, observable: which.
        off: observed less predicted, in the observable's unit.
        deviations: the same in standard deviations of replicates.
    """

    recording: str
    observable: str
    off: float
    deviations: float


def departures(recordings: Sequence[Observed], sights: Sequence[Sight], base: Fit) -> tuple[Departure, ...]:
    """Of each recording those of all observables that are used, the farthest first.

    Args:
        base: the base model fitted to the recordings.
    """
    found = []
    cloth, places, _ = hypothesis(sights, None).values(base.scores[0])
    for one, own, place in zip(recordings, sights, places, strict=True):
        mean, _ = own.model.predict({**cloth, **place})
        off = one.summary[own.model.used] - base.weights[0] @ mean
        columns = np.flatnonzero(own.model.used).tolist()
        found += [
            Departure(recording=one.name, observable=OBSERVED[column], off=float(size), deviations=float(size / sigma))
            for column, size, sigma in zip(columns, off, own.model.base.deviations, strict=True)
            if column < len(OBSERVED)
        ]
    return tuple(sorted(found, key=lambda one: -abs(one.deviations)))


def root_mean_square(found: Sequence[Departure]) -> float:
    """Of departures, in standard deviations of replicates."""
    return float(np.sqrt(np.mean(np.square([one.deviations for one in found]))))
