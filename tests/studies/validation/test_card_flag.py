"""What is fitted and judged of the card flag: which rows count, and on which clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.studies.validation.card_flag import (
    CALM,
    EVERY,
    LONG,
    OPENED,
    long_rows,
    rows_of,
    tracked,
)


@pytest.mark.reference
def test_rows_whose_second_holds_a_jump_of_the_tracker_are_left_out(reference_data: Path) -> None:
    """All points are lost and found anew at 7.6 s: the jump of 42 px raises the root mean square to
    42/√30 = 7.7 px for 30 frames, in still air."""
    found = tracked(reference_data / "wind" / "flag-camera-tunnel", until=OPENED)
    jumped = (found.stamps > 7.65) & (found.stamps < 8.4)
    assert found.motion[jumped] == pytest.approx(42.1 / np.sqrt(30), abs=0.1)
    rows, places = rows_of(found)
    assert not ((found.stamps[places] > 7.2) & (found.stamps[places] < 8.65)).any()
    assert (rows.values[rows.times + rows.span / 2 < CALM] < 0.7).all()
    assert float(np.median(np.diff(rows.times))) == pytest.approx(EVERY, abs=0.02)
    assert found.clock.low == pytest.approx(-0.0634, abs=0.002)
    long = long_rows(found, rows)
    assert long.span == LONG
    assert len(long.times) < len(rows.times)
