"""Angles of the wind to the bow of a platform, which are no directions from north."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.winds import radiation
from flagdata.ingest.anemometer.words.headings import Heading, understand, words_of

_TO_BOW = frozenset({"rel", "relative", "apparent", "bow", "awa", "awd", "twa"})
"""Words of a direction from its platform's bow or mark."""
_ANGLES = frozenset({"angle", "ang"})
_HEADINGS = frozenset({"heading", "hdg", "hdt", "hdm"})
"""Words of where the platform's bow points to."""
_SIDES, _KINDS = frozenset({"tack", "side", "amure"}), 3
"""Words of the side of the bow, and how many kinds such a column holds at most."""
_HALF_A_TURN = 180.0


def to_bow(layout: Layout, index: int) -> bool:
    """Whether a heading is of an angle to the bow: by its own words, or as an angle beside the platform's heading."""
    words = set(words_of(layout.names[index]))
    if words & _TO_BOW:
        return True
    others = (name for at, name in enumerate(layout.names) if at != index)
    return bool(words & _ANGLES) and any(set(words_of(name)) & _HEADINGS for name in others)


def heading_of(layout: Layout, index: int) -> Heading:
    """What a column's heading says, of the apparent wind where it is an angle of the wind to the bow."""
    found = understand(layout.names[index], layout.units[index])
    if radiation.is_direct(layout.names, index):
        return replace(found, channel="", quantity="", sure=False)
    if found.quantity != "wind_direction" or not to_bow(layout, index):
        return found
    channel = "apparent_wind_direction"
    return replace(found, channel=found.channel and channel, quantity=channel)


def side(layout: Layout, angle: int) -> int | None:
    """The column that tells on which side of the bow an angle is that never leaves 0° to 180°; `None` for none.

    Args:
        angle: the column of an angle to the bow.
    """
    value = numbers(layout.column(angle), decimal=layout.decimal).value
    known = value[np.isfinite(value)]
    if not len(known) or known.min() < 0 or known.max() > _HALF_A_TURN:
        return None
    for index, name in enumerate(layout.names):
        kinds = {cell for cell in layout.column(index) if cell}
        if set(words_of(name)) & _SIDES and 1 <= len(kinds) <= _KINDS:
            return index
    return None
