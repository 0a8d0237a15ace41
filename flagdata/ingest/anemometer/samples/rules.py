"""What is wrong with the samples of an anemometer: found, counted and flagged, never smoothed over.

`RULES` is the table of them. Each takes rows in strictly increasing time, marks the samples that it
concerns with a flag and adds one finding a channel or kind of wind.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.findings import Finding, Severity
from flagdata.core.schema import CHANNELS, UNUSABLE, SampleFlag
from flagdata.errors import InputError
from flagdata.ingest.anemometer.log_reading import WIND_CHANNELS, Reading, streams
from flagdata.ingest.anemometer.samples.zero import resolution
from flagdata.timebase import NANOSECONDS, iso

SPEEDS = ("wind_speed", "apparent_wind_speed", "theoretical_wind_speed", "wind_speed_estimate")
"""Channels that cannot be negative."""
_FASTEST = 150.0
"""Largest speed, or component, of air near the ground [m/s]. Lowered, it cuts real gusts; raised,
codes for no value pass as wind."""
_TURNS = (-math.pi - 1e-6, 2 * math.pi + 1e-6)
"""Directions as instruments write them, signed or not, with room for conversion from degrees [rad];
beyond, the cell is a code or another quantity."""
_POSSIBLE: Mapping[str, tuple[float, float]] = {
    **dict.fromkeys(sorted(WIND_CHANNELS), (-_FASTEST, _FASTEST)),
    "sonic_temperature": (170.0, 370.0),
    "air_temperature": (170.0, 350.0),
    "air_pressure": (30_000.0, 115_000.0),
    "relative_humidity": (-0.05, 1.1),
}
"""Smallest and largest possible value [SI], outside the records of the World Meteorological
Organization (World Weather
and Climate Extremes Archive: gust 113 m/s, air -89.2 to 56.7 °C) and of station pressure on land
(about 31 kPa on the highest summit, 108 kPa at the lowest shore), with room for wind tunnels,
sensors in the sun and humidity sensors that overshoot. A recipe's `range` narrows them."""
_STALE_CHANCE, _STALE_SHORTEST, _STALE_SECONDS = 1e-3, 5, 1.0
"""Probability of flagging one run of repeats in a log without any, see `stale`; rows and seconds
below which a run is
never stale: fast loggers read a smoothed signal several times over. Lowered chances or raised
lengths let short freezes of a sensor pass."""
_COARSE_STEP, _LEAST_OFF = 0.2, 0.1
"""Step between speeds [m/s] from which on an instrument is coarse, and how far its least speed may
be from that."""
_VANE_ROWS, _VANE_SPEEDS = 20, 3
"""Rows and different speeds from which on a direction that stays the same is reported."""
_STUCK_SECONDS, _STUCK_REPEATS = 60.0, 60
"""Wind that reads the same for as long as this [s], so many times, is stale whatever the rest of
the log looks like."""
_SIGNED_SHARE, _SIGNED_KINDS, _SIGNED_LEVEL = 0.05, 3, -0.5
"""Share of the rows, different values, and their median [m/s], from which negative speeds are those
of a component."""
_INTENSITY, _STEADY_ROWS, _STEADY_SPAN, _SLOWEST = 0.02, 20, 600.0, 1.0
"""Turbulence intensity (standard deviation by the mean) that no wind outdoors stays below;
readings, seconds and mean speed [m/s] from which on a speed is judged. A raised intensity reports
calm nights as wind tunnels."""
_OUT = "out-of-range"
_OUT_FIX = (
    "check the recipe's columns and units; a code for no value belongs into its [file] missing"
)


def impossible(reading: Reading) -> Reading:
    """Flags impossible winds OUT_OF_RANGE. Impossible values of other channels are left out (NaN):
    one absurd temperature does not make the wind beside it unusable."""
    for name, (low, high) in _POSSIBLE.items():
        if name not in reading.channels:
            continue
        values, of_wind = reading.channels[name], name in WIND_CHANNELS
        beyond = (values < low) | (values > high)
        bounds = f"{low:g} to {high:g} {CHANNELS[name].unit}"
        message = f"{{n}} impossible values of {name}, outside {bounds}; left out of averages"
        flag = SampleFlag.OUT_OF_RANGE if of_wind else SampleFlag.OK
        flagged = (reading.flags & flag) != 0
        reading = reading.marked(beyond & ~flagged, _OUT, message, flag=flag, fix=_OUT_FIX)
        if not of_wind:
            reading = replace(
                reading, channels={**reading.channels, name: np.where(beyond, np.nan, values)}
            )
    return reading


def direction(
    name: str, angle: FloatArray, line: IntArray, *, offset: float = 0.0
) -> tuple[FloatArray, tuple[Finding, ...]]:
    """Angles with those left out (NaN) that no instrument writes: -180° to 360° is possible.

    Args:
        angle: (n,) as written [rad], not yet wrapped.
        line: (n,) their lines.
        offset: [rad] that a recipe added to turn the vane: the angle is possible with or without
            it.
    """
    (low, high), bare = _TURNS, angle - offset
    beyond = ((angle < low) | (angle > high)) & ((bare < low) | (bare > high))
    if not beyond.any():
        return angle, ()
    message = (
        f"{int(beyond.sum())} impossible values of {name}, outside -180° to 360°; left out of "
        "averages"
    )
    finding = Finding(
        kind=_OUT,
        severity=Severity.WARNING,
        count=int(beyond.sum()),
        where=f"line {line[beyond][0]}",
        what=message,
        fix=_OUT_FIX,
    )
    return np.where(beyond, np.nan, angle), (finding,)


def faults(reading: Reading) -> Reading:
    """Rows in which a channel of the recipe's `fault-where-zero` is 0: SENSOR_FAULT."""
    for name in reading.rules.fault_where_zero:
        if name in reading.channels:
            message = f"{{n}} rows in which {name} is 0"
            reading = reading.marked(
                reading.channels[name] == 0, "sensor-fault", message, flag=SampleFlag.SENSOR_FAULT
            )
    return reading


def negative(reading: Reading) -> Reading:
    """Speeds below zero are impossible: OUT_OF_RANGE; but for the scatter of a calm about a zero
    that was set right.

    Raises:
        InputError: values are below zero as those of a component of the wind are: often, far, by
            different numbers.
    """
    calm = (reading.flags & SampleFlag.DEAD_ZONE) != 0
    for name in SPEEDS:
        speed = reading.channels.get(name, np.zeros(len(calm)))
        below = (speed < 0) & ~calm
        if not below.any():
            continue
        lowest, values = float(np.nanmin(speed)), speed[below]
        often = len(values) >= _SIGNED_SHARE * np.isfinite(speed[~calm]).sum()
        if (
            often
            and len(np.unique(values)) >= _SIGNED_KINDS
            and float(np.median(values)) < _SIGNED_LEVEL
        ):
            share = 100 * len(values) / int(np.isfinite(speed).sum())
            raise InputError(
                f"{name} is negative in {share:.0f} % of its rows, down to {lowest:.3g} m/s: this "
                "looks like one "
                "component of the wind, not its speed",
                where=f"line {reading.line[below][0]}",
                fix="name both components and their columns in --columns, as wind_x[m/s] and "
                "wind_y[m/s]; if they "
                "point east and north, add --azimuth 270",
            )
        message = f"{{n}} negative values of {name}, down to {lowest:.3g} m/s; left out of averages"
        reading = reading.marked(
            below,
            "negative-speed",
            message,
            flag=SampleFlag.OUT_OF_RANGE,
            value=lowest,
            fix="if calm air reads below zero, give --zero-offset",
        )
    return reading


def dead_zone(reading: Reading) -> Reading:
    """Speeds below the sensor's declared threshold, or exactly 0 where none is declared: DEAD_ZONE.

    Calms about a zero offset that was subtracted are flagged and reported by `zero` already.
    """
    speed = reading.channels.get("wind_speed")
    if speed is None:
        return reading
    threshold = reading.sensor.threshold
    below = (speed >= 0) & (speed < threshold) if threshold else speed == 0
    below &= (reading.flags & SampleFlag.DEAD_ZONE) == 0
    text = (
        f"below the sensor's threshold, {threshold:g} m/s"
        if threshold
        else "exactly 0: calm, or below a threshold"
    )
    return reading.marked(
        below,
        "dead-zone",
        f"{{n}} of {len(speed)} speeds are {text}",
        flag=SampleFlag.DEAD_ZONE,
        severity=Severity.NOTE,
        value=threshold,
    )


def idle(reading: Reading) -> Reading:
    """Speeds that stay at exactly 0, as of a sensor that is not connected or blocked.

    On a platform that may move no calm reads 0 for `_STUCK_REPEATS` rows over `_STUCK_SECONDS`:
    such runs of apparent or theoretical wind are STALE. On a mast a calm may last; a log that never
    reads anything else is reported.
    """
    for name in SPEEDS:
        values = reading.channels.get(name, np.zeros(0))
        rows = np.flatnonzero(np.isfinite(values))
        starts, lengths = _runs(values[rows] == 0)
        span = (reading.time[rows[starts + lengths - 1]] - reading.time[rows[starts]]) / NANOSECONDS
        long = (lengths >= _STUCK_REPEATS) & (span >= _STUCK_SECONDS)
        on_mast, always = name == "wind_speed", int(lengths[long].sum()) == len(rows)
        if not long.any() or (on_mast and not always):
            continue
        zero = np.zeros(len(values), dtype=bool)
        zero[rows[_within(starts[long], lengths[long])]] = True
        longest = float(span[long].max())
        message = (
            f"{name} reads exactly 0 in {'all ' if always else ''}{{n}} rows, for {longest:.0f} s "
            "on end: "
        )
        message += (
            "a calm all along, or a sensor that is not connected or blocked"
            if on_mast
            else "past a platform that may move no air stands so still; the sensor is not "
            "connected or blocked; left "
            "out of averages"
        )
        reading = reading.marked(
            zero,
            "stays-at-zero",
            message,
            flag=SampleFlag.OK if on_mast else SampleFlag.STALE,
            value=longest,
            fix="check the sensor, its cable and the column",
        )
    return reading


def one_direction(reading: Reading) -> Reading:
    """Directions that are the same in every row of a wind that varies, and speeds and directions
    that are all 0."""
    none = np.full(len(reading.time), np.nan)
    speed, towards = (reading.channels.get(name, none) for name in ("wind_speed", "wind_direction"))
    finite = np.isfinite(speed) & np.isfinite(towards)
    if int(finite.sum()) < _VANE_ROWS or len(np.unique(towards[finite])) > 1:
        return reading
    at = float(np.degrees(towards[finite][0]))
    message = f"wind_direction is {at:g}° in all {{n}} rows"
    if not speed[finite].any():
        message += " and wind_speed is 0: calm air all along, or columns that were never filled"
    elif len(np.unique(speed[finite])) >= _VANE_SPEEDS:
        message += ", while the speed varies: a vane that is stuck, not connected or not set up"
    else:
        return reading
    return reading.marked(
        finite, "direction-stays", message, value=at, fix="check the vane, its cable and the column"
    )


def stale(reading: Reading) -> Reading:
    """Runs in which every wind reading repeats exactly, longer than chance and resolution explain:
    STALE.

    Were repeats independent with probability p, n rows would hold a run of L or more repeats with
    probability at most n p^L (Feller, An Introduction to Probability Theory I, XIII.7). A run is
    stale from the L on at which that is `_STALE_CHANCE`, if it lasts `_STALE_SECONDS`. p is the
    share of repeats in the log, taken again without the runs found (three passes), and never below
    5 %. It must be so with the p of the rows around the run too, since a night's light wind repeats
    more than a day's. A sensor that is stuck most of the time shows in neither: a run of
    `_STUCK_REPEATS` over `_STUCK_SECONDS` is stale in any case. Readings of a calm (0, or dead
    zone) are no repeats. A recipe's `stale_after` replaces the rules.
    """
    names = [n for n in (*SPEEDS, "wind_x", "wind_y", "wind_z") if n in reading.channels]
    names += [n for n in ("wind_direction", "apparent_wind_direction") if n in reading.channels]
    # Streams interleave kinds of wind: rows that hold the same channels are compared with each
    # other.
    channels_present = np.zeros(len(reading.time), dtype=np.int64)
    for bit, name in enumerate(names):
        channels_present |= np.isfinite(reading.channels[name]).astype(np.int64) << bit
    moves = (reading.flags & (SampleFlag.DEAD_ZONE | SampleFlag.OUT_OF_RANGE)) != 0
    for kind in np.unique(channels_present[channels_present > 0]).tolist():
        rows = np.flatnonzero(channels_present == kind)
        present = [name for bit, name in enumerate(names) if kind >> bit & 1]
        if WIND_CHANNELS.isdisjoint(present) or len(rows) < _STALE_SHORTEST:
            continue  # a direction without a speed is no reading of the wind
        values = {name: reading.channels[name][rows] for name in present}
        same = (
            np.logical_and.reduce(
                [channel_values[1:] == channel_values[:-1] for channel_values in values.values()]
            )
            & ~moves[rows[1:]]
        )
        same &= ~_least(values.get("wind_speed", np.zeros(len(rows))))[1:]
        starts, lengths = _runs(same)
        span = (reading.time[rows[starts + lengths]] - reading.time[rows[starts]]) / NANOSECONDS
        long, text, fix = _longer(same, starts, lengths, span, reading.rules.stale_after)
        repeats = np.zeros(len(reading.time), dtype=bool)
        repeats[rows[_within(starts[long] + 1, lengths[long])]] = True
        number, seconds = (
            int(long.sum()),
            float(span[np.argmax(np.where(long, lengths, 0))]) if len(span) else 0.0,
        )
        message = (
            f"{{n}} rows in {number} {'run' if number == 1 else 'runs'} repeat the "
            f"{' and '.join(present)} before "
        )
        message += f"them {text}; the longest run lasts {seconds:.2f} s; left out of averages"
        reading = reading.marked(
            repeats, "stale-repeats", message, flag=SampleFlag.STALE, value=seconds, fix=fix
        )
    return reading


def _longer(
    same: BoolArray,
    starts: IntArray,
    lengths: IntArray,
    span: FloatArray,
    allowed: float | None,
) -> tuple[BoolArray, str, str | None]:
    """Decides which runs of repeats are too long, in words, and what to do where the air was that
    steady."""
    if allowed is not None:
        return span > allowed, f"for longer than the {allowed:g} s its recipe allows", None
    n = len(same) + 1
    limit = n
    for _ in range(3):
        within = lengths < limit
        rest = n - 1 - float(lengths[~within].sum())
        limit = int(_limit(n, np.array([float(lengths[within].sum()) / max(rest, 1.0)]))[0])
    # The share of repeats around a run, itself left out: five times its length to each side, at
    # least 200 rows.
    total, reach = np.concatenate(([0], np.cumsum(same))), np.maximum(200, 5 * lengths)
    low, high = np.maximum(0, starts - reach), np.minimum(n - 1, starts + lengths + reach)
    rest = high - low - lengths
    around = np.where(rest > 0, (total[high] - total[low] - lengths) / np.maximum(rest, 1), 0.0)
    long = (lengths >= limit) & (span >= _STALE_SECONDS) & (lengths >= _limit(n, around))
    stuck = (lengths >= _STUCK_REPEATS) & (span >= _STUCK_SECONDS)
    fewest = min(limit, _STUCK_REPEATS) if stuck.any() else limit
    fix = (
        "if the air was that steady, say how long a reading may stand: stale-after in a recipe's "
        "[quality]"
    )
    return long | stuck, f"{fewest} times or more, which chance and resolution do not explain", fix


def _limit(n: int, share: FloatArray) -> IntArray:
    """Repeats in a row that chance does not explain among n rows of which `share` repeat the one
    before them."""
    clipped = np.clip(share, 0.05, 0.999)
    return np.maximum(
        _STALE_SHORTEST, np.ceil(math.log(n / _STALE_CHANCE) / -np.log(clipped))
    ).astype(np.int64)


def _least(speed: FloatArray) -> BoolArray:
    """Finds (n,) rows whose speed is the least that a coarse instrument shows above calm: it stays
    there as calm air does."""
    above = speed[np.isfinite(speed) & (speed > 0)]
    step, least = resolution(above), float(above.min(initial=np.inf))
    return (speed == least) & (step >= _COARSE_STEP) & (abs(least - step) <= _LEAST_OFF * step)


def _runs(same: BoolArray) -> tuple[IntArray, IntArray]:
    """Finds the first row and the number of repeats of each run of repeats."""
    edges = np.diff(same.astype(np.int8), prepend=np.int8(0), append=np.int8(0))
    starts = np.flatnonzero(edges == 1)
    return starts, np.flatnonzero(edges == -1) - starts


def _within(starts: IntArray, lengths: IntArray) -> IntArray:
    """Lists all rows of runs."""
    return np.repeat(starts - np.cumsum(lengths) + lengths, lengths) + np.arange(int(lengths.sum()))


def at_nyquist(reading: Reading) -> Reading:
    """Frequencies found in frames taken once a row that lie within one step of half the frame rate:
    ALIASED.

    A sampled oscillation of frequency f is the same as one of |k·rate - f| for every whole k
    (Shannon 1949); close to rate/2 the two lowest candidates cannot be distinguished within the
    resolution of the estimate: two of its steps, or 5 % of rate/2. The step is the median spacing
    of the frequencies above a quarter of the rate; the rate is the mean one.
    """
    for name in reading.rules.frame_rate_of:
        values = reading.channels.get(name, np.zeros(0))
        if len(values) < 10:
            continue
        rate = NANOSECONDS / float(np.mean(np.diff(reading.time)))
        limit = rate / 2
        high = np.unique(np.round(values[values > rate / 4], 6))
        step = float(np.median(np.diff(high))) if len(high) > 2 else 1.0
        at_limit = values >= limit - max(2 * step, 0.05 * limit)
        typical = float(np.median(values[at_limit])) if at_limit.any() else 0.0
        message = (
            f"{{n}} values of {name}, median {typical:.2f} Hz in steps of {step:.2f} Hz, lie at "
            "the Nyquist limit "
            f"{limit:.2f} Hz of {rate:.1f} frames a second: the true frequency may as well be "
            f"{rate - typical:.1f} or "
            f"{rate + typical:.1f} Hz"
        )
        fix = f"only a camera faster than {4 * limit:.0f} frames a second can show it"
        reading = reading.marked(
            at_limit, "at-nyquist", message, flag=SampleFlag.ALIASED, value=typical, fix=fix
        )
    return reading


def gaps(reading: Reading) -> Reading:
    """Stretches without rows, of each kind of wind by itself: longer than the jitter of the stamps
    explains.

    A gap is an interval beyond 1.5 times the median m, and beyond m + 3 (q - m) with the 99th
    percentile q, but in any case one beyond 3 m. A row without a value was not lost, though nobody
    knows of which kind it is.
    """
    kinds = streams(reading.channels)
    blank = np.ones(len(reading.time), dtype=bool)
    for _, rows in kinds:
        blank[rows] = False
    for names, rows_of_kind in kinds:
        if len(rows_of_kind) < 4:
            continue
        rows = np.union1d(rows_of_kind, np.flatnonzero(blank)) if len(kinds) > 1 else rows_of_kind
        of = (
            f" of {next(name for name in names if name in WIND_CHANNELS)}" if len(kinds) > 1 else ""
        )
        between, steps = np.diff(reading.time[rows_of_kind]), np.diff(reading.time[rows])
        usual = float(np.median(between))
        jitter = 3 * (float(np.quantile(between, 0.99)) - usual)
        wide = np.flatnonzero(steps > max(1.5 * usual, min(usual + jitter, 3 * usual)))
        if len(wide) == 0:
            continue
        longest = int(wide[np.argmax(steps[wide])])
        lost, seconds = (
            float((steps[wide] - usual).sum()) / NANOSECONDS,
            float(steps[longest]) / NANOSECONDS,
        )
        finding = Finding.of(
            "gaps",
            f"{len(wide)} {'interval' if len(wide) == 1 else 'intervals'}{of} longer than the "
            "usual "
            f"{usual / NANOSECONDS:.4g} s, {lost:.3f} s lost in all; the longest interval, "
            f"{seconds:.3f} s, ends at "
            "the line named",
            count=len(wide),
            value=seconds,
            where=f"line {reading.line[rows[longest + 1]]}",
        )
        reading = reading.with_findings((finding,))
    return reading


def steady(reading: Reading) -> Reading:
    """Speeds that vary less than any wind outdoors: of a wind tunnel, or of another quantity under
    a wind's name.

    The turbulence intensity is some hundredths over a calm sea and a tenth or more over land; means
    of ten minutes and more vary by as much with the weather. A wind tunnel's is below one
    hundredth, and so is that of a pressure, a temperature in K or a humidity of some hours.
    """
    speed = reading.channels.get("wind_speed", np.full(len(reading.time), np.nan))
    usable = np.isfinite(speed) & ((reading.flags & UNUSABLE) == 0)
    values, time = speed[usable], reading.time[usable]
    if (
        len(values) < _STEADY_ROWS
        or float(np.ptp(time)) < _STEADY_SPAN * NANOSECONDS
        or values.mean() < _SLOWEST
    ):
        return reading
    intensity = float(values.std() / values.mean())
    if intensity >= _INTENSITY:
        return reading
    message = (
        f"the speed varies by {100 * intensity:.2g} % about its mean of {values.mean():.3g} m/s: "
        "as steady as in a "
        "wind tunnel, and steadier than wind outdoors; if it was outdoors, the column is likely "
        "another quantity"
    )
    finding = Finding.of("steady-wind", message, value=intensity)
    return reading.with_findings((finding,))


def future(reading: Reading, *, now: int) -> Reading:
    """Rows that are stamped more than a day after `now` [UTC ns]; a clock that is a little fast is
    not reported."""
    message = (
        f"{{n}} rows are stamped after today, the last {iso(int(reading.time.max()))}: a wrong "
        "clock or date"
    )
    fix = (
        "check the logger's clock and the order of day, month and year; years of two digits are "
        "taken as 1970 to 2069"
    )
    return reading.marked(
        reading.time > now + 86_400 * NANOSECONDS, "stamps-in-future", message, fix=fix
    )


RULES: tuple[Callable[[Reading], Reading], ...] = (
    faults,
    negative,
    dead_zone,
    idle,
    one_direction,
    stale,
    at_nyquist,
    gaps,
    steady,
)
"""In order: what an earlier rule flags, a later one leaves alone."""
