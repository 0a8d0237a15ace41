"""Frames in which markers were not tracked: short gaps are interpolated, markers with longer ones are left out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from measure.observe.trajectory import Floats, Trajectory

LONGEST = 3
"""Frames of the longest gap that is interpolated."""
_TRACKED = 0.9  # of the markers: a recording begins and ends with a frame in which so many were tracked
_LOST = 0.5  # of the markers: a recording that loses more is refused


@dataclass(frozen=True, kw_only=True, eq=False)
class Filled:
    """Positions without gaps.

    Attributes:
        frames: those of the recording that were kept, one stretch.
        markers: (marker,) which were kept.
        positions: (frame, marker, 3) of them [m].
        findings: what was done.
    """

    frames: slice
    markers: NDArray[np.bool_]
    positions: Floats
    findings: tuple[Finding, ...]


def fill(trajectory: Trajectory) -> tuple[Trajectory, tuple[Finding, ...]]:
    """A recording in which every marker is tracked in every frame, and what was done to get there.

    Raises:
        InputError: more than half of its markers are lost.
    """
    filled = fill_positions(trajectory.positions, where=f"recording {trajectory.name!r}")
    complete = replace(
        trajectory, markers=trajectory.markers[filled.markers], positions=filled.positions,
        wind=trajectory.wind.later(filled.frames.start / trajectory.rate),
    )  # fmt: skip
    return complete, filled.findings


def fill_positions(positions: Floats, *, where: str) -> Filled:
    """Positions (frame, marker, 3) [m] without their NaN.

    The recording is cut to begin and end with frames in which nine of ten markers were tracked. A gap of up to
    `LONGEST` frames is filled by the cubic spline through the marker's other frames; a marker with a longer gap, or one
    at either end, is left out.

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
            what=f"{cut} frames at its ends are left out, in which fewer than nine of ten markers were tracked",
        ))  # fmt: skip
    tracked = tracked[frames]
    kept = (_longest_gap(tracked) <= LONGEST) & tracked[0] & tracked[-1]
    lost = int((~kept).sum())
    if lost > _LOST * len(kept):
        marker = int(np.flatnonzero(~kept)[0])
        raise InputError(
            f"{lost} of {len(kept)} markers have gaps of more than {LONGEST} frames",
            where=f"{where}, marker {marker}", fix="track them again, or cut the recording to where they are tracked",
        )  # fmt: skip
    if lost:
        found.append(Finding(
            kind="markers-left-out", severity=Severity.WARNING, where=f"{where}, marker {int(np.argmin(kept))}",
            count=lost, what=f"{lost} of {len(kept)} markers are left out: not tracked at an end, or for more than "
            f"{LONGEST} frames on end",
            fix="track them again, if they matter",
        ))  # fmt: skip
    whole = np.array(positions[frames][:, kept])
    there = tracked[:, kept]
    missing = int((~there).sum())
    index = np.arange(len(whole))
    for marker in np.flatnonzero(~there.all(axis=0)):
        seen = there[:, marker]
        whole[~seen, marker] = CubicSpline(index[seen], whole[seen, marker])(index[~seen])
    if missing:
        found.append(Finding(
            kind="gaps-filled", severity=Severity.WARNING, where=f"{where}, frame {frames.start + _first(~there)}",
            count=missing, value=missing / there.size,
            what=f"{missing} positions ({100 * missing / there.size:.2g} %) in gaps of up to {LONGEST} frames are "
            "interpolated",
        ))  # fmt: skip
    return Filled(frames=frames, markers=kept, positions=whole, findings=tuple(found))


def _stretch(tracked: NDArray[np.bool_]) -> slice:
    """From the first to the last frame in which nine of ten of the markers were tracked that are tracked half the time;
    all frames where there are none such."""
    often = tracked.mean(axis=0) >= _LOST
    enough = np.flatnonzero(tracked[:, often].mean(axis=1) >= _TRACKED) if often.any() else np.empty(0, dtype=np.int64)
    return slice(int(enough[0]), int(enough[-1]) + 1) if len(enough) else slice(0, len(tracked))


def _longest_gap(tracked: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(marker,) frames of each one's longest gap."""
    longest = np.zeros(tracked.shape[1], dtype=np.int64)
    running = np.zeros_like(longest)
    for frame in tracked:
        running = np.where(frame, 0, running + 1)
        longest = np.maximum(longest, running)
    return longest


def _first(frames: NDArray[np.bool_]) -> int:
    return int(np.argmax(frames.any(axis=1)))
