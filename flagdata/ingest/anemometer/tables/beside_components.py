"""Components beside a speed and a direction: what is left out of the two ways to tell a wind, with the line for it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from flagdata.ingest.anemometer.tables import offered_columns
from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.winds.angles import compass_unit, unit_of
from flagdata.ingest.anemometer.winds.directions import judge
from flagdata.ingest.anemometer.winds.found import Column, Wind
from flagdata.ingest.anemometer.words.headings import understand

_CLOSE, _LEAST = 0.05, 0.05
"""Share of a speed, and m/s or the like, within which the components of a row make it."""
_UPWARD, _ROWS = 0.02, 5
"""Share of a speed by which the vertical wind lengthens it, in so many rows at least, so that it is told."""
_MOST = 0.8
"""Share of the rows in which they must."""


def remark(layout: Layout, time: TimeChoice | None, wind: Wind) -> tuple[str, ...]:
    """The line that reads a direction beside components with the speed of its own column; none where there is none."""
    x, y = wind.columns.get("wind_x"), wind.columns.get("wind_y")
    if time is None or x is None or y is None or "wind_speed" in wind.columns:
        return ()
    taken = {*time.columns, *(column.index for column in wind.columns.values())}
    directions = [at for at in range(layout.number_of_columns()) if at not in taken and _is_direction(layout, at)]
    if not directions:
        return ()
    direction = Column(index=directions[0], unit=unit_of(layout, directions[0]), told="")
    speed = _speed(layout, x, y, {*taken, *directions})
    own = replace(wind, columns={**wind.columns, "wind_direction": direction})
    name = layout.names[direction.index]
    if speed is None:
        line = offered_columns.read_instead(layout, time, own, None)
        return (f"to read {name!r} with the speed of its own column: {line} with the number of the speed for the ?",)
    own = replace(own, columns={**own.columns, "wind_speed": Column(index=speed, unit=x.unit, told="")})
    line = offered_columns.read_instead(layout, time, own, speed)
    what = (
        f"column {layout.names[speed]!r} is the speed that {layout.names[x.index]!r} and {layout.names[y.index]!r} make"
    )
    return (f"{what}, and is left out too; to read it with {name!r} in place of the components: {line}",)


def instead(layout: Layout, time: TimeChoice | None, wind: Wind) -> tuple[str, ...]:
    """The line that reads the components of a speed in its place; none where they are read, or there are none."""
    speed, parts = wind.columns.get("wind_speed"), _parts(layout)
    if time is None or speed is None or "wind_x" not in parts or "wind_y" not in parts:
        return ()
    others = {name: column for name, column in wind.columns.items() if not name.startswith("wind_")}
    columns = {name: Column(index=at, unit=speed.unit, told="") for name, at in parts.items()}
    line = offered_columns.read_as(layout, time, replace(wind, columns={**columns, **others}))
    names = ", ".join(repr(layout.names[at]) for at in parts.values())
    return (f"to read the components {names} in place of {layout.names[speed.index]!r}: {line}",)


def lengths(layout: Layout, wind: Wind) -> tuple[str, ...]:
    """A warning where a speed is the length of three components, so that it is no horizontal one."""
    speed, parts = wind.columns.get("wind_speed"), _parts(layout)
    if speed is None or set(parts) != {"wind_x", "wind_y", "wind_z"}:
        return ()
    value, x, y, z = (numbers(layout.column(at), decimal=layout.decimal).value for at in (speed.index, *parts.values()))
    flat, whole = np.hypot(x, y), np.sqrt(x**2 + y**2 + z**2)
    known = np.isfinite(value) & np.isfinite(whole) & (whole - flat > _UPWARD * whole)
    off = np.abs(np.stack([value - whole, value - flat]))[:, known]
    if (
        int(known.sum()) < _ROWS
        or float((off[0] < off[1]).mean()) < _MOST
        or float(np.median(off[0] / whole[known])) > 0.01
    ):
        return ()
    names = ", ".join(repr(layout.names[at]) for at in parts.values())
    return (f"column {layout.names[speed.index]!r} is the length of {names}: the vertical wind is in it",)


def _parts(layout: Layout) -> dict[str, int]:
    """The columns of components by channel, where one column is each."""
    channels = [understand(name, unit).channel for name, unit in zip(layout.names, layout.units, strict=True)]
    return {name: channels.index(name) for name in ("wind_x", "wind_y", "wind_z") if channels.count(name) == 1}


def _is_direction(layout: Layout, index: int) -> bool:
    """Whether a column has the heading of a wind's direction, and points of the compass or angles below it."""
    heading = understand(layout.names[index], layout.units[index])
    if heading.channel != "wind_direction":
        return False
    value = numbers(layout.column(index), decimal=layout.decimal).value
    if compass_unit(layout, index) is not None:
        return True
    return bool(np.isfinite(value).any()) and not judge(heading, value, "wind_direction").left_out


def _speed(layout: Layout, x: Column, y: Column, taken: Collection[int]) -> int | None:
    """The column whose numbers are the length of the horizontal components; `None` where no column, or several, are."""
    value = [numbers(layout.column(column.index), decimal=layout.decimal).value for column in (x, y)]
    length = np.hypot(value[0], value[1])
    found: list[int] = []
    for at in range(layout.number_of_columns()):
        if at in taken:
            continue
        off = np.abs(numbers(layout.column(at), decimal=layout.decimal).value - length)
        known = np.isfinite(off)
        close = off[known] <= _CLOSE * length[known] + _LEAST
        if int(known.sum()) > 1 and float(close.mean()) >= _MOST and float(np.ptp(length[known])) > _LEAST:
            found.append(at)
    return found[0] if len(found) == 1 else None
