"""Directions that are called after the speed beside them, which no heading tells alone: U and Udir, VW1 and DW1."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.winds.angles import compass_unit
from flagdata.ingest.anemometer.words.gust_words import GUSTS, MAXIMA
from flagdata.ingest.anemometer.words.headings import Heading, understand, words_of

_DIRECTIONS = ("dir", "direction", "wd")
"""What stands before or behind the name of a speed in that of its direction."""
_INSTEAD = (
    ("speed", "direction"), ("speed", "dir"), ("spd", "dir"), ("vel", "dir"), ("wsp", "wd"), ("wsp", "wdir"),
    ("ws", "wd"), ("vw", "dw"), ("wv", "wd"), ("ff", "dd"),
)  # fmt: skip
"""What stands in the name of a speed, and in its place in that of its direction."""
_SPREADS = ("std", "sd", "stdev", "stddev", "sigma")
"""What stands behind the name of a speed, or of its direction, in that of its standard deviation."""
_OF_GUSTS = GUSTS | {"peak"}
"""Words of a gust, beside which a direction is that of the gust; "max" is that of the vane's readings, too."""
_UNIT = re.compile(r"[\[(<{][^\])>}]*[\])>}]")
_TURN, _MOST = 361.0, 0.9
"""Largest angle [deg], and the share of a column that must be angles; the rest are codes of no value."""


def direction_of(layout: Layout, speed: int, *, apart: Collection[int] = ()) -> int | None:
    """The column of angles or points of the compass that is called after the speed in another; `None` for no such.

    Args:
        speed: its column.
        apart: columns that are none.
    """
    own = _plain(layout.names[speed])
    if not own:
        return None
    named = {f"{own}{word}" for word in _DIRECTIONS} | {f"{word}{own}" for word in _DIRECTIONS}
    named |= {own.replace(said, word, 1) for said, word in _INSTEAD if said in own}
    found = [
        index for index, name in enumerate(layout.names)
        if index not in {speed, *apart} and _plain(name) in named and _turns(layout, index)
    ]  # fmt: skip
    return found[0] if len(found) == 1 else None


def direction_of_gust(layout: Layout, speed: int, *, apart: Collection[int] = ()) -> int | None:
    """The one column of angles that is the direction of a gust, by its words, beside a gust of the same instrument.

    Args:
        speed: the gust's column.
        apart: columns that are none.
    """
    own = understand(layout.names[speed], layout.units[speed])
    if not set(words_of(layout.names[speed])) & _OF_GUSTS:
        return None
    found: list[int] = []
    for index, name in enumerate(layout.names):
        heading = understand(name, layout.units[index])
        alike = (heading.label, heading.height) == (own.label, own.height)
        of_gust = heading.quantity == "wind_direction" and set(words_of(name)) & _OF_GUSTS
        if (
            of_gust
            and alike
            and _of_maximum(name) == _of_maximum(layout.names[speed])
            and index not in {speed, *apart}
            and _turns(layout, index)
        ):
            found.append(index)
    return found[0] if len(found) == 1 else None


def _of_maximum(name: str) -> bool:
    """Whether a heading is of the greatest gust of a period, which is none of each row's gusts."""
    return bool(set(words_of(name)) & MAXIMA)


def has_companions(layout: Layout, speed: int) -> bool:
    """Whether a direction and a standard deviation stand beside a column under its name, as Udir and Ustd beside U.

    Args:
        speed: a column that may be a speed.
    """
    own = _plain(layout.names[speed])
    named = {f"{own}{word}" for word in _SPREADS} | {f"{own}{way}{word}" for way in _DIRECTIONS for word in _SPREADS}
    spread = any(_plain(name) in named for at, name in enumerate(layout.names) if at != speed)
    return bool(own) and spread and direction_of(layout, speed) is not None


def as_direction(heading: Heading, *, of: Heading) -> Heading:
    """The heading of a column as that of the direction of the speed below another heading."""
    channel = "wind_direction"
    return replace(heading, channel=channel, quantity=channel, spread=False, label=of.label, height=of.height)


def _plain(name: str) -> str:
    """A heading without its unit, in lower case, without blanks and signs."""
    return re.sub(r"[\W_]", "", _UNIT.sub("", name)).lower()


def _turns(layout: Layout, index: int) -> bool:
    """Whether a column holds points of the compass, or numbers from 0 to 360 but for codes of no value."""
    if compass_unit(layout, index) is not None:
        return True
    value = numbers(layout.column(index), decimal=layout.decimal).value
    known = value[np.isfinite(value)]
    return len(known) > 0 and float(((known >= 0) & (known <= _TURN)).mean()) >= _MOST
