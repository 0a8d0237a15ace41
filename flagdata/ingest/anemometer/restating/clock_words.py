"""Clocks with a word beside them: 01.02.2023 14:00 Uhr, 14:00 h, kl. 14:00, @ 14:00, a las 14:00. It is left out.

It says nothing that the numbers do not: AM and PM, which do, are read elsewhere (`twelve`).
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_CLOCK = r"(?:[01]?\d|2[0-4])[:.][0-5]\d(?:[:.][0-5]\d(?:[.,]\d{1,9})?)?"
_BEHIND = re.compile(
    rf"(?<![\d:.])(?P<clock>{_CLOCK})\s?(?P<word>Uhr|hrs?|hs|horas?|godz|h)\.?(?![^\W_])", re.IGNORECASE
)
_BEFORE = re.compile(
    rf"(?<![^\W\d_])(?P<word>kl|klo|um|kello|at|om|[aà] las|alle|[àá]s|à|@)\.?\s?(?P<clock>{_CLOCK})(?![\d:.])",
    re.IGNORECASE,
)
_SHARE = 0.8
_LEAST = 3


def matches(lines: Sequence[str]) -> bool:
    """Whether most lines, headings apart, hold a clock with such a word."""
    filled = [line for line in lines if any(map(str.isdigit, line))]
    found = sum(_word(line) is not None for line in filled)
    return found >= max(_LEAST, _SHARE * len(filled))


def as_table(source: TextFile) -> TableText | None:
    """The same lines without the words."""
    word = next((found for line in source.head() if (found := _word(line)) is not None), "")
    text = [_without(line) for _, lines in source.blocks() for line in lines]
    what = f"the word {word!r} beside each clock says nothing that its numbers do not: left out"
    return TableText.of(source, text, [Finding(kind="clock-in-words", severity=Severity.NOTE, what=what)])


def _word(line: str) -> str | None:
    """The word beside the first clock of a line; `None` where there is none."""
    match = _BEHIND.search(line) or _BEFORE.search(line)
    return None if match is None else match["word"]


def _without(line: str) -> str:
    return _BEFORE.sub(r"\g<clock>", _BEHIND.sub(r"\g<clock>", line))
