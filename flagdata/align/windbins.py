"""An anemometer's samples as equal bins whose instants are those of the air they report, for the
search of a lag.

A bin's stamp is easily half a sample off: a reading stamped t may be of that instant or the mean of
the time since the reading before. For clips that is nothing; for a clock offset it is the error. So
each bin's instant is set by its samples' own stamps, by how long the instrument averages and by how
late it follows; the uncertainty of these goes into σ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from flagdata.core.schema import UNUSABLE
from flagdata.errors import InputError
from flagdata.record.averaging import average
from flagdata.record.signals import Sensor, WindAverage, WindSeries
from flagdata.timebase import NANOSECONDS

SHORTEST = 1.0  # s, of a bin: gusts that flag and sensor share are slower
_LONGEST = 60.0  # s
_REACH = 20  # samples
_HEAVIEST = 3.0  # m, distance constant of heavy cups
_TRUST = 0.2  # of a stated distance constant: U varies, and makers measure it in steady wind
_SLOWEST = 0.5  # m/s, below which rotating sensors hardly turn


@dataclass(frozen=True, kw_only=True)
class WindBins:
    """Bins on one regular grid; `average.time` minus half a period is the middle of the air each
    reports.

    Attributes:
        average: the bins.
        sigma: standard uncertainty of all their instants together [s]: the uncertainty of the
            instrument's averaging and lag.
    """

    average: WindAverage
    sigma: float


def wind_bins(series: WindSeries, *, shortest: float = SHORTEST) -> WindBins:
    """Bins of `shortest` [s], or of the time between samples where that is longer.

    A sample's air precedes its stamp by the sum of two times. Half the sensor's averaging, where
    its recipe states it; else anything from 0 (a reading of the instant) to half the time between
    samples. And ℓ/U, the lag of a rotating sensor of distance constant ℓ in a mean wind U
    (Kristensen, 1998); where the recipe states no ℓ, anything from 0 (a sonic) to 3 m (a heavy
    cup). A range counts as its middle ± 1/√12 of its width; a stated ℓ is trusted to 20 %.

    Raises:
        InputError: no wind speed, fewer than two usable samples, or samples more than a minute
            apart.
    """
    if "wind_speed" not in series.channels:
        raise InputError(
            f"the log of {series.sensor.name} has no channel wind_speed",
            where=", ".join(sorted(series.channels)),
            fix="align by stamps or by a given offset",
        )
    usable = ((series.flags & UNUSABLE) == 0) & np.isfinite(series.channels["wind_speed"])
    time = series.time[usable]
    if len(time) < 2:
        raise InputError(
            f"{len(time)} usable wind samples", fix="check the log's report; give another log"
        )
    # Over several samples at a time, so that jitter averages out; their median, so that gaps do not
    # count.
    reach = min(_REACH, len(time) - 1)
    spacing = float(np.median(time[reach:] - time[:-reach])) / reach / NANOSECONDS
    if spacing > _LONGEST:
        raise InputError(
            f"wind samples come every {spacing:.0f} s, too rarely to see gusts",
            fix="align by stamps or by a given offset",
        )
    period = max(shortest, round(spacing, 2))
    length = round(period * NANOSECONDS)
    shift = _mid_bin_shift(time, length) if spacing > period / 4 else 0
    means = average(replace(series, time=series.time - shift), period)
    shifted = time - shift
    bins = -(-shifted // length)
    starts = np.flatnonzero(np.concatenate(([True], np.diff(bins) > 0)))
    counts = np.diff(np.append(starts, len(bins)))
    origin = int(shifted[0])
    stamps = np.add.reduceat((shifted - origin).astype(np.float64), starts) / counts
    middles = (means.time - origin).astype(np.float64) - length / 2
    early, sigma = lead(
        series.sensor, spacing, float(np.mean(series.channels["wind_speed"][usable]))
    )
    move = float(np.median(stamps - middles)) - early * NANOSECONDS
    return WindBins(average=replace(means, time=means.time + shift + round(move)), sigma=sigma)


def lead(sensor: Sensor, spacing: float, speed: float) -> tuple[float, float]:
    """Computes by how much a sample's air precedes its stamp, and its standard uncertainty [s]."""
    rectangle = 1 / math.sqrt(12)
    if sensor.averaging is not None:
        averaging, averaging_sigma = sensor.averaging / 2, 0.0
    else:
        averaging, averaging_sigma = spacing / 4, rectangle * spacing / 2
    wind = max(speed, _SLOWEST)
    if sensor.distance_constant is not None:
        lag = sensor.distance_constant / wind
        lag_sigma = _TRUST * lag
    else:
        lag, lag_sigma = _HEAVIEST / 2 / wind, rectangle * _HEAVIEST / wind
    return averaging + lag, math.hypot(averaging_sigma, lag_sigma)


def _mid_bin_shift(time: np.ndarray, length: int) -> int:
    """Computes the time to take off slow samples so that they fall mid-bin, where jitter cannot
    move them across [ns]."""
    angle = 2 * np.pi * ((time % length) / length)
    phase = float(np.angle(np.mean(np.exp(1j * angle)))) / (2 * np.pi) * length
    return round(phase - length / 2)
