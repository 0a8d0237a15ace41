"""Sensor recipes: a delimited log described in TOML, so that a new logger needs no code.

A recipe is parsed here and nowhere else; unknown keys are refused with the nearest known one.
Tables:

    name, about, source       what it is, and where its facts come from
    [file]                    delimiter, decimal, encoding, preamble, header, comment, missing, host
    [time]                    columns, format, zone
    [rows]                    column, value: only rows whose cell is this text are read
    [channels.<channel>]      column, unit, gain, offset, range, convention, rotation, optional,
                              suffix
    [sensor]                  name, height, distance-constant, averaging, threshold, resolution,
                              accuracy, accuracy-relative (all SI)
    [quality]                 zero-offset, stale-after, frame-rate-of, fault-where-zero
    [expect]                  confirmed: doubts about a draft that its user has answered (keys of
                              draft/doubts.py)
    [[check]]                 column, values, about, optional: cells that must be one of these
                              texts, else the row is a fault

A recipe may leave open what the heading of the file states: see `OpenRecipe`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, TypeAlias

from msgspec import Meta

from flagdata.core.schema import CHANNELS
from flagdata.core.units import unit
from flagdata.errors import FlagdataError, InputError, UnknownNameError, UsageError
from flagdata.ingest.anemometer.instants import dates
from flagdata.ingest.anemometer.instants.stamp_text import EPOCH, pattern
from flagdata.ingest.anemometer.wind_options import ZeroOffset, check_zero_offset
from flagdata.recipes import typed_tables
from flagdata.recipes.shelves import Shelf, parse_recipe
from flagdata.recipes.typed_tables import Named, Spelled
from flagdata.record.signals import Sensor
from flagdata.timebase import zone

SENSORS = Shelf(folder="sensors", noun="sensor recipe")

DELIMITERS: Mapping[str, str] = {",": ",", ";": ";", "tab": "\t", "|": "|", "space": " "}
COLUMNS_LIMIT = 10_000
"""Highest number of a column."""
Column: TypeAlias = str | Annotated[int, Meta(ge=1, le=COLUMNS_LIMIT)]
ChannelName: TypeAlias = Annotated[str, Named("channel", CHANNELS)]
MISSING = (
    "",
    "nan",
    "na",
    "n/a",
    "n.a.",
    "#n/a",
    "#value!",
    "null",
    "none",
    "m",
    "mm",
    "missing",
    "no data",
)
"""Spellings of "no value" that every recipe knows, lower-case."""
MISSING_SIGNS = r"^[-–—_./*#]+$"
"""Cells of signs alone ("----", "--.-", "/////", "***") are no value either."""


@dataclass(frozen=True, kw_only=True)
class FileLayout:
    """How the text is cut into cells.

    Attributes:
        delimiter: between cells; " " stands for any run of blanks.
        decimal: "." or ",".
        encoding: Python codec name, `None` to decide by the bytes.
        preamble: lines before the header.
        header: header lines; the first names the columns, further ones (units) are skipped. 0:
            columns have no names.
        comment: lines that start with it are skipped; "" for none.
        missing: further spellings of "no value"; those that are numbers are compared as numbers.
        host: format of the stamp that the logging computer wrote before each raw line (see
            `TimeLayout.format`), "" for none. Columns are then numbered within the raw line.
    """

    delimiter: str = ","
    decimal: Literal[".", ","] = "."
    encoding: str | None = None
    preamble: int = 0
    header: int = 1
    comment: str = ""
    missing: Spelled = ()
    host: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "delimiter", DELIMITERS.get(self.delimiter or ",", self.delimiter))
        object.__setattr__(self, "missing", tuple(code.lower() for code in self.missing))
        if self.host and (self.preamble or self.comment or self.delimiter == " "):
            raise UsageError(
                "a host stamp goes with neither preamble, comment nor blanks",
                where="[file] host",
                fix="leave those keys out",
            )
        if self.host and self.host not in EPOCH:
            pattern(self.host)
        if self.delimiter not in DELIMITERS.values():
            raise UnknownNameError.of(
                "delimiter", self.delimiter, DELIMITERS, where="[file] delimiter"
            )
        if self.decimal == self.delimiter:
            raise UsageError(
                "the decimal mark is also the delimiter",
                where="[file]",
                fix="correct one of the two",
            )
        if not 0 <= self.preamble <= 1000 or not 0 <= self.header <= 10:
            raise UsageError(
                "preamble beyond 1000 or header beyond 10 lines",
                where="[file]",
                fix="count the lines",
            )


@dataclass(frozen=True, kw_only=True)
class TimeLayout:
    """How a row says when it was.

    Attributes:
        columns: names or numbers (from 1) of the columns that are joined with a blank; none where
            the host's stamp is all there is.
        format: "iso", "epoch-s", "epoch-ms", strptime directives or a count (see
            instants/stamps.py).
        zone: of wall-clock stamps; `None` leaves it to the user.
    """

    columns: tuple[Column, ...] = ()
    format: str
    zone: str | None = None

    def __post_init__(self) -> None:
        if self.columns:
            dates.check(self.format)
        if self.zone is not None:
            zone(self.zone, where="[time] zone")


@dataclass(frozen=True, kw_only=True)
class ChannelLayout:
    """One measured column; `value = unit.to_si(cell * gain + offset)`.

    Attributes:
        column: name or number (from 1) of the column.
        unit: as `flagdata.core.units` spells it.
        gain, offset: of the cell, in the file's unit.
        range: smallest and largest value the instrument can give, in the file's unit, after gain
            and offset.
        convention: of a direction: the wind blows "from" it or "to" it.
        rotation: added to a direction [deg in the file's sense, clockwise].
        optional: whether files without the column are read all the same.
        suffix: text behind every number of the column, such as its unit; numbers with another are
            unreadable.
    """

    column: Column
    unit: str
    gain: float = 1.0
    offset: float = 0.0
    range: tuple[float, float] | None = None
    convention: Literal["from", "to"] = "from"
    rotation: float = 0.0
    optional: bool = False
    suffix: str = ""

    def __post_init__(self) -> None:
        unit(self.unit, where=f"unit of column {self.column}")
        if self.gain == 0:
            raise UsageError(
                "the gain is 0",
                where=f"column {self.column}",
                fix="give the factor of the calibration",
            )
        if self.range is not None and not self.range[0] < self.range[1]:
            raise UsageError(
                "the range is empty", where=f"column {self.column}", fix="give [lowest, highest]"
            )


@dataclass(frozen=True, kw_only=True)
class RowsLayout:
    """Which rows are read: those whose cell in `column` (name, or number from 1) is `value`.

    For tables that list several sites or sensors one below the other.
    """

    column: Column
    value: str


@dataclass(frozen=True, kw_only=True)
class CheckLayout:
    """A column of text, such as a status or a unit, that says whether a row can be trusted.

    Attributes:
        column: name or number (from 1) of the column.
        values: texts of a row that is right; any other makes it a SENSOR_FAULT.
        about: what the column is ("status", "unit").
        optional: files without the column are read all the same, unchecked.
    """

    column: Column
    values: Spelled
    about: str
    optional: bool = False

    def __post_init__(self) -> None:
        if not self.values:
            raise UsageError(
                "a check without values",
                where=f"column {self.column}",
                fix="list the texts that are right",
            )


@dataclass(frozen=True, kw_only=True)
class QualityRules:
    """What is known about the instrument's errors.

    Attributes:
        zero_offset: see options.ZeroOffset.
        stale_after: repeats longer than this [s] are stale; `None` derives it from the readings
            themselves.
        frame_rate_of: channels that are frequencies found in frames, one a row: checked against the
            Nyquist limit.
        fault_where_zero: channels that are exactly 0 when the instrument saw nothing: such rows are
            SENSOR_FAULT.
    """

    zero_offset: ZeroOffset = "report"
    stale_after: float | None = None
    frame_rate_of: tuple[ChannelName, ...] = ()
    fault_where_zero: tuple[ChannelName, ...] = ()

    def __post_init__(self) -> None:
        check_zero_offset(self.zero_offset, where="[quality] zero-offset")
        if self.stale_after is not None and self.stale_after <= 0:
            raise UsageError(
                "stale-after is not positive",
                where="[quality] stale-after",
                fix="give seconds above 0",
            )


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """A log format and its instrument, see the module's text."""

    name: str
    about: str
    source: str
    file: FileLayout
    time: TimeLayout
    channels: Mapping[str, ChannelLayout]
    sensor: Sensor
    quality: QualityRules = field(default_factory=QualityRules)
    checks: tuple[CheckLayout, ...] = ()
    rows: RowsLayout | None = None
    expect: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if not self.time.columns and not self.file.host:
            raise UsageError(
                "there is no time column",
                where="[time] columns",
                fix="name the column of the stamps",
            )
        if not self.channels:
            raise UsageError(
                "there are no channels", where=self.name, fix="add a table [channels.wind_speed]"
            )
        for name, layout in self.channels.items():
            if name not in CHANNELS:
                raise UnknownNameError.of("channel", name, CHANNELS, where=self.name)
            if unit(layout.unit).si != CHANNELS[name].unit:
                raise UsageError(
                    f"channel {name} is measured in {CHANNELS[name].unit}, not in {layout.unit}",
                    where=self.name,
                    fix="correct the unit or the channel",
                )
        columns_used = [c.column for c in (*self.channels.values(), *self.checks)] + list(
            self.time.columns
        )
        columns_used += [self.rows.column] if self.rows is not None else []
        if (self.file.header == 0 or self.file.host) and any(
            isinstance(column, str) for column in columns_used
        ):
            raise UsageError(
                "columns by name where no header names them",
                where=self.name,
                fix="give their numbers",
            )


@dataclass(frozen=True, kw_only=True)
class _Expect:
    confirmed: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class _SensorTables:
    """The tables of a complete recipe."""

    name: str
    about: str
    source: str
    file: FileLayout
    time: TimeLayout
    rows: RowsLayout | None = None
    channels: Mapping[str, ChannelLayout]
    sensor: Sensor
    quality: QualityRules
    check: tuple[CheckLayout, ...] = ()
    expect: _Expect


MATCH = "header first-line within mark cell units groups stacked row averaged starts"
"""Keys of [match], by which the heading of a file is found.

    header          names, each of which is a cell of the heading; within: lines in which the
                    heading is looked for
    first-line      a pattern at the beginning of the file; mark: one in the heading or above it;
                    row: of the first row
    cell            a pattern of a cell of the heading, with groups "name" and "unit"
    units           whether the line below the heading holds units
    groups          whether the line above the heading holds what goes before the names; stacked:
                    their first words
    averaged        whether a row is the average over the distance of the stamps (true)
    starts          a pattern above the heading by which stamps begin the average
"""


@dataclass(frozen=True, kw_only=True)
class OpenRecipe:
    """A recipe that the heading of a file completes (see formats/described.py).

    Attributes:
        name: of the recipe.
        file: what it says of the file itself.
        data: its tables.
    """

    name: str
    file: FileLayout
    data: Mapping[str, Any]


def load(recipe: str) -> Recipe | OpenRecipe:
    """Reads the recipe called `recipe`, or in the TOML file of that path.

    Raises:
        UnknownNameError: no such name, with the nearest.
        NotFoundError: no such file.
        InputError: not TOML; a key missing, unknown or of the wrong type.
    """
    file = SENSORS.find(recipe)
    data = parse_recipe(file.text, where=file.where)
    return (
        _open_recipe(data, where=file.where) if _is_open(data) else of_data(data, where=file.where)
    )


def parse(text: str, *, where: str) -> Recipe:
    """Reads the complete recipe written in `text`; raises as `of_data`, and InputError for what is
    not TOML."""
    return of_data(parse_recipe(text, where=where), where=where)


def parse_open(text: str, *, where: str) -> OpenRecipe:
    """Reads the open recipe written in `text`; raises as `parse`."""
    return _open_recipe(parse_recipe(text, where=where), where=where)


def of_data(data: Mapping[str, Any], *, where: str) -> Recipe:
    """Builds the recipe of these tables.

    Raises:
        InputError: a key missing or of the wrong type; values that do not fit together.
        UnknownNameError: a key, channel, unit or zone that is not known, with the nearest.
    """
    try:
        form = typed_tables.read(_SensorTables, data, where=where)
        return Recipe(
            name=form.name,
            about=form.about,
            source=form.source,
            file=form.file,
            time=form.time,
            channels=form.channels,
            sensor=form.sensor,
            quality=form.quality,
            rows=form.rows,
            expect=frozenset(form.expect.confirmed),
            checks=form.check,
        )
    except UnknownNameError as error:
        raise UnknownNameError(
            error.what, where=_inside(where, error.where), fix=error.fix
        ) from None
    except FlagdataError as error:
        raise InputError(error.what, where=_inside(where, error.where), fix=error.fix) from None


def _is_open(data: Mapping[str, Any]) -> bool:
    """Checks whether a recipe leaves something to the heading of a file."""
    channels, time = data.get("channels", {}), data.get("time", {})
    layouts = channels.values() if isinstance(channels, Mapping) else ()
    listed = any(
        isinstance(layout, Mapping)
        and (isinstance(layout.get("column"), list) or isinstance(layout.get("unit"), Mapping))
        for layout in layouts
    )
    return (
        listed
        or "match" in data
        or (isinstance(time, Mapping) and isinstance(time.get("format"), list))
    )


def _open_recipe(data: Mapping[str, Any], *, where: str) -> OpenRecipe:
    """Checks every key of an open recipe, as far as that is possible without a file, and returns
    the recipe."""
    typed_tables.entries(
        {"header": tuple[str, ...], **dict.fromkeys(MATCH.split()[1:], Any)},
        data.get("match", {}),
        where=f"{where} [match]",
    )
    channels: dict[str, Any] = {}
    for name, layout in _table(data, "channels", where).items():
        layout_keys = dict(layout) if isinstance(layout, Mapping) else {}
        names, units = layout_keys.get("column"), layout_keys.get("unit")
        if isinstance(names, list) and names and all(isinstance(name, str) for name in names):
            layout_keys["column"] = names[0]
        if isinstance(units, Mapping):
            inside = f"{where} [channels.{name}] unit"
            typed_tables.check_keys(units, ("in", "else", "whole"), where=inside)
            if units.get("in") != "heading":
                raise InputError(
                    "the unit is in no heading", where=inside, fix='write { in = "heading" }'
                )
            layout_keys["unit"] = CHANNELS[name].unit if name in CHANNELS else "m/s"
        channels[name] = layout_keys
    time, sensor = (_without_facts(_table(data, key, where)) for key in ("time", "sensor"))
    time["format"] = time["format"] if isinstance(time.get("format"), str) else "iso"
    closed = {key: data[key] for key in data.keys() - {"match", "facts", "described-by"}}
    checked = of_data({**closed, "channels": channels, "time": time, "sensor": sensor}, where=where)
    return OpenRecipe(name=checked.name, file=checked.file, data=data)


def _without_facts(table: Mapping[str, Any]) -> dict[str, Any]:
    """Removes the keys whose texts occur nowhere in the file; a name counts as it is."""
    return {
        key: value
        for key, value in table.items()
        if key == "name" or not (isinstance(value, str) and "{" in value)
    }


def _inside(file: str, key: str | None) -> str:
    return key if key is not None and key.startswith(file) else f"{file}: {key}" if key else file


def _table(data: Mapping[str, Any], key: str, where: str) -> Mapping[str, Any]:
    return typed_tables.value(Mapping[str, Any], data.get(key, {}), key=key, where=where)
