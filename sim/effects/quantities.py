"""Parameters that several effects share."""

from __future__ import annotations

from typing import Annotated, TypeAlias

from sim.effects.parameter import NOT_NEGATIVE, Value, shape

AIR_DENSITY = 1.225
"""[kg/m³] at 288.15 K and 1013.25 hPa: U.S. Standard Atmosphere 1976, table 1."""

AirDensity: TypeAlias = Annotated[
    Value,
    shape(
        unit="kg/m³",
        prior=(1.0, 1.4),
        admissible=NOT_NEGATIVE,
        source="dry air, sea level to 2,000 m, −20 to 40 °C; U.S. Standard Atmosphere 1976",
    ),
]
