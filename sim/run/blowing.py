"""Winds that a recipe gives as samples: an array, or the log of an anemometer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import torch
from torch import Tensor

from flagdata.answer.film_series import Wind
from flagdata.core.arrays import FloatArray
from flagdata.core.provenance import canonical, digest
from flagdata.errors import InputError, UsageError
from flagdata.recipes.typed_tables import Angle, value
from flagdata.record.signals import WindSeries
from sim.wind.sampled import Beyond, SampledWind, about_mean, usable

Logs: TypeAlias = Callable[[str], tuple[str, WindSeries]]
"""The artifact and the samples of a log of the lake, by its name or id."""


@dataclass(frozen=True, kw_only=True, eq=False)
class WindSamples:
    """What blows in every member.

    Attributes:
        times: (n,) since the first frame that is kept [s], ascending; those alone that the run
            needs.
        velocity: (n, 3) where the air goes to [m/s].
        artifact: the log's in the lake; empty for none.
    """

    times: FloatArray
    velocity: FloatArray
    artifact: str = ""

    def mean(self, frames: int, rate: float) -> FloatArray:
        """Returns the mean (3,) over the recorded frames [m/s]."""
        frame_times = np.arange(frames) / rate
        return np.stack(
            [np.interp(frame_times, self.times, component).mean() for component in self.velocity.T]
        )

    def wind(self, first: float, batch: int, like: Tensor) -> SampledWind:
        """Returns the wind of a batch on the clock of its run; the first and the last sample last
        on.

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
        return digest(canonical({"times": self.times.tolist(), "velocity": self.velocity.tolist()}))


TYPES: Mapping[str, Mapping[str, Any]] = {
    "log": {"log": Any, "log-start": float, "toward": Angle, "beyond": Beyond},
    "samples": {"samples": Any, "beyond": Beyond},
}
"""Where samples come from → its keys in [wind]."""


def source(content: Mapping[str, Any], *, where: str) -> str | None:
    """Returns where the samples of a recipe's [wind] come from, a key of `TYPES`; None for a steady
    wind.

    Raises:
        UsageError: a speed beside them, or both.
    """
    sources = [key for key in ("speed", *TYPES) if key in content]
    if len(sources) > 1:
        raise UsageError(f"{' and '.join(sources)} are given", where=where, fix="keep one of them")
    return sources[0] if sources and sources[0] in TYPES else None


def read(
    values: Mapping[str, Any], *, before: float, duration: float, logs: Logs | None, where: str
) -> WindSamples:
    """Returns the samples of the part of a wind that a run needs.

    Args:
        values: key → value, of the source's types in `TYPES`.
        before: how long the run lasts before the first frame that is kept [s].
        duration: from that frame to the last one [s].
        logs: of the lake; None where there is no lake.

    Raises:
        UsageError: a log by name without a lake.
        InputError: samples that do not fit, that are not ascending in time or do not cover the run.
    """
    artifact = ""
    if "log" in values:
        artifact, series = _log(values["log"], logs, where=where)
        times, velocity = _velocity(values, series, where=where)
    else:
        times, velocity = _array(values["samples"], where=where)
    refused = values.get("beyond", Beyond.REFUSE) is Beyond.REFUSE
    if refused and (times[0] > -before or times[-1] < duration):
        raise InputError(
            f"the wind is known from {times[0]:g} to {times[-1]:g} s and the run lasts from "
            f"{-before:g} to "
            f"{duration:g} s, counted from the first frame that is kept",
            where=where,
            fix='give a longer series, or beyond = "hold", with which the first and the last '
            "sample last on",
        )
    low = max(int(np.searchsorted(times, -before, side="right")) - 1, 0)
    high = min(int(np.searchsorted(times, duration, side="left")) + 1, len(times))
    low, high = min(low, len(times) - 2), max(high, min(low, len(times) - 2) + 2)
    return WindSamples(times=times[low:high], velocity=velocity[low:high], artifact=artifact)


def _log(log: Any, logs: Logs | None, *, where: str) -> tuple[str, WindSeries | Wind]:
    if isinstance(log, Wind | WindSeries):
        return "", log
    name = value(str, log, key="log", where=where)
    if logs is None:
        raise UsageError(
            f"the log {name!r} is looked for in a lake, and there is none",
            where=where,
            fix="give the log itself, as flagdata.wind returns it",
        )
    return logs(name)


def _velocity(
    values: Mapping[str, Any], series: WindSeries | Wind, *, where: str
) -> tuple[FloatArray, FloatArray]:
    """Returns times (n,) [s] and velocities (n, 3) [m/s] of a log whose vector mean goes where
    `toward` says."""
    start = int(series.time[0]) if isinstance(series, WindSeries) else 0
    if isinstance(series, WindSeries):
        time, speed, direction = usable(series, start=start, where=where)
    else:
        good = np.isfinite(series.speed)
        direction = None
        if np.isfinite(series.direction).any():
            good &= np.isfinite(series.direction)
            direction = series.direction[good]
        time, speed = series.time[good], series.speed[good]
    times, mean, relative = about_mean(time, speed, direction, where=where)
    toward = mean * np.exp(1j * values.get("toward", 0.0)) * (1 + relative)
    return times - values.get("log-start", 0.0), np.stack(
        [toward.real, toward.imag, 0.0 * times], axis=1
    )


def _array(samples: Any, *, where: str) -> tuple[FloatArray, FloatArray]:
    try:
        rows = np.array(samples, dtype=np.float64)
    except (TypeError, ValueError):
        rows = np.zeros((0, 4))
    if rows.ndim != 2 or rows.shape[1] != 4 or len(rows) < 2 or not np.isfinite(rows).all():
        raise InputError(
            "samples of the wind are no table of numbers",
            where=where,
            fix="give two rows or more, [[time, x, y, z], …], in s since the first frame that is "
            "kept and m/s",
        )
    if not (np.diff(rows[:, 0]) > 0).all():
        raise InputError(
            "times of the wind's samples do not ascend", where=where, fix="sort the rows by time"
        )
    return rows[:, 0], rows[:, 1:]
