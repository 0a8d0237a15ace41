"""Lines of columns that are offered to the user: what is known of a table filled in, and "?" where it is not.

They are lines as `stated_columns` reads them, so that each can be given back as it is printed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from flagdata.ingest.anemometer.instants import counted
from flagdata.ingest.anemometer.options import in_shell
from flagdata.ingest.anemometer.tables import speeds_offered
from flagdata.ingest.anemometer.tables.stated_columns import PARTS, SITE, TOWARDS, named, shown
from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times import count_units, given_clock
from flagdata.ingest.anemometer.times.timechoice import TimeChoice, whole_numbers
from flagdata.ingest.anemometer.winds import beside, bow, own_motion, vectors
from flagdata.ingest.anemometer.winds.angles import compass_unit, in_tens, may_be_direction, unit_of
from flagdata.ingest.anemometer.winds.directions import Judged, holds_marks, judge
from flagdata.ingest.anemometer.winds.found import COMPONENTS, SPEEDS, Column, Wind
from flagdata.ingest.anemometer.winds.weather import WEATHER
from flagdata.ingest.anemometer.words import extremes, headings, series
from flagdata.ingest.anemometer.words.events import of_event
from flagdata.ingest.anemometer.words.headings import fits, understand
from flagdata.schema import CHANNELS

_COUNT_AND_WIND, _ROWS, _UNEVEN = 2, 4, 0.01
"""Columns and steps from which a count is told, and the share of a step by which others may differ."""
_SECONDS, _SMALL, _FINE = "elapsed-s", 1.0, 0.5
"""How a count is likely written that grows by less than 1, with a fraction of three digits in most rows."""
_OPEN = "elapsed-?"
"""A count whose unit the user is to write in place of the question mark."""
_WIDE = 12
"""Columns up to which an offer lists all of them."""


def offer(layout: Layout, time: TimeChoice | None, winds: Sequence[Wind], *, components: bool = False) -> str:
    """The option with which the user says what the columns are, as far as they are known; "?" where they are not.

    Args:
        components: whether a wind that is not known is asked for by its components, not by its speed.
    """
    winds = [wind for wind in winds if speeds_offered.is_offered(layout, wind)]
    width, own = given_clock.own_columns(layout), own_motion.columns(layout)
    known = _known(layout, time, winds)
    speeds = [entry for entry in known.values() if entry.split("[")[0] in (*SPEEDS, *COMPONENTS)]
    if speeds:  # weather of a unit that nothing tells is not to be asked for with the wind
        known = {at: entry for at, entry in known.items() if not entry.endswith("[?]") or _of_wind_or_time(entry)}
    any_named = "?" in known.values() or any("wind" in entry for entry in known.values())
    if width > _WIDE or not any_named:
        listed = [f"{at + 1}={entry}" for at, entry in sorted(known.items()) if "?" not in entry.split("[")[0]]
        entries = {entry.split("[")[0] for entry in known.values()}
        listed += ["?=time"] if time is None and not {"time", "date", "hour"} & entries else []
        directed = any("wind_direction" in entry for entry in known.values())
        asked = ["?=wind_x[?]", "?=wind_y[?]"] if components else ["?=wind_speed[?]"]
        listed += asked if not winds and not speeds else []
        directed = directed or components
        listed += ["?=wind_direction[deg]"] if not winds and not speeds and not directed else []
        line = ",".join(listed)
    else:
        line = ",".join(known.get(at, "") for at in range(width))
    others = [
        name for at, name in enumerate(layout.names) if at not in {*known, *own}
        and ("wind_speed" if _alone(layout, at) else understand(name, layout.units[at]).channel)
        in {entry.split("[")[0] for entry in speeds} and speeds_offered.may_stand(layout, at)
    ]  # fmt: skip
    serial = _serial(layout) if time is None else None
    further = f"; name {', '.join(map(repr, others))} in its place in a run of its own" if others else ""
    further += "" if given_clock.index(layout) is None else f"; {given_clock.AS_GIVEN}"
    example = f"with a name{_names(line)}, or nothing, in place of each ?"
    example = example if "?" in line else "corrected where it is wrong"
    if f"time[{_OPEN}]" in known.values():
        counts = "; of time[elapsed-?] the ? is s, ms, us, min, h or d, the unit of its count: add --start TIME"
        further = f"{counts}{further}"
    elif time is None and "time[elapsed-d]" in known.values():
        further = f"; column 1 grows by parts of a day, as days since a start do: add --start TIME{further}"
    elif time is None and f"time[{_SECONDS}]" in known.values():
        further = (
            f"; column 1 grows in small steps, as a count of seconds since a start does: add --start TIME{further}"
        )
    if time is None and known.get(0) == "hour":
        further = f"; column 1 counts the hours of a day: add the day by --date DATE{further}"
    steady = _steady(layout) if time is None and "time[?]" in known.values() else None
    if steady is not None:
        units = ", ".join(counted.UNITS[:-1]) + f" or {counted.UNITS[-1]}"
        counts = f"; where column {steady + 1} is the time since a start, write {units} in time[?] and add --start TIME"
        further = counts + further
    if serial is not None and f"time[{serial}]" in known.values():
        rises = {
            "excel-days": "days since 1899-12-30, as Excel counts them,",
            "datenum": "days since year 0, as MATLAB counts them,", "decimal-years": "years with a fraction",
        }[serial]  # fmt: skip
        further = f"; column 1 rises as {rises} do: write another format in its place where it is none{further}"
    return f'say what the columns are: --columns "{line}" {example}{further} (the first row is {shown(layout)})'


def _names(line: str) -> str:
    """The names that are most used, for a line without any; where they are listed, for one with some; else ""."""
    entries = [entry.split("=")[-1] for entry in line.split(",") if entry]
    if "?" not in entries:
        return ""
    if set(entries) != {"?"}:
        return " of those that flagdata ingest --help lists"
    return " (time, date, wind_speed[m/s], wind_direction[deg], wind_x[m/s], site or others of flagdata ingest --help)"


def _serial(layout: Layout) -> str | None:
    """The format of serial days that the first column is likely in, where it has no heading."""
    return None if layout.names[0] else counted.serial_days(numbers(layout.column(0), decimal=layout.decimal).value)


def _steady(layout: Layout) -> int | None:
    """The first column, where it has no heading and rises by a steady step, as the time since a start does."""
    if layout.names[0] or layout.number_of_columns() < _COUNT_AND_WIND:
        return None
    value = numbers(layout.column(0), decimal=layout.decimal).value
    step = np.diff(value)
    if len(step) < _ROWS or not np.all(np.isfinite(step)) or value[0] < 0:
        return None
    usual = float(np.median(step))
    return 0 if usual > 0 and bool(np.all(np.abs(step - usual) <= _UNEVEN * usual)) else None


def _of_one_day(layout: Layout) -> bool:
    """Whether the first column counts the hours of one day, from 0 to 23 or from 1 to 24."""
    value = numbers(layout.column(0), decimal=layout.decimal).value
    return value.tolist() in (list(range(24)), list(range(1, 25)))


def _grows(layout: Layout) -> bool:
    """Whether the first column has no heading, and grows from row to row by parts of one, as seconds do."""
    if layout.names[0] or layout.number_of_columns() < _COUNT_AND_WIND:
        return False
    cells = layout.column(0)
    step = np.diff(numbers(cells, decimal=layout.decimal).value)
    fine = sum(re.fullmatch(r"\d+[.,]\d{3,}", cell) is not None for cell in cells) > _FINE * len(cells)
    return fine and len(step) >= _ROWS and bool(np.all((step > 0) & (step < _SMALL)))


def _of_wind_or_time(entry: str) -> bool:
    return "wind" in entry or entry.startswith(("time", "date"))


def read_also(
    layout: Layout, time: TimeChoice, wind: Wind, direction: int | None, *, unit_name: str | None = None,
    channel: str = "wind_direction",
) -> str:  # fmt: skip
    """The line that says what was understood of a table, and that a further column is the wind's direction.

    It stands in place of a direction that is read already.

    Args:
        direction: its column; `None` where only the user knows it, who writes its number in place of the "?".
        unit_name: of the direction; `None` takes the one its values are likely in, degrees where no column is named.
        channel: that the direction is.
    """
    unit = unit_name or ("deg" if direction is None else unit_of(layout, direction))
    known = _understood(layout, time, (wind,))
    entries = {at: entry for at, entry in known.items() if entry.split("[")[0].removesuffix("_to") != channel}
    if direction is not None:
        entries[direction] = f"{channel}[{unit}]"
    return ",".join([*_numbered(entries), *([f"?={channel}[{unit}]"] if direction is None else [])])


def _numbered(entries: Mapping[int, str]) -> list[str]:
    """Entries behind the numbers of their columns."""
    return [f"{at + 1}={entry}" for at, entry in sorted(entries.items())]


def of_bare_dates(layout: Layout, dates: Sequence[int], winds: Sequence[Wind]) -> str:
    """What the user can say of a table whose rows have dates without a time of day.

    Args:
        dates: the columns of the date.
    """
    known = _understood(layout, None, winds)
    others = [at for at in range(layout.number_of_columns()) if at not in {*known, *dates}]
    said = []
    hours = _hours_of_days(layout, dates[0], others) if len(dates) == 1 else []
    if len(hours) == 1:
        line = ",".join(_numbered(known | {dates[0]: "date", hours[0]: "hour"}))
        said.append(f'if {named(layout, hours[0])} is the hour of the day: --columns "{line}"')
    elif others and len(dates) == 1:
        line = ",".join([*_numbered(known | {dates[0]: "date"}), "?=time"])
        said.append(f'if a column is the time of day: --columns "{line}" with its number for the ?')
    line = ",".join(_numbered(known))
    said.append(f'if the rows came at a steady rate, leave the date out: --columns "{line}" --start TIME --rate HZ')
    if layout.site is None and others:
        said.append("if the rows of a date are of several stations, name the column that tells them apart as site")
    return "; ".join([*said, "else export the log with the time of each row"])


def _hours_of_days(layout: Layout, date: int, others: Sequence[int]) -> list[int]:
    """The columns of whole numbers up to 24, none of which returns within a date."""
    dates, found = layout.column(date), []
    for index in others:
        cells = layout.column(index)
        written = all(re.fullmatch(r"\d{1,2}", cell) for cell in cells) and whole_numbers(cells, 0, 24)
        if written and len(set(zip(dates, cells, strict=True))) == len(cells):
            found.append(index)
    return found


def read_as(layout: Layout, time: TimeChoice, wind: Wind) -> str:
    """The option that reads a table as it was understood."""
    return f'--columns "{",".join(_numbered(_understood(layout, time, (wind,))))}"'


def read_instead(layout: Layout, time: TimeChoice, wind: Wind, speed: int | None) -> str:
    """The option that reads another column as the wind's speed, by the time and the direction of the one understood.

    A direction that is called after that column goes before the other.
    A direction whose unit is in doubt is given in the one that its numbers speak for; the heading's stands beside.

    Args:
        speed: its column; `None` where only the user knows it, who writes its number in place of the "?".
    """
    known = wind.columns.get("wind_speed") or wind.columns.get("wind_x")
    heading = understand(layout.names[speed], layout.units[speed]) if speed is not None else None
    stated_unit = heading.unit if heading is not None and heading.unit else known.unit if known else None
    others = {
        name: column for name, column in wind.columns.items()
        if not name.startswith(("apparent", "theoretical")) and name not in ("wind_speed", *COMPONENTS)
    }  # fmt: skip
    entry = f"wind_speed[{stated_unit or '?'}]"
    entries = _understood(layout, time, (replace(wind, columns=others),)) | ({} if speed is None else {speed: entry})
    open_one = [f"?={entry}"] if speed is None else []
    direction = others.get("wind_direction")
    apart = (*time.columns, *([direction.index] if direction else []))
    own = None if speed is None else beside.direction_of(layout, speed, apart=apart)
    own = beside.direction_of_gust(layout, speed, apart=apart) if own is None and speed is not None else own
    if own is None and speed is not None and direction is not None and _of_another_height(layout, speed, direction):
        entries, direction = {at: entry for at, entry in entries.items() if at != direction.index}, None
        own = _at_its_height(layout, speed)
    if own is not None:
        entries = {at: entry for at, entry in entries.items() if "wind_direction" not in entry}
        return f'--columns "{",".join(_numbered(entries | {own: f"wind_direction[{unit_of(layout, own)}]"}))}"'
    ways = _ways(layout, direction) if direction is not None else ()
    if direction is None or not ways:
        return f'--columns "{",".join([*_numbered(entries), *open_one])}"'
    line = ",".join([*_numbered(entries | {direction.index: ways[0]}), *open_one])
    return f'--columns "{line}", or with {" or ".join(ways[1:])} for the direction, which is in doubt'


def _of_another_height(layout: Layout, speed: int, direction: Column) -> bool:
    """Whether the headings of a speed and a direction state heights that are not the same."""
    heights = [understand(layout.names[at], layout.units[at]).height for at in (speed, direction.index)]
    return None not in heights and heights[0] != heights[1]


def _at_its_height(layout: Layout, speed: int) -> int | None:
    """The one direction of the wind at the height of a speed; `None` where there is none or several."""
    headings = [understand(name, unit) for name, unit in zip(layout.names, layout.units, strict=True)]
    height = headings[speed].height
    found = [at for at, own in enumerate(headings) if own.channel == "wind_direction" and own.height == height]
    return found[0] if len(found) == 1 else None


def _ways(layout: Layout, column: Column) -> tuple[str, ...]:
    """The entries that a column of directions may be, that which its numbers speak for first; none without a doubt."""
    judged = doubted(layout, column)
    own = f"{TOWARDS if column.towards else 'wind_direction'}[{column.unit}]"
    if judged is None:
        return ()
    if not judged.may_be:
        return own, f"{TOWARDS}[{column.unit}]"
    ways = (*(f"wind_direction[{unit}]" for unit in judged.may_be), own)
    return ways if len(set(ways)) > 1 else ()


def doubted(layout: Layout, column: Column) -> Judged | None:
    """What speaks against how a direction is read, by its heading and numbers; `None` where nothing does."""
    heading = understand(layout.names[column.index], layout.units[column.index])
    value = numbers(layout.column(column.index), decimal=layout.decimal).value
    judged = judge(heading, value, "wind_direction")
    return judged if judged.doubt and not column.towards else None


def calibrated(layout: Layout, time: TimeChoice | None, column: int) -> str:
    """The option that reads a column of counts or of a frequency as a speed, by what one of them is in m/s."""
    known = {at: entry for at, entry in _known(layout, time, ()).items() if "?" not in entry and "speed" not in entry}
    entries = {**known, column: "wind_speed[? m/s]"}
    line = ",".join(_numbered(entries))
    return (
        f'--columns "{line}" with what one of them is in m/s in place of the ?, as wind_speed[0.765 m/s]; '
        "a calibration with an offset is a recipe's gain and offset"
    )


def of_stretches(layout: Layout, time: TimeChoice, wind: Wind, site: int) -> str:
    """The option that reads one of several stretches, which a column tells apart and each of which counts anew."""
    entries = _understood(replace(layout, site=site), time, (wind,))
    return f'--columns "{",".join(_numbered(entries))}" --wind {in_shell(layout.rows[0][site])} --start TIME'


def _understood(layout: Layout, time: TimeChoice | None, winds: Sequence[Wind]) -> dict[int, str]:
    """Entries of the columns of the site, of the time and of the first wind, by their index."""
    found: dict[int, str] = {} if layout.site is None else {layout.site: SITE}
    if time is not None and given_clock.index(layout) is None:
        forms = (time.form or "").split(" ")
        parts = {form: name for name, form in PARTS.items()}
        if 1 < len(time.columns) == len(forms):
            found |= {at: _part(form, parts) for at, form in zip(time.columns, forms, strict=True)}
        elif len(time.columns) == 1:
            elapsed = time.form is not None and counted.is_elapsed(time.form)
            found[time.columns[0]] = (
                f"time[{time.form}]" if elapsed else f"time[{time.likely or _OPEN}]" if time.counts else "time"
            )
        else:
            found |= dict(zip(time.columns, ("date", *["time"] * len(time.columns)), strict=False))
    for wind in winds[:1]:
        for channel, column in wind.columns.items():
            name = TOWARDS if column.towards else channel
            found.setdefault(column.index, f"{name}[{column.unit or '?'}]")
    return found


def _known(layout: Layout, time: TimeChoice | None, winds: Sequence[Wind]) -> dict[int, str]:
    """Entries of columns by their index."""
    found = _understood(layout, time, winds)
    for column in (wind.columns.get("wind_direction") for wind in winds[:1]):
        if column is not None and len(_ways(layout, column)) > 1:
            found[column.index] = "wind_direction[?]"
    timed = time is not None
    steady, own = None if timed else _steady(layout), own_motion.columns(layout)
    stamped, apart = _stamped(layout), series.members(layout.names, layout.units)
    headed = any(bow.heading_of(layout, at).channel == "wind_direction" for at in range(len(layout.names)))
    if not timed and (serial := _serial(layout)) is not None:
        found[0], timed = f"time[{serial}]", True
    elif steady is not None:
        found[steady] = "hour" if _of_one_day(layout) else "time[?]"
    elif not timed and _grows(layout):
        cells = layout.column(0)
        digits = max(len(re.split("[.,]", cell)[-1]) for cell in cells)
        likely = count_units.likely(numbers(cells, decimal=layout.decimal).value, digits=digits)
        found[0], timed = f"time[{likely.form or _OPEN}]", True
    for at in range(given_clock.own_columns(layout)):
        if at in found:
            continue
        kinds = [kind for cell in layout.column(at) if (kind := cell_kind(cell)) != "missing"]
        heading = bow.heading_of(layout, at)
        if at in apart or (not kinds and speeds_offered.is_none(layout, heading.channel)):
            continue  # the name of a station may read as that of a quantity; an empty column is none
        if not timed and at == stamped and not any(e.startswith("time") for e in found.values()):
            found[at] = "time[?]"
        elif at in own or (heading.channel in SPEEDS and not speeds_offered.may_be(layout, at)):
            found |= {} if winds else {at: "?"}
        elif winds and heading.channel in WEATHER:
            continue  # which of the columns is the weather of this wind was told already
        elif heading.channel and heading.channel not in {entry.split("[")[0] for entry in found.values()}:
            if heading.channel == "wind_direction" and (extremes.is_extreme(layout.names[at]) or _marks(layout, at)):
                continue  # the direction of a gust is none of a mean
            if compass_unit(layout, at) is not None:
                found[at] = heading.channel
                continue
            if kinds and kinds.count("text") > len(kinds) / 2:
                continue  # it is headed as a quantity and holds words: the names may be shifted against the rows
            if heading.channel in COMPONENTS and _alone(layout, at):
                # v_wind may be a speed (v, velocity), or the component towards the north
                found |= {} if winds else {at: "?"}
                continue
            guessed = heading.unit if fits(heading.channel, heading.unit) else None
            if guessed is None and CHANNELS[heading.channel].unit == "rad" and _in_doubt(layout, at):
                guessed = "?"
            found[at] = f"{heading.channel}[{guessed or _guessed(heading.channel)}]"
        elif heading.quantity:
            continue
        elif not headed and may_be_direction(layout, at) and not any("wind_direction" in e for e in found.values()):
            channel = "apparent_wind_direction" if bow.to_bow(layout, at) else "wind_direction"
            channel = TOWARDS if channel == "wind_direction" and _blows_to(layout, at) else channel
            found[at] = channel if compass_unit(layout, at) else f"{channel}[deg]"
        elif (not winds and {"number", "stamp"} & set(kinds)) or (
            not timed and re.search(r"\d{3}|\d.*\d.*\d", layout.rows[0][at])
        ):
            found[at] = "?"
    if not winds and not any(entry.split("[")[0] in (*SPEEDS, *COMPONENTS) for entry in found.values()):
        found |= speeds_offered.latest(layout)
    return found


def _blows_to(layout: Layout, index: int) -> bool:
    """Whether columns of a speed and its components say that a column of angles is where the wind blows to."""
    speeds = [at for at in range(layout.number_of_columns()) if beside.direction_of(layout, at) == index]
    found = [vectors.beside(layout, speed, index) for speed in speeds]
    return any(one is not None and one.opposite for one in found)


def _stamped(layout: Layout) -> int | None:
    """The first column of stamps, or else the first whose heading is a time above words with digits."""
    columns = [
        [] if of_event(name) else [cell for cell in layout.column(at) if cell_kind(cell) != "missing"]
        for at, name in enumerate(layout.names)
    ]
    stamps = (at for at, cells in enumerate(columns) if cells and cell_kind(cells[0]) == "stamp")
    worded = (
        at for at, cells in enumerate(columns)
        if cells and cell_kind(cells[0]) == "text" and re.search(r"\d", cells[0])
        and headings.names_time(layout.names[at])
    )  # fmt: skip
    return next(stamps, next(worded, None))


def _alone(layout: Layout, index: int) -> bool:
    """Whether a column is a component of the wind, and none along another axis is beside it."""
    along = {understand(name, stated).channel for name, stated in zip(layout.names, layout.units, strict=True)}
    return along & set(COMPONENTS) == {understand(layout.names[index], layout.units[index]).channel}


def _marks(layout: Layout, index: int) -> bool:
    """Whether a column below the heading of a direction holds marks, 0 and 1."""
    heading = understand(layout.names[index], layout.units[index])
    return holds_marks(heading, numbers(layout.column(index), decimal=layout.decimal).value)


def _in_doubt(layout: Layout, index: int) -> bool:
    """Whether the numbers of a direction may be in another unit than degrees, or are no angles."""
    heading = understand(layout.names[index], layout.units[index])
    judged = judge(heading, numbers(layout.column(index), decimal=layout.decimal).value, heading.channel)
    return in_tens(layout, index) or bool(judged.left_out)


def _part(form: str, parts: Mapping[str, str]) -> str:
    """The entry of a column that is a part of a time, written as `form`; `parts` are names by directives."""
    if form in parts:
        return parts[form]
    if form in ("%b", "%y"):
        return "month" if form == "%b" else "year"
    if form == "%H%M":
        return "time[%H%M]"
    if form in ("%Q", "%J"):
        return f"{'hour' if form == '%Q' else 'day_of_year'}[{form}]"
    return "time" if counted.is_time_of_day(form) else "date" if set("dmyYb") & set(form) else f"time[{form}]"


def _guessed(channel: str) -> str:
    return "deg" if CHANNELS[channel].unit == "rad" else "?"
