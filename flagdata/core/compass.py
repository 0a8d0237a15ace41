"""Points of the compass as logs write them: letters and words of several languages, in degrees
clockwise from north.

A letter may be the west of one language and the east of another: O is Ost in German and Oeste in
Spanish. So each language is a table of its own, and a column of points has the table's name as its
unit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

_ROSE = (
    "N",
    "NNE",
    "NE",
    "ENE",
    "E",
    "ESE",
    "SE",
    "SSE",
    "S",
    "SSW",
    "SW",
    "WSW",
    "W",
    "WNW",
    "NW",
    "NNW",
)
_POINT = 22.5
_DEGREES = {name: number * _POINT for number, name in enumerate(_ROSE)}
_WORDS: dict[str, tuple[str, str, str, str]] = {
    "en": ("NORTH", "EAST", "SOUTH", "WEST"),
    "de": ("NORD", "OST", "SÜD", "WEST"),
    "nl": ("NOORD", "OOST", "ZUID", "WEST"),
    "fr": ("NORD", "EST", "SUD", "OUEST"),
    "it": ("NORD", "EST", "SUD", "OVEST"),
    "es": ("NORTE", "ESTE", "SUR", "OESTE"),
    "pt": ("NORTE", "LESTE", "SUL", "OESTE"),
    "no": ("NORD", "ØST", "SØR", "VEST"),
    "da": ("NORD", "ØST", "SYD", "VEST"),
    "sv": ("NORR", "ÖST", "SÖDER", "VÄST"),
}
"""North, east, south and west."""
_JOINED = {
    "NOR": "N",
    "NORD": "N",
    "SUR": "S",
    "SUD": "S",
    "ESTE": "E",
    "OESTE": "W",
    "LES": "E",
    "LESTE": "E",
}
"""How Spanish and Portuguese begin the names of points between."""


def _spell_points(words: Sequence[str]) -> dict[str, float]:
    """Spells every point in the words for north, east, south and west, joined by nothing, a blank
    or a hyphen."""
    of = dict(zip("NESW", words, strict=True))
    points: dict[str, float] = {}
    for point, degrees in _DEGREES.items():
        for sign in ("", " ", "-"):
            points[sign.join(of[letter] for letter in point)] = degrees
            if len(point) == 3:
                points[f"{of[point[0]]}{sign}{of[point[1]]}{of[point[2]]}"] = degrees
    return points


def _iberian() -> dict[str, float]:
    """Spells NORESTE, SUROESTE, NORDESTE, ESTENORESTE and the like."""
    ends = {"E": "ESTE", "W": "OESTE"}
    between = {
        start + ends[east]: side + east
        for start, side in _JOINED.items()
        if side in "NS"
        for east in ends
    }
    points = {name: _DEGREES[point] for name, point in between.items()}
    for name, point in between.items():
        for start, side in _JOINED.items():
            joined = side + point
            if joined in _DEGREES:
                points |= {f"{start}{sign}{name}": _DEGREES[joined] for sign in ("", " ", "-")}
    return points


def _russian() -> dict[str, float]:
    """Spells СЕВЕРО-ВОСТОК, of the wind СЕВЕРО-ВОСТОКА, as the weather pages rp5 say "Ветер, дующий
    с северо-востока"."""
    of = {"N": "СЕВЕР", "E": "ВОСТОК", "S": "ЮГ", "W": "ЗАПАД"}
    points: dict[str, float] = {}
    for point, degrees in _DEGREES.items():
        name = "".join(f"{of[letter]}О-" for letter in point[:-1]) + of[point[-1]]
        points |= dict.fromkeys((name, f"{name}А", f"ВЕТЕР, ДУЮЩИЙ С {name}А"), degrees)
    return points


def _blowing() -> dict[str, float]:
    """Spells WIND BLOWING FROM THE SOUTH-SOUTHWEST or NORTH-EAST, as the weather pages rp5 say in
    English."""
    of = dict(zip("NESW", _WORDS["en"], strict=True))
    points: dict[str, float] = {}
    for point, degrees in _DEGREES.items():
        first, last = ([of[letter] for letter in part] for part in (point[:-2], point[-2:]))
        for name in ("-".join([*first, "".join(last)]), "-".join([*first, *last])):
            points[f"WIND BLOWING FROM THE {name}"] = degrees
    return points


def _polish() -> dict[str, float]:
    """Spells PN., PN.-ZACH. and ZACH.PN.-ZACH., as Polish shortens północ, południe, wschód and
    zachód; the dots may lack."""
    of = {"N": "PN.", "E": "WSCH.", "S": "PD.", "W": "ZACH."}
    points: dict[str, float] = {}
    for point, degrees in _DEGREES.items():
        name = "".join(of[letter] for letter in point[:-2]) + "-".join(
            of[letter] for letter in point[-2:]
        )
        points |= dict.fromkeys((name, name.replace(".", "")), degrees)
    return points


def _letters(north: str, east: str, south: str, west: str) -> dict[str, float]:
    of = {"N": north, "E": east, "S": south, "W": west}
    return {"".join(of[letter] for letter in point): degrees for point, degrees in _DEGREES.items()}


_KANJI = {"N": "北", "E": "東", "S": "南", "W": "西"}
# Japanese joins the letters as English does (北東, 東北東);
# Chinese puts east and west first (东北, 东东北).
_FAR_EAST = {
    "".join(_KANJI[letter] for letter in spelled): _DEGREES[point]
    for point in _ROSE
    for spelled in {point, point[:-2] + point[-2:][::-1]}
}
_NAMES: dict[str, float] = (
    {name: degrees for words in _WORDS.values() for name, degrees in _spell_points(words).items()}
    | _iberian()
    | _russian()
    | _blowing()
    | _polish()
)
_COMMON = (
    _NAMES | _FAR_EAST | {name.replace("東", "东"): degrees for name, degrees in _FAR_EAST.items()}
)

POINTS: Mapping[str, float] = _COMMON | _DEGREES
"""English letters, and the words of all languages: "points"."""
BY_UNIT: Mapping[str, Mapping[str, float]] = {
    "points": POINTS,
    "points-de": _COMMON | _letters("N", "O", "S", "W"),
    "points-nl": _COMMON | _letters("N", "O", "Z", "W"),
    "points-es": _COMMON | _letters("N", "E", "S", "O"),
    "points-pt": _COMMON | _letters("N", "L", "S", "O"),
    "points-da": _COMMON | _letters("N", "Ø", "S", "V"),
    "points-sv": _COMMON | _letters("N", "Ö", "S", "V"),
    "points-ru": _COMMON | _letters("С", "В", "Ю", "З"),
    "points-tr": _COMMON | _letters("K", "D", "G", "B"),
}
"""Points, upper-case → degrees, by the unit of a column of them."""
_HEADINGS = {
    "points-de": ("richtung",),
    "points-nl": ("richting",),
    "points-es": ("viento", "vento", "vent", "dirección", "direccion", "direzione"),
    "points-pt": ("vento", "direção"),
}
"""Words of a heading that identify its language."""
STILL = frozenset(
    {
        "c",
        "calm",
        "calm wind",
        "calm winds",
        "calm, no wind",
        "still",
        "calma",
        "calmo",
        "windstille",
        "calme",
        "штиль",
        "штиль, безветрие",
        "stil",
        "stille",
        "vindstille",
        "windstil",
        "no wind",
        "静穏",
        "静风",
        "靜風",
        "無風",
        "无风",
        "静稳",
    }
)
"""Words for calm air: a speed of 0 and no direction."""
CALM = STILL | {
    "none",
    "variable",
    "vrb",
    "var",
    "cvr",
    "cv",
    "cal",
    "umlaufend",
    "variabel",
    "風向不定",
    "风向不定",
    "不定",
    "переменное направление",
    "ветер переменного направления",
    "variable wind direction",
}
"""What stands in a column of points where there is no direction."""


def table_of(cells: Sequence[str], *, heading: str, share: float) -> str | None:
    """Names the unit of a column of points of the compass; `None` where it holds something else, or
    two may be meant.

    Args:
        cells: trimmed, without those that are missing.
        heading: of the column, whose language decides where letters alone do not.
        share: of the cells that must be points; calm air counts neither way.
    """
    filled = [cell.upper() for cell in cells if cell.lower() not in CALM]
    if not filled:
        return None
    fitting = [
        unit
        for unit, points in BY_UNIT.items()
        if sum(cell in points for cell in filled) >= share * len(filled)
    ]
    if not fitting:
        return None
    kinds = {cell for cell in filled if any(cell in BY_UNIT[unit] for unit in fitting)}
    if "points" in fitting or all(
        len({BY_UNIT[unit].get(cell) for unit in fitting}) == 1 for cell in kinds
    ):
        return fitting[0]
    named_by_heading = [
        unit for unit in fitting if any(word in heading.lower() for word in _HEADINGS.get(unit, ()))
    ]
    return named_by_heading[0] if named_by_heading else None
