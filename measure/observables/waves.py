"""The wave that travels along the chord, from the phases of the silhouette's middle line at
sections of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from measure.observables.chord import Window, chord
from measure.observables.not_shown import EDGE_ON, NO_WAVE, UnseenError
from measure.observables.place_courses import HIGHEST, LOWEST, RATE, even, fourier_transform

_SECTIONS = np.linspace(0.35, 0.85, 6)
"""Of the mean chord, where the middle line is followed."""
_COHERENT = 0.5
"""Share of the power at neighbouring sections whose phases belong together from which on there is a
wave. Lower reads waves into flags that swing as a whole or flutter without order."""
_LONGEST = 3.0
"""Length [flag lengths] of a wave above which all of the chord moves together, and no wave is
seen."""


@dataclass(frozen=True, kw_only=True)
class Wave:
    """A travelling wave.

    Attributes:
        frequency: [Hz], weighed by the power of the middle line.
        number: phase along a flag length [rad], above 0 where it travels away from the hoist.
    """

    frequency: float
    number: float


def wave(window: Window) -> Wave:
    """Estimates the mean wave of a window.

    Raises:
        UnseenError: no phases that belong together, or too few frames.
    """
    reach = chord(window).mean(axis=0)[0]
    shapes = window.silhouettes
    profile = shapes.masks.sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        line = np.einsum("nrc,r->nc", shapes.masks, shapes.rows) / profile
    half = 0.04 * shapes.length
    sections = [np.abs(shapes.columns - share * reach) <= half for share in _SECTIONS]
    if not all(section.any() for section in sections):
        raise UnseenError(EDGE_ON)
    course = np.stack([line[:, section].mean(axis=1) for section in sections], axis=1)
    at, places = even(shapes.times, course)
    spectra = fourier_transform(at, places)
    frequency = np.fft.rfftfreq(len(at), 1 / RATE)
    band = (frequency >= LOWEST - 1e-9) & (frequency <= HIGHEST)
    spectra, frequency = spectra[band], frequency[band]
    cross = (spectra[:, 1:] * spectra[:, :-1].conj()).sum(axis=1)
    power = (np.abs(spectra[:, 1:]) * np.abs(spectra[:, :-1])).sum(axis=1)
    total = cross.sum()
    if power.sum() <= 0 or abs(total) < _COHERENT * power.sum():
        raise UnseenError(NO_WAVE)
    spacing = float(np.diff(_SECTIONS).mean()) * reach / window.length
    number = -math.atan2(total.imag, total.real) / spacing
    if number * _LONGEST < 2 * math.pi:
        raise UnseenError(NO_WAVE)
    return Wave(frequency=float((power * frequency).sum() / power.sum()), number=number)
