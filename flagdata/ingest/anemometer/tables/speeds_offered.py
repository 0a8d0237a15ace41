"""Which columns a line that is offered may name as the speed of a wind: no component, and none that is empty."""

from __future__ import annotations

from collections.abc import Mapping

from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.winds import bow, named_axes, negative
from flagdata.ingest.anemometer.winds.found import Wind
from flagdata.ingest.anemometer.words.headings import words_of


def is_offered(layout: Layout, wind: Wind) -> bool:
    """Whether a wind is offered as it was understood: by its components, or by a column that may be a speed.

    A letter of a component alone, with no direction beside it, is to be named by the user.
    """
    speed = wind.columns.get("wind_speed")
    if speed is None:
        return True
    alone = not wind.sure and "wind_direction" not in wind.columns and named_axes.is_letter(layout, speed.index)
    return may_be_wind(layout, wind) and not alone


def may_be_wind(layout: Layout, wind: Wind) -> bool:
    """Whether a wind is of components, or the column of its speed may be one."""
    speed = wind.columns.get("wind_speed")
    return speed is None or may_be(layout, speed.index)


def may_be(layout: Layout, index: int) -> bool:
    """Whether a column may be a speed: it does not go below zero, and is none of several components."""
    return negative.may_be_speed(layout, index) and not named_axes.is_lettered(layout, index)


def may_stand(layout: Layout, index: int) -> bool:
    """Whether a column may be named in the place of another: it holds numbers, and may be a speed."""
    return is_filled(layout, index) and may_be(layout, index)


def is_none(layout: Layout, channel: str) -> bool:
    """Whether an empty column of a channel is of no use: of no wind, or another column of that quantity is filled."""
    if "wind" not in channel:
        return True
    filled = (at for at in range(layout.number_of_columns()) if is_filled(layout, at))
    return any(bow.heading_of(layout, at).quantity == channel and _is_mean(layout, at) for at in filled)


def latest(layout: Layout) -> Mapping[int, str]:
    """The entry of the latest reading of a wind's speed, where no mean of it is filled; empty where there is none."""
    for at in range(layout.number_of_columns()):
        heading = bow.heading_of(layout, at)
        if _is_latest(layout, at) and heading.quantity == "wind_speed" and is_filled(layout, at):
            return {at: f"wind_speed[{heading.unit or '?'}]"}
    return {}


def _is_mean(layout: Layout, index: int) -> bool:
    """Whether a column is no gust or another statistic."""
    return not bow.heading_of(layout, index).spread or _is_latest(layout, index)


def _is_latest(layout: Layout, index: int) -> bool:
    return {"latest", "samples"} <= set(words_of(layout.names[index]))


def is_filled(layout: Layout, index: int) -> bool:
    """Whether a column holds numbers in the first rows."""
    return any(cell_kind(cell) == "number" for cell in layout.column(index))
