"""A wind from elsewhere beside a film's: the number of a station, an app or a forecast.

A station states the wind 10 m above open land. Near the ground the wind is slower, and slower still
among houses: the logarithmic law u(z) = (u* / κ) ln(z / z₀), joined at the blending height of 60 m
above which the land below no longer matters (Wieringa, Quarterly Journal of the Royal
Meteorological Society 112, 1986, pages 867-889). Roughness lengths z₀ are of WMO, Guide to
Instruments and Methods of Observation (No. 8), part I, chapter 5, annex: 0.03 m of open land with
few obstacles, 1 m of a suburb.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.core.stated import Stated

STATION_HEIGHT = 10.0
BLENDING_HEIGHT = 60.0
OPEN_LAND, SUBURB = 0.03, 1.0
FLAG_HEIGHT = 3.0
"""Height of a flag above the ground that the sentence speaks of [m]."""


@dataclass(frozen=True, kw_only=True)
class WindComparison:
    """How a film's wind differs from one that somebody stated.

    Attributes:
        stated: the wind from elsewhere [m/s].
        difference: central interval of the film's wind less that one [m/s]; None where the film
            only bounds the wind.
        level: of the interval.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "stated=statement",
        "difference",
        "level",
        "agrees",
        "sentence",
    )

    stated: Stated
    difference: tuple[float, float] | None
    level: float

    @property
    def statement(self) -> Any:
        """The wind from elsewhere as a JSON value."""
        return self.stated.recipe()

    @property
    def agrees(self) -> bool | None:
        """Whether the interval of the difference contains 0; None where there is none."""
        return None if self.difference is None else self.difference[0] <= 0 <= self.difference[1]

    @property
    def sentence(self) -> str:
        """The comparison in one line."""
        if self.difference is None:
            return f"not compared with {self.stated.text} m/s: the film only bounds the wind"
        low, high = self.difference
        verdict = "agrees with" if low <= 0 <= high else "is above" if low > 0 else "is below"
        return (
            f"the film's wind {verdict} {self.stated.text} m/s: the difference is {low:+.1f} to "
            f"{high:+.1f} m/s "
            f"({100 * self.level:.0f} %)"
        )

    @property
    def advice(self) -> str:
        """What height and surroundings do to a station's number."""
        in_open, in_suburb = (
            share_of_station(FLAG_HEIGHT, roughness) for roughness in (OPEN_LAND, SUBURB)
        )
        return (
            f"a station states the wind {STATION_HEIGHT:g} m above open land; {FLAG_HEIGHT:g} m "
            "above the ground it is "
            f"about {in_open:.1f} of that in the open, {in_suburb:.1f} among houses"
        )


def compare_winds(
    wind: FloatArray, stated: Stated, *, is_bound: bool, level: float, seed: int
) -> WindComparison:
    """Compares a posterior of the wind with a statement of it.

    The statement is normal about its value, or uniform over its range, and independent of the film.

    Args:
        wind: (n,) draws of the posterior [m/s].
        stated: the wind from elsewhere [m/s].
        is_bound: whether the posterior bounds the wind on one side only.
        level: of the interval of the difference.
        seed: of the draws of the statement.
    """
    if is_bound:
        return WindComparison(stated=stated, difference=None, level=level)
    generator = stream(seed, "wind-elsewhere")
    elsewhere = generator.uniform(
        stated.low, stated.high, len(wind)
    ) + stated.sigma * generator.standard_normal(len(wind))
    low, high = np.quantile(wind - elsewhere, [(1 - level) / 2, (1 + level) / 2]).tolist()
    return WindComparison(stated=stated, difference=(low, high), level=level)


def share_of_station(height: float, roughness: float) -> float:
    """Computes the mean wind at a height above land of a roughness length, as a share of a
    station's.

    Args:
        height: above the ground [m], between the roughness length and `BLENDING_HEIGHT`.
        roughness: roughness length of the land about the flag [m].
    """
    aloft = math.log(BLENDING_HEIGHT / OPEN_LAND) / math.log(STATION_HEIGHT / OPEN_LAND)
    return aloft * math.log(height / roughness) / math.log(BLENDING_HEIGHT / roughness)
