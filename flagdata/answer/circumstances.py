"""When, where and with what recordings were made, as far as files state it: rows of an answer's
first screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

from flagdata.timebase import NANOSECONDS, zone


@dataclass(frozen=True, kw_only=True)
class Circumstances:
    """Those of one recording; what no file states is None or empty.

    Attributes:
        start: instant of its first frame [UTC ns].
        seconds: that it lasts.
        zone: name of the clocks' zone at the place.
        session: one set-up at one place.
        sensor: what logged the wind, in words.
        clock: standard uncertainty of film and log beside each other [s].
        clock_method: by which they were put on one clock.
    """

    start: int | None = None
    seconds: float = 0.0
    zone: str | None = None
    session: str | None = None
    sensor: str = ""
    clock: float | None = None
    clock_method: str | None = None

    def part(self, first: float, seconds: float) -> Circumstances:
        """Returns those of a part that begins `first` seconds after the first frame."""
        start = None if self.start is None else self.start + round(first * NANOSECONDS)
        return replace(self, start=start, seconds=seconds)


def list_circumstances(several: Sequence[Circumstances]) -> dict[str, str]:
    """Lists what there is to know of recordings: date and time, session, anemometer, clock."""
    facts: dict[str, str] = {}
    dated = [(one, one.start) for one in several if one.start is not None]
    if dated:
        first = min(start for _, start in dated)
        last = max(start + round(one.seconds * NANOSECONDS) for one, start in dated)
        zones = {one.zone for one, _ in dated}
        facts["date and time"] = _write_period(
            first, last, zones.pop() if len(zones) == 1 else None
        )
    for name, stated in (
        ("session", [one.session for one in several]),
        ("anemometer", [one.sensor for one in several]),
    ):
        if known := list(dict.fromkeys(one for one in stated if one)):
            facts[name] = ", ".join(known)
    if clocks := [one for one in several if one.clock]:
        worst = max(clocks, key=lambda one: one.clock or 0.0)
        by = "" if worst.clock_method is None else f", by {worst.clock_method}"
        facts["clock"] = f"recording and log on one clock to ± {worst.clock:.2g} s (1 σ){by}"
    return facts


def _write_period(start: int, end: int, zone_name: str | None) -> str:
    """Writes a period of instants [UTC ns], in the clocks of a zone or in UTC."""
    known = UTC if zone_name is None else zone(zone_name)
    first, last = (datetime.fromtimestamp(one / NANOSECONDS, known) for one in (start, end))
    day, other = (f"{one.day} {one:%B %Y}" for one in (first, last))
    until = f"{last:%H:%M:%S}" if day == other else f"{other}, {last:%H:%M:%S}"
    clock = "UTC" if zone_name is None else f"local time ({zone_name})"
    return f"{day}, {first:%H:%M:%S} to {until}, {clock}"
