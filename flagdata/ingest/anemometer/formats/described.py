"""Table formats that are data: recipes whose open facts are in the heading of the file itself.

Each is a TOML file of catalogs/sensors/formats: a recipe (see recipe.py) in which the file states what differs from one
export to the next. Patterns are regular expressions; those of names and cells fit the whole of it, case ignored.

    described-by        whose description it follows, where it was tried on made files only
    [match]             header: patterns, each of which a cell of the heading fits; within: lines in which the heading
                        is looked for; mark: a pattern in the heading or above it; cell: of one of its cells, groups
                        "name" and "unit"; units: whether the line below the heading holds units; groups: whether the
                        line above it holds what goes before the names; averaged: whether a row is the average over the
                        distance of the stamps; starts: a pattern above the heading by which stamps begin the average
    [facts]             name → pattern with one group, looked for down to the first row; "{name}" in texts stands for it
    [time] columns      patterns of cells (those but one may be absent; group "zone" states the zone), or numbers
    [time] format       absent: by the stamps themselves
    [channels.…]        column: patterns of names (the first column that fits is read), or a number; range in SI
    unit = { in = "heading", else = "deg" }     else: where the heading states none; absent: there it is an error
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.formats.exports import (
    Assigned,
    Column,
    Export,
    Names,
    assign,
    cut,
    known_unit,
    read_export,
    stamp_format,
)
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import DELIMITERS, CheckLayout, FileLayout, TimeLayout
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.rows import cells_of_lines
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.recipes import Shelf, parsed
from flagdata.schema import CHANNELS
from flagdata.signals import Sensor
from flagdata.units import unit

_SHELF = Shelf(folder="sensors/formats", noun="table format")
_LINES, _LONGEST = 5000, 20_000
"""Lines by which order of dates and decimal mark are decided, and letters of a heading."""
_FIX = "export again in m/s, km/h, mph or knots (Beaufort is a scale of classes), or describe the file by a recipe"


@dataclass(frozen=True, kw_only=True)
class _Heading:
    """The line of names, from 0; the lines above the rows; cells and, for each, name and unit as written."""

    at: int
    rows: int
    delimiter: str
    cells: Sequence[str] = ()
    names: Sequence[str] = ()
    units: Sequence[str] = ()
    below: Sequence[str] = ()


class Described:
    """A format of the catalog, by its name."""

    uses = frozenset({"zone", "date_order"})

    def __init__(self, name: str) -> None:
        self.name = name
        self._data = _data(name)
        self.about: str = self._data["about"]

    def recognise(self, head: Head) -> Guess | None:
        """The heading and the mark that the maker writes."""
        found = _heading(self._data, head.lines)
        if found is None:
            return None
        reason = f"line {found.at + 1} is as in every {self.about}: {head.lines[found.at].strip()[:100]}"
        return Guess(format=self.name, score=0.96, reasons=(reason,))

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read the rows by what the heading states."""
        where, data = str(source.path), self._data
        lines = source.head(_LINES)
        heading = _heading(data, lines)
        if heading is None:
            raise InputError(f"no heading of a {self.about}", where=where, fix="export it again, or name another --as")
        rows = [row for row in cells_of_lines(lines[heading.rows :], heading.delimiter) if any(map(str.strip, row))]
        if not rows:
            raise InputError("no rows below the heading", where=f"{where}, line {heading.at + 1}", fix="export again")
        facts = _facts(data, lines[: heading.rows + 1])
        time, found = _time(data["time"], heading, rows, options, f"{where}, line {heading.rows + 1}")
        assigned, about = _assigned(data, heading, rows, facts, f"{where}, line {heading.at + 1 + bool(heading.below)}")
        facts |= assigned.names
        averaged = data["match"].get("averaged", True)
        starts = data["match"].get("starts")
        export = Export(
            name=self.name, file=_file(data.get("file", {}), heading, assigned, rows), time=time, assigned=assigned,
            sensor=_sensor(data["sensor"], facts), checks=_checks(data.get("check", ()), heading),
            described_by=data.get("described-by"), averaged=averaged,
            starts=starts is not None and re.search(starts, "\n".join(lines[: heading.at])) is not None,
        )  # fmt: skip
        return read_export(source, export, options).with_findings((*found, *about))


def names(format_name: str) -> Names:
    """The patterns by which a format of the catalog names its columns, and their channels."""
    return tuple((_either(layout["column"]), channel) for channel, layout in _data(format_name)["channels"].items())


@cache
def _data(name: str) -> dict[str, Any]:
    found = _SHELF.named(name)
    return parsed(found.text, where=found.where)


def _fits(pattern: str, cell: str) -> re.Match[str] | None:
    return re.fullmatch(pattern, cell[:300], re.IGNORECASE)  # a heading of any length must not cost more


def _either(patterns: Sequence[str]) -> str:
    return "|".join(f"(?:{pattern})" for pattern in patterns)


def _heading(data: Mapping[str, Any], lines: Sequence[str]) -> _Heading | None:
    match, file = data["match"], data.get("file", {})
    mark = match.get("mark", "")
    if "header" not in match:
        rows: int = file["preamble"]
        known = len(lines) > rows and re.search(mark, lines[rows - 1])
        return _Heading(at=rows - 1, rows=rows, delimiter=DELIMITERS[file["delimiter"]]) if known else None
    above = [line[:_LONGEST] for line in lines[: match.get("within", 1)]]
    if not re.search(mark, "\n".join(above)):
        return None
    for at, line in enumerate(above):
        line = line.lstrip("\ufeff# ")
        delimiter = "\t" if "\t" in line else ";" if line.count(";") > 1 or "," not in line else ","
        cells = cut(line, delimiter)
        if match.get("groups") and at:
            cells = _grouped(cut(above[at - 1], delimiter), cells)
        held = all(any(_fits(one, cell) for cell in cells) for one in match["header"])
        if held and re.search(mark, "\n".join(above[: at + 1])):
            below = cut(lines[at + 1], delimiter) if match.get("units") and at + 1 < len(lines) else []
            return _named(match, lines, at, delimiter, cells, below)
    return None


def _named(
    match: Mapping[str, Any], lines: Sequence[str], at: int, delimiter: str, cells: list[str], below: list[str]
) -> _Heading:
    rows = at + 1 + bool(match.get("units"))
    while rows < len(lines) and not lines[rows].strip(f'{delimiter} "-'):
        rows += 1
    parts = [_fits(match["cell"], cell) if "cell" in match else None for cell in cells]
    stated = [*below, *[""] * len(cells)] if below else [part["unit"] or "" if part else "" for part in parts]
    return _Heading(
        at=at, rows=rows, delimiter=delimiter, cells=cells, units=stated, below=below,
        names=[part["name"] or "" if part else cell for part, cell in zip(parts, cells, strict=True)],
    )  # fmt: skip


def _grouped(above: Sequence[str], cells: Sequence[str]) -> list[str]:
    """Names behind the name of their group, which stands above the first of it."""
    joined, group = [], ""
    for at, cell in enumerate(cells):
        group = above[at] if at < len(above) and above[at] else group
        joined.append(f"{group} {cell}".strip())
    return joined


def _facts(data: Mapping[str, Any], lines: Sequence[str]) -> defaultdict[str, str]:
    text = "\n".join(lines).lstrip("\ufeff")
    found = ((name, re.search(pattern, text, re.MULTILINE)) for name, pattern in data.get("facts", {}).items())
    return defaultdict(str, {name: match[1].strip() for name, match in found if match})


def _file(file: Mapping[str, Any], heading: _Heading, assigned: Assigned, rows: Sequence[Sequence[str]]) -> FileLayout:
    read = [int(layout.column) - 1 for layout in assigned.channels.values()]
    commas = heading.delimiter != "," and any("," in row[at] for row in rows for at in read if at < len(row))
    # A line of units that names columns of its own leaves the heading no right count of cells.
    named = bool(heading.cells) and not any(heading.below[len(heading.cells) :])
    return FileLayout(
        delimiter=heading.delimiter, decimal="," if commas else ".", preamble=heading.at if named else heading.rows,
        header=heading.rows - heading.at if named else 0, missing=tuple(file.get("missing", ())),
    )  # fmt: skip


def _time(
    time: Mapping[str, Any], heading: _Heading, rows: Sequence[Sequence[str]], options: WindOptions, where: str
) -> tuple[TimeLayout, tuple[Finding, ...]]:
    columns: list[int] = []
    zone = time.get("zone")
    for wanted in time["columns"]:
        cells = enumerate(heading.cells, start=1)
        found = (
            (wanted, None) if isinstance(wanted, int)
            else next(((at, match) for at, cell in cells if (match := _fits(wanted, cell))), None)
        )  # fmt: skip
        if found is not None:
            columns.append(found[0])
            zone = (found[1].groupdict().get("zone") if found[1] else None) or zone
    if "format" in time:
        return TimeLayout(columns=tuple(columns), format=time["format"], zone=zone), ()
    texts = [" ".join(row[at - 1].strip() for at in columns) for row in rows if len(row) >= max(columns)]
    form, order = stamp_format(texts, options, where)
    claim = heading.below[columns[0] - 1] if heading.below else ""
    if claim.upper().startswith("YYYY"):
        order = tuple(
            replace(one, severity=Severity.WARNING, what=f"{one.what}; the heading says {claim!r}") for one in order
        )
    return TimeLayout(columns=tuple(columns), format=form, zone=zone), order


def _assigned(
    data: Mapping[str, Any], heading: _Heading, rows: Sequence[Sequence[str]], facts: Mapping[str, str], where: str
) -> tuple[Assigned, list[Finding]]:
    """The columns that are read, and what was found about their units."""
    channels: Mapping[str, Mapping[str, Any]] = data["channels"]
    if not heading.cells:
        columns = [Column(number=one["column"], name=name, unit=one["unit"]) for name, one in channels.items()]
        return assign(columns, [(name, name) for name in channels], where=where, fix=_FIX), []
    stamped = [at for at, cell in enumerate(heading.cells) if any(_fits(one, cell) for one in data["time"]["columns"])]
    always = [f"{at + 1}={heading.cells[at]}" for at in stamped]
    columns: list[Column] = []
    strange: list[str] = []
    repaired: list[str] = []
    borrowed = ""
    for at, (name, written) in enumerate(zip(heading.names, heading.units, strict=False)):
        channel = next((c for c, one in channels.items() if _fits(_either(one["column"]), name)), None)
        if at in stamped or channel is None:
            columns.extend([] if at in stamped else [Column(number=at + 1, name=name, unit=written)])
            continue
        stated: str | Mapping[str, str] = channels[channel]["unit"]
        if isinstance(stated, str):
            columns.append(Column(number=at + 1, name=name, unit=stated))
            continue
        other = stated.get("else", "")
        spelled, bare = written, written.encode("ascii", "ignore").decode().strip()
        if known_unit(written) is None and bare != written and (known_unit(bare) or not bare):
            spelled = bare or other
            repaired.append(f"{name}: {written!r} is read as {known_unit(spelled)}")
        spelled = spelled or other.format_map(facts)
        if other == spelled == "points" and not any(
            any(map(str.isalpha, cell)) for row in rows for cell in row[at : at + 1]
        ):
            spelled = "deg"
        borrowed = borrowed or (spelled if not written and "{" in other else "")
        if other and heading.below:
            always.append(f"{at + 1}={channel}[{other}]")
            known = known_unit(spelled)
            strange.extend([] if known and unit(known).si == CHANNELS[channel].unit else [f"{name} in {written}"])
        columns.append(Column(number=at + 1, name=name, unit=spelled))
    short = len(heading.cells) - len(heading.below)
    if strange and (short > 0 or any("wind" in one for one in strange)):
        fewer = f", {short} fewer of them," if short > 0 else ""
        what = f"the units{fewer} do not stand below their names: {', '.join(strange[:3])}"
        fix = f'mend the line of units; or, since they are the same in every such file: --columns "{",".join(always)}"'
        raise InputError(what, where=where, fix=fix)
    assigned = assign(columns, names(data["name"]), where=where, fix=_FIX)
    layouts = dict(assigned.channels)
    for channel in {name for name, one in channels.items() if "range" in one} & layouts.keys():
        low, high = (float(unit(layouts[channel].unit).from_si(bound)) for bound in channels[channel]["range"])
        layouts[channel] = replace(layouts[channel], range=(low, high))
    found: list[Finding] = []
    if borrowed:
        what = f"speeds carry no unit: taken to be in {borrowed}, which is stated above the heading"
        found.append(Finding(kind="unit-from-preamble", severity=Severity.WARNING, what=what))
    if repaired:
        text = "; ".join(repaired)
        found.append(Finding(kind="units-repaired", severity=Severity.NOTE, count=len(repaired), what=text))
    return replace(assigned, channels=layouts), found


def _sensor(sensor: Mapping[str, Any], facts: Mapping[str, str]) -> Sensor:
    texts = {key: value.format_map(facts).strip() for key, value in sensor.items() if isinstance(value, str)}
    numbers = {key.replace("-", "_"): value for key, value in sensor.items() if key not in texts}
    height = float(texts["height"]) if texts.get("height") else None
    return Sensor(name=texts["name"], **({"height": height} if height else {}), **numbers)


def _checks(checks: Sequence[Mapping[str, Any]], heading: _Heading) -> tuple[CheckLayout, ...]:
    """The checks of columns that the file has."""
    found: list[CheckLayout] = []
    for one in checks:
        column = one["column"]
        if column in heading.cells:
            column = heading.cells.index(column) + 1
        if isinstance(column, int):
            found.append(CheckLayout(column=column, values=tuple(one["values"]), about=one["about"]))
    return tuple(found)


Davis = partial(Described, "davis")
Ecowitt = partial(Described, "ecowitt")
EddyPro = partial(Described, "eddypro")
Fluxnet = partial(Described, "fluxnet")
Hobo = partial(Described, "hobo")
Icos = partial(Described, "icos")
IcosEcosystem = partial(Described, "icos-ecosystem")
Kestrel = partial(Described, "kestrel")
Surfrad = partial(Described, "surfrad")
Windographer = partial(Described, "windographer")
Zentra = partial(Described, "zentra")
