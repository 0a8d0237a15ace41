"""Tables that say before each group of rows how many follow, as forcing of snow and runoff models does; the counts go.

    3
    2026 5 1 12 1 491987 4876320 174 8.9 85 2.4 30
    2026 5 1 12 2 559446 4895672 430 7.1 92 0.2 218
    2026 5 1 12 3 570352 4895266 1294 3.2 99 0.7 312
    3

(G. E. Liston and K. Elder, MicroMet and SnowModel: stations of a day below their number.) A line is a count where it
holds one whole number alone and as many rows with more cells stand between it and the next.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_COUNT = re.compile(r"\s*(?P<count>[1-9]\d{0,3})[\s,;]*")
_LEAST = 2
"""Groups that show what the counts are."""


def matches(lines: Sequence[str]) -> bool:
    """The first lines are counts and as many rows as they say, the last group perhaps cut off."""
    groups = _groups(lines)
    whole = groups[:-1]
    return len(whole) >= _LEAST and all(stated == rows for stated, rows in whole)


def as_table(source: TextFile) -> TableText | None:
    """The rows without the counts."""
    lines = list(source.each_line())
    rows = [line for line in lines if _COUNT.fullmatch(line) is None]
    count = len(lines) - len(rows)
    text = f"{count} lines that say how many rows follow are left out; lines are counted without them"
    return TableText.of(source, rows, [Finding(kind="count-lines", severity=Severity.NOTE, count=count, what=text)])


def _groups(lines: Sequence[str]) -> list[tuple[int, int]]:
    """(the number that is stated, the rows that follow) of each group; none where rows stand before the first."""
    groups: list[tuple[int, int]] = []
    for line in lines:
        if not line.strip():
            continue
        if (match := _COUNT.fullmatch(line)) is not None:
            groups.append((int(match["count"]), 0))
        elif not groups:
            return []
        else:
            groups[-1] = (groups[-1][0], groups[-1][1] + 1)
    return groups
