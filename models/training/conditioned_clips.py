"""Films as `flagdata measure` judges them: conditioned, and shown at the network's instants.

A training film has its flag in the middle, since that is where its camera aims. Where something
else moves more like cloth, the region nearest to the middle is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import Float32Array, FloatArray, UInt8Array
from models.conditioning import Conditioning, Follower, conditioning_of
from models.training.timed_film import TimedFilm

SIZE = 300
"""Side of conditioned pictures [px]."""
SAMPLE = 32
"""Frames of a film in which camera and cloth are sought: a training film is two seconds long."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FitFilm(TimedFilm):
    """A conditioned film: its frames are (n, size, size).

    Attributes:
        found: what was found in it.
    """

    found: Conditioning

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
            found=conditioning,
            frames=np.stack([follower.show(frame) for frame in film]),
            times=times - times[0],
        )

    @property
    def weight(self) -> Float32Array:
        """(size, size) 1 on the cloth, 0 where the film is frozen."""
        return self.found.weight


def _nearest_to_the_middle(conditioning: Conditioning) -> int:
    """Chooses the region nearest to the picture's middle; the chosen one's index where nothing
    moves."""
    if len(conditioning.regions) < 2:
        return conditioning.chosen
    boxes = np.array([region.box for region in conditioning.regions], dtype=np.float64)
    middle = np.array(conditioning.regions[0].mask.shape[::-1]) / 2
    return int(np.linalg.norm((boxes[:, :2] + boxes[:, 2:]) / 2 - middle, axis=1).argmin())
