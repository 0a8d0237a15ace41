"""Tables whose cells stand in columns of characters, some of them empty or of several words: fixed width.

    FECHA     HORA  TEMP   HUM   PNM    DD    FF     NOMBRE
              [HOA] [°C]   [%]  [hPa]  [gr] [km/hr]
    25082026     0   9.7    74  1023.7   60   26     AEROPARQUE AERO
    25082026     0   4.4    86          990    7     BARILOCHE AERO

Cut at blanks, such rows have cells of different numbers, and those behind an empty one are taken for others. So they
are cut at the characters that are blank in every row; words of the lines above name the column that they stand over.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from flagdata.ingest.anemometer.recognition import recognise
from flagdata.ingest.anemometer.restating.restate import LOOKED_AT, table
from flagdata.ingest.anemometer.text.kinds import cell_kind, is_unit
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_LEAST_ROWS, _LEAST_COLUMNS = 8, 4
_NUMBERS = 2
"""Numbers that a line must hold to be a row."""
_ALIKE, _SEVERAL = 0.95, 3
"""Share of the rows with one number of words from which blanks divide them well enough, but for so many others."""
_CLEAN = 0.98
"""Share of the filled cells of a column that must be of one kind."""
_HEADING_LINES = 3
_OTHER_SIGNS = re.compile(r"[;\t|]|,.*,")
_NUMBER = re.compile(r"(?<!\S)[-+]?(?:\d+\.?\d*|\.\d+)(?!\S)")

Span = tuple[int, int]


def matches(lines: Sequence[str]) -> bool:
    """Whether rows of numbers have cells of different numbers at blanks, and stand in columns all the same."""
    return bool(_spans(_rows(lines)))


def as_table(source: TextFile) -> TableText | None:
    """The rows cut at the blanks that all of them share; `None` where those further down share none."""
    guesses = recognise(source)
    if guesses and guesses[0].format != "delimited":
        return None
    lines = list(source.each_line())
    rows = _rows(lines)
    spans = _spans(rows)
    if len(spans) < len(_spans(_rows(lines[:LOOKED_AT]))):
        return None
    first = next(at for at, line in enumerate(lines) if line == rows[0])
    above = [line for line in lines[max(0, first - _HEADING_LINES) : first] if line.strip()]
    cells = [[line[start:end].strip() for start, end in spans] for line in rows]
    others = sum(bool(line.strip()) for line in lines) - len(rows) - len(above)
    what = "a table of fixed width, some of whose cells are empty or of several words: cut at the blanks of all rows"
    return table(source, _names(above, spans), cells, kind="fixed-width", what=what, left_out=max(0, others))


def _rows(lines: Sequence[str]) -> list[str]:
    """Lines of several numbers, from the first of them on, without signs that divide cells."""
    return [line for line in lines if len(_NUMBER.findall(line)) >= _NUMBERS and not _OTHER_SIGNS.search(line)]


def _spans(rows: Sequence[str]) -> list[Span]:
    """The columns of characters of the rows; none where blanks divide them alike, or they stand in no columns."""
    counts = Counter(len(row.split()) for row in rows)
    others = len(rows) - max(counts.values(), default=0)
    if len(rows) < _LEAST_ROWS or others < max(_SEVERAL, (1 - _ALIKE) * len(rows)):
        return []
    width = max(map(len, rows))
    used = [False] * width
    for row in rows:
        for match in re.finditer(r"\S+", row):
            used[match.start() : match.end()] = [True] * (match.end() - match.start())
    spans = [match.span() for match in re.finditer("1+", "".join("1" if one else "0" for one in used))]
    spans = _with_words_together(rows, spans)
    return spans if len(spans) >= _LEAST_COLUMNS and all(_of_one_kind(rows, span) for span in spans) else []


def _with_words_together(rows: Sequence[str], spans: Sequence[Span]) -> list[Span]:
    """The columns, of which neighbours of words that one blank divides are one."""
    found: list[Span] = []
    for start, end in spans:
        if found and start - found[-1][1] == 1 and _worded(rows, found[-1]) and _worded(rows, (start, end)):
            found[-1] = (found[-1][0], end)
        else:
            found.append((start, end))
    return found


def _kinds(rows: Sequence[str], span: Span) -> Counter[str]:
    cells = (row[span[0] : span[1]].strip() for row in rows)
    return Counter(cell_kind(cell) for cell in cells if cell)


def _worded(rows: Sequence[str], span: Span) -> bool:
    kinds = _kinds(rows, span)
    return kinds["text"] > kinds["number"] + kinds["stamp"]


def _of_one_kind(rows: Sequence[str], span: Span) -> bool:
    """Whether the filled cells of a column are numbers and stamps, each alone, or words."""
    kinds = _kinds(rows, span)
    known = sum(kinds.values()) - kinds["missing"]
    return not known or max(kinds["number"] + kinds["stamp"], kinds["text"]) >= _CLEAN * known


def _names(above: Sequence[str], spans: Sequence[Span]) -> list[str]:
    """A name for each column, of the words above it, with the unit below them in brackets."""
    names = [""] * len(spans)
    for line in above:
        words = [(match.start(), match.end(), match[0]) for match in re.finditer(r"\S+(?: \S+)*", line)]
        if len(words) != len(spans):
            words = [(match.start(), match.end(), match[0]) for match in re.finditer(r"\S+", line)]
        for at, (start, end, word) in enumerate(words):
            column = at if len(words) == len(spans) else _nearest(spans, start, end)
            unit = is_unit(word) and bool(names[column])
            names[column] = f"{names[column]} [{word.strip('[]()')}]" if unit else f"{names[column]} {word}".strip()
    return names


def _nearest(spans: Sequence[Span], start: int, end: int) -> int:
    """The column that a word stands over, or is next to."""

    def apart(span: Span) -> tuple[int, float]:
        gap = max(span[0] - end, start - span[1], 0)
        return gap, abs(span[0] + span[1] - start - end) / 2

    return min(range(len(spans)), key=lambda at: apart(spans[at]))
