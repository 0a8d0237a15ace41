"""Runs the fitted model freely in the recordings' winds, and compares what each hangs and moves
like on average."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import child_seed, stream
from measure.forecasting.calibrated_parameters import Calibration
from measure.nulls.null_simulation import NullBatch
from measure.probes.settled import settling_of
from measure.trajectories.trajectory import Trajectory
from measure.verdict.criteria import CRITERIA

_COPIES = 2
"""Runs of the model for each recording, from other starts: the mean of two differs by chance less
than one does."""


def settled_off(recordings: Sequence[Trajectory], batch: NullBatch) -> FloatArray:
    """Computes the mean state of each recording less that of the model, in the same wind and held
    at the same places, (recording, quantity); quantities and units as of
    `measure.probes.settled.settling_of`.

    Args:
        batch: one run a recording: the model's cloth, calibration, wind and effects.
    """
    count = len(recordings)
    tracks = tuple(recording.track for recording in recordings if recording.track is not None)
    copies = replace(
        batch,
        calibrations=batch.calibrations * _COPIES,
        speeds=batch.speeds * _COPIES,
        winds=batch.winds * _COPIES,
        tracks=tracks * _COPIES,
        seed=child_seed(batch.seed, "free"),
    )
    runs = copies.as_fitted()
    off = []
    for number, recording in enumerate(recordings):
        # As long as the recording, whose wind is not known further, and both at the model's rate: a
        # speed between two frames is less the further they are apart.
        stride = max(1, round(recording.rate / batch.rate))
        positions, period = recording.positions[::stride], stride / recording.rate
        modelled = [
            settling_of(batch.markers, runs[: len(positions), ..., run], period=1 / batch.rate)
            for run in range(number, runs.shape[-1], count)
        ]
        observed = settling_of(recording.markers, positions, period=period, noise=recording.noise)
        off.append(observed - np.mean(modelled, axis=0))
    return np.stack(off)


def mistaken(batch: NullBatch) -> NullBatch:
    """Moves the batch's calibrations by one draw of the errors that a fit to data makes, the same
    for all of one cloth."""
    rng = stream(batch.seed, "null", "mistaken")
    spread = (CRITERIA.area_weight_between, CRITERIA.bending_between, CRITERIA.damping_factor)
    steps = tuple(float(step) for step in spread * rng.standard_normal(3))
    moved: dict[Calibration, Calibration] = {
        calibration: calibration.moved(steps) for calibration in batch.calibrations
    }
    return replace(
        batch, calibrations=tuple(moved[calibration] for calibration in batch.calibrations)
    )
