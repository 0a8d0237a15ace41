"""What the columns of a table are, as its user says in one line: "date,time,wind_speed[km/h],,wind_direction[deg]".

    ENTRY,ENTRY,…              one entry a column, in the order of the file; a blank entry is a column that is not read
    COLUMN=ENTRY,COLUMN=ENTRY  or only those that are read, each after its heading or number (from 1)

An entry is the name of a channel with its unit in brackets, `wind_direction_to` for a direction that the wind blows to,
`site` for the column that tells sites apart, or a part of the time: `time`, `date`, `year`, `month`, `day`,
`day_of_year`, `hour`, `minute`, `second`. Behind `time` and `date` the format may stand in brackets, as a recipe's
[time] format has it, or the unit of a count since a start, such as `time[s]`. The line makes the recipe that a draft
would make, by the same code.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from flagdata import compass
from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.ingest.anemometer.instants import counted
from flagdata.ingest.anemometer.instants.dates import Order
from flagdata.ingest.anemometer.instants.stamps import EPOCH
from flagdata.ingest.anemometer.recipe import COLUMNS_LIMIT
from flagdata.ingest.anemometer.text.cells import Cell, numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times import given_clock, truncated
from flagdata.ingest.anemometer.times.dateparts import CLOCKS, date_forms
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.times.timecolumns import find_time, time_as
from flagdata.ingest.anemometer.winds.angles import compass_unit
from flagdata.ingest.anemometer.winds.axes import EAST, NORTH
from flagdata.ingest.anemometer.winds.found import COMPONENTS, SPEEDS, Column, Wind
from flagdata.ingest.anemometer.words.headings import fits, understand, words_of
from flagdata.schema import CHANNELS
from flagdata.units import canonical

_WHERE = "--columns"
TOWARDS = "wind_direction_to"
PARTS = {
    "year": "%Y", "month": "%m", "day": "%d", "day_of_year": "%j", "hour": "%H", "minute": "%M", "second": "%S%f",
}  # fmt: skip
"""Parts of a date and the directives they are written with."""
ALIASES = {"doy": "day_of_year", "yday": "day_of_year", "julian_day": "day_of_year"}
"""Other names of parts of a date."""
_WITH_FRACTION = {"%j": "%J", "%H": "%Q"}
"""Directives of days and hours, and those of them with their fraction."""
_FRACTION = re.compile(r"\d{1,3}[.,]\d*[1-9]\d*")
FREE = ("date", "time")
SITE = "site"
_COUNTS = {form.removeprefix("elapsed-"): form for form in counted.UNITS} | {"µs": "elapsed-us", "μs": "elapsed-us"}
"""Units that stand for a count of them since a start, as in time[s]."""
_NAMES = tuple(name for name, channel in CHANNELS.items() if channel.dims == ("time",))
_AXES = frozenset({"u", "v", "u10", "v10"}) | NORTH | EAST
"""Words by which users call components of the wind."""
_ENTRY = re.compile(r"(?:(?P<column>.*)=)?\s*(?P<name>[^\[\]=]*?)\s*(?:\[(?P<detail>[^\]]*)\])?\s*", re.DOTALL)


@dataclass(frozen=True, kw_only=True)
class Entry:
    """What one column is.

    Attributes:
        column: its index, or its heading or number as written.
        name: of a channel, of a part of the time, or "site".
        detail: what stands in brackets, "" where nothing does: a unit, or the format of a time.
    """

    column: int | str
    name: str
    detail: str


@dataclass(frozen=True, kw_only=True)
class Stated:
    """A table's time and wind by its user's word.

    Attributes:
        time: `None` where the user says nothing of it and no other column is one.
        wind: the anemometer.
        site: index of the column that tells sites apart, `None` where there is one site.
    """

    time: TimeChoice | None
    wind: Wind
    site: int | None


def parse(text: str) -> tuple[Entry, ...]:
    """The entries of a line of columns, those that are left blank apart.

    Raises:
        UsageError, UnknownNameError: an entry that cannot be read, or a name that is not known.
    """
    parts = re.split(r",(?![^\[]*\])", text)
    entries: list[Entry] = []
    by_name = "=" in re.sub(r"\[[^\]]*\]", "", text)
    for number, part in enumerate(parts, start=1):
        if not part.strip() or part.strip().startswith("="):  # no column, where "?=wind_speed[?]" was offered
            continue
        match = _ENTRY.fullmatch(part.strip())
        if match is None or not match["name"] or (by_name and match["column"] is None):
            fix = 'write NAME[UNIT] for each, as "time,wind_speed[km/h]", or COLUMN=NAME[UNIT] for each'
            raise UsageError(f"{part.strip()!r} cannot be read", where=_WHERE, fix=fix)
        if "?" in (match["column"], match["name"], (match["detail"] or "").removeprefix("elapsed-")):
            fix = "write there what it is, or leave the entry blank where the column is not needed"
            raise UsageError(f"{part.strip()!r} still has a question mark, entry {number}", where=_WHERE, fix=fix)
        name = ALIASES.get(match["name"], match["name"])
        if name not in (*_NAMES, *FREE, *PARTS, SITE, TOWARDS):
            raise _unknown(name)
        column = match["column"].strip() if by_name else number - 1
        detail = (match["detail"] or "").strip()
        detail = counted.WORDS.get(detail.lower(), detail) if name in FREE else detail
        entries.append(Entry(column=column, name=name, detail=detail))
    names = [entry.name for entry in entries if entry.name not in FREE]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise UsageError(
            f"{twice} stands twice", where=_WHERE, fix="name one of them, and ingest the other in a second run"
        )
    if not any(entry.name in CHANNELS or entry.name == TOWARDS for entry in entries):
        raise UsageError("no column is measured", where=_WHERE, fix="name the wind's column: wind_speed[m/s]")
    return tuple(entries)


def _unknown(name: str) -> UnknownNameError:
    """The error of a name of a column that is not known: of a component, with the axis that is meant."""
    words = set(words_of(name))
    if words & _AXES:
        fix = "call the component towards east wind_x and the one towards north wind_y, and add --azimuth 270; "
        fix += "components along the axes of an instrument are wind_x and wind_y as well, without it"
        return UnknownNameError(f"unknown name of a column {name!r}", where=_WHERE, fix=fix)
    known = [*FREE, *PARTS, SITE, TOWARDS, *_NAMES]
    near = UnknownNameError.of("name of a column", name, known, where=_WHERE)
    meant = near.fix if near.fix is not None and near.fix.startswith("did you mean") else ""
    return UnknownNameError(near.what, where=_WHERE, fix=f"{meant} known: {', '.join(known)}".strip())


def names_time(text: str) -> bool:
    """Whether a line of columns names the time or a part of it.

    Raises:
        UsageError, UnknownNameError: see `parse`.
    """
    return any(entry.name in (*FREE, *PARTS) for entry in parse(text))


def stated(layout: Layout, text: str, *, unit: str | None, order: Order | None, where: str) -> Stated:
    """The time and the wind of a table whose columns a line of text says.

    Args:
        unit: of speeds that the line states no unit for, by the user's word.
        order: of dates written with numbers only.
        where: the file, for messages.

    Raises:
        UsageError, UnknownNameError: see `parse`; more entries than columns, a column that is not there, a quantity
            that is another.
        InputError: a column that does not hold what is said.
        TimeError: a date whose order nothing tells.
    """
    entries = [(_index(layout, entry.column), entry) for entry in parse(text)]
    columns = [index for index, _ in entries]
    if len(set(columns)) < len(columns):
        raise UsageError("a column stands twice", where=_WHERE, fix="say once what it is")
    site = next((index for index, entry in entries if entry.name == SITE), None)
    time = _time(layout, [(i, e) for i, e in entries if e.name in (*FREE, *PARTS)], order, where)
    measured = [(index, entry) for index, entry in entries if entry.name in CHANNELS or entry.name == TOWARDS]
    channels: dict[str, Column] = {}
    for index, entry in measured:
        towards = entry.name == TOWARDS
        channel = "wind_direction" if towards else entry.name
        if channel in channels:
            raise UsageError(f"{channel} stands twice", where=_WHERE, fix="name one of the two")
        channels[channel] = replace(_column(layout, index, channel, entry.detail, unit, where), towards=towards)
    if time is None:
        found = find_time(layout, order=order)
        time = found if found is not None and not set(found.columns) & set(columns) else None
    first = next((channels[name] for name in (*SPEEDS, *COMPONENTS) if name in channels), None)
    first = first or next(iter(channels.values()))
    label = layout.names[first.index] or f"column {first.index + 1}"
    height = understand(layout.names[first.index]).height
    return Stated(time=time, wind=Wind(label=label, height=height, columns=channels, sure=True), site=site)


def _index(layout: Layout, column: int | str) -> int:
    """The index of a column by its place, heading or number."""
    width = given_clock.own_columns(layout)
    if isinstance(column, int):
        if column < width:
            return column
        fix = f"the first row is {shown(layout)}"
        raise UsageError(f"entry {column + 1}, but the table has {width} columns", where=_WHERE, fix=fix)
    same = [index for index, name in enumerate(layout.names[:width]) if name == column]
    if len(same) == 1:
        return same[0]
    if re.fullmatch(r"#?\d{1,5}", column) and 1 <= int(column.lstrip("#")) <= min(width, COLUMNS_LIMIT):
        return int(column.lstrip("#")) - 1
    if len(same) > 1:
        numbered = ", ".join(str(index + 1) for index in same)
        fix = f"name one by its number: {numbered}"
        raise UsageError(f"{len(same)} columns are called {column!r}", where=_WHERE, fix=fix)
    raise UnknownNameError.of("column", column, [name for name in layout.names[:width] if name], where=_WHERE)


def _time(layout: Layout, entries: Sequence[tuple[int, Entry]], order: Order | None, where: str) -> TimeChoice | None:
    """The time that columns make together; `None` where none is named."""
    if not entries:
        return None
    forms = [_COUNTS.get(entry.detail, entry.detail) or PARTS.get(entry.name) for _, entry in entries]
    forms = [_as_written(layout, index, form) for (index, _), form in zip(entries, forms, strict=True)]
    columns = tuple(index for index, _ in entries)
    said = f"{' and '.join(named(layout, index) for index in columns)} as the time"
    first = " ".join(layout.rows[0][index].strip() for index in columns)
    names = ("iso", *EPOCH, *counted.FORMS)
    for form in forms:
        if form is not None and "%" not in form and form not in names:
            raise UnknownNameError.of("format of a time", form, names, where=_WHERE)
    for index, form_of in zip(columns, forms, strict=True):
        cells = [cell for cell in layout.column(index) if cell]
        years = form_of == "%Y" and truncated.years_before_1970("year", cells)
        if years or truncated.before_1970(cells):
            what, fix = truncated.too_early(repr(layout.names[index] or index + 1), cells)
            raise InputError(what, where=where, fix=fix)
    known = [form for form in forms if form is not None]
    if len(known) == len(forms):
        form = " ".join(known)
        choice = time_as(layout, columns, form)
        if choice is None:
            fix = f"correct the format of {_WHERE}; the first is {first!r}, of the row {shown(layout)}"
            raise InputError(f"{said} cannot be read as {form}", where=where, fix=fix)
        return choice
    choice = find_time(_only(layout, entries), order=order, told=True)
    choice = choice if choice is not None and set(choice.columns) == set(columns) else None
    if choice is not None and choice.form is None and any(entry.detail for _, entry in entries):
        choice = None  # what the columns alone leave open, the formats in brackets tell
    if choice is None and known and forms.count(None) == 1:
        index, entry = entries[forms.index(None)]
        missing = CLOCKS if entry.name == "time" else date_forms(layout, index, order)
        tried = (" ".join(form or other for form in forms) for other in missing)
        choice = next((found for form in tried if (found := time_as(layout, columns, form)) is not None), None)
    if choice is None and not known and [entry.name for _, entry in entries] == ["date"]:
        tried = date_forms(layout, columns[0], order)  # alone it may be no time yet, which the draft tells
        choice = next((found for form in tried if (found := time_as(layout, columns, form)) is not None), None)
    if choice is None:
        fix = (
            f"state the format in brackets, such as time[%d.%m.%Y %H:%M], time[epoch-s] or time[elapsed-ms]; the first "
            f"is {first!r}"
        )
        raise InputError(f"{said} cannot be read", where=where, fix=fix)
    return choice


def _as_written(layout: Layout, index: int, form: str | None) -> str | None:
    """The directive of a part of a date as its column writes it: two digits, letters, or with a fraction."""
    cells = [cell for cell in layout.column(index) if cell]
    if form == "%Y" and cells and all(len(cell) == 2 for cell in cells):
        return "%y"
    if form == "%m" and cells and cells[0].isalpha():
        return "%b"
    if form in _WITH_FRACTION and any(_FRACTION.fullmatch(cell) for cell in cells):
        return _WITH_FRACTION[form]
    return form


def _only(layout: Layout, entries: Sequence[tuple[int, Entry]]) -> Layout:
    """The table with the columns of the time alone, under the names that the user gives them."""
    names = {index: entry.name if entry.name != "day_of_year" else "doy" for index, entry in entries}
    width = layout.number_of_columns()
    rows = tuple(tuple(cell if at in names else "" for at, cell in enumerate(row)) for row in layout.rows)
    beside = {at: layout.names[at] for at in names if names[at] in FREE}  # their heading may state zone and order
    return replace(
        layout, rows=rows, names=tuple(f"{names[at]} {beside.get(at, '')}".strip() if at in names else ""
                                       for at in range(width)),
    )  # fmt: skip


def _column(layout: Layout, index: int, channel: str, detail: str, unit: str | None, where: str) -> Column:
    """A column of a channel with its unit: as said, else by its heading, else by its cells or the option."""
    cells = layout.column(index)
    if detail:
        name = canonical(detail, where=_WHERE)
        if not fits(channel, name):
            wanted = CHANNELS[channel].unit
            raise UsageError(f"{channel} is measured in {wanted}, not in {detail}", where=_WHERE, fix="correct it")
        how = f"in {detail}, as you said"
    else:
        heading = understand(layout.names[index], layout.units[index]).unit
        name = heading if fits(channel, heading) else None
        how = f"in {name} by its heading" if name else ""
        if CHANNELS[channel].unit == "m/s" and unit is not None:
            name, how = unit, f"in {unit}, as you said"
    if name in (None, "deg") and CHANNELS[channel].unit == "rad" and (points := compass_unit(layout, index)):
        name, how = points, "as points of the compass, 22.5° apart"
    if name is None and CHANNELS[channel].unit != "m/s":
        fix = f"write it in brackets: {channel}[{_unit_like(channel)}]"
        raise UsageError(f"no unit for {channel}, {named(layout, index)}", where=_WHERE, fix=fix)
    if name not in compass.BY_UNIT:
        parsed = numbers(cells, decimal=layout.decimal)
        words = [cell for cell, state in zip(cells, parsed.state, strict=True) if state == Cell.UNREADABLE]
        if 2 * len(words) > len(cells):
            fix = f"correct {_WHERE}; the first row is {shown(layout)}"
            raise InputError(
                f"{named(layout, index)}, said to be {channel}, holds words: {words[0]!r}", where=where, fix=fix
            )
    return Column(index=index, unit=name, told=how)


def _unit_like(channel: str) -> str:
    return {"rad": "deg", "K": "degC", "Pa": "hPa", "1": "%"}.get(CHANNELS[channel].unit, CHANNELS[channel].unit)


def named(layout: Layout, index: int) -> str:
    """A column for a message, by its heading or number."""
    return f"column {layout.names[index]!r}" if layout.names[index] else f"column {index + 1}"


def shown(layout: Layout) -> str:
    """The first row with the numbers of its columns, for a message."""
    cells = [cell[:30] for cell in layout.rows[0][: given_clock.own_columns(layout)]]
    return "; ".join(f"{number}: {cell}" for number, cell in enumerate(cells, start=1) if cell)[:600]


def with_site(text: str, index: int) -> str:
    """A line of columns that says beside that the column at `index` tells sites apart."""
    if "=" in re.sub(r"\[[^\]]*\]", "", text):
        return f"{text},{index + 1}={SITE}"
    parts = re.split(r",(?![^\[]*\])", text)
    parts += [""] * (index + 1 - len(parts))
    return ",".join([*parts[:index], SITE, *parts[index + 1 :]])
