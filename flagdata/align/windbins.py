"""An anemometer's samples as equal bins whose instants are those of the air they report, for the search of a lag.

A bin's stamp is easily half a sample off: a reading stamped t may be of that instant or the mean of the time since the
reading before. For clips that is nothing; for a clock offset it is the error. So each bin's instant is set by its
samples' own stamps and by how long the instrument averages, and what is not known of that goes into σ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from flagdata.errors import InputError
from flagdata.ingest.anemometer.averaging import average
from flagdata.schema import UNUSABLE
from flagdata.signals import WindAverage, WindSeries
from flagdata.timebase import NANOSECONDS

SHORTEST = 1.0  # s, of a bin: gusts that flag and sensor share are slower
_LONGEST = 60.0  # s
_REACH = 20  # samples


@dataclass(frozen=True, kw_only=True)
class WindBins:
    """Bins on one regular grid; `average.time` minus half a period is the middle of the air each reports.

    Attributes:
        average: the bins.
        sigma: standard uncertainty of all their instants together [s]: what is not known of the instrument's averaging.
    """

    average: WindAverage
    sigma: float


def wind_bins(series: WindSeries) -> WindBins:
    """Bins of 1 s, or of the time between samples where that is longer.

    With c the time by which a sample's air precedes its stamp: half the sensor's averaging where its recipe states it;
    else anything from 0 (a reading of the instant) to half the time between samples, so its middle ± 1/√12 of it.

    Raises:
        InputError: no wind speed, fewer than two usable samples, or samples more than a minute apart.
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
        raise InputError(f"{len(time)} usable wind samples", fix="check the log's report; give another log")
    # Over several samples at a time, so that jitter averages out; their median, so that gaps do not count.
    reach = min(_REACH, len(time) - 1)
    spacing = float(np.median(time[reach:] - time[:-reach])) / reach / NANOSECONDS
    if spacing > _LONGEST:
        raise InputError(
            f"wind samples come every {spacing:.0f} s, too rarely to see gusts",
            fix="align by stamps or by a given offset",
        )
    period = max(SHORTEST, round(spacing, 2))
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
    stated = series.sensor.averaging
    lead = stated / 2 if stated is not None else spacing / 4
    move = float(np.median(stamps - middles)) - lead * NANOSECONDS
    return WindBins(
        average=replace(means, time=means.time + shift + round(move)),
        sigma=0.0 if stated is not None else spacing / (4 * math.sqrt(3)),
    )


def _mid_bin_shift(time: np.ndarray, length: int) -> int:
    """Time to take off slow samples so that they fall mid-bin, where jitter cannot move them across [ns]."""
    angle = 2 * np.pi * ((time % length) / length)
    phase = float(np.angle(np.mean(np.exp(1j * angle)))) / (2 * np.pi) * length
    return round(phase - length / 2)
