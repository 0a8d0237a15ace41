"""What the heading of a column says: the quantity, whether it is a mean, the unit, the height, and whose it is.

A heading is cut into words at blanks, signs, capitals and digits ("Spd80mN" is spd, 80, m, N). Words of the quantity,
of the statistic and of the unit are known in the languages of common loggers; what is left tells instruments apart.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer.instants.abbreviations import ABBREVIATED, written_out
from flagdata.ingest.anemometer.words import weather_words
from flagdata.ingest.anemometer.words.languages import in_english
from flagdata.ingest.anemometer.words.wind_words import (
    ANY_SPEED,
    AXES,
    COURSES,
    DIRECTION,
    HEIGHTS,
    MEAN,
    OF_ROTORS,
    OF_VESSELS,
    OTHER,
    PLACES,
    PLAIN,
    SPEED,
    SPREAD,
    SURE_DIRECTION,
    VERTICAL,
    WIND,
    parted,
)
from flagdata.schema import CHANNELS
from flagdata.timebase import zone
from flagdata.units import UNITS, spelled

_WORD = re.compile(r"\d+(?:[.]\d+)?|[^\W\d_]+")
_CAMEL = re.compile(r"[A-ZÀ-ÖØ-Þ]+(?![^\W\d_A-ZÀ-ÖØ-Þ])|[A-ZÀ-ÖØ-Þ]?[^\W\d_A-ZÀ-ÖØ-Þ]+|[^\W\d_]+")
_BRACKET = re.compile(r"[\[(<{]([^\])>}]*)[\])>}]")
_HEIGHT = re.compile(r"(?<![\d.])(\d{1,3}(?:\.\d+)?)\s*[mM](?![a-z/²³\d])")
_ABOVE = re.compile(
    r"(?<![^\W_])above[ _](?:the[ _])?(?:ground|surface|sea|deck)(?:[ _](?:level|surface))?(?![^\W_])", re.IGNORECASE
)
_PERIOD = re.compile(r"(avg|average|mean|max|min|std|smp)([\W_]*\(\s*\d+\s*)m(?=\s*\))", re.IGNORECASE)
"""Minutes behind a mean or an extreme, as "WS_Avg(5m)", which are no height."""
_WIND_VECTOR = re.compile(r"(?:WS|WD|Wind|Anem\w*)(?P<name>.*?)_WVc\((?P<n>[123])\)", re.IGNORECASE)
_VECTOR = {"1": "wind speed", "2": "wind direction", "3": "wind direction Std"}
"""What Campbell's instruction WindVector writes under one name: mean speed, mean direction, its standard deviation."""
_INTERVAL = re.compile(r"\b\d+ ?-?(?:min|mins|minutes|minute|sec|hr|hour|h)\b", re.IGNORECASE)
_ZONE = re.compile(r"\b(?:UTC|GMT)\s*([+-]\s?\d{1,2}(?::?\d{2})?)?|(?<![A-Za-z])Z(?![A-Za-z])")

_TOWARDS = re.compile(
    r"\btowards?\b|\bblowing to\b|\bto dir|\bgoing to\b|\bdir(?:ection)? to\s*(?:[\[(]|$)", re.IGNORECASE
)
_PLACE = re.compile(r"[A-Z][A-Za-z]+/[A-Z][A-Za-z_]+(?:/[A-Z][A-Za-z_]+)?")
_APPARENT = frozenset({"apparent", "aws", "awa", "rel", "relative", "awd", "app", "apparente", "bow"})
_THEORETICAL = frozenset({"tws", "twa", "theoretical"})
_ABBREVIATED = {
    "aws": "apparent_wind_speed", "awa": "apparent_wind_direction", "awd": "apparent_wind_direction",
    "tws": "theoretical_wind_speed", "twa": "theoretical_wind_direction",
}  # fmt: skip
_VESSEL_WIND = {
    "angle": "a", "ang": "a", "speed": "s", "spd": "s", "velocity": "s", "dir": "d", "direction": "d",
}  # fmt: skip
"""The last letter of what instruments of boats call AWA, AWS, AWD, TWA, TWS, TWD and GWD, by its word."""
_COMPONENTS = {
    "u": "wind_x", "v": "wind_y", "w": "wind_z", "ux": "wind_x", "uy": "wind_y", "uz": "wind_z", "vx": "wind_x",
    "vy": "wind_y", "vz": "wind_z", "x": "wind_x", "y": "wind_y", "z": "wind_z",
}  # fmt: skip
_ENDING_IN_DIRECTION = frozenset({"dir", "direction", "direccion", "direc", "direzione", "richtung"})
"""What stands behind the letter of a wind in the heading of its direction, as VDir (viento)."""
_INSIDE = {
    "ms": "m/s", "mps": "m/s", "kmh": "km/h", "kph": "km/h", "kts": "kn", "kt": "kn", "knots": "kn", "kn": "kn",
    "sknt": "kn", "mph": "mph", "deg": "deg", "degc": "degC", "degf": "degF", "c": "degC", "f": "degF", "hpa": "hPa",
    "mbar": "hPa", "kpa": "kPa", "pct": "%", "perc": "%", "k": "K",
}  # fmt: skip
"""Words that are a unit behind the quantity, wherever they stand ("WS_ms_S_WVT", "windSpeedMps")."""
_OF_WIND = WIND | SPEED | DIRECTION
_NORTH_BEHIND = re.compile(r"\s*[\[(]\W?(?P<north>t|true|tn|m|mag|mn)[\])]\s*$", re.IGNORECASE)
"""What stands in brackets behind a direction for the north it is from."""
_TENTHS = re.compile(r"\btenths? of (?:an? )?", re.IGNORECASE)
_RATE = re.compile(r"(?<![\d.])\d+(?:\.\d+)?\s?k?Hz(?![^\W_])", re.IGNORECASE)
"""The rate of samples in a heading ("u_20Hz"), which is no unit."""
_OF_BRIDGE = re.compile(r"^\[?wind\d+(avg|)wind(?![a-z])")
_PER = re.compile(
    r"(?P<length>(?<![^\W_])k?m|(?:kilo)?met(?:er|re)s?)[_ ]?per[_ ]?(?P<time>s|sec|second|h|hr|hour)(?![a-z])",
    re.IGNORECASE,
)
"""Units in words that are put together, as in metersPerSecond and km_per_h."""
_MEAN_BEHIND = re.compile(r"[\s_]+[(\[]?(?P<mean>avg|mean|average|ave)[)\]]?$", re.IGNORECASE)
_GLUED = re.compile(r"(?:speed|velocity|wind|gust)(?P<unit>km[/._]h|m[/._]s|km/?ph|miles)$", re.IGNORECASE)
_U_SONIC = re.compile(r"\bu[- ]?sonic\b", re.IGNORECASE)  # an ultrasonic anemometer, as METOS writes; no component u
"""How Meteobridge names the speed of its anemometers ("wind0avgwind-act")."""
_TENFOLD = re.compile(r"(?:(?<=[\W_])|(?<=\d))[x×*]\s?(?P<factor>100?)\b", re.IGNORECASE)
"""What a heading says of numbers that are ten or a hundred times the quantity, or a tenth: it is to be asked."""
_TURNED = re.compile(r"\bccw\b|counter.?clock|anti.?clock|from east|mathemat|\bmath\b", re.IGNORECASE)
"""What a heading says of an angle that is not clockwise from north."""
_SENSORS = frozenset(
    {"csat", "csat3", "sonic", "sat", "metek", "gill", "young", "wind", "comp", "component", "hs", "wm"}
)


_YEARS = frozenset({"yyyy", "aaaa", "jjjj", "yy", "aa", "åååå"})
_DATE_PARTS = frozenset({"mm", "mmm", "dd", "gg", "jj", "tt", "hh", "ss", "sss", "mi", "nn", "t", "z", "min", "sec"})
"""Parts of a format of a stamp as headings write it, in several languages."""
_PARTS_OF_DATE = 3
"""Parts from which such words are a format: year, month and day."""


@dataclass(frozen=True, kw_only=True)
class Heading:
    """What a heading says.

    Attributes:
        name: as written.
        channel: of `schema.CHANNELS`; "" where it names none that a log of wind has, and for spreads and extremes.
        sure: whether it names the channel; false where only the unit speaks for it.
        spread: whether it is a maximum, gust, deviation, count or mark, of whatever quantity.
        quantity: the channel that a spread belongs to, else `channel`.
        mean: whether it says that it is a mean.
        unit: the table's name of the unit it states, of whatever quantity; `None` where it states none.
        height: above ground [m].
        label: words that tell instruments apart, lower-case.
        magnetic: of a direction, whether it is from magnetic north.
        towards: of a direction, whether the wind blows to it.
        misstated: the unit of a speed that the heading of a direction states by mistake; "" where it does not.
        strange: what stands in brackets where a unit does, but spells none that is known, or how an angle is turned
            that is not clockwise from north; "" where nothing does.
    """

    name: str
    channel: str
    sure: bool
    spread: bool
    quantity: str
    mean: bool
    unit: str | None
    height: float | None
    label: tuple[str, ...]
    magnetic: bool = False
    towards: bool = False
    misstated: str = ""
    strange: str = ""


@lru_cache(maxsize=4096)
def understand(name: str, stated: str = "") -> Heading:
    """What the heading `name` says, with the cell `stated` of a line of units below it."""
    text = in_english("" if is_format(name) else name[:120].strip().strip('"').strip())
    text = _PER.sub(lambda found: f" {'k' * (found['length'][0] in 'kK')}m/{found['time'][0].lower()}", text)
    text = re.sub(r"^Ten[_ ]Met(?:er|re)[_ ]Elevation(?=[_ ])", "10m", text, flags=re.IGNORECASE)
    text = re.sub(r"^[Øø⌀]\s?(?=[^\W\d_]{2})", "mean ", text)
    text = re.sub(r"(?<=direction), ?\*$", ", deg", text, flags=re.IGNORECASE)  # a sign for degrees, lost by HOBO
    text = _PERIOD.sub(r"\1\2min", _ABOVE.sub(" ", _RATE.sub(" ", text)))
    text = _U_SONIC.sub("sonic", _OF_BRIDGE.sub(r"wind speed \1 ", _TENTHS.sub("0.1 ", text)))
    tenfold = _TENFOLD.search(text)
    text = text if tenfold is None else f"{text[: tenfold.start()]} {text[tenfold.end() :]}"
    text = re.sub(r"_(S|U|D1|SD1|D1U|DU)_WVT$", lambda found: "_Std" if found[1] == "SD1" else "_Avg", text)
    vector = _WIND_VECTOR.fullmatch(text)
    if vector is not None:
        text, stated = f"{_VECTOR[vector['n']]} {vector['name']}", stated if vector["n"] == "1" else "deg"
    north = _NORTH_BEHIND.search(text) if re.search(r"dir|bearing|wd", text, re.IGNORECASE) else None
    text = text if north is None else text[: north.start()]
    rest, unit = _unit(text, stated)
    height = _height(rest)
    bare = _HEIGHT.sub(" ", rest) if height is not None else rest
    bare, averaged = _INTERVAL.subn(" ", bare.replace("_", " "))
    words = _words(bare)
    if tenfold is not None:
        unit = None
    elif unit is None:
        no_units = {"deg", "c", "f", "k"} if _OF_WIND & set(words) else {"deg"}  # WS_c: the third
        last = (word for word in reversed(words[1:] or words) if word in _INSIDE and word not in no_units)
        unit = next((_INSIDE[word] for word in last), None)
        unit = "deg" if unit is None and "deg" in words[1:] else unit
        words = [word for at, word in enumerate(words) if not (at and _INSIDE.get(word) == unit is not None)]
    known = set(words)
    if unit is not None and UNITS[unit].si == "m/s" and "latest" not in known:
        known.discard("samples")  # of a speed, not a count of them
    compact = "".join(words)
    spread = bool(known & SPREAD) or "*" in rest or bool(re.search(r"gust|böe|std|max$|min$|chill|rms$", compact))
    misstated = _misstated(known, unit)
    unit = None if misstated else unit
    quantity, sure, used = _quantity(words, compact, unit, rest)
    courses = {"course", "heading"} if known & WIND else {"course"}
    if quantity and known & OTHER and not (quantity.endswith("direction") and known & courses):
        allowed = VERTICAL if quantity == "wind_z" else {"scalar"} if "sonic" in known else frozenset()
        excluded = known & OTHER - allowed
        if "wind" in quantity and excluded:
            quantity, sure = "", False
    if "wind" in quantity and _of_another(known, unit, text):
        quantity, sure = "", False
    if quantity == "wind_speed" and len(along := known & {"x", "y", "z"}) == 1:
        quantity, sure = _COMPONENTS[next(iter(along))], bool(known & WIND)
    if quantity.endswith("wind_speed") and known & AXES:
        quantity, sure = "", False
    left = list(words)
    for word in used:
        left.remove(word)
    label = tuple(word for word in left if word not in MEAN | SPREAD | PLAIN | WIND)
    return Heading(
        name=name, channel="" if spread else quantity, sure=sure, spread=spread, quantity=quantity,
        mean=bool(known & MEAN or averaged), unit=unit, height=height, label=label,
        magnetic=bool(known & {"mag", "magnetic"}) or (north is not None and north["north"].lower().startswith("m")),
        towards=bool(_TOWARDS.search(text.replace("_", " "))), misstated=misstated,
        strange=tenfold[0].strip() if tenfold is not None
        else turned[0] if (turned := _TURNED.search(text)) else _strange(text) if unit is None else "",
    )  # fmt: skip


def _of_another(known: set[str], unit: str | None, text: str) -> bool:
    """Whether a heading of a wind is of the height of its mast, or of the speed or course of a vessel or a rotor."""
    if known & OF_ROTORS and not known & WIND and known & SPEED <= ANY_SPEED:
        return True
    if known & OF_VESSELS and not known & WIND and not known & (_APPARENT | _THEORETICAL):
        return True
    speed = unit is not None and UNITS[unit].si in ("m/s", "rad")
    return bool(known & HEIGHTS) and not speed and not re.search(r"\d", text)


def interest(name: str) -> int:
    """How much a cell looks like the heading of a time (2), a wind (2) or another channel (1)."""
    heading = understand(name)
    if heading.unit is not None and _known(name.strip("[]()")) is not None:
        return 0
    if names_time(name):
        return 1 if name.strip().upper() == "TS" else 2
    if not heading.quantity or not heading.sure:
        return 0
    return 2 if "wind" in heading.quantity else 1


def names_time(name: str) -> bool:
    """Whether a heading names a time or a date."""
    words = set(words_of(name))
    known = {
        "time", "timestamp", "date", "datetime", "datum", "uhrzeit", "zeit", "zeitstempel", "fecha", "hora", "heure",
        "horodatage", "stamp", "epoch", "unixtime", "unix", "millis", "milliseconds", "seconds", "elapsed", "ts",
        "utc", "tijd", "tid", "dato", "data", "dt", "timestamps", "isotime", "when", "year", "month", "day", "hour",
        "doy", "jday", "tstamp", "ora", "tmstamp", "dateutc", "ms", "observed", "obs",
    }  # fmt: skip
    if is_format(name):
        return True
    labview = name.strip() == "X_Value"
    return bool(words & known) or labview or bool(re.search(r"time|date", "".join(words)))


def is_format(name: str) -> bool:
    """Whether a heading is the format of the stamps below it, such as "yyyy-mm-dd hh:mm" or "JJ/MM/AAAA"."""
    parts = re.findall(r"[^\W\d_]+", name.lower())
    parts = parts[1:] if parts[:1] in (["date"], ["datum"], ["fecha"], ["data"], ["dato"]) else parts
    year = any(part in _YEARS for part in parts)
    return len(parts) >= _PARTS_OF_DATE and year and all(part in _YEARS | _DATE_PARTS for part in parts)


def zone_of(name: str) -> str | None:
    """The zone that the heading of a time states: "UTC", or an offset."""
    place = _PLACE.search(name)
    if place is not None and _is_zone(place[0]):
        return place[0]
    found = _ZONE.search(re.sub(r"_", " ", name))
    if found is None and re.search(r"utc|gmt", name, re.IGNORECASE):
        return "UTC"
    if found is None:
        short = re.search(r"(?<![A-Za-z])([A-Z]{3,4})\W*$", name.replace("_", " "))
        hours = ABBREVIATED.get(short[1]) if short is not None else written_out(name)
        return None if hours is None else f"{hours:+03d}:00"
    if not found[1]:
        return "UTC"
    sign, digits = found[1][0], found[1][1:].strip().replace(":", "")
    hours, minutes = (digits[:-2], digits[-2:]) if len(digits) > 2 else (digits, "00")
    return f"{sign}{int(hours):02d}:{minutes}"


def _is_zone(name: str) -> bool:
    try:
        zone(name)
    except FlagdataError:
        return False
    return True


_SPEED_AND_UNIT = re.compile(r"(\w*(?:speed|spd|gust|velocity))(mph|kmh|kph|kts|knots|mps)")
"""A speed with its unit in one word, as "windspeedmph"."""


_SHORT_AND_STATISTIC = re.compile(r"(?<![^\W_])(WS|WD|FF|DD)([a-z]{1,6})(?![^\W_])")
"""A short name in capitals with its statistic or unit behind it, as WSavg or WSms."""


def _cut_behind(found: re.Match[str]) -> str:
    known = found[2] in MEAN | SPREAD or found[2] in _INSIDE
    return f"{found[1]} {found[2]}" if known else found[0]


def words_of(name: str) -> list[str]:
    """Words of a heading, lower-case."""
    return _words(in_english(name))


def _words(text: str) -> list[str]:
    found: list[str] = []
    text = text.replace("WDrs", "wdir")  # the resultant direction of Campbell's programs
    text = _SHORT_AND_STATISTIC.sub(_cut_behind, text)
    text = re.sub(r"(?<![^\W_])([ATG]W)(?=(?:angle|speed|spd|dir))", r"\1 ", text)
    for word in _WORD.findall(text.replace("µ", "u")):
        if word[0].isdigit():
            found.append(word)
        elif word.isupper() or word.islower():
            joined = _SPEED_AND_UNIT.fullmatch(word.lower())
            found.extend(joined.groups() if joined is not None else parted(word.lower()))
        else:
            found.extend(part for cut in _CAMEL.findall(word) for part in parted(cut.lower()))
    return _abbreviations(found)


def _abbreviations(words: list[str]) -> list[str]:
    """Words of which those of a vessel's wind in two parts are one, as "AW_angle" is AWA and "TW_Dir" is TWD."""
    found: list[str] = []
    for word in words:
        letter = _VESSEL_WIND.get(word)
        if letter is not None and found and found[-1] in ("aw", "tw", "gw"):
            found[-1] += letter
        else:
            found.append(word)
    return found


def _strange(text: str) -> str:
    """What stands in brackets at the end of a heading as a unit does, such as "gon" or "V"."""
    found = re.search(r"[\[(<{]\s*([^\W\d_]{1,4})\s*[\])>}]\s*$", text)
    return found[1] if found is not None and "°" not in text else ""


def _height(text: str) -> float | None:
    found = _HEIGHT.findall(text.replace("_", " "))
    return float(found[0]) if len(found) == 1 and 0 < float(found[0]) <= 500 else None


def _unit(text: str, stated: str) -> tuple[str, str | None]:
    """The heading without its unit, and the unit."""
    below = _known(stated.strip().strip("[]()<>"))
    if len(text) > 1 and text.lower() != "pa" and below is None and (whole := _known(text)) is not None:
        return text, whole  # Pa alone is a pressure of the air, in whatever unit
    for found in _BRACKET.finditer(text):
        inside = _known(re.sub(r"^\s*(?:units?\s*[=:]\s*|(?:in|en|em)\s+)|[\"']", "", found[1]))
        if inside is not None:
            return text[: found.start()] + " " + text[found.end() :], inside
    # HOBO writes the serial numbers of logger and sensor in brackets: they tell no instruments of one file apart.
    text = re.sub(r"\([^)]*\b(?:S/N|LGR|SEN)\b[^)]*\)?", "", text).strip()
    if below is not None:
        return text, below
    mangled = re.search(r"\.+((?:X\.)?(?:m\.s|km\.h|mph|kn|kts|knots|m\.s\.1|deg|C|hPa|mbar))\.*$", text)
    if mangled is not None and (inside := _known(mangled[1].replace(".1", "-1").replace(".", "/"))) is not None:
        return text[: mangled.start()], inside
    glued = _GLUED.search(text)
    if glued is not None:
        spelt = re.sub(r"[._]", "/", glued["unit"]).lower().replace("miles", "mph").replace("km/ph", "km/h")
        if (inside := _known(spelt)) is not None:
            return text[: glued.start("unit")], inside
    averaged = _MEAN_BEHIND.search(text)
    if averaged is not None and (inside := _unit(text[: averaged.start()], "")[1]) is not None:
        return f"{_unit(text[: averaged.start()], '')[0]} {averaged['mean']}", inside
    pieces = re.split(r"(\s*,\s*|\s+|_|;|:|-(?=[a-zA-Z]))", text)
    for count in (5, 3, 1):
        # At the end ("wind_speed_km_h", "Wind Speed, m/s") and at the beginning ("m/s Wind Speed").
        if len(pieces) > count:
            for part, others in ((pieces[-count:], pieces[:-count]), (pieces[:count], pieces[count:])):
                joined = "".join(part)
                if count > 1 and not re.search(r"[\d/]|per|m_s|km_h|deg|kilo|m[ _]s", joined, re.IGNORECASE):
                    continue
                if joined.lower() in ("c", "f") and _OF_WIND & set(_words("".join(others))):
                    continue  # WS_c is the third of several
                for way in (joined, re.sub(r"[_ ]", "/", joined), re.sub(r"[_ ]", "", joined)):
                    inside = _known(way)
                    if inside is not None and inside not in ("m", "s", "Hz", "px", "1", "ft", "cm", "mm", "K", "rad"):
                        return "".join(others), inside
    return text, None


def _known(words: str) -> str | None:
    """The table's name of a unit, where a text spells one; "ms" is metres a second in a log of wind."""
    text = words.strip().strip(".").strip()
    if not text or len(text) > 40:
        return None
    if text.lower() in ("ms", "m/s/1", "m_s"):
        return "m/s"
    if text.lower() == "km/h/1":
        return "km/h"
    return spelled(text)


def _quantity(words: list[str], compact: str, unit: str | None, rest: str) -> tuple[str, bool, set[str]]:
    """The channel, whether the words name it (or only the unit does), and the words that do."""
    known = set(words)
    si = UNITS[unit].si if unit is not None else None
    windy = bool(known & WIND) or compact.startswith(("wind", "wnd"))
    if words[:1] == ["w"] and words[1:2] and words[1] in {*SPEED, *DIRECTION} - {"vel", "velocity"}:
        windy = True
    component = _component(words, si)
    if component is not None:
        return component, True, set(words) & {*_COMPONENTS, "velocity", "vel", "speed", "comp", "component"}
    if known & WIND and si in (None, "rad") and known & COURSES and not known - WIND - MEAN - COURSES - {"deg"}:
        return "wind_direction", True, known & COURSES
    if si in (None, "rad", "1") or windy:
        away = known & DIRECTION
        if (away or re.search(r"wind?.?dir|windricht|wind_?ri\b|^wd\d*$|winddeg", compact)) and si in (None, "rad"):
            sure = windy or bool(known & {"dir", "wd", "wdir", "drct", "dd", "vane", "wvane"}) or "dir" in compact
            if away and away <= {"deg", "azimuth", "bearing", "angle"} and not windy and not known & {"awa", "twa"}:
                return "", False, set()
            return _by_platform(known, "direction"), sure, known & (DIRECTION | _APPARENT | _THEORETICAL)
        if si == "rad" and windy and not known - WIND - MEAN - PLAIN:
            return _by_platform(known, "direction"), True, known & WIND
    if si in (None, "m/s"):
        for word, channel in _ABBREVIATED.items():
            if word in known and (si == "m/s") <= channel.endswith("speed"):
                return channel, True, {word}
        named = known & SPEED or (known & {"strength"} if windy else set())
        if named or re.search(r"wind.?(speed|spd|vel|geschw)|^ws\d*$|^wspd|^spd", compact) or (windy and si == "m/s"):
            return (
                _by_platform(known, "speed"),
                bool(named - {"sp"}) or windy,
                named | (known & (_APPARENT | _THEORETICAL)),
            )
        if windy and words[-1] == "from" and si in (None, "rad"):
            return "wind_direction", True, known & WIND
        if windy and (not known - WIND - MEAN - (PLAIN - {"d", "u"}) or _of_a_place(known)):
            return "wind_speed", True, known & WIND
        if _of_a_cup(words):
            return "wind_speed", True, {"cup"}
        if known >= {"sonic", "scalar"} and not known & weather_words.ALL:
            return "wind_speed", True, {"scalar"}  # the mean of a sonic's speeds, beside that of its vectors
    if si in (None, "rad") and known & {"awa", "twa", "awd"}:
        word = next(iter(sorted(known & {"awa", "twa", "awd"})))
        return _ABBREVIATED[word], True, {word}
    if si == "m/s" and not known & OTHER:
        return "wind_speed", False, set()
    return ("", False, set()) if windy else weather_words.channel(words, compact, si)


def _of_a_cup(words: list[str]) -> bool:
    """Whether a heading names a cup anemometer, and beside it its height, side or statistic alone ("Cup116m_Mean")."""
    known = {word for word in words if len(word) > 2 and not word.isdigit()}
    return "cup" in known and known <= {"cup", *MEAN, *SPREAD, *PLAIN, "north", "east", "south", "west"}


def _of_a_place(known: set[str]) -> bool:
    """Whether a heading says the wind and whose it is, and no more ("Station1_WND", "Mast B wind")."""
    rest = known - WIND - MEAN - PLACES
    marks = rest - {*_COMPONENTS, "d"}
    return bool(known & PLACES) and rest == marks and all(word.isdigit() or len(word) == 1 for word in marks)


def _misstated(known: set[str], unit: str | None) -> str:
    """The unit of a speed behind words that are of a direction alone; "" where there is none."""
    if unit is None or UNITS[unit].si != "m/s" or known & (SPEED | OTHER | _COMPONENTS.keys()):
        return ""
    return unit if known & SURE_DIRECTION else ""


def _component(words: list[str], si: str | None) -> str | None:
    if si not in (None, "m/s"):
        return None
    core = [word for word in words if word not in MEAN and not word.isdigit()]
    head = [word for word in core if word not in _SENSORS]
    if head and head[0] in ("u", "v", "w") and head[1:2] and head[1] in ("x", "y", "z"):
        return _COMPONENTS[head[1]]
    if head and head[-1] in _COMPONENTS and "wind" in words and set(head[:-1]) <= {"speed", "vel", "velocity"}:
        return _COMPONENTS[head[-1]]
    if not head or head[0] not in _COMPONENTS:
        return None
    if head[0] == "w" and head[1:2] and head[1] in {*SPEED, *DIRECTION} - {"vel", "velocity"}:
        return None
    if head[0] in ("u", "v") and head[1:2] and head[1] in _ENDING_IN_DIRECTION:
        return None
    if head[0] in ("x", "y", "z", "vx", "vy", "vz") and not set(core) & {"wind", "sonic", "csat"}:
        return None
    if "star" in head or (len(head) > 1 and head[1] in _COMPONENTS):
        return None
    return _COMPONENTS[head[0]]


def _by_platform(known: set[str], quantity: str) -> str:
    if quantity == "direction" and "angle" in known and known & {"true", "réel", "reel", "real"}:
        return "theoretical_wind_direction"  # an angle of the true wind is from the bow
    if known & _APPARENT:
        return f"apparent_wind_{quantity}"
    if known & _THEORETICAL:
        return f"theoretical_wind_{quantity}"
    return f"wind_{quantity}"


def fits(channel: str, unit: str | None) -> bool:
    """Whether a unit is one of a channel's quantity."""
    return unit is not None and UNITS[unit].si == CHANNELS[channel].unit
