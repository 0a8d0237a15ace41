"""From the wall clock of a place to UTC for a whole log, and the zone that a log states above its
rows.

A wall time in the hour that daylight saving repeats is settled only by the log itself: its rows run
through the hour twice, or follow without a gap from before it, or lead without a gap to after it.
Otherwise the log is refused.

What lines above the rows say of the clock ("UTC Offset,+2", "Timezone=UTC") is a hint, not a
property of the stamps: a logger's setting may be one thing and its export another. It is named
where a zone is missing, and compared with the zone that the user gives.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, tzinfo

import numpy as np

from flagdata.core.arrays import BoolArray, IntArray
from flagdata.core.findings import Finding
from flagdata.core.shell import command_line
from flagdata.errors import FlagdataError, TimeError, ZoneMissingError
from flagdata.ingest.anemometer.instants.log_clock import usual
from flagdata.ingest.anemometer.instants.stamp_text import HOUR
from flagdata.record.signals import Instants
from flagdata.timebase import NANOSECONDS, zone

LINES = 100
"""Lines at the beginning of a file in which a zone is looked for."""
_LONGEST = 300
"""Characters of a line that are looked at."""
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_FIX = (
    "give the fixed offset that the logger's clock ran on, e.g. +01:00 (many loggers stay on "
    "winter time); if its "
    "clock was set at another time than those of the zone, the offset of its first rows and "
    "--clock first, or that of "
    "its last rows and --clock last"
)
_MISSING = (
    "name the zone of the logger's clock: the place whose clocks it followed through summer and "
    "winter time, e.g. "
    "--zone Europe/Amsterdam, or its offset if it was never set, e.g. --zone +01:00"
)
_STATED = re.compile(
    r"(?<![A-Za-z])(?:time[ _-]?zone(?:[ _]name)?(?:\s*\((?:utc|gmt)\s*[+±]?\s*\))?|(?:utc|gmt)[ "
    r"_-]?(?:time[ _]?)?"
    r"offset|offset[ _](?:from|to)[ _](?:utc|gmt))[\"']?\s*(?:->|[=:,;|\t(]|\s)+\s*[\"']?(?P<zone>"
    r"[A-Z][A-Za-z]+/[A-Za-z_]+(?:/[A-Za-z_]+)?(?:[+-]\d{1,2})?"
    r"|(?:UTC|GMT)?\s?[+-]?\d{1,4}(?::?\d{2})?|UTC|GMT|Z)"
    r"(?![A-Za-z/\d.]|\s?[+±]\s?\))",
    re.IGNORECASE,
)


def to_utc(
    wall: IntArray, local_zone: tzinfo, *, lines: IntArray, where: str
) -> tuple[IntArray, tuple[Finding, ...]]:
    """Converts wall-clock nanoseconds to UTC nanoseconds, in the order of the rows.

    Args:
        wall: (n,) nanoseconds since 1970 as the wall clock shows them.
        lines: (n,) line numbers, for messages.

    Raises:
        TimeError: a wall time that never occurred there, or one that occurred twice without
            evidence which.
    """
    if len(wall) == 0:
        return wall.copy(), ()
    first, last = int(wall.min()) - 26 * HOUR, int(wall.max()) + 26 * HOUR
    offset = np.full(len(wall), offset_at(local_zone, first), dtype=np.int64)
    findings: list[Finding] = []
    for instant, before, after in _changes(local_zone, first, last):
        start, end = instant + min(before, after), instant + max(before, after)
        rows = np.flatnonzero((wall >= start) & (wall < end))
        offset[wall >= end] = after
        if not len(rows):
            continue
        if after > before:
            raise TimeError(
                f"{_show(int(wall[rows[0]]))} does not exist in {local_zone}: the clocks were set "
                "forward over it",
                where=f"{where}, line {lines[rows[0]]}",
                fix=_FIX,
            )
        late = _second_pass(wall, rows, end - start, local_zone, f"{where}, line {lines[rows[0]]}")
        offset[late] = after
        message = (
            f"the hour from {_show(start)} occurs twice in {local_zone}; by their order "
            f"{len(rows) - len(late)} "
        )
        message += f"rows are of its first pass, {len(late)} of its second"
        findings.append(
            Finding.of("clocks-set-back", message, count=len(rows), where=f"line {lines[rows[0]]}")
        )
    return wall - offset, tuple(findings)


def _second_pass(
    wall: IntArray, rows: IntArray, length: int, local_zone: tzinfo, where: str
) -> IntArray:
    """Finds the rows in a repeated interval [ns] that are of its second pass."""
    steps, step = np.diff(wall[rows[0] : rows[-1] + 1]), usual(wall)
    back = np.flatnonzero((steps <= -length // 2) | ((steps == 0) & (step >= length)))
    if len(back) == 1:
        return rows[rows > rows[0] + back[0]]
    reach = max(10 * step, 2 * NANOSECONDS)
    before = rows[0] > 0 and wall[rows[0]] - wall[rows[0] - 1] <= reach
    after = rows[-1] + 1 < len(wall) and wall[rows[-1] + 1] - wall[rows[-1]] <= reach
    if len(back) == 0 and before != after:
        return rows if after else rows[:0]
    reason = "nothing in the log says which pass it is"
    if len(back):
        reason = "the log goes back more than once within that hour"
    elif before:
        reason = "the log runs through it once without a break, so its clock was not set back"
    raise TimeError(
        f"{_show(int(wall[rows[0]]))} occurs twice in {local_zone} and {reason}",
        where=where,
        fix=_FIX,
    )


def instants(
    wall: IntArray, utc: BoolArray, *, line: IntArray, zone_name: str | None, where: str
) -> tuple[Instants, tuple[Finding, ...]]:
    """Converts stamps, some of which may state their own zone, to UTC nanoseconds.

    Raises:
        TimeError: stamps without a zone and none named, or impossible in it.
    """
    if utc.all():
        return wall, ()
    if zone_name is None:
        where_first = f"{where}, line {line[np.flatnonzero(~utc)[0]]}"
        raise ZoneMissingError("the stamps carry no time zone", where=where_first, fix=_MISSING)
    time = wall.copy()
    time[~utc], findings = to_utc(wall[~utc], zone(zone_name), lines=line[~utc], where=where)
    return time, findings


def offset_at(local_zone: tzinfo, instant: int) -> int:
    """Computes how far a zone's clocks are east of UTC at an instant [ns]."""
    delta = (_EPOCH + timedelta(seconds=instant // NANOSECONDS)).astimezone(local_zone).utcoffset()
    return 0 if delta is None else (delta.days * 86_400 + delta.seconds) * NANOSECONDS


def _changes(local_zone: tzinfo, low: int, high: int) -> Sequence[tuple[int, int, int]]:
    """Changes of the zone's offset between two instants: (UTC ns, offset before, after [ns east]).

    Each is found to the second by bisection of steps of a day.
    """
    changes: list[tuple[int, int, int]] = []
    edge, offset = low, offset_at(local_zone, low)
    while edge < high:
        upper = min(edge + 24 * HOUR, high)
        value = offset_at(local_zone, upper)
        if value != offset:
            earlier, later = edge // NANOSECONDS, upper // NANOSECONDS
            while later - earlier > 1:
                middle = (earlier + later) // 2
                earlier, later = (
                    (middle, later)
                    if offset_at(local_zone, middle * NANOSECONDS) == offset
                    else (earlier, middle)
                )
            changes.append((later * NANOSECONDS, offset, value))
        edge, offset = upper, value
    return changes


def _show(wall: int) -> str:
    return (_EPOCH + timedelta(seconds=wall // NANOSECONDS)).strftime("%Y-%m-%d %H:%M:%S")


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
        """Advises a user who named no zone."""
        option = command_line("--zone", self.name)
        return f"line {self.line} says {self.text!r}: if that is the zone of the stamps, {option}"


def stated_zone(lines: Sequence[str]) -> Statement | None:
    """Finds the zone that the first lines of a file state; `None` where none does, or they state
    several."""
    statements = [
        Statement(line=number, text=" ".join(match[0].split()), name=name)
        for number, line in enumerate(lines[:LINES], start=1)
        for match in _STATED.finditer(line[:_LONGEST])
        if (name := _name(match["zone"].strip())) is not None
    ]
    winters, summers = (
        {offset_at(zone(statement.name), at) for statement in statements}
        for at in (0, 182 * 24 * HOUR)
    )
    return statements[0] if len(winters) == 1 or len(summers) == 1 else None


def _name(word: str) -> str | None:
    """Names the zone that a value spells, as `flagdata.timebase.zone` reads it; a number alone is
    hours, or hours and minutes."""
    number = re.fullmatch(r"(?:UTC|GMT)?\s?([+-]?)(\d{1,2})(\d{2})?", word, re.IGNORECASE)
    name = (
        f"{number[1] or '+'}{int(number[2]):02d}:{number[3] or '00'}"
        if number is not None
        else word
    )
    try:
        zone(name)
    except FlagdataError:
        return None
    return name


def contradiction(says: str, theirs: str, given_zone: str, time: Instants) -> tuple[Finding, ...]:
    """Reports that the zone a file states is another than the one that was given, at its first or
    last instant.

    Args:
        says: who states it, as the subject and verb of a sentence.
        theirs: the zone that is stated.
        given_zone: the zone by which `time` [UTC ns] was read.
    """
    ends = (int(time.min()), int(time.max())) if len(time) else ()
    hours_between = (
        max(
            (offset_at(zone(given_zone), at) - offset_at(zone(theirs), at) for at in ends),
            key=abs,
            default=0,
        )
        / HOUR
    )
    if not hours_between:
        return ()
    message = (
        f"{says} that the stamps are of {theirs}; {given_zone} was given and is used, "
        f"{abs(hours_between):g} h away"
    )
    fix = f"give {command_line('--zone', theirs)}, unless the file is known to be wrong"
    return (Finding.of("zone-contradicts", message, value=hours_between, fix=fix),)
