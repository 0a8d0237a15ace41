"""Courses of places in a window: their speed, spectrum and waves, at one rate whatever the
film's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from flagdata.core.arrays import FloatArray
from measure.observables.not_shown import FEW_FRAMES, UnseenError

RATE = 25.0
"""Rate [Hz] at which courses are compared: films of 25 fps and more have it."""
LOWEST, HIGHEST = 0.4, 8.0
"""Band [Hz] of the spectra: from a period a window up to where a film of 25 fps still resolves a
motion."""
_FEWEST = 25
"""Instants at `RATE` below which a window gives no spectrum."""
_LARGEST_GAP = 0.25
"""Gap between frames [s] from which on a course is not interpolated."""


def even(times: FloatArray, course: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Times and course (n, …) at `RATE`, by a cubic spline.

    Raises:
        UnseenError: too few instants, or a gap between them.
    """
    finite = np.isfinite(course).reshape(len(course), -1).all(axis=1)
    times, course = times[finite], course[finite]
    if len(times) < 4 or np.ptp(times) * RATE + 1 < _FEWEST or np.diff(times).max() > _LARGEST_GAP:
        raise UnseenError(FEW_FRAMES)
    at = times[0] + np.arange(int(np.ptp(times) * RATE + 1e-6) + 1) / RATE
    return at, make_interp_spline(times, course, k=3)(at)


def speed(times: FloatArray, course: FloatArray) -> float:
    """Computes the root mean square speed of a course (n, 2) by central differences over 2/`RATE`
    seconds [its unit per s].

    Raises:
        UnseenError: as `even`.
    """
    _, places = even(times, course)
    steps = (places[2:] - places[:-2]) * (RATE / 2)
    return float(np.sqrt(np.square(steps).sum(axis=1).mean()))


def spectrum(times: FloatArray, course: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Frequencies [Hz] of the band and power of a course (n, d) there, summed over its axes; a Hann
    window without the straight line through the course.

    Raises:
        UnseenError: as `even`.
    """
    at, places = even(times, course)
    transform = fourier_transform(at, places)
    frequency = np.asarray(np.fft.rfftfreq(len(at), 1 / RATE), np.float64)
    band = (frequency >= LOWEST - 1e-9) & (frequency <= HIGHEST)
    return frequency[band], np.square(np.abs(transform[band])).sum(axis=1)


def fourier_transform(at: FloatArray, places: FloatArray) -> NDArray[np.complex128]:
    """Computes the Fourier transform (f, d) of a course (n, d) at even instants less its straight
    line, under a Hann window."""
    line = np.polynomial.polynomial.polyvander(at - at.mean(), 1)
    residual = places - line @ np.linalg.lstsq(line, places, rcond=None)[0]
    return np.fft.rfft(residual * np.hanning(len(at) + 2)[1:-1, None], axis=0)
