"""What recordings can show: how far each effect moves them, beyond what cloth, view and anemometer can imitate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from measure.calibrate.prior import Floats
from measure.films.evidence import Experiments, Fit, Sight
from measure.films.library import Weighable
from measure.films.weigh import hypothesis

STRONG = 0.9
"""Share of the prior of strengths at which an effect counts as strong."""
SEEN = 2.0
"""Standard errors below which even a strong effect is not seen."""
_DIFFERENCE = 1e-3


def sensitivity(sights: Sequence[Sight], effects: Sequence[Weighable], base: Fit, observed: Experiments) -> Floats:
    """(effect,) standard errors by which the strong effect moves the summaries, what a change of cloth, view and
    anemometer makes up for left out.

    Args:
        base: the base model fitted to the recordings, about whose cloth and view it is found.
        observed: the recordings.
    """
    own = hypothesis(sights, None)
    at = base.weights[:1] @ base.scores[0]
    moved = np.concatenate([at, at + _DIFFERENCE * np.eye(at.shape[1])])
    mean, _, weight = own.predicted(moved)
    off = observed.repeated(len(moved)).off(weight)
    slopes = np.concatenate([own.scatter.white @ (mean[1:] - mean[0]).T, (off[1:] - off[0])[None]]) / _DIFFERENCE
    # What the prior lets them make up for: ridge regression on slopes, the scores' prior being standard normal.
    left = np.eye(len(slopes)) - slopes @ np.linalg.solve(slopes.T @ slopes + np.eye(slopes.shape[1]), slopes.T)
    cloth, places, _ = own.values(at)
    found = []
    for effect in effects:
        strength = effect.prior.at(np.array([STRONG]))
        parts = []
        for sight, place in zip(sights, places, strict=True):
            with_it, _ = sight.model.predict({**cloth, **place}, effect.name, strength)
            without, _ = sight.model.predict({**cloth, **place})
            parts.append((with_it - without)[0])
        column = np.concatenate([own.scatter.white @ np.concatenate(parts), [0.0]])
        found.append(float(np.sqrt(column @ left @ column)))
    return np.array(found)
