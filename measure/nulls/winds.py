"""The winds of nulls: steady where the data's are, and else what the data's logs are, begun
elsewhere and stronger.

What a simulation leaves depends on how the wind fluctuates, so that nulls in steady winds calibrate
no recording in a
fluctuating one: its density would be estimated too high, and its interval too narrow.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flagdata.core.rng import stream
from measure.nulls.null_simulation import SETTLE
from measure.trajectories.trajectory import Trajectory, WindTrack

_STEADY = 1e-3
"""Fluctuation below which a wind counts as steady, as a share of its mean [1]."""
_STILL = 0.1
"""Mean below which a log is of still air [m/s]: it has no course that could be multiplied to
another mean."""
_EVERY = 0.05
"""Between samples of a null's wind [s]."""


def like(
    recordings: Sequence[Trajectory], speeds: Sequence[float], *, duration: float, seed: int
) -> tuple[WindTrack, ...]:
    """Draws a wind for each of `speeds` [m/s]; none where the logs of all recordings are steady.

    Each is the log of a recording that has wind, drawn at random, from an instant drawn at random,
    forwards and backwards in turns so that it goes on, and multiplied to its speed.

    Args:
        recordings: of the data, in the frame of the fit.
        duration: of a null recording behind the time in which it settles [s].
        seed: of the draws.
    """
    blowing = [recording for recording in recordings if _mean(recording) > _STILL]
    if not any(fluctuates(recording) for recording in blowing):
        return ()
    rng = stream(seed, "null", "winds")
    times = np.arange(round((SETTLE + duration) / _EVERY) + 2, dtype=np.float64) * _EVERY
    drawn: list[WindTrack] = []
    for speed in speeds:
        recording = blowing[int(rng.integers(len(blowing)))]
        length = float(recording.times[-1])
        folded = np.abs((times + rng.uniform(0, 2 * length)) % (2 * length) - length)
        velocity = recording.wind.at(folded)
        drawn.append(
            WindTrack(times=times - SETTLE, velocity=velocity * (speed / _mean(recording)))
        )
    return tuple(drawn)


def fluctuates(recording: Trajectory) -> bool:
    """Whether the log of a recording is not steady."""
    wind = recording.wind.at(np.arange(0.0, recording.times[-1], _EVERY))
    return bool(np.linalg.norm(wind.std(axis=0)) > _STEADY * recording.wind.speed)


def _mean(recording: Trajectory) -> float:
    """Computes the mean speed during a recording [m/s]."""
    return float(
        np.linalg.norm(
            recording.wind.at(np.arange(0.0, recording.times[-1], _EVERY)), axis=1
        ).mean()
    )
