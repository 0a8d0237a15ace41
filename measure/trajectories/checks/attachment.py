"""The pins: whether the vertices given as held stand still, and where they are instead."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.core.findings import Finding
from flagdata.errors import InputError
from measure.trajectories import cloth_mesh
from measure.trajectories.interpolation import onto
from measure.trajectories.trajectory import Experiment, Specimen, Trajectory

# A pin's root-mean-square motion over that of the median marker. Held by springs of 1 kN/m in 8
# m/s: below 0.01.
_LOOSE, _FREE = 0.05, 0.3
_STILL = 1e-3  # of the cloth's size: what moves less is still, whatever the rest does
_SEEN = 0.02  # of the cloth's size: a pin that far beyond the outermost markers is not observed
# markers of a hoist between its pins, below which nothing is concluded from their standing still
_ALONG = 3
_ELSEWHERE = 0.02  # of the cloth's size: pins of two recordings further apart are not in one place


def check_pins(recording: Trajectory, specimen: Specimen) -> tuple[Finding, ...]:
    """Refuses pins that move with the cloth, and reports those that move a little.

    Raises:
        InputError: a pin among the markers moves by more than three tenths of what the median
            marker does, or one beyond them by more than all of it.
    """
    where = f"recording {recording.name!r}"
    seats = specimen.mesh.rest[list(specimen.held)]
    tracks = _tracks(recording, seats)
    moved = _motion(
        tracks, recording.noise * np.linalg.norm(onto(recording.markers, seats), axis=1)
    )
    usual = float(np.median(_motion(recording.positions, recording.noise)))
    size = float(np.ptp(specimen.mesh.rest, axis=0).max())
    worst = int(moved.argmax())
    if moved[worst] <= max(_LOOSE * usual, _STILL * size, 3 * recording.noise):
        return ()
    u, v = seats[worst]
    motion = (
        f"the cloth moves by {1e3 * moved[worst]:.3g} mm at the pin (u, v) = ({u:.3g}, {v:.3g}) m"
    )
    still = _still_points(recording)
    reach = cloth_mesh.hull(recording.markers, where=where)
    away = (
        0.0
        if cloth_mesh.inside(reach, seats[worst][None])[0]
        else cloth_mesh.distance_to(reach, seats[worst])
    )
    covered = away <= _SEEN * size
    if not covered and moved[worst] <= usual:
        return (
            Finding.of(
                "pins-not-observed",
                f"the pin (u, v) = ({u:.3g}, {v:.3g}) m is {away:.3g} m beyond the outermost "
                "markers; its "
                f"place is guessed from them and moves by {1e3 * moved[worst]:.3g} mm",
                where=where,
                value=away,
                fix="track a point at each pin",
            ),
        )
    if not covered or moved[worst] > max(_FREE * usual, 3 * recording.noise):
        raise InputError(
            f"{motion}, against {1e3 * usual:.3g} mm at the median marker: it is not held there",
            where=where,
            fix=f"name the pins where it is held; it moves least at (u, v) = {still} m",
        )
    return (
        Finding.of(
            "pins-move",
            f"{motion}: is it held there? It moves least at (u, v) = {still} m",
            where=where,
            value=float(moved[worst]),
            count=len(moved),
            fix="correct the pins, or look whether they have play",
        ),
    )


def beside_pins(recording: Trajectory, specimen: Specimen) -> tuple[Finding, ...]:
    """Reports markers away from the pins that stand as still as these: the cloth may be held there
    too."""
    still, away = _still(recording, specimen)
    still_markers = np.flatnonzero(still & (away > 0))
    if not len(still_markers) or still.mean() > 0.5:
        return ()
    u, v = recording.markers[still_markers[int(away[still_markers].argmax())]]
    return (
        Finding.of(
            "still-away-from-pins",
            f"{len(still_markers)} markers away from the pins stand as still as these, one at (u, "
            f"v) = ({u:.3g}, "
            f"{v:.3g}) m",
            where=f"recording {recording.name!r}",
            count=len(still_markers),
            fix="if the cloth is held there, name it with the pins",
        ),
    )


def hoist_stands_still(experiment: Experiment) -> bool:
    """Returns whether in every recording the markers of the hoist away from the pins stand as still
    as these, three of
    them or more, and no others do: the cloth is attached along its hoist."""
    specimen = experiment.specimen
    size = float(np.ptp(specimen.mesh.rest, axis=0).max())
    hoist = float(specimen.mesh.rest[:, 0].min()) + _SEEN * size
    for recording in experiment.recordings:
        still, away = _still(recording, specimen)
        along = (recording.markers[:, 0] <= hoist) & (away > 0)
        if along.sum() < _ALONG or not still[along].all() or (still & ~along & (away > 0)).any():
            return False
    return True


def _still(recording: Trajectory, specimen: Specimen) -> tuple[BoolArray, FloatArray]:
    """Masks the markers that stand still, (marker,), and measures how far each is from the nearest
    pin [m], 0 of one that is beside it."""
    size = float(np.ptp(specimen.mesh.rest, axis=0).max())
    still = _motion(recording.positions, recording.noise) <= max(_STILL * size, recording.noise)
    seats = specimen.mesh.rest[list(specimen.held)]
    away = np.linalg.norm(recording.markers[:, None] - seats, axis=2).min(axis=1)
    return still, np.where(away > 0.1 * size, away, 0.0)


def check_places(recordings: Sequence[Trajectory], specimen: Specimen) -> None:
    """Refuses recordings whose pins are not at the same points.

    Raises:
        InputError: the pins of a recording are elsewhere than those of the first.
    """
    seats = specimen.mesh.rest[list(specimen.held)]
    size = float(np.ptp(specimen.mesh.rest, axis=0).max())
    first = _tracks(recordings[0], seats).mean(axis=0)
    for recording in recordings[1:]:
        places = _tracks(recording, seats).mean(axis=0)
        away = np.linalg.norm(places - first, axis=1)
        if away.max() > _ELSEWHERE * size:
            x, y, z = (places - first).mean(axis=0)
            raise InputError(
                f"its pins are up to {away.max():.3g} m from those of {recordings[0].name!r}; on "
                "the average "
                f"({x:.3g}, {y:.3g}, {z:.3g}) m",
                where=f"recording {recording.name!r}",
                fix="bring the recordings to one frame of coordinates, the wind along with them",
            )


def centre_of_pins(recording: Trajectory, specimen: Specimen) -> FloatArray:
    """Computes the pins' mean position, (3,) [m]."""
    return _tracks(recording, specimen.mesh.rest[list(specimen.held)]).mean(axis=(0, 1))


def _tracks(recording: Trajectory, seats: FloatArray) -> FloatArray:
    """Tracks points of the cloth, (frame, seat, 3) [m]."""
    return np.einsum("sm,fmi->fsi", onto(recording.markers, seats), recording.positions)


def _motion(positions: FloatArray, sigma: float | FloatArray) -> FloatArray:
    """Computes the root-mean-square distance of each point from its mean, without the noise's part,
    (point,) [m]."""
    return np.sqrt(np.maximum(positions.var(axis=0).sum(axis=1) - 3 * sigma**2, 0.0))


def _still_points(recording: Trajectory) -> str:
    """Names the two markers that move least and are not neighbours, as text."""
    moved = _motion(recording.positions, recording.noise)
    size = float(np.ptp(recording.markers, axis=0).max())
    first = int(moved.argmin())
    away = np.hypot(*(recording.markers - recording.markers[first]).T)
    second = int(np.where(away > 0.2 * size, moved, np.inf).argmin())
    return " and ".join(f"({u:.3g}, {v:.3g})" for u, v in recording.markers[[first, second]])
