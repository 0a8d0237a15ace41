"""Delimited text by a sensor recipe: the format "delimited", and the table reading that other formats build on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError, TimeError, UnknownNameError, UsageError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer import recipe as recipes
from flagdata.ingest.anemometer.cells import Cell, numbers
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import WIND_CHANNELS, Reading
from flagdata.ingest.anemometer.recipe import ChannelLayout, Recipe
from flagdata.ingest.anemometer.rows import RowReader
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.source import TextFile
from flagdata.ingest.anemometer.stamps import Stamps
from flagdata.ingest.anemometer.stamps import parse as parse_stamps
from flagdata.ingest.anemometer.wall import to_utc
from flagdata.schema import CHANNELS, SampleFlag
from flagdata.signals import Instants
from flagdata.timebase import zone
from flagdata.units import unit


class Delimited:
    """Format "delimited": a recipe of catalogs/sensors, or the user's own TOML file."""

    name = "delimited"
    about = "delimited text described by a sensor recipe"
    uses = frozenset({"zone", "encoding", "zero_offset", "azimuth"})

    def recognise(self, head: Head) -> Guess | None:
        """The recipe whose columns the header names, if one does; the one with most columns in common."""
        best: Guess | None = None
        for name in recipes.names():
            guess = _match(recipes.load(name), name, head)
            if guess and (best is None or guess.score > best.score):
                best = guess
        return best

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read a file by the recipe in `options`."""
        if options.recipe is None:
            raise UsageError("the format delimited needs a recipe", where=str(source.path), fix="name one by --recipe")
        recipe = recipes.load(options.recipe)
        if recipe.file.host:
            raise UsageError(
                f"the recipe {recipe.name} is for host-stamped lines", where=str(source.path), fix="use that format"
            )
        return read_table(source, recipe, RowReader(source, recipe.file), zone_name=options.zone).reading


def _match(recipe: Recipe, name: str, head: Head) -> Guess | None:
    layout = recipe.file
    if layout.host or layout.header == 0 or len(head.lines) <= layout.preamble:
        return None
    line = head.lines[layout.preamble]
    cells = [
        cell.strip().strip('"') for cell in (line.split() if layout.delimiter == " " else line.split(layout.delimiter))
    ]
    needed = [c.column for c in recipe.channels.values() if not c.optional] + list(recipe.time.columns)
    if not all(column in cells for column in needed):
        return None
    found = [c.column for c in recipe.channels.values() if c.column in cells]
    return Guess(
        format="delimited",
        recipe=name,
        score=min(0.95, 0.6 + 0.05 * (len(found) + len(recipe.time.columns))),
        reasons=(f"line {layout.preamble + 1} names the columns of recipe {name}: {', '.join(map(str, needed))}",),
    )


class Rows(Protocol):
    """Where the cells come from; `shift` is the index of the column that recipes call 1."""

    header: list[str] | None
    shift: int
    first_line: int

    def blocks(self, width: int) -> Iterator[tuple[NDArray[np.int64], list[list[str]]]]: ...

    def findings(self) -> tuple[Finding, ...]: ...


@dataclass(frozen=True, kw_only=True)
class Table:
    """A log read by a recipe.

    Attributes:
        reading: its channels.
        extra: (n,) float64 of the columns asked for beside the channels, as written.
    """

    reading: Reading
    extra: Mapping[str, NDArray[np.float64]]


@dataclass
class _Column:
    """One column as its blocks come in."""

    index: int
    values: list[NDArray[np.float64]] = field(default_factory=list)
    states: list[NDArray[np.uint8]] = field(default_factory=list)

    def value(self) -> NDArray[np.float64]:
        return np.concatenate(self.values)

    def state(self) -> NDArray[np.uint8]:
        return np.concatenate(self.states)


@dataclass
class _Clock:
    """One clock's stamps as their blocks come in."""

    form: str
    step: int = 2**62
    ns: list[NDArray[np.int64]] = field(default_factory=list)
    utc: list[NDArray[np.bool_]] = field(default_factory=list)

    def add(self, stamps: Stamps, keep: NDArray[np.bool_]) -> None:
        self.ns.append(stamps.ns[keep])
        self.utc.append(stamps.utc[keep])
        self.step = min(self.step, stamps.step)

    def instants(
        self, line: NDArray[np.int64], zone_name: str | None, where: str
    ) -> tuple[Instants, tuple[Finding, ...]]:
        return instants(np.concatenate(self.ns), np.concatenate(self.utc), line=line, zone_name=zone_name, where=where)


def read_table(
    source: TextFile, recipe: Recipe, rows: Rows, *, zone_name: str | None, extra: Sequence[str] = ()
) -> Table:
    """Read cells by a recipe.

    Args:
        rows: the file's rows.
        zone_name: of wall-clock stamps; goes before the recipe's.
        extra: further columns to read, by name.

    Raises:
        InputError: no such columns, or hardly a row that can be read.
        TimeError: stamps without a zone, or impossible ones.
    """
    where = str(source.path)
    columns = {name: _Column(index=i) for name, i in _channel_columns(recipe, rows, where).items()}
    others = {name: _Column(index=_index(name, rows, where)) for name in extra}
    stamp_index = [_index(column, rows, where) for column in recipe.time.columns]
    clock = _Clock(form=recipe.time.format)
    host = _Clock(form=recipe.file.host)
    if not stamp_index:
        clock, stamp_index = host, [0]
    lines: list[NDArray[np.int64]] = []
    bad_stamps: list[int] = []
    width = 1 + max([*stamp_index, *(column.index for column in [*columns.values(), *others.values()])])
    for block_lines, block in rows.blocks(width):
        stamps = parse_stamps([" ".join(row[i].strip() for i in stamp_index) for row in block], clock.form)
        keep = stamps.valid
        if recipe.file.host and clock is not host:
            host_stamps = parse_stamps([row[0] for row in block], host.form)
            keep = keep & host_stamps.valid
            host.add(host_stamps, keep)
        clock.add(stamps, keep)
        bad_stamps.extend(block_lines[~keep].tolist())
        lines.append(block_lines[keep])
        for column in [*columns.values(), *others.values()]:
            cells = [row[column.index] for row in block]
            parsed = numbers(cells, decimal=recipe.file.decimal, missing=recipe.file.missing)
            column.values.append(parsed.value[keep])
            column.states.append(parsed.state[keep])
    findings = list(rows.findings())
    line = np.concatenate(lines) if lines else np.zeros(0, dtype=np.int64)
    if len(line) == 0:
        raise InputError(
            "no row with a readable time stamp",
            where=f"{where}, line {bad_stamps[0] if bad_stamps else rows.first_line}",
            fix=f"stamps are expected as {clock.form}; check the recipe, or that the logger recorded anything",
        )
    if bad_stamps:
        refuse_if_most(len(bad_stamps), len(line), f"rows without a stamp as {clock.form}", where)
        findings.append(
            Finding(
                kind="unreadable-stamps", severity=Severity.ERROR, count=len(bad_stamps), where=f"line {bad_stamps[0]}",
                what=f"{len(bad_stamps)} rows whose stamp is not {clock.form} or no date; left out",
            )
        )  # fmt: skip
    zone_name = zone_name or recipe.time.zone
    time, found = clock.instants(line, zone_name, where)
    findings.extend(found)
    host_time = host.instants(line, zone_name, where)[0] if host.ns and clock is not host else None
    channels: dict[str, NDArray[np.float64]] = {}
    flags = np.zeros(len(line), dtype=np.uint16)
    for name, column in columns.items():
        layout = recipe.channels[name]
        state = column.state()
        unreadable = int((state == Cell.UNREADABLE).sum())
        refuse_if_most(unreadable, len(line) - unreadable, f"unreadable values of {name}", where)
        channels[name] = calibrated(column.value(), name, layout)
        channel_flags, found = cell_flags(name, layout, channels[name], state, line)
        findings.extend(found)
        if name in WIND_CHANNELS:
            flags |= channel_flags
    reading = Reading(
        time=time, channels=channels, flags=flags, line=line, sensor=recipe.sensor, step=clock.step,
        rules=recipe.quality, host_time=host_time, findings=tuple(findings),
    )  # fmt: skip
    return Table(reading=reading, extra={name: column.value() for name, column in others.items()})


def _channel_columns(recipe: Recipe, rows: Rows, where: str) -> dict[str, int]:
    absent = set(rows.header).isdisjoint if rows.header is not None else None
    found: dict[str, int] = {}
    for name, layout in recipe.channels.items():
        if layout.optional and isinstance(layout.column, str) and absent is not None and absent([layout.column]):
            continue
        found[name] = _index(layout.column, rows, where)
    return found


def _index(column: str | int, rows: Rows, where: str) -> int:
    header = rows.header
    if isinstance(column, int):
        if header is not None and column > len(header):
            raise InputError(f"no column {column}, only {len(header)}", where=where, fix="correct the recipe")
        return column - 1 + rows.shift
    names = list(header or ())
    if column not in names:
        fix = UnknownNameError.of("column", column, names).fix
        raise InputError(f"no column {column!r} in the header", where=where, fix=fix)
    return names.index(column)


def instants(
    wall: NDArray[np.int64], utc: NDArray[np.bool_], *, line: NDArray[np.int64], zone_name: str | None, where: str
) -> tuple[Instants, tuple[Finding, ...]]:
    """UTC nanoseconds of stamps, some of which may state their own zone.

    Raises:
        TimeError: stamps without a zone and none named, or impossible in it.
    """
    if utc.all():
        return wall, ()
    if zone_name is None:
        at = int(np.flatnonzero(~utc)[0])
        raise TimeError(
            "the stamps carry no time zone", where=f"{where}, line {line[at]}",
            fix="name the zone of the logger's clock, e.g. --zone Europe/Amsterdam or --zone +01:00",
        )  # fmt: skip
    time = wall.copy()
    rows = ~utc
    time[rows], found = to_utc(wall[rows], zone(zone_name), lines=line[rows], where=where)
    return time, found


def calibrated(value: NDArray[np.float64], name: str, layout: ChannelLayout) -> NDArray[np.float64]:
    """Cells of a column in SI, directions as 'from', clockwise, 0 to 2π."""
    converted = unit(layout.unit).to_si(value * layout.gain + layout.offset)
    if CHANNELS[name].unit != "rad" or not CHANNELS[name].frame.startswith("from"):
        return converted
    turned = converted + unit(layout.unit).to_si(layout.rotation) + (np.pi if layout.convention == "to" else 0.0)
    return np.mod(turned, 2 * np.pi)


def cell_flags(
    name: str, layout: ChannelLayout, value: NDArray[np.float64], state: NDArray[np.uint8], line: NDArray[np.int64]
) -> tuple[NDArray[np.uint16], tuple[Finding, ...]]:
    """Flags and findings about single cells: missing, unreadable, infinite, outside the instrument's range."""
    flags = np.zeros(len(value), dtype=np.uint16)
    found: list[Finding] = []

    def note(mask: NDArray[np.bool_], flag: SampleFlag, kind: str, severity: Severity, what: str) -> None:
        if mask.any():
            flags[mask] |= flag
            count = int(mask.sum())
            found.append(
                Finding(
                    kind=kind, severity=severity, count=count, where=f"line {line[mask][0]}",
                    what=f"{count} {what} of {name}",
                )
            )  # fmt: skip

    note(state == Cell.MISSING, SampleFlag.MISSING, "missing-values", Severity.WARNING, "missing values")
    note(state == Cell.UNREADABLE, SampleFlag.MISSING, "unreadable-values", Severity.ERROR, "unreadable values")
    note(state == Cell.INFINITE, SampleFlag.OUT_OF_RANGE, "out-of-range", Severity.WARNING, "infinite values")
    if layout.range is not None:
        low, high = (float(unit(layout.unit).to_si(bound)) for bound in layout.range)
        text = f"values outside {layout.range[0]:g} to {layout.range[1]:g} {layout.unit}"
        note((value < low) | (value > high), SampleFlag.OUT_OF_RANGE, "out-of-range", Severity.WARNING, text)
    return flags, tuple(found)


def refuse_if_most(bad: int, good: int, what: str, where: str) -> None:
    """Refuse a file of which less than half can be read: it is of another format.

    Raises:
        InputError: with both counts.
    """
    if bad > good or (bad and bad == good and good > 1):
        raise InputError(
            f"{bad} of {bad + good} are {what}", where=where, fix="look at it with flagdata ingest --sniff"
        )
