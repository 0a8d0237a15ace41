"""What a proposal may see and what it is tested on: divided before anything is fitted."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.errors import InputError
from measure.forecasting.segments import Segments

_LEAST = 3
"""Segments on each side: an interval of a mean wants three."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Split:
    """Segments for choosing and fitting, and segments for the test.

    Attributes:
        used: (segment,) whether a proposal is made from it; the others are for its test.
        words: what the test is on.
    """

    used: BoolArray
    words: str


def split(segments: Segments, speeds: FloatArray) -> Split:
    """Splits off the last third of every recording for the test; of three or more, also the whole
    one of the middle wind.

    Args:
        speeds: (recording,) of the wind [m/s].

    Raises:
        InputError: too few segments.
    """
    recording = segments.recording
    used = np.ones(len(recording), dtype=bool)
    words = "the last third of each recording"
    for index in np.unique(recording):
        of_recording = np.flatnonzero(recording == index)
        used[of_recording[-max(1, len(of_recording) // 3) :]] = False
    if len(speeds) > 2:
        middle = int(np.argsort(speeds, kind="stable")[len(speeds) // 2])
        used[recording == middle] = False
        words = f"all of the recording at {speeds[middle]:.1f} m/s and the last third of the others"
    if min(int(used.sum()), int((~used).sum())) < _LEAST:
        raise InputError(
            f"there are {int(used.sum())} segments to propose from and {int((~used).sum())} to "
            "test on",
            where="propose",
            fix=f"record for longer, or more recordings: {_LEAST} of each are needed, of up to 2 s",
        )
    return Split(used=used, words=words)


def data_hash(segments: Segments) -> str:
    """Hashes the markers, positions and wind of segments, SHA-256, hex."""
    digest = hashlib.sha256(np.ascontiguousarray(segments.markers, dtype="<f8").tobytes())
    for item in segments.items:
        times = np.asarray(
            item.start + np.arange(len(item.positions)) * segments.period, dtype=np.float64
        )
        for values in (item.positions, item.wind.at(times)):
            digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()
