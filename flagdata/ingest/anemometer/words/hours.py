"""Times of day in the headings of tables of one row a day: "WindSpeed9am", "3pm wind speed", "ff_0900"."""

from __future__ import annotations

import re

_TWELVE = re.compile(
    r"(?<![\d.])(?P<hour>1[0-2]|0?[1-9])(?::(?P<minute>[0-5]\d))?[\s_]?(?P<half>[AaPp])\.?[Mm](?![a-z])"
)
_WHOLE = re.compile(r"(?<![\d.])(?P<hour>[01]\d|2[0-3]):?(?P<minute>00|30)(?![\d.])")
_LEVELS = frozenset({"1000", "2000"})
"""Numbers that are as likely a pressure [hPa] or a year."""


def minute_of(heading: str) -> int | None:
    """The minute of the day that a heading gives, 540 for 9 am; `None` where it gives none."""
    twelve = _TWELVE.search(heading)
    if twelve is not None:
        hour = int(twelve["hour"]) % 12 + (12 if twelve["half"].lower() == "p" else 0)
        return 60 * hour + int(twelve["minute"] or 0)
    whole = [match for match in _WHOLE.finditer(heading) if match[0] not in _LEVELS]
    return 60 * int(whole[0]["hour"]) + int(whole[0]["minute"]) if len(whole) == 1 else None
