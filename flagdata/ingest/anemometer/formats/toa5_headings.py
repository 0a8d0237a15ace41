"""What the words of a TOA5 table's headings tell where no names of Campbell's programs do: a direction without a unit.

And what of the columns that are read contradicts another: components that point where the wind comes from.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.recipe import ChannelLayout
from flagdata.ingest.anemometer.sniffing import HEAD_LINES
from flagdata.ingest.anemometer.tables import against_components, unread
from flagdata.ingest.anemometer.text.layout import Layout, lay_out
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.times.timecolumns import find_time
from flagdata.ingest.anemometer.winds.found import Column, Wind
from flagdata.ingest.anemometer.winds.instruments import find_winds
from flagdata.ingest.anemometer.words.headings import interest, understand


def direction(
    source: TextFile, channels: Mapping[str, ChannelLayout]
) -> tuple[ChannelLayout | None, tuple[Finding, ...]]:
    """The direction beside the speed that is read, as the words of its heading and its numbers tell; and what to say.

    Args:
        channels: that are read, by names of columns.
    """
    if "wind_speed" not in channels or {"wind_direction", "wind_x"} & set(channels):
        return None, ()
    table = _table(source)
    if table is None:
        return None, ()
    layout, time = table
    winds, remarks, _ = find_winds(layout, time=time.columns)
    own = (wind for wind in winds if _name(layout, wind, "wind_speed") == channels["wind_speed"].column)
    column = next((wind.columns.get("wind_direction") for wind in own), None)
    if column is not None and column.unit is not None:
        name = layout.names[column.index]
        convention = "to" if column.towards else "from"
        what = f"the header states no unit of {name!r} that is known: wind_direction is read from it, {column.told}"
        found = Finding(kind="unit-from-values", severity=Severity.NOTE, what=what)
        return ChannelLayout(column=name, unit=column.unit, convention=convention), (found,)
    wind = _as_read(layout, channels)
    texts = unread.directions(layout, time, wind, (wind,), ())
    what = "; ".join([*(text for text in remarks if "direction" in text), *texts])
    return None, (Finding(kind="columns-not-read", severity=Severity.NOTE, what=what),) if texts else ()


def contradictions(source: TextFile, channels: Mapping[str, ChannelLayout]) -> tuple[Finding, ...]:
    """A warning for each direction that contradicts the components which are read."""
    if not {"wind_x", "wind_y"} <= set(channels):
        return ()
    table = _table(source)
    if table is None:
        return ()
    texts = against_components.warnings(table[0], _as_read(table[0], channels), stated=False)
    return tuple(
        Finding(
            kind="heading-doubtful", severity=Severity.WARNING, what=text,
            fix="check in the logger's program what its components are of",
        )
        for text in texts
    )  # fmt: skip


def _table(source: TextFile) -> tuple[Layout, TimeChoice] | None:
    """The table as its headings tell it, with its time; `None` where they do not, or name no direction."""
    names = next(csv.reader(source.head(2)[1:]), [])
    if not any("direction" in understand(name).quantity for name in names):
        return None
    layout = lay_out(source.head(HEAD_LINES), interest=interest)
    time = None if layout is None else find_time(layout)
    return None if layout is None or time is None else (layout, time)


def _name(layout: Layout, wind: Wind, channel: str) -> str:
    return layout.names[wind.columns[channel].index] if channel in wind.columns else ""


def _as_read(layout: Layout, channels: Mapping[str, ChannelLayout]) -> Wind:
    """The wind that is read, as one of the table."""
    columns = {
        name: Column(index=layout.names.index(str(one.column)), unit=one.unit, told="")
        for name, one in channels.items() if one.column in layout.names
    }  # fmt: skip
    return Wind(label="", height=None, columns=columns, sure=True)
