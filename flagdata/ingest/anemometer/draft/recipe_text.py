"""The recipe of a draft as TOML; "?" stands where it is open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from flagdata.ingest.anemometer.draft.table_shape import TableShape
from flagdata.ingest.anemometer.sensor_recipe import DELIMITERS


@dataclass(frozen=True, kw_only=True)
class ChannelText:
    """A channel of a recipe: its column by heading or number, its unit, and whether the wind blows
    that way."""

    column: str | int
    unit: str
    towards: bool = False


def recipe_text(
    shape: TableShape,
    *,
    time: Sequence[int] | None,
    form: str | None,
    zone: str | None,
    channels: Mapping[str, ChannelText],
    label: str,
    missing: Sequence[str],
) -> str:
    """Writes the recipe of a table."""
    delimiter = next(name for name, character in DELIMITERS.items() if character == shape.delimiter)
    lines = [
        'name = "drafted"',
        'about = "drafted from the first lines of the file"',
        'source = "the file"',
        "",
        "[file]",
        f"delimiter = {quote_for_toml(delimiter)}",
        f"decimal = {quote_for_toml(shape.decimal)}",
        f"preamble = {shape.preamble}",
        f"header = {shape.header}",
        f"missing = [{', '.join(map(quote_for_toml, missing))}]",
        "",
        "[time]",
    ]
    columns = ["?"] if time is None else [shape.reference(i) for i in time]
    lines += [
        f"columns = [{', '.join(map(reference, columns))}]",
        f"format = {quote_for_toml(form or '?')}",
    ]
    lines += [f"zone = {quote_for_toml(zone)}"] if zone is not None else []
    for name, channel in channels.items():
        lines += [
            "",
            f"[channels.{name}]",
            f"column = {reference(channel.column)}",
            f"unit = {quote_for_toml(channel.unit)}",
        ]
        lines += ['convention = "to"'] if channel.towards else []
    return "\n".join([*lines, "", "[sensor]", f"name = {quote_for_toml(label)}", ""])


def quote_for_toml(text: str) -> str:
    """Quotes a text for TOML."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t") + '"'


def reference(column: str | int) -> str:
    """Writes a column for TOML: its heading, or its number."""
    return str(column) if isinstance(column, int) else quote_for_toml(column)
