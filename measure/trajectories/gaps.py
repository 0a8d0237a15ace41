"""Frames in which markers were not tracked: their positions are filled in, and a mask says which
were.

What is filled in starts a prediction and shows where a marker about is; it is never compared with a
prediction. Short gaps are filled by the marker's own motion, longer ones by that of its neighbours
or, of a marker that hardly moves, by its places before and after.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.findings import Finding
from flagdata.errors import InputError
from measure.trajectories.trajectory import Trajectory, marker_at

LONGEST = 0.12
"""Longest gap that the marker's own motion fills [s]: three frames at 25 a second."""
# of what is usual: a recording begins and ends with a frame in which so many markers were tracked
_TRACKED = 0.9
_LEAST = 0.5  # of the frames: a marker that was tracked in fewer is left out
_LOST = 0.5  # of the markers: a recording that loses more is refused
_NEIGHBOURS = (
    12  # tracked markers from which a quadratic map gives the place of one among them that was not
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Filled:
    """Positions without gaps.

    Attributes:
        frames: those of the recording that were kept, one stretch.
        markers: (marker,) which were kept.
        positions: (frame, marker, 3) of them [m].
        seen: (frame, marker) whether each was tracked; None where all were.
        findings: what was done.
    """

    frames: slice
    markers: BoolArray
    positions: FloatArray
    seen: BoolArray | None
    findings: tuple[Finding, ...]


def frames_of(gap: float, period: float) -> int:
    """Frames that a gap of so many seconds has at a period [s], at least one."""
    return max(1, round(gap / period))


def fill(trajectory: Trajectory) -> tuple[Trajectory, tuple[Finding, ...]]:
    """Fills a recording's NaN, and returns it with a mask of the positions that were tracked, and
    what was done.

    Raises:
        InputError: more than half of its markers are lost.
    """
    filled = fill_positions(
        trajectory.positions,
        trajectory.markers,
        period=1 / trajectory.rate,
        where=f"recording {trajectory.name!r}",
    )
    complete = replace(
        trajectory,
        markers=trajectory.markers[filled.markers],
        positions=filled.positions,
        seen=filled.seen,
        wind=trajectory.wind.later(filled.frames.start / trajectory.rate),
    )
    return complete, filled.findings


def fill_positions(
    positions: FloatArray, markers: FloatArray, *, period: float, where: str
) -> Filled:
    """Fills the NaN of positions (frame, marker, 3).

    The recording is cut to begin and end with frames in which about as many markers were tracked as
    usually. A marker that was tracked in fewer than half of the frames is left out. A gap of up to
    `LONGEST`, or one with frames in which hardly a marker was tracked, is filled by the cubic
    spline through the marker's other frames. In a longer one, or one at an end, the marker is where
    the quadratic map of its tracked neighbours takes it, less what that is off by at the ends of
    the gap; or evenly between its places at the ends, where that is closer in gaps of this length
    that are made where the marker was tracked, as it is of markers beside an attachment.

    Args:
        markers: (marker, 2) rest coordinates [m].
        period: between frames [s].

    Raises:
        InputError: nothing was tracked, or more than half of the markers are lost.
    """
    tracked = np.asarray(np.isfinite(positions).all(axis=2))
    if not tracked.any():
        raise InputError(
            "no marker was tracked in any frame",
            where=where,
            fix="check the columns and their units",
        )
    frames = _stretch(tracked)
    findings: list[Finding] = []
    cut = len(tracked) - (frames.stop - frames.start)
    if cut:
        findings.append(
            Finding.of(
                "recording-cut",
                f"{cut} frames at its ends are left out, in which clearly fewer markers were "
                "tracked than usually",
                where=where,
                count=cut,
            )
        )
    tracked = tracked[frames]
    markers_used = tracked.mean(axis=0) >= _LEAST
    lost = int((~markers_used).sum())
    if lost > _LOST * len(markers_used):
        raise InputError(
            f"{lost} of {len(markers_used)} markers were tracked in fewer than half of the frames",
            where=f"{where}, {marker_at(markers[~markers_used][0])}",
            fix="track them again, or cut the recording to where they are tracked",
        )
    if lost:
        findings.append(
            Finding.of(
                "markers-left-out",
                f"{lost} of {len(markers_used)} markers were tracked in fewer than half of the "
                "frames: left out",
                where=f"{where}, {marker_at(markers[~markers_used][0])}",
                count=lost,
                fix="track them again, if they matter",
            )
        )
    tracked_used = tracked[:, markers_used]
    missing = int((~tracked_used).sum())
    if not missing:
        return Filled(
            frames=frames,
            markers=markers_used,
            positions=np.array(positions[frames][:, markers_used]),
            seen=None,
            findings=tuple(findings),
        )
    findings.append(
        Finding.of(
            "markers-missing",
            f"{missing} positions ({100 * missing / tracked_used.size:.2g} %) were not tracked; "
            "predictions are not "
            "compared with them",
            where=f"{where}, frame {frames.start + _first(~tracked_used)}",
            count=missing,
            value=missing / tracked_used.size,
        )
    )
    complete = _fill_gaps(
        positions[frames][:, markers_used],
        tracked_used,
        markers[markers_used],
        frames_of(LONGEST, period),
    )
    return Filled(
        frames=frames,
        markers=markers_used,
        positions=complete,
        seen=tracked_used,
        findings=tuple(findings),
    )


def _fill_gaps(
    positions: FloatArray, tracked: BoolArray, markers: FloatArray, longest: int
) -> FloatArray:
    """Fills (frame, marker, 3)."""
    complete = np.array(positions)
    index = np.arange(len(complete))
    neighbours = np.argsort(((markers[:, None] - markers[None]) ** 2).sum(axis=2), axis=1)[:, 1:]
    for marker in np.flatnonzero(~tracked.all(axis=0)).tolist():
        of_marker = tracked[:, marker]
        spline = CubicSpline(index[of_marker], positions[of_marker, marker])
        carried: FloatArray | None = None
        for begin, end in _gaps(of_marker):
            inner = begin > 0 and end < len(of_marker)
            if (inner and end - begin <= longest) or tracked[begin:end].sum(
                axis=1
            ).min() < _NEIGHBOURS:
                complete[begin:end, marker] = spline(index[begin:end])
                continue
            if carried is None:
                carried = _carry_marker(positions, tracked, markers, neighbours[marker], marker)
            complete[begin:end, marker] = _long_gap(positions[:, marker], carried, index[begin:end])
    return complete


def _long_gap(track: FloatArray, carried: FloatArray, gap: IntArray) -> FloatArray:
    """Fills a gap (gap, 3) of a marker (frame, 3), by its own positions at the gap's ends or by
    where its neighbours take it."""
    off, half = track - carried, max(1, (len(gap) + 1) // 2)
    moved = _across(off, gap) + carried[gap]
    return (
        moved
        if _swing(off, half) < _swing(track, half) and np.isfinite(moved).all()
        else _across(track, gap)
    )


def _across(series: FloatArray, gap: IntArray) -> FloatArray:
    """Interpolates a series (frame, 3) in a gap, (gap, 3): it changes evenly between its ends, and
    stays beyond a single one."""
    ends = [frame for frame in (gap[0] - 1, gap[-1] + 1) if 0 <= frame < len(series)]
    return np.stack([np.interp(gap, ends, series[ends, axis]) for axis in range(3)], axis=-1)


def _swing(series: FloatArray, half: int) -> float:
    """Computes the mean square by which a series (frame, 3) is off the mean of itself so many
    frames before and after.

    It is what filling a gap of twice as many frames from its ends costs where the series is known;
    infinite where it is known nowhere.
    """
    off = series[half:-half] - (series[: -2 * half] + series[2 * half :]) / 2
    finite = off[np.isfinite(off).all(axis=1)]
    return float((finite**2).sum(axis=1).mean()) if len(finite) else np.inf


def _carry_marker(
    positions: FloatArray,
    tracked: BoolArray,
    markers: FloatArray,
    neighbours: IntArray,
    marker: int,
) -> FloatArray:
    """Maps a marker by the quadratic map of its nearest tracked neighbours, (frame, 3) [m].

    It is not finite in frames in which hardly a marker was tracked.

    Args:
        neighbours: the other markers, the nearest first.
    """
    positions_by_neighbours = np.full((len(positions), 3), np.nan)
    nearest = [neighbours[in_frame[neighbours]][:_NEIGHBOURS] for in_frame in tracked]
    fillable = np.flatnonzero([len(neighbours_used) == _NEIGHBOURS for neighbours_used in nearest])
    if not len(fillable):
        return positions_by_neighbours
    kinds, kind = np.unique(
        np.stack([nearest[frame] for frame in fillable]), axis=0, return_inverse=True
    )
    for index, chosen in enumerate(kinds):
        frames = fillable[kind.ravel() == index]
        weights = _weights(markers[chosen] - markers[marker])
        positions_by_neighbours[frames] = np.einsum(
            "n,fnc->fc", weights, positions[np.ix_(frames, chosen)]
        )
    return positions_by_neighbours


def _weights(arms: FloatArray) -> FloatArray:
    """Computes weights (neighbour,) by which places add up to that of a marker, arms (neighbour, 2)
    from it [m]."""
    u, v = (arms / np.abs(arms).max()).T
    basis = np.stack([np.ones(len(u)), u, v, u * u, u * v, v * v], axis=1)
    return np.linalg.pinv(basis, rcond=1e-3)[0]


def _gaps(tracked: BoolArray) -> Iterator[tuple[int, int]]:
    """Yields the first frame of each gap, and the frame after it."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], tracked, [True]]).astype(np.int8)))
    yield from ((int(begin), int(end)) for begin, end in zip(edges[::2], edges[1::2], strict=True))


def _stretch(tracked: BoolArray) -> slice:
    """Cuts to the frames from the first to the last in which nearly as many markers were tracked as
    usually, of those that are tracked half the time; all frames where there are none such."""
    often = tracked.mean(axis=0) >= _LEAST
    if not often.any():
        return slice(0, len(tracked))
    share = tracked[:, often].mean(axis=1)
    enough = np.flatnonzero(share >= _TRACKED * np.median(share))
    return slice(int(enough[0]), int(enough[-1]) + 1)


def _first(frames: BoolArray) -> int:
    return int(np.argmax(frames.any(axis=1)))
