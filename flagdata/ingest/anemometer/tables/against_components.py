"""A direction that contradicts the components of the same wind in other columns."""

from __future__ import annotations

from dataclasses import replace

from flagdata.ingest.anemometer.tables import offered_columns
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.winds import vectors
from flagdata.ingest.anemometer.winds.found import Column, Wind
from flagdata.ingest.anemometer.winds.vectors import Components
from flagdata.ingest.anemometer.words.headings import understand


def doubt(layout: Layout, time: TimeChoice, wind: Wind) -> tuple[str, str] | None:
    """What is in doubt of a direction that is read, and the lines of columns for either way; `None` where nothing is.

    Args:
        wind: as it was understood, with a speed and a direction.
    """
    found = _contradiction(layout, wind, time)
    if found is None or found[1].way == "turned":
        return None
    what, components, speed, direction = found
    as_read = offered_columns.read_as(layout, time, wind)
    if components.way == "mirrored":
        own = {
            name: Column(index=at, unit=speed.unit, told="")
            for name, at in (("wind_x", components.x), ("wind_y", components.y))
        }
        others = {name: one for name, one in wind.columns.items() if not name.startswith("wind_")}
        instead = offered_columns.read_as(layout, time, replace(wind, columns={**own, **others}))
        return what, (
            f"if the components are towards east and north, read them in its place: {instead}; if it is counted "
            f"clockwise from north as a compass does, and the components are along other axes: {as_read}"
        )
    other = replace(direction, towards=not direction.towards)
    turned = offered_columns.read_as(layout, time, replace(wind, columns={**wind.columns, "wind_direction": other}))
    as_to, as_from = (as_read, turned) if direction.towards else (turned, as_read)
    return what, (
        f"if the components are towards east and north, as is usual, it is where the wind blows to: {as_to}; if the "
        f"components are of where the wind comes from: {as_from}"
    )


def warnings(layout: Layout, wind: Wind, *, stated: bool = True) -> tuple[str, ...]:
    """What is to be told of a direction that is read, or of one beside components that are read.

    Args:
        stated: whether the user says that the direction is what it is read as, so that nothing is refused.
    """
    if "wind_x" not in wind.columns or "wind_y" not in wind.columns:
        found = _contradiction(layout, wind, None)
        if found is None or not (stated or found[1].way == "turned"):
            return ()
        end = ": one of them is not from north" if found[1].way == "turned" else ""
        said = f"is taken as {'you said' if stated else 'it is'}"
        return (f"{found[0]}{end}: {layout.names[found[3].index]!r} {said}",)
    x, y = (wind.columns[channel].index for channel in ("wind_x", "wind_y"))
    both = f"{layout.names[x]!r} and {layout.names[y]!r}"
    found_texts: list[str] = []
    for at, name in enumerate(layout.names):
        if understand(name, layout.units[at]).channel != "wind_direction":
            continue
        components = vectors.way_of(layout, x, y, at)
        if components is None or components.way == "same":
            continue
        found_texts.append(f"column {name!r} {_against(components, both)}")
    return tuple(found_texts)


def _against(components: Components, both: str) -> str:
    """What a direction is that is left out beside components, and what of them may be wrong."""
    if components.way == "opposite":
        return (
            f"points to where the wind comes from by {both}, which are taken as towards which the wind blows: if they "
            "are of where it comes from, the wind is turned by 180°"
        )
    if components.way == "turned":
        return (
            f"differs by {components.turn:.0f}° from where the wind comes from by {both}, which are taken as towards "
            "east and north: if they are along the instrument's own axes, the wind is turned by as much"
        )
    return (
        f"is counted the other way round than the wind turns by {both}, which are taken as towards east and north: it "
        "is an angle of mathematics, or they are along other axes and the wind is mirrored"
    )


def _contradiction(
    layout: Layout, wind: Wind, time: TimeChoice | None
) -> tuple[str, Components, Column, Column] | None:
    """What components say against a direction, with them, the speed and the direction; `None` where they agree."""
    speed, direction = wind.columns.get("wind_speed"), wind.columns.get("wind_direction")
    if speed is None or direction is None or direction.unit != "deg":
        return None
    apart = time.columns if time is not None else ()
    found = vectors.beside(layout, speed.index, direction.index, towards=direction.towards, apart=apart)
    if found is None or found.way == "same":
        return None
    x, y, of, to = (layout.names[at] for at in (found.x, found.y, speed.index, direction.index))
    pointed = {
        "opposite": "is " + ("where the wind comes from" if direction.towards else "where the wind blows to"),
        "mirrored": "is counted counter-clockwise, as angles are in mathematics,",
        "turned": f"differs by {found.turn:.0f}° from the wind's direction",
    }[found.way]
    what = f"column {to!r} {pointed} by {x!r} and {y!r}, the components of {of!r} in the same rows"
    return what, found, speed, direction
