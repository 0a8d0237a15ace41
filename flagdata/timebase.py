"""Instants: UTC nanoseconds since 1970 as int64, and their text forms.

A wall-clock time becomes an instant only with an explicit zone. Where daylight saving makes a wall
time ambiguous or impossible, the functions say so; they never pick silently.

Abbreviations of time zones: what each may mean. None is the name of a zone, and many are of
several.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta, timezone, tzinfo
from functools import cache
from typing import Literal
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError, available_timezones

from flagdata.errors import TimeError, UnknownNameError, suggest

_PLACES = (
    "Europe/Amsterdam",
    "Europe/London",
    "Europe/Lisbon",
    "Europe/Athens",
    "Europe/Moscow",
    "America/New_York",
    "America/Chicago",
    "America/Denver",
    "America/Los_Angeles",
    "America/Anchorage",
    "Pacific/Honolulu",
    "America/Halifax",
    "America/St_Johns",
    "Asia/Kolkata",
    "Europe/Dublin",
    "Asia/Jerusalem",
    "Asia/Shanghai",
    "Asia/Tokyo",
    "Asia/Seoul",
    "Australia/Sydney",
    "Australia/Adelaide",
    "Australia/Perth",
    "Pacific/Auckland",
    "Africa/Johannesburg",
    "Africa/Lagos",
    "Africa/Nairobi",
    "Pacific/Pago_Pago",
)
"""Places that are named rather than others of the same clock."""
_ELSEWHERE: Mapping[str, Mapping[str, str]] = {
    "MEZ": {"+01:00": "Europe/Berlin"},
    "MESZ": {"+02:00": "Europe/Berlin"},
    "MET": {"+01:00": "Europe/Amsterdam"},
    "MEST": {"+02:00": "Europe/Amsterdam"},
    "HNEC": {"+01:00": "Europe/Paris"},
    "HAEC": {"+02:00": "Europe/Paris"},
    "ET": {"-05:00": "America/New_York", "-04:00": "America/New_York"},
    "CT": {"-06:00": "America/Chicago", "-05:00": "America/Chicago"},
    "MT": {"-07:00": "America/Denver", "-06:00": "America/Denver"},
    "PT": {"-08:00": "America/Los_Angeles", "-07:00": "America/Los_Angeles"},
    "BRT": {"-03:00": "America/Sao_Paulo"},
    "BRST": {"-02:00": "America/Sao_Paulo"},
    "ART": {"-03:00": "America/Argentina/Buenos_Aires"},
    "CLT": {"-04:00": "America/Santiago"},
    "CLST": {"-03:00": "America/Santiago"},
    "COT": {"-05:00": "America/Bogota"},
    "PET": {"-05:00": "America/Lima"},
    "VET": {"-04:00": "America/Caracas"},
    "UYT": {"-03:00": "America/Montevideo"},
    "ECT": {"-05:00": "America/Guayaquil"},
    "AMT": {"-04:00": "America/Manaus", "+04:00": "Asia/Yerevan"},
    "AST": {"+03:00": "Asia/Riyadh"},
    "BST": {"+06:00": "Asia/Dhaka"},
    "GST": {"+04:00": "Asia/Dubai"},
    "IRST": {"+03:30": "Asia/Tehran"},
    "TRT": {"+03:00": "Europe/Istanbul"},
    "UZT": {"+05:00": "Asia/Tashkent"},
    "NPT": {"+05:45": "Asia/Kathmandu"},
    "ICT": {"+07:00": "Asia/Bangkok"},
    "SGT": {"+08:00": "Asia/Singapore"},
    "SST": {"+08:00": "Asia/Singapore"},
    "MYT": {"+08:00": "Asia/Kuala_Lumpur"},
    "PHT": {"+08:00": "Asia/Manila"},
    "WST": {"+08:00": "Australia/Perth", "+13:00": "Pacific/Apia"},
    "CHST": {"+10:00": "Pacific/Guam"},
    "EST": {"+10:00": "Australia/Brisbane"},
    "FET": {"+03:00": "Europe/Minsk"},
    "SAMT": {"+04:00": "Europe/Samara"},
}
"""Abbreviations in use that the tz database does not have, or not for these places."""


def meanings(abbreviation: str) -> dict[str, str]:
    """Maps the offsets from UTC ("+02:00") that an abbreviation may mean to a place whose clocks
    are called so; empty for no abbreviation."""
    name = abbreviation.strip().upper()
    return {**_names_of_clocks().get(name, {}), **_ELSEWHERE.get(name, {})}


@cache
def _names_of_clocks() -> dict[str, dict[str, str]]:
    """Maps what clocks of this year are called to their offset and the first place, by the tz
    database."""
    clocks: dict[str, dict[str, str]] = {}
    middle = datetime.now(UTC).replace(day=15)
    for zone_name in (*_PLACES, *sorted(name for name in available_timezones() if "/" in name)):
        for month in (1, 7):
            clock = middle.replace(month=month).astimezone(ZoneInfo(zone_name))
            name = (clock.tzname() or "").upper()
            if name.isalpha() and name not in ("UTC", "GMT"):
                clocks.setdefault(name, {}).setdefault(
                    _written(clock.utcoffset() or timedelta()), zone_name
                )
    return clocks


def _written(offset: timedelta) -> str:
    minutes = round(offset.total_seconds() / 60)
    return f"{'-' if minutes < 0 else '+'}{abs(minutes) // 60:02d}:{abs(minutes) % 60:02d}"


NANOSECONDS = 1_000_000_000
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_FIXED = re.compile(r"^(?:UTC|GMT)?([+-])(\d{1,2}):?([0-5]\d)?$")
_ISO = re.compile(
    r"^(\d{4})-(\d{2})-(\d{2})(?:[T "
    r"](\d{2}):(\d{2})(?::(\d{2})(?:[.,](\d{1,9}))?)?)?\s*(Z|[+-]\d{2}(?::?[0-5]\d)?)?$"
)

WallStatus = Literal["unique", "ambiguous", "nonexistent"]


def zone(name: str, *, where: str | None = None) -> tzinfo:
    """Returns the time zone called `name`: an IANA name ("Europe/Amsterdam"), "UTC", or a fixed
    offset ("+02:00").

    An abbreviation ("CET") is refused even where the tz database has a zone of that name: whether
    its clock is set in summer is what the abbreviation leaves open.

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
            raise TimeError(
                f"the offset {text!r} is beyond ±14:00",
                where=where,
                fix="give an offset such as +02:00",
            )
        return timezone(sign * offset)
    if text.isalpha() and (clocks := meanings(text)):
        raise _abbreviation_error(text, clocks, where)
    try:
        return ZoneInfo(text)
    except (ZoneInfoNotFoundError, ValueError, OSError):
        places = sorted(
            name for name in available_timezones() if "/" in name and not name.startswith("Etc/")
        )
        raise UnknownNameError(
            f"the time zone {name!r} is unknown",
            where=where,
            fix=suggest(text, places) or "give a name such as Europe/Amsterdam, or +02:00, or UTC",
        ) from None


def _abbreviation_error(
    text: str, clocks: Mapping[str, str], where: str | None
) -> UnknownNameError:
    """Returns the error for an abbreviation of these clocks, offset → place."""
    meanings_found = " or ".join(
        f"{offset} (as in {where_used})" for offset, where_used in clocks.items()
    )
    offsets, places = (" or ".join(dict.fromkeys(names)) for names in (clocks, clocks.values()))
    return UnknownNameError(
        f"{text!r} is an abbreviation, no name of a time zone: it may mean {meanings_found}",
        where=where,
        fix=f"give the offset that the clock kept, {offsets}; if it was set in summer and winter, "
        "give the place whose "
        f"time it followed, {places}",
    )


def from_datetime(moment: datetime, *, nanosecond: int = 0) -> int:
    """Converts an aware `moment` (exact to the microsecond) plus `nanosecond` below the microsecond
    to UTC nanoseconds.

    Raises:
        TimeError: when `moment` carries no zone.
    """
    if moment.tzinfo is None:
        raise TimeError(
            f"the time {moment.isoformat()} has no zone", fix="name the zone it was written in"
        )
    delta = moment - _EPOCH
    return (
        (delta.days * 86_400 + delta.seconds) * NANOSECONDS
        + delta.microseconds * 1_000
        + nanosecond
    )


def wall_status(wall: datetime, local_zone: tzinfo) -> WallStatus:
    """Checks whether a naive wall-clock time occurs once, twice or never in `local_zone`
    (daylight-saving jumps)."""
    early = wall.replace(tzinfo=local_zone, fold=0)
    late = wall.replace(tzinfo=local_zone, fold=1)
    if early.utcoffset() == late.utcoffset():
        return "unique"
    back = early.astimezone(UTC).astimezone(local_zone).replace(tzinfo=None)
    return "ambiguous" if back == wall else "nonexistent"


def from_wall(
    wall: datetime, local_zone: tzinfo, *, fold: int | None = None, where: str | None = None
) -> int:
    """Converts a naive wall-clock time in a zone to UTC nanoseconds.

    Args:
        fold: 0 or 1 chooses the first or second pass of an ambiguous hour; `None` refuses it.

    Raises:
        TimeError: the wall time never occurs there, or occurs twice and `fold` was not given.
    """
    status = wall_status(wall, local_zone)
    if status == "nonexistent":
        raise TimeError(
            f"{wall.isoformat(sep=' ')} does not exist in {local_zone}: the clocks were set "
            "forward over it",
            where=where,
            fix="give the zone the instrument's clock really ran on (many loggers stay on winter "
            "time, e.g. +01:00)",
        )
    if status == "ambiguous" and fold is None:
        raise TimeError(
            f"{wall.isoformat(sep=' ')} occurs twice in {local_zone}: the clocks were set back "
            "over it",
            where=where,
            fix="give a fixed offset such as +02:00 (before the change) or +01:00 (after it)",
        )
    return from_datetime(wall.replace(tzinfo=local_zone, fold=fold or 0))


def parse(text: str, *, default: tzinfo | None = None, where: str | None = None) -> int:
    """Parses an ISO 8601 time such as "2026-05-01T12:00:00.25+02:00" to UTC nanoseconds, to the
    nanosecond.

    Args:
        default: the zone of a time that names none; with `None` such a time is refused.

    Raises:
        TimeError: not ISO 8601, not a calendar date, or without a zone.
    """
    match = _ISO.match(text.strip())
    if not match:
        raise TimeError(
            f"{text!r} is not an ISO 8601 time",
            where=where,
            fix="write it as 2026-05-01T12:00:00+02:00",
        )
    year, month, day, hour, minute, second, fraction, offset = match.groups()
    try:
        # A wall-clock time: its zone is attached below.
        wall = datetime(  # noqa: DTZ001
            int(year), int(month), int(day), int(hour or 0), int(minute or 0), int(second or 0)
        )
    except ValueError:
        message = f"{text!r} is no day or time of the calendar"
        raise TimeError(message, where=where, fix="correct the date") from None
    nanosecond = int((fraction or "").ljust(9, "0"))
    local_zone = zone(offset, where=where) if offset else default
    if local_zone is None:
        raise TimeError(
            f"the time {text!r} has no zone",
            where=where,
            fix="append one, e.g. +02:00 or Z, or name it by --zone",
        )
    return from_wall(wall, local_zone, where=where) + nanosecond


def names_zone(text: str) -> bool:
    """Checks whether an ISO 8601 time names its own zone; false for what is no such time."""
    match = _ISO.match(text.strip())
    return match is not None and match[8] is not None


def iso(instant: int) -> str:
    """Writes UTC nanoseconds as ISO 8601, with as many decimals (0, 3, 6 or 9) as it takes to be
    exact."""
    seconds, nanosecond = divmod(int(instant), NANOSECONDS)
    text = (_EPOCH + timedelta(seconds=seconds)).strftime("%Y-%m-%dT%H:%M:%S")
    if nanosecond:
        digits = f"{nanosecond:09d}"
        keep = 3 if digits.endswith("000000") else 6 if digits.endswith("000") else 9
        text += "." + digits[:keep]
    return text + "Z"
