"""The format "delimited": a table by a sensor recipe, or by a draft whose facts are all known."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from flagdata.core.findings import Finding
from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.ingest.anemometer import sensor_recipe as recipes
from flagdata.ingest.anemometer.draft.doubts import KEYS, doubts
from flagdata.ingest.anemometer.draft.drafting import Draft, draft
from flagdata.ingest.anemometer.draft.heading_words import meaning
from flagdata.ingest.anemometer.draft.questions import Open, OpenFactsError
from flagdata.ingest.anemometer.formats.described import column_findings, complete
from flagdata.ingest.anemometer.log_reading import WIND_CHANNELS, Reading, with_horizontal
from flagdata.ingest.anemometer.samples import platform
from flagdata.ingest.anemometer.sensor_recipe import OpenRecipe, Recipe
from flagdata.ingest.anemometer.sniffing import HEAD_LINES, Guess, Head
from flagdata.ingest.anemometer.table.log_table import read_table
from flagdata.ingest.anemometer.table.rowclock import StatedTime
from flagdata.ingest.anemometer.text.cut_lines import RowReader
from flagdata.ingest.anemometer.text.text_file import TextFile
from flagdata.ingest.anemometer.wind_options import WindOptions

_ASKED = frozenset({"unit", "date_order", "wind", "columns", "missing", "expect"})
"""Options that complete a draft; a recipe says these things itself."""
_WEST = 1.5 * np.pi
"""The azimuth of components towards east (x) and north (y): wind along +x comes from the west."""
_LEFT_OUT = frozenset({"malformed-lines", "unreadable-stamps"})


class Delimited:
    """Format "delimited": a recipe of catalogs/sensors, the user's own TOML file, or a draft."""

    name = "delimited"
    about = "delimited text described by a sensor recipe, or by a draft that its user confirms"
    uses = frozenset({"zone", "azimuth", "platform", "start", "date", *_ASKED})

    def recognise(self, head: Head) -> Guess | None:
        """Finds the recipe of the catalog whose columns the header names; the one with most columns
        in common."""
        best: Guess | None = None
        for name in recipes.SENSORS.names():
            recipe = recipes.load(name)
            guess = _match(recipe, name, head) if isinstance(recipe, Recipe) else None
            if guess and (best is None or guess.score > best.score):
                best = guess
        return best

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read a file by the recipe in `options`, or by its draft."""
        where = str(source.path)
        if options.recipe is None:
            return _by_draft(source, options, where)
        strange = sorted(_ASKED & options.given())
        if strange:
            raise UsageError(
                f"the recipe says for itself: {', '.join(strange)}",
                where=where,
                fix="leave it out, or edit the recipe",
            )
        recipe = recipes.load(options.recipe)
        if isinstance(recipe, OpenRecipe):
            done = complete(recipe, source.head(HEAD_LINES), options, where=where)
            reading = _by_recipe(source, done.recipe, options, options.azimuth)
            return reading.with_findings((*done.findings, *column_findings(done)))
        if recipe.file.host:
            raise UsageError(
                f"the recipe {recipe.name} is for host-stamped lines",
                where=where,
                fix="use --as host-stamped",
            )
        return _by_recipe(source, recipe, options, options.azimuth)


def _by_recipe(
    source: TextFile, recipe: Recipe, options: WindOptions, azimuth: float | None
) -> Reading:
    """Reads all rows of a table, in the order of the file; `azimuth` of components' axes [rad,
    clockwise from true north]."""
    where, rows = str(source.path), RowReader(source, recipe.file)
    if recipe.time.format == "excel-days":
        recipe = replace(recipe, time=replace(recipe.time, format=source.serial_days))
    columns = platform.position_columns(rows.header or ()) or ()
    stamp_options = StatedTime(start=options.start, date=options.date, clock=options.clock)
    table = read_table(
        rows,
        recipe,
        where=where,
        zone_name=options.zone,
        extra=columns,
        stamp_options=stamp_options,
    )
    reading = with_horizontal(table.reading, azimuth, where=where)
    positions = {
        name: table.extra[column] for name, column in zip(platform.POSITION, columns, strict=False)
    }
    return platform.settle(reading, options.platform, positions=positions, where=where)


def draft_recipe(source: TextFile, options: WindOptions) -> Draft | None:
    """Drafts a recipe for a file; `None` where it holds no table.

    Raises:
        UnknownNameError: an answer to a check that does not exist.
    """
    for key in options.expect:
        if key not in KEYS:
            raise UnknownNameError.of("check", key, KEYS, where="--expect")
    return draft(
        source.head(HEAD_LINES), options, serial_days=source.serial_days, counted=source.counted
    )


def _by_draft(source: TextFile, options: WindOptions, where: str) -> Reading:
    draft = draft_recipe(source, options)
    if draft is None:
        fix = "describe it by a recipe: --sensor FILE.toml"
        raise UsageError("there is no table in its first lines", where=where, fix=fix)
    if len(draft.winds) > 1 and options.wind is None:
        question = (
            f"the file holds {len(draft.winds)} anemometers: {', '.join(draft.winds)}; which one?"
        )
        raise OpenFactsError.of(
            [Open(key="wind", question=question, example="COLUMN")], where=where
        )
    if draft.open:
        raise OpenFactsError.of(draft.open, where=where)
    recipe = recipes.parse(draft.recipe, where=f"the draft for {where}")
    recipe = replace(
        recipe,
        expect=frozenset((*options.expect, *(("order",) if options.clock is not None else ()))),
    )
    azimuth = _WEST if draft.of_earth and options.azimuth is None else options.azimuth
    reading = _by_recipe(source, recipe, options, azimuth)
    if _LEFT_OUT & {finding.kind for finding in reading.findings}:
        _refuse_new_names(source, recipe, where)
    odd = doubts(
        reading,
        recipe,
        assumed=frozenset(fact.what for fact in draft.facts if fact.origin == "assumed"),
        left_out=sum(finding.count for finding in reading.findings if finding.kind in _LEFT_OUT),
        now=time.time_ns(),
    )
    if odd:
        asked = [
            Open(key="expect", question=f"{doubt.text}. {doubt.question}", example=doubt.key)
            for doubt in odd
        ]
        raise OpenFactsError.of(asked, where=where)
    unused = _unused_findings(draft)
    understood = tuple(fact.line() for fact in draft.facts)
    return replace(
        reading.with_findings(unused),
        drafted=draft.recipe,
        stated=draft.stated,
        understood=understood,
    )


def _refuse_new_names(source: TextFile, recipe: Recipe, where: str) -> None:
    """Refuse a table whose columns change places on the way, by a line that names them in another
    order."""
    heading = source.head(recipe.file.preamble + 1)[-1].strip()
    cut = recipe.file.delimiter if recipe.file.delimiter != " " else None
    names = sorted(heading.split(cut))
    for number, line in enumerate(source.each_line(), start=1):
        if len(line) == len(heading) and line != heading and sorted(line.split(cut)) == names:
            message = "this line names the columns anew, in another order"
            raise InputError(
                message, where=f"{where}, line {number}", fix="split the file before it"
            )


def _unused_findings(draft: Draft) -> tuple[Finding, ...]:
    message = f"columns that are not used: {', '.join(draft.unused)}"
    return (Finding.of("columns-not-read", message),) if draft.unused else ()


def _states_its_unit(recipe: Recipe) -> bool:
    """Checks whether the headings that a recipe expects state the unit of the wind."""
    winds = [layout.column for name, layout in recipe.channels.items() if name in WIND_CHANNELS]
    return all(isinstance(column, str) and meaning(column).unit is not None for column in winds)


def _match(recipe: Recipe, name: str, head: Head) -> Guess | None:
    layout = recipe.file
    if (
        not _states_its_unit(recipe)
        or layout.host
        or layout.header == 0
        or len(head.lines) <= layout.preamble
    ):
        return None
    line = head.lines[layout.preamble]
    cells = [
        cell.strip().strip('"')
        for cell in (line.split() if layout.delimiter == " " else line.split(layout.delimiter))
    ]
    needed = [c.column for c in recipe.channels.values() if not c.optional] + list(
        recipe.time.columns
    )
    if not all(column in cells for column in needed):
        return None
    columns = [c.column for c in recipe.channels.values() if c.column in cells]
    return Guess(
        format="delimited",
        recipe=name,
        score=min(0.95, 0.6 + 0.05 * (len(columns) + len(recipe.time.columns))),
        reasons=(
            (
                f"line {layout.preamble + 1} names the columns of recipe {name}: "
                f"{', '.join(map(str, needed))}"
            ),
        ),
    )
