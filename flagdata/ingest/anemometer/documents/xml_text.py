"""XML with one element a reading, made a table that every format reads.

    <obs time="2026-05-01T12:00:00Z"><windSpeed unit="m/s">4.2</windSpeed><windDir>210</windDir></obs>

An element's attributes, and the elements within it, become columns called by their names, joined with points; a unit
that an attribute states stands behind the name in brackets. Of elements of one name within a reading the attribute
that tells them apart is the name of the column. What elements around the readings say belongs to each of them; where
it is the same for all it stands above the table.
"""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element

from flagdata.errors import InputError, LimitError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.words.headings import names_time, understand

LARGEST = 64 * 1024**2
"""Bytes of the largest document that is read."""
_WIDEST = 2000
_DEEPEST = 8
_UNITS = ("unit", "units", "uom")
_NAMES = ("name", "id", "type", "code", "parameter", "key", "label", "variable")
_NAMED = 12
"""Values that a note names where they are left out."""
_NOT_XML = ("gpx", "kml", "svg", "html", "rss", "feed")
"""Roots of documents that are no readings."""


def matches(lines: Sequence[str]) -> bool:
    """Whether a file begins as XML does; HTML is not meant."""
    start = "".join(lines[:20]).lstrip("\ufeff \t\r").lower()
    return start.startswith("<?xml") and "<html" not in start


def as_table(source: TextFile) -> TableText | None:
    """The readings of a document as a table whose first line names the columns; `None` where it holds none.

    Raises:
        InputError: the document is not well-formed.
        LimitError: it is larger than `LARGEST`, or has more columns than a table may.
    """
    where = str(source.path)
    text = "\n".join(source.each_line())
    if len(text) > LARGEST:
        raise LimitError(f"XML of more than {LARGEST} bytes", where=where, fix="split it, or export it as CSV")
    if "<!ENTITY" in text:
        fix = "export it as CSV with one row a reading"
        raise InputError("XML that defines entities of its own, which may unfold without end", where=where, fix=fix)
    try:
        root = ET.fromstring(text.lstrip("\ufeff \t\r\n"))
    except ET.ParseError as error:
        fix = "copy it again, or export it as CSV with one row a reading"
        raise InputError(f"XML that is not well-formed: {error.msg}", where=where, fix=fix) from None
    if _tag(root).lower() in _NOT_XML:
        return None
    found = _readings(root)
    if found is None:
        return None
    tag, said, around = found
    own = [one.cells for one in said]
    apart = tuple(dict.fromkeys(name for one in said for name in one.apart))
    shared = {name: cell for name, cell in around[0].items() if all(row.get(name) == cell for row in around)}
    rows = [
        {name: cell for name, cell in outer.items() if name not in shared} | row
        for outer, row in zip(around, own, strict=True)
    ]
    names = tuple(dict.fromkeys(name for row in rows for name in row))
    if len(names) > _WIDEST:
        raise LimitError(f"XML with more than {_WIDEST} columns", where=where, fix="write those needed to a CSV file")
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerows(shared.items())
    writer.writerow(names)
    writer.writerows([row.get(name, "") for name in names] for row in rows)
    what = f"XML, read as a table with a row for each <{tag}>; lines are counted with its heading as the first"
    notes = [Finding(kind="xml-table", severity=Severity.NOTE, what=what)]
    if apart:
        what = f"values with an instant or a period of their own are left out, among them {', '.join(apart[:_NAMED])}"
        notes.append(Finding(kind="other-instants", severity=Severity.NOTE, count=len(apart), what=what))
    return TableText.of(source, out.getvalue().splitlines(), notes)


@dataclass(frozen=True, kw_only=True)
class _Said:
    """What a reading says.

    Attributes:
        cells: by the names of their columns.
        apart: names of values that state an instant or a period of their own, which is none of the reading's.
    """

    cells: dict[str, str]
    apart: list[str]


def _readings(root: Element) -> tuple[str, list[_Said], list[dict[str, str]]] | None:
    """The elements that are readings: their tag, what each says, and what is said around each."""
    groups: dict[tuple[str, ...], list[tuple[Element, Mapping[str, str]]]] = {}
    for path, element, around in _walk(root, (), {}):
        groups.setdefault(path, []).append((element, around))
    best: tuple[tuple[bool, int, int], tuple[str, ...]] | None = None
    for path, members in groups.items():
        element, around = members[0]
        said = _said(element).cells
        timed = any(names_time(name) for name in (*said, *around)) or any(
            cell_kind(cell) == "stamp" for cell in said.values()
        )
        wind = any("wind" in understand(name).quantity for name in said)
        if len(said) + len(around) > 1 and timed and (wind or len(members) > 1):
            rank = (wind, len(members), -len(path))
            best = max(best, (rank, path)) if best is not None else (rank, path)
    if best is None:
        return None
    chosen = groups[best[1]]
    return best[1][-1], [_said(element) for element, _ in chosen], [dict(around) for _, around in chosen]


def _walk(
    element: Element, path: tuple[str, ...], around: Mapping[str, str]
) -> Iterator[tuple[tuple[str, ...], Element, Mapping[str, str]]]:
    """Each element below the root, with its path and what the elements around it say."""
    here = (*path, _tag(element))
    if path:
        yield here, element, around
    if len(here) > _DEEPEST:
        return
    counts = Counter(_tag(child) for child in element)
    plain = _attributes(element) | {
        _tag(child): (child.text or "").strip()
        for child in element if counts[_tag(child)] == 1 and not len(child) and (child.text or "").strip()
    }  # fmt: skip
    for child in element:
        if len(child) or child.attrib or counts[_tag(child)] > 1:
            yield from _walk(child, here, {**around, **plain})


def _said(element: Element) -> _Said:
    """What a reading says, by the names of its columns."""
    found = _Said(cells=_attributes(element), apart=[])
    _fill(found, "", element, 0)
    if not len(element) and (element.text or "").strip():
        found.cells.setdefault(_tag(element), _text(element.text))
    return found


def _fill(found: _Said, before: str, element: Element, depth: int) -> None:
    cells = found.cells
    counts = Counter(_tag(child) for child in element)
    for number, child in enumerate(element, start=1):
        told = next((child.get(key) for key in _NAMES if child.get(key)), None)
        name = told if told is not None else _tag(child)
        if told is None and counts[_tag(child)] > 1:
            name = f"{name}.{number}"
        name = f"{before}.{name}" if before else name
        unit = next((child.get(key) for key in _UNITS if child.get(key)), None)
        others = {key: cell for key, cell in _attributes(child).items() if key not in (*_UNITS, *_NAMES)}
        if not len(child) and (child.text or "").strip():
            stamps = {cell for key, cell in others.items() if names_time(key) and cell_kind(cell) == "stamp"}
            if stamps - set(cells.values()):
                found.apart.append(name)
                continue
            cells.setdefault(_with_unit(name, unit), _text(child.text))
            others = {}
        for key, cell in others.items():
            one = len(others) == 1 or key == "value"
            inner = name if key == "value" else f"{name}.{key}"
            cells.setdefault(_with_unit(inner, unit if one else None), cell)
        if len(child) and depth < _DEEPEST and len(cells) <= _WIDEST:
            _fill(found, name, child, depth + 1)


def _with_unit(name: str, unit: str | None) -> str:
    return name if unit is None else f"{name} [{unit}]"


def _attributes(element: Element) -> dict[str, str]:
    return {key.rpartition("}")[2]: _text(cell) for key, cell in element.attrib.items()}


def _tag(element: Element) -> str:
    """The name of an element without its namespace."""
    return str(element.tag).rpartition("}")[2]


def _text(text: str | None) -> str:
    return " ".join((text or "").split())
