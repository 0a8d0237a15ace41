"""Exports with a heading: columns become channels by the names and units that the maker writes above them.

What the exports of loggers and weather stations share: a heading names every column, with its unit in the name or in a
line of its own; one time column or two; rows. Each maker's file says where the heading stands, what the names mean and
how stamps are written; the rest is here.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flagdata.errors import InputError, TimeError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants.dates import decide
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import ChannelLayout, CheckLayout, FileLayout, Recipe, TimeLayout
from flagdata.ingest.anemometer.table.rowclock import Given
from flagdata.ingest.anemometer.table.sonic import with_horizontal
from flagdata.ingest.anemometer.table.table import read_table
from flagdata.ingest.anemometer.text.rows import RowReader
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.schema import CHANNELS
from flagdata.signals import Sensor
from flagdata.timebase import NANOSECONDS
from flagdata.units import spelled, unit

Names = Sequence[tuple[str, str]]
"""Patterns of a column's whole name, case ignored → channel; the first pattern that fits decides."""

_INCHES = ("in", "inches")
"""What these exports call inches of mercury; the table of units knows lengths by such names."""
_REST = re.compile(
    r"\s+\d{1,2}:\d{2}(?P<s>:\d{2})?(?P<f>[.,]\d+)?(?P<b>\s*)(?P<p>[AaPp](?:\.?[Mm]\.?)?)?\s*(?P<z>Z|[+-]\d{2}:?\d{2})?$"
)


_LISTED, _LONGEST = 60, 120
"""Columns that are not read which a note names, and letters of each."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column of a heading: its number from 1, its name, and its unit as written ("" where there is none)."""

    number: int
    name: str
    unit: str = ""


@dataclass(frozen=True, kw_only=True)
class Assigned:
    """Which columns are read.

    Attributes:
        channels: channel → column.
        names: channel → name of its column.
        unread: names of columns that are not read.
        rivals: names of further columns of wind speed or components: other anemometers or heights.
    """

    channels: Mapping[str, ChannelLayout]
    names: Mapping[str, str]
    unread: tuple[str, ...] = ()
    rivals: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Export:
    """An export as its heading describes it.

    Attributes:
        name: of the format.
        file, time, sensor, checks: see recipe.Recipe.
        assigned: its columns.
        described_by: the maker's description that the reader follows, where no file of the instrument was at hand.
        averaged: whether a row is the average over the distance of the stamps.
        starts: whether the stamp of an average is that of its beginning.
    """

    name: str
    file: FileLayout
    time: TimeLayout
    sensor: Sensor
    assigned: Assigned
    checks: tuple[CheckLayout, ...] = ()
    described_by: str | None = None
    averaged: bool = False
    starts: bool = False


def cut(line: str, delimiter: str) -> list[str]:
    """The cells of one line of a heading, without blanks and quotes around them."""
    if delimiter == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line.lstrip("\ufeff")], delimiter=delimiter), [])]


def stamp_format(texts: Sequence[str], options: WindOptions, where: str) -> tuple[str, tuple[Finding, ...]]:
    """The format of stamps (see stamps.py) by the stamps themselves, and what was found about the order of dates.

    Args:
        texts: stamps of the first rows, date before time.

    Raises:
        TimeError: no date and time in them, or nothing that decides between day and month.
    """
    filled = [text.strip() for text in texts if text.strip()]
    decision = decide(filled, given=options.date_order, where=where)
    found = [match for text in filled if (match := _REST.search(text))]
    rest = next(iter(found), None)
    if rest is None:
        first = filled[0] if filled else ""
        raise TimeError(f"no time of day in {first!r}", where=where, fix="export date and time")
    clock = ("%I" if rest["p"] else "%H") + ":%M" + (":%S" if rest["s"] else "")
    clock += "%f" if any(match["f"] for match in found) else ""  # some loggers drop zeros at the end
    half = f"{' ' if rest['b'] else ''}%p" if rest["p"] else ""
    form = f"{decision.directives()} {clock}{half}{'%z' if rest['z'] else ''}"
    if decision.order == "ymd":
        return form, ()
    text = f"dates are read as {decision.order}: {decision.reason}"
    return form, (Finding(kind="date-order", severity=Severity.NOTE, what=text),)


def known_unit(text: str) -> str | None:
    """The unit that an export spells as `text`; `None` where it is not known."""
    bare = re.sub(r"^\s*[\[(](.*)[\])]\s*$", r"\1", text).strip()
    return "inHg" if bare.lower() in _INCHES else spelled(bare)


def assign(columns: Sequence[Column], names: Names, *, where: str, fix: str) -> Assigned:
    """Find the channels among columns by their names.

    Args:
        columns: of the heading, without those of time.
        names: see `Names`.
        where: the heading, for messages.
        fix: what to do about a unit that is not known or no wind at all.

    Raises:
        InputError: no column of wind, or wind in a unit that is not known.
    """
    channels: dict[str, ChannelLayout] = {}
    taken: dict[str, str] = {}
    unread: list[str] = []
    rivals: list[str] = []
    for column in columns:
        short = column.name[:120]  # a heading of any length must not cost more
        channel = next((c for pattern, c in names if re.fullmatch(pattern, short, re.IGNORECASE)), None)
        if channel is None or channel in channels:
            if channel is not None and channel.startswith("wind_") and CHANNELS[channel].unit == "m/s":
                rivals.append(column.name)
            elif column.name:
                unread.append(column.name)
            continue
        name = known_unit(column.unit)
        if name is None or unit(name).si != CHANNELS[channel].unit:
            if channel.startswith("wind_"):
                raise InputError(f"{column.name!r} is {channel}, but its unit is {column.unit!r}", where=where, fix=fix)
            unread.append(column.name)
            continue
        channels[channel] = ChannelLayout(column=column.number, unit=name)
        taken[channel] = column.name
    if not {"wind_speed", "wind_x"} & set(channels):
        listed = ", ".join(column.name for column in columns[:40] if column.name)
        raise InputError(f"no column of wind speed among {listed}", where=where, fix=fix)
    return Assigned(channels=channels, names=taken, unread=tuple(unread), rivals=tuple(rivals))


def read_export(source: TextFile, export: Export, options: WindOptions) -> Reading:
    """Read the rows below a heading.

    Raises:
        InputError, TimeError: see `read_table`.
    """
    where = str(source.path)
    assigned = export.assigned
    recipe = Recipe(
        name=export.name, about="from the file's own heading", source="the file", file=export.file, time=export.time,
        channels=assigned.channels, sensor=export.sensor, checks=export.checks,
    )  # fmt: skip
    rows = RowReader(source, export.file)
    reading = read_table(rows, recipe, where=where, zone_name=options.zone, given=Given(clock=options.clock)).reading
    found = [*column_findings(assigned)]
    if export.averaged:
        reading = _with_period(reading)
    if export.starts and reading.sensor.averaging:
        text = f"stamps are of the beginning of averages over {reading.sensor.averaging:g} s; they are kept as written"
        found.append(Finding(kind="stamps-at-start", severity=Severity.NOTE, what=text))
    if export.described_by is not None:
        found.append(described(export.described_by))
    return with_horizontal(reading.with_findings(tuple(found)), options.azimuth, where=where)


def described(by: str) -> Finding:
    """The finding that a reader follows a description alone."""
    return Finding(
        kind="read-by-description", severity=Severity.NOTE,
        what=f"read by {by}; the reader was tried on made files only", fix="compare the first rows with the file",
    )  # fmt: skip


def _with_period(reading: Reading) -> Reading:
    """The same reading with the median distance of its stamps as the logger's averaging [s]."""
    if len(reading.time) < 2:
        return reading
    period = float(np.median(np.abs(np.diff(reading.time)))) / NANOSECONDS
    return replace(reading, sensor=replace(reading.sensor, averaging=period))


def column_findings(assigned: Assigned) -> tuple[Finding, ...]:
    """What is to be said of the columns that are not read, anemometers first."""
    found: list[Finding] = []
    if assigned.rivals:
        used = assigned.names.get("wind_speed", assigned.names.get("wind_x", ""))
        found.append(
            Finding(
                kind="several-anemometers", severity=Severity.WARNING, count=len(assigned.rivals),
                what=f"wind is read from {used!r}, the first of {len(assigned.rivals) + 1} columns of wind; not from "
                f"{', '.join(assigned.rivals)}",
                fix="to read the others, too, ingest the file with --as delimited, which asks for what the headings do "
                "not state (such as --unit); where it does not read them, describe the file by a recipe that names "
                "the column",
            )
        )  # fmt: skip
    if assigned.unread:
        # Columns that speak of the wind come first, so that none of them is lost among a hundred others.
        names = sorted(assigned.unread, key=lambda name: "wind" not in name.lower())
        more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
        what = ", ".join(name[:_LONGEST] for name in names[:_LISTED]) + more
        found.append(Finding(kind="columns-not-read", severity=Severity.NOTE, count=len(names), what=what))
    return tuple(found)
