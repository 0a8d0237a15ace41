"""Frames in which markers were not tracked: their positions are filled in, and a mask says which were.

What is filled in starts a prediction and shows where a marker about is; it is never compared with a prediction. Short
gaps are filled by the marker's own motion, longer ones by that of its neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from measure.observe.trajectory import Floats, Trajectory

LONGEST = 0.12
"""Longest gap that the marker's own motion fills [s]: three frames at 25 a second."""
_TRACKED = 0.9  # of what is usual: a recording begins and ends with a frame in which so many markers were tracked
_LEAST = 0.5  # of the frames: a marker that was tracked in fewer is left out
_LOST = 0.5  # of the markers: a recording that loses more is refused
_NEIGHBOURS = 12  # tracked markers that tell by a quadratic map where one among them is that was not


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
    markers: NDArray[np.bool_]
    positions: Floats
    seen: NDArray[np.bool_] | None
    findings: tuple[Finding, ...]


def frames_of(gap: float, period: float) -> int:
    """Frames that a gap of so many seconds has at a period [s], at least one."""
    return max(1, round(gap / period))


def fill(trajectory: Trajectory) -> tuple[Trajectory, tuple[Finding, ...]]:
    """A recording without NaN, whose mask says which positions were tracked, and what was done to get there.

    Raises:
        InputError: more than half of its markers are lost.
    """
    filled = fill_positions(
        trajectory.positions, trajectory.markers, period=1 / trajectory.rate, where=f"recording {trajectory.name!r}"
    )
    complete = replace(
        trajectory, markers=trajectory.markers[filled.markers], positions=filled.positions, seen=filled.seen,
        wind=trajectory.wind.later(filled.frames.start / trajectory.rate),
    )  # fmt: skip
    return complete, filled.findings


def fill_positions(positions: Floats, markers: Floats, *, period: float, where: str) -> Filled:
    """Positions (frame, marker, 3) without their NaN.

    The recording is cut to begin and end with frames in which about as many markers were tracked as usually. A marker
    that was tracked in fewer than half of the frames is left out. A gap of up to `LONGEST`, or one with frames in which
    hardly a marker was tracked, is filled by the cubic spline through the marker's other frames. In a longer one, or
    one at an end, the marker is where the quadratic map of its tracked neighbours takes it, less what that is off by at
    the ends of the gap.

    Args:
        markers: (marker, 2) rest coordinates [m].
        period: between frames [s].

    Raises:
        InputError: nothing was tracked, or more than half of the markers are lost.
    """
    tracked = np.asarray(np.isfinite(positions).all(axis=2))
    if not tracked.any():
        raise InputError("no marker was tracked in any frame", where=where, fix="check the columns and their units")
    frames = _stretch(tracked)
    found: list[Finding] = []
    cut = len(tracked) - (frames.stop - frames.start)
    if cut:
        found.append(Finding(
            kind="recording-cut", severity=Severity.WARNING, where=where, count=cut,
            what=f"{cut} frames at its ends are left out, in which clearly fewer markers were tracked than usually",
        ))  # fmt: skip
    tracked = tracked[frames]
    kept = tracked.mean(axis=0) >= _LEAST
    lost = int((~kept).sum())
    if lost > _LOST * len(kept):
        marker = int(np.flatnonzero(~kept)[0])
        raise InputError(
            f"{lost} of {len(kept)} markers were tracked in fewer than half of the frames",
            where=f"{where}, marker {marker}", fix="track them again, or cut the recording to where they are tracked",
        )  # fmt: skip
    if lost:
        found.append(Finding(
            kind="markers-left-out", severity=Severity.WARNING, where=f"{where}, marker {int(np.argmin(kept))}",
            count=lost, what=f"{lost} of {len(kept)} markers were tracked in fewer than half of the frames: left out",
            fix="track them again, if they matter",
        ))  # fmt: skip
    there = tracked[:, kept]
    missing = int((~there).sum())
    if not missing:
        return Filled(
            frames=frames, markers=kept, positions=np.array(positions[frames][:, kept]), seen=None,
            findings=tuple(found),
        )  # fmt: skip
    found.append(Finding(
        kind="markers-missing", severity=Severity.WARNING, where=f"{where}, frame {frames.start + _first(~there)}",
        count=missing, value=missing / there.size,
        what=f"{missing} positions ({100 * missing / there.size:.2g} %) were not tracked; predictions are not compared "
        "with them",
    ))  # fmt: skip
    whole = _filled(positions[frames][:, kept], there, markers[kept], frames_of(LONGEST, period))
    return Filled(frames=frames, markers=kept, positions=whole, seen=there, findings=tuple(found))


def _filled(positions: Floats, there: NDArray[np.bool_], markers: Floats, longest: int) -> Floats:
    """(frame, marker, 3) without NaN."""
    whole = np.array(positions)
    index = np.arange(len(whole))
    near = np.argsort(((markers[:, None] - markers[None]) ** 2).sum(axis=2), axis=1)[:, 1:]
    for marker in np.flatnonzero(~there.all(axis=0)).tolist():
        seen = there[:, marker]
        spline = CubicSpline(index[seen], positions[seen, marker])
        for begin, end in _gaps(seen):
            inner = begin > 0 and end < len(seen)
            if (inner and end - begin <= longest) or there[begin:end].sum(axis=1).min() < _NEIGHBOURS:
                whole[begin:end, marker] = spline(index[begin:end])
                continue
            ends = [frame for frame, real in ((begin - 1, begin > 0), (end, end < len(seen))) if real]
            span = index[max(begin - 1, 0) : min(end, len(seen) - 1) + 1]
            guess = np.stack([_carried(positions[k], there[k], markers, near[marker], marker) for k in span])
            off = np.stack([positions[k, marker] - guess[k - span[0]] for k in ends])
            # The offset at the ends changes evenly in between; beyond a single end it stays.
            share = np.stack([np.interp(index[begin:end], ends, off[:, axis]) for axis in range(3)], axis=-1)
            whole[begin:end, marker] = guess[index[begin:end] - span[0]] + share
    return whole


def _carried(frame: Floats, there: NDArray[np.bool_], markers: Floats, near: NDArray[np.int64], marker: int) -> Floats:
    """(3,) where the quadratic map of the nearest tracked markers takes a marker [m]."""
    chosen = near[there[near]][:_NEIGHBOURS]
    arms = markers[chosen] - markers[marker]
    u, v = (arms / np.abs(arms).max()).T
    basis = np.stack([np.ones(len(u)), u, v, u * u, u * v, v * v], axis=1)
    solved, *_ = np.linalg.lstsq(basis, frame[chosen], rcond=1e-3)
    return solved[0]


def _gaps(seen: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """First frame of each gap, and the frame after it."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], seen, [True]]).astype(np.int8)))
    yield from ((int(begin), int(end)) for begin, end in zip(edges[::2], edges[1::2], strict=True))


def _stretch(tracked: NDArray[np.bool_]) -> slice:
    """From the first to the last frame in which nearly as many markers were tracked as usually, of those that are
    tracked half the time; all frames where there are none such."""
    often = tracked.mean(axis=0) >= _LEAST
    if not often.any():
        return slice(0, len(tracked))
    share = tracked[:, often].mean(axis=1)
    enough = np.flatnonzero(share >= _TRACKED * np.median(share))
    return slice(int(enough[0]), int(enough[-1]) + 1)


def _first(frames: NDArray[np.bool_]) -> int:
    return int(np.argmax(frames.any(axis=1)))
