"""Columns that a recipe of the catalog does not read: told as of a table that is read without one."""

from __future__ import annotations

from dataclasses import replace

from flagdata.ingest.anemometer.recipe import Recipe
from flagdata.ingest.anemometer.sniffing import HEAD_LINES
from flagdata.ingest.anemometer.tables import unread, unread_rest, unread_winds
from flagdata.ingest.anemometer.text.layout import Layout, lay_out
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.ingest.anemometer.times.timecolumns import find_time
from flagdata.ingest.anemometer.winds.found import Column, Wind
from flagdata.ingest.anemometer.words.headings import interest


def remarks(source: TextFile, recipe: Recipe, *, devices_by: int | None = None) -> tuple[str, ...]:
    """A remark for each kind of column of the wind that is not read, with the line that reads it, and one for the rest.

    Args:
        recipe: that the file was read by.
        devices_by: a column that may tell devices apart, which the lines name.
    """
    layout = lay_out(source.head(HEAD_LINES), interest=interest)
    if layout is None or not any(layout.names):
        return ()
    layout = replace(layout, site=devices_by)
    columns = {
        channel: Column(index=at, unit=column.unit, told="by the recipe", towards=column.convention == "to")
        for channel, column in recipe.channels.items() if (at := _index(layout, column.column)) is not None
    }  # fmt: skip
    if not columns:
        return ()
    time = find_time(layout)
    wind = Wind(label=recipe.name, height=None, columns=columns, sure=True)
    found = unread.directions(layout, time, wind, (wind,), ())
    found = (*found, *unread_winds.remark(layout, time, wind, (wind,), found))
    return (*found, *unread_rest.remark(layout, time, (wind,), found))


def _index(layout: Layout, column: str | int) -> int | None:
    """The index of a recipe's column; `None` where the table has none of that name or number (from 1)."""
    if isinstance(column, int):
        return column - 1 if column <= layout.number_of_columns() else None
    return layout.names.index(column) if column in layout.names else None
