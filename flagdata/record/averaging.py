"""Averages of a wind series over equal bins, with their standard uncertainty.

For the n usable samples v_i of a bin:

    speed      v = Σ v_i / n                                          scalar mean
    direction  atan2(Σ v_i sin θ_i, Σ v_i cos θ_i)                    vector mean, "from",
                                                                      clockwise from north
    sigma²     s² / n_eff + a² + q² / 12

s² is the sample variance within the bin, n_eff = n (1 - ρ) / (1 + ρ) the number of independent
samples of a first-order autoregressive process (Bayley and Hammersley 1946, J. R. Stat. Soc. Suppl.
8:184, for large n), at least 1, with ρ, the correlation of neighbouring samples, from the von
Neumann ratio pooled over all bins: ρ = 1 - mean (v_{i+1} - v_i)² / (2 s²), kept within 0 and 1. a
is the larger of the sensor's accuracy and its relative accuracy × v (systematic: not reduced by
averaging; JCGM 100:2008, 4.3), q its resolution (rectangular, 4.3.7).

Not included: what the sensor missed while it gave no sample, its response time, its distance from
the flag, tilt, and clock errors. A bin with one sample has no scatter to see: its sigma is the
instrument's alone. A sensor whose recipe names no accuracy counts as exact, so that its sigma is a
lower bound.
"""

from __future__ import annotations

import math

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.schema import UNUSABLE
from flagdata.errors import InputError, UsageError
from flagdata.record.signals import Sensor, WindAverage, WindSeries
from flagdata.timebase import NANOSECONDS

_DIRECTION_OF = {
    "wind_speed": "wind_direction",
    "apparent_wind_speed": "apparent_wind_direction",
    "theoretical_wind_speed": "theoretical_wind_direction",
}


def average(series: WindSeries, period: float = 1.0, *, channel: str = "wind_speed") -> WindAverage:
    """Averages `channel` over bins of `period` [s] that end at whole multiples of it since 1970.

    A sample stamped at a bin's end belongs to that bin: (end - period, end]. Bins without a usable
    sample are absent.

    Raises:
        InputError: the series has no such channel.
        UsageError: a period that is not positive, or below a microsecond.
    """
    if not (math.isfinite(period) and period >= 1e-6):
        raise UsageError(
            f"the averaging period {period} s is not a positive number",
            where="period",
            fix="give seconds above 0",
        )
    if channel not in series.channels:
        raise InputError(
            f"the log of {series.sensor.name} has no channel {channel}",
            where=", ".join(sorted(series.channels)),
            fix="name one that it has; apparent or estimated wind is no ground truth",
        )
    length = round(period * NANOSECONDS)
    speed = series.channels[channel]
    usable = ((series.flags & UNUSABLE) == 0) & np.isfinite(speed)
    time, speed = series.time[usable], speed[usable]
    bins = -(-time // length)
    starts = (
        np.flatnonzero(np.concatenate(([True], np.diff(bins) > 0)))
        if len(bins)
        else np.zeros(0, dtype=np.int64)
    )
    count = np.diff(np.append(starts, len(bins)))
    if len(starts) == 0:
        empty = np.zeros(0)
        return WindAverage(
            time=np.zeros(0, dtype=np.int64),
            speed=empty,
            sigma=empty,
            direction=empty,
            count=np.zeros(0, dtype=np.int32),
            period=period,
        )
    mean = np.add.reduceat(speed, starts) / count
    scatter = _scatter(speed, starts, count, mean)
    direction = np.full(len(starts), np.nan)
    name = _DIRECTION_OF.get(channel)
    if name is not None and name in series.channels:
        direction = _vector_mean(speed, series.channels[name][usable], starts)
    return WindAverage(
        time=bins[starts] * length,
        speed=mean,
        sigma=np.hypot(scatter, instrument_sigma(series.sensor, mean)),
        direction=direction,
        count=count.astype(np.int32),
        period=period,
    )


def instrument_sigma(sensor: Sensor, speed: FloatArray) -> FloatArray:
    """Computes the standard uncertainty of a reading by the instrument alone: accuracy and
    resolution [m/s]."""
    accuracy = np.maximum(sensor.accuracy or 0.0, (sensor.accuracy_relative or 0.0) * np.abs(speed))
    return np.hypot(accuracy, (sensor.resolution or 0.0) / math.sqrt(12))


def correlation(speed: FloatArray, starts: IntArray, count: IntArray) -> float:
    """Estimates the correlation ρ of neighbouring samples within bins, 0 to 1, see the module's
    text."""
    if len(speed) == 0 or int(count.max()) < 2:
        return 0.0
    mean = np.repeat(np.add.reduceat(speed, starts) / count, count)
    freedom = float((count - 1).sum())
    variance = float(((speed - mean) ** 2).sum()) / freedom
    inside = np.ones(len(speed), dtype=bool)
    inside[starts] = False
    steps = np.diff(speed)[inside[1:]]
    if variance <= 0 or len(steps) == 0:
        return 0.0
    return min(max(1 - float((steps**2).mean()) / (2 * variance), 0.0), 1.0)


def _scatter(speed: FloatArray, starts: IntArray, count: IntArray, mean: FloatArray) -> FloatArray:
    """Computes the standard deviation of each bin's mean from the scatter within it [m/s]; 0 for
    bins of one sample."""
    square = np.add.reduceat((speed - np.repeat(mean, count)) ** 2, starts)
    variance = square / np.maximum(count - 1, 1)
    rho = correlation(speed, starts, count)
    independent = np.maximum(count * (1 - rho) / (1 + rho), 1.0)
    return np.sqrt(variance / independent)


def _vector_mean(speed: FloatArray, direction: FloatArray, starts: IntArray) -> FloatArray:
    """Computes the direction of the mean wind vector of each bin [rad, 0 to 2π]; NaN where nothing
    blows or nothing is known."""
    finite = np.isfinite(direction)
    east = np.add.reduceat(np.where(finite, speed * np.sin(direction), 0.0), starts)
    north = np.add.reduceat(np.where(finite, speed * np.cos(direction), 0.0), starts)
    total = np.add.reduceat(np.where(finite, np.abs(speed), 0.0), starts)
    angle = np.mod(np.arctan2(east, north), 2 * np.pi)
    return np.where(np.hypot(east, north) > 1e-9 * np.maximum(total, 1e-12), angle, np.nan)
