"""What a verdict on tracked recordings takes is stated by their number, lengths and mesh."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from measure.nulls import FEWEST_NULLS, NullOptions, of_recordings
from measure.trajectories import Trajectory, WindTrack


def recording(seconds: float) -> Trajectory:
    frames = round(seconds * 25)
    return Trajectory(
        name="flag",
        markers=np.array([[0.1, 0.1], [0.9, 0.5]]),
        positions=np.zeros((frames, 2, 3)),
        rate=25.0,
        wind=WindTrack.constant((4.0, 0.0, 0.0)),
        noise=1e-3,
    )


def simulated(said: str) -> float:
    (minutes,) = re.findall(r"null recordings of (\d+) minutes", said)
    return float(minutes)


def test_nulls_last_as_long_as_the_data_and_three_seconds_before_each() -> None:
    """Forty kinds of four recordings, each of a quarter of the data's segments of 2 s and the
    warm-up."""
    said = of_recordings([recording(40.0)] * 4, 200, NullOptions(workers=2), workers=2)
    assert FEWEST_NULLS * (3 + 36) / 60 < simulated(said) < FEWEST_NULLS * (3 + 42) / 60
    assert "on 2 idle cores; what was simulated before is kept" in said


def test_more_sets_take_longer_and_a_bank_leaves_the_judging(tmp_path: Path) -> None:
    options = NullOptions()
    one, five = (of_recordings([recording(12.0)], 200, options, sets=n, workers=1) for n in (1, 5))
    assert simulated(five) == pytest.approx(5 * simulated(one), rel=0.05)
    judged = of_recordings(
        [recording(12.0)] * 3, 200, NullOptions(bank=tmp_path), sets=10, workers=1
    )
    assert (
        judged == "judging 10 sets of recordings takes about 12 minutes on one idle core"
    )  # 72 s each
