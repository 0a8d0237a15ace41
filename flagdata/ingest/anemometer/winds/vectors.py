"""Whether a direction is where the wind comes from, by components of the same wind in the same rows.

Towards east u = −V sin d and towards north v = −V cos d, where the wind of speed V comes from d. A direction with
u = V sin d and v = V cos d is either where the wind blows to, or the components are of where it comes from. One that
differs from d by another angle in all rows is of axes that do not point to east and north, and one whose sum with d is
the same in all rows is counted counter-clockwise, as angles are in mathematics.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from itertools import permutations
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.words.headings import understand, words_of

Way = Literal["same", "opposite", "turned", "mirrored"]
"""A direction is where components come from, where they point to, turned by another angle, or counted the other way."""
_CLOSE, _LEAST = 0.02, 0.05
"""Share of a speed, and its unit, within which the components of a row make it."""
_TURN, _BLOWING, _SHARE, _ROWS = 5.0, 0.5, 0.9, 2
"""Largest difference of two angles [deg], the speed [in its unit] from which a row has one, and in which share of at
least how many rows they must agree."""
_VEERING, _SEVERAL, _LOOKED = 10.0, 5, 400
"""Angle [deg] about one direction that the wind must leave, rows from which on the sense of an angle can be told, and
those whose middle is looked for."""
_ORDER: tuple[Way, ...] = ("same", "opposite", "turned", "mirrored")
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
        way: how the direction relates to where (x, y) comes from.
        turn: from (x, y) to the direction, clockwise [deg, from −180 to 180], where `way` is "turned".
    """

    x: int
    y: int
    way: Way
    turn: float = 0.0

    @property
    def opposite(self) -> bool:
        """Whether the direction is where (x, y) points to, not where it comes from."""
        return self.way == "opposite"


def beside(
    layout: Layout, speed: int, direction: int, *, towards: bool = False, apart: Collection[int] = ()
) -> Components | None:
    """The components of a speed and a direction in other columns of a table; `None` where it has none.

    Components that fit a direction where the wind comes from go before those that fit its opposite, and these before
    others, which must be headed as components: in the wrong order any two are mirrored.

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
    found: list[Components] = []
    for x, y in permutations(candidates, 2):
        if _in_order(layout, x, y) and _make(value[x][rows], value[y][rows], length[rows]):
            headed = _axis(layout, x) == "x" and _axis(layout, y) == "y"
            way, turn = _way(value[x][rows], value[y][rows], angle[rows])
            if way in ("same", "opposite") or (way is not None and headed):
                found.append(Components(x=x, y=y, way=way, turn=turn))
    return min(found, key=lambda one: _ORDER.index(one.way)) if found else None


def way_of(layout: Layout, x: int, y: int, direction: int) -> Components | None:
    """How a direction [deg] relates to components in columns x (east) and y (north); `None` where not at all."""
    value = [_numbers(layout, at) for at in (x, y)]
    angle = _numbers(layout, direction)
    rows = np.isfinite(angle) & (np.hypot(*value) >= _BLOWING)
    if int(rows.sum()) < _ROWS:
        return None
    way, turn = _way(value[0][rows], value[1][rows], angle[rows])
    return None if way is None else Components(x=x, y=y, way=way, turn=turn)


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


def _way(x: NDArray[np.float64], y: NDArray[np.float64], angle: NDArray[np.float64]) -> tuple[Way | None, float]:
    """How an angle clockwise from north [deg] relates to where the wind (x, y) comes from, and its turn [deg]."""
    comes = np.degrees(np.arctan2(-x, -y))
    known = np.isfinite(comes) & np.isfinite(angle)
    comes, angle = comes[known], angle[known]
    if len(angle) < _ROWS:
        return None, 0.0
    if _alike(angle - comes, 0.0):
        return "same", 0.0
    if _alike(angle - comes, 180.0):
        return "opposite", 0.0
    if len(angle) < _SEVERAL or _alike(angle, _middle(angle), _VEERING):
        return None, 0.0  # a wind from one direction cannot tell an angle's sense
    if _alike(angle - comes, turn := _middle(angle - comes)):
        return "turned", turn
    return ("mirrored" if _alike(angle + comes, _middle(angle + comes)) else None), 0.0


def _alike(angle: NDArray[np.float64], to: float, within: float = _TURN) -> bool:
    """Whether most angles are one angle [deg]."""
    off = np.abs((angle - to + 180.0) % 360.0 - 180.0)
    return float((off <= within).mean()) >= _SHARE


def _middle(angle: NDArray[np.float64]) -> float:
    """The angle that is nearest to all of some, in the mean of their distances, from −180 to 180 [deg]."""
    off = np.abs((angle[:_LOOKED, None] - angle[None, :_LOOKED] + 180.0) % 360.0 - 180.0)
    return float((angle[:_LOOKED][np.argmin(off.sum(axis=0))] + 180.0) % 360.0 - 180.0)


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
