"""Angles of the wind to the bow of a platform, which are no directions from north."""

from __future__ import annotations

from dataclasses import replace

from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.words.headings import Heading, understand, words_of

_TO_BOW = frozenset({"rel", "relative", "apparent", "bow", "awa", "awd", "twa"})
"""Words of a direction from its platform's bow or mark."""
_ANGLES = frozenset({"angle", "ang"})
_HEADINGS = frozenset({"heading", "hdg", "hdt", "hdm"})
"""Words of where the platform's bow points to."""


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
    if found.quantity != "wind_direction" or not to_bow(layout, index):
        return found
    channel = "apparent_wind_direction"
    return replace(found, channel=found.channel and channel, quantity=channel)
