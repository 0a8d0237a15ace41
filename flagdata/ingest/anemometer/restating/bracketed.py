"""Lines that begin with a stamp in brackets, as consoles and programs' logs write it, without the brackets.

    [2026-05-01 12:00:01] 3.2 231
    [5/1/2026 12:00:01 PM] new speed: 3.2 km/h

What follows the stamp is told as of any table.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.text.source import TableText, TextFile

_STAMP = re.compile(
    r"\s*\[\s*(?P<stamp>\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}[T ,]+\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?"
    r"(?:\s?[AaPp]\.?[Mm]\.?)?(?:\s?Z|\s?[+-]\d{2}:?\d{2})?)\s*\]\s*(?P<rest>[^\s$!].*)"
)
_FRACTION = re.compile(r"(?P<seconds>:\d{2}),(?=\d)")
_SHARE = 0.8
_LEAST = 3


def matches(lines: Sequence[str]) -> bool:
    """Most lines begin so, and no sentence of an instrument follows."""
    filled = [line for line in lines if line.strip()]
    found = sum(_STAMP.match(line) is not None for line in filled)
    return found >= max(_LEAST, _SHARE * len(filled))


def as_table(source: TextFile) -> TableText | None:
    """The lines with the stamp bare; the others as they are."""
    return TableText.of(source, [_bare(line) for _, lines in source.blocks() for line in lines])


def _bare(line: str) -> str:
    match = _STAMP.match(line)
    if match is None:
        return line
    stamp = _FRACTION.sub(r"\g<seconds>.", match["stamp"]).replace(",", " ")
    return f"{stamp} {match['rest']}"
