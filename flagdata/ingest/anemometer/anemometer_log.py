"""From an anemometer's file to a `WindLog`: choose the format, read, put in order, judge.

Rows of a log beside what was read of them, so that its user can judge how the file was understood.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.files.addresses import local_path
from flagdata.core.findings import Finding
from flagdata.core.provenance import digest
from flagdata.core.schema import CHANNELS, UNUSABLE, SampleFlag
from flagdata.core.shell import command_line
from flagdata.errors import (
    InputError,
    NothingMeasuredError,
    TimeError,
    UsageError,
    ZoneMissingError,
)
from flagdata.ingest.anemometer import sensor_recipe as recipes
from flagdata.ingest.anemometer import untimed
from flagdata.ingest.anemometer.draft import doubts
from flagdata.ingest.anemometer.formats.log_formats import FORMATS, Format
from flagdata.ingest.anemometer.identify import open_log, recognise_file, signing_formats, unknown
from flagdata.ingest.anemometer.instants import zones
from flagdata.ingest.anemometer.log_reading import WIND_CHANNELS, Reading
from flagdata.ingest.anemometer.samples import platform, rules, zero
from flagdata.ingest.anemometer.samples.order import in_order
from flagdata.ingest.anemometer.table.delimited import Delimited, draft_recipe
from flagdata.ingest.anemometer.text.text_file import TextFile
from flagdata.ingest.anemometer.wind_options import WindOptions
from flagdata.record.signals import LogRow, Series, WindLog, WindSeries

_SPEEDS = ("wind_speed", "apparent_wind_speed", "theoretical_wind_speed", "wind_speed_estimate")
_COMPONENTS = ("wind_x", "wind_y", "wind_z")
_DIRECTIONS = ("wind_direction", "apparent_wind_direction", "theoretical_wind_direction")
_FIRST = 2


def shown_rows(source: TextFile, reading: Reading) -> tuple[LogRow, ...]:
    """Selects the first two rows with a speed, the slowest, the fastest and the last, in the order
    of the file.

    Args:
        source: the text that was read.
        reading: its rows, put in order and judged; at least one.
    """
    speed = _speed(reading)
    finite = np.flatnonzero(np.isfinite(speed))
    first = finite if len(finite) else np.arange(len(reading.time))
    chosen = {*map(int, first[:_FIRST]), len(reading.time) - 1}
    if len(finite):
        chosen |= {int(np.nanargmin(speed)), int(np.nanargmax(speed))}
    texts = _lines(source, {int(reading.line[row]) for row in chosen})
    return tuple(
        LogRow(
            line=int(reading.line[row]),
            text=texts.get(int(reading.line[row]), ""),
            time=int(reading.time[row]),
            wind=wind_of(reading, row),
        )
        for row in sorted(chosen, key=lambda row: int(reading.line[row]))
    )


def wind_of(reading: Reading, row: int) -> str:
    """Describes the wind of a row: speed in m/s and direction in degrees, or components, and its
    flags."""
    speeds = [reading.channels[name][row] for name in _SPEEDS if name in reading.channels]
    parts = [f"{speed:.2f} m/s" if np.isfinite(speed) else "no speed," for speed in speeds]
    if not parts:
        parts = [
            f"{name.removeprefix('wind_')} {reading.channels[name][row]:+.2f}"
            for name in _COMPONENTS
            if name in reading.channels
        ]
        parts = [f"{', '.join(parts)} m/s"] if parts else []
    directions = [name for name in _DIRECTIONS if name in reading.channels]
    if directions and np.isfinite(reading.channels[directions[0]][row]):
        parts.append(f"from {np.rad2deg(reading.channels[directions[0]][row]):.0f}°")
    flags = [
        flag.name.lower().replace("_", " ")
        for flag in SampleFlag
        if flag.name and flag & int(reading.flags[row])
    ]
    return " ".join(parts) + (f" ({', '.join(flags)})" if flags else "")


def _speed(reading: Reading) -> Series:
    for name in _SPEEDS:
        if name in reading.channels:
            return reading.channels[name]
    parts = [reading.channels[name] for name in _COMPONENTS if name in reading.channels]
    return np.sqrt(sum(part**2 for part in parts)) if parts else np.full(len(reading.time), np.nan)


def _lines(source: TextFile, wanted: set[int]) -> dict[int, str]:
    texts: dict[int, str] = {}
    for first, lines in source.blocks():
        texts |= {
            number: lines[number - first]
            for number in wanted
            if first <= number < first + len(lines)
        }
        if len(texts) == len(wanted):
            break
    return texts


READER = 3
"""Version of the readers of logs: raised with each change of code after which a file that was read
gives other times, values or flags, or has other channels. What a TOML file says needs no raise: its
digest is in the plan.

    2   formats of tables are TOML files; instruments' lines are read where they are whole and
        stamped; numbers that may mean no value, and directions of 0 that may be calm air, are asked
        about or reported, and stay as written
"""


def read_log(path: Path | str, options: WindOptions | None = None) -> WindLog:
    """Read an anemometer's log, of whichever format it seems to be or `options` say it is.

    Args:
        path: the file.
        options: what the file does not say about itself.

    Raises:
        InputError, TimeError, LimitError: the file cannot be read as this format; names the line
            and the fix.
        UsageError: options that do not fit the format, or a file of no known format.
        NotFoundError: no such file, or no such recipe.
    """
    path = local_path(path)
    options = options or WindOptions()
    recipe = recipes.load(options.recipe) if options.recipe is not None else None
    source = open_log(path, options, recipe.file.encoding if recipe else None)
    if options.rate is not None:
        options = replace(options, start=None, rate=None)
    if (
        recipe is None
        and options.columns is None
        and not signing_formats(source)
        and untimed.has_clock_times(source)
    ):
        if options.date is None:
            day = untimed.year_alone(source)
            lacking = "dates without a year" if day else "times of day without a date"
            message = f"the lines of an instrument stand after {lacking}"
            example = f"YYYY-{day}" if day else "2026-05-01"
            year = ", with its year in place of YYYY" if day else ""
            fix = (
                f"give the day of the first: {command_line('--date', example)}{year}, and its "
                "--zone"
            )
            raise TimeError(message, where=str(path), fix=fix)
        source, options = untimed.add_date(source, options.date), replace(options, date=None)
    name, options, reasons = _choose(source, options)
    reader: Format = FORMATS[name]()
    unused = options.given() - reader.uses
    if unused:
        raise UsageError(
            f"the format {name} has no use for: {', '.join(sorted(unused))}",
            where=str(path),
            fix="leave it out",
        )
    statement = zones.stated_zone(source.head(zones.LINES))
    try:
        reading = reader.read(source, options)
    except ZoneMissingError as error:
        hint = f"; {statement.advice()}" if statement is not None else ""
        fix = f"{error.fix}{hint}; or state it in a recipe, as [time] zone: --sensor FILE.toml"
        raise ZoneMissingError(error.what, where=error.where, fix=fix) from None
    reported = {finding.kind for finding in reading.findings}
    if (
        statement is not None
        and options.zone is not None
        and reported.isdisjoint({"zone-contradicts", "zone-not-needed"})
    ):
        says = f"line {statement.line} ({statement.text!r}) says"
        reading = reading.with_findings(
            zones.contradiction(says, statement.name, options.zone, reading.time)
        )
    if "platform" not in reader.uses:
        reading = platform.settle(reading, options.platform, where=str(path))
    platform.check_corrected(reading, options.platform, where=str(path))
    reading = reading.with_findings(source.findings)
    if len(reading.time) == 0:
        raise InputError(
            "there are no samples in the file",
            where=str(path),
            fix="check that the logger recorded anything",
        )
    zero.check(reading, options.zero_offset, where=str(path))
    choice = options.zero_offset if options.zero_offset is not None else reading.rules.zero_offset
    ordered = in_order(reading, where=str(path), choice=options.clock)
    reading = zero.settle(rules.impossible(ordered), choice)
    try:
        for rule in rules.RULES:
            reading = rule(reading)
    except InputError as error:
        raise InputError(error.what, where=f"{path}, {error.where}", fix=error.fix) from None
    reading = rules.future(reading, now=time.time_ns())
    answered = recipe.expect if isinstance(recipe, recipes.Recipe) else frozenset[str]()
    findings = (
        *reading.findings,
        *(() if reading.drafted else doubts.report_doubts(reading, answered)),
    )
    findings = (*findings, *_nothing_measured(reading, where=str(path)))
    series = WindSeries(
        time=reading.time,
        channels=reading.channels,
        flags=reading.flags,
        sensor=reading.sensor,
        host_time=reading.host_time,
    )
    reasons = reading.understood or reasons
    text = (
        reading.drafted
        or reading.described
        or (_text(options.recipe) if options.recipe is not None else None)
    )
    rows = shown_rows(source, reading) if reading.drafted else ()
    return WindLog(
        series=series,
        format=name,
        findings=findings,
        reasons=reasons,
        plan=understood(name, text),
        drafted=reading.drafted,
        stated=reading.stated,
        rows=rows,
    )


def _text(recipe: str) -> str:
    """Quotes what a recipe says, in TOML; its file may be damaged where nothing of it was read."""
    return recipes.SENSORS.find(recipe).data.decode(errors="replace")


def _nothing_measured(reading: Reading, *, where: str) -> tuple[Finding, ...]:
    """Reports that no wind can be used, but the log measured something else.

    Raises:
        NothingMeasuredError: nothing else either; a direction beside speeds that are all missing is
            none.
    """
    winds = [values for name, values in reading.channels.items() if name in WIND_CHANNELS]
    usable = (reading.flags & UNUSABLE) == 0
    if any((np.isfinite(values) & usable).any() for values in winds):
        return ()
    quantities = sorted(
        name
        for name, values in reading.channels.items()
        if name not in WIND_CHANNELS
        and (CHANNELS[name].unit != "rad" or not winds)
        and np.isfinite(values).any()
    )
    counts = ((flag, int(((reading.flags & flag) != 0).sum())) for flag in UNUSABLE)
    why = ", ".join(
        f"{count} {flag.name.lower().replace('_', ' ')}"
        for flag, count in counts
        if count and flag.name
    )
    message = (
        f"not one value of the wind in {len(reading.time)} rows can be "
        f"used{f' ({why})' if why else ''}"
    )
    if not quantities:
        fix = "check the sensor, and which columns are read"
        below = any(
            (values < 0).any() for name, values in reading.channels.items() if name in rules.SPEEDS
        )
        fix += "; if calm air reads below zero, give --zero-offset" if below else ""
        raise NothingMeasuredError(
            f"there is nothing to measure: {message}",
            where=f"{where}, line {reading.line[0]}",
            fix=fix,
        )
    text = f"{message}; kept for {', '.join(quantities)}: no ground truth comes of it"
    return (
        Finding.of(
            "no-usable-wind",
            text,
            count=len(reading.time),
            where=f"line {reading.line[0]}",
            fix="check the sensor and the recipe's columns",
        ),
    )


def _choose(source: TextFile, options: WindOptions) -> tuple[str, WindOptions, tuple[str, ...]]:
    """Format, options completed by what was recognised, and why."""
    if options.format is not None:
        if options.format not in FORMATS:
            FORMATS[options.format]
        return options.format, options, (f"the format {options.format} was named",)
    if options.recipe is not None:
        name = "host-stamped" if recipes.load(options.recipe).file.host else "delimited"
        return name, options, (f"the recipe {options.recipe} was named",)
    if options.columns is not None:
        return "delimited", options, ("its columns were named",)
    guesses = recognise_file(source)
    if not guesses:
        if draft_recipe(source, options) is None:
            guess = unknown(source)
            message = f"not a log of a known format: {'; '.join(guess.reasons)}"
            raise InputError(
                message, where=str(source.path), fix=guess.fix or "describe it by a recipe"
            )
        return Delimited.name, options, ()
    best = guesses[0]
    return best.format, replace(options, recipe=best.recipe), best.reasons


def understood(format_name: str, recipe: str | None) -> Mapping[str, Any]:
    """Describes the plan by which a log was read: its format, the digest of the recipe (TOML), of
    the user or of the catalog's format, if one was used, and the reader."""
    return {
        "format": format_name,
        "recipe": None if recipe is None else digest(recipe),
        "reader": READER,
    }
