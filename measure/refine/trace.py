"""What an optimiser did: every evaluation with its point, distance and time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Trace:
    """Evaluations in their order; one is one simulated and filmed clip.

    Attributes:
        method: name of the optimiser.
        points: (n, d) of [−1, 1]ᵈ.
        distances: (n,) squared distances to the target; infinite where a simulation failed.
        seconds: (n,) from the start to the end of each evaluation, with the optimiser's own time
            [s].
    """

    method: str
    points: FloatArray
    distances: FloatArray
    seconds: FloatArray

    def __len__(self) -> int:
        return len(self.points)

    @property
    def best(self) -> IntArray:
        """(n,) number of the nearest evaluation so far."""
        order = np.arange(len(self))
        new = self.distances <= np.minimum.accumulate(self.distances)
        new &= np.concatenate(
            [[True], self.distances[1:] < np.minimum.accumulate(self.distances)[:-1]]
        )
        return np.maximum.accumulate(np.where(new, order, 0))

    def incumbent(self, *, evaluations: int | None = None, seconds: float | None = None) -> int:
        """Returns the number of the nearest evaluation within so many evaluations, and so many
        seconds; the first at least."""
        count = len(self) if evaluations is None else min(evaluations, len(self))
        if seconds is not None:
            count = min(count, int(np.searchsorted(self.seconds, seconds, side="right")))
        return int(self.best[max(count, 1) - 1])
