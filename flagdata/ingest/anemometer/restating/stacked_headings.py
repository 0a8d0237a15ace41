"""Tables whose headings are stacked over several lines, so that no line alone says what a column is.

                 Wind    Wind         Max
    Date  Time   Speed   Direction    Gust
                 km/h    deg          km/h

The words above each other are put together into one heading, after the line of units where there is one. Where cells
are divided by blanks, a word belongs to the column that it stands above; where they are divided by a sign, a heading
with nothing behind it is that of the columns up to the next, as spreadsheets write merged cells.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from typing import TypeAlias

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.recognition import recognise
from flagdata.ingest.anemometer.text.kinds import cell_kind, is_unit
from flagdata.ingest.anemometer.text.layout import Layout, cut, lay_out
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.words.headings import interest, names_time, understand, words_of
from flagdata.ingest.anemometer.words.wind_words import WIND

_MOST = 4
"""Lines of the highest stack, units among them."""
_WORD = re.compile(r"\S+")

_Span: TypeAlias = tuple[float, float]


def matches(lines: Sequence[str]) -> bool:
    """Whether two lines without numbers stand above the first row."""
    layout = lay_out(lines, interest=interest)
    return layout is not None and len(_stack(lines, layout)) > 1


def as_table(source: TextFile) -> TableText | None:
    """The file with its headings in one line; `None` where that of the time tells as many winds as all together."""
    lines = source.head()
    layout = lay_out(lines, interest=interest)
    if layout is None:
        return None
    stack = _stack(lines, layout)
    if len(stack) < 2:
        return None
    spans = _spans(lines, layout)
    by_line = {at: _cells(lines[at], layout, spans) for at in stack}
    below = stack[-1] if _tells_units(by_line[stack[-1]]) else None
    named = [at for at in stack if at != below]
    if len(named) < 2:
        return None
    by_line |= {at: _merged(by_line[at]) for at in named[:-1]}
    names = [" ".join(filter(None, parts)) for parts in zip(*(by_line[at] for at in named), strict=True)]
    if any(_heads_a_time(by_line[at], by_line[at + 1]) for at in named[:-1]):
        return None
    timed = [_winds(by_line[at]) for at in named if any(map(names_time, by_line[at]))]
    if not timed or _winds(names) <= max(timed):
        return None
    guesses = recognise(source)
    if guesses and guesses[0].format != "delimited":
        return None
    units = by_line[below] if below is not None else [""] * len(names)
    whole = list(source.each_line())
    for at in stack:
        whole[at] = ""
    whole[stack[-1]] = _joined(names, units, layout.delimiter)
    what = f"lines {stack[0] + 1} to {stack[-1] + 1} head the columns together: " + ", ".join(filter(None, names))
    return TableText.of(source, whole, [Finding(kind="stacked-headings", severity=Severity.NOTE, what=what[:600])])


def _stack(lines: Sequence[str], layout: Layout) -> list[int]:
    """Numbers from 0 of the lines of words right above the first row, the highest first."""
    found: list[int] = []
    spans = _spans(lines, layout)
    at = layout.lines[0] - 2
    while at >= 0 and len(found) < _MOST:
        cells = [cell for cell in cut(lines[at].strip(), layout.delimiter) if cell]
        if not cells or any(cell_kind(cell) in ("number", "stamp") for cell in cells):
            break
        if layout.delimiter != " " and not 1 < len(cells) <= layout.number_of_columns():
            break
        if found and layout.delimiter == " " and _is_text(lines[at], spans):
            break
        found.append(at)
        at -= 1
    return found[::-1]


def _cells(line: str, layout: Layout, spans: Sequence[_Span]) -> list[str]:
    """What a line of the stack says of each column, "" where it says nothing."""
    width = layout.number_of_columns()
    if layout.delimiter != " ":
        cells = cut(line.lstrip("\ufeff"), layout.delimiter)[:width]
        return [*cells, *[""] * (width - len(cells))]
    said: list[list[str]] = [[] for _ in range(width)]
    for word, place in _placed(line, spans):
        said[place].append(word[0])
    return [" ".join(words) for words in said]


def _placed(line: str, spans: Sequence[_Span]) -> list[tuple[re.Match[str], int]]:
    """The words of a line that is divided by blanks, each with the column that it stands above."""
    found: list[tuple[re.Match[str], int]] = []
    for word in _WORD.finditer(line.expandtabs()):
        middle = (word.start() + word.end()) / 2
        away = [max(low - middle, middle - high, 0.0) for low, high in spans]
        found.append((word, away.index(min(away))))
    return found


def _is_text(line: str, spans: Sequence[_Span]) -> bool:
    """Whether a line runs on over the columns, as a title does: one blank lies between words of different columns."""
    placed = _placed(line, spans)
    return any(
        place != other and after.start() - word.end() == 1
        for (word, place), (after, other) in itertools.pairwise(placed)
    )


def _merged(cells: Sequence[str]) -> list[str]:
    """Cells of which those without a word have that of the one before, unless that names a time."""
    found: list[str] = []
    for cell in cells:
        before = found[-1] if found else ""
        found.append(cell or ("" if names_time(before) else before))
    return found


def _spans(lines: Sequence[str], layout: Layout) -> list[_Span]:
    """From where to where each column's cells stand in the first rows."""
    width = layout.number_of_columns()
    spans: list[_Span] = [(float("inf"), 0.0)] * width
    for number in layout.lines[:20]:
        words = list(_WORD.finditer(lines[number - 1].expandtabs()))
        if len(words) == width:
            spans = [(min(a, w.start()), max(b, w.end())) for (a, b), w in zip(spans, words, strict=True)]
    return spans


def _heads_a_time(above: Sequence[str], below: Sequence[str]) -> bool:
    """Whether words stand above the name of a time that name none, as a title's do."""
    return any(word and names_time(name) and not names_time(word) for word, name in zip(above, below, strict=True))


def _tells_units(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell]
    return 2 * sum(is_unit(cell.strip("[]()")) for cell in filled) > len(filled)


def _winds(names: Sequence[str]) -> int:
    """How many columns say in words that they are a wind's speed or direction, or its gust."""
    found = [(understand(name), words_of(name)) for name in names]
    return sum(said.sure and "wind" in said.quantity and not WIND.isdisjoint(words) for said, words in found)


def _joined(names: Sequence[str], units: Sequence[str], delimiter: str) -> str:
    """One line of headings with their units in brackets, divided as the rows are."""
    headings = [f"{name} [{unit.strip('[]()')}]" if unit else name for name, unit in zip(names, units, strict=True)]
    if delimiter == " ":
        return " ".join(re.sub(r"\s+", "_", heading) or "-" for heading in headings)
    return delimiter.join(heading.replace(delimiter, " ") for heading in headings)
