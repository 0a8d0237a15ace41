"""The heading of a table, as an open recipe describes it: where it stands, its names, units and
delimiter."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from flagdata.core.findings import Finding, Severity
from flagdata.core.schema import CHANNELS
from flagdata.core.shell import command_line
from flagdata.core.units import UNITS, name_of_unit, unit
from flagdata.errors import InputError, TimeError
from flagdata.ingest.anemometer.instants.dates import date_form
from flagdata.ingest.anemometer.sensor_recipe import DELIMITERS
from flagdata.ingest.anemometer.wind_options import WindOptions

_LONGEST = 20_000
"""Letters of a heading."""
_REST = re.compile(
    r"\s+\d{1,2}:\d{2}(?P<s>:\d{2})?(?P<f>[.,]\d+)?(?P<b>\s*)"
    r"(?P<p>[AaPp](?:\.?[Mm]\.?)?)?\s*(?P<z>Z|[+-]\d{2}:?\d{2})?$"
)


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column of a heading: its number from 1, its name, and its unit as written ("" where there
    is none)."""

    number: int
    name: str
    unit: str = ""


@dataclass(frozen=True, kw_only=True)
class Heading:
    """The line of names, from 0; the lines above the rows; the names' cells and columns, and the
    units below them."""

    at: int
    rows: int
    delimiter: str
    cells: Sequence[str] = ()
    columns: Sequence[Column] = ()
    below: Sequence[str] = ()


def fits(name: str, cell: str) -> re.Match[str] | None:
    """Matches a cell of a heading with a name or a pattern; `None` where it does not fit."""
    cell = cell[:300]  # a heading of any length must not cost more
    return re.fullmatch(name, cell, re.IGNORECASE) or re.fullmatch(
        re.escape(name), cell, re.IGNORECASE
    )


def cut(line: str, delimiter: str) -> list[str]:
    """Cuts one line of a heading into cells, without the blanks and quotes around them."""
    if delimiter == " ":
        return line.split()
    return [
        cell.strip() for cell in next(csv.reader([line.lstrip("\ufeff")], delimiter=delimiter), [])
    ]


def find(data: Mapping[str, Any], lines: Sequence[str]) -> Heading | None:
    """Finds the heading of a file by the [match] and [file] of an open recipe; `None` where it is
    not there."""
    match, file = data.get("match", {}), data.get("file", {})
    mark, preamble = match.get("mark", ""), file.get("preamble", 0)
    delimiter = DELIMITERS.get(file.get("delimiter", ""), file.get("delimiter"))
    if not lines or not re.match(match.get("first-line", ""), lines[0].lstrip("\ufeff")):
        return None
    if file.get("header", 1) == 0:
        is_there = len(lines) > preamble and re.search(mark, "\n".join(lines[:preamble]))
        return (
            Heading(at=max(preamble - 1, 0), rows=preamble, delimiter=delimiter or ",")
            if is_there
            else None
        )
    first = 0 if "header" in match else preamble
    above = [line[:_LONGEST] for line in lines[: match.get("within", first + 1)]]
    if not re.search(mark, "\n".join(above)):
        return None
    for at, line in enumerate(above[first:], start=first):
        line = line.lstrip("\ufeff# ")
        used = delimiter or (
            "\t" if "\t" in line else ";" if line.count(";") > 1 or "," not in line else ","
        )
        cells = cut(line, used)
        if match.get("groups") and at:
            cells = _grouped_names(cut(above[at - 1], used), cells)
        if match.get("stacked") and at:
            used = "\t" if "\t" in line else " "
            cells = _stacked_names(above[at - 1].lstrip("\ufeff"), above[at], used)
        complete = all(any(fits(name, cell) for cell in cells) for name in match.get("header", ()))
        if complete and re.search(mark, "\n".join(above[: at + 1])):
            heading = _heading_at(
                match, lines, at, used, cells, file.get("header", 1 + bool(match.get("units")))
            )
            row = lines[heading.rows] if heading.rows < len(lines) else ""
            return heading if re.match(match.get("row", ""), row) else None
    return None


def _heading_at(
    match: Mapping[str, Any],
    lines: Sequence[str],
    at: int,
    delimiter: str,
    cells: list[str],
    header: int,
) -> Heading:
    below = cut(lines[at + 1], delimiter) if match.get("units") and at + 1 < len(lines) else []
    rows = at + header
    while rows < len(lines) and not lines[rows].strip(f'{delimiter} "-'):
        rows += 1
    parts = [fits(match["cell"], cell) if "cell" in match else None for cell in cells]
    units = (
        [*below, *[""] * len(cells)]
        if below
        else [part["unit"] or "" if part else "" for part in parts]
    )
    names = [part["name"] or "" if part else cell for part, cell in zip(parts, cells, strict=True)]
    columns = [Column(number=i + 1, name=name, unit=units[i]) for i, name in enumerate(names)]
    return Heading(at=at, rows=rows, delimiter=delimiter, cells=cells, columns=columns, below=below)


def _grouped_names(above: Sequence[str], cells: Sequence[str]) -> list[str]:
    """Names behind the name of their group, which stands above the first of it."""
    joined, group = [], ""
    for at, cell in enumerate(cells):
        group = above[at] if at < len(above) and above[at] else group
        joined.append(f"{group} {cell}".strip())
    return joined


def _stacked_names(upper: str, lower: str, delimiter: str) -> list[str]:
    """Joins names whose first word stands in the line above: in the same cell, or over one of the
    letters."""
    if delimiter != " ":
        first, second = cut(upper, delimiter), cut(lower, delimiter)
        return [
            f"{first[at] if at < len(first) else ''} {cell}".strip()
            for at, cell in enumerate(second)
        ]
    words = [(match.start(), match.end(), match[0]) for match in re.finditer(r"\S+", upper)]
    return [
        " ".join(
            [
                *(
                    word
                    for start, end, word in words
                    if start < lower_word.end() and end > lower_word.start()
                ),
                lower_word[0],
            ]
        )
        for lower_word in re.finditer(r"\S+", lower)
    ]


def stamp_format(
    texts: Sequence[str], options: WindOptions, where: str, *, claim: str = ""
) -> tuple[str, tuple[Finding, ...]]:
    """Infers the format of stamps (see stamp_text.py) from the stamps themselves; also returns
    findings on the order of dates.

    Args:
        texts: stamps of the first rows, date before time.
        claim: what the heading says of them.

    Raises:
        TimeError: no date and time in them, or nothing that decides between day and month.
    """
    filled = [text.strip() for text in texts if text.strip()]
    date, order, reason = date_form(filled, given_order=options.date_order, where=where)
    rests = [match for text in filled if (match := _REST.search(text))]
    rest = next(iter(rests), None)
    if rest is None:
        first = filled[0] if filled else ""
        raise TimeError(f"{first!r} has no time of day", where=where, fix="export date and time")
    clock = ("%I" if rest["p"] else "%H") + ":%M" + (":%S" if rest["s"] else "")
    clock += (
        "%f" if any(match["f"] for match in rests) else ""
    )  # some loggers drop zeros at the end
    half = f"{' ' if rest['b'] else ''}%p" if rest["p"] else ""
    form = f"{date} {clock}{half}{'%z' if rest['z'] else ''}"
    if order == "ymd":
        return form, ()
    contradicted = claim.upper().startswith("YYYY")
    text = f"dates are read as {order}: {reason}" + (
        f"; the heading says {claim!r}" if contradicted else ""
    )
    return form, (
        Finding(
            kind="date-order",
            severity=Severity.WARNING if contradicted else Severity.NOTE,
            what=text,
        ),
    )


_WINDS = ("mph", "km/h", "m/s", "kn")
_ENOUGH = 5
"""Different speeds above 0 that show the unit which an instrument counts whole."""


@dataclass(frozen=True, kw_only=True)
class _Units:
    """What was found about units: notes, and why one is inferred."""

    notes: tuple[Finding, ...]
    inferred: str = ""


def unit_of(text: str) -> str | None:
    """Names the unit that an export spells as `text`; `None` where it is unknown. Inches are of
    mercury here."""
    bare = re.sub(r"^\s*[\[(](.*)[\])]\s*$", r"\1", text).strip()
    return "inHg" if bare.lower() in ("in", "inches") else name_of_unit(bare)


def channel_of(channels: Mapping[str, Mapping[str, Any]], column: Column) -> str | None:
    """Finds the channel of a column by its name, or its number where the recipe gives one."""
    for name, layout in channels.items():
        wanted = layout["column"]
        names = wanted if isinstance(wanted, list) else [wanted]
        if column.number in names or any(
            isinstance(name, str) and fits(name, column.name) for name in names
        ):
            return name
    return None


def with_units(
    data: Mapping[str, Any],
    heading: Heading,
    rows: Sequence[Sequence[str]],
    facts: Mapping[str, str],
    stamped: Iterable[int],
    options: WindOptions,
    where: str,
) -> tuple[list[Column], _Units]:
    """Reads the units of all columns but those of time."""
    channels: Mapping[str, Mapping[str, Any]] = data["channels"]
    if not heading.cells:
        columns = [
            Column(number=layout["column"], name=name, unit=layout["unit"])
            for name, layout in channels.items()
        ]
        return columns, _Units(notes=())
    columns, always = [], [f"{at}={heading.cells[at - 1]}" for at in stamped]
    strange, repaired, borrowed, inferred = [], [], "", ""
    for column in heading.columns:
        channel = channel_of(channels, column)
        if column.number in stamped or channel is None:
            columns.extend([] if column.number in stamped else [column])
            continue
        of_recipe: str | Mapping[str, str] = channels[channel]["unit"]
        if isinstance(of_recipe, str):
            columns.append(replace(column, unit=of_recipe))
            continue
        cells = [row[column.number - 1] for row in rows if len(row) >= column.number]
        otherwise, written = of_recipe.get("else", ""), column.unit
        text, bare = written, written.encode("ascii", "ignore").decode().strip()
        if unit_of(written) is None and bare != written and (unit_of(bare) or not bare):
            text = bare or otherwise
            repaired.append(f"{column.name}: {written!r} is read as {unit_of(text)}")
        text = text or otherwise.format_map(facts)
        if otherwise == text == "points" and not any(any(map(str.isalpha, cell)) for cell in cells):
            text = "deg"
        if not text and "whole" in of_recipe:
            speed_cells = [
                other_column.number - 1
                for other_column in heading.columns
                if "speed" in other_column.name.lower()
            ]
            speeds = [row[at] for row in rows for at in speed_cells if at < len(row)]
            inferred_unit = _whole_in(cells, of_recipe["whole"]) or _whole_in(
                speeds, of_recipe["whole"]
            )
            text = options.unit or inferred_unit or ""
            if not text:
                message = (
                    f"the file states no unit of {column.name!r}, and its values do not show one"
                )
                fix = "give the one that was set: --unit m/s (or km/h, mph, kn)"
                raise InputError(message, where=f"{where}, line {heading.at + 1}", fix=fix)
            if options.unit is None:
                inferred = (
                    f"{column.name!r} in {text}: inferred, its values are whole "
                    f"{of_recipe['whole']} converted"
                )
        borrowed = borrowed or (text if not written and "{" in otherwise else "")
        if otherwise and heading.below:
            always.append(f"{column.number}={channel}[{otherwise}]")
            unit_name = unit_of(text)
            right = unit_name is not None and unit(unit_name).si == CHANNELS[channel].unit
            strange.extend([] if right else [f"{column.name} in {written}"])
        columns.append(replace(column, unit=text))
    short = len(heading.cells) - len(heading.below)
    if strange and (short > 0 or any("wind" in strange_text for strange_text in strange)):
        fewer = f", {short} fewer of them," if short > 0 else ""
        message = f"the units{fewer} do not stand below their names: {', '.join(strange[:3])}"
        fix = (
            "mend the line of units; or, since they are the same in every such file: "
            f"{command_line('--columns', ','.join(always))}"
        )
        raise InputError(message, where=f"{where}, line {heading.at + 2}", fix=fix)
    notes: list[Finding] = []
    if borrowed:
        message = (
            f"speeds carry no unit: taken to be in {borrowed}, which is stated above the heading"
        )
        notes.append(Finding.of("unit-from-preamble", message))
    if repaired:
        text = "; ".join(repaired)
        notes.append(Finding.of("units-repaired", text, count=len(repaired)))
    return columns, _Units(notes=tuple(notes), inferred=inferred)


def _whole_in(cells: Iterable[str], counted: str) -> str | None:
    """Infers the unit in which all speeds are whole ones of `counted`, to one decimal; `None`
    unless there is just one."""
    texts = {cell.strip().replace(",", ".") for cell in cells}
    speeds = {float(text) for text in texts if re.fullmatch(r"\d{1,3}(\.\d)?", text)} - {0.0}
    steps = {name: UNITS[counted].scale / UNITS[name].scale for name in _WINDS}
    fits = [
        name
        for name, step in steps.items()
        if all(abs(round(round(speed / step) * step, 1) - speed) < 0.01 for speed in speeds)
    ]
    return fits[0] if len(speeds) >= _ENOUGH and len(fits) == 1 else None
