"""A recipe for a table nobody has described yet, from its first lines: what was understood, and what was not.

What the file states without doubt (a heading with units, dates that can be meant in one way only) makes a recipe that
is taken without asking. What is in doubt is named with the one thing to say, and the recipe has a "?" there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from time import time_ns
from typing import Literal

import numpy as np

from flagdata.ingest.anemometer.instants import counted, yearless
from flagdata.ingest.anemometer.instants.stamps import is_date_alone
from flagdata.ingest.anemometer.options import in_shell
from flagdata.ingest.anemometer.tables import (
    against_components,
    beside_components,
    offered_columns,
    quality_columns,
    self_described,
    sounding,
    speeds_offered,
    stated_against,
    stated_columns,
    stated_rate,
    stated_unit,
    unread,
    unread_rest,
    unread_winds,
)
from flagdata.ingest.anemometer.tables.drafted_recipe import delimiter_name, recipe_of
from flagdata.ingest.anemometer.tables.needs import Need, needs_of, over_ground, stamps_of
from flagdata.ingest.anemometer.tables.rows_above import rows_above
from flagdata.ingest.anemometer.tables.unit_letters import with_letters
from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout, lay_out
from flagdata.ingest.anemometer.times import bare_dates, given_clock, stretches, truncated
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.times.timecolumns import find_time
from flagdata.ingest.anemometer.winds import (
    cumulated,
    missing_codes,
    negative,
    own_motion,
    radiation,
    site_labels,
    unitcheck,
)
from flagdata.ingest.anemometer.winds.found import Wind
from flagdata.ingest.anemometer.winds.instruments import find_winds, named_wind
from flagdata.ingest.anemometer.winds.no_speeds import beaufort, counts, is_count, of_no_mean
from flagdata.ingest.anemometer.winds.row_units import mixed_units
from flagdata.ingest.anemometer.winds.sites import sites
from flagdata.ingest.anemometer.words import ghcn
from flagdata.ingest.anemometer.words.headings import interest, understand
from flagdata.units import canonical

_LISTED = 30
"""Columns of a table that a message names."""
_ORDER = Literal["dmy", "mdy", "ymd"]


@dataclass(frozen=True, kw_only=True)
class Doubt:
    """Something that the file does not tell: what, and what the user can say."""

    what: str
    fix: str


@dataclass(frozen=True, kw_only=True)
class Draft:
    """What a table is, as far as its first lines tell.

    Attributes:
        toml: the recipe; "?" stands where it is to be completed. "" where there is no time and no wind to describe.
        understood: what in the file speaks for it.
        remarks: what was left out, and why.
        warnings: what is odd, but does not keep the table from being read.
        doubts: what must be said before it can be read.
        needs: what must be said beside, since its stamps do not tell it.
        unsure: labels of the anemometers that may be something else, such as the speed of a vehicle.
        winds: labels of the anemometers of the table; the recipe is of the one that was named, or of the first.
        site: index of the column that tells sites apart, `None` where there is one site.
        parts: labels of the anemometers of one row, "" for one alone (see `site_labels.columns`).
        delimiter: of the cells.
        of_earth: whether the components of the wind are towards east (x) and north (y).
        first: line of its first row, counted from 0.
        stated: whether the file itself states all that the draft says, so that nothing of it is a guess.
        afloat: what is odd unless the user says what the platform does; "" where nothing shows that it moves.
        stretches: whether its sites follow one another, each with a count of time and a start of its own.
    """

    toml: str
    understood: tuple[str, ...]
    remarks: tuple[str, ...]
    warnings: tuple[str, ...]
    doubts: tuple[Doubt, ...]
    needs: tuple[Need, ...] = ()
    unsure: tuple[str, ...] = ()
    winds: tuple[str, ...] = ()
    site: int | None = None
    parts: tuple[str, ...] = ("",)
    delimiter: str = ","
    of_earth: bool = False
    stretches: bool = False
    first: int = 0
    afloat: str = ""
    stated: bool = False


@lru_cache(maxsize=4)
def draft(
    lines: tuple[str, ...],
    *,
    unit: str | None = None,
    order: _ORDER | None = None,
    wind: str | None = None,
    columns: str | None = None,
    where: str = "",
    devices_by: int | None = None,
) -> Draft | None:
    """What the table is that `lines` seem to begin; `None` where they hold no table, or neither time nor wind.

    Args:
        unit: of the wind, by the user's word.
        order: of dates written with numbers only, by the user's word.
        wind: label of the anemometer to describe, of those that `Draft.winds` lists.
        columns: what the columns are, by the user's word (see `stated_columns`).
        where: the file, for messages.
        devices_by: a column that may tell devices apart by all rows of the file: the lines that are offered name it.

    Raises:
        UsageError, UnknownNameError, InputError: `columns` do not fit the table.
    """
    layout = lay_out(lines, interest=interest)
    if layout is None:
        return None
    layout = with_letters(layout)
    by_user: Wind | None = None
    written, unit = unit, None if unit is None else canonical(unit)
    if columns is not None:
        known = stated_columns.stated(layout, columns, unit=unit, order=order, where=where)
        by_user = known.wind
        time, winds, remarks, warnings = known.time, (by_user,), (), ()
        of_time = time.columns if time is not None else ()
        mixed = None if known.site is None else (known.site, tuple(sorted(set(layout.column(known.site)) - {""})))
    else:
        time = find_time(layout, order=order)
        of_time = time.columns if time is not None else ()
        mixed = None
        if time is not None:
            mixed = sites(layout, time=of_time, stamps=stamps_of(layout, of_time))
        winds, remarks, warnings = find_winds(layout, time=of_time, told=unit)
        for part in () if wind is None else site_labels.parts(wind, mixed[1] if mixed is not None else ()):
            if part in {one.label for one in winds}:
                break
            said, odd = named_wind(layout, part, time=of_time, told=unit)
            winds, warnings = (*winds, *said), (*warnings, *odd)
            if said:
                by_user = said[0]
                break
        if time is None and not winds:
            return None
    named = columns is None and by_user is not None
    warnings = warnings if by_user is None else (*warnings, *stated_against.warnings(layout, by_user))
    parts: tuple[str, ...] = ("",)
    layout = replace(layout, site=devices_by if mixed is None else mixed[0])
    if mixed is not None:
        parts = site_labels.columns(winds, named=named)
        winds = site_labels.of_sites(winds, *mixed, named=named)
    labels = tuple(one.label for one in winds)
    of_all = mixed is not None and wind in parts
    chosen = next((one for one in winds if one.label == wind or (of_all and one.label.endswith(f":{wind}"))), None)
    chosen = chosen if chosen is None else replace(chosen, sure=True)
    doubts = list(_doubts(lines, layout, time, winds, chosen))
    doubts += _below_zero(layout, time, winds) if columns is None and wind is None else []
    if wind is not None and chosen is None and mixed is not None and winds:
        # A site that the first rows do not hold.
        site, part = site_labels.site_of(wind, parts)
        like = next((one for one in winds if not part or one.label.endswith(f":{part}")), winds[0])
        chosen = replace(like, label=wind, site=(mixed[0], site))
    elif wind is not None and chosen is None:
        known = ", ".join(labels) or "none"
        doubts.append(Doubt(what=f"no anemometer {wind!r} in the file", fix=f"name one of: {known}"))
    chosen = chosen or (winds[0] if winds else None)
    anew: list[Doubt] = []
    if time is not None and chosen is not None and (columns is None if mixed is None else wind is None):
        anew = _stretches(layout, time, chosen)
        doubts += anew
    if columns is None and time is not None and chosen is not None:
        turned = against_components.doubt(layout, time, chosen)
        doubts += [] if turned is None else [Doubt(what=turned[0], fix=turned[1])]
    if layout.short:
        shown = f"line {layout.preamble + 1} names {layout.short} of {layout.number_of_columns()} columns"
        warnings = (*warnings, f"{shown}: taken as the first {layout.short}")
    if unit is not None and columns is None and not any("as you said" in text for text in warnings):
        warnings = (*warnings, *stated_unit.contradiction(lines, layout.preamble, unit))
    above = rows_above(lines, layout)
    warnings = (*warnings, above) if above else warnings
    if time is not None and time.unnamed:
        shown = f"{time.columns[0] + 1} to {time.columns[-1] + 1}"
        warnings = (*warnings, f"no line names the columns: numbers {shown} are taken as the time ({time.form})")
    if time is not None and time.remark is not None:
        warnings = (*warnings, time.remark)
    if columns is None and chosen is not None:
        taken = {*of_time, *(column.index for one in winds for column in one.columns.values())}
        warnings = (*warnings, *quality_columns.warnings(layout, taken=taken))
        warnings += against_components.warnings(layout, chosen, stated=False)
        remarks = (*remarks, *unread.from_either_north(layout, time, (chosen,)))
        remarks = (*remarks, *unread.directions(layout, time, chosen, winds, remarks), *unread.relative(layout, winds))
        remarks = (*remarks, *unread.otherwise(layout, time, chosen), *beside_components.remark(layout, time, chosen))
        remarks = (*remarks, *beside_components.instead(layout, time, chosen))
        warnings = (*warnings, *beside_components.lengths(layout, chosen))
        remarks = (*remarks, *own_motion.remarks(layout), *(unread.times(layout, time, remarks) if time else ()))
        remarks = (*remarks, *unread_winds.remark(layout, time, chosen, winds, remarks))
    remarks = (*remarks, *unread_rest.remark(layout, time, winds, (*layout.strange, *remarks, *warnings)))
    if given_clock.index(layout) is not None and any("--columns" in text for text in remarks):
        remarks = (*remarks, given_clock.AS_GIVEN)
    stated = columns is None and len(winds) == 1 and not doubts and self_described.of(layout, time, chosen)
    toml = recipe_of(layout, time, chosen, missing=() if stated else missing_codes.of(layout, chosen))
    needs = (*needs_of(lines, layout, time), *(over_ground(layout, chosen) if by_user is None else ()))
    return Draft(
        toml=toml, understood=_as_written(_understood(layout, time, winds), unit, written),
        remarks=(*layout.strange, *remarks), warnings=_as_written(warnings, unit, written),
        doubts=tuple(doubts), needs=needs,
        afloat="" if by_user is None else stated_against.afloat(layout, by_user),
        unsure=tuple(one.label for one in winds if not one.sure),
        winds=labels, parts=parts, site=mixed[0] if mixed else None, delimiter=layout.delimiter,
        of_earth=chosen is not None and chosen.of_earth, stretches=bool(anew),
        first=layout.lines[0] - 1, stated=stated,
    )  # fmt: skip


def _as_written(texts: Sequence[str], unit: str | None, written: str | None) -> tuple[str, ...]:
    """Messages with the unit that the user gave as it was written, where they say that it was given."""
    return tuple(text.replace(f"{unit}, as you said", f"{written}, as you said") for text in texts)


def _doubts(
    lines: Sequence[str], layout: Layout, time: TimeChoice | None, winds: Sequence[Wind], chosen: Wind | None
) -> list[Doubt]:
    found: list[Doubt] = []
    names = _listed(layout)
    dates = _bare_dates(layout, time, chosen or next(iter(winds), None))
    if dates and winds:
        one = " and ".join(stated_columns.named(layout, at) for at in dates)
        what = f"{one} is a date without a time of day, rows share it, and no column is read as the time of day"
        found.append(Doubt(what=what, fix=offered_columns.of_bare_dates(layout, dates, [chosen or winds[0]])))
    elif time is None and (cut_off := truncated.doubt(layout)) is not None:
        found.append(Doubt(what=cut_off[0], fix=cut_off[1]))
    elif time is None:
        offered = offered_columns.offer(layout, time, winds)
        fix = f"{offered}; if none is the time and the rows came at a steady rate, add --start TIME --rate HZ"
        above = stated_rate.advice(lines[: layout.preamble])
        fix += f" ({above})" if above else ""
        what = f"no column is a time in a format that is known; {sounding.told(layout)}{unread.events(layout)}"
        what += f"the columns are {names}"
        found.append(Doubt(what=what, fix=fix))
    elif (other := truncated.of_another_century(layout, time, now=time_ns())) is not None:
        found.append(Doubt(what=other[0], fix=other[1]))
    elif time.doubt is not None and time.fix is not None:
        offered = f"; {offered_columns.offer(layout, time, winds)}" if time.counts else ""
        found.append(Doubt(what=time.doubt, fix=f"{time.fix}{offered}"))
    classes = beaufort(layout)
    if not winds and classes:
        what = f"column {classes[0]!r} holds Beaufort numbers, which are classes of wind, not speeds"
        found.append(Doubt(what=what, fix="set the instrument to m/s, km/h, mph or kn and log again"))
    elif not winds and (counted_by := counts(layout)):
        what = f"column {layout.names[counted_by[0]]!r} is what an anemometer counts or gives, not yet a speed"
        fix = "say what one of it is in m/s, from the anemometer's data sheet: "
        found.append(Doubt(what=what, fix=fix + offered_columns.calibrated(layout, time, counted_by[0])))
    elif not winds and (directions := _directions(layout)):
        what = f"column {directions[0]!r} is a direction of the wind, but no column is its speed"
        fix = "log the speed beside it; if a column is the speed all the same, or the direction alone is wanted, "
        fix += offered_columns.offer(layout, time, winds)
        found.append(Doubt(what=what, fix=fix))
    elif not winds:
        fix = "name the column of the wind's speed by its heading or number: --wind COLUMN, with its unit: --unit m/s"
        if time is not None and (only := _only_numbers(layout, time)) is not None:
            name = in_shell(layout.names[only] if layout.by_name else str(only + 1))
            fix = f"if column {only + 1}, the only one of numbers, is the wind's speed: --wind {name} --unit m/s"
            fix += " (or its unit)"
        fix += "" if time is None or time.counts else f"; or {offered_columns.offer(layout, time, winds)}"
        beside = "".join(f"{said}; " for said in (own_motion.doubt(layout), of_no_mean(layout)) if said)
        what = f"no column is surely a wind; {beside}the columns are {names}"
        found.append(Doubt(what=what, fix=fix))
    for wind in winds if chosen is None else (chosen,):
        changing = mixed_units(layout, next(iter(wind.columns.values())).index)
        if changing:
            what = f"the rows of {wind.label!r} are in different units: {', '.join(changing)}"
            found.append(Doubt(what=what, fix="make a file of the rows in each unit, and ingest them apart"))
    for wind in (chosen,) if chosen is not None else winds:
        missing = wind.without_unit()
        if missing:
            found.append(_unit_doubt(lines, layout, time, wind, missing))
            break
    candidates = winds if chosen is None else ()
    unsure = [wind for wind in candidates if not wind.sure and speeds_offered.may_be_wind(layout, wind)]
    if unsure:
        first = unsure[0]
        whole = "the wind" if speeds_offered.is_offered(layout, first) else "the wind's whole speed, no component of it"
        fix = f"if it is {whole}, name it: --wind {in_shell(first.label)}"
        fix += "" if time is None or time.counts else f"; or {offered_columns.offer(layout, time, winds)}"
        what = (
            f"{', '.join(repr(wind.label) for wind in unsure)} may be a wind or another speed, the heading does not say"
        )
        own = own_motion.doubt(layout)
        what += f"; {own}" if own else ""
        found.append(Doubt(what=what, fix=fix))
    return found


def _listed(layout: Layout) -> str:
    """The names of a table's columns, the first of many."""
    names = [repr(name) for name in layout.names[: given_clock.own_columns(layout)] if name]
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return (", ".join(names[:_LISTED]) or "no names") + more


def _stretches(layout: Layout, time: TimeChoice, wind: Wind) -> list[Doubt]:
    """A doubt where a count of time starts again with each value of another column."""
    if time.form is None or not counted.is_elapsed(time.form):
        return []
    site = stretches.column(layout, time.columns)
    if site is None:
        return []
    what = f"the count of time starts again wherever {stated_columns.named(layout, site)} changes"
    line = offered_columns.of_stretches(layout, time, wind, site)
    return [Doubt(what=what, fix=f"read each stretch by itself, with its own start: {line}")]


def _bare_dates(layout: Layout, time: TimeChoice | None, wind: Wind | None) -> tuple[int, ...]:
    """The columns of a date without a time of day that rows share, where they are the time, or no column is."""
    if time is None:
        column = bare_dates.column(layout)
        return () if column is None else (column,)
    return time.columns if bare_dates.are_time(layout, time, wind.site if wind is not None else None) else ()


def _below_zero(layout: Layout, time: TimeChoice | None, winds: Sequence[Wind]) -> list[Doubt]:
    """A doubt for each speed that is below zero too often and too far to be one: it is a component."""
    found: list[Doubt] = []
    for wind in winds:
        column = wind.columns.get("wind_speed")
        if column is None:
            continue
        lowest = negative.lowest(layout, column.index)
        if lowest is None:
            continue
        what = f"column {wind.label!r} goes below zero, to {lowest:g}: a component of the wind, not its speed"
        line = offered_columns.offer(layout, time, (), components=True)
        fix = (
            f"if two columns are its components, say so with wind_x and wind_y (x to the east, y to the north): {line}"
        )
        found.append(Doubt(what=what, fix=fix))
    return found


def _only_numbers(layout: Layout, time: TimeChoice) -> int | None:
    """The one column beside the time whose cells are numbers; `None` where there are none or several."""
    columns = [index for index in range(layout.number_of_columns()) if index not in time.columns]
    found = [index for index in columns if {*map(cell_kind, layout.column(index))} <= {"number", "missing"}]
    return found[0] if len(found) == 1 else None


def _directions(layout: Layout) -> list[str]:
    named = (name for at, name in enumerate(layout.names) if not radiation.is_direct(layout.names, at))
    return [name for name in named if understand(name).channel.endswith("wind_direction")]


def _unit_doubt(
    lines: Sequence[str], layout: Layout, time: TimeChoice | None, wind: Wind, missing: Sequence[str]
) -> Doubt:
    above = stated_unit.above(lines, layout.preamble)
    if above is not None:
        name, number, words = above
        heading = layout.names[wind.columns[missing[0]].index]
        what = f"the unit of column {heading!r} is not stated in its heading; line {number} says {words!r}"
        return Doubt(what=what, fix=f"if that is the unit of the wind, give it: --unit {name}")
    column = wind.columns[missing[0]].index
    if is_count(layout, column):
        what = f"column {layout.names[column]!r} is what an anemometer counts or gives, not yet a speed"
        fix = "say what one of it is in m/s, from the anemometer's data sheet: "
        return Doubt(what=what, fix=fix + offered_columns.calibrated(layout, time, column))
    value = numbers(layout.column(column), decimal=layout.decimal, missing=missing_codes.of(layout, wind)).value
    daily = time is not None and time.form is not None and is_date_alone(time.form)
    unlike = cumulated.unlike_speed(value) or ("" if daily else unitcheck.no_wind(value))
    if missing[0] == "wind_speed" and unlike:
        what = f"column {layout.names[column]!r} may be no speed, and its unit is not stated: {unlike}"
        fix = "name the column of the speed: --wind COLUMN; if it is a speed all the same, give its unit: --unit m/s"
        return Doubt(what=what, fix=fix)
    if layout.names[column] in ghcn.ELEMENTS:
        return Doubt(what=f"the unit of {layout.names[column]!r} is not stated", fix=f"give it: {ghcn.UNITS}")
    evidence = unitcheck.likely(value, daily=daily) if missing[0] == "wind_speed" else None
    known = value[np.isfinite(value)]
    if evidence is not None and unitcheck.from_resolution(value) is None and bool(np.all(known % 1 == 0)):
        fix = "give it, after the file's description: --unit '0.1 m/s' (as weather services do), "
        fix += f"--unit {evidence.unit} or another"
        return Doubt(what=f"the unit of column {layout.names[column]!r} is not stated; {evidence.reason}", fix=fix)
    likely = f"; likely {evidence.unit}, since {evidence.reason}" if evidence else ""
    if (strange := understand(layout.names[column]).strange)[1:].isdecimal():  # as "x10"
        what = f"the heading of column {layout.names[column]!r} says {strange!r}, so that its numbers are no plain unit"
        return Doubt(what=what, fix=f"give what one of them is: --unit '{1 / int(strange[1:]):g} m/s'")
    name = layout.names[column] or f"number {column + 1}"
    first = evidence.unit if evidence else "m/s"
    others = ", ".join(unit for unit in ("m/s", "km/h", "mph", "kn", "ft/s") if unit != first)
    fix = f"give it: --unit {first} (or {others}), after the instrument's setting or manual"
    return Doubt(what=f"the unit of column {name!r} is not stated{likely}", fix=fix)


def _understood(layout: Layout, time: TimeChoice | None, winds: Sequence[Wind]) -> list[str]:
    added = given_clock.index(layout) is not None
    found = [*given_clock.understood(layout)] if added else _columns_and_time(layout, time)
    for wind in winds:
        height = f" at {wind.height:g} m" if wind.height is not None else ""
        site = f" of rows with {wind.site[1]!r} in column {_shown(layout, wind.site[0])}" if wind.site else ""
        parts = [
            f"{channel} from column {_shown(layout, column.index)}, {column.told or 'unit not stated'}"
            for channel, column in wind.columns.items()
        ]
        found.append(f"anemometer {wind.label!r}{height}{site}: {'; '.join(parts)}")
    return found


def _columns_and_time(layout: Layout, time: TimeChoice | None) -> list[str]:
    """How the cells of a table are divided, which line names its columns, and which of them are its time."""
    named = (
        f"line {layout.preamble + 1} names the {layout.number_of_columns()} columns"
        if layout.header
        else f"no line names the {layout.number_of_columns()} columns"
    )
    if layout.header and layout.named:
        named = f"line {layout.preamble + 1} names {layout.named} columns, of which rows fill the first "
        named += f"{layout.number_of_columns()}"
    units = f", {_units_line(layout)} their units" if any(layout.units) else ""
    decimal = ", numbers have decimal commas" if layout.decimal == "," else ""
    found = [f"cells are divided by {delimiter_name(layout.delimiter)!r}{decimal}; {named}{units}"]
    if time is not None:
        stamps = " and ".join(_shown(layout, index) for index in time.columns)
        zone = "which state their zone" if time.zoned else f"in {time.zone}" if time.zone else "without a zone"
        if time.form is not None and (counted.is_elapsed(time.form) or counted.needs_date(time.form)):
            zone = "without a year" if yearless.is_yearless(time.form) else "without a date"
        unknown = "a count in a unit that is not told" if time.counts else "a date in an order that is not told"
        zone = "from a start" if time.counts else zone
        found.append(f"column {stamps} is the time, as {time.form or unknown}, {zone}")
    return found


def _units_line(layout: Layout) -> str:
    if all(unit == behind for unit, behind in zip(layout.units, layout.suffixes, strict=True) if unit):
        return "the cells themselves"
    return f"line {layout.preamble + 2}" if layout.header == 2 else "line below"


def _shown(layout: Layout, index: int) -> str:
    return repr(layout.names[index]) if layout.names[index] else f"number {index + 1}"
