"""Tables whose headings stand over a ruler of dashes, as reports of data bases and of ships' programs print them.

          Date     Hour   Wind dir Wind speed        =================== ========== ====
       -------  -------    -------    -------        stamp               wind speed gust
    2004/07/24 03:25:00        190         10        =================== ========== ====

Names that hold blanks are cut where the ruler is: a word belongs to the run of dashes that it stands over. So do the
words of a row, where each stands below one run, so that a stamp of two words is one cell and an empty cell stays one.
Where a sign divides the cells, it divides the names as well, and the ruler is no more than a line that is left out.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.recognition import recognise
from flagdata.ingest.anemometer.text.kinds import cell_kind, is_unit
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_RULER = re.compile(r"[ \t]*+(?:[#%!][ \t]*+)?([-=_~])\1+(?:[ \t]+\1{2,})+[ \t]*")
_WORD = re.compile(r"\S+")
_MARK = re.compile(r"^(\s*)[#%!]")
_SIGNS = re.compile(r"[\t;|]|,.*,")
"""What divides the cells of a row without a ruler."""
_SHARE = 0.95
"""Of the rows, that must fit the ruler."""
_HEIGHT = 2
"""Lines of the highest heading: names, and their units below them."""

_Span = tuple[int, int]


def matches(lines: Sequence[str]) -> bool:
    """Whether a line of words stands over a ruler, and numbers below it."""
    return _ruler(lines) is not None


def as_table(source: TextFile) -> TableText | None:
    """The file with names and cells divided by tabs as the ruler cuts them; `None` where blanks cut them as well."""
    lines = list(source.each_line())
    at = _ruler(lines)
    if at is None:
        return None
    spans = [found.span() for found in _WORD.finditer(_plain(lines[at])) if len(found[0]) > 1]
    heading = _heading(lines, at, spans)
    rows = {number: line for number, line in enumerate(lines) if number > at and _holds_numbers(line)}
    cut = _cut(rows, spans)
    as_blanks_do = not any(" " in name for name in heading[0]) and all(cut.get(n) == rows[n].split() for n in rows)
    if not cut or not all(heading[0]) or as_blanks_do:
        return None
    guesses = recognise(source)
    if guesses and guesses[0].format != "delimited":
        return None
    names = heading[0]
    if len(heading) > 1:
        names = [f"{name} [{unit.strip('[]()')}]" if unit else name for name, unit in zip(*heading, strict=True)]
    whole = ["" if _RULER.fullmatch(line) else line for line in lines]
    whole[at - len(heading) : at] = ["\t".join(names), *[""] * (len(heading) - 1)]
    for number, cells in cut.items():
        whole[number] = "\t".join(cells)
    what = f"line {at + 1} is a ruler that cuts the headings above it into {len(names)} columns: {', '.join(names)}"
    return TableText.of(source, whole, [Finding(kind="ruled-headings", severity=Severity.NOTE, what=what[:600])])


def _plain(line: str) -> str:
    """A line with blanks in place of tabs and of the sign of a comment before it."""
    return _MARK.sub(r"\1 ", line.lstrip("\ufeff").expandtabs())


def _ruler(lines: Sequence[str]) -> int | None:
    """The number, from 0, of the first ruler below a line of words and above a row."""
    for at, line in enumerate(lines[1:-1], start=1):
        if _RULER.fullmatch(line) is None:
            continue
        above, below = lines[at - 1], next((row for row in lines[at + 1 : at + 4] if row.strip()), "")
        if len(above.split()) < 2 or _SIGNS.search(above) or _SIGNS.search(below) or _RULER.fullmatch(above):
            continue
        if len(below.split()) > 1 and _holds_numbers(below) and not _holds_numbers(above):
            return at
    return None


def _holds_numbers(line: str) -> bool:
    return any(cell_kind(word) in ("number", "stamp") for word in line.split())


def _heading(lines: Sequence[str], at: int, spans: Sequence[_Span]) -> list[list[str]]:
    """The names over a ruler, and the units where a line of them stands between."""
    last = _over(_plain(lines[at - 1]), spans)
    filled = [cell for cell in last if cell]
    above = lines[at - _HEIGHT] if at >= _HEIGHT else ""
    if 2 * sum(map(is_unit, filled)) <= len(filled) or not above.strip() or _RULER.fullmatch(above):
        return [last]
    return [_over(_plain(above), spans), last]


def _over(line: str, spans: Sequence[_Span]) -> list[str]:
    """What a heading says of each run: the words over it, and those in the gaps that names stick out into.

    They stick out to the left where names end with their runs, and to the right where they begin with them.
    """
    words = [(found.start(), found.end(), found[0]) for found in _WORD.finditer(line)]
    right = sum(end == stop for _, end, _ in words for _, stop in spans)
    left = sum(start == begin for start, _, _ in words for begin, _ in spans)
    said: list[list[str]] = [[] for _ in spans]
    for start, end, word in words:
        shared = [min(end, stop) - max(start, begin) for begin, stop in spans]
        place = shared.index(max(shared))
        if max(shared) <= 0 and left != right:
            behind = [at for at, (begin, _) in enumerate(spans) if begin >= end]
            before = [at for at, (_, stop) in enumerate(spans) if stop <= start]
            place = (behind or [len(spans) - 1])[0] if right > left else (before or [0])[-1]
        said[place].append(word)
    return [" ".join(words) for words in said]


def _cut(rows: dict[int, str], spans: Sequence[_Span]) -> dict[int, list[str]]:
    """The cells of the rows that fit the ruler, by their lines' numbers; empty where too few of them do.

    Each word of a row stands below one run; else all rows have a word for each.
    """
    placed = {number: cells for number, line in rows.items() if (cells := _below(line, spans)) is not None}
    counted = {number: cells for number, line in rows.items() if len(cells := line.split()) == len(spans)}
    if len(placed) >= _SHARE * len(rows):
        unlike = sum(placed.get(number, cells) != cells for number, cells in counted.items())
        return placed if 2 * unlike < len(rows) else {}
    return counted if len(counted) >= _SHARE * len(rows) else {}


def _below(line: str, spans: Sequence[_Span]) -> list[str] | None:
    """The words of a row below each run; `None` where one stands below none, or below several."""
    said: list[list[str]] = [[] for _ in spans]
    for found in _WORD.finditer(line.expandtabs()):
        places = [at for at, (begin, stop) in enumerate(spans) if found.start() < stop and found.end() > begin]
        if len(places) != 1:
            return None
        said[places[0]].append(found[0])
    return [" ".join(words) for words in said]
