"""The zone that a log states above its rows ("UTC Offset,+2", "Timezone=UTC", "GMT Offset: -5"), whatever its format.

What the lines above the rows say of the clock is a hint, not the stamps' own word: a logger's setting may be one thing
and its export another. So it is named where a zone is missing, and held against the zone that the user gives.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, tzinfo

from flagdata.errors import FlagdataError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants import abbreviations
from flagdata.ingest.anemometer.instants.wall import offset_at
from flagdata.signals import Instants
from flagdata.timebase import NANOSECONDS, zone

LINES = 100
"""Lines at the beginning of a file in which a statement is looked for."""
_LONGEST = 300
"""Characters of a line that are looked at."""
_KEY = (
    r"(?:time[ _-]?zone(?:[ _]name)?(?:\s*\((?:utc|gmt)\s*[+±]?\s*\))?|"
    r"(?:utc|gmt)[ _-]?(?:time[ _]?)?offset|offset[ _](?:from|to)[ _](?:utc|gmt)|"
    r"zeitzone|fuseau(?: horaire)?|zona horaria|tijdzone)"
)
_STATED = re.compile(
    rf"(?<![A-Za-z]){_KEY}(?P<count>[ _]?(?:in[ _])?\(?(?:seconds|minutes|hours)\)?)?[\"']?"
    r"\s*(?:->|[=:,;|\t(]|\s)+\s*[\"']?"
    r"(?P<zone>[A-Z][A-Za-z]+/[A-Za-z_]+(?:/[A-Za-z_]+)?(?:[+-]\d{1,2})?|(?:UTC|GMT)?\s?[+-]?\d{1,5}(?::?\d{2})?|UTC|GMT|Z)"
    r"(?![A-Za-z/\d.]|\s?[+±]\s?\))",
    re.IGNORECASE,
)
_KEY_ALONE = re.compile(rf"{_KEY}(?P<count>[ _]?\(?(?:seconds|minutes|hours)\)?)?", re.IGNORECASE)
_HOURS = 14
"""Hours from UTC that no zone goes beyond."""


@dataclass(frozen=True, kw_only=True)
class Statement:
    """What a line above the rows says of the clock.

    Attributes:
        line: its number, from 1.
        text: the words, as written.
        name: the zone, as `--zone` takes it.
    """

    line: int
    text: str
    name: str

    def advice(self) -> str:
        """What a user who named no zone may do."""
        return f"line {self.line} says {self.text!r}: if that is the zone of the stamps, --zone {self.name}"


def stated(lines: Sequence[str]) -> Statement | None:
    """The zone that the first lines of a file state first; `None` where none does, or another always contradicts it."""
    found: list[Statement] = []
    for number, line in enumerate(lines[:LINES], start=1):
        text = line[:_LONGEST]
        for match in _STATED.finditer(text):
            name = _name(match["zone"], match["count"] or "")
            if name is not None:
                found.append(Statement(line=number, text=" ".join(match[0].split()), name=name))
        below = lines[number][:_LONGEST] if number < len(lines) else ""
        found.extend(_below(text, below, number))
    offsets = [_offsets(zone(one.name)) for one in found]
    agree = all(any(one == other for one, other in zip(offsets[0], offset, strict=True)) for offset in offsets)
    return found[0] if found and agree else None


def hint(statement: Statement | None, lines: Sequence[str]) -> str:
    """What the first lines say to a user who named no zone: a statement, else an abbreviation; "" for neither."""
    return abbreviations.advice(lines) if statement is None else statement.advice()


def contradiction(says: str, theirs: str, given: str, time: Instants) -> tuple[Finding, ...]:
    """The finding that the zone a file states is another than the one that was given, at its first or last instant.

    Args:
        says: who states it, as the subject and verb of a sentence.
        theirs: the zone that is stated.
        given: the zone by which `time` [UTC ns] was read.
    """
    if not len(time):
        return ()
    parts = [
        (offset_at(zone(given), instant) - offset_at(zone(theirs), instant)) / (3600 * NANOSECONDS)
        for instant in (int(time.min()), int(time.max()))
    ]
    apart = max(parts, key=abs)
    if not apart:
        return ()
    return (
        Finding(
            kind="zone-contradicts", severity=Severity.WARNING, value=apart,
            what=f"{says} that the stamps are of {theirs}; {given} was given and is used, {abs(apart):g} h away",
            fix=f"give --zone {theirs}, unless the file is known to be wrong",
        ),
    )  # fmt: skip


def _below(line: str, below: str, number: int) -> list[Statement]:
    """Statements of which one line is a row of names and the next one of their values."""
    for delimiter in (",", ";", "\t"):
        names, values = ([cell.strip().strip('"') for cell in text.split(delimiter)] for text in (line, below))
        if len(names) < 2 or len(names) != len(values):
            continue
        found: list[Statement] = []
        for name, value in zip(names, values, strict=True):
            match = _KEY_ALONE.fullmatch(name)
            place = _name(value, match["count"] or "") if match is not None else None
            if place is not None:
                found.append(Statement(line=number + 1, text=f"{name} = {value}", name=place))
        return found
    return []


def _name(text: str, count: str) -> str | None:
    """The zone that a value spells, as `flagdata.timebase.zone` reads it; a number alone is hours, unless said."""
    word = text.strip()
    number = re.fullmatch(r"(?:UTC|GMT)?\s?([+-]?)(\d{1,5})", word, re.IGNORECASE)
    if number is not None:
        size = {"s": 1, "m": 60}.get(re.sub(r"[^a-z]", "", count.lower()).removeprefix("in")[:1], 3600)
        digits = int(number[2])
        together = size == 3600 and len(number[2]) > 2  # +0530
        seconds = digits // 100 * 3600 + digits % 100 * 60 if together else digits * size
        if seconds > _HOURS * 3600 or seconds % 60:
            return None
        sign = "-" if number[1] == "-" else "+"
        return f"{sign}{seconds // 3600:02d}:{seconds % 3600 // 60:02d}"
    try:
        zone(word)
    except FlagdataError:
        return None
    return word


def _offsets(place: tzinfo) -> tuple[timedelta | None, ...]:
    """A zone's offsets in January and July."""
    return tuple(datetime(2025, month, 1, tzinfo=UTC).astimezone(place).utcoffset() for month in (1, 7))
