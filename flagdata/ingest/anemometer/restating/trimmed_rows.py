"""Tables whose rows end with their last value, since the empty cells behind it were not written: each is filled up.

    Boat,Utc,Bsp,Awa,Aws,Twa,Tws,Twd,RudderFwd,Leeway
    0,43337.617801,5.2,111.5,14.4
    0,43337.617814,5.17,113.5,13.5,169.6,16.73,177.3
    0,43337.617825,,132.5,11.7,,,,1.5

They are told by rows of several lengths, none beyond the names, that end in a value.
"""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.ingest.anemometer.text.layout import cut
from flagdata.ingest.anemometer.text.signs import SIGNS
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_LEAST_NAMES, _LEAST_ROWS, _LENGTHS = 5, 6, 3
"""The least number of names, of rows, and of lengths, that of the names included."""
_SHARE, _WHOLE = 0.9, 0.5
"""The share of shorter rows that must end in a value, and that of rows of all names from which on others are damage."""


def matches(lines: Sequence[str]) -> bool:
    """The first lines are names above such rows."""
    return _sign([line for line in lines if line.strip()]) is not None


def as_table(source: TextFile) -> TableText | None:
    """The same lines, each with as many cells as there are names."""
    head = [line for line in source.head() if line.strip()]
    sign = _sign(head)
    if sign is None:
        return None
    count = len(cut(head[0], sign))

    def filled(line: str) -> str:
        own = len(cut(line, sign))
        return line + sign * (count - own) if line.strip() and own < count else line

    return TableText.of(source, [filled(line) for line in source.each_line()])


def _sign(lines: Sequence[str]) -> str | None:
    """The delimiter of names above rows of several lengths; `None` where the lines are none."""
    for sign in SIGNS:
        names = cut(lines[0], sign) if lines else []
        rows = [cut(line, sign) for line in lines[1:]]
        if len(names) < _LEAST_NAMES or len(rows) < _LEAST_ROWS:
            continue
        if not all(map(_names, names)) or any(len(row) > len(names) for row in rows):
            continue
        shorter = [row for row in rows if len(row) < len(names)]
        ends = sum(bool(row[-1]) for row in shorter)
        lengths = {len(row) for row in rows} | {len(names)}
        several = len(lengths) >= _LENGTHS and min(lengths) > 1 and not _wrapped([len(row) for row in rows], len(names))
        if several and len(shorter) > (1 - _WHOLE) * len(rows) and ends >= _SHARE * len(shorter):
            return sign
    return None


def _wrapped(lengths: Sequence[int], whole: int) -> bool:
    """Whether rows of a certain length were cut into lines, as many for each."""
    for lines in range(2, len(lengths) // 2 + 1):
        if sum(lengths[:lines]) == whole and all(a == b for a, b in zip(lengths, lengths[lines:], strict=False)):
            return True
    return False


def _names(cell: str) -> bool:
    """Whether a cell of the first line can be a name: it begins with a letter."""
    return cell[:1].isalpha()
