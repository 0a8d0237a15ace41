"""The recipe that is drafted for a table, as TOML; "?" stands where its user is to complete it."""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.ingest.anemometer.recipe import DELIMITERS
from flagdata.ingest.anemometer.tables import offered_columns
from flagdata.ingest.anemometer.tables.line_kinds import line_kinds
from flagdata.ingest.anemometer.tables.rows_above import rows_above
from flagdata.ingest.anemometer.text.layout import Layout, lay_out
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.winds import missing_codes
from flagdata.ingest.anemometer.winds.found import Column, Wind
from flagdata.ingest.anemometer.winds.sites import site_of_all
from flagdata.ingest.anemometer.words.headings import interest, understand


def delimiter_name(delimiter: str) -> str:
    """What a recipe calls a delimiter."""
    return next(name for name, character in DELIMITERS.items() if character == delimiter)


def quoted(text: str) -> str:
    """A text as TOML writes it."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t") + '"'


def reference(layout: Layout, index: int) -> str:
    """A column as a recipe names it: by its heading where that is its own, else by its number."""
    name = layout.names[index]
    return quoted(name) if layout.by_name and name and layout.names.count(name) == 1 else str(index + 1)


def skeleton(lines: Sequence[str]) -> tuple[str, str, str] | None:
    """What a table is of which nothing is known but its columns, what its user can say, and a recipe to complete.

    `None` for no table.
    """
    layout = lay_out(lines, interest=interest)
    if layout is None:
        return None
    names = ", ".join(repr(name) for name in layout.names if name)
    first = ", ".join(layout.rows[0])[:200]
    what = (
        f"a table of {layout.number_of_columns()} columns divided by {delimiter_name(layout.delimiter)!r}, "
        f"{f'called {names}' if names else 'which no line names'}, the first row {first}"
    )
    others = line_kinds(lines, layout.delimiter) or rows_above(lines, layout)
    fix = "; ".join(filter(None, [offered_columns.offer(layout, None, ()), others]))
    return what, fix, recipe_of(layout, None, None, missing=missing_codes.of(layout, None))


def recipe_of(layout: Layout, time: TimeChoice | None, wind: Wind | None, *, missing: Sequence[str]) -> str:
    """The recipe of a table, with the texts that stand for no value; "?" stands where it is to be completed."""
    preamble = layout.preamble if layout.by_name else layout.preamble + layout.header
    label = wind.label if wind is not None else "anemometer"
    lines = [
        'name = "drafted"', 'about = "drafted from the first lines of the file"', 'source = "the file"', "",
        "[file]", f"delimiter = {quoted(delimiter_name(layout.delimiter))}", f"decimal = {quoted(layout.decimal)}",
        f"preamble = {preamble}", f"header = {layout.header if layout.by_name else 0}",
        f"missing = [{', '.join(map(quoted, missing))}]", "",
        "[time]",
    ]  # fmt: skip
    if time is None:
        lines += ['columns = ["?"]  # names, or numbers from 1', 'format = "?"  # such as "%Y %j %H%M" or "epoch-s"']
    else:
        lines.append(f"columns = [{', '.join(reference(layout, index) for index in time.columns)}]")
        doubt = f"  # {time.doubt}" if time.form is None else ""
        lines.append(f"format = {quoted(time.form or '?')}{doubt}")
    if time is not None and time.zone is not None:
        lines.append(f"zone = {quoted(time.zone)}")
    if wind is not None and wind.site is not None:
        lines += ["", "[rows]", f"column = {reference(layout, wind.site[0])}", f"value = {quoted(wind.site[1])}"]
    if wind is None:
        names = ", ".join(name for name in layout.names if name)
        lines += ["", "[channels.wind_speed]", 'column = "?"  # ' + (f"one of: {names}" if names else "its number")]
        lines += ['unit = "?"  # m/s, km/h, mph, kn']
    for channel, column in (wind.columns if wind is not None else {}).items():
        lines += ["", f"[channels.{channel}]", f"column = {reference(layout, column.index)}"]
        lines += [f"unit = {quoted(column.unit)}" if column.unit else 'unit = "?"  # not stated: m/s, km/h, mph, kn']
        lines += ['convention = "to"'] if column.towards else []
        suffix = layout.suffixes[column.index]
        lines += [f"suffix = {quoted(suffix)}"] if suffix else []
    own = wind.columns.values() if wind is not None else ()
    units = list(dict.fromkeys(other for one in own for other in _beside(layout, one)))
    for column in units:
        text = next(row[column].strip() for row in layout.rows if row[column].strip())
        lines += ["", "[[check]]", f"column = {reference(layout, column)}", f"values = [{quoted(text)}]"]
        lines += ['about = "unit"']
    site = site_of_all(layout, apart={*time.columns, *units}) if time is not None else None
    if site is not None and own:
        lines += ["", "[[check]]", f"column = {reference(layout, site[0])}", f"values = [{quoted(site[1])}]"]
        lines += ['about = "site"']
    lines += ["", "[sensor]", f"name = {quoted(label)}"]
    if wind is not None and wind.height is not None:
        lines.append(f"height = {wind.height:g}")
    return "\n".join([*lines, ""])


def _beside(layout: Layout, column: Column) -> tuple[int, ...]:
    """The column that spells a column's unit in every row, where that is how the unit is known."""
    other = layout.unit_columns[column.index]
    alone = understand(layout.names[column.index]).unit is None
    return (other,) if other is not None and alone else ()
