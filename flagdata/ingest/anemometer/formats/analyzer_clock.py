"""The zone of canboat's messages by the lines that its own program writes between them, which are in UTC.

    INFO 2026-05-01T12:00:00.125Z [analyzer] New PGN 130306 for device 36 (heap 5000 bytes)
    2026-05-01-12:00:00.125 2  36 255 130306 Wind Data:  SID = 177; Wind Speed = 5.00 m/s; …

The program stamps its own line when it reads the message below it. Where it reads them as they come, both are the same
instant, and the messages are in UTC as well; where it reads a recording, its lines are of another time, and tell
nothing.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Iterable

_OWN = re.compile(r"(?:DEBUG|INFO|WARN|WARNING|ERROR|FATAL)\s+(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(?:\.\d{1,6})?)Z\s+\[")
_MESSAGE = re.compile(r"(\d{4}-\d\d-\d\d)[T -](\d\d:\d\d:\d\d(?:\.\d{1,6})?)(?=[\s,])")
_FEWEST = 3
"""Pairs of a line of the program and the message below it, from which on they show the zone."""
_APART = dt.timedelta(seconds=1)
"""What the two stamps of each pair may differ by."""


def in_utc(lines: Iterable[str]) -> bool:
    """Whether each message without a zone that follows a line of the program has that line's instant in UTC."""
    pairs = 0
    own: dt.datetime | None = None
    for line in lines:
        said = _OWN.match(line)
        if said is not None:
            own = _instant(said[1])
            continue
        message = _MESSAGE.match(line)
        if message is None or own is None:
            continue
        stamp = _instant(f"{message[1]}T{message[2]}")
        if stamp is None or abs(stamp - own) > _APART:
            return False
        pairs, own = pairs + 1, None
    return pairs >= _FEWEST


def _instant(text: str) -> dt.datetime | None:
    """A date and a time of day; `None` for one that is none."""
    whole, _, fraction = text.partition(".")
    try:
        return dt.datetime.fromisoformat(whole) + dt.timedelta(seconds=float(f"0.{fraction or 0}"))
    except ValueError:
        return None
