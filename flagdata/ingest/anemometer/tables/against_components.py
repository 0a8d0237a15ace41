"""A direction that points to where the components of the same wind in other columns say that it comes from."""

from __future__ import annotations

from dataclasses import replace

from flagdata.ingest.anemometer.tables import offered_columns
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.winds import vectors
from flagdata.ingest.anemometer.winds.instruments import Column, Wind
from flagdata.ingest.anemometer.words.headings import understand


def doubt(layout: Layout, time: TimeChoice, wind: Wind) -> tuple[str, str] | None:
    """What is in doubt of a direction that is read, and the lines of columns for either way; `None` where nothing is.

    Args:
        wind: as it was understood, with a speed and a direction.
    """
    found = _opposite(layout, wind, time)
    if found is None:
        return None
    what, direction = found
    other = replace(direction, towards=not direction.towards)
    as_from, as_to = sorted((direction, other), key=lambda column: column.towards)
    lines = [
        offered_columns.read_as(layout, time, replace(wind, columns={**wind.columns, "wind_direction": column}))
        for column in (as_to, as_from)
    ]
    fix = (
        f"if the components are towards east and north, as is usual, it is where the wind blows to: {lines[0]}; if the "
        f"components are of where the wind comes from: {lines[1]}"
    )
    return what, fix


def warnings(layout: Layout, wind: Wind) -> tuple[str, ...]:
    """What is to be told of a direction that the user states, or of one beside components that are read."""
    if "wind_x" not in wind.columns or "wind_y" not in wind.columns:
        found = _opposite(layout, wind, None)
        name = "" if found is None else layout.names[found[1].index]
        return () if found is None else (f"{found[0]}: {name!r} is taken as you said",)
    x, y = (wind.columns[channel].index for channel in ("wind_x", "wind_y"))
    return tuple(
        f"column {name!r} points to where the wind comes from by {layout.names[x]!r} and {layout.names[y]!r}, which "
        "are taken as towards which the wind blows: if they are of where it comes from, the wind is turned by 180°"
        for at, name in enumerate(layout.names)
        if understand(name, layout.units[at]).channel == "wind_direction" and vectors.opposite(layout, x, y, at)
    )


def _opposite(layout: Layout, wind: Wind, time: TimeChoice | None) -> tuple[str, Column] | None:
    speed, direction = wind.columns.get("wind_speed"), wind.columns.get("wind_direction")
    if speed is None or direction is None or direction.unit != "deg":
        return None
    apart = time.columns if time is not None else ()
    found = vectors.beside(layout, speed.index, direction.index, towards=direction.towards, apart=apart)
    if found is None or not found.opposite:
        return None
    pointed = "where the wind comes from" if direction.towards else "where the wind blows to"
    x, y, of, to = (layout.names[at] for at in (found.x, found.y, speed.index, direction.index))
    what = f"column {to!r} is {pointed} by {x!r} and {y!r}, the components of {of!r} in the same rows"
    return what, direction
