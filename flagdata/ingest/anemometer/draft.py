"""A first draft of a sensor recipe for a table nobody has described yet, from its first lines.

A draft is a proposal to a person: units and zones that the file does not state are left for them to fill in, and a
guess that carries one is never taken without asking.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from flagdata.errors import TimeError, UnknownNameError
from flagdata.ingest.anemometer.cells import Cell, numbers
from flagdata.ingest.anemometer.dates import decide
from flagdata.ingest.anemometer.recipe import DELIMITERS
from flagdata.ingest.anemometer.stamps import parse
from flagdata.schema import CHANNELS
from flagdata.units import unit

ROWS = 50
"""Rows looked at."""
_SHARE = 0.9
"""Share of rows that must fit for a column to be what it seems."""
_TIMES = ("%H:%M:%S%f", "%H:%M", "%I:%M:%S %p", "%I:%M %p")
# What header cells say, in the languages of common loggers, most telling first.
_HEADINGS: tuple[tuple[str, str], ...] = (
    (r"dir|richtung|heading|bearing", "wind_direction"),
    (r"gust|max|böe|min\b|std|chill", ""),
    (r"wind.?(speed|spd|vel|geschw)|windspeed|geschwindigkeit|^ws|speed|velocity|vitesse", "wind_speed"),
    (r"temp|°c|°f", "air_temperature"),
    (r"hum|feuchte|^rh", "relative_humidity"),
    (r"press|druck|baro", "air_pressure"),
    (r"m/s|km/h|mph|knots", "wind_speed"),
)
_UNIT = re.compile(
    r"[\[(]\s*([^\])]{1,12}?)\s*[\])]|[_ ](m/?s|mps|km/?h|kph|mph|kn|kts?|deg|hpa|mbar|degc|c|%)$", re.IGNORECASE
)


@dataclass(frozen=True, kw_only=True)
class Draft:
    """A proposal.

    Attributes:
        toml: the recipe, with what is not known left to fill in.
        reasons: what in the file speaks for it.
    """

    toml: str
    reasons: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class _Grid:
    delimiter: str
    header_line: int
    header: list[str]
    rows: list[list[str]]

    def column(self, index: int) -> list[str]:
        return [row[index].strip().strip('"') for row in self.rows]


def draft(lines: Sequence[str]) -> Draft | None:
    """A recipe for the table that `lines` seem to begin; `None` where no stamps or no wind can be made out."""
    grid = _grid(lines)
    if grid is None:
        return None
    time = _time(grid)
    if time is None:
        return None
    stamp_columns, form = time
    names = [name for name in grid.header if grid.header.count(name) == 1]
    decimal = "," if grid.delimiter != "," and _has_decimal_commas(grid) else "."
    channels: dict[str, tuple[str, str | None]] = {}
    for index, name in enumerate(grid.header):
        channel = _channel(name)
        if index in stamp_columns or name not in names or not channel or channel in channels:
            continue
        parsed = numbers(grid.column(index), decimal=decimal)
        if float((parsed.state == Cell.UNREADABLE).mean()) > 1 - _SHARE:
            continue
        channels[channel] = (name, _unit(name, channel))
    if "wind_speed" not in channels:
        return None
    stamps = [grid.header[index] for index in stamp_columns]
    reasons = (
        f"cells are divided by {_name(grid.delimiter)!r}, line {grid.header_line + 1} names the columns",
        f"column {' and '.join(map(repr, stamps))} is a time as {form}",
        *(f"column {name!r} looks like {channel}, {_told(known)}" for channel, (name, known) in channels.items()),
    )
    return Draft(toml=_toml(grid, decimal, stamps, form, channels), reasons=reasons)


def _grid(lines: Sequence[str]) -> _Grid | None:
    filled = [(number, line) for number, line in enumerate(lines) if line.strip()]
    best: tuple[int, str] = (1, "")
    tail = filled[-ROWS:]
    for delimiter in (";", "\t", ",", "|"):
        counts = Counter(line.count(delimiter) + 1 for _, line in tail)
        cells, often = max(counts.items(), key=lambda item: item[1], default=(1, 0))
        if cells > best[0] and often > len(tail) / 2:
            best = (cells, delimiter)
    width, delimiter = best
    if width < 2:
        return None
    table = [(number, line.split(delimiter)) for number, line in filled if line.count(delimiter) + 1 == width]
    number, header = table[0]
    header = [cell.strip().strip('"').lstrip("\ufeff") for cell in header]
    rows = [row for _, row in table[1 : ROWS + 1]]
    if not rows or not all(header) or any(re.fullmatch(r"[-+\d.,:/ TZ]+", cell) for cell in header):
        return None
    return _Grid(delimiter=delimiter, header_line=number, header=header, rows=rows)


def _time(grid: _Grid) -> tuple[list[int], str] | None:
    """Columns and format of the stamps: one column, or a date and the time beside it."""
    for index in range(len(grid.header)):
        whole = grid.column(index)
        for form in ("iso", "epoch-s", "epoch-ms"):
            if _fits(whole, form):
                return [index], form
        beside = grid.column(index + 1) if index + 1 < len(grid.header) else None
        for columns, texts in (([index], whole), ([index, index + 1], _joined(whole, beside))):
            if texts is None:
                continue
            try:
                date = decide(texts, told=None, where="")
            except TimeError:
                continue
            for clock in _TIMES:
                form = f"{date.directives()} {clock}"
                if _fits(texts, form):
                    return columns, form
    return None


def _joined(first: Sequence[str], second: Sequence[str] | None) -> list[str] | None:
    return None if second is None else [f"{a} {b}" for a, b in zip(first, second, strict=True)]


def _fits(texts: Sequence[str], form: str) -> bool:
    return float(parse(texts, form).valid.mean()) >= _SHARE


def _has_decimal_commas(grid: _Grid) -> bool:
    return any(re.fullmatch(r"[-+]?\d+,\d+", cell.strip()) for row in grid.rows for cell in row)


def _channel(name: str) -> str:
    return next((channel for pattern, channel in _HEADINGS if re.search(pattern, name[:80], re.IGNORECASE)), "")


def _unit(name: str, channel: str) -> str | None:
    """The unit that a heading states, if it is one of the channel's quantity."""
    match = _UNIT.search(name[:80])
    stated = (match[1] or match[2]) if match else ""
    if stated.lower() == "ms" and CHANNELS[channel].unit == "m/s":
        return "m/s"  # "speed_ms" means metres a second, not milliseconds
    for text in (stated, name):
        try:
            if text and unit(text).si == CHANNELS[channel].unit:
                return text
        except UnknownNameError:
            continue
    return None


def _told(known: str | None) -> str:
    return f"in {known}" if known else "in a unit the header does not state"


def _name(delimiter: str) -> str:
    return next(name for name, character in DELIMITERS.items() if character == delimiter)


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _toml(
    grid: _Grid, decimal: str, stamps: Sequence[str], form: str, channels: dict[str, tuple[str, str | None]]
) -> str:
    columns = ", ".join(map(_quoted, stamps))
    lines = [
        'name = "my-sensor"', 'about = "what it is"', 'source = "its manual"', "",
        "[file]", f"delimiter = {_quoted(_name(grid.delimiter))}", f"decimal = {_quoted(decimal)}",
        f"preamble = {grid.header_line}", "",
        "[time]", f"columns = [{columns}]", f"format = {_quoted(form)}",
    ]  # fmt: skip
    for channel, (name, known) in channels.items():
        lines += ["", f"[channels.{channel}]", f"column = {_quoted(name)}"]
        lines += [f"unit = {_quoted(known)}" if known else 'unit = "?"  # the header does not say: fill it in']
    lines += ["", "[sensor]", 'name = "my sensor"', ""]
    return "\n".join(lines)
