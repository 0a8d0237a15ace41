"""Recordings cut into segments, which run side by side as members of a batch.

A segment starts some frames early, so that its state has forgotten how it was started.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.errors import InputError
from measure.trajectories.trajectory import Trajectory, WindTrack

HORIZON = 0.04
"""How far ahead a prediction reaches, about [s]: 25 frames a second, the paper's rate."""
_SEGMENT = 2.0  # s
_SHORTEST = 0.8  # s: a segment of recordings too short for two of the usual length
_WARM_UP = 0.24  # s: six frames at 25 a second; the observer forgets its start in two


@dataclass(frozen=True, kw_only=True)
class Cut:
    """How recordings are cut into segments.

    Attributes:
        stride: recorded frames from one that is used to the next.
        period: between those [s].
        warm: frames of warm-up at a segment's start. Two more precede the first frame that counts.
        length: how many count.
    """

    stride: int
    period: float
    warm: int
    length: int

    @classmethod
    def of(cls, rate: float, frames: int) -> Cut:
        """Chooses how recordings of so many frames or more are cut: frames about a horizon apart,
        segments of 2 s, or half of what there is.

        Args:
            rate: [Hz].
        """
        stride = max(1, round(rate * HORIZON))
        period = stride / rate
        warm = round(_WARM_UP / period)
        length = min(round(_SEGMENT / period), (math.ceil(frames / stride) - warm - 2) // 2)
        return cls(stride=stride, period=period, warm=warm, length=length)

    @property
    def enough(self) -> bool:
        """Whether a segment is long enough to say anything."""
        return self.length * self.period >= _SHORTEST

    def segments(self, frames: int) -> int:
        """Counts the segments that a recording holds; a remainder is left out."""
        return (math.ceil(frames / self.stride) - self.warm - 2) // self.length

    def lasting(self, segments: int) -> float:
        """Computes how long a recording is that holds so many segments [s]."""
        return (segments * self.length + self.warm + 3) * self.period


@dataclass(frozen=True, kw_only=True, eq=False)
class Segment:
    """A stretch of a recording.

    Attributes:
        recording: its index in the experiment.
        start: of the first frame, since the recording's first [s].
        positions: (frame, marker, 3), warm-up included [m].
        wind: of the recording.
        noise: standard deviation of a coordinate's noise [m].
        anchors: (held, 3) where its cloth is tied [m]; None where the specimen says it.
        seen: (frame, marker) whether each position was tracked; None where all were.
        attachments: (frame, held, 3) where its cloth is held, if that moves [m].
    """

    recording: int
    start: float
    positions: FloatArray
    wind: WindTrack
    noise: float
    anchors: FloatArray | None = None
    seen: BoolArray | None = None
    attachments: FloatArray | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Segments:
    """Segments of equal length of recordings with the same markers and rate.

    Attributes:
        items: the segments.
        markers: (marker, 2) [m].
        cut: how the recordings were cut.
    """

    items: tuple[Segment, ...]
    markers: FloatArray
    cut: Cut

    @classmethod
    def of(cls, recordings: Sequence[Trajectory]) -> Segments:
        """Cuts recordings into segments; frames are thinned to about 40 ms apart; a remainder too
        short for a segment is left out.

        Segments last 2 s, or half of what the shortest recording allows.

        Raises:
            InputError: recordings of different markers or rates, untracked points, or shorter than
                a segment.
        """
        first = recordings[0]
        cut = Cut.of(first.rate, min(len(r.positions) for r in recordings))
        period, span = cut.period, cut.warm + 2 + cut.length
        items: list[Segment] = []
        for index, recording in enumerate(recordings):
            if recording.rate != first.rate or not np.array_equal(recording.markers, first.markers):
                raise InputError(
                    "its markers or its rate differ from the first recording's",
                    where=f"recording {recording.name!r}",
                    fix="close the loop on such recordings one by one",
                )
            if np.isnan(recording.positions).any():
                raise InputError(
                    "a marker was lost in some frames",
                    where=f"recording {recording.name!r}",
                    fix="fill its gaps (measure.trajectories.fill)",
                )
            frames = recording.positions[:: cut.stride]
            tracked = None if recording.seen is None else recording.seen[:: cut.stride]
            attachments = (
                None if recording.attachments is None else recording.attachments[:: cut.stride]
            )
            if not cut.enough:
                needed = 2 * _SHORTEST + (cut.warm + 2) * period
                raise InputError(
                    f"{len(frames) * period:.2f} s is too short: at least {needed:.2f} s are "
                    "needed",
                    where=f"recording {recording.name!r}",
                    fix="record for 10 s or more",
                )
            for number in range(cut.segments(len(recording.positions))):
                begin = number * cut.length
                items.append(
                    Segment(
                        recording=index,
                        start=begin * period,
                        wind=recording.wind,
                        noise=recording.noise,
                        positions=frames[begin : begin + span],
                        seen=None if tracked is None else tracked[begin : begin + span],
                        attachments=None
                        if attachments is None
                        else attachments[begin : begin + span],
                        anchors=None if attachments is None else attachments[begin],
                    )
                )
        return cls(items=tuple(items), markers=first.markers, cut=cut)

    def tied(self, anchors: Sequence[FloatArray]) -> Segments:
        """Sets the anchors (held, 3) [m] of each segment to those of its recording, except of
        segments whose attachments move."""
        return replace(
            self,
            items=tuple(
                item
                if item.attachments is not None
                else replace(item, anchors=anchors[item.recording])
                for item in self.items
            ),
        )

    def select(self, indices: Iterable[int]) -> Segments:
        """Selects some of the segments."""
        return replace(self, items=tuple(self.items[i] for i in indices))

    @cached_property
    def recording(self) -> IntArray:
        """(segment,) index of each one's recording."""
        return np.array([item.recording for item in self.items])

    @cached_property
    def noise(self) -> FloatArray:
        """(segment,) standard deviation of a coordinate's noise [m]."""
        return np.array([item.noise for item in self.items])

    @cached_property
    def positions(self) -> FloatArray:
        """(frame, marker, 3, segment), warm-up included [m]."""
        return np.stack([item.positions for item in self.items], axis=-1)

    @cached_property
    def seen(self) -> BoolArray | None:
        """Returns whether each position was tracked, warm-up included, (frame, marker, segment);
        None where all were."""
        if all(item.seen is None for item in self.items):
            return None
        all_tracked = np.ones(self.items[0].positions.shape[:2], dtype=bool)
        return np.stack(
            [all_tracked if item.seen is None else item.seen for item in self.items], axis=-1
        )

    @cached_property
    def counted(self) -> BoolArray | None:
        """(frame, marker, segment) whether a prediction is compared, in the frames that count; None
        where all are.

        It is where the marker was tracked in that frame and in the two before, from which the model
        has its position and velocity. Where it was not, the prediction reaches back farther than
        one horizon, to before the gap.
        """
        if self.seen is None:
            return None
        first = self.first
        return self.seen[first:] & self.seen[first - 1 : -1] & self.seen[first - 2 : -2]

    @cached_property
    def tracked(self) -> FloatArray:
        """(segment,) share of the predictions that are compared."""
        return np.ones(len(self)) if self.counted is None else self.counted.mean(axis=(0, 1))

    @property
    def period(self) -> float:
        """Between the frames used [s]."""
        return self.cut.period

    @property
    def warm(self) -> int:
        """How many frames of each are warm-up."""
        return self.cut.warm

    @property
    def first(self) -> int:
        """The first frame of a segment that counts."""
        return self.warm + 2

    @property
    def duration(self) -> float:
        """Duration of what counts of a segment [s]."""
        return self.cut.length * self.period

    def __len__(self) -> int:
        return len(self.items)
