"""Where the attachments are tied, as far as recordings show it.

The wind draws an attachment away from its anchor by what its spring yields, so that anchors taken
from recordings are off by that. Whatever is compared with such recordings has to take its anchors
in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flagdata.core.arrays import FloatArray
from measure.trajectories.interpolation import onto
from measure.trajectories.trajectory import Specimen, Trajectory


def anchors_of(recordings: Sequence[Trajectory], seats: FloatArray) -> FloatArray:
    """Locates points (held, 2) of the cloth on the average, (held, 3) [m], recordings counting
    alike.

    Each marker counts by the frames in which it was tracked.
    """
    means = [onto(r.markers, seats) @ _tracked_mean(r) for r in recordings]
    return np.mean(means, axis=0)


def carry_attachments(recording: Trajectory, seats: FloatArray) -> Trajectory:
    """Moves the recording's attachments where its markers say that points (held, 2) of the cloth
    go."""
    attachments = np.einsum("sm,fmi->fsi", onto(recording.markers, seats), recording.positions)
    return replace(recording, attachments=attachments)


def _tracked_mean(recording: Trajectory) -> FloatArray:
    """Averages each marker over the frames in which it was tracked, (marker, 3) [m]; over all
    frames where none was."""
    if recording.seen is None:
        return recording.positions.mean(axis=0)
    weight = np.where(recording.seen.any(axis=0), recording.seen, 1.0)
    return np.einsum("fm,fmc->mc", weight, recording.positions) / weight.sum(axis=0)[:, None]


def as_seen(specimen: Specimen, recordings: Sequence[Trajectory]) -> Specimen:
    """Takes the cloth's anchors from these recordings; itself where its anchors are given."""
    if specimen.anchors_given:
        return specimen
    return replace(
        specimen, anchors=anchors_of(recordings, specimen.mesh.rest[list(specimen.held)])
    )
