"""The wind that blew, of what an anemometer logged: its lag undone, turbulence above its rate
filled in.

A cup follows the wind by τ dm/dt = u − m with τ = ℓ/⟨u⟩, and a log has a sample every second or so.
What it shows is undone, û = m + τ dm/dt, on bins of a second or more; what it does not show is
drawn. Conditional simulation by the residual of a reconstruction (Journel, Economic Geology 69,
1974): of a turbulence r with von Kármán's spectrum the same instrument would log ρ(r), and

    u = û(m) + r − û(ρ(r))

is a turbulence of the same spectrum which that instrument logs as m. Each simulation draws its own
r.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.core.rng import stream
from flagdata.core.schema import UNUSABLE
from flagdata.errors import InputError
from flagdata.record.signals import WindSeries
from flagdata.timebase import NANOSECONDS
from sim.effects.anemometer_lag import AnemometerLag
from sim.wind.spectral_wind import VonKarman

WIND_RATE = 10.0
"""Samples of the wind that blows in a simulation [Hz]; it is linear between them. Higher fills in
smaller eddies; lower smooths gusts that move a flag."""
LATERAL, VERTICAL = 0.78, 0.52
"""Standard deviation across the wind and upwards over that along it, near the ground (ESDU
85020)."""
_BIN = 1.0
"""Shortest bin that the lag is undone on [s]: on shorter ones it would raise the log's noise.
Longer leaves more of the lag in."""
_LEAST = 0.01
"""Least intensity of turbulence that is filled in: that of a tunnel."""
STEADY = 0.05
"""Standard deviation of the windows' mean speeds over their mean below which a wind counts as
constant."""
_FEWEST_SAMPLES = 4
"""Samples of a log that a wind is made of."""
_LONGEST_GAP = 5.0
"""s without a sample that is bridged: large eddies last a few seconds."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Log:
    """A log of the wind beside a film.

    Attributes:
        times: (n,) of the samples since the film's first frame, ascending [s].
        speed: (n,) [m/s].
        turn: (n,) of the direction that the air goes to from its mean, counter-clockwise from above
            [rad]; None where no direction was logged.
        distance: distance constant of the instrument [m]; None where it is not known, 0 for one
            without lag.
        averaging: what a sample is the mean over, with its time in the middle [s]; 0 for one
            instant.
        clock: standard uncertainty of all its times together beside the film's [s].

    Raises:
        InputError: shapes that disagree, fewer than four samples, no wind.
    """

    times: FloatArray
    speed: FloatArray
    turn: FloatArray | None = None
    distance: float | None = None
    averaging: float = 0.0
    clock: float = 0.0

    def __post_init__(self) -> None:
        shapes = {self.times.shape, self.speed.shape} | (
            set() if self.turn is None else {self.turn.shape}
        )
        if len(shapes) != 1 or self.times.ndim != 1:
            raise InputError(f"shapes {sorted(shapes)}", where="wind log", fix="give (n,) each")
        if len(self.times) < _FEWEST_SAMPLES:
            raise InputError(
                f"{len(self.times)} usable samples of the wind, at least {_FEWEST_SAMPLES} are "
                "needed",
                where="wind log",
                fix="give a log of more samples, or a longer part of the film",
            )
        if (
            not (np.diff(self.times) > 0).all()
            or not np.isfinite(self.speed).all()
            or not self.speed.mean() > 0
        ):
            raise InputError(
                "times that do not ascend, speeds that are not finite, or no wind",
                where="wind log",
                fix="choose a stretch with wind",
            )

    @classmethod
    def of(cls, series: WindSeries, *, start: int, clock: float = 0.0) -> Log:
        """Returns the usable samples of a recording's log.

        Args:
            start: of the film [UTC ns].
            clock: standard uncertainty of that [s].

        Raises:
            InputError: a log without speeds, or as for `Log`.
        """
        if "wind_speed" not in series.channels:
            raise InputError(
                "the log has no wind speed",
                where=series.sensor.name,
                fix="ingest a log of a wind speed",
            )
        speed, direction = series.channels["wind_speed"], series.channels.get("wind_direction")
        usable = ((series.flags & UNUSABLE) == 0) & np.isfinite(speed)
        turn = None
        if direction is not None and np.isfinite(direction[usable]).mean() > 0.9:
            usable &= np.isfinite(direction)
            heading = np.exp(-1j * direction[usable])  # clockwise from above is a turn to the right
            mean = np.angle((speed[usable] * heading).mean())
            turn = np.angle(heading * np.exp(-1j * mean))
        averaging = series.sensor.averaging or 0.0
        return cls(
            times=(series.time[usable] - start) / NANOSECONDS - averaging / 2,
            speed=speed[usable].copy(),
            turn=turn,
            distance=series.sensor.distance_constant,
            averaging=averaging,
            clock=clock,
        )

    def cut(self, start: float, end: float) -> Log:
        """Cuts out the part of it that a film from `start` to `end` [s] needs, with its times since
        `start`.

        Raises:
            InputError: it does not cover the film.
        """
        period = float(np.median(np.diff(self.times)))
        if self.times[0] > start + period or self.times[-1] < end - 2 * period:
            raise InputError(
                f"the log runs from {self.times[0]:.1f} to {self.times[-1]:.1f} s of the film's "
                "time and does not "
                f"cover its part from {start:.1f} to {end:.1f} s",
                where="wind log",
                fix="choose a part of the film that the log covers, with --start and --end",
            )
        needed = (self.times >= start - 60.0) & (self.times <= end + 2 * period)
        inside = self.times[needed]
        widest = float(np.diff(inside).max())
        if widest > max(_LONGEST_GAP, 1.5 * period):
            raise InputError(
                f"the log has a gap of {widest:.1f} s beside the film",
                where="wind log",
                fix="choose a part without gaps, with --start and --end",
            )
        return Log(
            times=inside - start,
            speed=self.speed[needed],
            turn=None if self.turn is None else self.turn[needed],
            distance=self.distance,
            averaging=self.averaging,
            clock=self.clock,
        )

    def moved(self, late: float) -> Log:
        """Returns the same samples that much later [s]."""
        return replace(self, times=self.times + late)

    def covers(self, starts: NDArray[np.floating], ends: NDArray[np.floating]) -> BoolArray:
        """Returns (k,) whether no silence of the log longer than two of its periods, or two
        seconds, is in a window [s]."""
        gaps = np.diff(self.times)
        silent = gaps > max(2.0 * float(np.median(gaps)), 2.0)
        begins, stops = self.times[:-1][silent], self.times[1:][silent]
        free = [
            not ((begins < end) & (stops > start)).any()
            for start, end in zip(starts, ends, strict=True)
        ]
        return np.array(free) & (starts >= self.times[0]) & (ends <= self.times[-1])

    def undo_lag(self) -> Log:
        """Returns the same with its instrument's lag undone; itself where that is not known."""
        if not self.distance:
            return self
        speed = _undone(
            self.times, self.speed[:, None], lag=self.distance / float(self.speed.mean())
        )[:, 0]
        return replace(self, speed=np.maximum(speed, 0.0), distance=0.0)

    def velocity(self, distance: float) -> FloatArray:
        """Returns (n, 2) along the mean wind and to its left at `times`, a lag of that distance
        constant undone [m/s]."""
        turn = np.zeros_like(self.speed) if self.turn is None else self.turn
        parts = np.stack([self.speed * np.cos(turn), self.speed * np.sin(turn)], axis=1)
        return _undone(self.times, parts, lag=distance / float(self.speed.mean()))

    def mean_speed(self, starts: NDArray[np.floating], ends: NDArray[np.floating]) -> FloatArray:
        """Returns (k,) mean speed over windows [s], linear between samples [m/s]."""
        first, last = float(starts.min()), float(ends.max())
        grid = np.arange(0, round((last - first) * WIND_RATE) + 1) / WIND_RATE + first
        values = np.interp(grid, self.times, self.speed)
        return np.array(
            [values[(grid >= a) & (grid <= b)].mean() for a, b in zip(starts, ends, strict=True)]
        )


def blown(
    log: Log, *, before: float, duration: float, distance: float, eddies: float, seed: int
) -> FloatArray:
    """Draws one wind that an anemometer would have logged so.

    Args:
        before: time before the film's start for which it is needed [s]; what the log lacks of it is
            mirrored.
        duration: of the film [s].
        distance: distance constant [m].
        eddies: integral length scale [m].
        seed: of the turbulence.

    Returns:
        (n, 3) along the mean wind, to its left and up, at `WIND_RATE` from `before` seconds before
            the film [m/s].
    """
    count = int(np.ceil((before + duration) * WIND_RATE)) + 2
    times = np.arange(count) / WIND_RATE - before
    # The logged wind, its lag undone.
    logged_velocity = log.velocity(distance)
    mean = float(log.speed.mean())
    intensity = float(np.clip(logged_velocity[:, 0].std() / mean, _LEAST, 0.5))
    # From the log's own first sample on, so that the instrument's start in balance lies before what
    # is used.
    first = min(float(log.times[0]), -before)
    grid = np.arange(int(np.ceil((times[-1] - first) * WIND_RATE)) + 1) / WIND_RATE + first
    # Turbulence of the spectrum, on a grid that begins early enough.
    rng = stream(seed, "calibrate", "turbulence")
    drawn = []
    for ratio, length in ((1.0, eddies), (LATERAL, eddies / 2), (VERTICAL, eddies / 2)):
        spectrum = VonKarman(mean=mean, intensity=intensity * ratio, length=length)
        drawn.append(
            spectrum.series(rng, duration=len(grid) / WIND_RATE, rate=WIND_RATE)[: len(grid)] - mean
        )
    turbulence = np.stack(drawn, axis=1)
    # What the same instrument would have logged of it is subtracted: it is in the log already.
    logged_axes = 2 if log.turn is not None else 1
    logged = _read(grid, mean + turbulence[:, :logged_axes], log, distance=distance) - mean
    again = _undone(log.times, logged, lag=distance / mean)
    out = np.empty((count, 3))
    mirrored = (
        np.abs(times - log.times[0]) + log.times[0]
    )  # before the log begins it runs backwards
    for axis in range(3):
        free = np.interp(times, grid, turbulence[:, axis])
        if axis < logged_axes:
            logged_component = np.interp(mirrored, log.times, logged_velocity[:, axis])
            covered = times >= log.times[0]
            free = (
                np.where(covered, free - np.interp(times, log.times, again[:, axis]), 0.0)
                + logged_component
            )
        out[:, axis] = free
    if logged_axes == 1:  # a cup logs the horizontal speed, whatever the direction
        angle = np.arctan2(out[:, 1], mean)
        out[:, :2] = out[:, :1] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return out


def _read(times: FloatArray, values: FloatArray, log: Log, *, distance: float) -> FloatArray:
    """Returns what the instrument of a log reads of winds (n, k) at the log's instants: (m, k)."""
    lagged = (
        AnemometerLag(distance=distance)
        .read(torch.from_numpy(times), torch.from_numpy(values))
        .numpy()
    )
    size = max(1, round(log.averaging * WIND_RATE))
    if size > 1:
        total = np.concatenate([np.zeros((1, lagged.shape[1])), np.cumsum(lagged, axis=0)])
        places = np.arange(len(lagged))
        low, high = (
            np.maximum(places - size // 2, 0),
            np.minimum(places + size - size // 2, len(lagged)),
        )
        lagged = (total[high] - total[low]) / (high - low)[:, None]
    return np.stack([np.interp(log.times, times, column) for column in lagged.T], axis=1)


def _undone(times: FloatArray, values: FloatArray, *, lag: float) -> FloatArray:
    """Samples (n, k) with τ dm/dt added, the slope taken over bins of at least `_BIN`."""
    if lag == 0:
        return values
    half = max(1, round(_BIN / float(np.median(np.diff(times)))))
    low, high = (
        np.maximum(np.arange(len(times)) - half, 0),
        np.minimum(np.arange(len(times)) + half, len(times) - 1),
    )
    return values + lag * (values[high] - values[low]) / (times[high] - times[low])[:, None]
