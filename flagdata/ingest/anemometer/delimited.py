"""Delimited text by a sensor recipe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

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
from flagdata.ingest.anemometer.stamps import parse as parse_stamps
from flagdata.ingest.anemometer.wall import to_utc
from flagdata.schema import CHANNELS, SampleFlag
from flagdata.timebase import zone
from flagdata.units import unit


@dataclass
class _Column:
    """One channel as its blocks come in."""

    layout: ChannelLayout
    index: int
    values: list[NDArray[np.float64]] = field(default_factory=list)
    states: list[NDArray[np.uint8]] = field(default_factory=list)
    decimals: int = 0


class Delimited:
    """Format "delimited": a recipe of catalogs/sensors, or the user's own TOML file."""

    name = "delimited"
    about = "delimited text described by a sensor recipe"
    uses = frozenset({"zone", "encoding", "zero_offset"})

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
        return read_by_recipe(source, recipes.load(options.recipe), options)


def _match(recipe: Recipe, name: str, head: Head) -> Guess | None:
    layout = recipe.file
    if layout.header == 0 or len(head.lines) <= layout.preamble:
        return None
    cells = [cell.strip().strip('"') for cell in _cut(head.lines[layout.preamble], layout.delimiter)]
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


def _cut(line: str, delimiter: str) -> list[str]:
    return line.split() if delimiter == " " else line.split(delimiter)


def read_by_recipe(source: TextFile, recipe: Recipe, options: WindOptions) -> Reading:
    """Read a delimited log.

    Raises:
        InputError: no such columns, or no row that can be read.
        TimeError: stamps without a zone, or impossible ones.
    """
    where = str(source.path)
    rows = RowReader(source, recipe.file)
    columns = _columns(recipe, rows.header, where)
    stamp_index = [_index(column, rows.header, where) for column in recipe.time.columns]
    walls: list[NDArray[np.int64]] = []
    utcs: list[NDArray[np.bool_]] = []
    lines: list[NDArray[np.int64]] = []
    bad_stamps: list[int] = []
    step = 2**62
    width = 1 + max([*stamp_index, *(column.index for column in columns.values())])
    for block_lines, block in rows.blocks(width):
        texts = [" ".join(row[i].strip() for i in stamp_index) for row in block]
        stamps = parse_stamps(texts, recipe.time.format)
        bad_stamps.extend(block_lines[~stamps.valid].tolist())
        walls.append(stamps.ns[stamps.valid])
        utcs.append(stamps.utc[stamps.valid])
        lines.append(block_lines[stamps.valid])
        step = min(step, stamps.step)
        for column in columns.values():
            cells = [row[column.index] for row in block]
            parsed = numbers(cells, decimal=recipe.file.decimal, missing=recipe.file.missing)
            column.values.append(parsed.value[stamps.valid])
            column.states.append(parsed.state[stamps.valid])
            column.decimals = max(column.decimals, parsed.decimals)
    findings = list(rows.findings())
    line = np.concatenate(lines) if lines else np.zeros(0, dtype=np.int64)
    if len(line) == 0:
        raise InputError(
            "no row with a readable time stamp",
            where=f"{where}, line {bad_stamps[0] if bad_stamps else rows.first_line}",
            fix=f"the recipe {recipe.name} expects stamps as {recipe.time.format}; check the recipe, or the file",
        )
    if bad_stamps:
        findings.append(
            Finding(
                kind="unreadable-stamps", severity=Severity.ERROR, count=len(bad_stamps), where=f"line {bad_stamps[0]}",
                what=f"{len(bad_stamps)} rows whose stamp is not {recipe.time.format}; left out",
            )
        )  # fmt: skip
        refuse_if_most(len(bad_stamps), len(line), f"rows without a stamp as {recipe.time.format}", where)
    wall, utc = np.concatenate(walls), np.concatenate(utcs)
    time, found = instants(wall, utc, line=line, zone_name=options.zone or recipe.time.zone, where=where)
    findings.extend(found)
    channels: dict[str, NDArray[np.float64]] = {}
    flags = np.zeros(len(line), dtype=np.uint16)
    for name, column in columns.items():
        value, state = np.concatenate(column.values), np.concatenate(column.states)
        channels[name] = calibrated(value, name, column.layout)
        channel_flags, found = cell_flags(name, column.layout, channels[name], state, line)
        findings.extend(found)
        if name in WIND_CHANNELS:
            flags |= channel_flags
        refuse_if_most(int((state == Cell.UNREADABLE).sum()), len(line), f"unreadable values of {name}", where)
    return Reading(
        time=time, channels=channels, flags=flags, line=line, sensor=recipe.sensor, step=step, rules=recipe.quality,
        findings=tuple(findings),
    )  # fmt: skip


def _columns(recipe: Recipe, header: Sequence[str] | None, where: str) -> dict[str, _Column]:
    found: dict[str, _Column] = {}
    for name, layout in recipe.channels.items():
        if layout.optional and isinstance(layout.column, str) and header is not None and layout.column not in header:
            continue
        found[name] = _Column(layout=layout, index=_index(layout.column, header, where))
    return found


def _index(column: str | int, header: Sequence[str] | None, where: str) -> int:
    if isinstance(column, int):
        if header is not None and column > len(header):
            raise InputError(f"no column {column}, only {len(header)}", where=where, fix="correct the recipe")
        return column - 1
    names = list(header or ())
    if column not in names:
        raise InputError(
            f"no column {column!r} in the header", where=where,
            fix=UnknownNameError.of("column", column, names).fix,
        )  # fmt: skip
    return names.index(column)


def instants(
    wall: NDArray[np.int64], utc: NDArray[np.bool_], *, line: NDArray[np.int64], zone_name: str | None, where: str
) -> tuple[NDArray[np.int64], tuple[Finding, ...]]:
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
