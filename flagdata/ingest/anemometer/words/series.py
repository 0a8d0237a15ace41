"""Headings that are a series of names, as of the stations of a network: AAAI1, BBBI1, TS718."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from flagdata.ingest.anemometer.words.headings import understand

_NAME = re.compile(r"[A-Z]{2,}\d*|[A-Z]+\d+")
_LEAST, _MOST = 8, 0.6
"""Names of one length that are a series, and their share of all headings."""
_SHORTEST = 4
_SAYING = 0.2
"""Share of a series whose names may, by chance, be those of a quantity."""


def members(names: Sequence[str], units: Sequence[str]) -> frozenset[int]:
    """The columns whose headings are one series of names; none where they say what is measured or state units.

    Args:
        names: of the columns.
        units: below them, "" where there is none.
    """
    alike = [at for at, name in enumerate(names) if _NAME.fullmatch(name) and len(name) >= _SHORTEST and not units[at]]
    lengths = Counter(len(names[at]) for at in alike)
    if not lengths:
        return frozenset()
    length, count = lengths.most_common(1)[0]
    found = [at for at in alike if len(names[at]) == length]
    saying = sum(bool(understand(names[at]).quantity) for at in found)
    if count < _LEAST or count < _MOST * len(names) or saying > _SAYING * count:
        return frozenset()
    return frozenset(found)
