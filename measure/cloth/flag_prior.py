"""What is not known of a flag, its place and its anemometer before it is filmed, what a user
states, and draws of it.

A draw is a row of numbers in [0, 1), one a quantity, which each distribution turns into a value.
Rows come from a Sobol sequence (Owen's scrambling), so that few simulations cover all quantities
evenly.

Fabrics are the ten whose bending and stretching Wang, O'Brien and Ramamoorthi measured (ACM TOG
30(4):71, 2011). What each is made of is in the list that they publish beside their tables (Berkeley
Garment Library, README of its materials). The list states fibres and not how a cloth is made. Woven
are denim, by its name, and cloths as stiff as it (at rest, 200 N/m or more along warp and weft);
knit are rib, interlock, ponte roma, swim and sweat, by their names, and a cloth as compliant (below
100 N/m in one direction). `pink-ribbon-brown` lies between and is in neither.

Nobody has published such tables of a flag's bunting, so that a class is the nearest that was
measured. Of nylon one knit swimsuit was measured, while flags of nylon are woven: their class is
that of all woven cloths.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.core.stated import Stated
from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.recipes.typed_tables import Range, Scale


@dataclass(frozen=True, kw_only=True)
class Normal:
    """A normal distribution.

    Attributes:
        mean, sigma: in the quantity's unit.

    Raises:
        InputError: a deviation that is not positive.
    """

    mean: float
    sigma: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mean) and self.sigma > 0):
            raise InputError(
                f"the prior is {self.mean} ± {self.sigma}",
                where="prior",
                fix="give a finite mean and a deviation > 0",
            )

    def at(self, share: FloatArray) -> FloatArray:
        """Quantiles of shares in (0, 1)."""
        return self.mean + self.sigma * ndtri(np.clip(share, 1e-6, 1 - 1e-6))


@dataclass(frozen=True, kw_only=True)
class Among:
    """Some of so many equal parts of [0, 1), each as probable.

    Attributes:
        places: of the parts.
        count: of all parts.
    """

    places: tuple[int, ...]
    count: int

    def at(self, share: FloatArray) -> FloatArray:
        """Values of shares in [0, 1)."""
        scaled = np.minimum(share, np.nextafter(1.0, 0.0)) * len(self.places)
        part = scaled.astype(np.int64)
        return (np.array(self.places)[part] + scaled - part) / self.count


@dataclass(frozen=True, kw_only=True)
class Uncertain:
    """One quantity.

    Attributes:
        name: as in tables.
        unit: SI.
        prior: its distribution.
        source: what the prior is from.
        limits: values that the quantity can have at all, or that the user states: beyond an end of
            the prior that lies there is nothing.
    """

    name: str
    unit: str
    prior: Range | Normal | Among
    source: str
    limits: tuple[float, float] = (-math.inf, math.inf)

    @property
    def degrees(self) -> str:
        """Returns the prior of an angle in words."""
        if isinstance(self.prior, Normal):
            return f"{math.degrees(self.prior.mean):.3g} ± {math.degrees(self.prior.sigma):.2g}°"
        low, high = self.ends or (-math.inf, math.inf)
        return f"{math.degrees(low):.3g} to {math.degrees(high):.3g}°"

    @property
    def ends(self) -> tuple[float, float] | None:
        """Returns the ends of the prior; None of one that is no range."""
        return (self.prior.low, self.prior.high) if isinstance(self.prior, Range) else None

    def at(self, share: FloatArray) -> FloatArray:
        """Values of shares in [0, 1)."""
        if not isinstance(self.prior, Range):
            return self.prior.at(share)
        low, high = self.prior.low, self.prior.high
        if self.prior.scale is Scale.LOG:
            return low * (high / low) ** share
        return low + (high - low) * share


_POSITIVE = (0.0, math.inf)


def _log(low: float, high: float) -> Range:
    return Range(low=low, high=high, scale=Scale.LOG)


CLOTH = (
    Uncertain(
        name="area_weight",
        unit="kg/m²",
        prior=_log(0.05, 0.45),
        source="flag cloths are sold from 50 g/m² (spun polyester) to 350 g/m² (denim, wool "
        "bunting: 150 to 240)",
        limits=_POSITIVE,
    ),
    Uncertain(
        name="bending",
        unit="N·m",
        prior=_log(3e-6, 6e-4),
        source="mean coefficient of the fabrics of Wang et al. 2011, a tenth to ten times, as "
        "Runia et al. 2020 search",
        limits=_POSITIVE,
    ),
    Uncertain(
        name="damping",
        unit="s",
        prior=_log(2.5e-4, 4e-2),
        source="hardly ever measured; what the nulls of verdicts vary it by",
        limits=_POSITIVE,
    ),
)
"""What is sought."""
STRETCHING = Uncertain(
    name="stretching",
    unit="1",
    prior=_log(0.5, 2.0),
    source="factor on the table of the fabric that a simulation draws, as nulls of verdicts vary "
    "it",
)
FABRIC = Uncertain(
    name="fabric",
    unit="1",
    prior=Range(low=0.0, high=1.0),
    source="place in the list of the fabrics that Wang et al. 2011 measured, none of which is a "
    "flag's",
)
"""What a cloth is beside, the same in all recordings of it: left to the scatter."""
NUISANCES = (
    Uncertain(
        name="gain",
        unit="1",
        prior=Normal(mean=1.0, sigma=0.03),
        source="classes of cups, IEC 61400-12-1",
    ),
    Uncertain(
        name="scale",
        unit="1",
        prior=Normal(mean=1.0, sigma=0.01),
        source="a flag's size as sold or taped, one per cent",
    ),
    Uncertain(
        name="eddies",
        unit="m",
        prior=_log(20.0, 120.0),
        source="integral length along the wind, 50 to 100 m at 10 m height and less near the "
        "ground (ESDU 85020)",
    ),
)
"""What a simulation needs beside, another one in each recording. Gain and scale are fitted, eddies
are left to the scatter."""
DISTANCE = Uncertain(
    name="distance_constant",
    unit="m",
    prior=_log(1.5, 5.0),
    source="cups (ISO 17713-1; WMO-No. 8)",
)
"""Of an anemometer whose recipe states none."""


def clock_error(sigma: float) -> Uncertain:
    """Makes the prior of a log's times beside the film's, their standard uncertainty [s]."""
    return Uncertain(
        name="clock_error",
        unit="s",
        prior=Normal(mean=0.0, sigma=sigma),
        source="the log's clock model",
    )


DIRECTION = math.radians(5.0)
"""Standard uncertainty of the logged wind's direction: north, or a tunnel's axis, lined up by eye
and compass [rad]."""
AZIMUTH = Uncertain(
    name="azimuth",
    unit="rad",
    prior=Range(low=math.radians(30.0), high=math.radians(150.0)),
    source="a camera that was not placed by a vane; within 30° of the wind's axis a flag shows no "
    "length",
)
"""Of the camera's axis to the wind where the user gives none."""
ELEVATION = Uncertain(
    name="elevation",
    unit="rad",
    prior=Normal(mean=0.0, sigma=math.radians(5.0)),
    source="a camera held level at a flag a few metres up and ten or more away",
)


def draws(
    quantities: tuple[Uncertain, ...], count: int, *, seed: int, name: str
) -> Mapping[str, FloatArray]:
    """Name → (count,) values, from a scrambled Sobol sequence of the named stream.

    Args:
        count: a power of two covers best.
    """
    engine = qmc.Sobol(len(quantities), scramble=True, rng=stream(seed, "calibrate", name))
    shares = np.asarray(
        engine.random_base2(max(0, math.ceil(math.log2(max(count, 1))))), dtype=np.float64
    )[:count]
    return {
        quantity.name: quantity.at(shares[:, column]) for column, quantity in enumerate(quantities)
    }


def stated_angle(about: Uncertain, angle: Stated, *, where: str) -> Uncertain:
    """Makes the prior of an angle as the user states it [°], an exact value with the uncertainty of
    a direction.

    Raises:
        UsageError: an azimuth that is not between 0 and 180, or an elevation beyond 60.
    """
    least, most = (1.0, 179.0) if about.name == "azimuth" else (-60.0, 60.0)
    if angle.low < least or angle.high > most:
        raise UsageError(
            f"{about.name} is {angle.text}°",
            where=where,
            fix=f"give degrees from {least:g} to {most:g}, as in 70±7",
        )
    low, high = math.radians(angle.low), math.radians(angle.high)
    if low < high:
        return replace(about, prior=Range(low=low, high=high), source="stated", limits=(low, high))
    sigma = math.radians(angle.sigma)
    # An azimuth is to the wind, whose direction is not better known than it is lined up.
    total = (
        math.hypot(sigma, DIRECTION) if about.name == "azimuth" else max(sigma, math.radians(1.0))
    )
    return replace(about, prior=Normal(mean=low, sigma=total), source="stated")


TABLES = (
    "11oz-black-denim",
    "camel-ponte-roma",
    "gray-interlock",
    "ivory-rib-knit",
    "navy-sparkle-sweat",
    "pink-ribbon-brown",
    "royal-target",
    "tango-red-jet-set",
    "white-dots-on-blk",
    "white-swim-solid",
)
"""Materials of the catalog whose tables are multiplied; each simulation draws one. A simulation's
number in [0, 1) is a place among these."""
_WOVEN = ("11oz-black-denim", "royal-target", "white-dots-on-blk")
CLASSES = {
    "woven": _WOVEN,
    "woven-polyester": ("royal-target", "white-dots-on-blk"),
    "woven-cotton": ("11oz-black-denim", "royal-target"),
    "woven-nylon": _WOVEN,
    "knit": (
        "camel-ponte-roma",
        "gray-interlock",
        "ivory-rib-knit",
        "navy-sparkle-sweat",
        "tango-red-jet-set",
        "white-swim-solid",
    ),
    "knit-polyester": ("camel-ponte-roma", "navy-sparkle-sweat", "tango-red-jet-set"),
    "knit-cotton": ("gray-interlock", "ivory-rib-knit"),
    "cotton-59": ("11oz-black-denim", "royal-target"),
    "cotton-114": ("11oz-black-denim", "royal-target"),
    "cotton-192": ("11oz-black-denim", "royal-target"),
    "wool-274": _WOVEN,
}
"""Name → those of `TABLES` that a cloth of it may have. Fibres: denim 99 % cotton; royal target 65
% cotton, 35 % polyester; white dots, tango 100 % polyester; navy 96 % polyester; camel 60 %
polyester, 40 % rayon; ivory 95 % cotton; gray interlock 60 % cotton, 40 % polyester; white swim 87
% nylon. Cloths of which only weight and bending were measured have the tables of the class of their
fibre."""


@dataclass(frozen=True, kw_only=True)
class Fabric:
    """A stated fabric.

    Attributes:
        name: as it was given.
        tables: those of `TABLES` that are drawn.
    """

    name: str
    tables: tuple[str, ...]

    @property
    def drawn(self) -> Uncertain:
        """Returns what simulations draw in place of any."""
        places = tuple(TABLES.index(table) for table in self.tables)
        return replace(
            FABRIC, prior=Among(places=places, count=len(TABLES)), source=f"stated: {self.name}"
        )


def fabric(name: str, *, where: str) -> Fabric:
    """Finds a class of cloths, or one of the cloths that were measured.

    Raises:
        UnknownNameError: neither, with all that are known.
    """
    if name not in CLASSES and name not in TABLES:
        names = ", ".join([*CLASSES, *TABLES])
        raise UnknownNameError(
            f"no cloth like {name!r} was measured", where=where, fix=f"give one of {names}"
        )
    return Fabric(name=name, tables=CLASSES.get(name, (name,)))
