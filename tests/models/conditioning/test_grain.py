"""Noise that a film's coding took away is given back where nothing changes, and only there."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.arrays import UInt8Array
from models.conditioning import add_grain
from models.conditioning.grain import DEVIATION, STILL

SHAPE = (30, 40, 50)


def clip(*, still: float) -> UInt8Array:
    """Of whose columns a share never changes, below four rows that are black all the time, as
    beyond the picture."""
    rng = np.random.default_rng(3)
    made = np.repeat(rng.integers(60, 200, SHAPE[1:]).astype(np.uint8)[None], SHAPE[0], axis=0)
    moving = round((1 - still) * SHAPE[2])
    made[:, :, :moving] += np.arange(SHAPE[0], dtype=np.uint8)[:, None, None]
    made[:, :4] = 0
    return made


def test_where_most_of_a_clip_never_changes_that_part_gets_noise() -> None:
    """Of 0.5 gray levels and the rounding's 1/√12; what moves and what is beyond the picture stays
    to the bit."""
    before = clip(still=0.7)
    after = add_grain(before, seed=1)
    np.testing.assert_array_equal(after[:, :, :15], before[:, :, :15])
    assert not after[:, :4].any()
    added = after[:, 4:, 15:].astype(float) - before[:, 4:, 15:]
    assert added.std() == pytest.approx(np.hypot(DEVIATION, 12**-0.5), rel=0.03)
    assert abs(added.mean()) < 0.02
    np.testing.assert_array_equal(add_grain(before, seed=1), after)
    assert (add_grain(before, seed=2) != after).any()


@pytest.mark.parametrize("still", [0.0, STILL - 0.04, 1.0])
def test_a_clip_most_of_which_changes_and_one_without_motion_stay_as_they_are(still: float) -> None:
    assert add_grain(made := clip(still=still), seed=1) is made
