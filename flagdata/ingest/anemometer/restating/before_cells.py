"""Lines that begin with a stamp, set off by a blank from cells that are divided by another sign.

    2026-05-01T12:00:01Z 02.3;240;+23.5;15;;*31
    12:00:01.250 -> 2.3,240                             as the Arduino IDE's serial monitor shows them

The blank behind the stamp becomes that sign, so that the line is a row of a table, of which nothing is known yet. A
hyphen before digits is none of those blanks: it begins the zone of the stamp, -05:00.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.recognition import recognise
from flagdata.ingest.anemometer.sniffing import SURE
from flagdata.ingest.anemometer.text.signs import SIGNS
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_LINE = re.compile(
    r"\s*(?P<stamp>(?:\d{4}[-/]\d{2}[-/]\d{2}[T ])?\d{2}:\d{2}:\d{2}(?:[.,]\d{1,9})?"
    r"(?:Z|[+-]\d{2}:?\d{2}| ?(?:UTC|GMT))?)"
    r"(?!:\d{1,9}\s*[,;\t]|:\d{2}:\d{2}|-\d)(?P<gap>[\s>:|-]+)(?![A-Z]{3,4}\s*[,;\t])(?P<rest>[^\s$!].*)"
)
_SHARE = 0.8
_LEAST = 3
_DECIMAL_COMMA = re.compile(r"\s*[-+]?\d+,\d+\s*")


def matches(lines: Sequence[str]) -> bool:
    """Most lines begin so, and are cut into equally many cells by a sign that is no blank."""
    return _sign(lines) is not None


def as_table(source: TextFile) -> TableText | None:
    """The lines with the sign behind their stamps; `None` where another format knows them."""
    sign = _sign(source.head())
    if sign is None or any(guess.score >= SURE for guess in recognise(source)):
        return None
    return TableText.of(source, [_cut(line, sign) for _, lines in source.blocks() for line in lines])


def _cut(line: str, sign: str) -> str:
    match = _LINE.match(line)
    return line if match is None else f"{match['stamp'].replace(',', '.')}{sign}{match['rest']}"


def _more_cells(rest: str) -> bool:
    """Whether what follows a stamp and a tab is cells divided by tabs, or one number with a decimal comma."""
    return "\t" in rest or _DECIMAL_COMMA.fullmatch(rest) is not None


def _sign(lines: Sequence[str]) -> str | None:
    filled = [line for line in lines if line.strip()]
    matched = [match for line in filled if (match := _LINE.match(line)) is not None]
    found = [match["rest"] for match in matched]
    if len(found) < max(_LEAST, _SHARE * len(filled)):
        return None
    if all("\t" in match["gap"] and _more_cells(match["rest"]) for match in matched):
        return None
    for sign in SIGNS:
        counts = [rest.count(sign) for rest in found]
        if min(counts) >= 1 and sum(count == counts[0] for count in counts) >= _SHARE * len(counts):
            return sign
    return None
