"""Centroid and bandwidth of the free edge's spectrum."""

from __future__ import annotations

import numpy as np

from flagdata.core.arrays import FloatArray
from measure.observables.chord import Window, chord
from measure.observables.not_shown import NO_MOTION, UnseenError
from measure.observables.observable import Observable
from measure.observables.place_courses import spectrum

_STILL = 0.004
"""Root mean square motion of the free edge, in flag lengths, below which there is no spectrum but
of noise. Lower reads the frequency of noise."""


def moving(window: Window) -> tuple[FloatArray, FloatArray]:
    """Frequencies and power of the free edge's motion, `motion.spectrum`.

    Raises:
        UnseenError: it does not move, or is not seen.
    """
    if np.sqrt(chord(window).var(axis=0).sum()) < _STILL * window.length:
        raise UnseenError(NO_MOTION)
    return spectrum(window.silhouettes.times, window.free_edge)


def frequency(window: Window) -> float:
    """Computes the mean of the frequencies, each weighed by its power [Hz]."""
    frequencies, power = moving(window)
    return float((frequencies * power).sum() / power.sum())


FREQUENCY = Observable(
    name="frequency",
    unit="Hz",
    meaning="centroid of the power spectrum, 0.4 to 8 Hz, of the motion of the middle of the free "
    "edge in the picture",
    blind="slower changes of the wind; which of size, tension and damping sets it",
    pixels=frequency,
    geometry=frequency,
    bias=0.212,
    sigma=0.209,
)


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
