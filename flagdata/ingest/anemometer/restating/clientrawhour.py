"""Weather Display's clientrawhour.txt: one line that holds the last hour, minute by minute, one quantity after another.

    12345 3 3 4 4 … (60 speeds) 6 8 7 … (60 gusts) 146 135 … (60 directions) 22.8 … (60 temperatures) … !!H10.37R!!

Source: Weather Display's list of the fields of clientrawhour.txt: fields 1 to 60 average speed and 61 to 120 gust in
knots, 121 to 180 direction, 181 to 240 temperature in °C. The time of the last minute is in clientraw.txt alone.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.restating.restate import table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_MINUTES = 60
_NAMES = ("wind speed average [kn]", "gust [kn]", "wind direction [deg]", "air temperature [degC]")
_END = re.compile(r"!!H[\d.]+\w?!!")
"""The mark at the end of the line, with the program's version."""


def matches(lines: Sequence[str]) -> bool:
    """The one line begins and ends with the file's marks."""
    filled = [line for line in lines if line.strip()]
    return len(filled) == 1 and filled[0].startswith("12345 ") and _END.search(filled[0]) is not None


def as_table(source: TextFile) -> TableText | None:
    """A row a minute, counted from the first; `None` where fields are missing or no numbers."""
    cells = next(line for line in source.head() if line.strip()).split()[1 : 1 + len(_NAMES) * _MINUTES]
    if len(cells) < len(_NAMES) * _MINUTES or not all(re.fullmatch(r"-?\d+(?:\.\d+)?", cell) for cell in cells):
        return None
    columns = [cells[first : first + _MINUTES] for first in range(0, len(cells), _MINUTES)]
    rows = [[str(minute), *row] for minute, row in enumerate(zip(*columns, strict=True))]
    what = "the last hour of Weather Display (clientrawhour.txt), whose date is in clientraw.txt"
    return table(source, ["time [minutes]", *_NAMES], rows, kind="clientrawhour", what=what)
