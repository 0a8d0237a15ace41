"""Films that show no flag are refused, and a film is cut into whole windows."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from flagdata.errors import RefusedError
from flagdata.findings import Finding
from measure.estimate.conditioned import ConditionedFilm
from measure.estimate.similarity import FlagSize
from measure.observables.watching import watched

SIZE = FlagSize(length=1.5, height=1.0)
RATE, COUNT, SIDE = 10.0, 30, 64


class Still:
    """Three seconds of a picture in which nothing moves."""

    name, rate, duration, start, width, height = "still", RATE, (COUNT - 1) / RATE, None, SIDE, SIDE

    def frames(self, first: float, last: float) -> Iterator[tuple[float, NDArray[np.uint8]]]:
        picture = np.random.default_rng(1).integers(40, 200, (SIDE, SIDE)).astype(np.uint8)
        for k in range(COUNT):
            if first <= k / RATE <= last:
                yield k / RATE, picture

    def findings(self) -> tuple[Finding, ...]:
        return ()


def test_a_film_in_which_nothing_moves_is_refused() -> None:
    with pytest.raises(RefusedError, match="no motion like cloth"):
        watched(ConditionedFilm(Still()), SIZE)


def test_a_film_shorter_than_a_window_is_refused() -> None:
    with pytest.raises(RefusedError, match="no window"):
        watched(ConditionedFilm(Still()), SIZE, last=1.0)
