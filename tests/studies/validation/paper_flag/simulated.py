"""What the strip does in time over loads and speeds: frequency, wave speed and amplitude, read off
as from a clip."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from flagdata.core.arrays import AnyArray, FloatArray
from flagdata.errors import InputError
from tests.studies.validation.paper_flag import limit_cycle
from tests.studies.validation.paper_flag import waves as waves_module
from tests.studies.validation.paper_flag.cached import cached
from tests.studies.validation.paper_flag.candidates import Load, effects
from tests.studies.validation.paper_flag.evidence import Condition, Kind, LinearTable
from tests.studies.validation.paper_flag.limit_cycle import StripMotion, as_columns, simulate
from tests.studies.validation.paper_flag.recipe import Case
from tests.studies.validation.paper_flag.waves import waves

_COLUMNS = 110
_STILL = 0.01  # lengths: a tip that moves less does not flutter
_BATCH = 60
_FIELDS = ("frequency", "wave", "amplitude", "tip", "periodic")
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
    nothing = Flutter(
        frequency=math.nan, wave=math.nan, amplitude=math.nan, tip=travel, periodic=False
    )
    if not (math.isfinite(travel) and travel > _STILL):
        return nothing
    columns = np.linspace(0.04, 1.0, _COLUMNS) * length
    try:
        found = waves(motion.time, columns, as_columns(motion, member, columns), band=(3.0, 45.0))
    except InputError:  # too few cycles in the time kept, or folded over for most of it
        return nothing
    return Flutter(
        frequency=found.frequency.value,
        wave=found.speed.value,
        amplitude=found.amplitude.value / length,
        tip=travel,
        periodic=found.explained >= _PERIODIC,
    )


def flutters(
    loads: Sequence[Load], speeds: Sequence[float], *, case: Case, keep: Path | None
) -> list[Flutter]:
    """One member a pair of load and speed at the sheet [m/s], in batches.

    Args:
        keep: folder of intermediate results; None keeps none.
    """
    return [
        one
        for start in range(0, len(loads), _BATCH)
        for one in _batch(loads[start : start + _BATCH], speeds[start : start + _BATCH], case, keep)
    ]


def _batch(
    loads: Sequence[Load], speeds: Sequence[float], case: Case, keep: Path | None
) -> list[Flutter]:
    def make() -> dict[str, AnyArray]:
        motion = simulate(
            length=case.sheet.length,
            mass=case.sheet.mass,
            rigidity=case.sheet.rigidity,
            density=case.density,
            speeds=speeds,
            effects=effects(loads, length=case.sheet.length, density=case.density),
            run=case.run,
        )
        found = [observed(motion, member) for member in range(len(loads))]
        return {name: np.array([getattr(one, name) for one in found]) for name in _FIELDS}

    inputs = {
        "loads": [asdict(load) for load in loads],
        "speeds": list(speeds),
        "sheet": asdict(case.sheet),
        "density": case.density,
        "run": asdict(case.run),
    }
    arrays = cached(keep, inputs, (limit_cycle, waves_module, sys.modules[__name__]), make)
    return [
        Flutter(
            frequency=float(arrays["frequency"][i]),
            wave=float(arrays["wave"][i]),
            amplitude=float(arrays["amplitude"][i]),
            tip=float(arrays["tip"][i]),
            periodic=bool(arrays["periodic"][i]),
        )
        for i in range(len(loads))
    ]


class SimulatedTable:
    """A candidate over loads and speeds at the sheet; its stop speeds are those of linear
    stability.

    Args:
        table: (load, speed) of what was simulated, loads and speeds rising.
    """

    def __init__(
        self,
        loads: Sequence[Load],
        speeds: Sequence[float],
        table: Sequence[Sequence[Flutter]],
        linear: LinearTable,
    ) -> None:
        self.loads = tuple(loads)
        self.speeds = np.array(speeds)
        self.table = table
        self._linear = linear
        parts = {Kind.FREQUENCY: "frequency", Kind.WAVE: "wave", Kind.AMPLITUDE: "amplitude"}
        self._values = {
            kind: np.array(
                [[getattr(one, name) if one.periodic else math.nan for one in row] for row in table]
            )
            for kind, name in parts.items()
        }

    def predict(self, load: int, factors: FloatArray, condition: Condition) -> FloatArray:
        """As `Predictor.predict`; linear between the speeds simulated, NaN beyond them and next to
        no flutter."""
        if condition.kind is Kind.STOP:
            return self._linear.predict(load, factors, condition)
        return self.curve(condition.kind, load, factors * condition.at)

    def curve(self, kind: Kind, load: int, speeds: FloatArray) -> FloatArray:
        """(speed,) of one load, at speeds at the sheet [m/s]."""
        return np.interp(
            speeds, self.speeds, self._values[kind][load], left=math.nan, right=math.nan
        )
