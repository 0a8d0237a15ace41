"""Which effects of the library are weighed on a film, and how strong they may be."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from flagdata.tables import Range, Scale
from measure.calibrate.prior import Uncertain
from measure.calibrate.simulation import Flag
from measure.forecasting.strengths import Strengths, all_strengths

_HOIST = "full-hoist.stiffness"


@dataclass(frozen=True, kw_only=True)
class Weighable(Strengths):
    """An effect with the prior of its strength."""

    @cached_property
    def prior(self) -> Uncertain:
        """Of the strength beyond its null value."""
        scale = Scale.LOG if self.low > 0 else Scale.LINEAR
        return Uncertain(
            name=self.name,
            unit=self.column.unit,
            prior=Range(low=self.low, high=self.high, scale=scale),
            source="from what a minute of film hardly shows to beyond what is expected in the field",
        )


def weighable(flag: Flag) -> tuple[Weighable, ...]:
    """The effects that are weighed for a flag: one that is held along its hoist cannot be held more."""
    return tuple(
        Weighable(column=one.column, low=one.low, high=one.high)
        for one in all_strengths()
        if flag.attachment == "corners" or one.name != _HOIST
    )
