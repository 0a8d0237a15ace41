"""How much a flag moves, frame by frame: one number that rises with the wind, for finding the lag
between two clocks.

Successive frames are compared after what concerns the whole picture has been taken out. With I the
newer and J the older frame, both averaged over square blocks,

    I ≈ a + g J + s_x ∂J/∂x + s_y ∂J/∂y + motion,

where a and g are flicker, exposure and gain, and (s_x, s_y) a small shift of the camera (the
linearised brightness constancy of Lucas and Kanade, 1981). The four numbers are fitted by least
squares and refitted without the blocks that move. The energy is what the residual holds above the
noise of the same pair of frames,

    E = mean(max(|residual| − 3 σ, 0)) / Δt,

so that only the moving area counts, and no map of it has to be learnt first.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import BoolArray, Float32Array, FloatArray, UInt8Array
from flagdata.core.findings import Finding
from flagdata.errors import InputError
from flagdata.record.signals import Instants, Series
from flagdata.timebase import NANOSECONDS

BLOCKS = 60  # blocks along the shorter side of the picture
LONGEST_GAP = 0.5  # s; frames further apart are not compared
_LOW_QUANTILE = 0.2
_LOW_QUANTILE_OF_HALF_NORMAL = 0.2533471031357997  # P(|z| < this) = 0.2 for a standard normal z
_FEWEST_STILL = 0.1  # of the blocks, for a fit
_SHAKE = 0.5  # pixels of the original picture, root mean square


@dataclass(frozen=True, kw_only=True)
class MotionSeries:
    """Motion energy on the camera's own clock.

    Attributes:
        time: (n,) midway between the two frames compared, UTC nanoseconds on the camera's clock,
            strictly increasing.
        energy: (n,) mean brightness change above noise [gray levels/s], NaN where two frames were
            too far apart.
        findings: what was noticed about the picture (camera shake, flicker, no motion).

    Raises:
        InputError: shapes that disagree, time that does not increase, or negative energies.
    """

    time: Instants
    energy: Series
    findings: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        if self.time.ndim != 1 or self.time.shape != self.energy.shape:
            raise InputError(
                f"motion with {self.time.shape} times and {self.energy.shape} energies",
                fix="give one energy a time",
            )
        if len(self.time) > 1 and not bool(np.all(np.diff(self.time) > 0)):
            raise InputError(
                "the times of the motion do not increase", fix="give the frames in order of time"
            )
        if bool(np.any(self.energy < 0)):
            raise InputError(
                "a motion energy is negative",
                fix="give mean absolute differences or another energy ≥ 0",
            )

    def __len__(self) -> int:
        return len(self.time)


def motion_energy(frames: Iterable[tuple[int, UInt8Array]]) -> MotionSeries:
    """Computes the motion energy of a film, in one pass, holding two reduced frames at a time.

    Args:
        frames: (instant [UTC ns on the camera's clock], (height, width) uint8 gray), in order of
            time; all of one size.

    Raises:
        InputError: fewer than two frames, frames of different sizes, or times that do not increase.
    """
    times: list[int] = []
    energies: list[float] = []
    shifts: list[float] = []
    gains: list[float] = []
    before: Float32Array | None = None
    before_time = 0
    before_shape: tuple[int, ...] = ()
    block = 1
    for time, image in frames:
        if before is None:
            block = max(1, min(image.shape) // BLOCKS)
            before_shape = image.shape
        if image.shape != before_shape:
            raise InputError(
                f"a frame has shape {image.shape} after frames of {before_shape}",
                fix="crop all frames to one size",
            )
        reduced = _reduce(image, block)
        if before is not None:
            if time <= before_time:
                raise InputError(
                    f"frame {len(times) + 1} is not later than the one before it",
                    fix="give the frames in order of time",
                )
            gap = (time - before_time) / NANOSECONDS
            times.append(before_time + (time - before_time) // 2)
            if gap > LONGEST_GAP:
                energies.append(math.nan)
            else:
                change, gain, shift = _change(before, reduced, block)
                energies.append(change / gap)
                gains.append(gain)
                shifts.append(shift * block)
        before, before_time = reduced, time
    if not times:
        raise InputError("motion needs two frames at least", fix="give a longer film")
    return MotionSeries(
        time=np.array(times, dtype=np.int64),
        energy=np.array(energies),
        findings=_findings(energies, shifts, gains),
    )


def _reduce(image: UInt8Array, block: int) -> Float32Array:
    """Means over `block` × `block` pixels; rows and columns that do not fill a block are left
    out."""
    height, width = image.shape[0] // block, image.shape[1] // block
    blocks = image[: height * block, : width * block]
    return blocks.reshape(height, block, width, block).mean(axis=(1, 3), dtype=np.float32)


def _change(before: Float32Array, after: Float32Array, block: int) -> tuple[float, float, float]:
    """Computes the mean change above noise [gray levels], the gain, and the shift [blocks] between
    two reduced frames."""
    grad_y, grad_x = (
        np.gradient(before)
        if min(before.shape) > 1
        else (np.zeros_like(before), np.zeros_like(before))
    )
    centre = float(before.mean())
    columns = np.stack(
        [np.ones(before.size), (before - centre).ravel(), grad_x.ravel(), grad_y.ravel()],
        axis=1,
        dtype=np.float64,
    )  # (blocks, 4)
    target = after.ravel().astype(np.float64) - centre
    least = (
        1.0 / block
    )  # a gray level a pixel: rounding and JPEG leave as much, in steps that hide σ
    still = target - columns[:, 1]
    starts = (_quiet(np.abs(still - np.median(still)), least)[0], np.ones(before.size, dtype=bool))
    residual, sigma, parameters = min(
        (_fit_blocks(columns, target, keep, least) for keep in starts), key=lambda fit: fit[1]
    )
    change = float(np.mean(np.maximum(residual - 3 * sigma, 0.0)))
    return change, float(parameters[1]), float(math.hypot(parameters[2], parameters[3]))


def _fit_blocks(
    columns: FloatArray, target: FloatArray, keep: BoolArray, least: float
) -> tuple[FloatArray, float, FloatArray]:
    """Computes |residual| and its σ after least squares on the blocks to keep, twice; and the four
    parameters.

    Two starts are compared, since either can go astray: all blocks, where the flag fills little of
    the picture, and those that hardly changed, where the camera stands still.
    """
    parameters = np.array([0.0, 1.0, 0.0, 0.0])
    residual, sigma = np.abs(target - columns @ parameters), math.inf
    for _ in range(2):
        if np.count_nonzero(keep) < max(8, _FEWEST_STILL * len(target)):
            break
        columns_used = columns[keep]
        # As by the pseudo-inverse, which leaves alone what a flat picture does not determine (gain,
        # shift).
        values, vectors = np.linalg.eigh(columns_used.T @ columns_used)
        inverse = np.divide(1.0, values, out=np.zeros(4), where=values > 1e-9 * values[-1])
        parameters = vectors @ (inverse * (vectors.T @ (columns_used.T @ target[keep])))
        residual = np.abs(target - columns @ parameters)
        keep, sigma = _quiet(residual, least)
    return residual, sigma, parameters


def _quiet(residual: FloatArray, least: float) -> tuple[BoolArray, float]:
    """Finds which blocks are within 3 σ, σ being that of a normal distribution with the residual's
    lowest fifth."""
    # np.quantile, which takes ten times as long on so few numbers.
    below, share = divmod(_LOW_QUANTILE * (len(residual) - 1), 1)
    places = (int(below), min(int(below) + 1, len(residual) - 1))
    low, high = np.partition(residual, places)[list(places)]
    sigma = max(float(low + share * (high - low)) / _LOW_QUANTILE_OF_HALF_NORMAL, least)
    return residual < 3 * sigma, sigma


def _findings(
    energies: list[float], shifts: list[float], gains: list[float]
) -> tuple[Finding, ...]:
    findings: list[Finding] = []
    shake = math.sqrt(float(np.mean(np.square(shifts)))) if shifts else 0.0
    if shake > _SHAKE:
        findings.append(
            Finding.of(
                "camera-shake",
                f"the whole picture moves by {shake:.1f} pixels a frame (rms); taken out to first "
                "order",
                value=shake,
            )
        )
    flicker = float(np.std(gains)) if gains else 0.0
    if flicker > 0.02:
        findings.append(
            Finding.of(
                "brightness-flicker",
                f"the brightness of the whole picture varies by {100 * flicker:.1f} % a frame; "
                "taken out",
                value=flicker,
            )
        )
    if energies and not np.nanmax(np.array([0.0, *energies])) > 0:
        findings.append(Finding.of("no-motion", "no motion is found in the picture"))
    return tuple(findings)
