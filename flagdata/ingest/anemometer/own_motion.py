"""Velocities beside a position that changes: of the wind, or of the drone, boat or car that carries the instrument."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flagdata.ingest.anemometer.cells import numbers
from flagdata.ingest.anemometer.headings import words_of
from flagdata.ingest.anemometer.instruments import Wind
from flagdata.ingest.anemometer.layout import Layout

_LATITUDE, _LONGITUDE = frozenset({"lat", "latitude"}), frozenset({"lon", "lng", "long", "longitude"})
_STILL = 1e-4
"""Change of a coordinate [deg] below which a receiver at rest may show it: some 10 m."""
_HEIGHTS = frozenset({"alt", "altitude", "height", "elevation"})
_CLIMBS = 2.0
"""Change of a height [m] above which a platform climbs."""


def doubt(layout: Layout, wind: Wind) -> str:
    """Why a wind whose heading does not say so may be the platform's own velocity, and where the wind may stand
    instead; "" where nothing speaks for it."""
    moving = _moving(layout)
    if wind.sure or not moving:
        return ""
    taken = {column.index for column in wind.columns.values()}
    others = [names for names in _triples(layout) if not taken & {layout.names.index(name) for name in names}]
    where = f"; the wind may be {', '.join(map(repr, others[0]))}" if others else ""
    return f"{moving!r} changes, so that it may also be how the platform itself moves{where}"


def _moving(layout: Layout) -> str:
    """The first column of a position that changes; "" where none does."""
    for index, name in enumerate(layout.names):
        words = set(words_of(name))
        least = _STILL if words & (_LATITUDE | _LONGITUDE) else _CLIMBS if words & _HEIGHTS else None
        if least is None:
            continue
        value = numbers(layout.column(index), decimal=layout.decimal).value
        known = value[np.isfinite(value)]
        if len(known) and float(np.ptp(known)) > least:
            return name
    return ""


def _triples(layout: Layout) -> list[Sequence[str]]:
    """Columns called u, v and w with the same letters behind, such as Um, Vm, Wm."""
    by_name = {name.strip().lower(): name for name in layout.names if name.strip()}
    ends = [name[1:] for name in by_name if name[0] == "u"]
    return [[by_name[f"{letter}{end}"] for letter in "uvw"] for end in ends
            if all(f"{letter}{end}" in by_name for letter in "uvw")]  # fmt: skip
