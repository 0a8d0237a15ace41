"""What a table does not tell and no recipe can: start, day and zone of its stamps, and whether wind is over ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from flagdata.ingest.anemometer.instants import counted, yearless, zones
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.tables import stated_rate
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.winds import own_motion
from flagdata.ingest.anemometer.winds.found import Wind


@dataclass(frozen=True, kw_only=True)
class Need:
    """What a table does not tell and no recipe can: what, how to say it, and the option that says it."""

    what: str
    fix: str
    option: Literal["zone", "date", "start", "platform"]

    def without(self, options: WindOptions) -> bool:
        """Whether the user has not said it yet."""
        return getattr(options, self.option) is None


def needs_of(lines: Sequence[str], layout: Layout, time: TimeChoice | None) -> tuple[Need, ...]:
    """What the stamps of a time leave open: its start, its day, its zone."""
    if time is None or time.counts:
        return ()
    if time.form is not None and counted.is_elapsed(time.form):
        fix = "give the instant of the first: --start TIME"
        above = stated_rate.advice(lines[: layout.preamble + max(1, layout.header)] if layout.header else ())
        fix += f" ({above})" if above else ""
        return (Need(what="its rows count from a start", fix=fix, option="start"),)
    found: list[Need] = []
    if time.form is not None and counted.is_time_of_day(time.form):
        fix = "give the day of the first row: --date DATE"
        found.append(Need(what="its stamps have no date", fix=fix, option="date"))
    if time.form is not None and yearless.is_yearless(time.form):
        texts = stamps_of(layout, time.columns)
        read = counted.parse([text for text in texts if text.strip()], time.form)
        what, fix = yearless.missing(time.form, int(read.ns[read.valid].flat[0]))
        found.append(Need(what=what, fix=fix, option="date"))
    if not time.zoned and time.zone is None:
        fix = "name the zone of the logger's clock, e.g. --zone Europe/Amsterdam or --zone +01:00"
        hint = zones.hint(zones.stated(lines), lines)
        fix = f"{fix}; {hint}" if hint else fix
        fix = f"{fix}; {time.zone_advice}" if time.zone_advice else fix
        found.append(Need(what="its stamps have no zone", fix=fix, option="zone"))
    return tuple(found)


def over_ground(layout: Layout, wind: Wind | None) -> tuple[Need, ...]:
    """Whether a wind is over ground, where a column shows that its platform moves and the wind does not say it."""
    moves = own_motion.vessel(layout)
    relative = wind is not None and any(name.startswith(("apparent", "theoretical")) for name in wind.columns)
    if not moves or wind is None or "wind_speed" not in wind.columns or relative:
        return ()
    what = f"{moves!r} shows that the platform moves, and {wind.label!r} does not say whether it is wind over ground"
    fix = (
        "say it: --platform moving where it is apparent wind, as an anemometer on board measures it, --platform "
        "corrected where the platform's motion was taken out, --platform fixed where it stands still"
    )
    return (Need(what=what, fix=fix, option="platform"),)


def stamps_of(layout: Layout, columns: Sequence[int]) -> list[str]:
    """The stamps of the rows, as the cells of their columns with a blank between."""
    return [" ".join(row[index].strip() for index in columns) for row in layout.rows]
