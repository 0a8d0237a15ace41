"""Columns of angles: points of the compass, vanes, and what may be a direction though its heading does not say so."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flagdata import compass
from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.winds import radiation
from flagdata.ingest.anemometer.winds.directions import holds_marks
from flagdata.ingest.anemometer.words.headings import Heading, understand, words_of
from flagdata.units import UNITS

_DIRECTIONS = frozenset(
    {"dir", "direction", "degrees", "degree", "deg", "bearing", "angle", "wd", "dd", "azimuth", "wa", "dw", "drct"}
)
_ENDS = ("dir", "direction", "richtung")
"""Ends of words that are made of another and of that of a direction, such as "udir"."""
_OTHERS = frozenset(
    {
        "lat", "latitude", "lon", "lng", "long", "longitude", "heading", "hdg", "course", "cog", "roll", "pitch", "yaw",
        "tilt", "sun", "solar", "elevation", "temp", "temperature", "gust", "max", "min", "std", "sd", "sigma", "wave",
        "swell", "current", "chill", "f", "c", "vessel", "ship", "boat", "track", "platform", "blade", "rotor", "cable",
    }
)  # fmt: skip
"""Words of angles and degrees of other quantities."""
_TURN = 361.0
_UNREADABLE = 0.1
_NORTHS = frozenset({"true", "mag", "degt", "degm", "deg true", "deg mag"})
"""Units of directions, from true or magnetic north."""
_SIGNS = frozenset({"°", "º", "˚"})
_STANDS = 10
"""Rows in which a direction does not stay the same to its last digit."""
_HOTTEST = 60.0
"""No air is hotter, in °C."""


def may_be_direction(layout: Layout, index: int) -> bool:
    """Whether a column holds points of the compass, or angles below a heading that may be one of a direction."""
    words = set(words_of(layout.names[index]))
    heading = understand(layout.names[index], layout.units[index])
    if words & _OTHERS or heading.spread or radiation.is_direct(layout.names, index):
        return False
    if compass_unit(layout, index) is not None:
        return True
    named = words & _DIRECTIONS or any(word.endswith(_ENDS) for word in words)
    if not (named or heading.unit == "deg" or layout.units[index].strip().lower() in _NORTHS):
        return False
    value = numbers(layout.column(index), decimal=layout.decimal).value
    known = value[np.isfinite(value)]
    if not len(known) or holds_marks(heading, value) or float(known.min()) < 0 or float(known.max()) > _TURN:
        return False
    if len(known) >= _STANDS and len(np.unique(known)) == 1:
        return False  # no vane stands still
    # The sign of degrees alone may as well be that of a temperature.
    return bool(named) or layout.units[index].strip() not in _SIGNS or float(known.max()) > _HOTTEST


def unit_of(layout: Layout, index: int) -> str:
    """The unit that a column of angles is likely in: points of the compass, radians, or degrees."""
    points = compass_unit(layout, index)
    if points is not None:
        return points
    stated = understand(layout.names[index], layout.units[index]).unit
    if stated not in (None, "deg") and UNITS[stated].si == "rad":
        return stated
    value = numbers(layout.column(index), decimal=layout.decimal).value
    known = value[np.isfinite(value)]
    turned = len(known) > 0 and float(np.abs(known).max()) <= 2 * np.pi and bool(np.any(known % 1 != 0))
    return "rad" if turned else "deg"


def in_tens(layout: Layout, index: int) -> bool:
    """Whether a column may hold tens of degrees: whole numbers to 36, and 99 for a variable wind."""
    value = numbers(layout.column(index), decimal=layout.decimal).value
    known = value[np.isfinite(value) & (value != 99)]
    return len(known) > 0 and float(known.max()) <= 36 and bool(np.all(known % 1 == 0))


def compass_unit(layout: Layout, index: int) -> str | None:
    """The unit of a column of points of the compass, by the language of its letters; `None` where it holds none.

    A letter or word that never changes is a point only below a heading that says a direction or a wind.
    """
    if len(set(_filled(layout, index))) < 2 and not may_be_points(understand(layout.names[index], layout.units[index])):
        return None
    headings = " ".join(layout.names)
    return compass.table_of(_filled(layout, index), heading=f"{layout.names[index]} {headings}", share=1 - _UNREADABLE)


def may_be_two(layout: Layout, index: int) -> bool:
    """Whether a column holds points of the compass whose letters mean one direction here and another there."""
    return compass.may_be_two(_filled(layout, index), share=1 - _UNREADABLE)


def _filled(layout: Layout, index: int) -> list[str]:
    return [cell for cell in layout.column(index) if cell_kind(cell) != "missing"]


def degrees(layout: Layout, index: int, unit_name: str) -> NDArray[np.float64]:
    """The cells of a column of points of the compass in degrees, NaN where they are none."""
    points = compass.BY_UNIT[unit_name]
    return np.array([points.get(cell.upper(), np.nan) for cell in layout.column(index)])


def may_be_points(heading: Heading) -> bool:
    """Whether words below a heading may be points of the compass: of a direction, or of a wind in words."""
    return heading.quantity.endswith(("wind_direction", "wind_speed"))


def day_of_month(layout: Layout, index: int) -> bool:
    """Whether a column DD stands in a date written in parts, so that it is no direction."""
    names = [name.strip().upper() for name in layout.names]
    if names[index] not in ("DD", "D"):
        return False
    before, after = names[index - 1] if index else "", names[index + 1] if index + 1 < len(names) else ""
    return before in ("MM", "MO", "M", "MONTH") or after.startswith("HH")
