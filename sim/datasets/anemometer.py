"""The anemometer beside a simulated flag: what it would have logged, in the same form as a real
log."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.core.schema import SampleFlag
from flagdata.recipes.typed_tables import Quantity, Range
from flagdata.record.signals import Sensor, WindSeries
from flagdata.timebase import NANOSECONDS
from sim.cloth.system import System
from sim.datasets.dataset_recipe import AnemometerSpec
from sim.datasets.dataset_toml import changing
from sim.effects import SENSOR_EFFECTS
from sim.effects.sensor import AnemometerEffect
from sim.run.members import Crew, Member

_FINE = 10.0
"""Rate [Hz] at which the air is sampled and an instrument's response computed; of a faster one
twice its own."""
_NAME = "simulated"


@dataclass(frozen=True, kw_only=True)
class SimulatedLog:
    """What an anemometer logged.

    Attributes:
        series: its samples.
        parameters: what was drawn for it, "effect.parameter" → value, SI; with "anemometer.noise"
            [m/s].
    """

    series: WindSeries
    parameters: Mapping[str, float]


def read(
    spec: AnemometerSpec, crew: Crew, member: Member, *, instrument: int, seed: int, begin: int
) -> SimulatedLog:
    """Simulates the log of one recording.

    The instrument stands at the middle of the hoist in undisturbed air: effects that change the
    wind from place to place do not reach it. Its samples are means over their period up to their
    stamp, after its effects in the recipe's order, with noise, in steps of its resolution, and
    never below 0; stamps fall anywhere within a second.

    Args:
        instrument: seed of what it is, its effects and the size of its noise.
        seed: of the recording, for the noise and the stamps.
        begin: instant at which the simulation's time is 0 [UTC ns].
    """
    time, velocity = air(spec, crew, member)
    return log_of_air(spec, time, velocity, instrument=instrument, seed=seed, begin=begin)


def log_of_air(
    spec: AnemometerSpec,
    time: FloatArray,
    velocity: FloatArray,
    *,
    instrument: int,
    seed: int,
    begin: int,
) -> SimulatedLog:
    """Simulates what an anemometer logs of air at velocity (n, 3) [m/s] at times (n,) [s]; the
    others as of `read`."""
    drawn = {
        name: {
            key: _drawn(value, instrument, "anemometer", name, key)
            for key, value in parameters.items()
        }
        for name, parameters in spec.effects.items()
    }
    noise = _drawn(spec.noise, instrument, "anemometer", "noise")
    speed = torch.from_numpy(np.hypot(velocity[:, 0], velocity[:, 1])[:, None])
    for name, values in drawn.items():
        effect: AnemometerEffect = SENSOR_EFFECTS[name](**values)
        speed = effect.read(torch.from_numpy(time), speed)
    phase = stream(seed, "anemometer", "phase").random()
    stamps, means = _means(
        time, np.column_stack([speed[:, 0].numpy(), velocity[:, :2]]), spec.rate, phase
    )
    readings = means[:, 0] + stream(seed, "anemometer", "samples").normal(0.0, noise, len(stamps))
    threshold = drawn.get("anemometer-dead-zone", {}).get("threshold")
    dead = np.zeros(len(stamps), dtype=bool) if threshold is None else means[:, 0] < threshold
    readings[dead] = 0.0
    readings = np.round(np.maximum(readings, 0.0) / spec.resolution) * spec.resolution
    series = WindSeries(
        time=begin + np.round(stamps * NANOSECONDS).astype(np.int64),
        channels={"wind_speed": readings, "wind_direction": blowing_from(means[:, 1], means[:, 2])},
        flags=np.where(dead, int(SampleFlag.DEAD_ZONE), 0).astype(np.uint16),
        sensor=Sensor(
            name=_NAME,
            averaging=1 / spec.rate,
            resolution=spec.resolution,
            accuracy=spec.accuracy,
            threshold=threshold,
            distance_constant=drawn.get("anemometer-lag", {}).get("distance"),
        ),
    )
    parameters = {
        f"{name}.{key}": value for name, values in drawn.items() for key, value in values.items()
    }
    return SimulatedLog(series=series, parameters={**parameters, "anemometer.noise": noise})


def air(spec: AnemometerSpec, crew: Crew, member: Member) -> tuple[FloatArray, FloatArray]:
    """Times (n,) since the simulation's start [s], and the air's velocity (n, 3) at them [m/s].

    A wind that changes is known only from the start; one that does not began `before` the first
    frame.
    """
    time = crew.recipe.time
    end = (time.total - 1) / time.rate
    begin = 0.0 if changing(crew.recipe) else time.settling / time.rate - spec.before
    fine = _FINE if spec.rate <= _FINE else 2 * spec.rate
    count = math.floor((end - begin) * fine + 1e-9) + 1
    times = np.maximum(end - np.arange(count)[::-1] / fine, begin)
    if not changing(crew.recipe):
        return times, np.tile(np.array(member.scene.wind, dtype=np.float64), (count, 1))
    system, _ = crew.assemble([member])
    return times, velocities(system, times)


def velocities(system: System, times: FloatArray) -> FloatArray:
    """Returns the velocity (n, 3) [m/s] of the undisturbed air at the first of a batch, at times
    (n,) [s]."""
    with torch.no_grad():
        return np.stack([system.wind.velocity(float(t))[:, 0].double().numpy() for t in times])


def blowing_from(x: FloatArray, y: FloatArray) -> FloatArray:
    """Returns where a wind (x to the east, y to the north) blows from, clockwise from north, in [0,
    2π) [rad]."""
    return np.mod(np.arctan2(-x, -y), 2 * math.pi)


def _means(
    time: FloatArray, values: FloatArray, rate: float, phase: float
) -> tuple[FloatArray, FloatArray]:
    """Stamps (m,) a period apart, and the means (m, k) of values (n, k) over the period that ends
    with each."""
    period = 1 / rate
    first = math.ceil((time[0] + period) * rate - phase) + phase
    stamps = np.arange(first, time[-1] * rate + 1e-9) / rate
    edges = np.searchsorted(time, np.stack([stamps - period, stamps]) + 1e-9, side="right")
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    return stamps, (sums[edges[1]] - sums[edges[0]]) / (edges[1] - edges[0])[:, None]


def _drawn(quantity: Quantity, seed: int, *path: str) -> float:
    return quantity.at(stream(seed, *path).random()) if isinstance(quantity, Range) else quantity
