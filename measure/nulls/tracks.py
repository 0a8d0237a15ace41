"""How the attachments of nulls go: as the data's do where these are carried, from another instant
on.

What a simulation leaves depends on how the cloth is moved, so that nulls held still calibrate no
recording of a cloth that hands or a robot carry. A null goes the way of a recording drawn at
random, from an instant drawn at random on; at the recording's ends it slows down, turns and goes
back. That way is what the tracked one is without its noise: markers and attachments of a null are
then tracked with noise of their own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import solveh_banded

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from measure.nulls.null_simulation import CARRIED, SETTLE
from measure.trajectories.interpolation import onto
from measure.trajectories.trajectory import AttachmentTrack, Trajectory

_TURN = 1.0
"""In which a way that ends slows down and turns back [s], so that it has no jump of its
velocity."""
_WEIGHTS = (1e-6, 1e9)
"""Between which the weight of smoothness is sought: less leaves tracks as they are, more makes them
parabolas."""
_HALVINGS = 40


def like(
    recordings: Sequence[Trajectory], seats: FloatArray, count: int, *, duration: float, seed: int
) -> tuple[AttachmentTrack, ...]:
    """Draws so many ways of attachments; none where those of the recordings are held still.

    Args:
        recordings: of the data, in the frame of the fit.
        seats: (held, 2) where the attachments are on the flat cloth [m].
        duration: of a null recording behind the time in which it settles [s].
        seed: of the draws.
    """
    ways = [
        smooth_way(recording, seats)
        for recording in recordings
        if recording.attachments is not None
    ]
    if not ways:
        return ()
    rng = stream(seed, "null", "tracks")
    half = round(_TURN / 2 / CARRIED)
    times = np.arange(round((SETTLE + duration) / CARRIED) + 2, dtype=np.float64) * CARRIED
    around = np.arange(-half, len(times) + half, dtype=np.float64) * CARRIED
    drawn: list[AttachmentTrack] = []
    for _ in range(count):
        way = ways[int(rng.integers(len(ways)))]
        length = float(way.x[-1])
        folded = np.abs((around + rng.uniform(0, 2 * length)) % (2 * length) - length)
        instants = np.convolve(folded, np.full(2 * half + 1, 1 / (2 * half + 1)), mode="valid")
        drawn.append(AttachmentTrack(times=times - SETTLE, places=way(instants)))
    return tuple(drawn)


def smooth_way(recording: Trajectory, seats: FloatArray) -> CubicSpline:
    """Smooths the way of a recording's attachments (held, 3) [m] over its time [s], free of the
    noise of the markers.

    It is the smoothest, by its third differences, that lies as far from the tracked one as the
    noise does (Whittaker, Proc. Edinb. Math. Soc. 41:63, 1923; Morozov's discrepancy principle).

    Args:
        seats: (held, 2) of them on the flat cloth [m].
    """
    tracked = recording.positions if recording.attachments is None else recording.attachments
    values = tracked.reshape(len(tracked), -1)
    variance = recording.noise**2 * float((onto(recording.markers, seats) ** 2).sum(axis=1).mean())
    bands = _roughness(len(values))
    low, high = np.log(_WEIGHTS)
    smooth = values
    for _ in range(_HALVINGS if variance > 0 else 0):
        weight = float(np.exp((low + high) / 2))
        smooth = _smooth(values, weight, bands)
        if float(((values - smooth) ** 2).mean()) > variance:
            high = (low + high) / 2
        else:
            low = (low + high) / 2
    return CubicSpline(recording.times, smooth.reshape(tracked.shape))


def _roughness(count: int) -> FloatArray:
    """Computes the bands (4, count) of the sum of squared third differences of so many values, the
    diagonal last."""
    factors = np.array([-1.0, 3.0, -3.0, 1.0])
    bands = np.zeros((4, count))
    for lag in range(
        4
    ):  # off the diagonal: products of factors that far apart, summed over the differences
        for term in range(4 - lag):
            begin = term + lag
            bands[3 - lag, begin : begin + count - 3] += factors[term] * factors[term + lag]
    return bands


def _smooth(values: FloatArray, weight: float, bands: FloatArray) -> FloatArray:
    """Minimises squared distances from values, and a weight times their roughness, (frame,
    coordinate).

    Args:
        bands: (4, frame) of the roughness, the diagonal last, as `solveh_banded` has them.
    """
    matrix = weight * bands
    matrix[-1] += 1.0
    return np.asarray(solveh_banded(matrix, values), dtype=np.float64)
