"""Streams whose lines are of several kinds, told by a code of letters before their cells: a table is of one kind."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from flagdata.ingest.anemometer.text.layout import cut

_CODE = re.compile(r"(?:.*\d\s+)?\$?(?P<code>[A-Z][A-Z0-9]{1,7})")
"""The first cell of a line: a code, perhaps behind a stamp."""
_COVERED, _LEAST, _MOST = 0.9, 0.05, 8
"""The share of lines that must have a code, that of the rarest kind, and the most kinds."""


def line_kinds(lines: Sequence[str], delimiter: str) -> str:
    """What is said of lines of several kinds; "" where they are of one, or have no code."""
    firsts = [cut(line, delimiter)[0] for line in lines if line.strip()]
    codes = Counter(match["code"] for first in firsts if (match := _CODE.fullmatch(first)) is not None)
    total = codes.total()
    if not 2 <= len(codes) <= _MOST or total < _COVERED * len(firsts) or min(codes.values()) < _LEAST * total:
        return ""
    known = ", ".join(sorted(codes))
    return f"its lines are of {len(codes)} kinds ({known}): put those of one kind into a file of its own"
