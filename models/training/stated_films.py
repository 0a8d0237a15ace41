"""What the catalog states of films, compared with what a network takes before any of them is
decoded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.dataset.pairs import Pairs
from flagdata.errors import InputError
from flagdata.lake import Lake
from flagdata.timebase import NANOSECONDS
from models.maps.crops import Cropping
from models.maps.frontend import FrontEnd
from models.training.timed_film import LEAST_RATE, frame_rate, gives_clip, has_rate

LEAST_FRAMES = 4
"""Least frames of a clip that a front end takes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class StatedFilms:
    """Films, as the catalog describes them.

    Attributes:
        recordings: (n,) their artifacts.
        count: (n,) of their frames.
        seconds: (n,) from the first frame to the last.
    """

    recordings: Sequence[str]
    count: IntArray
    seconds: FloatArray

    @classmethod
    def of(cls, lake: Lake, *sides: Pairs, at: str | None) -> Self:
        """Reads the rows of the films that the pairs of some sides are of."""
        recordings = {recording for pairs in sides for recording in pairs.table.recording.tolist()}
        columns = ["artifact", "frame_count", "start", "end"]
        rows = lake.rows({"artifact": recordings}, at=at, columns=columns).drop_null()
        return cls(
            recordings=rows["artifact"].to_pylist(),
            count=rows["frame_count"].to_numpy().astype(np.int64),
            seconds=(rows["end"].to_numpy() - rows["start"].to_numpy()) / NANOSECONDS,
        )

    @property
    def rate(self) -> FloatArray:
        """Frame rates (n,) [Hz]."""
        return frame_rate(self.count, self.seconds)

    def check_judged(self, front_end: FrontEnd, cropping: Cropping, *, model: str) -> None:
        """Checks that a clip as the model takes it can be cut out of every film.

        Raises:
            InputError: some are too short or too slow.
        """
        frames, rate = front_end.frames, front_end.rate
        self._refuse(
            ~self._gives(front_end, cropping),
            f"cannot give clips of {frames} frames at {rate:g} Hz, which the model {model!r} takes",
            fix="leave the model out, or judge it on a data set whose films have "
            f"{(frames - 1) / rate:.3g} s or more, of {LEAST_RATE * rate:.3g} Hz or more",
        )

    def check_learned(self, front_end: FrontEnd, cropping: Cropping) -> None:
        """Checks that a recipe's clips can be cut out of every film: of its length, and of its
        rate, which only conditioned films may miss.

        Raises:
            InputError: not of some; the fix is a line of the recipe.
        """
        frames, rate = front_end.frames, front_end.rate
        if not len(self.count):
            return
        slowest, fastest = float(self.rate.min()), float(self.rate.max())
        if cropping.conditioned:
            self._refuse(
                self.rate < LEAST_RATE * rate,
                f"are too slow for the recipe's {rate:g} Hz",
                fix=f"write rate = {slowest:.4g} in [input]",
            )
            most = int(float(self.seconds.min()) * rate + 1e-6) + 1
        else:
            self._refuse(
                ~has_rate(self.count, self.seconds, rate),
                f"have another rate than the recipe's {rate:g} Hz",
                fix=f"write rate = {slowest:.4g} in [input]"
                if has_rate(self.count, self.seconds, slowest).all()
                else "write conditioned = true in [input], which shows films of any rate, here "
                f"{slowest:.4g} to "
                f"{fastest:.4g} Hz, at the network's",
            )
            most = int(self.count.min())
        self._refuse(
            ~self._gives(front_end, cropping),
            f"are shorter than the recipe's clips of {frames} frames at {rate:g} Hz",
            fix=f"write frames = {most} in [input]"
            if most >= LEAST_FRAMES
            else f"learn from films of {LEAST_FRAMES} frames or more",
        )

    def _gives(self, front_end: FrontEnd, cropping: Cropping) -> BoolArray:
        gives = gives_clip(self.count, self.seconds, frames=front_end.frames, rate=front_end.rate)
        if cropping.conditioned:
            return gives
        own_rate = has_rate(self.count, self.seconds, front_end.rate)
        return np.where(own_rate, self.count >= front_end.frames, gives)

    def _refuse(self, wrong: BoolArray, what: str, *, fix: str) -> None:
        if wrong.any():
            first = int(np.flatnonzero(wrong)[0])
            raise InputError(
                f"{int(wrong.sum())} of {len(wrong)} films {what}; the first has "
                f"{self.count[first]} frames at "
                f"{self.rate[first]:.4g} Hz",
                where=f"recording {self.recordings[first]}",
                fix=fix,
            )
