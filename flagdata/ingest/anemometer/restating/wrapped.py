"""Rows in brackets, as programs print tuples and lists, without them: ('2026-05-01 12:00:01', 3.2, 231)."""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.text.source import TableText, TextFile

_LINE = re.compile(r"\s*[\[(]?[(\[](?P<cells>[^()\[\]{}]*,[^()\[\]{}]*)[)\]]\s*[,;]?\s*\]?")
_QUOTE = re.compile(r"'([^',]*)'")
_SHARE = 0.8
_LEAST = 3


def matches(lines: Sequence[str]) -> bool:
    """Most lines are cells in brackets."""
    filled = [line for line in lines if line.strip()]
    return sum(_LINE.fullmatch(line) is not None for line in filled) >= max(_LEAST, _SHARE * len(filled))


def as_table(source: TextFile) -> TableText | None:
    """The cells of each line; lines that are none stay as they are."""
    return TableText.of(source, [_bare(line) for _, lines in source.blocks() for line in lines])


def _bare(line: str) -> str:
    match = _LINE.fullmatch(line)
    return line if match is None else _QUOTE.sub(r"\1", match["cells"])
