"""Gusts that only the columns beside them tell: by their names, or since they are never below the mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.winds.found import Found, Wind
from flagdata.ingest.anemometer.words.headings import Heading, words_of
from flagdata.units import unit

_MAXIMA_OF_HOURS = frozenset({"ff3", "ff10"})
"""Maxima over hours and between observations beside Ff, of the weather pages rp5."""
_SPEED, _GUST = "ws", "wg"
"""The last word of AgriMet's mean speed, and of its peak gust; alone the second is "Windgeschwindigkeit"."""
_ROWS, _NEVER, _OFTEN = 10, 0.99, 0.8
"""Rows that tell at least, and the shares of them in which a gust is not below, and is above, its mean."""


def as_gusts(layout: Layout, headings: Sequence[Heading]) -> list[Heading]:
    """The headings of a table, with those as gusts that the names of other columns show to be."""
    names = [name.strip() for name in layout.names]
    words = [tuple(words_of(name)) for name in names]
    found: list[Heading] = []
    for heading, name, own in zip(headings, names, words, strict=True):
        of_hours = name in _MAXIMA_OF_HOURS and "Ff" in names
        peak = own[-1:] == (_GUST,) and (*own[:-1], _SPEED) in words
        gust = of_hours or peak
        found.append(replace(heading, channel="", quantity="wind_speed", spread=True) if gust else heading)
    return found


def never_below(found: Found, winds: Sequence[Wind]) -> tuple[str, ...]:
    """Warnings of an anemometer that is never below another of the same height or of none: it may be its gust."""
    told: list[str] = []
    for mean in winds:
        for gust in winds:
            one, two = mean.columns.get("wind_speed"), gust.columns.get("wind_speed")
            if one is None or two is None or one is two or mean.height != gust.height or mean.site != gust.site:
                continue
            slow = found.values[one.index] * unit(one.unit or two.unit or "m/s").scale
            fast = found.values[two.index] * unit(two.unit or one.unit or "m/s").scale
            both = np.isfinite(slow) & np.isfinite(fast)
            if both.sum() < _ROWS:
                continue
            above, below = float((fast[both] > slow[both]).mean()), float((fast[both] < slow[both]).mean())
            if below <= 1 - _NEVER and above >= _OFTEN:
                told.append(
                    f"{gust.label!r} is above {mean.label!r} in nearly all rows: it may be its gust or maximum, no "
                    "anemometer of its own; --wind with the name of the other reads that alone"
                )
    return tuple(told)
