"""Ground truth of a clip: the mean wind speed over a window that ends with it, and how well that
mean is known.

The window is (end - window, end]: a sample stamped exactly at the clip's end counts, one stamped
exactly a window earlier does not, and nothing after the end does. A sample speaks for the time
since the row before it, so that an irregular logger is not biased towards the moments when it was
busy; after a gap it speaks for one sampling period only.

The uncertainty is that of the mean wind of such minutes, of which the window is one draw: the
standard error of a correlated series, the instrument and the clock, all independent. For an
instrument of unknown accuracy and resolution the step between its readings is a lower bound; where
there is no step, since every reading is the same, the uncertainty is unknown and never 0. Not
included: the response time of the sensor, its distance from the flag, and what it missed while it
gave no sample; coverage and staleness give these.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from flagdata.core.arguments import check_arguments
from flagdata.core.arrays import BoolArray
from flagdata.core.schema import TRUTH_WINDOW, UNUSABLE, SampleFlag
from flagdata.errors import InputError, UsageError
from flagdata.record.signals import Instants, Sensor, Series, WindSeries
from flagdata.timebase import NANOSECONDS

BLOCK = 1.0  # s, length of the block means whose correlation gives the standard error
# s up to the clip's end over which the correlation time is estimated, or the window, if longer
HISTORY = 600.0
GAP = 1.5  # sampling periods; a longer silence, if it is longer than a block too, is a gap
LOW_COVERAGE = 0.8  # of the window; less is flagged, and refused by default
STALE = 5.0  # s; an older newest sample is flagged, and refused by default


@dataclass(frozen=True, kw_only=True)
class WindTruth:
    """A mean wind speed and its budget of uncertainty.

    Attributes:
        wind: mean speed over the window [m/s], NaN when no usable sample is in it.
        sigma: standard uncertainty [m/s], the root sum of squares of the parts below; NaN when a
            part cannot be known.
        sigma_mean: standard error of the mean of a correlated series [m/s]; NaN with fewer than two
            blocks.
        sigma_sensor: accuracy of the instrument, its resolution and its dead zone; does not shrink
            by averaging [m/s]; NaN where they are unknown and the readings show no step.
        sigma_clock: what the uncertainty of the common clock does to the mean [m/s].
        coverage: share of the window that usable samples speak for, 0 to 1.
        staleness: age of the newest usable sample at the end [s]; infinite when there is none
            before the end.
        count: usable samples in the window.
        flags: machine-readable names of what is off, sorted.
    """

    wind: float
    sigma: float
    sigma_mean: float
    sigma_sensor: float
    sigma_clock: float
    coverage: float
    staleness: float
    count: int
    flags: tuple[str, ...] = ()

    @classmethod
    def exact(cls, wind: float) -> WindTruth:
        """Returns a wind that a simulation states [m/s]."""
        return cls(
            wind=wind,
            sigma=0.0,
            sigma_mean=0.0,
            sigma_sensor=0.0,
            sigma_clock=0.0,
            coverage=1.0,
            staleness=0.0,
            count=0,
        )

    @classmethod
    def missing(cls, *, staleness: float) -> WindTruth:
        """Returns a truth without a usable sample in the window; the newest before its end is
        `staleness` old [s]."""
        nan = math.nan
        return cls(
            wind=nan,
            sigma=nan,
            sigma_mean=nan,
            sigma_sensor=nan,
            sigma_clock=nan,
            coverage=0.0,
            staleness=staleness,
            count=0,
            flags=("wind-missing",),
        )


def over_ground(series: WindSeries) -> Series | None:
    """Computes the speed of the air over ground (n,) [m/s]: the channel itself, or from the
    horizontal components of a sonic.

    `None` when the series has neither. The wind that a moving platform feels, or that its
    instrument computes as if the platform were at rest, is not the wind at a flag; nor are the
    components that apparent wind was made of.
    """
    channels = series.channels
    if "wind_speed" in channels:
        return np.asarray(channels["wind_speed"], dtype=np.float64)
    if "wind_x" in channels and "wind_y" in channels and "apparent_wind_speed" not in channels:
        return np.hypot(channels["wind_x"], channels["wind_y"])
    return None


@dataclass(frozen=True, kw_only=True)
class TruthSeries:
    """A wind series made ready for many windows; on the clock of the clips.

    Attributes:
        time: (n,) of the usable samples [UTC ns].
        speed: (n,) [m/s].
        held: (n,) time each sample speaks for, up to its stamp [s].
        dead: (n,) whether the sample lies in the sensor's dead zone.
        period: the sampling period, the median spacing of rows [s].
        sensor: the instrument.
    """

    time: Instants
    speed: Series
    held: Series
    dead: BoolArray
    period: float
    sensor: Sensor

    @classmethod
    def of(cls, series: WindSeries) -> TruthSeries:
        """Prepares `series`, whose times must be on the clock of the clips.

        Rows that hold other channels only (the sentences of one stream) are as if they were not
        there.

        Raises:
            InputError: no wind over ground.
        """
        speed = over_ground(series)
        if speed is None:
            raise InputError(
                "there is no wind over ground among the channels "
                + ", ".join(sorted(series.channels)),
                where=series.sensor.name,
                fix="give a log with wind_speed, or wind_x and wind_y; apparent wind is not ground "
                "truth",
            )
        present = np.isfinite(speed) | ((series.flags & int(SampleFlag.MISSING)) != 0)
        time, speed, flags = series.time[present], speed[present], series.flags[present]
        usable = np.isfinite(speed) & ((flags & int(UNUSABLE)) == 0)
        spacing = np.diff(time) / NANOSECONDS
        period = float(np.median(spacing)) if len(spacing) else BLOCK
        since = np.concatenate([[period], spacing])[: len(speed)]
        # Rows that arrive in bunches within a second are no gaps between the bunches.
        hold_times = np.where(since <= max(GAP * period, BLOCK), since, period)
        return cls(
            time=time[usable],
            speed=speed[usable],
            held=hold_times[usable],
            dead=((flags & int(SampleFlag.DEAD_ZONE)) != 0)[usable],
            period=period,
            sensor=series.sensor,
        )

    @check_arguments
    def before(
        self, end: int, *, window: float = TRUTH_WINDOW, clock_sigma: float = 0.0
    ) -> WindTruth:
        """Averages over (end - window, end].

        Args:
            end: the clip's last instant [UTC ns].
            window: [s].
            clock_sigma: standard uncertainty of the clip's instants on the series' clock [s].

        Raises:
            UsageError: a window or σ that is not a length of time.
        """
        if not (math.isfinite(window) and window > 0):
            raise UsageError(
                f"the window of {window} s is not a positive length", fix="give a length above zero"
            )
        if not (math.isfinite(clock_sigma) and clock_sigma >= 0):
            raise UsageError(
                f"the clock uncertainty {clock_sigma} s is negative or not a number",
                fix="give a σ of zero or more",
            )
        begin = end - round(window * NANOSECONDS)
        first, last = np.searchsorted(self.time, [begin, end], side="right").tolist()
        staleness = (end - int(self.time[last - 1])) / NANOSECONDS if last else math.inf
        if first == last:
            return WindTruth.missing(staleness=staleness)
        speed, hold_times = self.speed[first:last], self.held[first:last]
        wind = float(np.average(speed, weights=hold_times))
        inside = np.minimum(hold_times, (self.time[first:last] - begin) / NANOSECONDS)
        past = int(
            np.searchsorted(
                self.time, end - round(max(HISTORY, window) * NANOSECONDS), side="right"
            )
        )
        correlation = _correlation_time(self._blocks(past, last, begin))
        sigma_mean = _standard_error(self._blocks(first, last, begin), correlation)
        dead = float(np.average(self.dead[first:last], weights=hold_times))
        sigma_sensor = _sensor_sigma(self._completed_sensor(first, last, past), wind, dead)
        sigma_clock = clock_sigma * self._slope(first, last, begin, end, clock_sigma)
        coverage = min(1.0, float(inside.sum()) / window)
        flags = {
            "wind-coverage-low": coverage < LOW_COVERAGE,
            "wind-stale": staleness > STALE,
            "sensor-accuracy-unknown": self.sensor.accuracy is None
            and self.sensor.accuracy_relative is None,
            "wind-dead-zone": dead > 0,
            "wind-sigma-unknown": math.isnan(sigma_mean) or math.isnan(sigma_sensor),
        }
        return WindTruth(
            wind=wind,
            sigma=math.hypot(sigma_mean, sigma_sensor, sigma_clock),
            sigma_mean=sigma_mean,
            sigma_sensor=sigma_sensor,
            sigma_clock=sigma_clock,
            coverage=coverage,
            staleness=staleness,
            count=last - first,
            flags=tuple(sorted(name for name, holds in flags.items() if holds)),
        )

    def _completed_sensor(self, first: int, last: int, past: int) -> Sensor:
        """Returns the instrument, with the step of its readings as resolution where its errors are
        unknown.

        The step is that of the window, or, where nothing changes in it, of the history from `past`
        on.
        """
        sensor = self.sensor
        if not (
            sensor.accuracy is None
            and sensor.accuracy_relative is None
            and sensor.resolution is None
        ):
            return sensor
        step = _smallest_step(self.speed[first:last]) or _smallest_step(self.speed[past:last])
        return replace(sensor, resolution=step or None)

    def _blocks(self, first: int, last: int, begin: int) -> Series:
        """Means over blocks of a second (or of the sampling period, if longer) from `begin`; empty
        ones are absent."""
        width = round(max(BLOCK, self.period) * NANOSECONDS)
        # A stamp closes its block, as it closes the window.
        block = (self.time[first:last] - begin - 1) // width
        starts = np.concatenate([[0], np.nonzero(np.diff(block))[0] + 1])
        hold_times = self.held[first:last]
        return np.add.reduceat(self.speed[first:last] * hold_times, starts) / np.add.reduceat(
            hold_times, starts
        )

    def _slope(self, first: int, last: int, begin: int, end: int, clock_sigma: float) -> float:
        """Computes the size of the derivative of the window's mean with respect to its position
        [m/s²].

        Moving the window by δ gains δ · v(end) and loses δ · v(begin): the derivative is (v(end) -
        v(begin)) / window. Both speeds are means over ±σ (at least a block) about the edges. Where
        an edge has no samples the scatter
        within the window stands in: two independent draws differ by √2 of it.
        """
        window = (end - begin) / NANOSECONDS
        reach = round(max(clock_sigma, BLOCK, self.period) * NANOSECONDS)
        edges = []
        for edge in (begin, end):
            low, high = np.searchsorted(
                self.time, [edge - reach, edge + reach + 1], side="left"
            ).tolist()
            if low == high:
                return math.sqrt(2) * float(np.std(self.speed[first:last])) / window
            edges.append(float(np.mean(self.speed[low:high])))
        return abs(edges[1] - edges[0]) / window


def _sensor_sigma(sensor: Sensor, wind: float, dead: float) -> float:
    """Combines accuracy, a rectangular resolution step, and for the share `dead` a rectangular true
    speed in [0, threshold].

    NaN where neither accuracy nor resolution is known.
    """
    if sensor.accuracy is None and sensor.accuracy_relative is None and sensor.resolution is None:
        return math.nan
    accuracy = max(sensor.accuracy or 0.0, (sensor.accuracy_relative or 0.0) * wind)
    step = (sensor.resolution or 0.0) / math.sqrt(12)
    hidden = dead * (sensor.threshold or 0.0) / math.sqrt(3)
    return math.hypot(accuracy, step, hidden)


def _smallest_step(speed: Series) -> float:
    """Finds the smallest difference between readings (n,) that occur [m/s], to a nanometre a
    second; 0 when all are equal."""
    levels = np.unique(np.round(speed, 9))
    return float(np.diff(levels).min()) if len(levels) > 1 else 0.0


def _correlation_time(values: Series) -> float:
    """Estimates the integrated autocorrelation time of a series (n,), in steps: 1 for uncorrelated
    values.

    Geyer's initial monotone sequence (Practical Markov chain Monte Carlo, Statist. Sci. 7, 1992,
    section 3.3), and at
    least 1: no credit for anti-correlation.
    """
    n = len(values)
    centred = values - np.mean(values)
    variance = float(np.mean(centred**2))
    if variance == 0:
        return 1.0
    spectrum = np.fft.rfft(centred, 2 * n)
    correlation = np.fft.irfft(spectrum * np.conj(spectrum), 2 * n)[:n] / (n * variance)
    pairs = correlation[0 : n - n % 2 : 2] + correlation[1::2]
    positive = pairs[: int(np.argmax(pairs <= 0))] if np.any(pairs <= 0) else pairs
    return max(2 * float(np.sum(np.minimum.accumulate(positive))) - 1, 1.0)


def _standard_error(values: Series, correlation: float) -> float:
    """Computes the standard error of the mean of a series (n,) with a correlation time τ in steps;
    NaN for n < 2.

    var(mean) = s² τ / (n - τ), with s² = mean((x - x̄)²): the divisor undoes the loss of variance
    that removing the sample's own mean causes. τ is held at n/2 at most, where the error is the
    scatter itself: the window then saw no two independent winds.

    For a minute at 1 Hz of an AR(1) process, mean ± 2 standard errors holds the true mean in 96,
    96, 95 and 92 % of cases at correlation times of 1, 6, 19 and 39 s when the log goes back ten
    minutes; when it begins with the window, in 96, 89, 75 and 65 %.
    """
    n = len(values)
    if n < 2:
        return math.nan
    time = min(correlation, n / 2)
    return math.sqrt(float(np.var(values)) * time / (n - time))
