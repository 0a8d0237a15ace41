"""A sensor's noise, given back to pictures whose coding left none.

A coder does not code what stands still: from one key frame to the next a background then does not
change by a gray level. In all films that networks are trained on some noise is left, or a key frame
comes every second, so that most places change once in a clip at least. A clip most of which never
changes is read as one of a faster wind, by a quarter or a third (docs/models.md). Noise in those
places, less than is left in the clips of the training, undoes that. Clips most of which change stay
as they are.
"""

from __future__ import annotations

import numpy as np

from flagdata.core.arrays import UInt8Array
from flagdata.core.rng import stream

STILL = 0.5
"""Share of a clip's places that never change above which noise is given back: films of the
training's cameras have 0.01 to 0.45."""
DEVIATION = 0.5
"""Of that noise [gray levels], the median over places of what films of the training's cameras have
in time."""


def add_grain(clip: UInt8Array, *, seed: int) -> UInt8Array:
    """Adds noise to a clip (n, height, width) gray where it never changes, if that is most of it;
    else returns the clip itself. else the clip itself. What is black all the time lies beyond the
    picture, and neither counts nor changes.
    """
    greatest = clip.max(axis=0)
    lit, still = greatest > 0, greatest == clip.min(axis=0)
    share = np.count_nonzero(still & lit) / max(np.count_nonzero(lit), 1)
    if not STILL < share < 1:  # where nothing at all moves there is nothing to read
        return clip
    noise = DEVIATION * stream(seed, "grain").standard_normal(clip.shape, dtype=np.float32)
    return np.clip(np.rint(clip + noise * (still & lit)), 0, 255).astype(np.uint8)
