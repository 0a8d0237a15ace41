"""A reading that is not zero in calm air, and the jump out of it: estimated from idle stretches."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.findings import Finding, Severity
from flagdata.core.schema import SampleFlag
from flagdata.core.shell import command_line
from flagdata.errors import RefusedError, UsageError
from flagdata.ingest.anemometer.log_reading import Reading
from flagdata.ingest.anemometer.wind_options import ZeroOffset
from flagdata.timebase import NANOSECONDS

_WINDOW = 2.0
"""Length of a stretch that is looked at whole [s]."""
_SHORTEST = 10.0
"""Idle time it takes to believe an offset [s]: free air does not hold its speed within `_BAND` for
so long. Lowered, a lull passes for idling; raised, short calms no longer show the offset."""
_BAND = 0.05
"""Widest spread of an idle reading within a stretch [m/s], or four steps of its resolution if that
is more. Raised, light steady wind passes for idling."""
_LARGEST = 1.0
"""An idle reading beyond this is no zero offset but steady wind [m/s]. Raised, steady wind may be
subtracted."""
_BELOW = 0.1
"""Readings below an idle one, over those that are idle, beyond which it is no calm air's."""
_LEAST_JUMP = 0.1
"""A smaller step out of idling is no dead zone [m/s]."""
_BETWEEN = 0.02
"""Share of the readings of wind that lie between calm and the step, beyond which no dead zone hides
them."""


@dataclass(frozen=True, kw_only=True)
class Zero:
    """An estimate of the zero offset.

    Attributes:
        offset: the median idle reading [m/s].
        sigma: standard deviation of the idle stretches' medians [m/s]: how far the zero wanders.
        idle: (n,) rows that are idle.
        seconds: idle time in all [s].
        jump: from the offset to the first reading outside the idle band after idling [m/s]; NaN if
            it never left, or has readings below that.
        leaves: (n,) rows after which the reading leaves the idle band.
    """

    offset: float
    sigma: float
    idle: BoolArray
    seconds: float
    jump: float
    leaves: BoolArray


def resolution(values: FloatArray) -> float:
    """Finds the smallest step between different readings that occurs [same unit], 0 when all are
    equal."""
    levels = np.unique(np.round(values[np.isfinite(values)], 9))
    return float(np.diff(levels).min()) if len(levels) > 1 else 0.0


def estimate(time: IntArray, speed: FloatArray) -> Zero | None:
    """Estimates the zero offset shown by idle stretches, `None` where there is not enough idle
    time.

    Args:
        time: (n,) increasing UTC nanoseconds.
        speed: (n,) [m/s], NaN where missing.
    """
    band = max(_BAND, 4 * resolution(speed))
    if len(time) < 20 or not np.isfinite(speed).any() or band > _LARGEST:
        return None
    window = (time - time[0]) // int(_WINDOW * NANOSECONDS)
    starts = np.flatnonzero(np.concatenate(([True], np.diff(window) > 0)))
    counts = np.diff(np.append(starts, len(time)))
    filled = np.where(np.isfinite(speed), speed, np.inf)
    top, bottom = np.maximum.reduceat(filled, starts), np.minimum.reduceat(filled, starts)
    with np.errstate(invalid="ignore"):
        steady = (top - bottom <= band) & (np.abs(top) <= _LARGEST) & (counts >= 4)
    if steady.sum() * _WINDOW < _SHORTEST:
        return None
    medians = np.array(
        [np.median(speed[s : s + c]) for s, c in zip(starts[steady], counts[steady], strict=True)]
    )
    offset = float(np.median(medians))
    # Stretches at another level (a steady breeze within the limits) are not the same zero.
    same = np.abs(medians - offset) <= band
    idle = np.isfinite(speed) & (np.abs(speed - offset) <= band)
    if same.sum() * _WINDOW < _SHORTEST or (speed < offset - band).sum() > _BELOW * idle.sum():
        return None  # a speed that often falls below it blows there
    leaves = np.append(idle[:-1] & ~idle[1:] & np.isfinite(speed[1:]), False)
    jump = float("nan")
    if leaves.any():
        step = float(np.median(speed[np.flatnonzero(leaves) + 1] - offset))
        blows = np.isfinite(speed) & ~idle
        if (speed[blows] < offset + 0.8 * step).mean() <= _BETWEEN:  # else a cap was taken off, say
            jump = step
    return Zero(
        offset=offset,
        sigma=float(np.std(medians[same])),
        idle=idle,
        seconds=float(same.sum() * _WINDOW),
        jump=jump,
        leaves=leaves,
    )


def check(reading: Reading, asked: ZeroOffset | None, *, where: str) -> None:
    """Refuse to subtract a zero offset where there is no speed it belongs to.

    Raises:
        UsageError: an offset, or its estimate, was asked for a log of components or without wind
            speed.
    """
    if (
        asked is None
        or asked == "report"
        or ("wind_speed" in reading.channels and "wind_x" not in reading.channels)
    ):
        return
    components = "wind_x" in reading.channels
    message = "wind components, each with a zero of its own" if components else "no wind speed"
    fix = "give each column its offset in a recipe" if components else "leave out --zero-offset"
    raise UsageError(
        f"a zero offset was asked for, but the log has {message}", where=where, fix=fix
    )


def settle(reading: Reading, choice: ZeroOffset) -> Reading:
    """Report the zero offset of `wind_speed`, and subtract it where `choice` says so.

    A jump out of the calm that was found becomes the sensor's threshold, where its recipe states
    none and calm reads
    about 0 after the shift: the uncertainty of a calm then covers what it may hide.

    Raises:
        RefusedError: an estimate was asked for and the log has no idle stretch.
    """
    speed = reading.channels.get("wind_speed")
    if speed is None or "wind_x" in reading.channels:
        return reading
    possible = np.where((reading.flags & SampleFlag.OUT_OF_RANGE) != 0, np.nan, speed)
    zero, step = estimate(reading.time, possible), resolution(possible)
    shift = 0.0
    if choice == "estimate":
        if zero is None:
            raise RefusedError(
                f"no zero offset can be estimated: the reading is nowhere idle for {_SHORTEST:g} s",
                fix="give the reading in calm air: --zero-offset M/S, or leave it as it is: "
                "--zero-offset report",
            )
        shift = zero.offset
    elif choice != "report":
        shift = float(choice)
        message = f"a zero offset of {shift:+.3f} m/s was given and subtracted from every speed"
        finding = Finding.of("zero-offset-given", message, value=shift, count=len(speed))
        reading = reading.with_findings((finding,))
    if zero is not None and abs(zero.offset) > max(0.5 * step, 1e-6):
        reading = _report_zero(reading, zero, shift)
    corrected = speed - shift
    calm = np.zeros(len(speed), dtype=bool)
    if shift:
        # The scatter of a calm about its zero is no impossible wind: flagged as calm, its sign
        # kept.
        calm = (corrected < 0) & (np.abs(corrected) <= max(_BAND, 4 * step))
        calm |= zero.idle if zero is not None and abs(zero.offset - shift) <= _BAND else False
    flags = np.where(calm, reading.flags | SampleFlag.DEAD_ZONE, reading.flags)
    return replace(reading, channels={**reading.channels, "wind_speed": corrected}).with_findings(
        (), flags=flags
    )


def _report_zero(reading: Reading, zero: Zero, shift: float) -> Reading:
    """Reports what calm air reads, whether the `shift` subtracted [m/s] has settled it, and the
    jump out of it."""
    settled = abs(zero.offset - shift) <= _BAND
    done, fix = "subtracted" if shift else f"left as it is, within {_BAND:g} m/s of zero", None
    if not settled:
        ways = f"--zero-offset estimate, or {command_line('--zero-offset', f'{zero.offset:.3g}')}"
        fix = f"correct it: {ways}" if shift else f"subtract it: {ways}"
        rest = zero.offset - shift
        done = (
            f"{shift:+.3f} m/s was subtracted, which leaves {rest:+.3f} m/s in calm air"
            if shift
            else "not subtracted"
        )
    message = (
        f"calm air reads {zero.offset:+.3f} m/s (σ {zero.sigma:.3f}, {zero.seconds:.0f} s idle); "
        f"{done}"
    )
    severity = Severity.NOTE if settled else Severity.WARNING
    reading = reading.marked(
        zero.idle, "zero-offset", message, severity=severity, value=zero.offset, fix=fix
    )
    if not zero.jump > _LEAST_JUMP:
        return reading
    message = (
        f"the reading leaves calm in a jump of {zero.jump:.2f} m/s ({{n}} times): lower speeds "
        "read as calm"
    )
    fix = "do not use winds below that jump"
    reading = reading.marked(
        np.roll(zero.leaves, 1), "dead-zone-jump", message, value=zero.jump, fix=fix
    )
    if settled and reading.sensor.threshold is None:
        # Calm now reads about 0, and what blows below the jump reads as calm: that is a threshold.
        return replace(reading, sensor=replace(reading.sensor, threshold=zero.jump))
    return reading
