"""The heading of a table, as an open recipe describes it: where it stands, its names, units and
delimiter."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flagdata.core.findings import Finding, Severity
from flagdata.errors import TimeError
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
