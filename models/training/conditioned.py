"""Films as `flagdata measure` judges them: conditioned, and shown at the network's instants.

A training film has its flag in the middle, since that is where its camera aims. Where something else moves more like
cloth, the region nearest to the middle is taken.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from flagdata.arrays import Float32Array, FloatArray, IntArray, UInt8Array
from flagdata.errors import InputError
from models.conditioning import Conditioning, Follower, conditioning_of
from models.conditioning.instants import Interpolator, TimedFrame, at_instants

SIZE = 300
"""Side of conditioned pictures [px]."""
SAMPLE = 32
"""Frames of a film in which camera and cloth are sought: a training film is two seconds long."""
LEAST_RATE = 0.8
"""Least frame rate of a film, in those of the network: most of its pictures must have been taken."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FitFilm:
    """A conditioned film.

    Attributes:
        found: what was found in it.
        frames: (n, size, size) gray, conditioned.
        times: (n,) of them, from the first [s].
    """

    found: Conditioning
    frames: UInt8Array
    times: FloatArray
    _interpolator: Interpolator = field(default_factory=lambda: Interpolator(capacity=1000))

    @classmethod
    def of(cls, film: UInt8Array, times: FloatArray, *, size: int = SIZE) -> FitFilm:
        """Conditions a film (n, height, width) gray with the times of its frames [s]."""
        stride = -(-len(film) // SAMPLE)
        sample, instants = film[::stride], times[::stride]
        conditioning = conditioning_of(sample, times=instants, size=size)
        if (flag := _nearest_to_the_middle(conditioning)) != conditioning.chosen:
            conditioning = conditioning_of(sample, times=instants, size=size, flag=flag + 1)
        follower = Follower(conditioning)
        return cls(
            found=conditioning, frames=np.stack([follower.show(frame) for frame in film]), times=times - times[0]
        )

    @property
    def weight(self) -> Float32Array:
        """(size, size) 1 on the cloth, 0 where the film is frozen."""
        return self.found.weight

    @cached_property
    def _frames(self) -> list[TimedFrame]:
        return list(zip(self.times.tolist(), self.frames, strict=True))

    def starts(self, count: int, rate: float) -> IntArray:
        """Returns the frames on which clips of `count` frames at `rate` [Hz] may begin.

        Raises:
            InputError: the film is shorter than one, or slower than `LEAST_RATE` of the rate.
        """
        film_rate = (len(self.times) - 1) / max(float(self.times[-1]), 1e-9)
        fits = np.flatnonzero(self.times + (count - 1) / rate <= self.times[-1] + 0.05 / film_rate)
        if film_rate < LEAST_RATE * rate or not len(fits):
            raise InputError(
                f"the film of {len(self.times)} frames at {film_rate:.4g} Hz cannot give "
                f"clips of {count} at {rate:g} Hz",
                fix=f"give {(count - 1) / rate:.3g} s or more, of {LEAST_RATE * rate:.3g} Hz or more",
            )
        return fits

    def whole(self, rate: float) -> UInt8Array:
        """Resamples all of the film at `rate` [Hz]: (m, size, size).

        Raises:
            InputError: the film is slower than `LEAST_RATE` of the rate.
        """
        self.starts(1, rate)
        return self.clip(0, int(self.times[-1] * rate + 1e-6) + 1, rate)[0]

    def clip(self, first: int, count: int, rate: float) -> tuple[UInt8Array, FloatArray]:
        """Resamples (count, size, size) pictures at `rate` [Hz] from a frame on, and returns their times [s]."""
        instants = self.times[first] + np.arange(count) / rate
        period = float(np.median(np.diff(self.times)))
        return at_instants(self._frames, instants, period=period, interpolator=self._interpolator)[0], instants


def _nearest_to_the_middle(conditioning: Conditioning) -> int:
    """Chooses the region nearest to the picture's middle; the chosen one's index where nothing moves."""
    if len(conditioning.regions) < 2:
        return conditioning.chosen
    boxes = np.array([region.box for region in conditioning.regions], dtype=np.float64)
    middle = np.array(conditioning.regions[0].mask.shape[::-1]) / 2
    return int(np.linalg.norm((boxes[:, :2] + boxes[:, 2:]) / 2 - middle, axis=1).argmin())
