"""Random search: the centre, then uniform draws (Bergstra and Bengio, J. Machine Learning Research
13, 2012)."""

from __future__ import annotations

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream


class RandomSearch:
    """See `tests.studies.validation.peers.registry.Optimiser`."""

    def __init__(self, dimension: int, *, seed: int, batch: int) -> None:
        self._dimension, self._batch = dimension, batch
        self._rng = stream(seed, "peers", "random")
        self._begun = False

    def ask(self) -> FloatArray:
        if not self._begun:
            self._begun = True
            return np.zeros((1, self._dimension))
        return self._rng.uniform(-1.0, 1.0, (self._batch, self._dimension))

    def tell(self, points: FloatArray, values: FloatArray) -> None:
        """Learns nothing."""
