"""Main data files of Scintec's sodars (FORMAT-1, .mnd): a block for each stamp, a row for each height.

    FORMAT-1
    # variable definitions
    height # z # m # Z1 # 0 # 99999
    wind speed # speed # m/s # G1 # 0 # 99.99
    wind direction # dir # deg # R1 # 0 # 999.9
    2026-05-01 00:15:00 00:15:00
    #    z  speed    dir
        30   3.67  129.9

Source: Scintec AG, "APRun Software Manual", format of the main data files: a definition has name, symbol, unit, type
and, last, the value that stands for none; a block begins with the end of its interval and the interval's length. The
zone is not stated.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from flagdata.ingest.anemometer.restating.restate import LOOKED_AT, rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_NAMES = {"height": "height", "wind speed": "wind speed", "wind direction": "wind direction", "wind W": "vertical wind"}
_BLOCK = re.compile(r"(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d) +\d\d:\d\d:\d\d")


@dataclass(frozen=True, kw_only=True)
class _Variable:
    """A defined variable that is read: its heading with the unit, and the value that stands for none."""

    heading: str
    missing: str


@dataclass
class _Blocks:
    """Reads lines in order; `symbols` are the columns of the present block, by the line above its rows."""

    variables: Mapping[str, _Variable]
    stamp: str = ""
    symbols: list[str] = field(default_factory=list)

    def row(self, line: str) -> list[str] | None:
        """The cells of a row; `None` for a line that is none."""
        block = _BLOCK.fullmatch(line.strip())
        if block is not None:
            self.stamp, self.symbols = block[1], []
        elif self.stamp and line.startswith("#") and not self.symbols:
            self.symbols = line[1:].split()
        elif self.symbols and len(cells := line.split()) == len(self.symbols):
            found = dict(zip(self.symbols, cells, strict=True))
            kept = (
                "" if found.get(symbol) == variable.missing else found.get(symbol, "")
                for symbol, variable in self.variables.items()
            )
            return [self.stamp, *kept]
        return None


def matches(lines: Sequence[str]) -> bool:
    """The first line is the format's name, and a wind speed is defined."""
    if not lines or lines[0].lstrip("\ufeff").strip() != "FORMAT-1":
        return False
    return any(line.startswith("wind speed #") for line in lines)


def as_table(source: TextFile) -> TableText | None:
    """Stamp, height, speed, direction and vertical speed; `None` where there is no row."""
    variables = _defined(source.head())
    rows, _ = rows_of(source, _Blocks(variables).row)
    names = ["time", *(variable.heading for variable in variables.values())]
    return table(source, names, rows, kind="scintec", what="Scintec's main data format")


def _defined(lines: Sequence[str]) -> dict[str, _Variable]:
    """Variables that are read, by their symbols."""
    found: dict[str, _Variable] = {}
    for line in lines[: 2 * LOOKED_AT]:
        parts = [part.strip() for part in line.split("#")]
        if len(parts) >= 4 and parts[0] in _NAMES:
            found[parts[1]] = _Variable(heading=f"{_NAMES[parts[0]]} [{parts[2]}]", missing=parts[-1])
    return found
