"""Numbers that names, headings and texts state, which may be of any size.

`read_bounded` reads one up to a bound. An `Ordinal` has no bound: it sorts, and is shown, and it is
no length. It has no `__index__`, so that neither `range` nor an array nor a list takes it for one.
What is missing between ordinals is the difference of neighbours, see `gap`; nothing is counted up
to one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

_PARTS = re.compile(r"([0-9]+)")
_DIGITS = 4000
"""Most digits of an ordinal: Python converts no more. A file's name has 255 at most."""


def read_bounded(digits: str, *, most: int) -> int | None:
    """Reads a number of decimal digits of any script; None of anything else, and of a number above
    `most`."""
    significant = digits.lstrip("0")
    if not digits.isdecimal() or len(significant) > len(str(most)):
        return None
    value = int(significant or "0")
    return value if value <= most else None


@dataclass(frozen=True, order=True)
class Ordinal:
    """A number of any size, as it counts frames in the names of files. Formats as an `int` does."""

    _value: int

    @classmethod
    def read(cls, digits: str) -> Ordinal:
        """Reads decimal digits of any script.

        Raises:
            ValueError: other letters, or more than 4000 digits.
        """
        if not digits.isdecimal() or len(digits) > _DIGITS:
            raise ValueError(f"{digits[:20]!r} is no number")
        return cls(int(digits))

    def up_to(self, most: int) -> int | None:
        """Returns the number where it is at most `most`; else None."""
        return self._value if self._value <= most else None

    def __format__(self, spec: str) -> str:
        return format(self._value, spec)

    def __str__(self) -> str:
        return format(self)


@dataclass(frozen=True, kw_only=True)
class Gap:
    """What is missing between numbers.

    Attributes:
        count: how many numbers are, in all.
        after: the one behind which the first is missing.
    """

    count: int
    after: Ordinal


def gap(numbers: Iterable[Ordinal]) -> Gap | None:
    """Finds the numbers that are missing between the least and the greatest; None where none is."""
    ordered = sorted(set(numbers))
    steps = [(after._value - before._value - 1, before) for before, after in pairwise(ordered)]
    first = next((before for missing, before in steps if missing), None)
    return None if first is None else Gap(count=sum(missing for missing, _ in steps), after=first)


def by_numbers(name: str) -> tuple[tuple[bool, int, str, str], ...]:
    """Makes the key by which names sort by the numbers in them, of any size: part 10 comes after
    part 9."""
    return tuple(map(_place, _PARTS.split(name)))


def _place(part: str) -> tuple[bool, int, str, str]:
    if not part.isascii() or not part.isdigit():
        return (False, 0, part.lower(), part)
    significant = part.lstrip("0")
    return (True, len(significant), significant, part)
