"""Tables whose headings are abbreviations that lines above explain, as archives of climate data write them.

    24-28 FG   : Mean wind speed in 0.1 m/s
    30-34 Q_FG : quality code for FG
    STAID,    DATE,   FG, Q_FG
        1,19730101,   30,    0

A heading that says nothing by itself, or no unit, is replaced by what its line above says of it, so that the table is
understood by the same words as any other. A column is named "time" where only its explanation says that it is one.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import cut
from flagdata.ingest.anemometer.text.signs import BLANKS, SIGNS
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.words.headings import fits, interest, names_time, understand, zone_of

_HEAD = 400
"""Lines of the longest legend that is read, with the heading below it."""
_LONG = 40
"""Lines of a legend that may go on behind the first lines."""
_ENTRY = re.compile(
    r"[\s#%*!;/\"'•-]*(?:\d{1,4}\s*[-–]\s*\d{1,4}\s+|(?:column|col|field)\s*\d{1,3}\s*[.:=]?\s+|\d{1,3}\s*[.)]\s+)?"
    r"(?P<name>[^\W\d][\w./%()-]{0,40})\s*(?:[:=]|\s[-–]\s|,\s|\t+|\s{3,})\s*(?P<text>\S.{2,300}?)[\s;,\"']*",
    re.IGNORECASE,
)
_OF_WORDS = re.compile(
    r"[\s#%*!;/\"'•-]*(?P<name>[^\W\d][\w./%()-]{0,40}(?: [^\W\d][\w./%()-]{0,40}){1,3}) ?[:=]\s*"
    r"(?P<text>\S.{2,300}?)[\s;,\"']*"
)
"""An entry whose name is of several words, which stand before a colon or an equals sign."""
_SPAN = re.compile(
    r"[\s#%*!;/\"'•-]*(?:start|end|begin|first|last)[ _](?:(?:date|time|day)[ _]?)+[(\[]\s*(?:UTC|GMT)\s*[)\]]"
    r"\s*[:=]\s*\d.{4,60}",
    re.IGNORECASE,
)
"""From when to when the rows are, in UTC, as the lines above them say."""
_ZONED = re.compile(r"\d:?\d\d(?:[.,]\d+)? ?(?:Z|UTC|GMT|[+-]\d\d(?::?\d\d)?)$")
"""How a stamp ends that states its zone."""
_BRACKETED = re.compile(r"[(\[<].*")
_PART = re.compile(r"\W*(year|month|day|hour|minute|second)s?\b(?! mean| average| wind)", re.IGNORECASE)
_BARE = re.compile(r"[\[(<]?\s*(?:time|date)", re.IGNORECASE)


@dataclass(frozen=True, kw_only=True)
class _Heading:
    """The line that names the columns.

    Attributes:
        at: its number from 0.
        mark: what marks it as a comment.
        delimiter: between its cells.
        cells: what it names the columns.
        told: what each abbreviation stands for, by the first line above that says it.
    """

    at: int
    mark: str
    delimiter: str
    cells: tuple[str, ...]
    told: Mapping[str, str]


def matches(lines: Sequence[str]) -> bool:
    """Whether the first lines explain a heading, or are a legend throughout."""
    if _heading(lines) is not None:
        return True
    filled = [line for line in lines if line.strip()]
    return len(filled) > _LONG and 2 * sum(_ENTRY.fullmatch(line) is not None for line in filled) > len(filled)


def as_table(source: TextFile) -> TableText | None:
    """The file with explained headings in place of those that say too little; `None` where none gains by it."""
    heading = _heading(source.head(_HEAD))
    if heading is None:
        return None
    names = [_better(cell, heading.told.get(cell, "")) for cell in heading.cells]
    zoned = _zoned(names, source.head(_HEAD), heading)
    names = names if zoned is None else zoned
    changed = [(old, new) for old, new in zip(heading.cells, names, strict=True) if old != new]
    if not any(interest(new) == 2 for _, new in changed) or len(set(names)) < len(names):
        return None
    delimiter = heading.delimiter
    if delimiter == " ":
        names = [re.sub(r"\s+", "_", _compact(name)) for name in names]
    else:
        names = [name.replace(delimiter, " ") for name in names]
    whole = list(source.each_line())
    whole[heading.at] = heading.mark + delimiter.join(names)
    shown = ", ".join(f"{old} is {new!r}" for old, new in changed if interest(new) == 2)
    what = f"the lines above line {heading.at + 1} explain its headings, which are read as they say: {shown}"
    what += "" if zoned is None else "; they give the first or last instant of the log in UTC, as its stamps are read"
    return TableText.of(source, whole, [Finding(kind="explained-headings", severity=Severity.NOTE, what=what)])


def _heading(lines: Sequence[str]) -> _Heading | None:
    """The line most of whose cells are explained above it, with rows of as many cells below."""
    told: dict[str, str] = {}
    for at, line in enumerate(lines):
        if len(told) > 1:
            mark = line[: len(line) - len(line.lstrip("#%*! \t"))] if line.lstrip()[:1] in ("#", "%", "*", "!") else ""
            for delimiter in (*SIGNS, BLANKS):
                cells = tuple(cut(line[len(mark) :].strip(), delimiter))
                known = sum(cell in told for cell in cells)
                enough = known > 1 and 2 * known >= len(cells)
                if enough and _row_below(lines[at + 1 :], cells, delimiter):
                    return _Heading(at=at, mark=mark, delimiter=delimiter, cells=cells, told=told)
        found = _ENTRY.fullmatch(line) or _OF_WORDS.fullmatch(line)
        if found is not None:
            told.setdefault(found["name"], found["text"])
    return None


def _zoned(names: Sequence[str], lines: Sequence[str], heading: _Heading) -> list[str] | None:
    """The names, that of the first time with UTC where lines above give the log's span in it; else `None`.

    So it is where neither a name nor the first row states a zone of its own.
    """
    first = next((at for at, name in enumerate(names) if names_time(name)), None)
    spans = any(_SPAN.fullmatch(line) for line in lines[: heading.at])
    if first is None or not spans or any(zone_of(name) for name in names):
        return None
    row = next((cut(line.strip(), heading.delimiter) for line in lines[heading.at + 1 :] if line.strip()), [])
    if any(_ZONED.search(cell) for cell in row):
        return None
    return [f"{name} UTC" if at == first else name for at, name in enumerate(names)]


def _row_below(lines: Sequence[str], cells: Sequence[str], delimiter: str) -> bool:
    """Whether the first of three lines with content is a row of numbers, as long as the heading."""
    rows = [line for line in lines if line.strip(" \t#")][:3]
    cut_rows = [cut(line.strip(), delimiter) for line in rows]
    return any(
        len(row) == len(cells) and 2 * sum(cell_kind(cell) != "text" for cell in row) > len(row) for row in cut_rows
    )


def _better(cell: str, text: str) -> str:
    """The heading of a column: its own, or its explanation where that says what it measures, or its unit."""
    if not text or len(text) > 120 or names_time(cell):
        return cell
    own, said = understand(cell), understand(text)
    part = _PART.match(text)
    if part is not None:
        return f"{part[1].lower()} {zone_of(text) or ''}".strip()
    if names_time(text) and _BARE.match(text) and not own.quantity:
        return f"time {cell} {zone_of(text) or ''}".strip()
    if said.spread and not own.spread:
        return text if own.quantity or "wind" in said.quantity else cell
    if not said.quantity or not said.sure:
        unit = said.unit if own.quantity and own.unit is None and fits(own.quantity, said.unit) else None
        return f"{cell} [{unit}]" if unit is not None else cell
    return cell if own.sure and own.quantity == said.quantity and own.unit is not None else text


def _compact(name: str) -> str:
    """A heading without blanks in its unit, for tables whose cells are divided by blanks."""
    unit = understand(name).unit
    return name if unit is None else f"{_BRACKETED.sub('', name).strip()} [{unit}]"
