"""Parts of a film in which the picture's edge cuts the flag off: left out, where enough is left without them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flagdata.findings import Finding, Severity
from models.conditioning import Conditioning
from models.conditioning.whole import CUT, SIDES

_ENOUGH = 1.5
"""Time [s] with the whole flag, in one piece, that a film must have for the rest to be left out: more than a window."""
_REPORTED = 0.05
"""Share of the film in which the flag is cut off, from which on it is reported."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CutOff:
    """When the flag is cut off.

    Attributes:
        times: (n,) of a sample of the film's frames [s].
        cut: (n, 4) whether the edge on each of `SIDES` cuts the flag off.
    """

    times: NDArray[np.float64]
    cut: NDArray[np.bool_]

    @classmethod
    def of(cls, found: Conditioning, times: NDArray[np.float64]) -> CutOff:
        """By what was found in the sample of frames of these times."""
        return cls(times=times, cut=found.cut > CUT)

    @cached_property
    def any(self) -> NDArray[np.bool_]:
        """(n,) whether any edge does."""
        return np.asarray(self.cut.any(axis=1), dtype=np.bool_)

    @cached_property
    def partly(self) -> bool:
        """Whether the film is cut off in a part and whole for long enough in another."""
        return bool(self.any.any()) and self._longest >= _ENOUGH

    @property
    def _longest(self) -> float:
        """Longest time between two frames that are cut off [s]."""
        ends = self.times[self.any]
        edges = np.concatenate([self.times[:1], ends, self.times[-1:]])
        return float(np.diff(edges).max())

    def left_out(self, time: float) -> bool:
        """Whether the frame of a time [s] is: beside a frame of the sample that is cut off."""
        if not self.partly:
            return False
        after = int(np.searchsorted(self.times, time))
        return bool(self.any[max(after - 1, 0) : after + 1].any())

    def findings(self) -> tuple[Finding, ...]:
        """One where the flag is cut off."""
        share = float(self.any.mean())
        if not share or (share < _REPORTED and not self.partly):
            return ()
        where = ", ".join(
            f"the {side} edge in {own:.0%}" for side, own in zip(SIDES, self.cut.mean(axis=0), strict=True) if own > 0
        )
        done = "; those are left out" if self.partly else ""
        return (
            Finding(
                kind="flag-cut-off",
                severity=Severity.WARNING,
                value=share,
                what=f"the flag reaches beyond the picture at {where} of the film's frames{done}",
                fix="film so that the whole flag is in the picture",
            ),
        )
