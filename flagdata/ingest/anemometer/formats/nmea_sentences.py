"""NMEA 0183 sentences: taken apart, checksums verified, and what MWV, MWD and the time sentences
say.

Source: NMEA 0183 4.10 as described in E. S. Raymond, "NMEA Revealed" (gpsd project), sections MWV,
MWD, ZDA, RMC, GGA, GLL, VTG; IEC 61162-450 for TAG blocks.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import xor

from flagdata.ingest.anemometer.instants.stamp_text import whole_year

# A talker is two letters, or, from canboat's n2kd, the device's address on NMEA 2000 as two
# hexadecimal digits. What follows P, which makers use for sentences of their own, is theirs:
# "$PSMDCN,2*19".
_SENTENCE = re.compile(
    r"[$!]([A-Z]{2}|[0-9A-F]{2}|P)([A-Z]{3}|(?<=[$!]P)[A-Z0-9]{3,12})"
    r"((?:,[^,*$!]*)*)(?:\*([0-9A-Fa-f]{2}))?\s*$"
)
_TAG = re.compile(r"^\\([^\\]*)\*([0-9A-Fa-f]{2})\\")
_TAG_TIME = re.compile(r"(?:^|,)c:(\d{10})(\d{3})?(?:,|$)")
_CLOCK = re.compile(r"^(\d{2})(\d{2})(\d{2})(?:\.(\d{1,9})\d*)?$")
_DATE = re.compile(r"^(\d{2})(\d{2})(\d{2})$")
_NUMBER = re.compile(r"^\d{1,6}(?:\.\d*)?$|^\.\d+$")
SPEED_UNITS: Mapping[str, str] = {"N": "kn", "K": "km/h", "M": "m/s", "S": "mph"}


@dataclass(frozen=True, kw_only=True)
class Sentence:
    """One sentence: talker ("II"), kind ("MWV"), its fields, and whether a checksum was there (and
    then right)."""

    talker: str
    kind: str
    fields: tuple[str, ...]
    checked: bool


class ChecksumError(ValueError):
    """A checksum that does not match its sentence."""


def checksum(text: str) -> int:
    """Computes the XOR of all characters between "$" and "*"."""
    return reduce(xor, text.encode("latin-1", "replace"), 0)


def split(line: str) -> Sentence | None:
    """Finds the sentence that ends a line, whatever stands before it; `None` where there is none.

    Raises:
        ChecksumError: its checksum does not match.
    """
    start = max(line.rfind("$"), line.rfind("!"))
    match = _SENTENCE.match(line, start) if start >= 0 else None
    if match is None:
        return None
    talker, kind, fields, stated_checksum = match.groups()
    if stated_checksum is not None and checksum(f"{talker}{kind}{fields}") != int(
        stated_checksum, 16
    ):
        raise ChecksumError(line)
    return Sentence(
        talker=talker,
        kind=kind,
        fields=tuple(fields.split(",")[1:]),
        checked=stated_checksum is not None,
    )


def tag_time(line: str) -> int | None:
    """Reads Unix milliseconds of a TAG block before the sentence, `None` where there is none that
    is whole."""
    match = _TAG.match(line)
    if match is None or checksum(match[1]) != int(match[2], 16):
        return None
    time = _TAG_TIME.search(match[1])
    return None if time is None else int(time[1]) * 1000 + int(time[2] or 0)


def number(text: str) -> float | None:
    """Reads a decimal field, `None` where it is empty or no number."""
    return float(text) if _NUMBER.match(text.strip()) else None


def clock(text: str) -> int | None:
    """Nanoseconds since midnight of "hhmmss.ss", `None` where it is no time of day. A leap second
    reads as 59.999…"""
    match = _CLOCK.match(text.strip())
    if match is None:
        return None
    hour, minute, second = int(match[1]), int(match[2]), int(match[3])
    if hour > 23 or minute > 59 or second > 60:
        return None
    fraction = int((match[4] or "").ljust(9, "0"))
    if second == 60:
        second, fraction = 59, 999_999_999
    return ((hour * 60 + minute) * 60 + second) * 1_000_000_000 + fraction


@dataclass(frozen=True, kw_only=True)
class TimeMark:
    """What a time sentence says: time of day [ns] and, where it has one, the date (year, month,
    day)."""

    clock: int
    date: tuple[int, int, int] | None


def time_mark(sentence: Sentence) -> TimeMark | None:
    """Reads the time in a ZDA, RMC, GGA or GLL sentence, `None` where it has none."""
    read = _TIMES.get(sentence.kind)
    return None if read is None else read(sentence.fields)


def _zda(fields: tuple[str, ...]) -> TimeMark | None:
    time = clock(fields[0]) if fields else None
    if time is None:
        return None
    parts = [int(f) if f.isascii() and f.isdigit() else 0 for f in fields[1:4]]
    day, month, year = [*parts, 0, 0, 0][:3]
    return TimeMark(clock=time, date=(year, month, day) if day and month and year >= 1970 else None)


def _rmc(fields: Sequence[str]) -> TimeMark | None:
    if len(fields) < 9:
        return None
    time = clock(fields[0])
    if time is None:
        return None
    match = _DATE.match(fields[8])
    date = (
        (whole_year(int(match[3])), int(match[2]), int(match[1]))
        if match and fields[1] == "A"
        else None
    )
    return TimeMark(clock=time, date=date)


def _first(fields: tuple[str, ...]) -> TimeMark | None:
    time = clock(fields[0]) if fields else None
    return None if time is None else TimeMark(clock=time, date=None)


def _gll(fields: tuple[str, ...]) -> TimeMark | None:
    time = clock(fields[4]) if len(fields) > 4 else None
    return None if time is None else TimeMark(clock=time, date=None)


_TIMES: Mapping[str, Callable[[tuple[str, ...]], TimeMark | None]] = {
    "ZDA": _zda,
    "RMC": _rmc,
    "GGA": _first,
    "GLL": _gll,
}


def speed_over_ground(sentence: Sentence) -> float | None:
    """Reads the speed over ground [kn] in VTG or RMC, `None` where there is none."""
    if sentence.kind == "VTG":
        fields = sentence.fields
        for at in range(len(fields) - 1):
            if fields[at + 1] == "N":
                return number(fields[at])
        return None
    if sentence.kind == "RMC" and len(sentence.fields) > 6 and sentence.fields[1] == "A":
        return number(sentence.fields[6])
    return None
