"""Headings of the instant of something that came once, such as the last lightning, which is never the time of a row."""

from __future__ import annotations

import re

from flagdata.ingest.anemometer.words.extremes import of_extreme
from flagdata.ingest.anemometer.words.headings import words_of

_EVENTS = frozenset(
    {
        "lightning", "strike", "strikes", "thunder", "sunrise", "sunset", "moonrise", "moonset", "dawn", "dusk",
        "installed", "installation", "commissioned", "calibrated", "calibration", "maintenance", "firmware", "boot",
        "reboot", "rebooted", "blitz", "sonnenaufgang", "sonnenuntergang",
    }
)  # fmt: skip
_LAST = frozenset(
    {"rain", "rainfall", "precipitation", "reset", "restart", "start", "cal", "service", "lluvia", "regen"}
)
"""What came last or since then: the heading says "last" as well."""
_JOINED = re.compile(
    r"lightning|strike(?:s|time|date|$)|sunrise|sunset|moonrise|moonset|install|calibrat|firmware|boot(?:time|date|ed|$)"
    r"|last(?:rain|boot|reboot|reset|restart|strike|cal(?=$|time|date)|service)"
)
"""Headings whose words are joined."""


def of_event(heading: str) -> bool:
    """Whether a heading is of the instant of an event or of an extreme, as "lightning_time" or "Date of max gust"."""
    words = words_of(heading)
    known = set(words)
    if known & _EVENTS or ("last" in known and known & _LAST) or _JOINED.search("".join(words)):
        return True
    return of_extreme(heading)
