"""The date and the time of day that the names of pictures state."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from flagdata.core.numbered import Ordinal
from flagdata.timebase import NANOSECONDS

_FRACTION = 3  # digits from which on a number behind the seconds is a fraction of one
_CLOCK_NUMBER = re.compile(r"\d+")
_CLOCK = re.compile(
    r"""(?<!\d)
    (?:
        (?P<date>(?:19|20)\d\d(?P<sep>[-_.]?)(?:0[1-9]|1[0-2])(?P=sep)(?:0[1-9]|[12]\d|3[01]))
        (?:at|[-_.\st])*
    )?
    (?:(?P<h>[01]\d|2[0-3])(?P<m>[0-5]\d)(?P<s>[0-5]\d)(?P<attached>\d*)
     |(?P<hh>[01]?\d|2[0-3])[-_.:h](?P<mm>[0-5]\d)[-_.:m](?P<ss>[0-5]\d)(?!\d))
    (?:\s*(?P<half>[ap]m)\b)?
    (?:(?P<mark>[-_.,])(?P<behind>\d+))?""",
    re.VERBOSE,
)


@dataclass(frozen=True, kw_only=True)
class Clock:
    """Times of day that all names of a folder state at the same place.

    Attributes:
        times: of each name, from any origin [ns].
        counts: number behind the seconds that is no fraction of one, as of a burst; 0 where there
            is none.
        first, last: numbers of the names that make it, from `first` up to `last`.
        dated: whether the names state the day.
        resolution: of the times [ns].
        problem: why it does not say the order, and what to do about it; None where it does.
    """

    times: tuple[int, ...]
    counts: tuple[Ordinal, ...]
    first: int
    last: int
    dated: bool
    resolution: int
    problem: tuple[str, str] | None = None


def clock_of(stems: Sequence[str]) -> Clock | None:
    """Reads the clock in names of one text; None where there is none, or it stands still.

    Six digits without a day are taken for a time of day where none is of the first hour: smaller
    numbers count.
    """
    matches = [match for stem in stems if (match := _CLOCK.search(stem)) is not None]
    if len(matches) < len(stems):
        return None
    places = {
        (len(_CLOCK_NUMBER.findall(m.string[: m.start()])), len(_CLOCK_NUMBER.findall(m[0])))
        for m in matches
    }
    dated = {match["date"] is not None for match in matches}
    if len(places) > 1 or len(dated) > 1:
        return None
    hours = {int(match["h"] or match["hh"]) for match in matches}
    plain = not all(dated) and matches[0]["h"] is not None
    if plain and ((0 in hours and 23 not in hours) or any(match["attached"] for match in matches)):
        return None
    try:
        seconds = [_seconds(match) for match in matches]
    except ValueError:  # no such day
        return None
    if len(set(seconds)) == 1:
        return None
    parts = [(match["attached"] or "") + (match["behind"] or "") for match in matches]
    widths = {len(part) for part in parts}
    exact = len(widths) == 1 and min(widths) >= _FRACTION
    fractions = [int(part[:9].ljust(9, "0")) if exact else 0 for part in parts]
    first, count = places.pop()
    return Clock(
        times=tuple(
            second * NANOSECONDS + part for second, part in zip(seconds, fractions, strict=True)
        ),
        counts=tuple(Ordinal.read("0" if exact or not part else part) for part in parts),
        first=first,
        last=first + count,
        dated=all(dated),
        resolution=10 ** max(0, 9 - min(widths)) if exact else NANOSECONDS,
        problem=_problem(
            overnight=not all(dated) and {0, 23} <= hours,
            loose=len(widths) > 1,
            mark=matches[0]["mark"],
        ),
    )


def _problem(*, overnight: bool, loose: bool, mark: str | None) -> tuple[str, str] | None:
    if overnight:
        return (
            (
                "the names state times of day of both sides of midnight and no day: their order is "
                "not known"
            ),
            "put the date before the time in the names, as 20260501_235959",
        )
    if loose and mark in (".", ","):
        message = (
            f"the numbers behind the seconds and {mark!r} are of several lengths: fractions or "
            "counts is not known"
        )
        return message, "write them with the same number of digits, as 12-00-00.520"
    return None


def _seconds(match: re.Match[str]) -> int:
    """Seconds since 1970 of a date and time of day; of a time of day, since midnight.

    Raises:
        ValueError: no such day.
    """
    hour, minute, second = (
        int(match[short] or match[long]) for short, long in (("h", "hh"), ("m", "mm"), ("s", "ss"))
    )
    if match["half"] is not None:
        hour = hour % 12 + (12 if match["half"] == "pm" else 0)
    of_day = (hour * 60 + minute) * 60 + second
    if match["date"] is None:
        return of_day
    digits = re.sub(r"\D", "", match["date"])
    return int(datetime.strptime(digits, "%Y%m%d").replace(tzinfo=UTC).timestamp()) + of_day
