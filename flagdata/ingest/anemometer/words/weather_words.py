"""Words of the air's temperature, humidity and pressure in headings, and of what is none of them.

A change or tendency of the pressure, a temperature of the soil, and the height or hour of a reading (BP_Change, Temp_H,
Temp_hr24) are called after a quantity and are not it.
"""

from __future__ import annotations

import re

_NO_AIR = frozenset(
    {
        "dew", "dewpoint", "dewpt", "dp", "soil", "wet", "bulb", "wetbulb", "chill", "globe", "box", "logger",
        "battery", "batt", "panel", "internal", "int", "indoor", "case", "board", "cpu", "virtual", "surface", "water",
        "sea", "heat",
        "index", "feels", "apparent", "anemometer", "inside", "room", "device", "module", "sst", "wbgt", "grass",
        "radiometer", "body", "cell", "ptemp", "rad", "road", "pv", "black", "leaf", "potential", "theta", "housing",
        "heater", "chip", "pod", "core", "irga", "crystal", "windchill", "heatindex", "cab", "cabine", "in",
        "gyro", "mpu", "w", "wt",
        "wtemp", "watertemp", "therm", "thermistor", "bottom", "seabed", "seafloor", "ocean", "ice", "snow", "ground",
    }
)  # fmt: skip
_OF_GROUND = ("soil", "ground", "grass", "boden", "erdboden", "suelo", "solo")
"""What words begin with that are of the ground, as soiltemp_10cm."""
_CHANGES = frozenset(
    {
        "change", "changes", "changed", "tendency", "tendencies", "tend", "trend", "trends", "delta", "diff",
        "difference", "differential", "departure", "anomaly", "tendenz", "tendance", "tendencia", "tendenza",
        "tendência", "änderung", "variation",
    }
)  # fmt: skip
_WHERE = frozenset({"height", "hgt", "elevation", "elev", "altitude", "alt", "höhe", "hoehe", "hauteur", "altura"})
_WHEN = frozenset({"hr", "hrs", "hour", "hours"})
"""Words of a change, and of the height or hour of a reading."""
_TEMPERATURE = frozenset(
    {"temp", "temperature", "temperatur", "température", "temperatura", "tair", "airt", "airtemp", "tmp", "tamb", "ta"}
)
_HUMIDITY = frozenset({"rh", "hum", "humidity", "humid", "feuchte", "luftfeuchte", "relhum", "humedad", "humidite"})
_OF_MASS = frozenset({"specific", "spec", "absolute", "abs", "mixing", "kgkg", "gkg", "gm"})
"""Words of a humidity that is a mass of vapour in one of air or in a volume, no share of saturation."""
_PRESSURE = frozenset(
    {"press", "pressure", "baro", "barometer", "druck", "luftdruck", "bp", "barometric", "pression", "presion", "pa"}
)
_NO_AIR_PRESSURE = frozenset(
    {"sea", "msl", "slp", "qnh", "vapor", "vapour", "vap", "vp", "vpd", "saturation", "sat", "partial", "deficit",
     "box", "cell", "mslp"}
)  # fmt: skip
ALL = _TEMPERATURE | _HUMIDITY | _PRESSURE
"""Words of the three quantities."""


def channel(words: list[str], compact: str, si: str | None) -> tuple[str, bool, set[str]]:
    """The channel of the weather that a heading names, whether it says so, and the words that do; "" for none.

    Args:
        words: of the heading, lower-case.
        compact: these without anything between.
        si: the SI unit of what the heading states; `None` where it states none.
    """
    known = set(words)
    if known & (_CHANGES | _WHEN) or (si is None and known & _WHERE) or _at_a_height(words):
        return "", False, set()
    sonic = bool(known & {"sonic", "son", "acoustic", "tsonic", "ts", "tson", "csat", "tv"})
    warm = (
        known & _TEMPERATURE or re.search(r"temp|^t$|^t\d+$|^tair", compact) or (words[:1] == ["t"] and len(words) > 1)
    )
    if si in (None, "K") and sonic and (warm or known & {"ts", "tsonic", "tson"}):
        # TS is a sonic's among u, v and w, the soil's in ICOS's and AmeriFlux's tables.
        said = bool(known & {"sonic", "son", "acoustic", "tsonic", "tson", "csat"})
        return "sonic_temperature", said, known & {"sonic", "ts", "temp", "temperature", "t", "tsonic"}
    panel = words[:2] in (["p", "temp"], ["panel", "t"])  # PTemp_C, the temperature of a Campbell logger's panel
    no_air = panel or bool(known & _NO_AIR) or any(word.startswith(_OF_GROUND) for word in words)
    if si in (None, "K") and (warm or (si == "K" and not known)) and not no_air and "dew" not in compact:
        return "air_temperature", True, (known & _TEMPERATURE) or (known & {"t"})
    of_mass = bool(known & _OF_MASS)
    if si in (None, "1") and (known & _HUMIDITY or re.search(r"humid|^rh", compact)) and not no_air and not of_mass:
        return "relative_humidity", True, known & _HUMIDITY
    pressed = known & _PRESSURE or re.search(r"press|baro|^p$|^p\d+$", compact)
    if si in (None, "Pa") and pressed and not known & _NO_AIR_PRESSURE:
        return "air_pressure", True, known & (_PRESSURE | {"p"})
    return "", False, set()


def _at_a_height(words: list[str]) -> bool:
    """Whether a heading is a quantity and the letter of a height or an hour, and no more, as Temp_H."""
    return len(words) == 2 and words[1] == "h" and words[0] in ALL
