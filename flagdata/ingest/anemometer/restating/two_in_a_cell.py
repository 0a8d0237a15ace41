"""Tables with the wind's direction and speed in one cell, cut into two.

2026-05-01 12:00,WSW 4.3 km/h        or 249@4.3, 249/12, 12 kt from SW, 4.3/249 below "speed/direction",
                                     pn.-zach. 27 km/h and the like in other languages

Two plain numbers are told apart by the order of the words in the heading, else by their values: no wind is faster than
a hundred of any unit day after day, and no direction has decimals where the speed has none.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass

from flagdata.compass import CALM, POINTS, STILL, in_letters, table_of
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.sniffing import HEAD_LINES
from flagdata.ingest.anemometer.text.layout import Layout, cut, lay_out
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.words.headings import interest, understand, words_of
from flagdata.units import UNITS, spelled

_SIGN = r"(?:°|degrees?\b|deg\b)"
_ANGLE = rf"\d{{1,3}}(?:\.\d+)?(?=\s?{_SIGN}|\s*[@/]|\s+at\b)"
_DIRECTION = rf"(?P<direction>{_ANGLE}|VRB|variable|[A-Za-z]{{1,3}}(?![A-Za-z/]))\s?{_SIGN}?"
_SPEED = r"(?P<speed>\d{1,3}(?:[.,]\d+)?)\s?(?P<unit>[^\W\d_]{1,5}(?:/[^\W\d_])?)?"
_FIRST = re.compile(rf"{_DIRECTION}\s*(?:@|/|,|at)?\s*{_SPEED}", re.IGNORECASE)
_LAST = re.compile(rf"{_SPEED}\s*(?:from|@|/)?\s+{_DIRECTION.replace('(?=', '(?=$|')}", re.IGNORECASE)
_WORDS_FIRST = re.compile(rf"(?P<direction>[^\W\d_][^\d@/]*?)\s*{_SPEED}", re.IGNORECASE)
_WORDS_LAST = re.compile(rf"{_SPEED}\s+(?P<direction>[^\W\d_][^\d@/]*)", re.IGNORECASE)
"""A point of the compass in letters or words of any language, beside a speed with its unit."""
_PAIR = re.compile(r"(\d{1,3}(?:[.,]\d+)?)\s?°?\s*[/|]\s*(\d{1,3}(?:[.,]\d+)?)\s?°?")
"""Two plain numbers, of which either may be the speed."""
_PARTS = re.compile(r"\s*[/|,;&+]\s*|\s+(?:and|und|et|y|e|og|och)\s+")
"""What stands between the two words of a heading."""
_FASTEST = 100
"""A speed that no wind has, in any of the usual units, and many directions."""
_GALE, _HALF_TURN, _TURN = 60, 180, 360
"""Below a heading that says nothing, speeds [any unit] and directions [deg] that tell a pair of them."""
_NAMES = frozenset(
    {
        "wind", "winds", "viento", "vent", "vento", "wnd", "wiatr", "vind", "tuuli", "tuul", "szél", "vítr", "vietor",
        "vjetar", "veter", "rüzgar", "ветер", "вятър", "вітер", "angin", "vânt", "άνεμος",
    }
)  # fmt: skip
_SHARE = 0.9
_LEAST = 3


def matches(lines: Sequence[str]) -> bool:
    """Whether a column is called after the wind and holds both in nearly every cell."""
    hinted = any(word in line.lower() for line in lines for word in (*_NAMES, "dir"))
    return (hinted or any(_PAIR.search(line) for line in lines)) and _column(lines) is not None


def as_table(source: TextFile) -> TableText | None:
    """The table with the direction and the speed in columns of their own, behind the others."""
    found = _column(source.head(HEAD_LINES))
    if found is None:
        return None
    layout, column = found.layout, found.column
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    heading = [name or f"column {at}" for at, name in enumerate(layout.names, start=1)]
    others = [at for at in range(len(heading)) if at != column]
    speed = f"wind speed [{found.unit}]" if found.unit else "wind speed"
    writer.writerow([*(heading[at] for at in others), "wind direction", speed])
    short = 0
    for number, lines in source.blocks():
        for line in lines[max(0, layout.lines[0] - number) :]:
            cells = cut(line, layout.delimiter)
            if len(cells) < len(heading):
                short += bool(line.strip())
                continue
            writer.writerow([*(cells[at] for at in others), *found.parts(cells[column])])
    order = "speed and direction" if found.speed_first else "direction and speed"
    text = f"column {layout.names[column]!r} holds {order}: read as two columns behind the others"
    notes = [Finding(kind="two-in-a-cell", severity=Severity.NOTE, what=text)]
    if not found.sure:
        text = f"no heading says that column {layout.names[column]!r} is a wind: taken as its {order} by the numbers"
        fix = "check the file's description"
        notes.append(Finding(kind="heading-doubtful", severity=Severity.WARNING, what=text, fix=fix))
    if short:
        what = f"{short} lines have fewer columns than the table; left out"
        notes.append(Finding(kind="malformed-lines", severity=Severity.ERROR, count=short, what=what))
    return TableText.of(source, out.getvalue().splitlines(), notes)


@dataclass(frozen=True, kw_only=True)
class _Both:
    """The column of a table that holds the wind's direction and its speed.

    Attributes:
        layout: of the table.
        column: its index.
        unit: the one that all speeds are written with; "" where none is.
        speed_first: whether the first of two plain numbers is the speed.
        sure: whether the heading says that it is a wind.
        points: the table of the compass by which words are its points (see `compass.BY_UNIT`); "" where there are none.
    """

    layout: Layout
    column: int
    unit: str
    speed_first: bool
    sure: bool
    points: str = ""

    def parts(self, cell: str) -> tuple[str, str]:
        """Direction and speed of a cell, "" for what it does not hold."""
        if not self.points:
            both = _both(cell, speed_first=self.speed_first)
            return ("", "") if both is None else both[:2]
        both = _in_words(cell)
        return ("", "") if both is None else (in_letters(both[0], self.points), both[1])


def _column(lines: Sequence[str]) -> _Both | None:
    """The column that holds both; `None` where none does."""
    layout = lay_out(lines, interest=interest)
    if layout is None:
        return None
    for column, name in enumerate(layout.names):
        words = set(words_of(name))
        quantities = _quantities(name)
        named = bool(words & _NAMES or ({"dir"} <= words and words & {"spd", "speed"}) or len(quantities) == 2)
        cells = [cell for cell in layout.column(column) if cell and cell.lower() not in CALM]
        if not named and not _surely_both(layout, cells):
            continue
        speed_first = _speed_first(quantities, cells)
        both = [found for cell in cells if (found := _both(cell, speed_first=speed_first)) is not None]
        units = {unit for _, _, unit in both}
        if len(both) >= max(_LEAST, _SHARE * len(cells)) and len(units) == 1:
            return _Both(layout=layout, column=column, unit=units.pop(), speed_first=speed_first, sure=named)
        spoken = [found for cell in cells if (found := _in_words(cell)) is not None]
        units = {unit for _, _, unit in spoken if unit}
        points = table_of([direction for direction, _, _ in spoken if direction], heading=name, share=_SHARE)
        if points is not None and len(spoken) >= max(_LEAST, _SHARE * len(cells)) and len(units) == 1:
            unit = units.pop()
            return _Both(layout=layout, column=column, unit=unit, speed_first=False, sure=named, points=points)
    return None


def _quantities(name: str) -> tuple[str, ...]:
    """The quantities that the two parts of a heading such as "speed/direction" name; () for any other heading."""
    parts = _PARTS.split(re.sub(r"[\[(].*?[\])]", "", name).strip())
    found = tuple(understand(part).channel.removeprefix("wind_") for part in parts if part)
    return found if set(found) == {"speed", "direction"} and len(found) == 2 else ()


def _pairs(cells: Sequence[str]) -> list[tuple[str, str]]:
    """The two numbers of each cell, where nearly every cell holds two; else none."""
    found = [(match[1], match[2]) for cell in cells if (match := _PAIR.fullmatch(cell.strip())) is not None]
    return found if len(found) >= max(_LEAST, _SHARE * len(cells)) else []


def _highest(numbers: Sequence[str]) -> float:
    return max(float(text.replace(",", ".")) for text in numbers)


def _speed_first(quantities: tuple[str, ...], cells: Sequence[str]) -> bool:
    """Whether the first of two plain numbers is the speed."""
    pairs = _pairs(cells)
    if not pairs:
        return False
    if quantities:
        return quantities[0] == "speed"
    first, second = zip(*pairs, strict=True)
    if max(_highest(first), _highest(second)) > _FASTEST:
        return _highest(second) > _highest(first)
    return any(re.search(r"[.,]", text) for text in first) and not any(re.search(r"[.,]", text) for text in second)


def _surely_both(layout: Layout, cells: Sequence[str]) -> bool:
    """Whether a column whose heading says nothing holds a speed with decimals and a whole direction, by its numbers."""
    pairs = _pairs(cells)
    if not pairs or any("wind" in understand(name).quantity for name in layout.names):
        return False
    first, second = zip(*pairs, strict=True)
    whole = all(text.isdigit() for text in second) and any(re.search(r"[.,]", text) for text in first)
    return whole and _highest(first) <= _GALE and _HALF_TURN < _highest(second) <= _TURN


def _is_of_speed(unit: str) -> bool:
    name = spelled(unit)
    return name is not None and UNITS[name].si == "m/s"


def _in_words(cell: str) -> tuple[str, str, str] | None:
    """Direction, speed and unit of a cell whose direction is in letters or words; calm air has none."""
    if cell.strip().lower() in STILL:
        return "", cell.strip(), ""
    for shape in (_WORDS_FIRST, _WORDS_LAST):
        match = shape.fullmatch(cell.strip())
        if match is not None and match["unit"] and _is_of_speed(match["unit"]):
            return match["direction"].strip(), match["speed"].replace(",", "."), match["unit"]
    return None


def _both(cell: str, *, speed_first: bool) -> tuple[str, str, str] | None:
    """Direction, speed and unit of a cell; `None` where it holds something else. Calm air has no direction."""
    if cell.strip().lower() in STILL:
        return "", cell.strip(), ""
    pair = _PAIR.fullmatch(cell.strip()) if speed_first else None
    if pair is not None:
        return pair[2].replace(",", "."), pair[1].replace(",", "."), ""
    for shape in (_FIRST, _LAST):
        match = shape.fullmatch(cell.strip())
        if match is None:
            continue
        direction, unit = match["direction"], match["unit"] or ""
        if unit and not _is_of_speed(unit):
            continue
        if direction.lower() in CALM:
            return "", match["speed"].replace(",", "."), unit
        if direction[0].isdigit() or direction.upper() in POINTS:
            return direction, match["speed"].replace(",", "."), unit
    return None
