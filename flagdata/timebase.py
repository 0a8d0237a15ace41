"""Instants: UTC nanoseconds since 1970 as int64, and their text forms.

A wall-clock time becomes an instant only with an explicit zone. Where daylight saving makes a wall time ambiguous or
impossible, the functions say so; they never pick silently.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta, timezone, tzinfo
from typing import Literal
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError, available_timezones

from flagdata.errors import TimeError, UnknownNameError
from flagdata.zone_names import meanings

NANOSECONDS = 1_000_000_000
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_FIXED = re.compile(r"^(?:UTC|GMT)?([+-])(\d{1,2}):?(\d{2})?$")
_ISO = re.compile(
    r"^(\d{4})-(\d{2})-(\d{2})(?:[T ](\d{2}):(\d{2})(?::(\d{2})(?:[.,](\d{1,9}))?)?)?\s*(Z|[+-]\d{2}(?::?\d{2})?)?$"
)

WallStatus = Literal["unique", "ambiguous", "nonexistent"]


def zone(name: str, *, where: str | None = None) -> tzinfo:
    """The time zone called `name`: an IANA name ("Europe/Amsterdam"), "UTC", or a fixed offset ("+02:00").

    An abbreviation ("CET") is refused even where the tz database has a zone of that name: whether its clock is set in
    summer is what the abbreviation leaves open.

    Raises:
        UnknownNameError: with what an abbreviation may mean, or with the nearest IANA name.
    """
    text = name.strip()
    if text.upper() in ("UTC", "Z", "GMT"):
        return UTC
    fixed = _FIXED.match(text)
    if fixed:
        sign = 1 if fixed[1] == "+" else -1
        offset = timedelta(hours=int(fixed[2]), minutes=int(fixed[3] or 0))
        if offset > timedelta(hours=14):
            raise TimeError(f"the offset {text!r} is beyond ±14:00", where=where, fix="give an offset such as +02:00")
        return timezone(sign * offset)
    if text.isalpha() and (clocks := meanings(text)):
        raise _abbreviated(text, clocks, where)
    try:
        return ZoneInfo(text)
    except (ZoneInfoNotFoundError, ValueError, OSError):
        places = sorted(name for name in available_timezones() if "/" in name and not name.startswith("Etc/"))
        close = difflib.get_close_matches(text, places, n=1)
        raise UnknownNameError(
            f"unknown time zone {name!r}",
            where=where,
            fix=f"did you mean {close[0]!r}?" if close else "give a name such as Europe/Amsterdam, or +02:00, or UTC",
        ) from None


def _abbreviated(text: str, clocks: Mapping[str, str], where: str | None) -> UnknownNameError:
    """The error for an abbreviation of these clocks, offset → place."""
    shown = " or ".join(f"{offset} (as in {place})" for offset, place in clocks.items())
    offsets, places = (" or ".join(dict.fromkeys(names)) for names in (clocks, clocks.values()))
    return UnknownNameError(
        f"{text!r} is an abbreviation, no name of a time zone: it may mean {shown}",
        where=where,
        fix=f"give the offset that the clock kept, {offsets}; if it was set in summer and winter, give the place whose "
        f"time it followed, {places}",
    )


def from_datetime(moment: datetime, *, nanosecond: int = 0) -> int:
    """UTC nanoseconds of an aware `moment` (exact to the microsecond) plus `nanosecond` below the microsecond.

    Raises:
        TimeError: when `moment` carries no zone.
    """
    if moment.tzinfo is None:
        raise TimeError(f"the time {moment.isoformat()} has no zone", fix="name the zone it was written in")
    delta = moment - _EPOCH
    return (delta.days * 86_400 + delta.seconds) * NANOSECONDS + delta.microseconds * 1_000 + nanosecond


def wall_status(wall: datetime, place: tzinfo) -> WallStatus:
    """Whether a naive wall-clock time occurs once, twice or never in `place` (daylight-saving jumps)."""
    early = wall.replace(tzinfo=place, fold=0)
    late = wall.replace(tzinfo=place, fold=1)
    if early.utcoffset() == late.utcoffset():
        return "unique"
    back = early.astimezone(UTC).astimezone(place).replace(tzinfo=None)
    return "ambiguous" if back == wall else "nonexistent"


def from_wall(wall: datetime, place: tzinfo, *, fold: int | None = None, where: str | None = None) -> int:
    """UTC nanoseconds of a naive wall-clock time in `place`.

    Args:
        fold: 0 or 1 chooses the first or second pass of an ambiguous hour; `None` refuses it.

    Raises:
        TimeError: the wall time never occurs there, or occurs twice and `fold` was not given.
    """
    status = wall_status(wall, place)
    if status == "nonexistent":
        raise TimeError(
            f"{wall.isoformat(sep=' ')} does not exist in {place}: the clocks were set forward over it",
            where=where,
            fix="give the zone the instrument's clock really ran on (many loggers stay on winter time, e.g. +01:00)",
        )
    if status == "ambiguous" and fold is None:
        raise TimeError(
            f"{wall.isoformat(sep=' ')} occurs twice in {place}: the clocks were set back over it",
            where=where,
            fix="give a fixed offset such as +02:00 (before the change) or +01:00 (after it)",
        )
    return from_datetime(wall.replace(tzinfo=place, fold=fold or 0))


def parse(text: str, *, default: tzinfo | None = None, where: str | None = None) -> int:
    """UTC nanoseconds of an ISO 8601 time such as "2026-05-01T12:00:00.25+02:00", to the nanosecond.

    Args:
        default: the zone of a time that names none; with `None` such a time is refused.

    Raises:
        TimeError: not ISO 8601, not a calendar date, or without a zone.
    """
    match = _ISO.match(text.strip())
    if not match:
        raise TimeError(f"{text!r} is not an ISO 8601 time", where=where, fix="write it as 2026-05-01T12:00:00+02:00")
    year, month, day, hour, minute, second, fraction, offset = match.groups()
    try:
        # A wall-clock time: its zone is attached below.
        wall = datetime(int(year), int(month), int(day), int(hour or 0), int(minute or 0), int(second or 0))  # noqa: DTZ001
    except ValueError:
        what = f"{text!r} is no day or time of the calendar"
        raise TimeError(what, where=where, fix="correct the date") from None
    nanosecond = int((fraction or "").ljust(9, "0"))
    place = zone(offset, where=where) if offset else default
    if place is None:
        raise TimeError(
            f"the time {text!r} has no zone", where=where, fix="append one, e.g. +02:00 or Z, or name it by --zone"
        )
    return from_wall(wall, place, where=where) + nanosecond


def names_zone(text: str) -> bool:
    """Whether an ISO 8601 time names its own zone; false for what is no such time."""
    match = _ISO.match(text.strip())
    return match is not None and match[8] is not None


def iso(instant: int) -> str:
    """ISO 8601 text of UTC nanoseconds, with as many decimals (0, 3, 6 or 9) as it takes to be exact."""
    seconds, nanosecond = divmod(int(instant), NANOSECONDS)
    text = (_EPOCH + timedelta(seconds=seconds)).strftime("%Y-%m-%dT%H:%M:%S")
    if nanosecond:
        digits = f"{nanosecond:09d}"
        keep = 3 if digits.endswith("000000") else 6 if digits.endswith("000") else 9
        text += "." + digits[:keep]
    return text + "Z"
