"""Instants by which a version can be named: 2026-11-26 (the end of that day, UTC), a time with its zone, 3.days.ago."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta

from flagdata.errors import TimeError, UsageError
from flagdata.timebase import NANOSECONDS, from_datetime, names_zone, parse

_DAY = re.compile(r"\d{4}-\d{2}-\d{2}")
_AGO = re.compile(r"(\d{1,6})\.(second|minute|hour|day|week)s?\.ago")
_SECONDS = {"second": 1, "minute": 60, "hour": 3600, "day": 86_400, "week": 7 * 86_400}


def moment(text: str, *, now: datetime | None = None) -> int | None:
    """The instant that a text names [UTC ns]; `None` for what names none.

    Args:
        now: from which "ago" counts; the system's clock if `None`.

    Raises:
        UsageError: a day that the calendar does not have, or a time without its zone.
    """
    ago = _AGO.fullmatch(text)
    if ago is not None:
        passed = timedelta(seconds=int(ago[1]) * _SECONDS[ago[2]])
        try:
            return from_datetime((now or datetime.now(UTC)) - passed)
        except OverflowError:
            raise UsageError(f"{text!r} is before the year 1", where="--at", fix="name a later instant") from None
    if not re.match(_DAY, text):
        return None
    try:
        if _DAY.fullmatch(text):
            return parse(f"{text}T00:00:00Z") + 86_400 * NANOSECONDS - 1
        if not names_zone(text):
            raise UsageError(f"{text!r} names no zone", where="--at", fix=f"write {text}Z, or +02:00 behind it")
        return parse(text)
    except TimeError as error:
        raise UsageError(error.what, where="--at", fix="write 2026-11-26, or 2026-11-26T12:00:00Z") from None
