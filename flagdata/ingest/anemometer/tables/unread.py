"""Columns that may be the direction of a wind which was read without one: told, with the line that reads them."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from flagdata.ingest.anemometer.tables import offered_columns, stated_columns
from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.times.timecolumns import event_stamps
from flagdata.ingest.anemometer.winds import bow
from flagdata.ingest.anemometer.winds.angles import compass_unit, may_be_direction, may_be_two
from flagdata.ingest.anemometer.winds.directions import judge
from flagdata.ingest.anemometer.winds.found import COMPONENTS, Wind
from flagdata.ingest.anemometer.words.headings import understand, words_of
from flagdata.ingest.anemometer.words.wind_words import COURSES

_FROM_NORTH = frozenset({"twd", "gwd"})
"""Directions that instruments of boats compute, from whichever north their compass is set to."""


def from_either_north(layout: Layout, time: TimeChoice | None, winds: Sequence[Wind]) -> tuple[str, ...]:
    """A remark for each direction that may be from true or from magnetic north."""
    found: list[str] = []
    for index, name in enumerate(layout.names):
        if not set(words_of(name)) & _FROM_NORTH:
            continue
        what = f"column {name!r} may be from true or magnetic north: left out"
        if time is not None and winds:
            line = offered_columns.read_also(layout, time, winds[0], index)
            what += f'; if from true north: --columns "{line}", else with wind_direction_magnetic for wind_direction'
        found.append(what)
    return tuple(found)


def times(layout: Layout, time: TimeChoice, remarks: Sequence[str]) -> tuple[str, ...]:
    """A remark for the columns of other stamps than the time's, and one for those of special events.

    Args:
        remarks: what was said of columns already.
    """
    said = (*remarks, time.remark or "")
    others = [repr(layout.names[at]) for at in time.others]
    others = [name for name in others if not any(name in remark for remark in said)]
    events = [at for at in event_stamps(layout) if at not in time.columns]
    events = [at for at in events if not any(repr(layout.names[at]) in remark for remark in said)]
    found: list[str] = []
    if others:
        what = f"columns {', '.join(others)} are times" if len(others) > 1 else f"column {others[0]} is a time"
        found.append(f"{what} as well: left out; to take another time, name it as time in --columns")
    if events:
        found.append(f"{_of_events(layout, events)}: left out")
    return tuple(found)


def events(layout: Layout) -> str:
    """Which columns of stamps are of special events, with "; " behind it; "" where none is."""
    columns = event_stamps(layout)
    return f"{_of_events(layout, columns)}; " if columns else ""


def _of_events(layout: Layout, columns: Sequence[int]) -> str:
    names = ", ".join(repr(layout.names[at]) for at in columns)
    what = f"columns {names} are times" if len(columns) > 1 else f"column {names} is the time"
    return f"{what} of a special event, not of the rows"


def directions(
    layout: Layout, time: TimeChoice | None, wind: Wind, winds: Sequence[Wind], remarks: Sequence[str]
) -> tuple[str, ...]:
    """A remark for each column that may be the direction of a wind which has none.

    Args:
        wind: the one that is read.
        winds: all of the table.
        remarks: what was said of columns already.
    """
    if time is None or not wind.sure:
        return ()
    told = [name for name in wind.columns if not name.startswith("apparent")]
    if any(name.endswith(("direction", "magnetic")) or name in COMPONENTS for name in told):
        return ()
    taken = {*time.columns, *(column.index for one in (wind, *winds) for column in one.columns.values())}
    found: list[str] = []
    for index, name in enumerate(layout.names):
        if index in taken:
            continue
        called = repr(name) if name else f"number {index + 1}"
        units = _may_be(layout, index)
        if units:
            line = offered_columns.read_also(layout, time, wind, index, unit_name=units[0])
            others = f", or with {' or '.join(f'[{unit}]' for unit in units[1:])}" if units[1:] else ""
            found.append(f'to read column {called} as the wind\'s direction: --columns "{line}"{others}')
            continue
        if any(repr(name) in remark for remark in remarks) or not may_be_direction(layout, index):
            continue
        if bow.to_bow(layout, index):
            line = offered_columns.read_also(layout, time, wind, index, channel="apparent_wind_direction")
            what = "is a direction from its platform's bow or mark, not from north"
            found.append(f'column {called} {what}: left out; to keep it as such: --columns "{line}"')
            continue
        line = offered_columns.read_also(layout, time, wind, index)
        found.append(f'column {called} may be the wind\'s direction, but is not read; if it is: --columns "{line}"')
    found = found or _of_several(layout, time, wind, remarks)
    return tuple(found) or _of_another(layout, time, wind, winds) or _unnamed_direction(layout, time, wind, taken)


def _of_several(layout: Layout, time: TimeChoice, wind: Wind, remarks: Sequence[str]) -> list[str]:
    """A remark with the line that reads the first of several directions, none of which is surely that of the wind."""
    for index, name in enumerate(layout.names):
        if not any(text.startswith("none of the directions") and repr(name) in text for text in remarks):
            continue
        heading = understand(name, layout.units[index])
        judged = judge(heading, numbers(layout.column(index), decimal=layout.decimal).value, "wind_direction")
        if heading.channel == "wind_direction" and judged.unit is not None:
            line = offered_columns.read_also(layout, time, wind, index, unit_name=judged.unit)
            return [f'if {name!r} is its direction: --columns "{line}"; another by its number for {index + 1}']
    return []


def _of_another(layout: Layout, time: TimeChoice, wind: Wind, winds: Sequence[Wind]) -> tuple[str, ...]:
    """A remark with the line that reads the one direction of the table, where it is that of another speed."""
    speed = wind.columns.get("wind_speed")
    known = {column.index: (one.label, column) for one in winds if (column := one.columns.get("wind_direction"))}
    if speed is None or len(known) != 1:
        return ()
    label, column = next(iter(known.values()))
    unit = column.unit or "deg"
    channel = stated_columns.TOWARDS if column.towards else "wind_direction"
    line = offered_columns.read_also(layout, time, wind, column.index, unit_name=unit, channel=channel)
    what = f"the direction {layout.names[column.index]!r} is that of {label!r}"
    return (f'{what}; to read it beside this speed: --columns "{line}"',)


def _unnamed_direction(layout: Layout, time: TimeChoice, wind: Wind, taken: Collection[int]) -> tuple[str, ...]:
    """A remark that no direction is read, where only the user knows which column is the speed, and so which is this."""
    speed = wind.columns.get("wind_speed")
    if speed is None or understand(layout.names[speed.index], layout.units[speed.index]).channel:
        return ()
    headings = enumerate(zip(layout.names, layout.units, strict=True))
    if all(at in taken or understand(*heading).quantity for at, heading in headings):
        return ()
    line = offered_columns.read_also(layout, time, wind, None)
    return (f'no direction is read beside this speed; if one holds it: --columns "{line}" with its number for the ?',)


def otherwise(layout: Layout, time: TimeChoice | None, wind: Wind) -> tuple[str, ...]:
    """A remark with the line that reads the direction of a wind in the other way that its heading or values leave open.

    It may be in another unit, or where the wind blows to.
    """
    column = wind.columns.get("wind_direction")
    judged = offered_columns.doubted(layout, column) if column is not None else None
    if time is None or column is None or judged is None:
        return ()
    name = layout.names[column.index]
    if judged.may_be and judged.may_be[0] != column.unit:
        line = offered_columns.read_also(layout, time, wind, column.index, unit_name=judged.may_be[0])
        return (f'to read column {name!r} in {judged.may_be[0]}: --columns "{line}"',)
    if set(words_of(name)) & COURSES:
        to = stated_columns.TOWARDS
        line = offered_columns.read_also(layout, time, wind, column.index, unit_name=column.unit, channel=to)
        return (f'to read column {name!r} as where the wind blows to: --columns "{line}"',)
    return ()


def relative(layout: Layout, winds: Sequence[Wind]) -> tuple[str, ...]:
    """A remark for each direction from a platform's bow that is left out beside one from north."""
    taken = {column.index for wind in winds for column in wind.columns.values()}
    north = [column.index for wind in winds for name, column in wind.columns.items() if name == "wind_direction"]
    return tuple(
        f"column {name!r} is relative to its platform: left out beside {layout.names[north[0]]!r}, which is from north"
        for index, name in enumerate(layout.names)
        if north and index not in taken and bow.to_bow(layout, index) and may_be_direction(layout, index)
    )


def _may_be(layout: Layout, index: int) -> tuple[str, ...]:
    """The units that a direction which is left out for its numbers may be in; none where it is no such column."""
    heading = understand(layout.names[index], layout.units[index])
    if heading.channel != "wind_direction":
        return ()
    if compass_unit(layout, index) is None and may_be_two(layout, index):
        return "points-de", "points-es"
    judged = judge(heading, numbers(layout.column(index), decimal=layout.decimal).value, heading.channel)
    return judged.may_be if judged.left_out else ()
