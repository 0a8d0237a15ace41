"""Every recording into one frame: pole base at the origin, mean wind along +x. Nulls and fields are
made in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from measure.trajectories.trajectory import Experiment, Specimen, Trajectory

_CALM = 0.3
"""Wind below which the flag, not the log, says where the wind goes [m/s]."""


def align_experiment(experiment: Experiment) -> Experiment:
    """Turns the experiment about the vertical through the lowest attachment, each recording by its
    own angle.

    Attachments on one vertical stay where they are; others are those of the first recording.

    Raises:
        InputError: gravity that does not point down the z axis.
    """
    specimen = experiment.specimen
    if specimen.gravity[0] or specimen.gravity[1] or specimen.gravity[2] >= 0:
        raise InputError(
            f"gravity is {specimen.gravity!r}",
            where="specimen",
            fix="turn the data so that z points up",
        )
    lowest = int(np.argmin(specimen.anchors[:, 2]))
    base = specimen.anchors[lowest]
    turns = [_turn(recording, lowest, base) for recording in experiment.recordings]
    recordings = tuple(
        replace(
            recording,
            positions=(recording.positions - base) @ turn.T,
            attachments=None
            if recording.attachments is None
            else (recording.attachments - base) @ turn.T,
            wind=replace(recording.wind, velocity=recording.wind.velocity @ turn.T),
        )
        for recording, turn in zip(experiment.recordings, turns, strict=True)
    )
    moved: Specimen = replace(specimen, anchors=(specimen.anchors - base) @ turns[0].T)
    return Experiment(specimen=moved, recordings=recordings)


def _turn(recording: Trajectory, lowest: int, base: FloatArray) -> FloatArray:
    """Computes the rotation about z, (3, 3), that takes the mean wind, or in calm the cloth's mean
    direction from its lowest attachment, to +x."""
    toward = recording.wind.velocity.mean(axis=0)[:2]
    if np.hypot(*toward) < _CALM:
        attachment = (
            base if recording.attachments is None else recording.attachments[:, lowest, None]
        )
        toward = np.nanmean(recording.positions - attachment, axis=(0, 1))[:2]
    cosine, sine = toward / max(float(np.hypot(*toward)), 1e-12)
    return np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
