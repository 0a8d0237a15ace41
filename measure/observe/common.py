"""Recordings of one cloth whose markers or rates differ, followed at the same points and at the same rate.

Where they differ because trackers lost some markers, the markers that all recordings have are taken. Where they differ
as meshes of different runs do, all are followed at the points of the model's mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial import KDTree

from flagdata.errors import InputError
from flagdata.findings import Finding
from measure.observe.interpolation import onto
from measure.observe.trajectory import Floats, Trajectory

_SAME = 1e-6
"""Share of the cloth's size within which places are the same: rest coordinates are often kept in single precision."""
_DENSER = 2.0
"""Markers a point: between markers as far apart as the points, wrinkles are lost that the other recordings show."""
_SHARED = 0.5
"""Share of the markers of the recording with most that all must have in common, for these to be taken alone."""
_NEAR = 0.75
"""Share of a point's weight: it counts as tracked where markers of so much were tracked."""


def at_same_rate(recordings: Sequence[Trajectory]) -> tuple[tuple[Trajectory, ...], tuple[Finding, ...]]:
    """The recordings as they are if their rates are the same; else each at the lowest of their rates.

    Positions in between are those of cubic splines in time, tracked where both neighbouring frames were.
    """
    rate = min(own.rate for own in recordings)
    moved: list[Trajectory] = []
    found: list[Finding] = []
    for own in recordings:
        if own.rate == rate:
            moved.append(own)
            continue
        times = np.arange(int((len(own.positions) - 1) / own.rate * rate + 1e-9) + 1) / rate
        place = times * own.rate
        before = np.minimum(np.floor(place + 1e-9).astype(np.int64), len(own.positions) - 2)
        seen = None if own.seen is None else own.seen[before] & own.seen[before + 1]
        moved.append(replace(own, rate=rate, positions=CubicSpline(own.times, own.positions)(times), seen=seen))
        found.append(
            Finding.of(
                "recording-resampled",
                f"its {own.rate:.4g} frames a second are not those of the other recordings: it is followed at "
                f"{rate:.4g} Hz",
                where=f"recording {own.name!r}",
                value=rate,
            )
        )
    return tuple(moved), tuple(found)


def at_same_points(
    recordings: Sequence[Trajectory], points: Floats
) -> tuple[tuple[Trajectory, ...], tuple[Finding, ...]]:
    """The recordings as they are if their markers are the same; else each at these points (point, 2) [m].

    Raises:
        InputError: a recording with markers too few to show the cloth at other points.
    """
    first = recordings[0]
    if all(_alike(own.markers, first.markers) for own in recordings):
        return tuple(replace(own, markers=first.markers) for own in recordings), ()
    if (shared := _shared(recordings)) is not None:
        return shared
    moved: list[Trajectory] = []
    found: list[Finding] = []
    for own in recordings:
        where, count = f"recording {own.name!r}", len(own.markers)
        if _alike(own.markers, points):
            moved.append(replace(own, markers=points))
            continue
        if count < _DENSER * len(points):
            raise InputError(
                f"its {count} markers are not those of the other recordings, and too few to follow the cloth at "
                f"the same {len(points)} points",
                where=where,
                fix="track the same points in all recordings, or close the loop on them one by one",
            )
        weights = onto(own.markers, points)
        grown = float(np.sqrt((weights**2).sum(axis=1).mean()))
        positions = np.einsum("pm,fmc->fpc", weights, own.positions)
        seen = None if own.seen is None else own.seen @ np.abs(weights).T >= _NEAR * np.abs(weights).sum(axis=1)
        moved.append(replace(own, markers=points, positions=positions, noise=own.noise * grown, seen=seen))
        found.append(
            Finding.of(
                "markers-resampled",
                f"its {count} markers are not those of the other recordings: all are followed at {len(points)} "
                "points of the cloth",
                where=where,
                count=len(points),
            )
        )
    return tuple(moved), tuple(found)


def _shared(recordings: Sequence[Trajectory]) -> tuple[tuple[Trajectory, ...], tuple[Finding, ...]] | None:
    """The recordings with the markers that all of them have; None where these are too few to speak of one layout."""
    most = max(recordings, key=lambda own: len(own.markers))
    size = _SAME * float(np.ptp(most.markers, axis=0).max())
    places: list[NDArray[np.int64]] = []
    there = np.ones(len(most.markers), dtype=bool)
    for own in recordings:
        distance, place = KDTree(own.markers).query(most.markers)
        there &= np.asarray(distance) <= size
        places.append(np.asarray(place, dtype=np.int64))
    if there.sum() < _SHARED * len(there):
        return None
    made = [
        replace(
            own,
            markers=most.markers[there],
            positions=own.positions[:, place[there]],
            seen=None if own.seen is None else own.seen[:, place[there]],
        )
        for own, place in zip(recordings, places, strict=True)
    ]
    found = Finding.of(
        "markers-shared",
        f"the {int(there.sum())} of {len(there)} markers that are in all recordings are followed",
        where="experiment",
        count=int(there.sum()),
        fix="track them again, if they matter",
    )
    return tuple(made), (found,)


def _alike(one: Floats, other: Floats) -> bool:
    return one.shape == other.shape and bool(np.abs(one - other).max() <= _SAME * np.ptp(one, axis=0).max())
