"""The recipe of a draft as TOML; "?" stands where it is open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from flagdata.ingest.anemometer.draft.shape import Shape
from flagdata.ingest.anemometer.recipe import DELIMITERS


@dataclass(frozen=True, kw_only=True)
class ChannelText:
    """A channel of a recipe: its column by heading or number, its unit, and whether the wind blows that way."""

    column: str | int
    unit: str
    towards: bool = False


def recipe_text(
    shape: Shape,
    *,
    time: Sequence[int] | None,
    form: str | None,
    zone: str | None,
    channels: Mapping[str, ChannelText],
    label: str,
    missing: Sequence[str],
) -> str:
    """The recipe of a table."""
    delimiter = next(name for name, character in DELIMITERS.items() if character == shape.delimiter)
    lines = [
        'name = "drafted"',
        'about = "drafted from the first lines of the file"',
        'source = "the file"',
        "",
        "[file]",
        f"delimiter = {quoted(delimiter)}",
        f"decimal = {quoted(shape.decimal)}",
        f"preamble = {shape.preamble}",
        f"header = {shape.header}",
        f"missing = [{', '.join(map(quoted, missing))}]",
        "",
        "[time]",
    ]
    columns = ["?"] if time is None else [shape.reference(i) for i in time]
    lines += [f"columns = [{', '.join(map(reference, columns))}]", f"format = {quoted(form or '?')}"]
    lines += [f"zone = {quoted(zone)}"] if zone is not None else []
    for name, channel in channels.items():
        lines += ["", f"[channels.{name}]", f"column = {reference(channel.column)}", f"unit = {quoted(channel.unit)}"]
        lines += ['convention = "to"'] if channel.towards else []
    return "\n".join([*lines, "", "[sensor]", f"name = {quoted(label)}", ""])


def quoted(text: str) -> str:
    """A text as TOML writes it."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t") + '"'


def reference(column: str | int) -> str:
    """A column as TOML writes it: its heading, or its number."""
    return str(column) if isinstance(column, int) else quoted(column)
