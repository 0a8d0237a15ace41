"""Letters and numbers behind the name of a place, which tell neighbours apart: MSNB_N and MSNB_S, mast 1 and mast 2."""

from __future__ import annotations

import re

from flagdata.ingest.anemometer.words.headings import words_of
from flagdata.ingest.anemometer.words.wind_words import DIRECTION, SPEED, WIND

_SETS = (frozenset("nesw"), frozenset("abc"), frozenset("lr"))
"""Letters that tell neighbours apart: sides, an order, left and right."""


def are_of_two(one: str, other: str) -> bool:
    """Whether two headings begin with the same word of no wind, and then with the letters or numbers of two places."""
    first, second = (re.split(r"[\W_]+", name.strip().lower()) for name in (one, other))
    for place, (mine, others) in enumerate(zip(first, second, strict=False)):
        if mine != others:
            named = first[:place]
            wind = any(set(words_of(word)) & (WIND | SPEED | DIRECTION) for word in named)
            return bool(named) and not wind and any(len(word) > 1 for word in named) and _neighbours(mine, others)
    return False


def _neighbours(one: str, other: str) -> bool:
    if one.isdigit() and other.isdigit():
        return len(one) <= 2 and len(other) <= 2
    return any({one, other} <= letters for letters in _SETS)
