"""A film as pictures with their times, and clips of it at the instants that a network takes."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from flagdata.core.arrays import AnyArray, BoolArray, FloatArray, IntArray, UInt8Array
from flagdata.errors import InputError
from models.conditioning.frame_interpolation import Interpolator, TimedFrame, at_instants

LEAST_RATE = 0.8
"""Least frame rate of a film, in those of the network: most of its pictures must have been
taken."""
SAME_RATE = 0.01
"""Share by which a film's rate may differ from the network's, so that its frames are taken as they
are."""
_BEYOND = 0.05
"""Share of the time between two frames by which a clip may end beyond its film."""


def frame_rate(count: AnyArray | int, seconds: AnyArray | float) -> FloatArray:
    """Computes the frame rates [Hz] of films from their numbers of frames, and the time from the
    first to the last."""
    return (np.asarray(count, dtype=np.float64) - 1) / np.maximum(seconds, 1e-9)


def has_rate(count: AnyArray | int, seconds: AnyArray | float, rate: float) -> BoolArray:
    """Returns whether films of so many frames in that time have a rate [Hz], within `SAME_RATE`."""
    return np.abs(frame_rate(count, seconds) / rate - 1) <= SAME_RATE


def gives_clip(
    count: AnyArray | int, seconds: AnyArray | float, *, frames: int, rate: float
) -> BoolArray:
    """Returns whether films of so many frames in that time give a clip of `frames` at `rate`
    [Hz]."""
    own = frame_rate(count, seconds)
    return (own >= LEAST_RATE * rate) & (
        (frames - 1) / rate <= seconds + _BEYOND / np.maximum(own, 1e-9)
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class TimedFilm:
    """A film.

    Attributes:
        frames: (n, height, width) gray.
        times: (n,) of them, from the first [s].
    """

    frames: UInt8Array
    times: FloatArray
    _interpolator: Interpolator = field(default_factory=lambda: Interpolator(capacity=1000))

    @cached_property
    def _timed_frames(self) -> list[TimedFrame]:
        return list(zip(self.times.tolist(), self.frames, strict=True))

    def starts(self, count: int, rate: float) -> IntArray:
        """Returns the frames on which clips of `count` frames at `rate` [Hz] may begin.

        Raises:
            InputError: the film is shorter than one, or slower than `LEAST_RATE` of the rate.
        """
        left = self.times[-1] - self.times
        film_rate = float(frame_rate(len(self.times), float(left[0])))
        fits = np.flatnonzero((count - 1) / rate <= left + _BEYOND / max(film_rate, 1e-9))
        if film_rate < LEAST_RATE * rate or not len(fits):
            raise InputError(
                f"the film of {len(self.times)} frames at {film_rate:.4g} Hz cannot give "
                f"clips of {count} at {rate:g} Hz",
                fix=f"give {(count - 1) / rate:.3g} s or more, of {LEAST_RATE * rate:.3g} Hz or "
                "more",
            )
        return fits

    def whole(self, rate: float) -> UInt8Array:
        """Resamples all of the film at `rate` [Hz]: (m, height, width).

        Raises:
            InputError: the film is slower than `LEAST_RATE` of the rate.
        """
        self.starts(1, rate)
        return self.clip(0, int(self.times[-1] * rate + 1e-6) + 1, rate)[0]

    def clip(self, first: int, count: int, rate: float) -> tuple[UInt8Array, FloatArray]:
        """Resamples (count, height, width) pictures at `rate` [Hz] from a frame on, and returns
        their times [s]."""
        instants = self.times[first] + np.arange(count) / rate
        period = float(np.median(np.diff(self.times)))
        return at_instants(
            self._timed_frames, instants, period=period, interpolator=self._interpolator
        )[0], instants

    def clip_near(self, first: int, count: int, rate: float) -> UInt8Array:
        """Resamples a clip, as `clip`, from a frame on or from as early as the film has to be
        entered for its length.

        Raises:
            InputError: as `starts`.
        """
        return self.clip(min(first, int(self.starts(count, rate)[-1])), count, rate)[0]
