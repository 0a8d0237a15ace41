"""What is wrong with the samples of an anemometer: found, counted and flagged, never smoothed over.

Works on rows in strictly increasing time. Each check names the samples it concerns by a flag and reports a number.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.reading import WIND_CHANNELS, Reading, streams
from flagdata.ingest.anemometer.samples.zero import resolution
from flagdata.schema import SampleFlag
from flagdata.timebase import NANOSECONDS

SPEEDS = ("wind_speed", "apparent_wind_speed", "theoretical_wind_speed", "wind_speed_estimate")
"""Channels that cannot be negative."""
STALE_CHANCE = 1e-3
"""Probability of flagging one run of repeats in a log without any, see `stale`."""
STALE_SHORTEST = 5
"""Rows; a shorter run of repeats is never called stale."""
STALE_SECONDS = 1.0
"""A shorter run is never called stale either: fast loggers read a smoothed signal several times over."""
COARSE_STEP, LEAST_OFF = 0.2, 0.1
"""Step between speeds [m/s] from which on an instrument is coarse, and how far its least speed may be from that."""
VANE_ROWS, VANE_SPEEDS = 20, 3
"""Rows and different speeds from which on a direction that stays the same is reported."""
STUCK_SECONDS = 60.0
STUCK_REPEATS = 60
"""Wind that reads the same for as long as this [s], so many times, is stale whatever the rest of the log looks like."""

_SIGNED_SHARE, _SIGNED_KINDS, _SIGNED_LEVEL = 0.05, 3, -0.5
"""Share of the rows, different values, and their median [m/s], from which negative speeds are those of a component."""


def gaps(reading: Reading) -> tuple[Finding, ...]:
    """Stretches without rows, of each kind of wind by itself: longer than the jitter of the stamps explains.

    A gap is an interval beyond 1.5 times the median m, and beyond m + 3 (q - m) with the 99th percentile q, but in any
    case one beyond 3 m.
    """
    kinds = streams(reading.channels)
    if len(kinds) == 1:
        return _gaps_of(reading, np.arange(len(reading.time)), "")
    # A row without a value was not lost, though nobody knows of which kind it is.
    blank = np.ones(len(reading.time), dtype=bool)
    for _, rows in kinds:
        blank[rows] = False
    found: list[Finding] = []
    for names, rows in kinds:
        kept = np.union1d(rows, np.flatnonzero(blank))
        of = next(name for name in names if name in WIND_CHANNELS)
        found.extend(_gaps_of(reading.take(kept), np.flatnonzero(~blank[kept]), f" of {of}"))
    return tuple(found)


def _gaps_of(reading: Reading, own: NDArray[np.int64], of: str) -> tuple[Finding, ...]:
    """Gaps between rows; what is usual is taken from the rows `own`, and `of` says of which kind they are."""
    if len(own) < 4:
        return ()
    between = np.diff(reading.time[own])
    usual = float(np.median(between))
    jitter = 3 * (float(np.quantile(between, 0.99)) - usual)
    steps = np.diff(reading.time)
    wide = np.flatnonzero(steps > max(1.5 * usual, min(usual + jitter, 3 * usual)))
    if len(wide) == 0:
        return ()
    longest = int(wide[np.argmax(steps[wide])])
    lost = float((steps[wide] - usual).sum()) / NANOSECONDS
    seconds = float(steps[longest]) / NANOSECONDS
    return (
        Finding(
            kind="gaps", severity=Severity.WARNING, count=len(wide), value=seconds,
            where=f"line {reading.line[longest + 1]}",
            what=f"{len(wide)} {'interval' if len(wide) == 1 else 'intervals'}{of} longer than the usual "
            f"{usual / NANOSECONDS:.4g} s, {lost:.3f} s lost in all; the longest interval, {seconds:.3f} s, ends at "
            "the line named",
        ),
    )  # fmt: skip


def faults(reading: Reading) -> tuple[NDArray[np.uint16], tuple[Finding, ...]]:
    """Rows in which a channel of the recipe's `fault-where-zero` is 0: SENSOR_FAULT."""
    flags = np.zeros(len(reading.time), dtype=np.uint16)
    found: list[Finding] = []
    for name in reading.rules.fault_where_zero:
        blind = reading.channels[name] == 0 if name in reading.channels else np.zeros(len(reading.time), dtype=bool)
        if blind.any():
            flags[blind] = SampleFlag.SENSOR_FAULT
            found.append(
                Finding(
                    kind="sensor-fault", severity=Severity.WARNING, count=int(blind.sum()),
                    where=f"line {reading.line[blind][0]}", what=f"{int(blind.sum())} rows in which {name} is 0",
                )
            )  # fmt: skip
    return flags, tuple(found)


def negative(reading: Reading) -> tuple[NDArray[np.uint16], tuple[Finding, ...]]:
    """Speeds below zero are impossible: OUT_OF_RANGE; but for the scatter of a calm about a zero that was set right.

    Raises:
        InputError: so many are so far below zero that it is no speed, but a component of the wind.
    """
    flags = np.zeros(len(reading.time), dtype=np.uint16)
    calm = (reading.flags & SampleFlag.DEAD_ZONE) != 0
    found: list[Finding] = []
    for name in SPEEDS:
        if name not in reading.channels:
            continue
        below = (reading.channels[name] < 0) & ~calm
        if below.any():
            count = int(below.sum())
            flags[below] |= SampleFlag.OUT_OF_RANGE
            lowest = float(np.nanmin(reading.channels[name]))
            if _signed(reading.channels[name][~calm]):
                share = 100 * count / int(np.isfinite(reading.channels[name]).sum())
                raise InputError(
                    f"{name} is below zero in {share:.0f} % of its rows, down to {lowest:.3g} m/s, as a component of "
                    "the wind is and no speed",
                    where=f"line {reading.line[below][0]}",
                    fix="name both components, each with its column, as wind_x[m/s] and wind_y[m/s] in --columns, and "
                    "add --azimuth 270 where they are towards east and north",
                )
            found.append(
                Finding(
                    kind="negative-speed", severity=Severity.WARNING, count=count, value=lowest,
                    where=f"line {reading.line[below][0]}",
                    what=f"{count} negative values of {name}, down to {lowest:.3g} m/s; left out of averages",
                    fix="if calm air reads below zero, give --zero-offset",
                )
            )  # fmt: skip
    return flags, tuple(found)


def _signed(speed: NDArray[np.float64]) -> bool:
    """Whether values are below zero as those of a component are: often, far, and by different numbers."""
    below = speed[speed < 0]
    often = len(below) >= _SIGNED_SHARE * np.isfinite(speed).sum()
    return often and len(np.unique(below)) >= _SIGNED_KINDS and float(np.median(below)) < _SIGNED_LEVEL


def dead_zone(reading: Reading) -> tuple[NDArray[np.uint16], tuple[Finding, ...]]:
    """Speeds below the sensor's declared threshold, or exactly 0 where none is declared: DEAD_ZONE.

    Calms about a zero offset that was subtracted are flagged and reported by `zero` already.
    """
    flags = np.zeros(len(reading.time), dtype=np.uint16)
    speed = reading.channels.get("wind_speed")
    if speed is None:
        return flags, ()
    threshold = reading.sensor.threshold
    below = (speed >= 0) & (speed < threshold) if threshold else speed == 0
    below &= (reading.flags & SampleFlag.DEAD_ZONE) == 0
    if not below.any():
        return flags, ()
    flags[below] = SampleFlag.DEAD_ZONE
    text = (
        f"below the sensor's threshold, {threshold:g} m/s" if threshold else "exactly 0: calm, or below the threshold"
    )
    return flags, (
        Finding(
            kind="dead-zone", severity=Severity.NOTE, count=int(below.sum()), where=f"line {reading.line[below][0]}",
            value=threshold, what=f"{int(below.sum())} of {len(speed)} speeds are {text}",
        ),
    )  # fmt: skip


def idle(reading: Reading) -> tuple[NDArray[np.uint16], tuple[Finding, ...]]:
    """Speeds that stay at exactly 0, as of a sensor that is not connected or blocked.

    On a platform that may move no calm reads 0 for `STUCK_REPEATS` rows over `STUCK_SECONDS`: such runs of apparent or
    theoretical wind are STALE. On a mast a calm may last; a log that never reads anything else is reported.
    """
    flags = np.zeros(len(reading.time), dtype=np.uint16)
    found: list[Finding] = []
    for name in SPEEDS:
        values = reading.channels.get(name)
        if values is None:
            continue
        rows = np.flatnonzero(np.isfinite(values))
        starts, lengths = _runs(values[rows] == 0)
        if len(starts) == 0:
            continue
        span = (reading.time[rows[starts + lengths - 1]] - reading.time[rows[starts]]) / NANOSECONDS
        long = (lengths >= STUCK_REPEATS) & (span >= STUCK_SECONDS)
        always = bool(long.any()) and int(lengths[long].sum()) == len(rows)
        if not long.any() or (name == "wind_speed" and not always):
            continue
        zero = np.concatenate([rows[s : s + k] for s, k in zip(starts[long], lengths[long], strict=True)])
        longest = float(span[long].max())
        what = f"{name} reads exactly 0 in {'all ' if always else ''}{len(zero)} rows, for {longest:.0f} s on end: "
        if name == "wind_speed":
            what += "a calm all along, or a sensor that is not connected or blocked"
        else:
            flags[zero] |= SampleFlag.STALE
            what += (
                "past a platform that may move no air stands so still; the sensor is not connected or blocked; left "
            )
            what += "out of averages"
        found.append(
            Finding(
                kind="stays-at-zero", severity=Severity.WARNING, count=len(zero), value=longest,
                where=f"line {reading.line[zero[0]]}", what=what, fix="check the sensor, its cable and the column",
            )
        )  # fmt: skip
    return flags, tuple(found)


def one_direction(reading: Reading) -> tuple[NDArray[np.uint16], tuple[Finding, ...]]:
    """Directions that are the same in every row of a wind that varies, and speeds and directions that are all 0."""
    flags = np.zeros(len(reading.time), dtype=np.uint16)
    speed, towards = reading.channels.get("wind_speed"), reading.channels.get("wind_direction")
    if speed is None or towards is None:
        return flags, ()
    known = np.isfinite(speed) & np.isfinite(towards)
    if int(known.sum()) < VANE_ROWS or len(np.unique(towards[known])) > 1:
        return flags, ()
    at = float(np.degrees(towards[known][0]))
    what = f"wind_direction is {at:g}° in all {int(known.sum())} rows"
    if not speed[known].any():
        what += " and wind_speed is 0: calm air all along, or columns that were never filled"
    elif len(np.unique(speed[known])) >= VANE_SPEEDS:
        what += ", while the speed varies: a vane that is stuck, not connected or not set up"
    else:
        return flags, ()
    found = Finding(
        kind="direction-stays", severity=Severity.WARNING, count=int(known.sum()), value=at, what=what,
        where=f"line {reading.line[known][0]}", fix="check the vane, its cable and the column",
    )  # fmt: skip
    return flags, (found,)


def stale(reading: Reading) -> tuple[NDArray[np.uint16], tuple[Finding, ...]]:
    """Runs in which every wind reading repeats exactly, longer than chance and resolution explain: STALE.

    Were repeats independent with probability p, n rows would hold a run of L or more repeats with probability at most
    n p^L (Feller, An Introduction to Probability Theory I, XIII.7). A run is stale from the L on at which that is
    `STALE_CHANCE`, if it lasts `STALE_SECONDS`. p is the share of repeats in the log, taken again without the runs
    found (three passes), and never below 5 %. It must be so with the p of the rows around the run too, since a night's
    light wind repeats more than a day's. A sensor that is stuck most of the time shows in neither: a run of
    `STUCK_REPEATS` over `STUCK_SECONDS` is stale in any case. Readings of a calm (0, or dead zone) are no repeats. A
    recipe's `stale_after` replaces the rules.
    """
    names = [n for n in (*SPEEDS, "wind_x", "wind_y", "wind_z") if n in reading.channels]
    names += [n for n in ("wind_direction", "apparent_wind_direction") if n in reading.channels]
    flags = np.zeros(len(reading.time), dtype=np.uint16)
    found: list[Finding] = []
    # Streams interleave kinds of wind: rows that hold the same channels are compared with each other.
    held = np.zeros(len(reading.time), dtype=np.int64)
    for bit, name in enumerate(names):
        held |= np.isfinite(reading.channels[name]).astype(np.int64) << bit
    for kind in np.unique(held[held > 0]).tolist():
        rows = np.flatnonzero(held == kind)
        present = [name for bit, name in enumerate(names) if kind >> bit & 1]
        if WIND_CHANNELS.isdisjoint(present):
            continue  # a direction without a speed is no reading of the wind
        looked_at = replace(reading, channels={name: reading.channels[name] for name in present}, host_time=None)
        repeats, finding = _stale_rows(looked_at.take(rows), present)
        flags[rows[repeats]] = SampleFlag.STALE
        found.extend(finding)
    return flags, tuple(found)


def _least(reading: Reading) -> NDArray[np.bool_]:
    """(n,) rows whose speed is the least that a coarse instrument shows above calm: it stays there as calm air does."""
    speed = reading.channels.get("wind_speed", np.zeros(len(reading.time)))
    above = speed[np.isfinite(speed) & (speed > 0)]
    step, least = resolution(above), float(above.min(initial=np.inf))
    if step < COARSE_STEP or abs(least - step) > LEAST_OFF * step:
        return np.zeros(len(speed), dtype=bool)
    return speed == least


def _stale_rows(reading: Reading, names: list[str]) -> tuple[NDArray[np.int64], tuple[Finding, ...]]:
    """Indices of stale rows among rows that hold all of `names`."""
    n = len(reading.time)
    nothing = np.zeros(0, dtype=np.int64)
    if n < STALE_SHORTEST:
        return nothing, ()
    same = np.ones(n - 1, dtype=bool)
    for name in names:
        values = reading.channels[name]
        same &= values[1:] == values[:-1]
    same &= (reading.flags[1:] & (SampleFlag.DEAD_ZONE | SampleFlag.OUT_OF_RANGE)) == 0
    same &= ~_least(reading)[1:]
    starts, lengths = _runs(same)
    if len(starts) == 0:
        return nothing, ()
    span = (reading.time[starts + lengths] - reading.time[starts]) / NANOSECONDS
    if reading.rules.stale_after is not None:
        long = span > reading.rules.stale_after
        text = f"for longer than the {reading.rules.stale_after:g} s its recipe allows"
        fix = None
    else:
        limit = _longest_by_chance(n, lengths)
        long = (lengths >= limit) & (span >= STALE_SECONDS)
        total = np.concatenate(([0], np.cumsum(same)))
        for index in np.flatnonzero(long):
            long[index] = lengths[index] >= _limit(n, _share_around(total, int(starts[index]), int(lengths[index])))
        stuck = (lengths >= STUCK_REPEATS) & (span >= STUCK_SECONDS)
        long |= stuck
        fewest = min(limit, STUCK_REPEATS) if stuck.any() else limit
        text = f"{fewest} times or more, which chance and resolution do not explain"
        fix = "if the air was that steady, say how long a reading may stand: stale-after in a recipe's [quality]"
    if not long.any():
        return nothing, ()
    stale_rows = np.concatenate([np.arange(s + 1, s + k + 1) for s, k in zip(starts[long], lengths[long], strict=True)])
    worst = int(np.argmax(np.where(long, lengths, 0)))
    seconds = float(reading.time[starts[worst] + lengths[worst]] - reading.time[starts[worst]]) / NANOSECONDS
    count, number = len(stale_rows), int(long.sum())
    return stale_rows, (
        Finding(
            kind="stale-repeats", severity=Severity.WARNING, count=count, value=seconds,
            where=f"line {reading.line[starts[long][0] + 1]}",
            what=f"{count} rows in {number} {'run' if number == 1 else 'runs'} repeat the {' and '.join(names)} before "
            f"them {text}; the longest run lasts {seconds:.2f} s; left out of averages",
            fix=fix,
        ),
    )  # fmt: skip


def _runs(same: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First row and number of repeats of each run of repeats."""
    edges = np.diff(same.astype(np.int8), prepend=np.int8(0), append=np.int8(0))
    starts = np.flatnonzero(edges == 1)
    return starts, np.flatnonzero(edges == -1) - starts


def _longest_by_chance(n: int, lengths: NDArray[np.int64]) -> int:
    limit = n
    for _ in range(3):
        within = lengths < limit
        repeats = float(lengths[within].sum())
        rest = n - 1 - float(lengths[~within].sum())
        limit = _limit(n, repeats / max(rest, 1.0))
    return limit


def _limit(n: int, share: float) -> int:
    """Repeats in a row that chance does not explain among n rows of which `share` repeat the one before them."""
    kept = min(max(share, 0.05), 0.999)
    return max(STALE_SHORTEST, math.ceil(math.log(n / STALE_CHANCE) / -math.log(kept)))


def _share_around(total: NDArray[np.int64], start: int, length: int) -> float:
    """Share of repeats around a run, itself left out: five times its length to each side, at least 200 rows.

    `total` is the running count of repeats.
    """
    reach = max(200, 5 * length)
    low, high = max(0, start - reach), min(len(total) - 1, start + length + reach)
    rest = high - low - length
    return float(total[high] - total[low] - length) / rest if rest > 0 else 0.0


def at_nyquist(reading: Reading) -> tuple[NDArray[np.uint16], tuple[Finding, ...]]:
    """Frequencies found in frames taken once a row that lie within one step of half the frame rate: ALIASED.

    A sampled oscillation of frequency f is the same as one of |k·rate - f| for every whole k (Shannon 1949); close to
    rate/2 the two lowest candidates cannot be distinguished within the resolution of the estimate: two of its steps, or
    5 % of rate/2. The step is the median spacing of the frequencies above a quarter of the rate; the rate is the
    mean one.
    """
    flags = np.zeros(len(reading.time), dtype=np.uint16)
    found: list[Finding] = []
    for name in reading.rules.frame_rate_of:
        values = reading.channels.get(name)
        if values is None or len(values) < 10:
            continue
        rate = NANOSECONDS / float(np.mean(np.diff(reading.time)))
        limit = rate / 2
        high = np.unique(np.round(values[values > rate / 4], 6))
        step = float(np.median(np.diff(high))) if len(high) > 2 else 1.0
        near = values >= limit - max(2 * step, 0.05 * limit)
        if not near.any():
            continue
        flags[near] = SampleFlag.ALIASED
        typical = float(np.median(values[near]))
        found.append(
            Finding(
                kind="at-nyquist", severity=Severity.WARNING, count=int(near.sum()), value=typical,
                where=f"line {reading.line[near][0]}",
                what=f"{int(near.sum())} values of {name}, median {typical:.2f} Hz in steps of {step:.2f} Hz, lie at "
                f"the Nyquist limit {limit:.2f} Hz of {rate:.1f} frames a second: the true frequency may as well be "
                f"{rate - typical:.1f} or {rate + typical:.1f} Hz",
                fix=f"only a camera faster than {4 * limit:.0f} frames a second can show it",
            )
        )  # fmt: skip
    return flags, tuple(found)
