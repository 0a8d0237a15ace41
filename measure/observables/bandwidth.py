"""Bandwidth of the free edge's spectrum."""

from __future__ import annotations

import numpy as np

from measure.observables.chord import Window
from measure.observables.frequency import moving
from measure.observables.observable import Observable


def bandwidth(window: Window) -> float:
    """Computes the deviation of the frequencies, each weighed by its power [Hz]."""
    frequencies, power = moving(window)
    share = power / power.sum()
    return float(np.sqrt((share * np.square(frequencies - share @ frequencies)).sum()))


BANDWIDTH = Observable(
    name="bandwidth",
    unit="Hz",
    meaning="standard deviation of the frequencies in the same spectrum",
    blind="whether a broad spectrum is of many waves or of one whose frequency follows the wind",
    pixels=bandwidth,
    geometry=bandwidth,
    bias=0.325,
    sigma=0.225,
    quadratic=True,
)
