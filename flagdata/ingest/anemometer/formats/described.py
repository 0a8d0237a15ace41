"""Tables described by data: recipes that the heading of the file itself completes.

Such a recipe leaves open what differs from one export to the next: where the heading stands, which
of several names a column has, in which unit it is. The formats of catalogs/sensors/formats are
recipes of this kind that recognise their files; a user's own is read by `--sensor FILE.toml`.
Beside the keys of every recipe (see sensor_recipe.py) they have

    described-by        whose description it follows, of a format that was never tested on a real
                        file
    [match]             see sensor_recipe.MATCH
    [facts]             name → pattern with one group, looked for down to the first row; "{name}" in
                        texts stands for it
    [time] columns      names (those but one may be absent; a group "zone" of the pattern states the
                        zone), or numbers
    [time] format       a list: the first that most stamps fit, else by the stamps themselves, as
                        where there is none
    [channels.…]        column: a list of names (the first column with one of them is read), or a
                        number
    unit = { in = "heading", else = "deg" }     else: where the heading states none; absent: there
                                                it is an error
    unit = { in = "heading", whole = "mph" }    whole: the unit that the instrument counts whole, by
                                                which that of a file that states none is inferred,
                                                and confirmed by its user; `--unit` gives it
    range               of a column whose unit is in the heading: in SI

A name is the heading's, or a regular expression that fits the whole of it, case ignored.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import islice
from typing import Any

import numpy as np

from flagdata.core.findings import Finding
from flagdata.core.schema import CHANNELS
from flagdata.core.units import unit
from flagdata.errors import InputError
from flagdata.ingest.anemometer import sensor_recipe as recipes
from flagdata.ingest.anemometer.formats.recipe_headings import (
    Column,
    Heading,
    channel_of,
    find,
    fits,
    stamp_format,
    unit_of,
    with_units,
)
from flagdata.ingest.anemometer.instants.stamp_text import parse
from flagdata.ingest.anemometer.log_reading import Reading, followed_finding, with_horizontal
from flagdata.ingest.anemometer.sensor_recipe import OpenRecipe, Recipe
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.table.log_table import Table, read_table
from flagdata.ingest.anemometer.table.rowclock import StatedTime
from flagdata.ingest.anemometer.text.cut_lines import RowReader, cells_of_lines
from flagdata.ingest.anemometer.text.text_file import TextFile
from flagdata.ingest.anemometer.wind_options import WindOptions
from flagdata.recipes.documents import to_toml
from flagdata.recipes.shelves import Shelf
from flagdata.timebase import NANOSECONDS

_SHELF = Shelf(folder="sensors/formats", noun="table format")
_LINES = 5000
"""Lines by which order of dates and decimal mark are decided."""
_FIX = (
    "export again in m/s, km/h, mph or knots (Beaufort is a scale of classes), or describe the "
    "file by a recipe"
)
_NAMED, _WIDE = 60, 120
"""Columns that are not read which a note names, and letters of each."""


@dataclass(frozen=True, kw_only=True)
class Completed:
    """A recipe that a file's heading completed.

    Attributes:
        recipe: its channels in the order of the file; columns are numbers.
        data: its tables, as TOML has them.
        channels: channel → the column that is read.
        unread, rivals: columns that are not read, and further ones of wind speed or components.
        inferred: why a unit is inferred that the file does not state; "" where none is.
        averaged: whether a row is the average over the distance of the stamps; starts: and stamped
            by its beginning.
        findings: about dates and units.
    """

    recipe: Recipe
    data: Mapping[str, Any]
    channels: Mapping[str, Column]
    unread: tuple[Column, ...]
    rivals: tuple[Column, ...]
    inferred: str
    averaged: bool
    starts: bool
    findings: tuple[Finding, ...]


class Described:
    """A format of the catalog, by its name."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.text, self.open = open_format(name)
        self.about: str = self.open.data["about"]
        self.uses = frozenset({"zone", "date_order", *(["unit"] if self._whole_in() else [])})

    def recognise(self, head: Head) -> Guess | None:
        """Recognises the heading and the mark that the maker writes."""
        heading = find(self.open.data, head.lines)
        if heading is None:
            return None
        reason = (
            f"line {heading.at + 1} is as in every {self.about}: "
            f"{head.lines[heading.at].strip()[:100]}"
        )
        return Guess(format=self.name, score=0.96, reasons=(reason,))

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read the rows by what the heading states."""
        done = self.completed(source, options)
        return self.finish_reading(
            self.table(source, done, options).reading, done, options, where=str(source.path)
        )

    def completed(self, source: TextFile, options: WindOptions) -> Completed:
        """Reads what the heading of a file states."""
        return complete(
            self.open, source.head(_LINES), options, where=str(source.path), relabel=self.named
        )

    def named(self, heading: Heading, lines: Sequence[str]) -> Heading:
        """Returns the heading with the names by which the recipe knows its columns."""
        return heading

    def table(
        self, source: TextFile, done: Completed, options: WindOptions, extra: Sequence[str] = ()
    ) -> Table:
        """Reads the rows below the heading, and further columns by their names."""
        rows, where = RowReader(source, done.recipe.file), str(source.path)
        return read_table(
            rows,
            done.recipe,
            where=where,
            zone_name=options.zone,
            stamp_options=StatedTime(clock=options.clock),
            extra=extra,
        )

    def finish_reading(
        self, reading: Reading, done: Completed, options: WindOptions, *, where: str
    ) -> Reading:
        """Adds to a reading what the format states of averages, and what is reported of other
        columns."""
        findings = [*done.findings, *column_findings(done)]
        if done.averaged and len(reading.time) > 1:
            period = float(np.median(np.abs(np.diff(reading.time)))) / NANOSECONDS
            reading = replace(reading, sensor=replace(reading.sensor, averaging=period))
        if done.starts and reading.sensor.averaging:
            averaging = reading.sensor.averaging
            reading = replace(reading, time=reading.time + round(averaging * NANOSECONDS))
            text = (
                f"stamps are of the beginning of averages over {averaging:g} s; moved to their end"
            )
            findings.append(Finding.of("stamps-at-start", text))
        if "described-by" in self.open.data:
            findings.append(followed_finding(self.open.data["described-by"]))
        reading = with_horizontal(
            reading.with_findings(tuple(findings)), options.azimuth, where=where
        )
        if not done.inferred:
            return replace(reading, described=self.text)
        return replace(reading, drafted=to_toml(done.data), understood=(self.about, done.inferred))

    def _whole_in(self) -> bool:
        layouts = self.open.data["channels"].values()
        return any(
            "whole" in layout["unit"] for layout in layouts if isinstance(layout["unit"], Mapping)
        )


def complete(
    open_recipe: OpenRecipe,
    lines: Sequence[str],
    options: WindOptions,
    *,
    where: str,
    relabel: Any = None,
) -> Completed:
    """Completes a recipe by the heading of a file.

    Args:
        lines: the first lines of the file.
        options: `date_order` and `unit` count where the recipe and the heading state neither.
        relabel: (heading, lines) → the heading with other names of its columns.

    Raises:
        InputError: no such heading, no rows, a column that is not there or whose unit is not known.
        TimeError: no stamps, or nothing that decides between day and month.
    """
    data = open_recipe.data
    heading = find(data, lines)
    if heading is None:
        fix = "export it again, or name another --as or --sensor"
        raise InputError(
            f"the file has no heading of a {data['about']}", where=f"{where}, line 1", fix=fix
        )
    heading = relabel(heading, lines) if relabel is not None else heading
    rows = [
        row
        for row in cells_of_lines(lines[heading.rows :], heading.delimiter)
        if any(map(str.strip, row))
    ]
    at_rows = f"{where}, line {heading.rows + 1}"
    facts = _facts(data, lines[: heading.rows + 1])
    stamped, zone = _time_columns(data["time"], heading, facts, at_rows)
    columns, units = with_units(data, heading, rows, facts, stamped, options, where)
    taken, unread, rivals = _assign_columns(data["channels"], columns, where=where, heading=heading)
    if not rows:
        raise InputError("there are no rows below the heading", where=at_rows, fix="export again")
    form, about_time = _format(data["time"], stamped, heading, rows, options, at_rows)
    time = {"columns": stamped, "format": form, **({"zone": zone} if zone else {})}
    checks = _checks(data.get("check", ()), heading, where=where)
    checked = {check["column"] for check in checks}
    facts |= {channel: column.name for channel, column in taken.items()}
    channels: dict[str, dict[str, Any]] = {}
    for name, column in taken.items():
        layout = dict(data["channels"][name])
        if isinstance(layout["unit"], Mapping) and "range" in layout:
            layout["range"] = [float(unit(column.unit).from_si(bound)) for bound in layout["range"]]
        channels[name] = {**layout, "column": column.number, "unit": column.unit}
    keys = data.keys() - {"match", "facts", "described-by", "check"}
    closed: dict[str, Any] = {
        **{key: value for key, value in data.items() if key in keys},
        "time": time,
        "channels": channels,
        "file": _file(
            data.get("file", {}), heading, [column.number - 1 for column in taken.values()], rows
        ),
        "sensor": _sensor(data["sensor"], facts),
        "check": checks,
    }
    match = data.get("match", {})
    begins = (
        "starts" in match and re.search(match["starts"], "\n".join(lines[: heading.at])) is not None
    )
    return Completed(
        recipe=recipes.of_data(closed, where=where),
        data=closed,
        channels=taken,
        unread=tuple(column for column in unread if column.number not in checked),
        rivals=rivals,
        findings=(*about_time, *units.notes),
        inferred=units.inferred,
        averaged=match.get("averaged", True),
        starts=begins,
    )


@cache
def open_format(name: str) -> tuple[str, OpenRecipe]:
    """Reads the text of a format of the catalog, and the recipe that it is."""
    text = _SHELF.named(name).text
    return text, recipes.parse_open(text, where=f"table format {name!r}")


def _facts(data: Mapping[str, Any], lines: Sequence[str]) -> defaultdict[str, str]:
    text = "\n".join(lines).lstrip("\ufeff")
    matches = (
        (name, re.search(pattern, text, re.MULTILINE))
        for name, pattern in data.get("facts", {}).items()
    )
    return defaultdict(str, {name: match[1].strip() for name, match in matches if match})


def _file(
    file: Mapping[str, Any], heading: Heading, read: Sequence[int], rows: Sequence[Sequence[str]]
) -> dict[str, Any]:
    commas = heading.delimiter != "," and any(
        "," in row[at] for row in rows for at in read if at < len(row)
    )
    # A line of units that names columns of its own leaves the heading no right count of cells.
    has_names = (
        bool(heading.cells)
        and not any(heading.below[len(heading.cells) :])
        and heading.delimiter != " "
    )
    return {
        "decimal": "," if commas else ".",
        **file,
        "delimiter": heading.delimiter,
        "preamble": heading.at if has_names else heading.rows,
        "header": heading.rows - heading.at if has_names else 0,
    }


def _time_columns(
    time: Mapping[str, Any], heading: Heading, facts: Mapping[str, str], where: str
) -> tuple[list[int], str | None]:
    """Finds the columns of time, and the zone that the recipe or the file states."""
    columns: list[int] = []
    zone: str | None = time.get("zone", "").format_map(facts) or None
    for wanted in time["columns"]:
        if isinstance(wanted, int):
            columns.append(wanted)
            continue
        matching = (
            (at, match)
            for at, cell in enumerate(heading.cells, start=1)
            if (match := fits(wanted, cell))
        )
        for at, match in islice(matching, 1):
            columns.append(at)
            zone = match.groupdict().get("zone") or zone
    if not columns:
        fix = f"its columns are {', '.join(heading.cells)[:1000]}"
        raise InputError(
            f"no column is called {' or '.join(time['columns'])}", where=where, fix=fix
        )
    return columns, zone


def _format(
    time: Mapping[str, Any],
    columns: Sequence[int],
    heading: Heading,
    rows: Sequence[Sequence[str]],
    options: WindOptions,
    where: str,
) -> tuple[str, tuple[Finding, ...]]:
    """Chooses the format of stamps: the recipe's, the first of its formats that most fit, or that
    of the stamps themselves."""
    forms = time.get("format", [])
    if isinstance(forms, str):
        return forms, ()
    texts = [
        " ".join(row[at - 1].strip() for at in columns) for row in rows if len(row) >= max(columns)
    ]
    if options.date_order is None:
        for form in forms:
            if 2 * int(parse(texts, form).valid.sum()) >= max(1, len(texts)):
                return form, ()
    return stamp_format(
        texts, options, where, claim=heading.below[columns[0] - 1] if heading.below else ""
    )


def _assign_columns(
    channels: Mapping[str, Mapping[str, Any]],
    columns: Sequence[Column],
    *,
    where: str,
    heading: Heading,
) -> tuple[dict[str, Column], tuple[Column, ...], tuple[Column, ...]]:
    """Assigns a column to each channel; also returns the columns that are not read, and further
    ones of speed.

    Raises:
        InputError: a column that the recipe needs is not there, or its unit is not known.
    """
    taken: dict[str, Column] = {}
    unread: list[Column] = []
    rivals: list[Column] = []
    at_names, at_units = (
        f"{where}, line {heading.at + 1 + below}" for below in (0, bool(heading.below))
    )
    for column in columns:
        channel = column.name if not heading.cells else channel_of(channels, column)
        if channel is None or channel in taken:
            rival = (
                channel is not None
                and channel.startswith("wind_")
                and CHANNELS[channel].unit == "m/s"
            )
            (rivals if rival else unread).extend([column] if column.name else [])
            continue
        name = unit_of(column.unit)
        if name is None or unit(name).si != CHANNELS[channel].unit:
            if channel.startswith("wind_") or not channels[channel].get("optional"):
                message = f"{column.name!r} is {channel}, but its unit is {column.unit!r}"
                raise InputError(message, where=at_units, fix=_FIX)
            unread.append(column)
            continue
        taken[channel] = replace(column, unit=name)
    listed = ", ".join(column.name for column in columns[:40] if column.name)
    for channel in channels:
        if channel not in taken and not channels[channel].get("optional"):
            message = f"no column of {channel.replace('_', ' ')} among {listed}"
            raise InputError(
                message,
                where=at_names,
                fix=f"{_FIX}; or let its columns be drafted: --as delimited",
            )
    if not {name for name in taken if name.startswith("wind_") and CHANNELS[name].unit == "m/s"}:
        fix = (
            "let its columns be drafted, and confirm them: --as delimited; or describe the file by "
            "a recipe"
        )
        raise InputError(
            f"there is no column of wind speed among {listed}", where=at_names, fix=fix
        )
    return taken, tuple(unread), tuple(rivals)


def _sensor(sensor: Mapping[str, Any], facts: Mapping[str, str]) -> dict[str, Any]:
    """Fills facts into the texts of the sensor's keys; a height that the file does not state is
    left out."""
    texts = {
        key: value.format_map(facts).strip()
        for key, value in sensor.items()
        if isinstance(value, str)
    }
    height = {"height": float(texts.pop("height"))} if texts.get("height") else {}
    return {**sensor, **{key: value for key, value in texts.items() if key != "height"}, **height}


def _checks(
    checks: Sequence[Mapping[str, Any]], heading: Heading, *, where: str
) -> list[dict[str, Any]]:
    """Numbers the columns that are checked, of those that the file has.

    Raises:
        InputError: a column is not there, and its check is not optional.
    """
    present: list[dict[str, Any]] = []
    for check in checks:
        wanted = check["column"]
        numbers = (
            at for at, cell in enumerate(heading.cells, 1) if fits(str(wanted), cell) is not None
        )
        number = wanted if isinstance(wanted, int) else next(numbers, None)
        if number is not None:
            present.append({**check, "column": number})
        elif not check.get("optional"):
            raise InputError(
                f"no column is called {wanted}, which the recipe checks",
                where=f"{where}, line {heading.at + 1}",
                fix=f"correct the name, its columns are {', '.join(heading.cells)[:1000]}; or set "
                "optional = true in its [[check]]",
            )
    return present


def column_findings(done: Completed) -> tuple[Finding, ...]:
    """Reports the columns that are not read, anemometers first."""
    findings: list[Finding] = []
    if done.rivals:
        used = next(
            done.channels[name].name for name in ("wind_speed", "wind_x") if name in done.channels
        )
        findings.append(
            Finding.of(
                "several-anemometers",
                f"wind is read from {used!r}, the first of {len(done.rivals) + 1} columns of wind; "
                "not from "
                f"{', '.join(column.name for column in done.rivals)}",
                count=len(done.rivals),
                fix="to read the others, too, ingest the file with --as delimited, which asks for "
                "what the headings do "
                "not state (such as --unit); where it does not read them, describe the file by a "
                "recipe that names "
                "the column",
            )
        )
    if done.unread:
        # Columns that speak of the wind come first, so that none of them is lost among a hundred
        # others.
        names = sorted(
            (column.name for column in done.unread), key=lambda name: "wind" not in name.lower()
        )
        further = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        message = ", ".join(name[:_WIDE] for name in names[:_NAMED]) + further
        findings.append(Finding.of("columns-not-read", message, count=len(names)))
    return tuple(findings)


Davis = partial(Described, "davis")
Ecowitt = partial(Described, "ecowitt")
EddyPro = partial(Described, "eddypro")
Fluxnet = partial(Described, "fluxnet")
Hobo = partial(Described, "hobo")
Icos = partial(Described, "icos")
IcosEcosystem = partial(Described, "icos-ecosystem")
Kestrel = partial(Described, "kestrel")
Surfrad = partial(Described, "surfrad")
WeatherLink = partial(Described, "weatherlink")
Windographer = partial(Described, "windographer")
Zentra = partial(Described, "zentra")
