"""What a film shows all the time: of each place the usual value, and the least and the greatest
that it takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import UInt8Array

HALVED = 2
"""By how much pictures are averaged down before cloth is sought in them."""
SAMPLE = 120
"""Pictures at most that are looked at."""
_USUAL = 0.2
"""Share of a pixel's values that the usual one is of."""
_LEAST, _GREATEST = 0.03, 0.97


@dataclass(frozen=True, kw_only=True, eq=False)
class Stills:
    """Of pictures of one film in one light.

    Attributes:
        usual: (rows, columns) middle of the narrowest fifth of a pixel's values: what is behind,
            where it is bare for that long, and cloth where it never is.
        least, greatest: (rows, columns) 3 % and 97 % quantiles of them.
    """

    usual: UInt8Array
    least: UInt8Array
    greatest: UInt8Array

    @classmethod
    def of(cls, small: Sequence[NDArray[np.generic]] | NDArray[np.generic]) -> Stills:
        """Computes the usual, least and greatest picture from pictures (n, rows, columns), of which
        `SAMPLE` spread over all are taken."""
        ordered = np.sort(
            np.stack(
                [np.asarray(picture, np.float32) for picture in small[:: -(-len(small) // SAMPLE)]]
            ),
            axis=0,
        )
        window = min(max(1, int(_USUAL * len(ordered))), len(ordered) - 1)
        first = (ordered[window:] - ordered[: len(ordered) - window]).argmin(axis=0)[None]
        middle = np.take_along_axis(ordered, first + window // 2, axis=0)[0]
        low, high = np.quantile(ordered, (_LEAST, _GREATEST), axis=0)
        return cls(usual=_bytes(middle), least=_bytes(low), greatest=_bytes(high))


def halve_picture(picture: UInt8Array) -> UInt8Array:
    """Averages a picture down by `HALVED`."""
    size = (picture.shape[1] // HALVED, picture.shape[0] // HALVED)
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def _bytes(values: NDArray[np.generic]) -> UInt8Array:
    return np.rint(np.asarray(values, np.float32)).astype(np.uint8)
