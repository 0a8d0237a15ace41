"""An anemometer as a chain of the library's sensor effects, each with one strength, and its
clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from sim.effects import SENSOR_EFFECTS, AnemometerEffect, Parameter

CLOCK = "clock-offset"
ORDER = (
    "anemometer-lag",
    "overspeeding",
    "anemometer-gain",
    "anemometer-dead-zone",
    "anemometer-offset",
)
"""As the wind passes them: what turns follows late and not below its threshold, then an amplifier
has a wrong zero."""


@dataclass(frozen=True, kw_only=True)
class Chain:
    """What acts on an anemometer's reading.

    Attributes:
        strengths: name of an effect → its strength, in the effect's unit. The one of the clock is
            what the log's clock is ahead of the table's [s].

    Raises:
        InputError: an effect that is neither a clock's offset nor one of `ORDER`.
    """

    strengths: Mapping[str, float]

    def __post_init__(self) -> None:
        if unknown := [name for name in self.strengths if name not in (CLOCK, *ORDER)]:
            raise InputError(
                f"{', '.join(unknown)} acts on no reading",
                where="anemometer",
                fix=f"name of {', '.join((CLOCK, *ORDER))}",
            )

    @property
    def clock(self) -> float:
        """What the log's clock is ahead of the table's [s]."""
        return self.strengths.get(CLOCK, 0.0)

    def read(self, times: FloatArray, wind: FloatArray) -> FloatArray:
        """(n,) readings of a wind (n,) [m/s] at ascending times (n,) [s], the clock aside."""
        reading = torch.from_numpy(wind.copy())[:, None]
        time = torch.from_numpy(times.copy())
        for name in ORDER:
            if name in self.strengths:
                reading = _made(name, self.strengths[name]).read(time, reading)
        return reading[:, 0].numpy()


def about(name: str) -> Parameter:
    """Of an effect's one strength: its unit, null value and prior."""
    kind = SENSOR_EFFECTS[name]
    (strength,) = kind.strengths()
    return kind.parameters()[strength]


def _made(name: str, value: float) -> AnemometerEffect:
    kind = SENSOR_EFFECTS[name]
    (strength,) = kind.strengths()
    return kind(**{strength: value})
