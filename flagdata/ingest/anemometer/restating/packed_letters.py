"""Lines that pack several numbers into one word, each behind its letter, after a stamp: a column for each letter.

    2026-05-01T12:00:01 A0752B135C0002D0010E0003M737N10075*27
    2026-05-01T12:00:03 A2551B000C0002D0006E0003M737N10075*24

So microcontrollers print what they measure. What a letter means and in which unit stands in their program alone, so
that the user says it by `--columns`, with the letters as the columns' names. A checksum behind an asterisk is left out.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

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
    found = [packed.letters for line in filled if (packed := _packed(line)) is not None]
    same = max((found.count(letters) for letters in set(found)), default=0)
    return bool(filled) and same >= _SHARE * len(filled)


def as_table(source: TextFile) -> TableText | None:
    """A column of stamps, one for each letter, and numbered ones for numbers behind the word."""
    found = [packed for line in source.head() if (packed := _packed(line)) is not None]
    if not found:
        return None
    all_letters = [packed.letters for packed in found]
    letters = max(set(all_letters), key=all_letters.count)
    more = max(len(packed.behind) for packed in found if packed.letters == letters)

    def row(line: str) -> list[str] | None:
        packed = _packed(line)
        if packed is None or packed.letters != letters:
            return None
        behind = packed.behind[:more]
        return [packed.stamp, *packed.values, *behind, *[""] * (more - len(behind))]

    rows, other = rows_of(source, row)
    names = ["time", *letters, *(f"behind {number}" for number in range(1, more + 1))]
    what = "numbers behind letters, whose meaning the device's program tells"
    return table(source, names, rows, kind="packed-letters", what=what, left_out=other)


@dataclass(frozen=True, kw_only=True)
class _Packed:
    """One line: its stamp, the letters of its word with their numbers, and the numbers behind it."""

    stamp: str
    letters: tuple[str, ...]
    values: tuple[str, ...]
    behind: tuple[str, ...]


def _packed(line: str) -> _Packed | None:
    """What a line says; `None` where it is no stamp and such a word with each letter once."""
    stamp, text = split_stamp(line)
    match = _LINE.fullmatch(text) if stamp else None
    if match is None:
        return None
    parts = _PART.findall(match["packed"])
    letters = tuple(letter for letter, _ in parts)
    if len(set(letters)) < len(letters):
        return None
    behind = re.split(r"[,;]\s*", match["rest"])[1:]
    behind = behind[:-1] if behind and not behind[-1] else behind
    return _Packed(stamp=stamp, letters=letters, values=tuple(value for _, value in parts), behind=tuple(behind))
