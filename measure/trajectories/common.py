"""Recordings of one cloth whose markers or rates differ, followed at the same points and at the
same rate.

Where they differ because trackers lost some markers, the markers that all recordings have are
taken. Where they differ as meshes of different runs do, all are followed at the points of the
model's mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial import KDTree

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.findings import Finding
from flagdata.errors import InputError
from measure.trajectories.interpolation import onto
from measure.trajectories.trajectory import Trajectory

_SAME = 1e-6
"""Share of the cloth's size within which places are the same: rest coordinates are often kept in
single precision."""
_DENSER = 2.0
"""Markers a point: between markers as far apart as the points, wrinkles are lost that the other
recordings show."""
_SHARED = 0.5
"""Share of the markers of the recording with most that all must have in common, for these to be
taken alone."""
_NEAR = 0.75
"""Share of a point's weight: it counts as tracked where markers of so much were tracked."""


def at_same_rate(
    recordings: Sequence[Trajectory],
) -> tuple[tuple[Trajectory, ...], tuple[Finding, ...]]:
    """Resamples the recordings to the lowest of their rates; returns them as they are if their
    rates are the same.

    Positions in between are those of cubic splines in time, tracked where both neighbouring frames
    were.
    """
    rate = min(recording.rate for recording in recordings)
    moved: list[Trajectory] = []
    findings: list[Finding] = []
    for recording in recordings:
        if recording.rate == rate:
            moved.append(recording)
            continue
        times = (
            np.arange(int((len(recording.positions) - 1) / recording.rate * rate + 1e-9) + 1) / rate
        )
        frames = times * recording.rate
        before = np.minimum(np.floor(frames + 1e-9).astype(np.int64), len(recording.positions) - 2)
        tracked = (
            None if recording.seen is None else recording.seen[before] & recording.seen[before + 1]
        )
        moved.append(
            replace(
                recording,
                rate=rate,
                positions=CubicSpline(recording.times, recording.positions)(times),
                seen=tracked,
            )
        )
        findings.append(
            Finding.of(
                "recording-resampled",
                f"its {recording.rate:.4g} frames a second are not those of the other recordings: "
                "it is followed at "
                f"{rate:.4g} Hz",
                where=f"recording {recording.name!r}",
                value=rate,
            )
        )
    return tuple(moved), tuple(findings)


def at_same_points(
    recordings: Sequence[Trajectory], points: FloatArray
) -> tuple[tuple[Trajectory, ...], tuple[Finding, ...]]:
    """Resamples the recordings to these points (point, 2) [m]; returns them as they are if their
    markers are the same.

    Raises:
        InputError: a recording with markers too few to show the cloth at other points.
    """
    first = recordings[0]
    if all(_same_markers(recording.markers, first.markers) for recording in recordings):
        return tuple(replace(recording, markers=first.markers) for recording in recordings), ()
    if (shared := _shared_markers(recordings)) is not None:
        return shared
    moved: list[Trajectory] = []
    findings: list[Finding] = []
    for recording in recordings:
        where, count = f"recording {recording.name!r}", len(recording.markers)
        if _same_markers(recording.markers, points):
            moved.append(replace(recording, markers=points))
            continue
        if count < _DENSER * len(points):
            raise InputError(
                f"its {count} markers are not those of the other recordings, and too few to follow "
                "the cloth at "
                f"the same {len(points)} points",
                where=where,
                fix="track the same points in all recordings, or close the loop on them one by one",
            )
        weights = onto(recording.markers, points)
        grown = float(np.sqrt((weights**2).sum(axis=1).mean()))
        positions = np.einsum("pm,fmc->fpc", weights, recording.positions)
        tracked = (
            None
            if recording.seen is None
            else recording.seen @ np.abs(weights).T >= _NEAR * np.abs(weights).sum(axis=1)
        )
        moved.append(
            replace(
                recording,
                markers=points,
                positions=positions,
                noise=recording.noise * grown,
                seen=tracked,
            )
        )
        findings.append(
            Finding.of(
                "markers-resampled",
                f"its {count} markers are not those of the other recordings: all are followed at "
                f"{len(points)} "
                "points of the cloth",
                where=where,
                count=len(points),
            )
        )
    return tuple(moved), tuple(findings)


def _shared_markers(
    recordings: Sequence[Trajectory],
) -> tuple[tuple[Trajectory, ...], tuple[Finding, ...]] | None:
    """Selects the markers that all recordings have; None where these are too few to speak of one
    layout."""
    most = max(recordings, key=lambda recording: len(recording.markers))
    size = _SAME * float(np.ptp(most.markers, axis=0).max())
    places: list[IntArray] = []
    shared = np.ones(len(most.markers), dtype=bool)
    for recording in recordings:
        distance, nearest = KDTree(recording.markers).query(most.markers)
        shared &= np.asarray(distance) <= size
        places.append(np.asarray(nearest, dtype=np.int64))
    if shared.sum() < _SHARED * len(shared):
        return None
    selected = [
        replace(
            recording,
            markers=most.markers[shared],
            positions=recording.positions[:, nearest[shared]],
            seen=None if recording.seen is None else recording.seen[:, nearest[shared]],
        )
        for recording, nearest in zip(recordings, places, strict=True)
    ]
    finding = Finding.of(
        "markers-shared",
        f"the {int(shared.sum())} of {len(shared)} markers that are in all recordings are followed",
        where="experiment",
        count=int(shared.sum()),
        fix="track them again, if they matter",
    )
    return tuple(selected), (finding,)


def _same_markers(first: FloatArray, second: FloatArray) -> bool:
    return first.shape == second.shape and bool(
        np.abs(first - second).max() <= _SAME * np.ptp(first, axis=0).max()
    )
