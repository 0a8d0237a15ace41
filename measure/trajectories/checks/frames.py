"""Frames: enough of them, evenly spaced, none repeated or lost, and something that moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import KDTree

from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.errors import InputError
from measure.trajectories.gaps import LONGEST, frames_of
from measure.trajectories.observation import Observation
from measure.trajectories.trajectory import marker_at

SHORTEST = 2.0
"""Seconds that a recording must last."""
FEWEST = 40
"""Frames that it must have."""
_SLOWEST, _FASTEST = 9.0, 550.0  # Hz: 10 to 500, and what cameras and trackers are off by
_JITTER = 0.1  # of a frame: times that are further off an even grid are not of a constant rate
_REPEATED = 0.02  # of the usual squared step: a frame that moved less repeats the one before
_MANY = 0.2  # of the frames: repeats that are so many mean a lower rate
_FROZEN = (
    0.95  # of the frames: repeats that are so many are no repeats but a cloth that stands still
)
_AROUND = 5  # frames on either side that give the usual step
_NEIGHBOURS = 4
_MOVED_ON = (
    20.0  # times the smallest steps there are: the neighbours of a stuck marker move as much
)
_PINNED = 0.5  # of the frames: a marker that stands still in so many is held
_FAR = (
    0.05  # of the cloth's size: (0, 0, 0) is no position of a marker that never comes as near to it
)
_JUMP = 1.7  # of the mean of the steps on either side: a frame is missing in between
# of the cloth's size, and three times the noise: what moves less on the average stands still
_STILL = 1e-3


def even(observation: Observation) -> Observation:
    """Spaces the recording's frames evenly: where some are missing, NaN stands for them.

    Raises:
        InputError: too few frames, or times that are not of a constant rate.
    """
    where = f"recording {observation.name!r}"
    count = len(observation.times)
    span = float(observation.times[-1] - observation.times[0]) if count else 0.0
    if count < FEWEST or span < SHORTEST * (1 - 1e-9):
        raise InputError(
            f"the recording has {count} frames over {span:.3g} s",
            where=where,
            fix=f"record at least {SHORTEST:g} s and {FEWEST} frames: with less, effects cannot be "
            "distinguished",
        )
    step = float(np.median(np.diff(observation.times)))
    if not _SLOWEST <= 1 / step <= _FASTEST:
        raise InputError(
            f"the recording has {1 / step:.4g} frames a second",
            where=where,
            fix=f"give {_SLOWEST:g} to {_FASTEST:g} Hz: cloth moves on too far between rarer "
            "frames",
        )
    index = np.concatenate(
        [[0], np.cumsum(np.rint(np.diff(observation.times) / step).astype(np.int64))]
    )
    step, first = np.polyfit(
        index, observation.times, 1
    ).tolist()  # the median of rounded times is a rounded step
    off = np.abs(observation.times - first - index * step)
    if off.max() > _JITTER * step or (np.diff(index) < 1).any():
        frame = int(off.argmax())
        raise InputError(
            f"frames are not evenly spaced: one is {1e3 * off[frame]:.3g} ms off, at "
            f"{1e3 * step:.4g} ms a frame",
            where=f"{where}, frame {frame}",
            fix="interpolate the positions to a constant rate, or track a video of constant frame "
            "rate",
        )
    times = np.arange(index[-1] + 1) * step
    lost = len(times) - count
    if not lost:
        return replace(observation, times=times)
    longest = int(np.diff(index).max()) - 1
    gap = int(index[np.argmax(np.diff(index) > 1)]) + 1
    if longest > frames_of(LONGEST, step):
        raise InputError(
            f"{longest} frames on end are missing, {longest * step:.2g} s",
            where=f"{where}, frame {gap}",
            fix="cut the recording there and give its parts as recordings of their own",
        )
    positions = np.full((len(times), *observation.positions.shape[1:]), np.nan)
    positions[index] = observation.positions
    finding = Finding.of(
        "frames-missing",
        f"{lost} frames are missing between others and are interpolated",
        where=f"{where}, frame {gap}",
        count=lost,
    )
    return replace(
        observation, times=times, positions=positions, findings=(*observation.findings, finding)
    )


def without_repeats(observation: Observation, sigma: float) -> Observation:
    """Sets frames to NaN that only repeat the one before, as recorders fill in lost ones.

    Args:
        sigma: standard deviation of a coordinate's noise [m].

    Raises:
        InputError: a fifth of the frames or more are repeats, or nearly all.
    """
    where = f"recording {observation.name!r}"
    steps = _steps(observation.positions)
    if (steps == 0).mean() > _FROZEN:
        raise InputError(
            "no motion is found: nearly all frames are the same",
            where=where,
            fix="record the cloth in a wind",
        )
    square = steps - 6 * sigma**2
    usual = _neighbourhood(square)
    repeat = np.zeros(len(observation.positions), dtype=bool)
    repeat[1:] = (steps == 0) | ((square < _REPEATED * usual) & (usual > 6 * sigma**2))
    count = int(repeat.sum())
    if not count:
        return observation
    if count >= _MANY * len(repeat):
        rate = (
            (len(repeat) - count)
            / (len(repeat) - 1)
            / float(observation.times[1] - observation.times[0])
        )
        raise InputError(
            f"{count} of {len(repeat)} frames repeat the one before",
            where=f"{where}, frame {int(repeat.argmax())}",
            fix=f"it may have been tracked at about {rate:.4g} Hz: drop the repeats and give that "
            "rate",
        )
    positions = np.array(observation.positions)
    positions[repeat] = np.nan
    finding = Finding.of(
        "repeated-frames",
        f"{count} frames repeat the one before; they are interpolated",
        where=f"{where}, frame {int(repeat.argmax())}",
        count=count,
        fix="find out whether the camera or the tracker lost frames there",
    )
    return replace(observation, positions=positions, findings=(*observation.findings, finding))


def without_stuck_markers(observation: Observation) -> Observation:
    """Sets positions to NaN where trackers write something else for a marker they lost.

    That is its last position while its neighbours move on, or exactly (0, 0, 0) where it never is
    otherwise. A marker that mostly stands still is a pin, and left alone.
    """
    step = np.abs(np.diff(observation.positions, axis=0)).max(axis=2)
    neighbours = KDTree(observation.markers).query(
        observation.markers, k=min(_NEIGHBOURS + 1, len(observation.markers))
    )[1]
    around = np.median(
        step[:, np.asarray(neighbours)[:, 1:]], axis=2
    )  # NaN where a neighbour was not tracked
    units = step[step > 0]
    resolution = float(np.quantile(units, 0.01)) if len(units) else 0.0
    stuck = np.zeros(observation.positions.shape[:2], dtype=bool)
    stuck[1:] = (step == 0) & (around > _MOVED_ON * resolution)
    stuck &= (step == 0).mean(axis=0) < _PINNED
    tracked = np.isfinite(observation.positions).all(axis=2)
    zero = (observation.positions == 0).all(axis=2)
    distances = np.where(
        (tracked & ~zero)[:, :, None],
        np.linalg.norm(observation.positions, axis=2, keepdims=True),
        np.inf,
    )
    nearest = distances[:, :, 0].min(
        axis=0
    )  # to the origin, when not at it; infinite for one that always is
    stuck |= (
        zero
        & np.isfinite(nearest)
        & (nearest > _FAR * float(np.ptp(observation.markers, axis=0).max()))
    )
    count = int(stuck.sum())
    if not count:
        return observation
    positions = np.array(observation.positions)
    positions[stuck] = np.nan
    frame, marker = np.argwhere(stuck)[0]
    finding = Finding.of(
        "positions-stuck",
        f"{count} positions are exactly those of the frame before while the markers around move "
        "on, or are "
        "(0, 0, 0): not tracked",
        count=count,
        where=f"recording {observation.name!r}, frame {int(frame)}, "
        f"{marker_at(observation.markers[marker])}",
    )
    return replace(observation, positions=positions, findings=(*observation.findings, finding))


def check_motion(positions: FloatArray, sigma: float, size: float, *, where: str) -> None:
    """Refuses a cloth that stands still.

    Args:
        positions: (frame, marker, 3) without gaps [m].
        sigma: standard deviation of a coordinate's noise [m].
        size: of the cloth [m].

    Raises:
        InputError: the median marker moves by less than its noise and a thousandth of the cloth.
    """
    motion = float(np.median(np.sqrt(positions.var(axis=0).sum(axis=1))))
    least = max(3 * np.sqrt(3) * sigma, _STILL * size)
    if motion < least:
        raise InputError(
            f"no motion is found: {1e3 * motion:.3g} mm on the average, with {1e3 * sigma:.3g} mm "
            "of noise",
            where=where,
            fix="record the cloth in a wind; a still cloth says nothing of damping, inertia or "
            "gusts",
        )


def lost_frames(positions: FloatArray, *, where: str) -> tuple[Finding, ...]:
    """Steps nearly twice as long as those on either side: a frame was lost there, and nothing says
    so.

    Found only where the motion is well sampled: where the ratio of steps hardly varies otherwise.

    Args:
        positions: (frame, marker, 3) without gaps [m].
    """
    step = np.linalg.norm(np.diff(positions, axis=0), axis=2)
    total = np.sqrt((step**2).mean(axis=1))
    if len(total) < 2 * _AROUND or not (total > 0).all():
        return ()
    ratio = total[1:-1] / ((total[:-2] + total[2:]) / 2)
    spread = 1.4826 * float(np.median(np.abs(ratio - np.median(ratio))))
    jumps = np.flatnonzero(ratio > max(_JUMP, 1 + 8 * spread)) + 1
    if not len(jumps):
        return ()
    return (
        Finding.of(
            "frames-lost",
            f"{len(jumps)} steps are about twice as long as those before and after: frames seem to "
            "be missing",
            where=f"{where}, frame {int(jumps[0]) + 1}",
            count=len(jumps),
            fix="give the frames' times or numbers, so that the gap is known",
        ),
    )


def _steps(positions: FloatArray) -> FloatArray:
    """Computes the mean squared step of the tracked markers (frame − 1,) [m²]; NaN where none is
    tracked on both sides."""
    square = (np.diff(positions, axis=0) ** 2).sum(axis=2)
    tracked = np.isfinite(square)
    count = tracked.sum(axis=1)
    total = np.where(tracked, square, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _neighbourhood(values: FloatArray) -> FloatArray:
    """Computes the median of the values around each, itself left out, (n,)."""
    usual = np.empty_like(values)
    for k in range(len(values)):
        around = np.concatenate([values[max(0, k - _AROUND) : k], values[k + 1 : k + 1 + _AROUND]])
        finite = around[np.isfinite(around)]
        usual[k] = np.median(finite) if len(finite) else np.nan
    return usual
