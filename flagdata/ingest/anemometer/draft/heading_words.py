"""What a heading says: the quantity that a column may hold, its unit, and words that speak against
a plain mean wind.

English, and the commonest words of German, Dutch, French, Spanish and Italian. What is not in these
tables is not understood, and the user says what the column is.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from flagdata.core.schema import CHANNELS
from flagdata.core.units import UNITS, name_of_unit

Kind = Literal[
    "speed",
    "direction",
    "site",
    "sonic",
    "x",
    "y",
    "z",
    "time",
    "date",
    "temperature",
    "humidity",
    "pressure",
    "other",
]


def words_of(text: str) -> frozenset[str]:
    """Splits a text at blanks into its words."""
    return frozenset(text.split())


_WIND = words_of(
    "wind winds windmean anemometer anemo anem sonic csat viento vent vento gill vane cup cups "
    "windvane"
)
_SPEED = words_of(
    "speed spd sp velocity vel ws wspd wsp windspeed windspd windsp wndspd wndsp ff fff vv "
    "geschwindigkeit "
    "windgeschwindigkeit vitesse velocidad snelheid windsnelheid velocita"
)
_DIRECTION = words_of(
    "direction dir dirn wd wdir winddir winddirection wnddir dd ddd bearing azimuth richtung "
    "windrichtung "
    "direccion richting direzione"
)
_AXES: tuple[tuple[Kind, frozenset[str]], ...] = (
    ("x", words_of("u ux x east eastward")),
    ("y", words_of("v uy y north northward")),
    ("z", words_of("w uz z up vertical upward")),
)
_TIME = words_of(
    "time timestamp datetime stamp clock hour uhrzeit zeit heure hora tijd ora tmstamp epoch "
    "unixtime utc gmt "
    "localtime zeitstempel date_time sampletime recordtime timestring millis elapsed"
)
_DATE = words_of("date day datum fecha jour giorno dato yyyymmdd")
_TEMPERATURE = words_of("temperature temp ta airtemp tair temperatur temperatura")
_HUMIDITY = words_of("humidity rh hum relhum feuchte humedad umidita humidite")
_PRESSURE = words_of("pressure press baro bp barometer luftdruck presion pression pressione druk")
_EXTREME = words_of(
    "gust gusts gustspeed max maximum min minimum peak high hi low lo highest lowest extreme boe "
    "böe bö rafale "
    "racha raffica windgust maxi mini"
)
GUSTS = _EXTREME - words_of("min minimum low lo lowest mini")
_SPREAD = words_of(
    "std stdev sd stddev sigma deviation dev variance var rms ti turbulence count quality qc flag"
)
MOVING = words_of(
    "apparent aws awa awd relative bow vessel boat ship drone uav sog cog heading hdg ground gps "
    "vehicle truewind "
    "tws twd twa track roll pitch yaw vx vy vz"
)
"""Words that speak of a platform which may move."""
_TOWARDS = words_of("to toward towards going")
_RAW = words_of(
    "volt volts voltage counts pulses pulse raw adc mv frequency freq beaufort bft class chill"
)
_OTHER = words_of(
    "battery batt rain solar radiation uv soil dew dewpoint snow wave tide water sea current"
)
_SITES = words_of(
    "station site sensor device location turbine buoy node mast id serial place logger"
)
_BRACKET = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]{1,20})[\])]\s*(?P<rest>.*)$")
_WORD = re.compile(r"[a-zäöüß°]+|\d+(?:\.\d+)?")
_HEIGHT = re.compile(r"(?<![a-z\d.])(\d{1,3}(?:\.\d+)?)\s*m(?![a-z/])", re.IGNORECASE)


@dataclass(frozen=True, kw_only=True)
class Meaning:
    """What a heading says.

    Attributes:
        kind: of quantity.
        unit: that the heading or the line below it states, as `flagdata.core.units` names it;
            `None` for none.
        against: words that speak against a plain mean wind of a fixed instrument.
        named: whether the wind itself is named, and not a speed or a direction of something.
        height: in metres, where it is stated.
        plain: its words, without the unit.
        utc: whether it says that a time is of UTC.
    """

    kind: Kind
    unit: str | None = None
    against: tuple[str, ...] = ()
    named: bool = False
    height: float | None = None
    plain: str = ""
    utc: bool = False


def meaning(name: str, below: str = "") -> Meaning:
    """Reads what a heading says, with the unit that may stand below it."""
    bare, unit = _with_unit(name, below)
    split = (
        re.sub(r"(?<=[a-z])(?=[A-Z])", " ", bare)
        .lower()
        .replace("é", "e")
        .replace("à", "a")
        .replace("ó", "o")
    )
    words = _WORD.findall(split.replace("_", " "))
    joined = {*words, *(a + b for a, b in pairwise(words))}
    against = tuple(w for w in words if w in _EXTREME | _SPREAD | MOVING | _RAW | _TOWARDS)
    height = _HEIGHT.search(name)
    kind = _kind(words, joined, unit)
    named = bool(joined & _WIND) or any(
        word.startswith(("wind", "wnd", "ws", "wd")) for word in words
    )
    return Meaning(
        kind=kind,
        unit=unit,
        against=against,
        named=named,
        utc=bool({"utc", "gmt"} & joined),
        height=float(height[1]) if height else None,
        plain=" ".join(words),
    )


def fits(channel: str, unit: str) -> bool:
    """Checks whether a unit is one of a channel's."""
    return unit in UNITS and UNITS[unit].si == CHANNELS[channel].unit


def named_alike(gust: Meaning, speed: Meaning) -> bool:
    """Checks whether a gust has the name of a speed: its words, but those of gusts and speeds, are
    among the other's."""
    left, right = (
        set(a.plain.split()) - _EXTREME - _SPEED - {"mean", "avg", "average"} for a in (gust, speed)
    )
    return left <= right


def _kind(words: list[str], joined: set[str], unit: str | None) -> Kind:
    if joined & _OTHER:
        return "other"
    if "sonic" in joined and joined & _TEMPERATURE:
        return "sonic"
    if joined & _DIRECTION:
        return "direction"
    if joined & _SPEED:
        return "speed"
    axes: list[Kind] = [axis for word in words for axis, vocabulary in _AXES if word in vocabulary]
    if axes and len(words) <= 3 and (unit is None or UNITS[unit].si == "m/s"):
        return axes[0]
    if joined & _WIND and (UNITS[unit].si == "m/s" if unit is not None else set(words) <= _WIND):
        return "speed"
    if set(words) & _SITES and not set(words) & (
        _TEMPERATURE | _HUMIDITY | _PRESSURE | _TIME | _DATE
    ):
        return "site"
    ordinary: tuple[tuple[frozenset[str], Kind], ...] = (
        (_TEMPERATURE, "temperature"),
        (_HUMIDITY, "humidity"),
        (_PRESSURE, "pressure"),
        (_TIME, "time"),
        (_DATE, "date"),
    )
    for vocabulary, kind in ordinary:
        if joined & vocabulary:
            return kind
    return "other"


def _with_unit(name: str, below: str) -> tuple[str, str | None]:
    """Splits a heading into name and unit, which stands in brackets, behind a comma or blank, or in
    the line below."""
    if (alone := name_of_unit(name[:40])) is not None:
        return "", alone
    match = _BRACKET.match(name[:200])
    if match is not None and (unit := name_of_unit(match["unit"])) is not None:
        return f"{match['name']} {match['rest']}", unit
    for mark in (",", " - ", " in ", " ", "_"):
        head, _, tail = name[:200].rpartition(mark)
        unit = name_of_unit(tail) if head and (len(tail) > 1 or mark == ",") else None
        if (
            unit is not None
            and UNITS[unit].si in ("m/s", "rad", "K", "Pa")
            and tail.lower() not in ("to", "grad")
        ):
            return head, unit
    return name[:200], name_of_unit(below.strip("[]() ")) if below else None
