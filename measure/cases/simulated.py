"""What the strip does in time over loads and speeds: frequency, wave speed and amplitude, read off as from a clip."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from measure.cases.candidates import Load, effects
from measure.cases.evidence import Condition, Kind, LinearTable
from measure.cases.limit_cycle import StripMotion, StripRun, as_columns, simulate
from measure.cases.sheet import Sheet
from measure.cases.waves import waves

_COLUMNS = 110
_STILL = 0.01  # lengths: a tip that moves less does not flutter
_PERIODIC = 0.9  # share of the variance that a periodic model explains


@dataclass(frozen=True, kw_only=True)
class Flutter:
    """One member.

    Attributes:
        frequency: [Hz]; NaN where it does not flutter, or its simulation diverged.
        wave: speed [m/s].
        amplitude: largest first harmonic over the length.
        tip: half the tip's travel over the length; NaN where the simulation diverged.
        periodic: whether one periodic motion explains it.
    """

    frequency: float
    wave: float
    amplitude: float
    tip: float
    periodic: bool


def observed(motion: StripMotion, member: int) -> Flutter:
    """Reads a member off as `waves` reads a clip, from columns fixed in space."""
    length = float(motion.arc[-1])
    tip = motion.across[:, -1, member]
    travel = float(np.ptp(tip)) / 2 / length
    nothing = Flutter(frequency=math.nan, wave=math.nan, amplitude=math.nan, tip=travel, periodic=False)
    if not (math.isfinite(travel) and travel > _STILL):
        return nothing
    columns = np.linspace(0.04, 1.0, _COLUMNS) * length
    try:
        found = waves(motion.time, columns, as_columns(motion, member, columns), band=(3.0, 60.0))
    except InputError:  # too few cycles in the time kept, or folded over for most of it
        return nothing
    return Flutter(
        frequency=found.frequency.value, wave=found.speed.value, amplitude=found.amplitude.value / length, tip=travel,
        periodic=found.explained >= _PERIODIC,
    )  # fmt: skip


def flutters(
    loads: Sequence[Load],
    speeds: Sequence[float],
    *,
    bare: Sheet,
    density: float,
    run: StripRun,
    advance: Callable[[int], None] = lambda _: None,
) -> list[Flutter]:
    """One member a pair of load and speed at the sheet [m/s], in one batch."""
    motion = simulate(
        length=bare.length, mass=bare.mass, rigidity=bare.rigidity, density=density, speeds=speeds,
        effects=effects(loads, length=bare.length, density=density), run=run, advance=advance,
    )  # fmt: skip
    return [observed(motion, member) for member in range(len(loads))]


class SimulatedTable:
    """A candidate over loads and speeds at the sheet; its stop speeds are those of linear stability.

    Args:
        table: (load, speed) of what was simulated, loads and speeds rising.
    """

    def __init__(
        self, loads: Sequence[Load], speeds: Sequence[float], table: Sequence[Sequence[Flutter]], linear: LinearTable
    ) -> None:
        self.loads = tuple(loads)
        self.speeds = np.array(speeds)
        self.table = table
        self._linear = linear
        parts = {Kind.FREQUENCY: "frequency", Kind.WAVE: "wave", Kind.AMPLITUDE: "amplitude"}
        self._values = {
            kind: np.array([[getattr(one, name) if one.periodic else math.nan for one in row] for row in table])
            for kind, name in parts.items()
        }

    def predict(self, load: int, factor: float, condition: Condition) -> float:
        """As `Predictor.predict`; linear between the speeds simulated, NaN beyond them and next to no flutter."""
        if condition.kind is Kind.STOP:
            return self._linear.predict(load, factor, condition)
        return float(self.curve(condition.kind, load, np.array([factor * condition.at]))[0])

    def curve(self, kind: Kind, load: int, speeds: NDArray[np.float64]) -> NDArray[np.float64]:
        """(speed,) of one load, at speeds at the sheet [m/s]."""
        return np.interp(speeds, self.speeds, self._values[kind][load], left=math.nan, right=math.nan)
