"""The clip of a simulated film that is set beside a film: as much time as the network takes, at any
frame rate."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flagdata.core.arrays import UInt8Array
from flagdata.timebase import NANOSECONDS
from measure.estimate.nearest import _clip
from models.maps.frontend import FrontEnd
from tests.models.conditioning.test_conditioning import COUNT, Drawn

FRONT_END = FrontEnd(maps="wave-maps", size=32, frames=30, rate=25.0)


class Filmed:
    """A record of a film at a rate that notes which frames are read."""

    def __init__(self, count: int, rate: float) -> None:
        self.frame_times = np.round(np.arange(count) * NANOSECONDS / rate).astype(np.int64)
        self.read: tuple[int, int] | None = None

    def frames(self, first: int, count: int) -> UInt8Array:
        self.read = first, count
        return Drawn().frames()[np.arange(count) % COUNT]


@pytest.mark.parametrize(
    ("rate", "count", "first", "begin", "taken"),
    [
        (25.0, 60, 30, 30, 30),
        (60.0, 120, 30, 30, 71),  # 1.16 s and the frame after
        (60.0, 120, 90, 49, 71),  # from frame 50 on 1.15 s are left
        (24.0, 30, 0, 0, 29),
    ],
)
def test_as_much_of_a_film_is_read_as_the_network_takes(
    rate: float, count: int, first: int, begin: int, taken: int
) -> None:
    record: Any = Filmed(count, rate)
    clip = _clip(record, first, FRONT_END)
    assert clip is not None
    assert clip.shape[0] == 30
    assert record.read == (begin, taken)


@pytest.mark.parametrize(("rate", "count"), [(60.0, 60), (25.0, 29), (15.0, 60)])
def test_a_film_that_is_too_short_or_too_slow_is_passed_over(rate: float, count: int) -> None:
    record: Any = Filmed(count, rate)
    assert _clip(record, 0, FRONT_END) is None
    assert record.read is None
