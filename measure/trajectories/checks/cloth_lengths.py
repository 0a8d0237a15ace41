"""The cloth's own lengths: cloth hardly stretches, so neighbouring markers are never further apart
than at rest, and when the cloth is taut they are as far."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import Delaunay, KDTree, QhullError

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.findings import Finding
from flagdata.errors import InputError
from measure.trajectories import cloth_mesh
from measure.trajectories.observation import Observation
from measure.trajectories.trajectory import marker_at

FEWEST = 30
"""Markers that a recording must have."""
_TAUT = 0.9  # quantile over the frames of a length: as long as it gets, fluttering apart
_NORMAL = 1.2816  # that quantile of a normal distribution
# Median of these lengths over those at rest. In the reference runs, 0 to 8 m/s and 30 to 651
# markers: 1.00 to 1.03.
_SHORT, _LONG, _TOO_LONG = 0.95, 1.05, 1.08
_UNEVEN = 0.08  # the same along u and along v differ by less than 0.05 there
# a marker that is further than that from most of its neighbours is not where the file places it
_TORN = 1.5
_HOLE = 0.35  # of the cloth's size: a part that is further from any marker is not observed
_UNITS = {
    "mm for m": 1000.0,
    "cm for m": 100.0,
    "mm for cm": 10.0,
    "inches for m": 39.3701,
    "inches for cm": 2.54,
    "feet for m": 3.28084,
}


@dataclass(frozen=True, kw_only=True)
class Edges:
    """Neighbouring markers: (edge, 2) indices and (edge,) distances at rest [m]."""

    ends: IntArray
    rest: FloatArray

    @classmethod
    def between(cls, markers: FloatArray, *, where: str) -> Edges:
        """Finds the edges of the Delaunay triangulation of the flat cloth, those along its hollows
        left out.

        Raises:
            InputError: fewer than `FEWEST` markers, two in one place, or all on a line.
        """
        if len(markers) < FEWEST:
            raise InputError(
                f"the recording has {len(markers)} markers",
                where=where,
                fix=f"track at least {FEWEST}, spread over the cloth: fewer do not show how it "
                "bends",
            )
        if not np.isfinite(markers).all():
            raise InputError(
                "a rest coordinate is not finite", where=where, fix="give u and v of every marker"
            )
        query = KDTree(markers).query(markers, k=2)
        distances, neighbours = np.asarray(query[0]), np.asarray(query[1])
        size = float(np.ptp(markers, axis=0).max())
        if distances[:, 1].min() <= 1e-6 * size:
            first = int(distances[:, 1].argmin())
            raise InputError(
                "two markers are at the same point of the cloth",
                where=f"{where}, markers {first} and {int(neighbours[first, 1])}",
                fix="correct their u and v, or keep one of them",
            )
        try:
            faces = Delaunay(markers).simplices
        except QhullError:
            raise InputError(
                "all markers are on one line of the cloth",
                where=where,
                fix="track markers that span it",
            ) from None
        sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        pairs = np.unique(np.sort(sides, axis=1), axis=0)
        rest = np.hypot(*(markers[pairs[:, 0]] - markers[pairs[:, 1]]).T)
        short = rest < 2 * np.median(rest)
        return cls(ends=pairs[short].astype(np.int64), rest=rest[short])

    def lengths(self, positions: FloatArray) -> FloatArray:
        """Computes the edges' lengths (frame, edge) [m]; NaN where an end was not tracked."""
        return np.linalg.norm(positions[:, self.ends[:, 0]] - positions[:, self.ends[:, 1]], axis=2)


def check_scale(observation: Observation, edges: Edges, sigma: float) -> tuple[Finding, ...]:
    """Refuses positions that are not of this rest shape in metres.

    Raises:
        InputError: lengths that are off by a factor, or differently along u and v; or nothing to
            measure them by.
    """
    where = f"recording {observation.name!r}"
    taut, measured = _taut(edges.lengths(observation.positions), sigma)
    if not measured.any():
        raise InputError(
            "no two neighbouring markers are tracked together",
            where=where,
            fix="check the columns of the positions",
        )
    ratio = taut[measured] / edges.rest[measured]
    scale = float(np.median(ratio))
    if not _SHORT <= scale <= _TOO_LONG:
        raise InputError(
            f"taut, neighbouring markers are {scale:.4g} times as far apart as at rest",
            where=where,
            fix=_advice(scale),
        )
    arms = np.abs(
        observation.markers[edges.ends[measured, 0]] - observation.markers[edges.ends[measured, 1]]
    )
    along = [ratio[arms[:, axis] > 2 * arms[:, 1 - axis]] for axis in (0, 1)]
    if min(map(len, along)) >= 5:
        u, v = (float(np.median(part)) for part in along)
        if abs(u - v) > _UNEVEN:
            raise InputError(
                f"pulled tight, the cloth is {u:.4g} times its length at rest along u, but {v:.4g} "
                "times along v",
                where=where,
                fix="check the width and height that were given, and that the columns u and v are "
                "not exchanged",
            )
    if scale <= _LONG:
        return ()
    return (
        Finding.of(
            "cloth-longer-than-rest",
            f"taut, the cloth is {100 * (scale - 1):.1f} % longer than at rest, more than wind "
            "stretches it",
            where=where,
            value=scale,
            fix="measure its width and height again",
        ),
    )


def without_strays(observation: Observation, edges: Edges, sigma: float) -> Observation:
    """Sets positions to NaN where a marker is much further from most of its neighbours than the
    cloth allows: lost and found elsewhere, or exchanged with another."""
    reach = _TORN * edges.rest + 6 * sigma
    stretched = edges.lengths(observation.positions) > reach  # false where NaN
    torn = np.zeros(observation.positions.shape[:2])
    degree = np.bincount(edges.ends.ravel(), minlength=len(observation.markers))
    for end in (0, 1):
        np.add.at(torn.T, edges.ends[:, end], stretched.T)
    stray = torn > 0.5 * degree
    # The neighbours of a stray have one bad edge each; strays that are neighbours of strays are
    # found as well.
    count = int(stray.sum())
    if not count:
        return observation
    positions = np.array(observation.positions)
    positions[stray] = np.nan
    frame, marker = np.argwhere(stray)[0]
    finding = Finding.of(
        "markers-astray",
        f"{count} positions are further from the markers around than cloth can stretch; they are "
        "left out",
        count=count,
        where=f"recording {observation.name!r}, frame {int(frame)}, "
        f"{marker_at(observation.markers[marker])}",
        fix="look at the track there: was the marker exchanged with another?",
    )
    return replace(observation, positions=positions, findings=(*observation.findings, finding))


def check_cover(markers: FloatArray, corners: FloatArray, *, where: str) -> tuple[Finding, ...]:
    """Reports parts of the cloth that are far from any marker.

    Args:
        corners: (corner, 2) of its outline.
    """
    size = float(np.ptp(corners, axis=0).max())
    low, high = corners.min(axis=0), corners.max(axis=0)
    u, v = np.meshgrid(*(np.linspace(low[axis], high[axis], 25) for axis in (0, 1)))
    points = np.stack([u.ravel(), v.ravel()], axis=1)
    points = np.concatenate([points[cloth_mesh.inside(corners, points)], corners])
    away = np.asarray(KDTree(markers).query(points)[0])
    if away.max() <= _HOLE * size:
        return ()
    hole = points[int(away.argmax())]
    return (
        Finding.of(
            "cloth-not-covered",
            f"the nearest marker is {away.max():.3g} m away: what the cloth does there is guessed",
            where=f"{where}, (u, v) = ({hole[0]:.3g}, {hole[1]:.3g}) m",
            value=float(away.max()),
            fix="track markers there, or correct the outline",
        ),
    )


def _taut(lengths: FloatArray, sigma: float) -> tuple[FloatArray, BoolArray]:
    """Computes the upper decile of each length over its frames without the noise's part, (edge,),
    and masks the edges that have one.

    Noise of σ a coordinate lies along the edge with variance 2 σ², which widens the upper half of a
    distribution as of a normal one, and across it with 4 σ², which adds as much to the mean square.
    """
    tracked = np.isfinite(lengths)
    measured = tracked.sum(axis=0) >= 10
    taut = np.zeros(lengths.shape[1])
    if measured.any():
        middle, upper = np.nanquantile(lengths[:, measured], [0.5, _TAUT], axis=0)
        wide = np.maximum((upper - middle) ** 2 - (_NORMAL * np.sqrt(2) * sigma) ** 2, 0.0)
        taut[measured] = np.sqrt(np.maximum(middle**2 - 4 * sigma**2, 0.0)) + np.sqrt(wide)
    return taut, measured


def _advice(ratio: float) -> str:
    for units, factor in _UNITS.items():
        for value, conversion in (
            (factor, units),
            (1 / factor, " for ".join(reversed(units.split(" for ")))),
        ):
            if abs(ratio / value - 1) < 0.06:
                return f"the positions seem to be {conversion}: name their unit"
    return (
        "the rest shape does not fit: check width and height, the unit, and that both are of this "
        "cloth"
    )
