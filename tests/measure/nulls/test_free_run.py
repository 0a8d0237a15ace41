"""What recordings settle at beside a model that is run freely: over the same time, at the same
rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from measure.nulls.free_run import settled_off
from measure.trajectories import Trajectory, WindTrack

MARKERS = np.stack(
    np.meshgrid(np.linspace(0.0, 1.5, 7), np.linspace(0.0, 1.0, 5)), axis=-1
).reshape(-1, 2)
RATE = 25.0


def waving(count: int, rate: float) -> FloatArray:
    """(count, marker, 3) a wave of 3 Hz along the cloth, whose height doubles behind the fourth
    second [m]."""
    time = np.arange(count)[:, None] / rate
    height = 0.1 * np.where(time > 4.0, 2.0, 1.0) * MARKERS[:, 0] / 1.5
    across = height * np.sin(2 * np.pi * (3.0 * time - MARKERS[:, 0]))
    along, down = (
        np.broadcast_to(MARKERS[:, 0], across.shape),
        np.broadcast_to(MARKERS[:, 1] - 0.2, across.shape),
    )
    return np.stack([along, across, down], axis=-1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Runs:
    """A batch whose free runs are the wave."""

    markers: FloatArray
    rate: float
    duration: float
    calibrations: tuple[int, ...]
    speeds: tuple[float, ...]
    winds: tuple[WindTrack, ...]
    tracks: tuple[Any, ...] = ()
    seed: int = 1

    def as_fitted(self) -> FloatArray:
        one = waving(round(self.duration * self.rate) + 1, self.rate)
        return np.repeat(one[..., None], len(self.calibrations), axis=-1)


def recorded(seconds: float, rate: float) -> Trajectory:
    positions = waving(round(seconds * rate) + 1, rate)
    wind = WindTrack.constant((4.0, 0.0, 0.0))
    return Trajectory(name="made", markers=MARKERS, positions=positions, rate=rate, wind=wind)


@pytest.mark.parametrize("rates", [(25.0, 25.0), (50.0, 25.0), (100.0, 75.0)])
def test_a_recording_of_the_models_own_motion_settles_where_the_model_does(
    rates: tuple[float, float],
) -> None:
    recordings = [recorded(4.0, rates[0]), recorded(12.0, rates[1])]
    batch: Any = Runs(
        markers=MARKERS,
        rate=RATE,
        duration=12.0,
        calibrations=(0, 1),
        speeds=(4.0, 4.0),
        winds=tuple(recording.wind for recording in recordings),
    )
    np.testing.assert_allclose(settled_off(recordings, batch), 0.0, atol=1e-9)
