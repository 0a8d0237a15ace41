"""Cells of a delimited log, by a recipe, into a `Reading`: what the formats with rows and columns
share."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from flagdata.core import compass
from flagdata.core.arrays import BoolArray, FloatArray, IntArray, UInt8Array
from flagdata.core.findings import Finding, Severity
from flagdata.core.schema import CHANNELS, SampleFlag
from flagdata.core.units import unit
from flagdata.errors import InputError, NothingMeasuredError, UnknownNameError
from flagdata.ingest.anemometer.instants import dates, zones
from flagdata.ingest.anemometer.instants.stamp_text import YEARS
from flagdata.ingest.anemometer.log_reading import WIND_CHANNELS, Reading
from flagdata.ingest.anemometer.samples import rules
from flagdata.ingest.anemometer.sensor_recipe import ChannelLayout, CheckLayout, Recipe
from flagdata.ingest.anemometer.table.rowclock import Block, Order, RowClock, StatedTime, cells_of
from flagdata.ingest.anemometer.text.columns import Columns
from flagdata.ingest.anemometer.text.text_cells import Cell, Growing, numbers

_LISTED = 12
"""Names of sites that an error lists."""
_ROUND = 1e-6
"""rad, by which an angle is off after its conversion."""
_SPEEDS = ("wind_speed", "apparent_wind_speed", "theoretical_wind_speed")
"""Channels in which a word for calm air, or "<0.3", is a speed."""
_DIRECTIONS = frozenset(
    name for name in CHANNELS if name.endswith(("wind_direction", "wind_direction_magnetic"))
)


class Rows(Protocol):
    """Where the cells come from; `shift` is the index of the column that recipes call 1."""

    header: list[str] | None
    shift: int
    first_line: int

    def blocks(self, width: int) -> Iterator[tuple[IntArray, Block]]: ...

    def findings(self) -> tuple[Finding, ...]: ...


@dataclass(frozen=True, kw_only=True)
class Table:
    """A log read by a recipe.

    Attributes:
        reading: its channels.
        extra: (n,) float64 of the columns asked for beside the channels, as written.
    """

    reading: Reading
    extra: Mapping[str, FloatArray]


@dataclass
class _Column:
    """One column as its blocks come in."""

    index: int
    suffix: str = ""
    points: Mapping[str, float] | None = None
    calm: Collection[str] = ()
    absent: Sequence[str] = ()
    limit: float = 0.0
    values: Growing[np.float64] = field(default_factory=lambda: Growing(np.float64))
    states: Growing[np.uint8] = field(default_factory=lambda: Growing(np.uint8))

    def value(self, order: Order) -> FloatArray:
        """Returns all values in order and releases them, so that a long log is not held twice."""
        values, self.values = self.values.view()[order], Growing(np.float64)
        return values

    def state(self, order: Order) -> UInt8Array:
        """Returns all states in order and releases them."""
        states, self.states = self.states.view()[order], Growing(np.uint8)
        return states


@dataclass
class _Check:
    """Whether the cells of one column are among the right ones, as the blocks come in."""

    layout: CheckLayout
    index: int
    right: list[BoolArray] = field(default_factory=list)

    def faults(self, order: Order, line: IntArray) -> tuple[BoolArray, tuple[Finding, ...]]:
        fault = ~np.concatenate(self.right)[order]
        if not fault.any():
            return fault, ()
        count, values = int(fault.sum()), ", ".join(self.layout.values)
        message = f"{count} rows whose {self.layout.about} is not {values}; left out of averages"
        where = f"line {line[fault][0]}"
        return fault, (Finding.of("sensor-fault", message, count=count, where=where),)


@dataclass
class _Gathered:
    """All cells wanted, as the blocks come in."""

    clock: RowClock
    host: RowClock | None
    channels: dict[str, _Column]
    extra: dict[str, _Column]
    checks: list[_Check]
    rows: int | None = None
    lines: Growing[np.int64] = field(default_factory=lambda: Growing(np.int64))
    bad_stamps: list[int] = field(default_factory=list)
    distant: int = 0
    blank: list[int] = field(default_factory=list)
    sites: set[str] = field(default_factory=set)
    """What the column of the sites says in blocks that have no row of the one wanted."""

    def columns(self) -> list[_Column]:
        return [*self.channels.values(), *self.extra.values()]

    def width(self) -> int:
        """Cells a row must have."""
        only = [] if self.rows is None else [self.rows]
        return 1 + max(
            [
                *only,
                *self.clock.columns,
                *(column.index for column in [*self.columns(), *self.checks]),
            ]
        )

    def add(self, line: IntArray, block: Block, recipe: Recipe) -> None:
        if self.rows is not None and recipe.rows is not None:
            wanted = _among(block, self.rows, (recipe.rows.value,))
            if not wanted.any():
                self.sites.update(map(str.strip, map(str, cells_of(block, self.rows))))
                return
            line, block = line[wanted], _where(block, wanted)
        stamps = self.clock.parse(block)
        keep = stamps.valid
        if self.host is not None:
            host = self.host.parse(block)
            keep = keep & host.valid
            self.host.add(host, keep)
        self.clock.add(stamps, keep)
        self.bad_stamps.extend(line[~keep].tolist())
        self.distant += int(stamps.distant.sum())
        empty = [_among(block, index, ("",)) for index in self.clock.columns]
        self.blank.extend(line[~keep & np.logical_and.reduce(empty)].tolist())
        self.lines.add(line[keep])
        for column in self.columns():
            cells = cells_of(block, column.index)
            cells = (
                _in_degrees(cells, recipe.file.decimal, column.points)
                if column.points is not None
                else cells
            )
            parsed = numbers(
                cells,
                decimal=recipe.file.decimal,
                missing=(*recipe.file.missing, *column.absent),
                suffix=column.suffix,
                zeros=column.calm,
                below=bool(column.calm),
            )
            column.limit = max(column.limit, parsed.limit)
            column.values.add(parsed.value[keep])
            column.states.add(parsed.state[keep])
        for check in self.checks:
            right = _among(block, check.index, check.layout.values)
            check.right.append(right[keep])

    def line(self) -> IntArray:
        return self.lines.view()


def _still(states: Mapping[str, UInt8Array]) -> dict[str, BoolArray]:
    """Finds where a word for calm air stands in a speed: the speed's name and those of its
    directions → (n,) rows.

    WMO-No. 8 (part I, chapter 5) and WMO-No. 306 (FM 15, 00000KT): calm air has speed 0 and no
    direction.
    """
    calm = {
        name: state == Cell.CALM for name, state in states.items() if (state == Cell.CALM).any()
    }
    return {
        channel: is_calm
        for name, is_calm in calm.items()
        for channel in (
            name,
            *(angle for angle in states if angle.startswith(name.replace("speed", "direction"))),
        )
    }


def _in_degrees(
    cells: Sequence[str] | pa.StringArray, decimal: str, points: Mapping[str, float]
) -> list[str]:
    """Points of the compass as degrees; calm air and what else is no point have no direction."""
    texts: list[str] = [str(text) for text in cells]
    degrees = (points.get(text.strip().upper()) for text in texts)
    return ["" if value is None else f"{value:g}".replace(".", decimal) for value in degrees]


def _where(block: Block, wanted: BoolArray) -> Block:
    """Selects the rows of a block that are wanted (n,)."""
    if isinstance(block, Columns):
        return block.where(wanted)
    return [row for row, is_wanted in zip(block, wanted.tolist(), strict=True) if is_wanted]


def _among(block: Block, index: int, values: Sequence[str]) -> BoolArray:
    """Checks (n,) whether the trimmed cells of a column are among `values`."""
    if isinstance(block, Columns):
        return block.among(index, values)
    return np.array([row[index].strip() in values for row in block], dtype=bool)


def read_table(
    rows: Rows,
    recipe: Recipe,
    *,
    where: str,
    zone_name: str | None,
    extra: Sequence[str] = (),
    stamp_options: StatedTime | None = None,
) -> Table:
    """Read cells by a recipe.

    Args:
        rows: the file's rows.
        where: the file, for messages.
        zone_name: of wall-clock stamps; goes before the recipe's.
        extra: further columns to read, by name.
        stamp_options: what the user says about stamps that are no dates.

    Raises:
        UsageError: a start or date for stamps that have one.
        InputError: no such columns, or hardly a row that can be read.
        TimeError: stamps without a zone, or impossible ones.
    """
    time_columns = [_index(column, rows, where) for column in recipe.time.columns]
    host = RowClock(form=recipe.file.host, columns=[0]) if recipe.file.host else None
    gathered = _Gathered(
        clock=RowClock(form=recipe.time.format, columns=time_columns)
        if time_columns or host is None
        else host,
        host=host if time_columns else None,
        channels={
            name: _channel_column(name, i, recipe.channels[name])
            for name, i in _channel_columns(recipe, rows, where).items()
        },
        extra={name: _Column(index=_index(name, rows, where)) for name in extra},
        checks=[
            _Check(layout=check, index=_index(check.column, rows, where))
            for check in recipe.checks
            if not check.optional or _is_there(check.column, rows)
        ],
        rows=None if recipe.rows is None else _index(recipe.rows.column, rows, where),
    )
    for line, block in rows.blocks(gathered.width()):
        gathered.add(line, block, recipe)
    pa.default_memory_pool().release_unused()  # the text of the last blocks
    findings = [*rows.findings(), *_stamp_findings(gathered, rows, recipe, where)]
    stamp_options = stamp_options or StatedTime()
    order, new_findings = gathered.clock.order(gathered.line(), stamp_options.clock)
    line = gathered.line()[order]
    findings.extend(new_findings)
    if zone_name is not None and gathered.host is None and gathered.clock.needs_no_zone():
        counts = dates.is_elapsed(gathered.clock.form)
        why = (
            "the stamps count from a start, which has a zone of its own"
            if counts
            else "the stamps state their own zone"
        )
        text = f"{why}: {zone_name} is not used"
        findings.append(Finding.of("zone-not-needed", text))
        zone_name = None
    zone_given, zone_name = zone_name, zone_name or recipe.time.zone
    time, new_findings = gathered.clock.instants(
        order, line=line, zone_name=zone_name, where=where, stamp_options=stamp_options
    )
    findings.extend(new_findings)
    if zone_given is not None and recipe.time.zone is not None:
        findings.extend(
            zones.contradiction(
                "the heading, or the recipe, says", recipe.time.zone, zone_given, time
            )
        )
    host_time = None
    if gathered.host is not None:
        host_time, _ = gathered.host.instants(
            order, line=line, zone_name=zone_name, where=where, stamp_options=StatedTime()
        )
    channels: dict[str, FloatArray] = {}
    flags = np.zeros(len(line), dtype=np.uint16)
    states = {name: column.state(order) for name, column in gathered.channels.items()}
    sensor, still = recipe.sensor, _still(states)
    for name, column in gathered.channels.items():
        layout, state = recipe.channels[name], states.pop(name)
        unreadable = int((state == Cell.UNREADABLE).sum())
        refuse_if_most(unreadable, len(line) - unreadable, f"unreadable values of {name}", where)
        cells = column.value(order)  # NaN where a cell is no number
        if name in still and name in _SPEEDS:
            message = "cells of {name} are words for calm air: read as 0 m/s, without a direction"
            findings.append(
                _of_cells("calm-in-words", Severity.NOTE, name, still[name], line, message)
            )
        elif name in still:
            state, cells = (
                np.where(still[name], np.uint8(Cell.CALM), state),
                np.where(still[name], np.nan, cells),
            )
        value = in_si(cells, layout)
        if column.limit:
            limit = float(in_si(np.array([column.limit]), layout)[0])
            message = (
                f"cells of {{name}} say no more than that it was below {limit:.3g} m/s: read as 0"
            )
            below = _of_cells(
                "below-threshold", Severity.WARNING, name, state == Cell.BELOW, line, message
            )
            findings.append(replace(below, value=limit))
            # averages over the ground truth's window know by the threshold what a 0 may hide
            sensor = sensor if sensor.threshold is not None else replace(sensor, threshold=limit)
        channel_flags, new_findings = cell_flags(name, layout, value, state, line)
        findings.extend(new_findings)
        if CHANNELS[name].unit == "rad" and CHANNELS[name].frame.startswith("from"):
            value, new_findings = rules.direction(
                name, value, line, offset=unit(layout.unit).scale * layout.offset
            )
            findings.extend(new_findings)
            zero, north = value == 0, np.abs(value - 2 * np.pi) < _ROUND
            if zero.any() and north.any():
                message = (
                    f"values of {{name}} are 0, and {int(north.sum())} are 360: where 360 is "
                    "north, 0 may be calm air"
                )
                findings.append(
                    _of_cells("zero-beside-360", Severity.WARNING, name, zero, line, message)
                )
            value = turn_angles(value, layout)
        channels[name] = value
        if name in WIND_CHANNELS:
            flags |= channel_flags
    for check in gathered.checks:
        fault, new_findings = check.faults(order, line)
        flags[fault] |= SampleFlag.SENSOR_FAULT
        findings.extend(new_findings)
    reading = Reading(
        time=time,
        channels=channels,
        flags=flags,
        line=line,
        sensor=sensor,
        step=gathered.clock.step,
        rules=recipe.quality,
        host_time=host_time,
        findings=tuple(findings),
    )
    return Table(
        reading=reading,
        extra={name: column.value(order) for name, column in gathered.extra.items()},
    )


def _list_first(names: Collection[str]) -> str:
    """Lists the first of the names, and how many more there are."""
    first_names = [repr(name) for name in sorted(names)[:_LISTED]]
    return " or ".join(first_names) + (
        f", or one of {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    )


def _stamp_findings(
    gathered: _Gathered, rows: Rows, recipe: Recipe, where: str
) -> tuple[Finding, ...]:
    """Rows left out for their stamps.

    Raises:
        InputError: all or most of them.
    """
    bad, form, distant = gathered.bad_stamps, gathered.clock.form, gathered.distant
    count = len(gathered.line())
    years = f"outside the accepted years, {YEARS[0]} to {YEARS[1]}"
    distance_note = f"; {distant} of them are {years}: a clock that was not set" if distant else ""
    if count == 0 and not bad and recipe.rows is not None:
        raise InputError(
            f"there is no row with {recipe.rows.value!r} in column {recipe.rows.column!r}, which "
            "names the site",
            where=where,
            fix=f"name a site as the file writes it: {_list_first(gathered.sites)}",
        )
    if count == 0:
        refused = (
            InputError if recipe.rows is None else NothingMeasuredError
        )  # of several sites the others are read
        raise refused(
            f"no row with a readable time stamp{distance_note}",
            where=f"{where}, line {bad[0] if bad else rows.first_line}",
            fix=f"stamps are expected as {form}; check the recipe, or that the logger recorded "
            "anything",
        )
    if not bad:
        return ()
    blank = sum(number < gathered.line()[0] for number in gathered.blank)
    refuse_if_most(len(bad) - blank, count, f"rows without a stamp as {form}", where)
    unset = f"{blank} rows before the first stamp have none: the clock was not set; left out"
    return (
        Finding.of(
            "unreadable-stamps",
            f"{len(bad)} rows whose stamp is {years}: a clock that was not set; left out"
            if distant == len(bad)
            else unset
            if blank == len(bad)
            else f"{len(bad)} rows whose stamp is not {form} or no date; left out{distance_note}",
            count=len(bad),
            where=f"line {bad[0]}",
        ),
    )


def _channel_columns(recipe: Recipe, rows: Rows, where: str) -> dict[str, int]:
    absent = set(rows.header).isdisjoint if rows.header is not None else None
    columns: dict[str, int] = {}
    for name, layout in recipe.channels.items():
        if (
            layout.optional
            and isinstance(layout.column, str)
            and absent is not None
            and absent([layout.column])
        ):
            continue
        columns[name] = _index(layout.column, rows, where)
    return columns


def _channel_column(name: str, index: int, layout: ChannelLayout) -> _Column:
    return _Column(
        index=index,
        suffix=layout.suffix,
        points=compass.BY_UNIT.get(layout.unit),
        calm=compass.STILL if name in _SPEEDS else (),
        absent=tuple(compass.CALM) if name in _DIRECTIONS else (),
    )


def _is_there(column: str | int, rows: Rows) -> bool:
    header = rows.header
    if isinstance(column, int):
        return header is None or column <= len(header)
    return column in (header or ())


def _index(column: str | int, rows: Rows, where: str) -> int:
    header = rows.header
    if isinstance(column, int):
        if header is not None and column > len(header):
            raise InputError(
                f"there is no column {column}, only {len(header)}",
                where=where,
                fix="correct the recipe",
            )
        return column - 1 + rows.shift
    names = list(header or ())
    if column not in names:
        fix = UnknownNameError.of("column", column, names).fix
        raise InputError(f"the header has no column {column!r}", where=where, fix=fix)
    if names.count(column) > 1:
        raise InputError(
            f"{names.count(column)} columns are called {column!r}",
            where=where,
            fix="give the column's number instead",
        )
    return names.index(column)


def _of_cells(
    kind: str, severity: Severity, name: str, affected: BoolArray, line: IntArray, text: str
) -> Finding:
    """Reports cells of a channel in the rows `affected` (n,)."""
    count = int(affected.sum())
    return Finding(
        kind=kind,
        severity=severity,
        count=count,
        where=f"line {line[affected][0]}",
        what=f"{count} {text.format(name=name)}",
    )


def in_si(value: FloatArray, layout: ChannelLayout) -> FloatArray:
    """Cells of a column in SI, by the recipe's calibration; directions still as the vane gives
    them."""
    if layout.gain != 1.0 or layout.offset != 0.0:
        value = value * layout.gain + layout.offset
    si_unit = unit(layout.unit)
    return value if si_unit.scale == 1.0 and si_unit.offset == 0.0 else si_unit.to_si(value)


def turn_angles(angle: FloatArray, layout: ChannelLayout) -> FloatArray:
    """Turns a vane's angles [rad] to 'from', clockwise, 0 to 2π."""
    mounted = unit(layout.unit).to_si(layout.rotation) + (
        np.pi if layout.convention == "to" else 0.0
    )
    return np.mod(angle + mounted, 2 * np.pi)


def cell_flags(
    name: str, layout: ChannelLayout, value: FloatArray, state: UInt8Array, line: IntArray
) -> tuple[NDArray[np.uint16], tuple[Finding, ...]]:
    """Flags and findings about single cells: missing, unreadable, infinite, outside the
    instrument's range."""
    flags = np.zeros(len(value), dtype=np.uint16)
    findings: list[Finding] = []

    def note(mask: BoolArray, flag: SampleFlag, kind: str, severity: Severity, text: str) -> None:
        if mask.any():
            flags[mask] |= flag
            findings.append(_of_cells(kind, severity, name, mask, line, f"{text} of {{name}}"))

    note(
        state == Cell.MISSING,
        SampleFlag.MISSING,
        "missing-values",
        Severity.WARNING,
        "missing values",
    )
    note(
        state == Cell.UNREADABLE,
        SampleFlag.MISSING,
        "unreadable-values",
        Severity.ERROR,
        "unreadable values",
    )
    note(
        state == Cell.INFINITE,
        SampleFlag.OUT_OF_RANGE,
        "out-of-range",
        Severity.WARNING,
        "infinite values",
    )
    if layout.range is not None:
        low, high = (float(unit(layout.unit).to_si(bound)) for bound in layout.range)
        text = f"values outside {layout.range[0]:g} to {layout.range[1]:g} {layout.unit}"
        note(
            (value < low) | (value > high),
            SampleFlag.OUT_OF_RANGE,
            "out-of-range",
            Severity.WARNING,
            text,
        )
    return flags, tuple(findings)


def refuse_if_most(bad: int, good: int, text: str, where: str) -> None:
    """Refuse a file of which less than half can be read: it is of another format.

    Raises:
        InputError: with both counts.
    """
    if bad > good or (bad and bad == good and good > 1):
        raise InputError(
            f"{bad} of {bad + good} are {text}",
            where=where,
            fix="look at it with flagdata ingest --sniff",
        )
