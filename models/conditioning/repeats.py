"""Frames that repeat the one before: a camera or a converter that ran slower than the file's rate.

A repeated frame differs from the one before by what the video's coding leaves, between changes that
do not. So a frame is a repetition where its mean change is below `SHARE` of the largest change of
the frames before it, and of that of the frames after it. A cloth that comes to rest does so over
many frames, and a film that stands still has no repetitions.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator

import numpy as np

from flagdata.core.arrays import UInt8Array
from models.conditioning.frame_interpolation import TimedFrame

SHARE = 0.15
"""Chosen on six real films: of those whose frames all differ none is below 0.2, and of one with 15
pictures in 60 frames two thirds are."""
_ABOUT = 4
"""Frames before and after whose changes are compared: up to three of four frames may be
repetitions."""


class Distinct:
    """The frames of a film without those that repeat the one before.

    Attributes:
        frames: that were read so far.
        repeated: of these, that repeat the one before.
    """

    def __init__(self, frames: Iterable[TimedFrame]) -> None:
        self._source = iter(frames)
        self.frames = 0
        self.repeated = 0

    @property
    def share(self) -> float:
        """Share of repetitions, 0 to 1."""
        return self.repeated / max(self.frames, 1)

    def __iter__(self) -> Iterator[TimedFrame]:
        waiting: deque[TimedFrame] = deque()
        changes: deque[float] = deque(
            maxlen=2 * _ABOUT + 1
        )  # of the frames about the first that waits
        last: UInt8Array | None = None
        for time, picture in self._source:
            change = (
                np.inf if last is None else float(np.abs(picture.astype(np.int16) - last).mean())
            )
            last = picture
            waiting.append((time, picture))
            changes.append(change)
            if len(waiting) > _ABOUT:
                yield from self._next(waiting, changes)
        while waiting:
            yield from self._next(waiting, changes)

    def _next(self, waiting: deque[TimedFrame], changes: deque[float]) -> Iterator[TimedFrame]:
        index = len(changes) - len(waiting)  # place of the first that waits
        finite = [
            0.0 if np.isinf(change) else change for change in changes
        ]  # the film's first frame has none
        before, after = (
            finite[max(0, index - _ABOUT) : index],
            finite[index + 1 : index + _ABOUT + 1],
        )
        self.frames += 1
        if changes[index] < SHARE * min(max(before, default=0.0), max(after, default=0.0)):
            self.repeated += 1
            waiting.popleft()
        else:
            yield waiting.popleft()
