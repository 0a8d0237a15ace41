"""A reading that is not zero in calm air, and the jump out of it: estimated from idle stretches."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import RefusedError, UsageError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.options import ZeroOffset
from flagdata.ingest.anemometer.reading import Reading
from flagdata.schema import SampleFlag
from flagdata.timebase import NANOSECONDS

WINDOW = 2.0
"""Length of a stretch that is looked at whole [s]."""
SHORTEST = 10.0
"""Idle time it takes to believe an offset [s]: free air does not hold its speed within `BAND` for so long."""
BAND = 0.05
"""Widest spread of an idle reading within a stretch [m/s], or four steps of its resolution if that is more."""
LARGEST = 1.0
"""An idle reading beyond this is no zero offset but steady wind [m/s]."""
_BELOW = 0.1
"""Readings below an idle one, over those that are idle, beyond which it is no calm air's."""
LEAST_JUMP = 0.1
"""A smaller step out of idling is no dead zone [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Zero:
    """An estimate of the zero offset.

    Attributes:
        offset: the median idle reading [m/s].
        sigma: standard deviation of the idle stretches' medians [m/s]: how far the zero wanders.
        idle: (n,) rows that are idle.
        seconds: idle time in all [s].
        jump: from the offset to the first reading outside the idle band after idling [m/s]; NaN if it never left.
        exits: how often the reading left the idle band.
    """

    offset: float
    sigma: float
    idle: NDArray[np.bool_]
    seconds: float
    jump: float
    exits: int


def resolution(values: NDArray[np.float64]) -> float:
    """Smallest step between different readings that occurs [same unit], 0 when all are equal."""
    levels = np.unique(np.round(values[np.isfinite(values)], 9))
    return float(np.diff(levels).min()) if len(levels) > 1 else 0.0


def estimate(time: NDArray[np.int64], speed: NDArray[np.float64]) -> Zero | None:
    """The zero offset shown by idle stretches, `None` where there is not enough idle time.

    Args:
        time: (n,) increasing UTC nanoseconds.
        speed: (n,) [m/s], NaN where missing.
    """
    if len(time) < 20 or not np.isfinite(speed).any():
        return None
    band = max(BAND, 4 * resolution(speed))
    if band > LARGEST:
        return None
    window = (time - time[0]) // int(WINDOW * NANOSECONDS)
    starts = np.flatnonzero(np.concatenate(([True], np.diff(window) > 0)))
    counts = np.diff(np.append(starts, len(time)))
    filled = np.where(np.isfinite(speed), speed, np.inf)
    top = np.maximum.reduceat(filled, starts)
    bottom = np.minimum.reduceat(filled, starts)
    with np.errstate(invalid="ignore"):
        steady = (top - bottom <= band) & (np.abs(top) <= LARGEST) & (counts >= 4)
    if steady.sum() * WINDOW < SHORTEST:
        return None
    medians = np.array([np.median(speed[s : s + c]) for s, c in zip(starts[steady], counts[steady], strict=True)])
    offset = float(np.median(medians))
    # Stretches at another level (a steady breeze within the limits) are not the same zero.
    same = np.abs(medians - offset) <= band
    if same.sum() * WINDOW < SHORTEST:
        return None
    idle = np.isfinite(speed) & (np.abs(speed - offset) <= band)
    if (speed < offset - band).sum() > _BELOW * idle.sum():
        return None  # a speed that often falls below it blows there
    leaves = np.flatnonzero(idle[:-1] & ~idle[1:] & np.isfinite(speed[1:]))
    jump = float(np.median(speed[leaves + 1] - offset)) if len(leaves) else float("nan")
    return Zero(
        offset=offset, sigma=float(np.std(medians[same])), idle=idle, seconds=float(same.sum() * WINDOW), jump=jump,
        exits=len(leaves),
    )  # fmt: skip


def check(reading: Reading, asked: ZeroOffset | None, *, where: str) -> None:
    """Refuse to subtract a zero offset where there is no speed it belongs to.

    Raises:
        UsageError: an offset, or its estimate, was asked for a log of components or without wind speed.
    """
    if asked is None or asked == "report":
        return
    if "wind_x" in reading.channels:
        raise UsageError(
            "a zero offset was asked for, but the log has wind components, each with a zero of its own", where=where,
            fix="give each column its offset in a recipe",
        )  # fmt: skip
    if "wind_speed" not in reading.channels:
        raise UsageError(
            "a zero offset was asked for, but the log has no wind speed", where=where, fix="leave out --zero-offset"
        )


def settle(reading: Reading, choice: ZeroOffset) -> Reading:
    """Report the zero offset of `wind_speed`, and subtract it where `choice` says so.

    A jump out of the calm that was found becomes the sensor's threshold, where its recipe states none and calm reads
    about 0 after the shift: the uncertainty of a calm then covers what it may hide.

    Raises:
        RefusedError: an estimate was asked for and the log has no idle stretch.
    """
    speed = reading.channels.get("wind_speed")
    if speed is None or "wind_x" in reading.channels:
        return reading
    possible = np.where((reading.flags & SampleFlag.OUT_OF_RANGE) != 0, np.nan, speed)
    zero = estimate(reading.time, possible)
    shift = 0.0
    found: list[Finding] = []
    if choice == "estimate":
        if zero is None:
            raise RefusedError(
                f"no zero offset can be estimated: the reading is nowhere idle for {SHORTEST:g} s",
                fix="give the reading in calm air: --zero-offset M/S, or leave it as it is: --zero-offset report",
            )
        shift = zero.offset
    elif choice != "report":
        shift = float(choice)
        found.append(
            Finding(
                kind="zero-offset-given", severity=Severity.NOTE, value=shift, count=len(speed),
                what=f"a zero offset of {shift:+.3f} m/s was given and subtracted from every speed",
            )
        )  # fmt: skip
    sensor = reading.sensor
    if zero is not None and abs(zero.offset) > max(0.5 * resolution(possible), 1e-6):
        settled = abs(zero.offset - shift) <= BAND
        jumped = zero.exits > 0 and np.isfinite(zero.jump) and zero.jump > LEAST_JUMP
        found.append(_about_zero(reading, zero, shift, settled=settled))
        if jumped:
            found.append(_about_jump(reading, zero))
        if jumped and settled and sensor.threshold is None:
            # Calm now reads about 0, and what blows below the jump reads as calm: that is a threshold.
            sensor = replace(sensor, threshold=zero.jump)
    flags = reading.flags
    if zero is not None and shift and abs(zero.offset - shift) <= BAND:
        flags = np.where(zero.idle, flags | SampleFlag.DEAD_ZONE, flags).astype(np.uint16)
    corrected = speed - shift
    if shift:
        # The scatter of a calm about its zero is no impossible wind: flagged as calm, its sign kept.
        calm = (corrected < 0) & (np.abs(corrected) <= max(BAND, 4 * resolution(possible)))
        flags = np.where(calm, flags | SampleFlag.DEAD_ZONE, flags).astype(np.uint16)
    channels = {**reading.channels, "wind_speed": corrected}
    return replace(reading, channels=channels, sensor=sensor).with_findings(tuple(found), flags=flags)


def _about_zero(reading: Reading, zero: Zero, shift: float, *, settled: bool) -> Finding:
    """What calm air reads, and whether the `shift` subtracted [m/s] has settled it."""
    fix = None
    if settled:
        done = "subtracted"
    elif shift:
        done = f"{shift:+.3f} m/s was subtracted, which leaves {zero.offset - shift:+.3f} m/s in calm air"
        fix = f"correct it: --zero-offset estimate, or --zero-offset {zero.offset:.3g}"
    else:
        done = "not subtracted"
        fix = f"subtract it: --zero-offset estimate, or --zero-offset {zero.offset:.3g}"
    return Finding(
        kind="zero-offset", severity=Severity.NOTE if settled else Severity.WARNING, count=int(zero.idle.sum()),
        value=zero.offset, where=f"line {reading.line[np.argmax(zero.idle)]}",
        what=f"calm air reads {zero.offset:+.3f} m/s (σ {zero.sigma:.3f}, {zero.seconds:.0f} s idle); {done}",
        fix=fix,
    )  # fmt: skip


def _about_jump(reading: Reading, zero: Zero) -> Finding:
    leave = np.flatnonzero(zero.idle[:-1] & ~zero.idle[1:])
    return Finding(
        kind="dead-zone-jump", severity=Severity.WARNING, count=zero.exits, value=zero.jump,
        where=f"line {reading.line[leave[0] + 1]}",
        what=f"the reading leaves calm in a jump of {zero.jump:.2f} m/s "
        f"({zero.exits} {'time' if zero.exits == 1 else 'times'}): lower speeds read as calm",
        fix="do not use winds below that jump",
    )  # fmt: skip
