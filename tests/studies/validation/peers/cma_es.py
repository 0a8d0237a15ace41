"""CMA-ES: evolution with an adapted covariance, from its author's library (Hansen, arXiv
1604.00772)."""

from __future__ import annotations

from typing import Any

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import child_seed
from tests.studies.validation.peers.library import library

_STEP = 0.5  # a quarter of the box, as the library advises
_FAILED = 1e12  # of a failed simulation: farther than any


class CmaEs:
    """See `tests.studies.validation.peers.registry.Optimiser`.

    It asks for a whole generation at once, 4 + ⌊3 ln d⌋ points, in place of `batch`, after the
    centre. Of a generation that the budget cuts it gets no values.
    """

    def __init__(self, dimension: int, *, seed: int, batch: int) -> None:
        del batch
        cma = library("cma", of="cma")
        self._dimension, self._begun = dimension, False
        self._strategy: Any = cma.CMAEvolutionStrategy(
            np.zeros(dimension),
            _STEP,
            {
                "bounds": [-1.0, 1.0],
                "seed": 1 + child_seed(seed, "peers", "cma-es") % (2**31 - 2),
                "verbose": -9,
            },
        )

    def ask(self) -> FloatArray:
        if not self._begun:
            return np.zeros((1, self._dimension))
        return np.array(self._strategy.ask())

    def tell(self, points: FloatArray, values: FloatArray) -> None:
        if not self._begun:
            self._begun = True
            return
        if len(points) == self._strategy.popsize:
            self._strategy.tell(
                list(points), np.where(np.isfinite(values), values, _FAILED).tolist()
            )
