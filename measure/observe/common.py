"""Recordings of one cloth whose markers differ, as meshes of different runs do, followed at the same points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from measure.observe.interpolation import onto
from measure.observe.trajectory import Floats, Trajectory

_SAME = 1e-6
"""Of the cloth's size: rest coordinates are often kept in single precision."""
_DENSER = 2.0
"""Markers a point: between markers as far apart as the points, wrinkles are lost that the other recordings show."""


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
                where=where, fix="track the same points in all recordings, or close the loop on them one by one",
            )  # fmt: skip
        weights = onto(own.markers, points)
        grown = float(np.sqrt((weights**2).sum(axis=1).mean()))
        positions = np.einsum("pm,fmc->fpc", weights, own.positions)
        moved.append(replace(own, markers=points, positions=positions, noise=own.noise * grown))
        found.append(
            Finding(
                kind="markers-resampled", severity=Severity.NOTE, where=where, count=len(points),
                what=f"its {count} markers are not those of the other recordings: all are followed at {len(points)} "
                "points of the cloth",
            )
        )  # fmt: skip
    return tuple(moved), tuple(found)


def _alike(one: Floats, other: Floats) -> bool:
    return one.shape == other.shape and bool(np.abs(one - other).max() <= _SAME * np.ptp(one, axis=0).max())
