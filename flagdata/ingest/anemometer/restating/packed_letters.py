"""Lines that pack several numbers into one word, each behind its letter, after a stamp: a column for each letter.

    2026-05-01T12:00:01 A0752B135C0002D0010E0003M737N10075*27
    2026-05-01T12:00:03 A2551B000C0002D0006E0003M737N10075*24

So microcontrollers print what they measure. What a letter means and in which unit stands in their program alone, so
that the user says it by `--columns`, with the letters as the columns' names. A checksum behind an asterisk is left out.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.formats.serial_lines import split_stamp
from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_PART = re.compile(r"([A-Z])([-+]?\d+(?:\.\d+)?)")
_LINE = re.compile(
    r"(?P<packed>(?:[A-Z][-+]?\d+(?:\.\d+)?){4,})(?P<rest>(?:[,;]\s*[-+]?[\d.]*)*)(?:\*[0-9A-Fa-f]{2})?\s*"
)
_SHARE = 0.8


def matches(lines: Sequence[str]) -> bool:
    """Most of the first lines are a stamp and such a word, of the same letters."""
    filled = [line for line in lines if line.strip()]
    found = [letters for line in filled if (letters := _letters(line)) is not None]
    same = max((found.count(letters) for letters in set(found)), default=0)
    return bool(filled) and same >= _SHARE * len(filled)


def as_table(source: TextFile) -> TableText | None:
    """A column of stamps, one for each letter, and numbered ones for numbers behind the word."""
    found = [letters for line in source.head() if (letters := _letters(line)) is not None]
    if not found:
        return None
    letters = max(set(found), key=found.count)
    more = max(len(_behind(line)) for line in source.head() if _letters(line) == letters)

    def row(line: str) -> list[str] | None:
        if _letters(line) != letters:
            return None
        stamp, packed = split_stamp(line)
        match = _LINE.fullmatch(packed)
        own = _behind(line)[:more]
        parts = [] if match is None else [value for _, value in _PART.findall(match["packed"])]
        return [stamp, *parts, *own, *[""] * (more - len(own))]

    rows, other = rows_of(source, row)
    names = ["time", *letters, *(f"behind {number}" for number in range(1, more + 1))]
    what = "numbers behind letters, whose meaning the device's program tells"
    return table(source, names, rows, kind="packed-letters", what=what, left_out=other)


def _letters(line: str) -> tuple[str, ...] | None:
    """The letters of a line's word, each once; `None` where it is no stamp and such a word."""
    stamp, packed = split_stamp(line)
    match = _LINE.fullmatch(packed) if stamp else None
    if match is None:
        return None
    letters = tuple(letter for letter, _ in _PART.findall(match["packed"]))
    return letters if len(set(letters)) == len(letters) else None


def _behind(line: str) -> list[str]:
    """The numbers behind the word."""
    match = _LINE.fullmatch(split_stamp(line)[1])
    cells = [] if match is None else re.split(r"[,;]\s*", match["rest"])[1:]
    return cells[:-1] if cells and not cells[-1] else cells
