"""Clock models: how one device's clock reads on another's, with its uncertainty."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import InputError
from flagdata.timebase import NANOSECONDS

NINETY = 1.6448536269514722
"""Half the width of the two-sided 90 % interval of a normal distribution [σ]."""


@dataclass(frozen=True, kw_only=True)
class Segment:
    """A stretch of one device's clock without jumps: `common = device + offset + drift · (device -
    origin)`.

    Attributes:
        start, end: bounds on the device's clock [UTC ns], end exclusive.
        origin: instant on the device's clock at which `offset` holds [UTC ns]; where offset and
            drift are uncorrelated.
        offset: [s], added to the device's clock.
        drift: [s/s].
        sigma_offset, sigma_drift: standard uncertainties at `origin`.
    """

    start: int
    end: int
    origin: int
    offset: float
    drift: float = 0.0
    sigma_offset: float = 0.0
    sigma_drift: float = 0.0

    def __post_init__(self) -> None:
        numbers = (self.offset, self.drift, self.sigma_offset, self.sigma_drift)
        if not all(np.isfinite(numbers)):
            raise InputError(
                f"clock segment with numbers that are not finite: {numbers}", fix="estimate it anew"
            )
        if self.end <= self.start:
            raise InputError("clock segment ends before it starts", fix="give end > start")
        if self.sigma_offset < 0 or self.sigma_drift < 0:
            raise InputError("the uncertainty of a clock segment is negative", fix="give σ ≥ 0")
        if abs(self.drift) >= 0.1:
            raise InputError(
                f"a clock drift of {self.drift} s/s is too large to be one",
                fix="check the time units",
            )


@dataclass(frozen=True, kw_only=True)
class ClockModel:
    """A device's clock on the common clock, by segments in order.

    Attributes:
        device: name of the device whose clock this is.
        reference: name of the clock it is expressed on.
        method: "stamps", "given", "estimated" (from motion) or "paired" (from two stamps of each
            sample).
        confidence: probability that an estimated offset is neither an accident nor another peak's,
            0 to 1; its σ is given that. 1 for offsets that someone states.
    """

    device: str
    reference: str
    method: str
    confidence: float
    segments: tuple[Segment, ...]

    def __post_init__(self) -> None:
        if not self.segments:
            raise InputError("a clock model needs a segment", fix="give at least one")
        for before, after in zip(self.segments, self.segments[1:], strict=False):
            if after.start < before.end:
                raise InputError(
                    "clock segments overlap", fix="give them in order, each ending before the next"
                )

    def _segment(self, time: IntArray) -> IntArray:
        starts = np.array([s.start for s in self.segments[1:]], dtype=np.int64)
        return np.searchsorted(starts, time, side="right")

    def to_common(self, time: ArrayLike) -> IntArray:
        """Instants of the device's clock on the common clock; int64 ns in and out, any shape.

        Times outside all segments use the nearest one.
        """
        device = np.asarray(time, dtype=np.int64)
        index = self._segment(device)
        origin = np.array([s.origin for s in self.segments], dtype=np.int64)[index]
        offset = np.array([round(s.offset * NANOSECONDS) for s in self.segments], dtype=np.int64)[
            index
        ]
        drift = np.array([s.drift for s in self.segments])[index]
        return device + offset + np.round((device - origin) * drift).astype(np.int64)

    def sigma(self, time: ArrayLike) -> FloatArray:
        """Computes the standard uncertainty [s] of `to_common` at instants of the device's
        clock."""
        device = np.asarray(time, dtype=np.int64)
        index = self._segment(device)
        origin = np.array([s.origin for s in self.segments], dtype=np.int64)[index]
        base = np.array([s.sigma_offset for s in self.segments])[index]
        slope = np.array([s.sigma_drift for s in self.segments])[index]
        return np.hypot(base, slope * (device - origin) / NANOSECONDS)

    def to_json(self) -> str:
        return json.dumps(
            {
                "device": self.device,
                "reference": self.reference,
                "method": self.method,
                "confidence": self.confidence,
                "segments": [vars(s) for s in self.segments],
            },
            sort_keys=True,
        )

    @classmethod
    def from_json(cls, text: str) -> ClockModel:
        data = json.loads(text)
        segments = tuple(Segment(**s) for s in data.pop("segments"))
        return cls(segments=segments, **data)

    @classmethod
    def identity(
        cls, device: str, reference: str, *, start: int, end: int, sigma: float
    ) -> ClockModel:
        """Declares both clocks the same, by their time stamps, to within `sigma` [s]."""
        segment = Segment(
            start=start, end=end, origin=(start + end) // 2, offset=0.0, sigma_offset=sigma
        )
        return cls(
            device=device, reference=reference, method="stamps", confidence=1.0, segments=(segment,)
        )
