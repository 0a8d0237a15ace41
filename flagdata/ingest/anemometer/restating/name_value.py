"""Tables with one value a row and its name beside it, made into one row a time with a column for each name.

    sensor.wind_speed,4.2,2026-05-01T12:00:00Z        exports of home servers
    2026-05-01 12:00,Wind Direction,231,deg           archives of many quantities
    2026-05-01 12:00:00 weather/wind/speed 4.2        messages as a program wrote them down

Values of one stamp are of one row. Where each name has stamps of its own, a row is one of a speed of the wind, and of
the others it holds the value that was told last before it, as programs write what changes; that is said.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.restating.restate import table
from flagdata.ingest.anemometer.sniffing import HEAD_LINES
from flagdata.ingest.anemometer.text.kinds import are_units, cell_kind
from flagdata.ingest.anemometer.text.layout import Layout, cut, lay_out
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.times.timecolumns import find_time, time_as
from flagdata.ingest.anemometer.winds.angles import compass_unit
from flagdata.ingest.anemometer.winds.found import SPEEDS
from flagdata.ingest.anemometer.winds.instruments import find_winds
from flagdata.ingest.anemometer.winds.sites import sites
from flagdata.ingest.anemometer.words.headings import interest, understand, words_of
from flagdata.ingest.anemometer.words.languages import in_english
from flagdata.units import spelled

_VALUES = frozenset({"value", "val", "state", "payload", "reading", "measurement", "wert", "valor", "valeur", "data"})
_NUMBERED = frozenset({"code", "id", "number", "num", "no"})
"""Words beside which a state is one of a country."""
_UNITS = frozenset({"unit", "units", "einheit", "unidad", "unité", "eenheid", "unidade", "unità", "enhet", "enhed"})
_SHORT = re.compile(r"(?<![A-Za-z\d])W(?:S|SPD?|DS?P)(?![A-Za-z])", re.IGNORECASE)
"""How a name says the speed of the wind shortly: WS_ms_Avg, ws, WSP."""
_MOST = 500
"""Names of quantities beyond which a column of words is something else."""
_SITE = "site"
"""Heading of the column of a stamp that tells sites apart."""
_SHARE = 0.9
_FEW = 0.3
"""Share of numbers among the values of a column that its heading calls values; the others are of other quantities."""


@dataclass(frozen=True, kw_only=True)
class _Shape:
    """Which columns of a table are the time, the names and the values, a unit (or `None`) and a site (or `None`)."""

    layout: Layout
    time: tuple[int, ...]
    name: int
    value: int
    unit: int | None
    site: int | None


@dataclass(frozen=True, kw_only=True)
class Record:
    """One value: its stamp as written in one cell or several, with the site behind it, its name with unit, and it."""

    stamp: tuple[str, ...]
    name: str
    value: str


def matches(lines: Sequence[str]) -> bool:
    """Whether the table's names hold a speed of the wind, and its headings do not."""
    return _shape(lines) is not None


def as_table(source: TextFile) -> TableText | None:
    """The values by their names, one row a time."""
    shape = _shape(source.head(HEAD_LINES))
    if shape is None:
        return None
    names = [shape.layout.names[index] or "time" for index in shape.time]
    names += [] if shape.site is None else [_SITE]
    short = [0]
    return wide(source, names, _records(source, shape, short), what="values beside their names", left_out=short)


def wide(
    source: TextFile, stamps: Sequence[str], records: Iterable[Record], *, what: str, left_out: Sequence[int] = ()
) -> TableText | None:
    """Values in the order of the file as a table with a column for each name; `None` where no speed is among them.

    Args:
        stamps: headings of the columns of the stamp.
        what: what the lines are, for the finding that says so.
        left_out: lines that hold no value, counted while the records are made.
    """
    known = list(records)
    names = list(dict.fromkeys(record.name for record in known))
    speeds = [name for name in names if _is_speed(name)]
    if not speeds or len(names) > _MOST:
        return None
    together: dict[tuple[str, ...], dict[str, str]] = {}
    for record in known:
        together.setdefault(record.stamp, {}).setdefault(record.name, record.value)
    counts = Counter(name for row in together.values() for name in row)
    shared = sum(1 for row in together.values() if set(speeds) <= set(row))
    apart = len(speeds) > 1 and 2 * shared < max(counts[name] for name in speeds)
    held = [
        name for name in names if name not in speeds
        and 2 * sum(1 for row in together.values() if name in row and not set(speeds).isdisjoint(row)) < counts[name]
    ]  # fmt: skip
    if apart or held:
        others = [name for name in names if name not in speeds]
        rows = list(_told_last(known, speeds, others, apart=apart, sites=tuple(stamps[-1:]) == (_SITE,)))
        heading = [*stamps, *(["sensor", "wind speed"] if apart else speeds)]
        heading += [name for name in names if name not in speeds]
    else:
        rows = [[*stamp, *(row.get(name, "") for name in names)] for stamp, row in together.items()]
        heading = [*stamps, *names]
    stated = table(source, heading, rows, kind="names-and-values", what=what, left_out=sum(left_out))
    if stated is None or not (apart or held):
        return stated
    text = "names have stamps of their own: beside each speed stands the value of the others that was told last before"
    finding = Finding(kind="told-last", severity=Severity.NOTE, what=text)
    return replace(stated, findings=(*stated.findings, finding))


def _told_last(
    known: Sequence[Record], speeds: Sequence[str], others: Sequence[str], *, apart: bool, sites: bool
) -> Iterator[list[str]]:
    """A row for each speed, with the value of each other name that stood last before it or shares its stamp.

    Args:
        apart: whether the speeds are of several sensors, one a row.
        sites: whether the last part of a stamp is the site; values are then of the same site.
    """
    last: dict[tuple[str, str], str] = {}
    at_once: dict[tuple[str, ...], dict[str, str]] = {}
    for record in known:
        at_once.setdefault(record.stamp, {})[record.name] = record.value
    for record in known:
        site = record.stamp[-1] if sites else ""
        if record.name not in speeds:
            last[site, record.name] = record.value
            continue
        now = at_once[record.stamp]
        own = [record.name, record.value] if apart else [record.value if name == record.name else now.get(name, "")
                                                        for name in speeds]  # fmt: skip
        yield [*record.stamp, *own, *(now.get(name, last.get((site, name), "")) for name in others)]


def _is_speed(name: str) -> bool:
    heading = understand(name)
    return heading.sure and heading.channel in SPEEDS


def _shape(lines: Sequence[str]) -> _Shape | None:
    if not any(_hints(line) for line in lines):
        return None
    layout = lay_out(lines, interest=interest)
    if layout is None:
        return None
    width = layout.number_of_columns()
    # Names come again and again: of several columns that hold them, the one with the fewest.
    for column in sorted(range(width), key=lambda at: len(set(layout.column(at)))):
        names = {cell for cell in layout.column(column) if cell_kind(cell) == "text"}
        speed = next(filter(_is_speed, sorted(names)), None)
        if (
            speed is None
            or not (len(names) > 1 or layout.names[column])
            or len(names) > _MOST
            or _share_of(layout, column, "text") < _SHARE
        ):
            continue
        alone = replace(layout, rows=tuple(row for row in layout.rows if row[column].strip() == speed))
        time = _time(alone, layout)
        rest = [index for index in range(width) if index != column and (time is None or index not in time.columns)]
        value = _value(layout, rest)
        if time is None or value is None or any(wind.sure for wind in find_winds(layout, time=time.columns)[0]):
            continue
        unit = next((at for at in rest if set(words_of(layout.names[at])) & _UNITS or _spells_units(layout, at)), None)
        stamps = [" ".join(row[at] for at in (*time.columns, column)) for row in layout.rows]
        apart = sites(layout, time=(*time.columns, column, value), stamps=stamps)
        site = apart[0] if apart is not None and apart[0] != unit else None
        return _Shape(layout=layout, time=time.columns, name=column, value=value, unit=unit, site=site)
    return None


def _time(alone: Layout, layout: Layout) -> TimeChoice | None:
    """The time of the rows with one name. Of several that no line names, the one that most names share.

    The other is then that of the message, which came some time after the reading.
    """
    time = find_time(alone)
    if time is None or time.form is None or len(time.columns) != 1 or any(layout.names[at] for at in time.columns):
        return time
    unnamed = (index for index, name in enumerate(layout.names) if not name)
    choices = [choice for index in unnamed if (choice := time_as(alone, (index,), time.form)) is not None]
    return min(choices, key=lambda choice: (len(set(layout.column(choice.columns[0]))), choice.columns), default=time)


def _value(layout: Layout, rest: Sequence[int]) -> int | None:
    """The column of the values: the only one that is called so, or the only one of numbers; the first of equal ones.

    Where no line names the columns, numbers that stay the same (a place, a mark) and instants are none.
    """
    told = [
        index for index in rest
        if set(words_of(layout.names[index])) & _VALUES and not set(words_of(layout.names[index])) & _NUMBERED
        and _share_of(layout, index, "number") >= _FEW
    ]  # fmt: skip
    numbers = [index for index in rest if _share_of(layout, index, "number") >= _SHARE and not _measured(layout, index)]
    values = told if len(told) == 1 or _alike(layout, told) else numbers
    if len(values) > 1 and not any(layout.names):
        values = [at for at in values if len(set(layout.column(at))) > 1 and not _instants(layout, at)]
    return values[0] if len(values) == 1 or _alike(layout, values) else None


def _alike(layout: Layout, columns: Sequence[int]) -> bool:
    """Whether there are columns, and all hold the same cells."""
    return len({tuple(layout.column(index)) for index in columns}) == 1


def _instants(layout: Layout, index: int) -> bool:
    return any(time_as(layout, (index,), form) is not None for form in ("epoch-s", "epoch-ms"))


def _hints(line: str) -> bool:
    """Whether a line may hold the name of a speed, so that most tables are told at once to be none."""
    text = line.lower()
    return any(word in text for word in ("wind", "speed", "anem", "wspd", "viento", "vent", "vind")) or bool(
        _SHORT.search(line) or (not text.isascii() and "wind" in in_english(text))
    )


def _spells_units(layout: Layout, index: int) -> bool:
    """Whether all cells of a column that are filled are units, of several kinds, whatever its heading."""
    kinds = set(layout.column(index)) - {""}
    return len(kinds) > 1 and are_units(kinds)


def _measured(layout: Layout, index: int) -> bool:
    return bool(understand(layout.names[index]).quantity)


def _share_of(layout: Layout, index: int, kind: str) -> float:
    kinds = [cell_kind(cell) for cell in layout.column(index)]
    known = [found for found in kinds if found != "missing"]
    return sum(found == kind for found in known) / len(known) if known else 0.0


def _records(source: TextFile, shape: _Shape, short: list[int]) -> Iterator[Record]:
    """The values of the rows; `short` counts lines that have fewer columns."""
    layout = shape.layout
    width, first = layout.number_of_columns(), layout.lines[0]
    points = compass_unit(layout, shape.value) is not None
    for number, lines in source.blocks():
        for line in lines[max(0, first - number) :]:
            if not line.strip():
                continue
            cells = cut(line, layout.delimiter)
            if len(cells) < width:
                short[0] += 1
                continue
            name = cells[shape.name].strip()
            value = cells[shape.value].strip()
            number_like = cell_kind(value) == "number" or points or understand(name).quantity.endswith("direction")
            stamp = tuple(cells[index].strip() for index in shape.time)
            site = () if shape.site is None else (cells[shape.site].strip(),)
            unit = _unit(cells[shape.unit]) if shape.unit is not None else ""
            value = value.replace(",", ".") if layout.decimal == "," else value
            yield Record(stamp=(*stamp, *site), name=f"{name} [{unit}]" if unit else name,
                         value=value if number_like else "")  # fmt: skip


def _unit(text: str) -> str:
    """The unit that a cell spells, of "Degrees Compass" the part that is one; "" where it spells none."""
    parts = (text.strip(), *text.split())
    return next((part for part in parts if part and spelled(part) is not None), "")
