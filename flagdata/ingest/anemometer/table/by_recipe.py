"""A table read by a recipe: cells, horizontal wind of components, platform."""

from __future__ import annotations

from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import Recipe
from flagdata.ingest.anemometer.samples import platform
from flagdata.ingest.anemometer.table.rowclock import Given
from flagdata.ingest.anemometer.table.sonic import with_horizontal
from flagdata.ingest.anemometer.table.table import read_table
from flagdata.ingest.anemometer.text.rows import RowReader
from flagdata.ingest.anemometer.text.source import TextFile


def read_by_recipe(source: TextFile, recipe: Recipe, options: WindOptions, *, azimuth: float | None) -> Reading:
    """All rows of a table, in the order of the file.

    Args:
        azimuth: of the axes of components [rad, clockwise from true north].

    Raises:
        UsageError, InputError, TimeError: see `read_table`.
    """
    where = str(source.path)
    rows = RowReader(source, recipe.file)
    given = Given(start=options.start, date=options.date, clock=options.clock)
    columns = platform.position_columns(rows.header or ())
    table = read_table(rows, recipe, where=where, zone_name=options.zone, extra=columns or (), given=given)
    reading = with_horizontal(table.reading, azimuth, where=where)
    positions = {name: table.extra[column] for name, column in zip(platform.POSITION, columns or (), strict=False)}
    return platform.settle(reading, options.platform, positions=positions, where=where)
