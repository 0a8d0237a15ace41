"""The rate and the start that lines above a table state, for rows that carry no time: proposed, never taken."""

from __future__ import annotations

import re
from collections.abc import Sequence

_RATE = re.compile(
    r"(?:sampl\w*|scan\w*|logging|output|data)[\s_]*(?:rate|freq\w*)?\W{0,20}?(?P<rate>\d{1,5}(?:\.\d+)?)\s*(?:hz|/s)\b",
    re.IGNORECASE,
)
_START = re.compile(
    r"(?:start\w*|begin\w*|since|date|time|recorded)\b[^\d]{0,25}"
    r"(?P<start>\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?)",
    re.IGNORECASE,
)


def advice(lines: Sequence[str]) -> str:
    """What lines say of rate and start, to be added to what the user can do; "" where they say nothing."""
    found: list[str] = []
    for number, line in enumerate(lines, start=1):
        rate, start = _RATE.search(line[:500]), _START.search(line[:500])
        if rate is not None:
            found.append(f"line {number} says {rate[0].strip()!r}: --rate {rate['rate']}")
        if start is not None:
            when = start["start"].replace(" ", "T")
            found.append(f"line {number} says {start[0].strip()!r}: --start {when} with its zone")
    return "; ".join(found[:3])
