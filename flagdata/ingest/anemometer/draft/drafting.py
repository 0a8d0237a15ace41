"""A draft of a table that no recipe describes: what is stated, inferred, assumed or given, and what
is open.

A draft gives no rows. Where nothing is open, its recipe can be read and shown; where anything of it
is inferred or assumed, what was read counts only when it is confirmed (see `confirm`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from flagdata.core import compass
from flagdata.core.units import canonical, name_of_unit
from flagdata.ingest.anemometer.draft.given_columns import GivenColumns, given_columns
from flagdata.ingest.anemometer.draft.heading_words import (
    MOVING,
    Meaning,
    fits,
    meaning,
)
from flagdata.ingest.anemometer.draft.questions import ZONE, Open
from flagdata.ingest.anemometer.draft.recipe_text import (
    ChannelText,
    quote_for_toml,
    recipe_text,
    reference,
)
from flagdata.ingest.anemometer.draft.table_shape import TableShape, is_missing, is_number, shape_of
from flagdata.ingest.anemometer.draft.times import (
    TimeFields,
    counts_of,
    find_time,
    of_another_origin,
    of_columns,
    unread_count,
)
from flagdata.ingest.anemometer.draft.wind_questions import ask_about_direction, gust_factor
from flagdata.ingest.anemometer.instants import dates
from flagdata.ingest.anemometer.instants.stamp_text import EPOCH
from flagdata.ingest.anemometer.wind_options import WindOptions

Origin = Literal["stated", "inferred", "assumed", "given"]
_BESIDE = {
    "sonic": "sonic_temperature",
    "temperature": "air_temperature",
    "humidity": "relative_humidity",
    "pressure": "air_pressure",
}
_AXES = {"x": "wind_x", "y": "wind_y", "z": "wind_z"}
_OF_WIND = frozenset({"speed", "direction", "x", "y", "z"})
_PLAIN = {
    "wind_speed": ("wind speed",),
    "wind_direction": ("wind direction",),
    "air_temperature": ("air temperature",),
    "relative_humidity": ("relative humidity",),
    "sonic_temperature": ("sonic temperature",),
    "air_pressure": ("air pressure",),
    "wind_x": ("wind x", "eastward wind"),
    "wind_y": ("wind y", "northward wind"),
    "wind_z": ("wind z", "upward wind"),
}
"""Words of a heading that state a quantity in full; others are understood, and what is understood
is inferred."""
_WRITINGS = {
    "iso": "ISO 8601",
    "elapsed-s": "a count of seconds",
    "elapsed-ms": "a count of milliseconds",
}
"""Forms of stamps that have a name."""
_LISTED = 5
"""Sites that a question names."""
_WIDE = 40
"""Characters of a line that is not read, where it is shown."""
_POINTS = 0.9
"""Share of the cells that must be points of the compass."""


@dataclass(frozen=True, kw_only=True)
class Fact:
    """One thing that a draft says.

    Attributes:
        what: it is about: "time", "wind_speed", "delimiter".
        value: for people.
        origin: the file states it, the program inferred it from values or assumed it, or the user
            gave it.
        evidence: what shows it.
    """

    what: str
    value: str
    origin: Origin
    evidence: str = ""

    def line(self) -> str:
        return (
            f"{self.what:<16}{self.value:<36}  "
            f"{self.origin}{f' ({self.evidence})' if self.evidence else ''}"
        )


@dataclass(frozen=True, kw_only=True)
class Draft:
    """See the module's text.

    Attributes:
        facts: what is known, with its origin.
        open: what is not.
        recipe: TOML; complete where nothing is open.
        unused: headings of the columns that are not read.
        winds: labels of the anemometers that it holds.
        rivals: headings of other speeds and directions, which are not read.
        of_earth: whether the components are towards east (x) and north (y).
    """

    facts: tuple[Fact, ...]
    open: tuple[Open, ...]
    recipe: str
    unused: tuple[str, ...]
    winds: tuple[str, ...]
    rivals: tuple[str, ...] = ()
    of_earth: bool = False

    @property
    def stated(self) -> bool:
        """Whether nothing of it is inferred or assumed, and nothing else in it may be the wind."""
        return not (self.open or self.rivals) and all(
            fact.origin in ("stated", "given") for fact in self.facts
        )


@dataclass
class _Parts:
    """A draft as it is put together."""

    facts: list[Fact] = field(default_factory=list)
    open: list[Open] = field(default_factory=list)
    channels: dict[str, ChannelText] = field(default_factory=dict)
    used: set[int] = field(default_factory=set)


def draft(
    lines: Sequence[str],
    options: WindOptions,
    *,
    serial_days: str = "excel-days",
    counted: bool = False,
) -> Draft | None:
    """Drafts a recipe for the table that a file begins with; `None` where it holds none.

    Args:
        serial_days: the form that "excel-days" are in this file.
        counted: whether its last column are instants that `untimed` counted.

    Raises:
        UsageError, UnknownNameError, InputError: `options.columns` do not fit the table.
    """
    shape = shape_of(lines)
    if shape is None:
        return None
    meanings = [meaning(name, below) for name, below in zip(shape.names, shape.units, strict=True)]
    user_columns = given_columns(options.columns, shape) if options.columns is not None else None
    if user_columns is not None and user_columns.form == "excel-days":
        user_columns = replace(user_columns, form=serial_days)
    parts = _Parts()
    winds, of_earth = (
        _of_wind(parts, shape, meanings, options)
        if user_columns is None
        else (_of_user(parts, shape, user_columns), False)
    )
    time = _time(parts, shape, meanings, user_columns, options, counted=counted)
    if user_columns is None and not winds and time is None:
        return None
    if user_columns is None:
        _ask_about_sites(parts, shape, meanings)
    parts.facts.insert(0, _cutting(shape, lines))
    label = options.wind or (winds[0] if winds else "anemometer")
    unused_columns = [i for i in range(len(shape.names)) if i not in parts.used and shape.names[i]]
    unused = tuple(shape.shown(i) for i in unused_columns)
    rivals = tuple(shape.label(i) for i in unused_columns if meanings[i].kind in _OF_WIND)
    return Draft(
        facts=tuple(parts.facts),
        open=tuple(parts.open),
        unused=unused,
        winds=winds,
        rivals=rivals,
        of_earth=of_earth,
        recipe=recipe_text(
            shape,
            time=None if time is None else time.columns,
            form=time.form if time is not None else None,
            zone="UTC" if time is not None and time.utc and not time.zoned else None,
            channels=parts.channels,
            label=label,
            missing=options.missing,
        ),
    )


def _ask_about_sites(parts: _Parts, shape: TableShape, meanings: Sequence[Meaning]) -> None:
    """Asks where a column names several sites or units, whose rows must not be mixed."""
    for index, heading in enumerate(meanings):
        values = sorted(set(shape.column(index)) - {""})
        of_units = bool(values) and all(
            fits("wind_speed", name_of_unit(value) or "") for value in values
        )
        if (
            (heading.kind == "site" or of_units)
            and index not in parts.used
            and 1 < len(values) < len(shape.rows)
        ):
            several = f"{len(values)} {'units' if of_units else 'sites'}"
            question = (
                f"rows are of {several} by {shape.shown(index)}: {', '.join(values[:_LISTED])}; "
                "which one?"
            )
            lines = (
                f"[rows]\ncolumn = {reference(shape.reference(index))}\nvalue = "
                f"{quote_for_toml(values[0])}"
            )
            parts.open.append(
                Open(key="sensor", question=question, example="FILE.toml", lines=lines)
            )


def _cutting(shape: TableShape, lines: Sequence[str]) -> Fact:
    delimiter = {" ": "blanks", "\t": "tabs"}.get(shape.delimiter, repr(shape.delimiter))
    value = f"divided by {delimiter}, decimal {shape.decimal!r}"
    plain = (
        shape.delimiter in ",\t"
        and shape.decimal == "."
        and shape.preamble == 0
        and shape.header == 1
    )
    where = (
        f"line {shape.preamble + 1} names the columns"
        if shape.header
        else "no line names the columns"
    )
    if shape.preamble:
        fullest = max(range(shape.preamble), key=lambda at: sum(map(str.isdigit, lines[at])))
        where += (
            f"; {shape.preamble} lines above are not read, as line {fullest + 1} "
            f"{lines[fullest][:_WIDE]!r}"
        )
    return Fact(what="cells", value=value, origin="stated" if plain else "inferred", evidence=where)


def _time(
    parts: _Parts,
    shape: TableShape,
    meanings: Sequence[Meaning],
    user_columns: GivenColumns | None,
    options: WindOptions,
    *,
    counted: bool,
) -> TimeFields | None:
    if user_columns is not None:
        columns = user_columns.time or ((len(shape.names) - 1,) if counted else ())
        time = (
            of_columns(shape, columns, options.date_order, user_columns.form or None)
            if columns
            else None
        )
    else:
        time = find_time(shape, meanings, options.date_order)
    if time is None:
        question = (
            "no column reads as a time: which one is it, and in what "
            f"format?{unread_count(shape, meanings)}"
        )
        example = (
            "'1=time[FORMAT],2=wind_speed[UNIT]' (or, if readings came at a steady rate, --start "
            "TIME --rate HZ)"
        )
        parts.open.append(Open(key="columns", question=question, example=example))
        return None
    parts.used.update(time.columns)
    names = " + ".join(shape.shown(i) for i in time.columns)
    if time.form is None:
        first = shape.rows[0][time.columns[0]]
        question = f"{names}: {first!r} reads as {' and as '.join(time.forms)}: which is right?"
        question += f" (It would be {counts_of(first)})" if set(time.forms) & set(EPOCH) else ""
        orders = {form.replace("%d", "%m") for form in time.forms}
        if len(orders) == 1:
            parts.open.append(
                Open(key="date_order", question=question, example="ORDER (dmy, mdy or ymd)")
            )
        else:
            example = f"'{shape.reference(time.columns[0])}=time[FORMAT], and all other columns'"
            parts.open.append(Open(key="columns", question=question, example=example))
        return time
    if user_columns is None and of_another_origin(time, meanings):
        question = (
            f"{names} reads as {time.form}, and its heading speaks of another origin than 1970: "
            "which is right?"
        )
        example = f"'{shape.reference(time.columns[0])}=time[FORMAT], and all other columns'"
        parts.open.append(Open(key="columns", question=question, example=example))
    if user_columns is not None and user_columns.form:
        origin: Origin = "given"
    elif time.form == "iso" and all(meanings[i].kind == "time" for i in time.columns):
        origin = "stated"
    else:
        origin = "given" if options.date_order is not None else "inferred"
    parts.facts.append(
        Fact(
            what="time",
            value=f"{names} as {_WRITINGS.get(time.form, time.form)}",
            origin=origin,
            evidence=time.evidence,
        )
    )
    if dates.is_elapsed(time.form):
        if options.start is None:
            question = f"{names} counts from a start: at what instant was the first row?"
            parts.open.append(
                Open(key="start", question=question, example="TIME (as 2026-05-01T12:00:00+02:00)")
            )
        return time
    if dates.needs_date(time.form) and options.date is None:
        question = f"{names} has no whole date: of what day is the first row?"
        parts.open.append(Open(key="date", question=question, example="DATE (as 2026-05-01)"))
    if time.zoned:
        zone = f"UTC, as {time.form}" if time.form in EPOCH else "in the stamps"
        parts.facts.append(Fact(what="zone", value=zone, origin="stated"))
    elif options.zone is not None:
        parts.facts.append(Fact(what="zone", value=options.zone, origin="given"))
    elif time.utc:
        parts.facts.append(Fact(what="zone", value="UTC", origin="stated", evidence="the heading"))
    else:
        parts.open.append(ZONE)
    return time


def _of_user(parts: _Parts, shape: TableShape, user_columns: GivenColumns) -> tuple[str, ...]:
    for channel, (index, unit) in user_columns.channels.items():
        towards = channel == "wind_direction" and user_columns.towards
        parts.used.add(index)
        parts.channels[channel] = ChannelText(
            column=shape.reference(index), unit=unit, towards=towards
        )
        parts.facts.append(
            Fact(what=channel, value=f"{shape.shown(index)} in {unit}", origin="given")
        )
    first = next(iter(user_columns.channels.values()))[0]
    return (shape.label(first),)


def _of_wind(
    parts: _Parts, shape: TableShape, meanings: Sequence[Meaning], options: WindOptions
) -> tuple[tuple[str, ...], bool]:
    """Labels of the anemometers; the facts of the one that is read are added to `parts`."""
    numeric = {i for i in range(len(meanings)) if _numeric(shape.column(i))}
    speeds = [
        i
        for i, heading in enumerate(meanings)
        if heading.kind == "speed" and not heading.against and i in numeric
    ]
    moves = any(set(heading.against) & MOVING for heading in meanings)
    if moves or any(meanings[i].named for i in speeds):
        speeds = [i for i in speeds if meanings[i].named]
    labels = {shape.label(i): i for i in speeds}
    chosen = labels.get(options.wind or "", speeds[0] if len(speeds) == 1 else None)
    is_given = options.wind is not None and not (len(labels) > 1 and options.wind in labels)
    if options.wind is not None and options.wind not in labels:
        columns = {shape.label(i): i for i in range(len(shape.names))}
        chosen = columns.get(options.wind)
        labels = {options.wind: chosen} if chosen is not None else labels
    axes = {
        heading.kind: i
        for i, heading in reversed(list(enumerate(meanings)))
        if heading.kind in _AXES and not heading.against
    }
    components = {
        _AXES[kind]: axes[kind]
        for kind in ("x", "y", "z")
        if kind in axes and axes[kind] in numeric
    }
    if chosen is None and not speeds and {"wind_x", "wind_y"} <= set(components):
        for channel, index in components.items():
            _add_wind_column(parts, shape, meanings, channel, index, options, is_given=False)
        earth = any(word in shape.names[components["wind_x"]].lower() for word in ("east", "u10"))
        _other_quantities(parts, shape, meanings)
        return (shape.label(components["wind_x"]),), earth
    if chosen is None:
        listed = ", ".join(labels) or ", ".join(shape.shown(i) for i in range(len(shape.names)))
        question = (
            f"which column is the wind's speed? {listed}"
            if not labels
            else f"which anemometer? {listed}"
        )
        parts.open.append(Open(key="wind", question=question, example="COLUMN"))
        return tuple(labels), False
    against = meanings[chosen].against
    moving = [
        shape.names[i]
        for i, heading in enumerate(meanings)
        if set(heading.against) & MOVING or (i == chosen and against)
    ]
    if moving and options.platform is None:
        question = (
            f"the heading {moving[0]!r} speaks of a platform that moves: which is it, fixed (it "
            "does not move), "
            "moving (the wind is apparent), or corrected (the wind is over ground)?"
        )
        parts.open.append(Open(key="platform", question=question, example="PLATFORM"))
    _add_wind_column(parts, shape, meanings, "wind_speed", chosen, options, is_given=is_given)
    direction = _direction(parts, shape, meanings, chosen)
    doubts = [gust_factor(shape, meanings, chosen)]
    if direction is not None and {"wind_x", "wind_y"} <= set(components):
        axes_columns = (components["wind_x"], components["wind_y"])
        doubts.append(
            ask_about_direction(
                shape, axes_columns, direction, parts.channels["wind_direction"].unit
            )
        )
    parts.open += [
        doubt for doubt in doubts if doubt is not None and doubt.example not in options.expect
    ]
    _other_quantities(parts, shape, meanings)
    return tuple(labels), False


def _add_wind_column(
    parts: _Parts,
    shape: TableShape,
    meanings: Sequence[Meaning],
    channel: str,
    index: int,
    options: WindOptions,
    *,
    is_given: bool,
) -> None:
    """Adds a column of wind with its unit; `is_given` where the user named it, and it is not one of
    several by its heading."""
    meaning = meanings[index]
    parts.used.add(index)
    unit, origin, evidence = meaning.unit, _STATED, "the heading"
    if options.unit is not None:
        unit, origin, evidence = canonical(options.unit), _GIVEN, "--unit"
        if meaning.unit not in (None, unit):
            evidence = f"--unit; the heading says {meaning.unit}"
    if unit is None or not fits(channel, unit):
        question = f"what is the unit of {shape.shown(index)} (m/s, km/h, mph, kn)?"
        parts.open.append(Open(key="unit", question=question, example="UNIT"))
        unit = "?"
    if meaning.plain not in _PLAIN[channel]:
        origin = "given" if is_given else "inferred"
        evidence += "" if meaning.named else "; it does not name the wind"
    parts.channels[channel] = ChannelText(column=shape.reference(index), unit=unit)
    parts.facts.append(
        Fact(
            what=channel, value=f"{shape.shown(index)} in {unit}", origin=origin, evidence=evidence
        )
    )


_STATED: Origin = "stated"
_GIVEN: Origin = "given"


def _direction(
    parts: _Parts, shape: TableShape, meanings: Sequence[Meaning], speed: int
) -> int | None:
    """Finds the direction that belongs to a speed: of the same height, the only one of the table;
    its column, if numeric."""
    candidates = [
        i
        for i, meaning in enumerate(meanings)
        if meaning.kind == "direction"
        and not set(meaning.against) - {"to", "toward", "towards", "going"}
        and meanings[speed].height in (None, meaning.height)
    ]
    if len(candidates) != 1:
        return None
    index = candidates[0]
    meaning_of_direction = meanings[index]
    unit, origin, evidence = (
        meaning_of_direction.unit,
        _STATED,
        "the heading; from true north, clockwise, is the convention",
    )
    points = _compass(shape.column(index))
    if points == "?":
        question = (
            f"{shape.shown(index)} has points of the compass whose O may be east or west: of which "
            "language?"
        )
        example = (
            f"'{shape.reference(index)}=wind_direction[points-de] (or points-es, …), and all other "
            "columns'"
        )
        parts.open.append(Open(key="columns", question=question, example=example))
        return None
    if points is not None:
        unit, origin, evidence = points, "inferred", "its cells are points of the compass"
    elif not _numeric(shape.column(index)):
        return None
    elif unit is None:
        unit, origin, evidence = "deg", "assumed", "no unit is stated"
    elif not fits("wind_direction", unit):
        return None
    elif meaning_of_direction.plain not in _PLAIN["wind_direction"]:
        origin = "inferred"
    if meaning_of_direction.against:
        question = f"does {shape.shown(index)} say where the wind comes from, or where it blows to?"
        example = (
            f"'{shape.reference(index)}=wind_direction[{unit}] (or wind_direction_to), and all "
            "other columns'"
        )
        parts.open.append(Open(key="columns", question=question, example=example))
    parts.used.add(index)
    parts.channels["wind_direction"] = ChannelText(column=shape.reference(index), unit=unit)
    value = f"{shape.shown(index)} in {unit}"
    parts.facts.append(Fact(what="wind_direction", value=value, origin=origin, evidence=evidence))
    return index if points is None else None


def _other_quantities(parts: _Parts, shape: TableShape, meanings: Sequence[Meaning]) -> None:
    """Adds temperature, humidity and pressure whose unit is stated."""
    for index, heading in enumerate(meanings):
        channel = _BESIDE.get(heading.kind)
        if (
            channel is None
            or channel in parts.channels
            or heading.against
            or not _numeric(shape.column(index))
        ):
            continue
        if heading.unit is not None and fits(channel, heading.unit):
            parts.used.add(index)
            parts.channels[channel] = ChannelText(column=shape.reference(index), unit=heading.unit)
            value = f"{shape.shown(index)} in {heading.unit}"
            origin: Origin = "stated" if heading.plain in _PLAIN[channel] else "inferred"
            parts.facts.append(
                Fact(what=channel, value=value, origin=origin, evidence="the heading")
            )


def _numeric(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if not is_missing(cell) and cell.upper() not in compass.CALM]
    return bool(filled) and sum(is_number(cell) for cell in filled) >= _POINTS * len(filled)


def _compass(cells: Sequence[str]) -> str | None:
    """Names the unit of the compass points in a column's cells; `None` for none, "?" where
    languages differ."""
    filled = {cell.upper() for cell in cells if not is_missing(cell)}
    tables: Mapping[str, Mapping[str, float]] = compass.BY_UNIT
    fitting = [
        name for name, points in tables.items() if filled and filled <= {*points, *compass.CALM}
    ]
    if not fitting or not any(cell.isalpha() for cell in filled):
        return None
    first = tables[fitting[0]]
    same = all(tables[name].get(cell) == first.get(cell) for name in fitting for cell in filled)
    return fitting[0] if same else "?"
