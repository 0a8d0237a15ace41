"""Cells divided by commas, with numbers that have decimal commas in quotes: "14.05.2026 12:00:01","4,36","231".

The numbers get decimal points. A comma with three digits behind it in every such number may divide thousands: it stays.
So does it where other cells are numbers with decimal points: "4,5" may be two numbers beside them.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.text.source import TableText, TextFile

_NUMBER = re.compile(r'"\s*[-+]?\d+,\d+\s*"')
_DECIMAL = re.compile(r"\s*([-+]?\d+),(\d+)\s*")
_THOUSAND = re.compile(r'"\s*[-+]?\d{1,3},\d{3}\s*"')
_POINTED = re.compile(r'(?:^|,)\s*"?[-+]?\d+\.\d+"?\s*(?=,|$)')
_SHARE = 0.6


def matches(lines: Sequence[str]) -> bool:
    """Most lines from the first with such a number on hold one, and no other sign divides their cells."""
    filled = [line for line in lines if line.strip()]
    first = next((at for at, line in enumerate(filled) if _NUMBER.search(line)), len(filled))
    found = [numbers for line in filled[first:] if (numbers := _NUMBER.findall(line))]
    if len(found) < max(2, _SHARE * len(filled[first:])) or any('";"' in line or '"\t"' in line for line in filled):
        return False
    if any(_POINTED.search(line) for line in filled[first:]):
        return False
    return not all(_THOUSAND.fullmatch(number) for numbers in found for number in numbers)


def as_table(source: TextFile) -> TableText | None:
    """The same cells with decimal points."""
    return TableText.of(source, [_pointed(line) for _, lines in source.blocks() for line in lines])


def _pointed(line: str) -> str:
    if '"' not in line or line.count('"') % 2:
        return line
    cells = next(csv.reader([line]), [])
    out = io.StringIO()
    csv.writer(out, lineterminator="").writerow(
        [f"{match[1]}.{match[2]}" if (match := _DECIMAL.fullmatch(cell)) is not None else cell for cell in cells]
    )
    return out.getvalue()
