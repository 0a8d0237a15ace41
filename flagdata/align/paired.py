"""Two clocks that stamped the same samples: a device's own, and that of the computer which received
them.

A sample stamped t by the device reaches the computer late, never early: host = device + offset(t) +
delay, delay ≥ 0, and the delays come in bursts (buffers of serial ports and USB, a busy computer).
So the offset is the lower envelope of host − device, not its mean (Moon, Skelly and Towsley,
INFOCOM 1999), here by the least of each of many short blocks and a line through those that no
single wrong stamp can turn (Theil 1950, Sen 1968). Where the envelope steps, one of the
clocks was set: the model gets another segment, and nothing is fitted across (as pyxdf does). Stamps
are never evened out.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from flagdata.align.declared import PRIOR_DRIFT, stamp_sigma
from flagdata.core.arrays import IntArray
from flagdata.core.clock_model import NINETY, ClockModel, Segment
from flagdata.core.findings import Finding
from flagdata.errors import InputError
from flagdata.record.signals import Instants, Series, WindSeries
from flagdata.timebase import NANOSECONDS, iso

LEAST_JUMP = 0.1  # s; smaller steps are taken for delays

_BLOCK = 1.0  # s, at least
_SAMPLES = 8  # a block, at least
_MOST_BLOCKS = 400  # the line through them takes all pairs
_SIDE = 5  # blocks on either side of a step
_NORMAL = 1.4826  # σ over the median absolute deviation, normal distribution
_MEDIAN_LOSS = 1.2533  # σ of a median over σ of a mean, normal distribution


@dataclass(frozen=True, kw_only=True)
class PairedClocks:
    """A device's clock on a computer's.

    Attributes:
        model: offset, drift and σ by segments; offsets are of the fastest samples, `least_delay`
            taken off.
        delay: median delay above the fastest [s].
        worst_delay: the longest [s].
        findings: jumps, long delays.
    """

    model: ClockModel
    delay: float
    worst_delay: float
    findings: tuple[Finding, ...]


def pair_clocks(
    device_time: Instants,
    host_time: Instants,
    *,
    device: str = "device",
    reference: str = "host",
    least_delay: float = 0.0,
    least_delay_sigma: float | None = None,
) -> PairedClocks:
    """Models `device_time` on the clock of `host_time`.

    Args:
        device_time: (n,) the device's stamps, strictly increasing [UTC ns].
        host_time: (n,) the computer's stamps of the same samples [UTC ns].
        least_delay: of the fastest sample on its way [s]; the stamps do not show it.
        least_delay_sigma: its standard uncertainty [s]; with `None`, the median delay above the
            fastest, since what cannot be seen is likely of the size of what can.

    Raises:
        InputError: fewer than two samples, shapes that disagree, device stamps that do not
            increase, or a step so large that the two cannot be clocks of the same samples' time.
    """
    if device_time.ndim != 1 or device_time.shape != host_time.shape:
        raise InputError(
            f"{device_time.shape} device stamps and {host_time.shape} host stamps",
            fix="give two stamps for each sample",
        )
    if len(device_time) < 2:
        raise InputError("a clock cannot be modelled from one sample", fix="give a longer log")
    if not bool(np.all(np.diff(device_time) > 0)):
        raise InputError(
            "device stamps that do not increase", fix="sort and report the disorder first"
        )
    time = (device_time - device_time[0]) / NANOSECONDS
    # Offsets may be decades (a device without a set clock): kept exact as integers, fitted about
    # the first one.
    base = int(host_time[0] - device_time[0])
    late = ((host_time - device_time) - base) / NANOSECONDS
    quantum = math.hypot(stamp_sigma(device_time), stamp_sigma(host_time))
    edges = [0, *_jumps(time, late), len(time)]
    pieces = [slice(low, high) for low, high in itertools.pairwise(edges)]
    fits = [_line(time[piece], late[piece], quantum) for piece in pieces]
    delays = np.concatenate(
        [late[p] - fit.at(time[p]) for p, fit in zip(pieces, fits, strict=True)]
    )
    delay = float(np.median(np.maximum(delays, 0.0)))
    unseen = delay if least_delay_sigma is None else least_delay_sigma
    segments = tuple(
        Segment(
            start=int(device_time[piece.start]),
            end=int(device_time[piece.stop])
            if piece.stop < len(time)
            else int(device_time[-1]) + 1,
            origin=int(device_time[0]) + round(fit.origin * NANOSECONDS),
            offset=base / NANOSECONDS + fit.offset - least_delay,
            drift=fit.drift,
            sigma_offset=math.hypot(fit.sigma_offset, unseen, quantum),
            sigma_drift=fit.sigma_drift,
        )
        for piece, fit in zip(pieces, fits, strict=True)
    )
    model = ClockModel(
        device=device, reference=reference, method="paired", confidence=1.0, segments=segments
    )
    worst = float(delays.max())
    return PairedClocks(
        model=model, delay=delay, worst_delay=worst, findings=_findings(model, delay, worst)
    )


@dataclass(frozen=True, kw_only=True)
class _Line:
    """offset + drift · (time − origin), all in seconds."""

    origin: float
    offset: float
    drift: float
    sigma_offset: float
    sigma_drift: float

    def at(self, time: Series) -> Series:
        return self.offset + self.drift * (time - self.origin)


def _blocks(time: Series) -> IntArray:
    """Finds the first indices of the blocks."""
    count = len(time)
    span = max(float(time[-1] - time[0]), 1e-9)
    length = max(_BLOCK, span * _SAMPLES / count, span / _MOST_BLOCKS)
    number = np.floor((time - time[0]) / length).astype(np.int64)
    return np.flatnonzero(np.concatenate(([True], np.diff(number) > 0)))


def _least(time: Series, late: Series) -> tuple[Series, Series, IntArray]:
    """Finds time and value of the least of each block, and the blocks' first indices."""
    starts = _blocks(time)
    ends = np.append(starts[1:], len(time))
    index = np.array(
        [low + int(np.argmin(late[low:high])) for low, high in zip(starts, ends, strict=True)]
    )
    return time[index], late[index], starts


def _line(time: Series, late: Series, quantum: float) -> _Line:
    """Fits the lower envelope of one segment; `quantum` is the σ that the resolution of the stamps
    leaves them [s]."""
    when, least, _ = _least(time, late)
    origin = float(np.mean(when))
    drift, sigma_drift = 0.0, PRIOR_DRIFT
    if len(when) > 2 * _SIDE:
        from scipy.stats import (
            theilslopes,
        )  # only now: it takes longer to load than most logs to read

        slope, _, low, high = np.asarray(
            theilslopes(least, when, 0.6827), dtype=np.float64
        ).tolist()
        rounding = quantum / math.sqrt(len(when)) / float(np.std(when))
        measured = math.hypot((high - low) / 2, rounding)
        if measured < PRIOR_DRIFT:
            drift, sigma_drift = slope, measured
    rest = least - drift * (when - origin)
    offset = float(np.quantile(rest, 0.1)) if len(rest) >= 10 else float(rest.min())
    spread = _NORMAL * float(np.median(np.abs(rest - np.median(rest))))
    sigma = max(_MEDIAN_LOSS * spread / math.sqrt(len(rest)), abs(float(np.median(rest)) - offset))
    return _Line(
        origin=origin, offset=offset, drift=drift, sigma_offset=sigma, sigma_drift=sigma_drift
    )


def _jumps(time: Series, late: Series) -> list[int]:
    """Indices of the first samples after steps of the lower envelope."""
    _, least, starts = _least(time, late)
    jumps: list[int] = []
    pending = [(0, len(least))]
    while pending:
        low, high = pending.pop()
        part = least[low:high]
        if len(part) < 4:
            continue
        side = min(_SIDE, len(part) // 2)
        splits = np.arange(side, len(part) - side + 1)
        steps = np.array(
            [np.median(part[i : i + side]) - np.median(part[i - side : i]) for i in splits]
        )
        noise = _NORMAL * float(np.median(np.abs(np.diff(part))))
        limit = max(LEAST_JUMP, 8 * noise)
        if np.abs(steps).max() <= limit:
            continue
        # Within the blocks beside the largest step, the change between neighbours is greatest at
        # the jump itself.
        centre = int(splits[int(np.argmax(np.abs(steps)))])
        around = np.arange(max(1, centre - side), min(len(part), centre + side))
        split = int(around[int(np.argmax(np.abs(np.diff(part))[around - 1]))])
        before = float(np.median(part[max(0, split - side) : split]))
        after = float(np.median(part[split : split + side]))
        if abs(after - before) <= limit:
            continue
        jumps.append(_first_after(late, starts, low + split, before, after))
        pending += [(low, low + split), (low + split, high)]
    return sorted(set(jumps))


def _first_after(late: Series, starts: IntArray, block: int, before: float, after: float) -> int:
    """Finds the first sample after a step that lies in block `block` or the one before it."""
    low = int(starts[block - 1])
    high = int(starts[block + 1]) if block + 1 < len(starts) else len(late)
    below = late[low:high] < (before + after) / 2
    if after < before:
        return low + max(1, int(np.argmax(below)))
    return low + min(len(below) - 1, len(below) - int(np.argmax(below[::-1])))


def _findings(model: ClockModel, delay: float, worst: float) -> tuple[Finding, ...]:
    first = model.segments[0]
    half = NINETY * first.sigma_offset
    findings = [
        Finding.of(
            "clocks-paired",
            f"{model.device} clock {first.offset:+.4f} s [{first.offset - half:.4f}, "
            f"{first.offset + half:.4f}]"
            f" 90 % to {model.reference}, drift {1e6 * first.drift:+.1f} ± "
            f"{1e6 * first.sigma_drift:.1f} ppm;"
            f" delays {1e3 * delay:.1f} ms (median), {1e3 * worst:.0f} ms (longest)",
            value=first.offset,
        )
    ]
    for before, after in itertools.pairwise(model.segments):
        elapsed = (after.start - before.origin) / NANOSECONDS
        step = after.offset + after.drift * (after.start - after.origin) / NANOSECONDS
        step -= before.offset + before.drift * elapsed
        findings.append(
            Finding.of(
                "clock-jump",
                f"the {model.device} and {model.reference} clocks step apart by {step:+.3f} s",
                where=iso(after.start),
                value=step,
            )
        )
    return tuple(findings)


def host_clock(series: WindSeries) -> PairedClocks | None:
    """Puts a logged device's clock on the computer's; `None` where the log has one kind of stamp
    only, or one sample.

    Raises:
        InputError: see `pair_clocks`.
    """
    if series.host_time is None or len(series) < 2:
        return None
    return pair_clocks(series.time, series.host_time, device=series.sensor.name, reference="host")
