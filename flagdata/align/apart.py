"""Whether the clocks of a camera and a log that are paired are hours apart: a wrong zone, a date
that was never set."""

from __future__ import annotations

from flagdata.core.findings import Finding
from flagdata.timebase import NANOSECONDS, iso

HOURS_APART = 1800.0
"""Clocks that differ by this [s] or more are hours apart: half an hour is the least by which zones
differ but for a few that differ by a quarter; a clock that someone set drifts that far in years."""
_QUARTER = 900.0  # s; zones differ by whole quarters of an hour
_NEAR = 120.0  # s about a whole quarter


def by_spans(
    film: tuple[int, int], log: tuple[int, int], *, names: tuple[str, str]
) -> Finding | None:
    """Warns where film and log (or two logs), as stamped, lie `HOURS_APART` or more from each
    other; else `None`.

    Args:
        film, log: first and last instant of each, on its own clock [UTC ns].
        names: of film and log.
    """
    before, after = (log[0] - film[1]) / NANOSECONDS, (film[0] - log[1]) / NANOSECONDS
    gap = max(before, after)
    if gap < HOURS_APART:
        return None
    return Finding.of(
        "clocks-hours-apart",
        f"{names[0]} is stamped {iso(film[0])} to {iso(film[1])}, and {names[1]} {iso(log[0])} to "
        f"{iso(log[1])}: "
        f"{names[1]} {'begins' if before > after else 'ends'} {_length(gap)} "
        f"{'after' if before > after else 'before'} {names[0]}",
        value=gap if before > after else -gap,
        fix="if they were made together, ingest the one anew whose --zone, --start or --date is "
        "wrong, or search "
        "around the difference: --centre SECONDS",
    )


def by_offset(offset: float, *, names: tuple[str, str]) -> Finding | None:
    """Warns where a clock model shifts the film's clock by `HOURS_APART` or more; else `None`.

    Args:
        offset: added to the film's clock [s].
    """
    if abs(offset) < HOURS_APART:
        return None
    rest = abs(abs(offset) - round(abs(offset) / _QUARTER) * _QUARTER)
    zone = ", about what zones differ by" if rest <= _NEAR else ""
    return Finding.of(
        "clocks-hours-apart",
        f"the clocks of {names[0]} and {names[1]} are {_length(abs(offset))} apart{zone}",
        value=offset,
        fix="ingest the one anew whose --zone, --start or --date is wrong: the day of its clips "
        "may be wrong too",
    )


def _length(seconds: float) -> str:
    minutes = round(seconds / 60)
    if minutes < 48 * 60:
        return f"{minutes // 60} h {minutes % 60:02d} min"
    return f"{minutes / 1440:.0f} days"
