"""Speed of the travelling wave."""

from __future__ import annotations

import math

from measure.observables.chord import Window
from measure.observables.observable import Observable
from measure.observables.waves import wave


def wave_speed(window: Window) -> float:
    """Computes the speed of the mean wave [flag lengths a second]."""
    mean_wave = wave(window)
    return 2 * math.pi * mean_wave.frequency / mean_wave.number


WAVE_SPEED = Observable(
    name="wave-speed",
    unit="1/s",
    meaning="speed, in flag lengths a second, at which the silhouette's middle line travels away "
    "from the hoist",
    blind="waves whose crests are along the line of sight's direction of motion, and standing "
    "waves",
    pixels=wave_speed,
    geometry=wave_speed,
    bias=0.408,
    sigma=0.793,
    counted_in="length",
)
