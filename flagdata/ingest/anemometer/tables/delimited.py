"""The format "delimited": text in columns, by a sensor recipe, or by a heading that leaves nothing in doubt."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flagdata.errors import InputError, TimeError, UsageError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer import recipe as recipes
from flagdata.ingest.anemometer.options import WindOptions, in_shell
from flagdata.ingest.anemometer.reading import WIND_CHANNELS, Reading
from flagdata.ingest.anemometer.recipe import Recipe
from flagdata.ingest.anemometer.samples import platform
from flagdata.ingest.anemometer.sniffing import HEAD_LINES, Guess, Head
from flagdata.ingest.anemometer.tables import devices, filled_later, unread_by_recipe
from flagdata.ingest.anemometer.tables.draft import Draft, draft
from flagdata.ingest.anemometer.tables.rowclock import Given
from flagdata.ingest.anemometer.tables.table import read_table
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import cut, lay_out
from flagdata.ingest.anemometer.text.rows import RowReader
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.ingest.anemometer.times import given_date
from flagdata.ingest.anemometer.winds import site_labels
from flagdata.ingest.anemometer.winds.sites import site_of_all
from flagdata.ingest.anemometer.winds.sonic import with_horizontal
from flagdata.ingest.anemometer.words import unknown_words
from flagdata.ingest.anemometer.words.headings import interest, understand

_DRAFTED = 0.55
"""Score of a draft without doubts: it is taken, but any format that knows the file goes before it."""
_DOUBTED = 0.3
_EVERY, _ROWS, _SITES = 10, 5, 50
"""Of a table's later rows, one of so many is looked at, so many of each site, and so many sites at most."""
_ASKED = frozenset({"unit", "date_order", "wind", "columns"})
"""Options that complete a draft; a recipe says these things itself."""


class Delimited:
    """Format "delimited": a recipe of catalogs/sensors, the user's own TOML file, or a draft without doubts."""

    name = "delimited"
    about = "delimited text described by a sensor recipe, or by its own heading"
    uses = frozenset({"zone", "azimuth", "platform", "start", "date", *_ASKED})

    def recognise(self, head: Head) -> Guess | None:
        """The recipe whose columns the header names; else the draft of one."""
        best = self.by_recipe(head)
        if best is not None:
            return best
        proposal = draft(head.lines)
        return None if proposal is None else guess(proposal)

    @staticmethod
    def by_recipe(head: Head) -> Guess | None:
        """The recipe of the catalog whose columns the header names; the one with most columns in common."""
        best: Guess | None = None
        for name in recipes.SENSORS.names():
            found = _match(recipes.load(name), name, head)
            if found and (best is None or found.score > best.score):
                best = found
        return best

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read a file by the recipe in `options`, or by its draft."""
        where = str(source.path)
        if options.recipe is None:
            return self._by_draft(source, options, where)
        strange = sorted(name for name in _ASKED if getattr(options, name) is not None)
        if strange:
            raise UsageError(
                f"the recipe says for itself: {', '.join(strange)}", where=where, fix="leave it out, or edit the recipe"
            )
        recipe = recipes.load(options.recipe)
        if recipe.file.host:
            raise UsageError(
                f"the recipe {recipe.name} is for host-stamped lines", where=where, fix="use --as host-stamped"
            )
        reading = _read(source, recipe, options, where)
        if options.recipe not in recipes.SENSORS.names():  # whoever writes a recipe names what is wanted
            return reading
        mixed = devices.check(source, source.head(HEAD_LINES), reading, recipe, options, where)
        devices_by = None if mixed is None else mixed.column
        told = _not_read(unread_by_recipe.remarks(source, recipe, devices_by=devices_by))
        return reading.with_findings(told if mixed is None else (*told, mixed.finding))

    def _by_draft(self, source: TextFile, options: WindOptions, where: str) -> Reading:
        proposal = drafted(source, options)
        if proposal is None:
            raise UsageError(
                "no table in its first lines", where=where, fix="describe it by a recipe: --recipe FILE.toml"
            )
        unsaid = [need for need in proposal.needs if need.without(options)]
        afloat = [need for need in unsaid if need.option == "platform"]
        if proposal.doubts or afloat:
            what = "; ".join(one.what for one in proposal.doubts or afloat)
            raise InputError(what, where=where, fix="; ".join(one.fix for one in (*proposal.doubts, *unsaid)))
        winds = proposal.winds if options.wind is None else site_labels.of_column(proposal.winds, options.wind)
        if len(winds) > 1:
            raise InputError(
                f"the file holds {len(winds)} anemometers: {', '.join(winds)}", where=where,
                fix=f"name the one to read: --wind {in_shell(winds[0])}; ingest takes each by itself",
            )  # fmt: skip
        recipe = recipes.parse(proposal.toml, where=f"the draft for {where}")
        try:
            turned = replace(options, azimuth=_WEST) if proposal.of_earth and options.azimuth is None else options
            reading = _read(source, recipe, turned, where)
        except TimeError as error:
            rest = [need.fix for need in unsaid if f"--{need.option}" not in error.fix]
            same = [need.fix for need in proposal.needs if f"--{need.option}" in error.fix]
            more = (fix for fix in same if "(line " in fix or fix.startswith(f"{error.fix}; columns"))
            told = next(more, error.fix)
            raise type(error)(error.what, where=error.where, fix="; ".join([told, *rest])) from None
        found = [
            Finding(kind="heading-doubtful", severity=Severity.WARNING, what=text, fix="check the file's description")
            for text in (*proposal.warnings, *([proposal.afloat] if proposal.afloat and not options.platform else []))
        ]
        found += _against_date(source, options)
        mixed = devices.check(source, source.head(HEAD_LINES), reading, recipe, options, where)
        of_each = drafted(source, options, devices_by=mixed.column) if mixed is not None else None
        found += _not_read((of_each or proposal).remarks)
        if options.columns is None and options.wind is None:
            speed = recipe.channels.get("wind_speed")
            found += unknown_words.told([speed.column] if speed is not None and isinstance(speed.column, str) else [])
        found += [] if mixed is None else [mixed.finding]
        return replace(
            reading,
            findings=(*reading.findings, *found),
            drafted=proposal.toml,
            stated=proposal.stated,
            understood=proposal.understood,
        )


_WEST = 1.5 * np.pi
"""The azimuth of components towards east (x) and north (y): wind along +x comes from the west."""


def guess(proposal: Draft) -> Guess:
    """What `sniff` says of a draft."""
    return Guess(
        format="delimited", score=_DOUBTED if proposal.doubts else _DRAFTED,
        reasons=proposal.understood, notes=(*proposal.warnings, *proposal.remarks),
        doubts=tuple(f"{doubt.what}: {doubt.fix}" for doubt in proposal.doubts), winds=proposal.winds,
        fix="; ".join(doubt.fix for doubt in proposal.doubts) or None, draft=proposal.toml or None,
        needs=tuple(f"{need.what}: {need.fix}" for need in proposal.needs),
    )  # fmt: skip


def drafted(source: TextFile, options: WindOptions, *, devices_by: int | None = None) -> Draft | None:
    """The draft of a file's recipe, completed by what the user says; `devices_by`: see `draft`."""
    lines = tuple(source.head(HEAD_LINES))
    if len(lines) == HEAD_LINES:
        lines = (*lines, *_of_later_sites(source, lines), *filled_later.rows(source, lines))
    return draft(
        lines, unit=options.unit, order=options.date_order, wind=options.wind, columns=options.columns,
        where=str(source.path), devices_by=devices_by,
    )  # fmt: skip


def _of_later_sites(source: TextFile, lines: tuple[str, ...]) -> tuple[str, ...]:
    """Rows of sites that follow the first lines, where a column has a site's heading and these hold one site alone."""
    layout = lay_out(lines, interest=interest)
    one = site_of_all(layout, apart=()) if layout is not None else None
    if layout is None or one is None or one[0] in layout.unit_columns:
        return ()
    at, width = one[0], layout.number_of_columns()
    found: dict[str, list[str]] = {}
    for first, block in source.blocks():
        for line in block[HEAD_LINES if first == 1 else 0 :: _EVERY]:
            cells = cut(line, layout.delimiter)
            if len(cells) == width and cells[at] and cells[at] != one[1]:
                found.setdefault(cells[at], []).append(line)
    if not found or len(found) > _SITES:
        return ()
    return tuple(line for rows in found.values() for line in rows[:_ROWS])


def sites(source: TextFile, proposal: Draft) -> tuple[str, ...]:
    """Labels of all anemometers of a file whose column tells sites apart, those beyond its first lines included."""
    if proposal.site is None:
        return proposal.winds
    known = {site_labels.site_of(text, proposal.parts)[0] for text in proposal.winds}
    for first, lines in source.blocks():
        for number, line in enumerate(lines, start=first - 1):
            if number < proposal.first:
                continue
            cells = cut(line, proposal.delimiter)
            of_a_site = len(cells) > proposal.site and bool(cells[proposal.site])
            if of_a_site and (number >= HEAD_LINES or _is_row(cells)):
                known.add(cells[proposal.site])
    return tuple(site_labels.label_of(site, part) for site in sorted(known) for part in sorted(proposal.parts))


def _is_row(cells: Sequence[str]) -> bool:
    """Whether a line among rows is one: a stamp and numbers in most of its cells, or all filled, its stamp damaged."""
    kinds = [kind for cell in cells if (kind := cell_kind(cell)) != "missing"]
    if len(kinds) == len(cells) and "number" in kinds:
        return True
    return "stamp" in kinds and sum(kind != "text" for kind in kinds) > len(kinds) / 2


def _against_date(source: TextFile, options: WindOptions) -> tuple[Finding, ...]:
    """The finding that a column of the file speaks against the date that was given, if one does."""
    layout = lay_out(source.head(HEAD_LINES), interest=interest) if options.date is not None else None
    what = given_date.contradiction(layout, options.date) if layout is not None and options.date is not None else ""
    fix = "give --date with the year of the first row"
    return (Finding(kind="date-contradicts", severity=Severity.WARNING, what=what, fix=fix),) if what else ()


def _not_read(remarks: Sequence[str]) -> tuple[Finding, ...]:
    """The finding that tells columns which were not read, if there are any."""
    what = "; ".join(remarks)
    return (Finding(kind="columns-not-read", severity=Severity.NOTE, what=what),) if remarks else ()


def _read(source: TextFile, recipe: Recipe, options: WindOptions, where: str) -> Reading:
    rows = RowReader(source, recipe.file)
    given = Given(start=options.start, date=options.date, clock=options.clock, heading=_of_wind(recipe, rows))
    columns = platform.position_columns(rows.header or ())
    table = read_table(rows, recipe, where=where, zone_name=options.zone, extra=columns or (), given=given)
    reading = with_horizontal(table.reading, options.azimuth, where=where)
    positions = {name: table.extra[column] for name, column in zip(platform.POSITION, columns or (), strict=False)}
    return platform.settle(reading, options.platform, positions=positions, where=where)


def _of_wind(recipe: Recipe, rows: RowReader) -> str:
    """The heading of the first column of wind that a recipe reads; the name of its sensor where no line names it."""
    column = next((layout.column for name, layout in recipe.channels.items() if name in WIND_CHANNELS), "")
    if isinstance(column, str):
        return column
    return rows.header[column - 1] if rows.header and column <= len(rows.header) else recipe.sensor.name


def _states_its_unit(recipe: Recipe) -> bool:
    """Whether the headings that a recipe expects state the unit of the wind."""
    winds = [layout.column for name, layout in recipe.channels.items() if name in WIND_CHANNELS]
    return all(isinstance(column, str) and understand(column).unit is not None for column in winds)


def _match(recipe: Recipe, name: str, head: Head) -> Guess | None:
    layout = recipe.file
    if not _states_its_unit(recipe):
        return None
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
