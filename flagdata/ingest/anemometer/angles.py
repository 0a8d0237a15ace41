"""Which columns may be angles of a wind's direction, though their headings do not say so."""

from __future__ import annotations

import numpy as np

from flagdata.ingest.anemometer.cells import numbers
from flagdata.ingest.anemometer.headings import understand, words_of
from flagdata.ingest.anemometer.instruments import compass_unit
from flagdata.ingest.anemometer.layout import Layout

_DIRECTIONS = frozenset(
    {"dir", "direction", "degrees", "degree", "deg", "bearing", "angle", "wd", "dd", "azimuth", "wa"}
)
_OTHERS = frozenset(
    {
        "lat", "latitude", "lon", "lng", "long", "longitude", "heading", "hdg", "course", "cog", "roll", "pitch", "yaw",
        "tilt", "sun", "solar", "elevation", "temp", "temperature", "gust", "max", "min", "std", "sd", "sigma", "wave",
        "swell", "current", "chill", "f", "c",
    }
)  # fmt: skip
"""Words of angles and degrees of other quantities."""
_TURN = 361.0
_NORTHS = frozenset({"true", "mag", "degt", "degm", "deg true", "deg mag"})
"""Units of directions, from true or magnetic north."""


def may_be_direction(layout: Layout, index: int) -> bool:
    """Whether a column holds points of the compass, or angles below a heading that may be one of a direction."""
    words = set(words_of(layout.names[index]))
    heading = understand(layout.names[index], layout.units[index])
    if words & _OTHERS or heading.spread:
        return False
    if compass_unit(layout, index) is not None:
        return True
    if not (words & _DIRECTIONS or heading.unit == "deg" or layout.units[index].strip().lower() in _NORTHS):
        return False
    value = numbers(layout.column(index), decimal=layout.decimal).value
    known = value[np.isfinite(value)]
    return len(known) > 0 and bool(np.all((known >= 0) & (known <= _TURN)))


def unit_of(layout: Layout, index: int) -> str:
    """The unit that a column of angles is likely in: points of the compass, radians, or degrees."""
    points = compass_unit(layout, index)
    if points is not None:
        return points
    value = numbers(layout.column(index), decimal=layout.decimal).value
    known = value[np.isfinite(value)]
    turned = len(known) > 0 and float(np.abs(known).max()) <= 2 * np.pi and bool(np.any(known % 1 != 0))
    return "rad" if turned else "deg"


def in_tens(layout: Layout, index: int) -> bool:
    """Whether a column may hold tens of degrees: whole numbers to 36, and 99 for a variable wind."""
    value = numbers(layout.column(index), decimal=layout.decimal).value
    known = value[np.isfinite(value) & (value != 99)]
    return len(known) > 0 and float(known.max()) <= 36 and bool(np.all(known % 1 == 0))
