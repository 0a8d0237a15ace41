"""Two anemometers' logs of one wind on one clock: offset, drift and gain of a sensor against a
reference.

The offset is found as that between a film and a log is (`lag`), with the faster log in the place of
the motion: first over the hour in which the slower log varies most, then over parts of ten minutes
all along, through which a weighted line gives offset and drift (`drift`). A sensor that follows the
wind late would shift the offset, and, since it is later in light wind, the drift too; where its
distance constant is stated, the other log is passed through the same lag, so that both follow
alike.

The gain is the slope of the sensor's minute means on the reference's, on the common clock, by least
squares about their
means: a minute's noise and resolution vanish beside what the wind varies by from minute to minute,
and what each sensor misses of a gust does too. Its σ holds for residuals that stay alike over
minutes (Newey and West, 1987).

Functions of their arguments: no files, no clocks, no random generator of their own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from flagdata.align.declared import QUARTZ, stamp_sigma
from flagdata.align.drift import FEWEST_PARTS, PART, ClockLine, line_through
from flagdata.align.film_motion import MotionSeries
from flagdata.align.lag import LagEstimate, LagSearch, estimate_offset
from flagdata.align.whitened import long_run_variance
from flagdata.align.windbins import SHORTEST, lead, wind_bins
from flagdata.core.clock_model import ClockModel, Segment
from flagdata.core.schema import UNUSABLE
from flagdata.errors import InputError, RefusedError
from flagdata.record.averaging import average
from flagdata.record.signals import Instants, Series, WindAverage, WindSeries
from flagdata.timebase import NANOSECONDS

WHOLE = 3600.0  # s over which the offset is searched first
MOST_PARTS = 288  # two days whole; of longer logs parts spread evenly
GAIN_PERIOD = 60.0  # s
_REACH = 30.0  # s searched either side of the first offset, at least
_FASTEST = 3e-4  # s/s, beyond which no logger's clock parts from another
_PART_SIGMA = 1.0  # s; a part known worse than this says nothing
_PART_SURROGATES = (
    50  # the first offset is known by then; those of a part keep out what agrees by accident
)
# hours looked at before the logs are taken for unrelated; more take longer and refuse fewer pairs
_TRIES = 3

Progress = Callable[[int], object]


@dataclass(frozen=True, kw_only=True)
class Gain:
    """The sensor's speed as `zero` + `gain` × the reference's.

    Attributes:
        gain, sigma: slope and its standard uncertainty.
        zero, sigma_zero: what the sensor reads in still air by that line [m/s].
        count: minutes compared.
    """

    gain: float
    sigma: float
    zero: float
    sigma_zero: float
    count: int


@dataclass(frozen=True, kw_only=True)
class LogClock:
    """The sensor's clock on the reference's, and its gain.

    Attributes:
        model: added to the sensor's stamps.
        line: what it was made from; of the faster log's clock on the slower one's.
        whole: the first hour's estimate.
        gain: of the sensor against the reference.
    """

    model: ClockModel
    line: ClockLine
    whole: LagEstimate
    gain: Gain


def log_clock(
    reference: WindSeries,
    sensor: WindSeries,
    *,
    names: tuple[str, str],
    search: LagSearch,
    generator: np.random.Generator,
    progress: Progress | None = None,
) -> LogClock:
    """Estimates offset, drift and gain of `sensor` against `reference`.

    Args:
        names: of the reference and the sensor, for the model and messages.
        search: around which offset, added to the sensor's stamps, and how far; its response is that
            of a flag and has no part here.
        progress: called with 1 for each part compared.

    Raises:
        InputError: a log without wind speed or with too few samples.
        RefusedError: the logs are not of one wind, or no offset can be estimated, with the reason.
    """
    model, line, overall = clock_between(
        reference, sensor, names=names, search=search, generator=generator, progress=progress
    )
    return LogClock(model=model, line=line, whole=overall, gain=gain_of(reference, sensor, model))


def clock_between(
    reference: WindSeries,
    sensor: WindSeries,
    *,
    names: tuple[str, str],
    search: LagSearch,
    generator: np.random.Generator,
    progress: Progress | None = None,
) -> tuple[ClockModel, ClockLine, LagEstimate]:
    """Estimates offset and drift of `sensor` against `reference`, with the line and the first hour
    that they are from; parameters and refusals as for `log_clock`. The sensor may be anything that
    follows the wind.
    """
    slow_is_sensor = _spacing(sensor) >= _spacing(reference)
    slow, fast = (sensor, reference) if slow_is_sensor else (reference, sensor)
    slow, fast = _with_equal_lag(slow, fast)
    sign = -1.0 if slow_is_sensor else 1.0
    bins = wind_bins(slow, shortest=max(SHORTEST, 2 * _spacing(fast)))
    motion, motion_sigma = _as_motion(fast)
    stamps = math.hypot(bins.sigma, motion_sigma, stamp_sigma(slow.time), stamp_sigma(fast.time))
    search_used = replace(
        search,
        centre=sign * search.centre,
        response=0.0,
        response_sigma=0.0,
        stamp_sigma=math.hypot(search.stamp_sigma, stamps),
    )
    overall = _overall(motion, bins.average, search=search_used, generator=generator, names=names)
    line = _line(
        motion, bins.average, overall, search=search_used, generator=generator, progress=progress
    )
    crooked = [finding.what for finding in line.findings]
    if crooked:
        raise _refused_error(names, crooked)
    return (
        _model(line, sensor, names=names, confidence=overall.confidence, turned=slow_is_sensor),
        line,
        overall,
    )


def gain_of(reference: WindSeries, sensor: WindSeries, model: ClockModel) -> Gain:
    """Compares the sensor's minute means with the reference's, the sensor's stamps taken to the
    reference's clock.

    Raises:
        InputError: fewer than ten minutes that both cover, or a reference that does not vary.
    """
    ours = average(replace(sensor, time=model.to_common(sensor.time)), GAIN_PERIOD)
    theirs = average(reference, GAIN_PERIOD)
    full = (half_full(ours), half_full(theirs))
    _, at, to = np.intersect1d(ours.time[full[0]], theirs.time[full[1]], return_indices=True)
    y, x = ours.speed[full[0]][at], theirs.speed[full[1]][to]
    n = len(x)
    if n < 10 or not np.std(x) > 0:
        raise InputError(
            f"{n} minutes that both logs cover are too few or too even for a gain",
            fix="give longer logs, or logs of a wind that varies",
        )
    away = x - x.mean()
    square = float(away @ away)
    gain = float(away @ y) / square
    rest = y - y.mean() - gain * away
    sigma = math.sqrt(max(long_run_variance(rest * away, n), 0.0) * n) / square
    level = math.sqrt(max(long_run_variance(rest, n), 0.0) / n)
    zero = float(y.mean()) - gain * float(x.mean())
    return Gain(
        gain=gain,
        sigma=sigma,
        zero=zero,
        sigma_zero=math.hypot(level, sigma * float(x.mean())),
        count=n,
    )


def half_full(means: WindAverage) -> np.ndarray:
    """Checks (n,) whether a bin holds half as many samples as the usual one."""
    return means.count >= max(1.0, float(np.median(means.count)) / 2)


def _usable(series: WindSeries) -> tuple[Instants, Series]:
    if "wind_speed" not in series.channels:
        raise InputError(
            f"the log of {series.sensor.name} has no channel wind_speed",
            where=", ".join(sorted(series.channels)),
            fix="give a log of the wind's speed",
        )
    speed = series.channels["wind_speed"]
    good = ((series.flags & UNUSABLE) == 0) & np.isfinite(speed)
    if np.count_nonzero(good) < 2:
        raise InputError(
            f"{np.count_nonzero(good)} usable samples of {series.sensor.name}",
            fix="give another log",
        )
    return series.time[good], speed[good]


def _spacing(series: WindSeries) -> float:
    """Computes the median time between usable samples [s]."""
    time, _ = _usable(series)
    return float(np.median(np.diff(time))) / NANOSECONDS


def _with_equal_lag(slow: WindSeries, fast: WindSeries) -> tuple[WindSeries, WindSeries]:
    """Delays both logs by the slower one's lag, where it is stated and the faster has none, so that
    none is left to allow for; else as they are."""
    lags = [series.sensor.distance_constant for series in (slow, fast)]
    if any(lag is None for lag in lags) or _spacing(fast) > SHORTEST / 2:
        return slow, fast
    if (lags[1] or 0.0) > 0:
        return (
            slow,
            fast,
        )  # a slow log cannot be passed through a lag between its samples: `lead` allows for both
    late = _lag_as_rotor(fast, lags[0]) if lags[0] else fast
    at_once = [
        replace(series, sensor=replace(series.sensor, distance_constant=0.0))
        for series in (slow, late)
    ]
    return at_once[0], at_once[1]


def _lag_as_rotor(series: WindSeries, distance: float) -> WindSeries:
    """Filters a log as a rotor of distance constant `distance` [m] would have given it: dy/dt = (u
    − y) u / ℓ.

    After a gap of ten of its lags the rotor is taken to have followed.
    """
    time, speed = _usable(series)
    step = np.diff(time) / NANOSECONDS
    share = 1 - np.exp(-step * np.abs(speed[1:]) / distance)
    out = np.empty(len(speed))
    level = out[0] = float(speed[0])
    for index, (value, part) in enumerate(
        zip(speed[1:].tolist(), share.tolist(), strict=True), start=1
    ):
        level += part * (value - level)
        out[index] = level
    return WindSeries(
        time=time,
        channels={"wind_speed": out},
        flags=np.zeros(len(time), dtype=np.uint16),
        sensor=series.sensor,
    )


def _as_motion(series: WindSeries) -> tuple[MotionSeries, float]:
    """Returns the faster log at the instants of its air, and the standard uncertainty of those [s].

    Each sample stands twice, a quarter of its spacing before and after: one that falls on the edge
    of a bin then counts by half on either side, where as a whole it would shift the bin by half a
    spacing.
    """
    time, speed = _usable(series)
    early, sigma = lead(series.sensor, _spacing(series), float(np.mean(speed)))
    usual = round(_spacing(series) * NANOSECONDS)
    step = np.minimum(np.diff(time), usual) // 4
    pairs = np.stack(
        [time - np.append(usual // 4, step), time + np.append(step, usual // 4)], axis=1
    )
    speeds = np.repeat(np.maximum(speed, 0.0), 2)
    return MotionSeries(time=pairs.reshape(-1) - round(early * NANOSECONDS), energy=speeds), sigma


def _cut(motion: MotionSeries, low: int, high: int) -> MotionSeries | None:
    first, last = np.searchsorted(motion.time, [low, high]).tolist()
    if last - first < 2:
        return None
    return MotionSeries(time=motion.time[first:last], energy=motion.energy[first:last])


def _between(wind: WindAverage, low: int, high: int) -> WindAverage | None:
    rows = slice(*np.searchsorted(wind.time, [low, high]).tolist())
    if len(wind.time[rows]) < 2:
        return None
    return replace(
        wind,
        time=wind.time[rows],
        speed=wind.speed[rows],
        sigma=wind.sigma[rows],
        direction=wind.direction[rows],
        count=wind.count[rows],
    )


def _part(
    motion: MotionSeries,
    wind: WindAverage,
    low: int,
    high: int,
    *,
    search: LagSearch,
    generator: np.random.Generator,
) -> LagEstimate | None:
    """Estimates the offset of the faster log from `low` to `high` on its own clock [ns]; `None`
    where one of them is silent."""
    chunk = _cut(motion, low, high)
    margin = round(search.window * NANOSECONDS)
    centre = round(search.centre * NANOSECONDS)
    bins = _between(wind, low + centre - margin, high + centre + margin)
    if chunk is None or bins is None:
        return None
    return estimate_offset(chunk, bins, search=search, generator=generator)


def _overall(
    motion: MotionSeries,
    wind: WindAverage,
    *,
    search: LagSearch,
    generator: np.random.Generator,
    names: tuple[str, str],
) -> LagEstimate:
    """Finds the first accepted offset of the hours in which the wind varies most.

    Raises:
        RefusedError: none is, with the reasons of the best one.
    """
    centre = round(search.centre * NANOSECONDS)
    low, high = int(wind.time[0]) - centre, int(wind.time[-1]) - centre
    low, high = max(low, int(motion.time[0])), min(high, int(motion.time[-1]))
    if high <= low:
        raise _refused_error(
            names, ["by their stamps and the centre of the search the logs do not overlap"]
        )
    count = max(1, int((high - low) / NANOSECONDS / WHOLE))
    edges = np.linspace(low, high + 1, count + 1).astype(np.int64)
    spread = []
    for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        wind_in_hour = _between(wind, first + centre, last + centre)
        spread.append(
            0.0
            if wind_in_hour is None
            else float(np.std(wind_in_hour.speed)) * math.sqrt(len(wind_in_hour.time))
        )
    reasons: list[str] = []
    for hour in np.argsort(spread)[::-1][:_TRIES].tolist():
        estimate = _part(
            motion, wind, int(edges[hour]), int(edges[hour + 1]), search=search, generator=generator
        )
        if estimate is not None and estimate.is_accepted:
            return estimate
        if estimate is not None and not reasons:
            reasons = list(estimate.reasons)
    raise _refused_error(names, reasons or ["the logs have no hour in common"])


def _line(
    motion: MotionSeries,
    wind: WindAverage,
    overall: LagEstimate,
    *,
    search: LagSearch,
    generator: np.random.Generator,
    progress: Progress | None,
) -> ClockLine:
    """Fits the line through the offsets of the parts; without three of them the first offset and a
    prior drift."""
    duration = float(motion.time[-1] - motion.time[0]) / NANOSECONDS
    reach = max(_REACH, 4 * overall.sigma + _FASTEST * duration)
    search_nearby = replace(
        search, centre=overall.offset, window=min(reach, search.window), sigma=_PART_SIGMA
    )
    search_nearby = replace(
        search_nearby,
        sigma=math.hypot(_PART_SIGMA, search_nearby.stamp_sigma),
        surrogates=_PART_SURROGATES,
    )
    count = int(duration / PART)
    edges = np.linspace(float(motion.time[0]), float(motion.time[-1]) + 1, count + 1).astype(
        np.int64
    )
    chosen = (
        np.unique(np.linspace(0, count - 1, min(count, MOST_PARTS)).round().astype(np.int64))
        if count
        else []
    )
    parts: list[LagEstimate] = []
    for index in chosen:
        part = _part(
            motion,
            wind,
            int(edges[index]),
            int(edges[index + 1]),
            search=search_nearby,
            generator=generator,
        )
        if part is not None and part.is_accepted:
            parts.append(part)
        if progress:
            progress(1)
    if len(parts) < FEWEST_PARTS:
        return ClockLine(
            origin=overall.at,
            offset=overall.offset,
            drift=0.0,
            sigma_offset=overall.sigma,
            sigma_drift=QUARTZ,
        )
    return line_through(tuple(parts), overall)


def _model(
    line: ClockLine, sensor: WindSeries, *, names: tuple[str, str], confidence: float, turned: bool
) -> ClockModel:
    """Builds the sensor's clock on the reference's; `turned` where the line is of the reference's
    clock on the sensor's."""
    origin, offset, drift = line.origin, line.offset, line.drift
    if turned:
        origin, offset, drift = origin + round(offset * NANOSECONDS), -offset, -drift / (1 + drift)
    segment = Segment(
        start=int(sensor.time[0]),
        end=int(sensor.time[-1]) + 1,
        origin=origin,
        offset=offset,
        drift=drift,
        sigma_offset=line.sigma_offset,
        sigma_drift=line.sigma_drift,
    )
    return ClockModel(
        device=names[1],
        reference=names[0],
        method="estimated",
        confidence=confidence,
        segments=(segment,),
    )


def _refused_error(names: tuple[str, str], reasons: list[str]) -> RefusedError:
    return RefusedError(
        f"no offset can be estimated: {'; '.join(reasons)}",
        where=f"{names[0]} and {names[1]}",
        fix="check that both logs are of one wind, and their zones; search around another offset: "
        "--centre, --search;"
        " or compare logs that last longer",
    )
