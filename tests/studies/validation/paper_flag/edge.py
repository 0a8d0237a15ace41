"""The centre line of a sheet seen edge-on: a dark line on a bright ground, one height a column, to
parts of a pixel.

In every column the line is the run of dark pixels around the darkest one, and its height is that
run's centroid, weighted with darkness above a floor. A line that moves during the exposure is
smeared into a band, whose centroid is the line's place at mid-exposure as long as it moves evenly;
its width says how far it moved. What cannot be located is flagged and left out, never filled.

The error of a height is estimated from the track itself: `scatter` compares every column with the
parabola through its neighbours, which a sheet with bending stiffness follows over a few pixels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Literal

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray, UInt8Array
from flagdata.core.findings import Severity
from flagdata.errors import InputError, UsageError
from flagdata.ingest import CameraOptions, open_camera
from flagdata.timebase import NANOSECONDS

_SPAN = 15
"""Columns of the parabola in `scatter`: 2 mm at 0.138 mm a pixel, over which a sheet of 75 µm paper
is smooth."""

_STRIDE = 4
"""Each so many-th row counts for the median that is the ground of a column: a line covers few of
them."""


class Seen(IntEnum):
    """What a column shows."""

    LINE = 0
    """One line, its height measured."""
    NOTHING = 1
    """No pixel darker than the ground by the least contrast: no line, or one smeared until it
    vanishes."""
    DOUBLE = 2
    """Two lines: the sheet is folded over, or something else is in view."""
    SMEARED = 3
    """A band wider than `EdgeOptions.widest`: moved too far during the exposure."""
    APART = 4
    """A line that does not join the sheet: the holder, dirt, a reflection."""


@dataclass(frozen=True, kw_only=True)
class EdgeOptions:
    """How the line is found.

    Attributes:
        contrast: least darkness against the ground [gray levels].
        floor: share of a column's greatest darkness below which a pixel does not count.
        widest: widest band that counts as a line, measured across the line [px].
        step: greatest distance between the heights of neighbouring columns of one line [px]; a
            slope of `step`.
        bridge: widest gap within one line [columns].
    """

    contrast: float = 8.0
    floor: float = 0.25
    widest: float = 60.0
    step: float = 3.0
    bridge: int = 12

    def __post_init__(self) -> None:
        if not (0 < self.floor < 1 and min(self.contrast, self.widest, self.step, self.bridge) > 0):
            raise UsageError(
                f"{self} finds nothing", where="edge", fix="give positive values, a floor below 1"
            )


@dataclass(frozen=True, kw_only=True)
class EdgeTrack:
    """The line in every frame and column.

    Attributes:
        time: (frame,) [s] from the first frame on, by the camera's true rate.
        height: (frame, column) rows from the top, fractional [px]; NaN where `seen` is not LINE.
        width: (frame, column) of the dark run along the column [px]; NaN likewise.
        seen: (frame, column) `Seen`.
    """

    time: FloatArray
    height: FloatArray
    width: FloatArray
    seen: UInt8Array

    def __post_init__(self) -> None:
        frames = (len(self.time), self.height.shape[-1])
        if not (self.height.shape == self.width.shape == self.seen.shape == frames):
            raise InputError(
                f"times {self.time.shape}, heights {self.height.shape}, widths {self.width.shape} "
                "do not fit",
                where="edge track",
                fix="give (frame,) times and (frame, column) arrays",
            )

    @property
    def rate(self) -> float:
        """Frames a second [Hz]."""
        return float((len(self.time) - 1) / (self.time[-1] - self.time[0]))

    def share(self, what: Seen) -> float:
        """The share that was seen so, of all frames and columns of the picture."""
        return float((self.seen == what).mean())


def line_in(image: UInt8Array, options: EdgeOptions) -> tuple[FloatArray, FloatArray, UInt8Array]:
    """Height, width and kind of what each column of one picture shows.

    Args:
        image: (row, column), the line dark.

    Returns:
        (column,) heights and widths [px], NaN where no line is, and `Seen` as numbers.
    """
    columns = np.arange(image.shape[1])
    ground = np.median(image[::_STRIDE], axis=0)
    peak = (image - ground.astype(np.int16)).argmin(axis=0)
    deepest = np.maximum(ground - image[peak, columns], 0.0)
    line = deepest >= options.contrast
    floor = np.maximum(options.floor * deepest, options.contrast / 2)
    reach = math.ceil(2 * options.widest)
    rows = peak + np.arange(-reach, reach + 1)[:, None]
    inside = (rows >= 0) & (rows < len(image))
    dark = np.where(inside, ground - image[np.clip(rows, 0, len(image) - 1), columns], 0.0)
    run = _run_around(dark > floor, reach)
    weight = np.where(run, dark - floor, 0.0)
    height = (weight * rows).sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-12)
    width = run.sum(axis=0).astype(np.float64)
    second = np.where(run, 0.0, dark).max(axis=0)
    seen = np.full(len(columns), Seen.NOTHING, dtype=np.uint8)
    seen[line] = Seen.LINE
    seen[line & (second > np.maximum(0.5 * deepest, options.contrast))] = Seen.DOUBLE
    sheet = _joined(height, seen == Seen.LINE, options)
    seen[(seen == Seen.LINE) & ~sheet] = Seen.APART
    slope = _slope(np.where(seen == Seen.LINE, height, np.nan))
    seen[(seen == Seen.LINE) & (width > options.widest * np.sqrt(1 + slope**2))] = Seen.SMEARED
    located = seen == Seen.LINE
    return np.where(located, height, np.nan), np.where(located, width, np.nan), seen


def _run_around(counted: BoolArray, middle: int) -> BoolArray:
    """The unbroken run of each column that holds its middle row."""
    above = np.logical_and.accumulate(counted[middle::-1], axis=0)[::-1]
    below = np.logical_and.accumulate(counted[middle:], axis=0)
    return np.concatenate([above, below[1:]])


def _joined(height: FloatArray, line: BoolArray, options: EdgeOptions) -> BoolArray:
    """The columns of the longest chain in which neighbours lie within `step` a column and gaps
    within `bridge`."""
    columns = np.flatnonzero(line)
    sheet = np.zeros_like(line)
    if not len(columns):
        return sheet
    gap = np.diff(columns)
    rise = np.abs(np.diff(height[columns]))
    cut = (gap > options.bridge) | (rise > options.step * gap + 1)
    chains = np.split(columns, np.flatnonzero(cut) + 1)
    sheet[max(chains, key=len)] = True
    return sheet


def _slope(height: FloatArray) -> FloatArray:
    """Central differences over 8 columns; 0 where they are not known."""
    slope = np.zeros_like(height)
    slope[4:-4] = np.nan_to_num((height[8:] - height[:-8]) / 8)
    return slope


def scatter(track: EdgeTrack) -> FloatArray:
    """Standard error of single heights, (frame,) [px]: residuals of the parabola through 15 columns
    around each.

    The residual of the middle point of a parabola through k points, with independent errors σ, has
    the variance σ² (1 − c), c the middle weight of the quadratic Savitzky–Golay filter; smooth
    parts of the error (lens, codec blocks) are not seen. NaN for frames with fewer than 15 whole
    windows.
    """
    half = _SPAN // 2
    offset = np.arange(-half, half + 1)
    basis = np.stack([np.ones(_SPAN), offset, offset**2], axis=1).astype(np.float64)
    kernel = np.linalg.pinv(basis)[0]
    windows = np.lib.stride_tricks.sliding_window_view(track.height, _SPAN, axis=1)
    residual = (track.height[:, half:-half] - windows @ kernel) / np.sqrt(1 - kernel[half])
    known = np.isfinite(residual)
    count = known.sum(axis=1)
    # A robust spread: 1.4826 times the median magnitude is σ for a normal error.
    error = np.full(len(residual), np.nan)
    enough = count >= _SPAN
    if enough.any():
        error[enough] = 1.4826 * np.nanmedian(np.abs(residual[enough]), axis=1)
    return error


def track_edge(
    path: Path,
    *,
    true_rate: float,
    rate: float | Literal["native"] = "native",
    options: EdgeOptions | None = None,
) -> EdgeTrack:
    """The line in all frames of a clip, in its own pixels.

    Args:
        true_rate: at which the camera ran [Hz], whatever its container says.
        rate: of the frames that are measured [Hz]; "native" measures each.

    Raises:
        InputError: the clip is damaged, or has fewer than two frames.
        FlagdataError: as `open_camera`.
    """
    options = options or EdgeOptions()
    size = _longest_side(path)
    camera = CameraOptions(start=0, true_fps=true_rate, rate=rate, size=size)
    times, found = [], []
    with open_camera(path, camera) as stream:
        left, top = (size - stream.info.width) // 2, (size - stream.info.height) // 2
        for frame in stream:
            image = frame.image[top : top + stream.info.height, left : left + stream.info.width]
            found.append(line_in(image, options))
            times.append(frame.time / NANOSECONDS)
        damage = [finding for finding in stream.findings if finding.severity is Severity.ERROR]
    if damage:
        raise InputError(
            damage[0].what,
            where=str(path),
            fix=damage[0].fix or "give an undamaged copy of the clip",
        )
    if len(times) < 2:
        raise InputError(
            "a clip of fewer than two frames", where=str(path), fix="give a moving picture"
        )
    time = np.array(times)
    return EdgeTrack(
        time=time - time[0],
        height=np.stack([each[0] for each in found]),
        width=np.stack([each[1] for each in found]),
        seen=np.stack([each[2] for each in found]),
    )


def _longest_side(path: Path) -> int:
    """So that frames come out at their own size, neither shrunk nor enlarged."""
    with open_camera(path, CameraOptions(start=0, rate="native")) as stream:
        return max(stream.info.width, stream.info.height)
