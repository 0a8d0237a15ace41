"""Whether a direction is where the wind comes from, by components of the same wind in the same rows.

Towards east u = −V sin d and towards north v = −V cos d, where the wind of speed V comes from d. A direction with
u = V sin d and v = V cos d is either where the wind blows to, or the components are of where it comes from.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.words.headings import understand, words_of

_CLOSE, _LEAST = 0.02, 0.05
"""Share of a speed, and its unit, within which the components of a row make it."""
_TURN, _BLOWING, _SHARE, _ROWS = 5.0, 0.5, 0.9, 2
"""Largest difference of two angles [deg], the speed [in its unit] from which a row has one, and in which share of at
least how many rows they must agree."""
_WIDEST = 60
"""Columns of numbers that are looked through; a wider table's other columns are not."""
_EAST = re.compile(r"[vwu]{0,2}x|u|u-?(?:wnd|wind|comp)|e|east\w*|zonal")
_NORTH = re.compile(r"[vwu]{0,2}y|v|v-?(?:wnd|wind|comp)|n|north\w*|meridional")
"""Words of components towards east and north."""


@dataclass(frozen=True, kw_only=True)
class Components:
    """Two columns that are the components of a speed, and what they say of its direction.

    Attributes:
        x, y: the columns, towards east and north where the direction is the wind's.
        opposite: whether the direction is where (x, y) points to, not where it comes from.
    """

    x: int
    y: int
    opposite: bool


def beside(
    layout: Layout, speed: int, direction: int, *, towards: bool = False, apart: Collection[int] = ()
) -> Components | None:
    """The components of a speed and a direction in other columns of a table; `None` where it has none.

    Components that fit a direction where the wind comes from go before those that fit its opposite.

    Args:
        speed, direction: their columns; the direction is in degrees.
        towards: whether the direction is taken as where the wind blows to.
        apart: columns that are none, such as the time's.
    """
    value = {at: _numbers(layout, at) for at in range(layout.number_of_columns()) if at not in {direction, *apart}}
    if speed not in value:
        return None
    length = value.pop(speed)
    angle = _numbers(layout, direction) + (180.0 if towards else 0.0)
    rows = np.isfinite(length) & np.isfinite(angle) & (length >= _BLOWING)
    candidates = [at for at, own in value.items() if _part_of(own[rows], length[rows])][:_WIDEST]
    if int(rows.sum()) < _ROWS:
        return None
    found = [
        Components(x=x, y=y, opposite=opposite)
        for x, y in permutations(candidates, 2)
        if _in_order(layout, x, y) and _make(value[x][rows], value[y][rows], length[rows])
        for opposite in (False, True)
        if _agree(value[x][rows], value[y][rows], angle[rows] + (180.0 if opposite else 0.0))
    ]
    return min(found, key=lambda one: one.opposite) if found else None


def opposite(layout: Layout, x: int, y: int, direction: int) -> bool:
    """Whether a direction is where (x, y) points to, of components in columns x (east) and y (north)."""
    value = [_numbers(layout, at) for at in (x, y)]
    angle = _numbers(layout, direction)
    rows = np.isfinite(angle) & (np.hypot(*value) >= _BLOWING)
    return int(rows.sum()) >= _ROWS and _agree(value[0][rows], value[1][rows], angle[rows] + 180.0)


def _numbers(layout: Layout, index: int) -> NDArray[np.float64]:
    return numbers(layout.column(index), decimal=layout.decimal).value


def _part_of(value: NDArray[np.float64], length: NDArray[np.float64]) -> bool:
    """Whether numbers are nowhere longer than a speed, and not zero throughout."""
    known = np.isfinite(value)
    close = np.abs(value[known]) <= length[known] * (1 + _CLOSE) + _LEAST
    return bool(known.any()) and float(close.mean()) >= _SHARE and bool(np.any(value[known] != 0))


def _make(x: NDArray[np.float64], y: NDArray[np.float64], length: NDArray[np.float64]) -> bool:
    off = np.abs(np.hypot(x, y) - length)
    known = np.isfinite(off)
    close = off[known] <= _CLOSE * length[known] + _LEAST
    return int(known.sum()) >= _ROWS and float(close.mean()) >= _SHARE


def _agree(x: NDArray[np.float64], y: NDArray[np.float64], angle: NDArray[np.float64]) -> bool:
    """Whether the wind (x, y) comes from an angle clockwise from north [deg]."""
    off = np.degrees(np.arctan2(-x, -y)) - angle
    off = np.abs((off[np.isfinite(off)] + 180.0) % 360.0 - 180.0)
    return len(off) >= _ROWS and float((off <= _TURN).mean()) >= _SHARE


def _in_order(layout: Layout, x: int, y: int) -> bool:
    """Whether two columns may be towards east and north, in this order, by their headings."""
    said = [_axis(layout, at) for at in (x, y)]
    return said[0] != "y" and said[1] != "x"


def _axis(layout: Layout, index: int) -> str:
    """ "x" or "y" where the heading of a column says which component it is, else ""."""
    channel = understand(layout.names[index], layout.units[index]).channel
    if channel in ("wind_x", "wind_y"):
        return channel[-1]
    said = words_of(layout.names[index])
    east, north = (any(axis.fullmatch(word) for word in said) for axis in (_EAST, _NORTH))
    return "" if east == north else "x" if east else "y"
