"""Winds that a recipe gives as samples: an array, or the log of an anemometer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from flagdata.errors import InputError, UsageError
from flagdata.provenance import canonical, digest
from flagdata.series import Wind
from flagdata.signals import WindSeries
from flagdata.tables import Table
from sim.wind.sampled import Beyond, Floats, SampledWind, about_mean, usable

Logs: TypeAlias = Callable[[str], tuple[str, WindSeries]]
"""The artifact and the samples of a log of the lake, by its name or id."""


@dataclass(frozen=True, kw_only=True, eq=False)
class WindSamples:
    """What blows in every member.

    Attributes:
        times: (n,) since the first frame that is kept [s], ascending; those alone that the run needs.
        velocity: (n, 3) where the air goes to [m/s].
        artifact: the log's in the lake; empty for none.
    """

    times: Floats
    velocity: Floats
    artifact: str = ""

    def mean(self, frames: int, rate: float) -> NDArray[np.float64]:
        """Returns the mean (3,) at the frames that are kept [m/s]."""
        kept = np.arange(frames) / rate
        return np.stack([np.interp(kept, self.times, part).mean() for part in self.velocity.T])

    def wind(self, first: float, batch: int, like: Tensor) -> SampledWind:
        """Returns the wind of a batch on the clock of its run; the first and the last sample last on.

        Args:
            first: when the first frame that is kept is, on that clock [s].
            batch: members.
            like: of the type and on the device of the wind's samples.
        """
        samples = torch.as_tensor(self.velocity, dtype=like.dtype, device=like.device)
        return SampledWind(
            times=tuple((self.times + first).tolist()),
            samples=samples[..., None].expand(-1, -1, batch),
            beyond=Beyond.HOLD,
        )

    def content(self) -> str:
        """Returns a hash of times and velocities."""
        return digest(canonical([self.times.tolist(), self.velocity.tolist()]))


def read(table: Table, *, before: float, duration: float, logs: Logs | None) -> WindSamples | None:
    """Reads `log`, `log-start` and `toward`, or `samples`, and `beyond` of a recipe's [wind]; None where neither is.

    Args:
        before: how long the run lasts before the first frame that is kept [s].
        duration: from that frame to the last one [s].
        logs: of the lake; None where there is no lake.

    Raises:
        UsageError: a speed beside them, or both; a log by name without a lake.
        InputError: samples that do not fit, that are not ascending in time or do not cover the run.
    """
    stated = [key for key in ("speed", "log", "samples") if key in table]
    if len(stated) > 1:
        raise UsageError(f"{' and '.join(stated)} are given", where=table.where, fix="keep one of them")
    if stated in ([], ["speed"]):
        return None
    artifact = ""
    if stated == ["log"]:
        artifact, series = _log(table, logs)
        times, velocity = _velocity(table, series)
    else:
        times, velocity = _array(table)
    if table.choice("beyond", Beyond.REFUSE) is Beyond.REFUSE and (times[0] > -before or times[-1] < duration):
        raise InputError(
            f"the wind is known from {times[0]:g} to {times[-1]:g} s and the run lasts from {-before:g} to "
            f"{duration:g} s, counted from the first frame that is kept",
            where=table.where,
            fix='give a longer series, or beyond = "hold", with which the first and the last sample last on',
        )
    low = max(int(np.searchsorted(times, -before, side="right")) - 1, 0)
    high = min(int(np.searchsorted(times, duration, side="left")) + 1, len(times))
    low, high = min(low, len(times) - 2), max(high, min(low, len(times) - 2) + 2)
    return WindSamples(times=times[low:high], velocity=velocity[low:high], artifact=artifact)


def _log(table: Table, logs: Logs | None) -> tuple[str, WindSeries | Wind]:
    log = table.value("log")
    if isinstance(log, Wind | WindSeries):
        return "", log
    name = table.text("log", None) or ""
    if logs is None:
        raise UsageError(
            f"the log {name!r} is looked for in a lake, and there is none",
            where=table.where,
            fix="give the log itself, as flagdata.wind returns it",
        )
    return logs(name)


def _velocity(table: Table, series: WindSeries | Wind) -> tuple[Floats, Floats]:
    """Returns times (n,) [s] and velocities (n, 3) [m/s] of a log whose vector mean goes where `toward` says."""
    start = int(series.time[0]) if isinstance(series, WindSeries) else 0
    if isinstance(series, WindSeries):
        time, speed, direction = usable(series, start=start, where=table.where)
    else:
        good = np.isfinite(series.speed)
        direction = None
        if np.isfinite(series.direction).any():
            good &= np.isfinite(series.direction)
            direction = series.direction[good]
        time, speed = series.time[good], series.speed[good]
    times, mean, relative = about_mean(time, speed, direction, where=table.where)
    toward = mean * np.exp(1j * table.one_angle("toward", 0.0)) * (1 + relative)
    return times - table.number("log-start", 0.0), np.stack([toward.real, toward.imag, 0.0 * times], axis=1)


def _array(table: Table) -> tuple[Floats, Floats]:
    try:
        rows = np.array(table.value("samples"), dtype=np.float64)
    except (TypeError, ValueError):
        rows = np.zeros(0)
    if rows.ndim != 2 or rows.shape[1] != 4 or len(rows) < 2 or not np.isfinite(rows).all():
        raise InputError(
            "samples of the wind are no table of numbers",
            where=table.where,
            fix="give two rows or more, [[time, x, y, z], …], in s since the first frame that is kept and m/s",
        )
    if not (np.diff(rows[:, 0]) > 0).all():
        raise InputError("times of the wind's samples do not ascend", where=table.where, fix="sort the rows by time")
    return rows[:, 0], rows[:, 1:]
