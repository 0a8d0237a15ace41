"""Which effects of the library are weighed on a film, and how strong they may be.

The strengths are a prior: log-uniform where an effect has one sign, from what a minute of film hardly shows to beyond
what is expected in the field; uniform where it has two. They were fixed before any verdict on a film was made,
that of `finite-span-loading` later, from its prior, before any was made with it.
Not weighed: a wind that is turned from its log, which a film cannot separate from the view's azimuth; internal damping,
which is calibrated; gusts, since turbulence beyond the log is drawn for all simulations.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from flagdata.tables import Range, Scale
from measure.calibrate.prior import Uncertain
from measure.calibrate.simulation import Flag
from measure.forecasting.regressors import EffectColumn, library


@dataclass(frozen=True, kw_only=True)
class Weighable:
    """An effect with the strengths that it may have.

    Attributes:
        column: which strength of which effect.
        low, high: of the strength beyond its null value, in its unit.
    """

    column: EffectColumn
    low: float
    high: float

    @property
    def name(self) -> str:
        """effect.parameter."""
        return self.column.name

    @cached_property
    def prior(self) -> Uncertain:
        """Of the strength beyond its null value."""
        scale = Scale.LOG if self.low > 0 else Scale.LINEAR
        return Uncertain(
            name=self.name, unit=self.column.unit, prior=Range(low=self.low, high=self.high, scale=scale),
            source="from what a minute of film hardly shows to beyond what is expected in the field",
        )  # fmt: skip


_RANGES: dict[str, tuple[float, float]] = {
    "power-law-drag.exponent": (-0.5, 0.8),
    "tangential-linear-drag.coefficient": (0.03, 1.5),
    "tangential-quadratic-drag.coefficient": (0.006, 0.3),
    "lift.coefficient": (0.3, 8.0),
    "added-mass.mass": (0.03, 0.6),
    "reactive-loading.mass": (0.03, 0.6),
    "air-density.change": (-0.4, 0.8),
    "permeability.permeability": (1e-3, 5e-2),
    "hem-mass.line_density": (4e-3, 8e-2),
    "hem-stiffness.ratio": (3.0, 60.0),
    "vertical-wind.inclination": (-0.4, 0.4),
    "shear.exponent": (-0.3, 0.8),
    "pole-wake.share": (0.2, 1.5),
    "hysteresis.couple": (5e-5, 2e-3),
    "rest-curvature.curvature": (-6.0, 6.0),
    "full-hoist.stiffness": (30.0, 2e4),
    "tilted-pole.lean": (-0.4, 0.6),
    "tilted-pole.sway": (-0.25, 0.25),
    "wet-mass.uptake": (0.05, 1.0),
    "slack.length": (0.01, 0.15),
    "finite-span-loading.share": (0.05, 1.2),
}
_SLACK = EffectColumn(effect="slack", parameter="length", step=0.02)
_HOIST = "full-hoist.stiffness"


def weighable(flag: Flag) -> tuple[Weighable, ...]:
    """The effects that are weighed for a flag: one that is held along its hoist cannot be held more."""
    columns = {column.name: column for column in (*library(), _SLACK)}
    return tuple(
        Weighable(column=columns[name], low=low, high=high)
        for name, (low, high) in _RANGES.items()
        if flag.attachment == "corners" or name != _HOIST
    )
