"""Length of the travelling wave."""

from __future__ import annotations

import math

from measure.observables.chord import Window
from measure.observables.observable import Observable
from measure.observables.waves import wave


def wave_length(window: Window) -> float:
    """Computes the length of the mean wave [flag lengths]."""
    mean_wave = wave(window)
    return 2 * math.pi / mean_wave.number


WAVE_LENGTH = Observable(
    name="wave-length",
    unit="1",
    meaning="length, in flag lengths along the picture, of the wave that travels along the "
    "silhouette's middle line",
    blind="waves whose crests are along the line of sight's direction of motion, and standing "
    "waves",
    pixels=wave_length,
    geometry=wave_length,
    bias=0.278,
    sigma=0.388,
    counted_in="length",
)
