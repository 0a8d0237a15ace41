"""Conversion of the units found in sensor files to SI, in one table.

Inside the package every quantity is SI and angles are radians (no unit suffix on names). A file's
unit enters here and nowhere else. Factors are exact by definition (BIPM SI Brochure, 9th ed.;
international knot 1852 m/h, foot 0.3048 m).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from flagdata.core import compass
from flagdata.core.arrays import FloatArray
from flagdata.errors import UnknownNameError


@dataclass(frozen=True, kw_only=True)
class Unit:
    """A unit of a file: `si_value = value * scale + offset`, in the SI unit named by `si`."""

    si: str
    scale: float
    offset: float = 0.0

    def to_si(self, value: ArrayLike) -> FloatArray:
        """Convert values of this unit to SI; shape kept."""
        return np.asarray(value, dtype=np.float64) * self.scale + self.offset

    def from_si(self, value: ArrayLike) -> FloatArray:
        """Convert SI values to this unit; shape kept."""
        return (np.asarray(value, dtype=np.float64) - self.offset) / self.scale


class _Table(dict[str, Unit]):
    """Units by name; those of a factor, as "0.1 kn", are made of the unit behind it."""

    def __missing__(self, name: str) -> Unit:
        factor, _, rest = name.partition(" ")
        if _FACTOR.fullmatch(name) is None or rest not in self:
            raise KeyError(name)
        return Unit(si=self[rest].si, scale=float(factor) * self[rest].scale)


_FACTOR = re.compile(
    r"(?P<factor>(?:0|[1-9]\d*)?\.?\d+(?:e-?\d+)?)\s*[*x]?\s*(?P<unit>[^\d\s*].*)", re.IGNORECASE
)
_POWERS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−·⋅∙", "0123456789--...")
"""Powers, signs and products as they are set in print, and as they are typed."""
_TENTHS = ("0.1", "0.01", "0.001")
"""Factors with which files spell units."""

UNITS: dict[str, Unit] = _Table(
    {
        "m/s": Unit(si="m/s", scale=1.0),
        "km/h": Unit(si="m/s", scale=1 / 3.6),
        "km/day": Unit(si="m/s", scale=1 / 86.4),
        "kn": Unit(si="m/s", scale=1852 / 3600),
        "mph": Unit(si="m/s", scale=0.44704),
        "dm/s": Unit(si="m/s", scale=0.1),
        "cm/s": Unit(si="m/s", scale=0.01),
        "ft/s": Unit(si="m/s", scale=0.3048),
        "ft/min": Unit(si="m/s", scale=0.3048 / 60),
        "rad": Unit(si="rad", scale=1.0),
        "deg": Unit(si="rad", scale=math.pi / 180),
        "sixteenths": Unit(si="rad", scale=math.pi / 8),
        **{name: Unit(si="rad", scale=math.pi / 180) for name in compass.BY_UNIT},
        "gon": Unit(si="rad", scale=math.pi / 200),
        "mil": Unit(si="rad", scale=math.pi / 3200),
        "10 deg": Unit(si="rad", scale=math.pi / 18),
        "K": Unit(si="K", scale=1.0),
        "degC": Unit(si="K", scale=1.0, offset=273.15),
        "degF": Unit(si="K", scale=5 / 9, offset=273.15 - 32 * 5 / 9),
        "Pa": Unit(si="Pa", scale=1.0),
        "hPa": Unit(si="Pa", scale=100.0),
        "kPa": Unit(si="Pa", scale=1000.0),
        "inHg": Unit(si="Pa", scale=3386.389),
        "1": Unit(si="1", scale=1.0),
        "%": Unit(si="1", scale=0.01),
        "m": Unit(si="m", scale=1.0),
        "mm": Unit(si="m", scale=1e-3),
        "cm": Unit(si="m", scale=1e-2),
        "ft": Unit(si="m", scale=0.3048),
        "s": Unit(si="s", scale=1.0),
        "ms": Unit(si="s", scale=1e-3),
        "Hz": Unit(si="Hz", scale=1.0),
        "1/s": Unit(si="1/s", scale=1.0),
        "px": Unit(si="px", scale=1.0),
    }
)

# Spellings seen in instrument exports, as `_key` reduces them, → the table's name. Beaufort is left
# out on purpose: it is an interval scale of classes, not a unit.
SPELLINGS: dict[str, str] = {
    "mps": "m/s",
    "ms-1": "m/s",
    "m.s-1": "m/s",
    "m/sec": "m/s",
    "meters/sec": "m/s",
    "meter/sec": "m/s",
    "meters/second": "m/s",
    "meter/second": "m/s",
    "metres/second": "m/s",
    "metre/second": "m/s",
    "metres/sec": "m/s",
    "0.1m/s": "dm/s",
    "0,1m/s": "dm/s",
    "cms-1": "cm/s",
    "cm.s-1": "cm/s",
    "cm/sec": "cm/s",
    "m+1s-1": "m/s",
    "meterspersecond": "m/s",
    "kmh": "km/h",
    "kph": "km/h",
    "km/hr": "km/h",
    "kmph": "km/h",
    "km/hour": "km/h",
    "kmh-1": "km/h",
    "km.h-1": "km/h",
    "kilometers/hour": "km/h",
    "kilometres/hour": "km/h",
    "km/d": "km/day",
    "kmd-1": "km/day",
    "km.d-1": "km/day",
    "kmday-1": "km/day",
    "km.day-1": "km/day",
    "kmd": "km/day",
    "kilometers/day": "km/day",
    "kilometres/day": "km/day",
    "km/24h": "km/day",
    "km/tag": "km/day",
    "km/jour": "km/day",
    "km/día": "km/day",
    "km/dia": "km/day",
    "kt": "kn",
    "kts": "kn",
    "knt": "kn",
    "knts": "kn",
    "knot": "kn",
    "knots": "kn",
    "nauticalmiles/hour": "kn",
    "mi/h": "mph",
    "mi/hr": "mph",
    "miles/hour": "mph",
    "mile/hour": "mph",
    "milesperhour": "mph",
    "fps": "ft/s",
    "fpm": "ft/min",
    "ft/sec": "ft/s",
    "feet/second": "ft/s",
    "feet/minute": "ft/min",
    "°": "deg",
    "ø": "deg",
    "degs": "deg",
    "degree": "deg",
    "degrees": "deg",
    "degt": "deg",
    "°t": "deg",
    "degtrue": "deg",
    "deg_from_north": "deg",
    "degreesfromnorth": "deg",
    "degreestrue": "deg",
    "°true": "deg",
    "degn": "deg",
    "degreesn": "deg",
    "°n": "deg",
    "arcdegrees": "deg",
    "mils": "mil",
    "graden": "deg",
    "grader": "deg",
    "gradi": "deg",
    "graus": "deg",
    "degrés": "deg",
    "degrees_true": "deg",
    "knoten": "kn",
    "knopen": "kn",
    "nudos": "kn",
    "nudo": "kn",
    "nœuds": "kn",
    "noeuds": "kn",
    "nœud": "kn",
    "noeud": "kn",
    "nds": "kn",
    "nodi": "kn",
    "nós": "kn",
    "knop": "kn",
    "knob": "kn",
    "knuter": "kn",
    "węzły": "kn",
    "узлы": "kn",
    "solmua": "kn",
    "meter/sekund": "m/s",
    "meterprsekund": "m/s",
    "kilometer/timme": "km/h",
    "kilometer/time": "km/h",
    "km/tim": "km/h",
    "meter/sekunde": "m/s",
    "meter/seconde": "m/s",
    "mètres/seconde": "m/s",
    "mètre/seconde": "m/s",
    "m/seg": "m/s",
    "metros/segundo": "m/s",
    "metri/secondo": "m/s",
    "metro/secondo": "m/s",
    "m/sek": "m/s",
    "m/sn": "m/s",
    "м/с": "m/s",
    "kilometer/stunde": "km/h",
    "km/std": "km/h",
    "km/stunde": "km/h",
    "km/u": "km/h",
    "km/uur": "km/h",
    "km/t": "km/h",
    "km/heure": "km/h",
    "km/hora": "km/h",
    "kilomètres/heure": "km/h",
    "kilómetros/hora": "km/h",
    "kilometros/hora": "km/h",
    "chilometri/ora": "km/h",
    "quilômetros/hora": "km/h",
    "км/ч": "km/h",
    "км/час": "km/h",
    "compassdegrees": "deg",
    "angulardegrees": "deg",
    "grad": "deg",
    "grados": "deg",
    "radian": "rad",
    "radians": "rad",
    "gons": "gon",
    "gradian": "gon",
    "gradians": "gon",
    "10sdeg": "10 deg",
    "10deg": "10 deg",
    "10'sdeg": "10 deg",
    "10°": "10 deg",
    "tensofdegrees": "10 deg",
    "tensofdeg": "10 deg",
    "°c": "degC",
    "℃": "degC",
    "c": "degC",
    "celsius": "degC",
    "celcius": "degC",
    "degc": "degC",
    "deg_c": "degC",
    "degreesc": "degC",
    "degreec": "degC",
    "degreescelsius": "degC",
    "degreecelsius": "degC",
    "degcelsius": "degC",
    "degrees_c": "degC",
    "degree_c": "degC",
    "degrees_celsius": "degC",
    "degree_celsius": "degC",
    "deg_celsius": "degC",
    "degrees_f": "degF",
    "degree_f": "degF",
    "degrees_fahrenheit": "degF",
    "degree_fahrenheit": "degF",
    "°f": "degF",
    "℉": "degF",
    "f": "degF",
    "fahrenheit": "degF",
    "degf": "degF",
    "deg_f": "degF",
    "degreesf": "degF",
    "degreesfahrenheit": "degF",
    "k": "K",
    "kelvin": "K",
    "degk": "K",
    "°k": "K",
    "mb": "hPa",
    "mbar": "hPa",
    "millib": "hPa",
    "millibar": "hPa",
    "millibars": "hPa",
    "hpa": "hPa",
    "kpa": "kPa",
    "hectopascal": "hPa",
    "hectopascals": "hPa",
    "pa": "Pa",
    "pascal": "Pa",
    "pascals": "Pa",
    "inhg": "inHg",
    "percent": "%",
    "%rh": "%",
    "pct": "%",
    "%r.h.": "%",
    "rh%": "%",
    "hz": "Hz",
    "s-1": "1/s",
    "persecond": "1/s",
}


_HOURS = ("小時", "小时", "時間", "時", "时", "h", "시")
_SECONDS = ("秒", "秒鐘", "秒钟", "s", "초")
_PER = {
    "km/h": (("公里", "千米", "km", "キロメートル", "キロ", "킬로미터"), _HOURS),
    "m/s": (("米", "公尺", "m", "メートル", "미터"), _SECONDS),
    "kn": (("海里", "海浬", "浬", "カイリ"), _HOURS),
}
"""Lengths and times of which Chinese, Japanese and Korean tables make their units of speed."""
SPELLINGS |= {
    spelling: name
    for name, (lengths, times) in _PER.items()
    for length in lengths
    for time in times
    for spelling in (
        f"{length}/{time}",
        f"{length}每{time}",
        f"{length}毎{time}",
        f"每{time}{length}",
        f"毎{time}{length}",
    )
    if not spelling.isascii()
} | {"節": "kn", "节": "kn", "ノット": "kn", "노트": "kn", "度": "deg", "도": "deg"}


def unit(text: str, *, where: str | None = None) -> Unit:
    """Returns the unit that a file spells as `text`.

    Raises:
        UnknownNameError: with the nearest known spelling.
    """
    return UNITS[canonical(text, where=where)]


def canonical(text: str, *, where: str | None = None) -> str:
    """Returns the table's own name of the unit that a file spells as `text`.

    Raises:
        UnknownNameError: with the nearest known spelling.
    """
    name = name_of_unit(text) or _factored_unit(text)
    if name is None:
        raise UnknownNameError.of("unit", text, [*UNITS, *SPELLINGS], where=where)
    return name


def name_of_unit(text: str) -> str | None:
    """Returns the table's own name of the unit that a file spells as `text`; `None` where it spells
    none."""
    stripped = text.strip()
    if stripped in UNITS:
        return stripped
    key = _key(stripped)
    unit_name = key if key in UNITS else SPELLINGS.get(key)
    if unit_name is not None:
        return unit_name
    name = _factored_unit(stripped)
    unit_name = (
        name is not None and name.partition(" ")[0] in _TENTHS and UNITS[name].si in ("m/s", "rad")
    )
    return name if unit_name else None


def _factored_unit(text: str) -> str | None:
    """Returns the name of a unit with a factor before it, as "0.765 m/s" of what one turn of a cup
    is; `None` for no such."""
    match = _FACTOR.fullmatch(text.strip().replace(",", "."))
    name = None if match is None else name_of_unit(match["unit"])
    if (
        match is None
        or name is None
        or UNITS[name].offset
        or " " in name
        or float(match["factor"]) == 0
    ):
        return None
    return f"{float(match['factor']):g} {name}"


def plain_powers(text: str) -> str:
    """Writes a unit with powers as digits and a point for products: W/m² and W/m**2 as W/m2, m·s⁻¹
    as m.s-1."""
    return re.sub(r"(?<=\w)\s*\*\s*(?=\w)", ".", re.sub(r"\*\*|\^", "", text.translate(_POWERS)))


def _key(text: str) -> str:
    """Writes a unit in lower case, without blanks, and with one way to write degrees, powers,
    products and "per"."""
    key = plain_powers(text.lower().replace("º", "°")).replace("-per-", "/").replace("(-1)", "-1")
    for per in (" per ", " pro ", " por ", " par ", " al "):
        key = key.replace(per, "/")
    key = "".join(key.split())
    return "°" + key[1:] if key[:1] == "*" and len(key) > 1 else key
