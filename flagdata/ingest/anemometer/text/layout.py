"""How an unknown table is laid out: its delimiter, where its rows begin, and which line names the columns."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from flagdata.compass import CALM
from flagdata.ingest.anemometer.text import settings
from flagdata.ingest.anemometer.text.kinds import OF_LOGS, CellKind, cell_kind, is_unit, unit_behind
from flagdata.ingest.anemometer.text.rows import blank_cells
from flagdata.ingest.anemometer.words.headings import names_time
from flagdata.units import UNITS, spelled

TAIL = 200
"""Lines at the end of those looked at by which the delimiter is told; half of them where the file is short."""
_LEAST = 2
"""Lines at the end that may tell the delimiter where more of them do not."""
_CANDIDATES = (";", "\t", ",", "|", " ")
_STRONG = (";", "\t", "|")
_CELLS = 4
"""Cells of a line that these signs divide, from which on they do and no other."""
_MARK = re.compile(r"^\s*[#%!]+\s*|^\s*//\s*")
_NAMING = re.compile(r"^\s*@\s*")
"""How the line of names begins in tables of crop models (DSSAT), which are divided by blanks."""
_BRACKETS = re.compile(r"[(\[（]([^()\[\]（）]{1,12})[)\]）]\s*$")
_LEAST_UNITS = 2
"""In brackets that make a second line of names one that tells units."""
_COUNTED = 6
"""Columns that are numbered one after another in a heading."""
_HEADING_LINES = 10
"""Lines that the heading, its units and blank lines below it may take."""


@dataclass(frozen=True, kw_only=True)
class Layout:
    """A table as its first lines show it.

    Attributes:
        delimiter: between cells; " " stands for any run of blanks.
        decimal: "." or ",".
        preamble: lines before the one that names the columns, or before the first row where none does.
        header: lines from the one that names the columns to the last one before the rows; 0 where none does.
        names: of the columns, as many as a row has cells; "" where there is none.
        units: below the names, as many, "" where there is none.
        by_name: whether a recipe can find the columns by these names (else by number).
        rows: the first rows, each of as many cells.
        lines: of `rows`, counted from 1.
        suffixes: of the columns, the unit behind every number ("4.3 mph"); "" where there is none.
        unit_columns: of the columns, the index of the next one where that spells their unit in every row; else `None`.
        strange: what of the heading is not understood.
        short: how many columns the heading names, where rows have more and it is taken for the first of them; else 0.
        named: how many columns the heading names, where rows hold fewer, whose cells beyond are empty; else 0.
        site: index of the column that tells sites apart, once it is known.
    """

    delimiter: str
    decimal: Literal[".", ","]
    preamble: int
    header: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    by_name: bool
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    suffixes: tuple[str, ...] = ()
    unit_columns: tuple[int | None, ...] = ()
    strange: tuple[str, ...] = ()
    short: int = 0
    named: int = 0
    site: int | None = None

    def column(self, index: int) -> list[str]:
        """Cells of a column, trimmed, without the unit behind their numbers."""
        suffix = self.suffixes[index] if self.suffixes else ""
        return [row[index].strip().removesuffix(suffix).rstrip() for row in self.rows]

    def number_of_columns(self) -> int:
        return len(self.names)


def lay_out(lines: Sequence[str], *, interest: Callable[[str], int]) -> Layout | None:
    """The table that `lines` hold, if any: at least two columns, of which a number of rows agree.

    Args:
        lines: the beginning of the file.
        interest: how much a cell looks like the heading of a time or a wind, to tell the line of names.
    """
    return _laid_out(tuple(lines), interest)


@lru_cache(maxsize=4)
def _laid_out(lines: tuple[str, ...], interest: Callable[[str], int]) -> Layout | None:
    """See `lay_out`; whoever recognises, completes and reads a table asks for the same lines."""
    filled = [(number, line) for number, line in enumerate(lines) if line.strip(" \t\x00\x1a")]
    tail = min(TAIL, max(1, len(filled) // 2))
    found = _lay_out(lines, filled, tail, interest)
    if found is None:
        found = _above_a_legend(lines, interest)
    while found is None and _LEAST < tail < TAIL:
        # A short log below a long preamble: fewer lines of its end may be rows alone. Their names must bear it out.
        tail = max(_LEAST, tail // 2)
        shorter = _lay_out(lines, filled, tail, interest)
        if shorter is not None and _named(shorter, interest):
            found = shorter
    return found


def _above_a_legend(lines: Sequence[str], interest: Callable[[str], int]) -> Layout | None:
    """The table above one of the blank lines of a short file, where notes follow it; its names must bear it out."""
    if len(lines) > TAIL:
        return None
    for end in reversed([at for at, line in enumerate(lines) if not line.strip()]):
        above = [(number, line) for number, line in enumerate(lines[:end]) if line.strip(" \t\x00\x1a")]
        found = _lay_out(lines[:end], above, max(1, len(above) // 2), interest) if above else None
        if found is not None and _named(found, interest):
            return found
    return None


def _named(layout: Layout, interest: Callable[[str], int]) -> bool:
    """Whether the names of a table bear out that it is one."""
    return layout.by_name and sum(interest(name) > 0 for name in layout.names) > 1


def _lay_out(
    lines: Sequence[str], filled: Sequence[tuple[int, str]], tail: int, interest: Callable[[str], int]
) -> Layout | None:
    """The table that `lines` hold, if any, as the last `tail` of its `filled` lines divide their cells."""
    delimiter = _delimiter([line for _, line in filled[-tail:]])
    if delimiter is None:
        return None
    table = [(number, cut(line, delimiter)) for number, line in filled]
    width = _width([cells for _, cells in table[-tail:]], [cells for _, cells in table[:-tail]])
    typed = _typed([cells for _, cells in table[-tail:] if len(_trimmed(cells, width)) == width], width)
    if width < 2 or not typed:
        return None
    fits = [_is_row(cells, width, typed) for _, cells in table]
    first = next(
        (
            at for at in range(len(table))
            if fits[at] and _mostly(fits[at : at + 20]) and not _counts_columns(table[at][1], typed)
            and not _names_follow(table[at + 1 : at + 3], fits[at + 1 : at + 3], interest)
            and not (delimiter == " " and any(_NAMING.match(line) for _, line in filled[at : at + _HEADING_LINES]))
        ),
        None,
    )  # fmt: skip
    if first is None:
        return None
    start = table[first][0]
    kept = [(number, _trimmed(cells, width)) for (number, cells), fit in zip(table, fits, strict=True) if fit]
    kept = [(number, cells) for number, cells in kept if number >= start]
    rows = tuple(tuple(cells) for _, cells in kept)
    full = Counter(len(cells) for (_, cells), fit in zip(table, fits, strict=True) if fit).most_common(1)[0][0]
    names, units, at, by_name, strange = _heading(lines, start, delimiter, (width, full), interest)
    short = _short(lines, at, delimiter, width)
    if at is not None and len(cut(lines[at], delimiter)) < width and _leaves_out_the_last(names, rows):
        names, short = (*names[1:], ""), width - 1
    if short and _shifted(table, names, kept, short, interest):
        strange = (*strange, f"line {(at or 0) + 1} names {short} columns, but rows have {width}, and do not fit it")
        names, units, at, by_name, short = ("",) * width, ("",) * width, None, False, 0
    suffixes = tuple(_suffix([row[index] for row in rows]) for index in range(width))
    numbered = frozenset(typed)
    beside = tuple(_unit_column(rows, index) if index in numbered else None for index in range(width))
    units = tuple(
        unit or suffix or ("" if other is None else _first(rows, other))
        for unit, suffix, other in zip(units, suffixes, beside, strict=True)
    )
    decimal: Literal[".", ","] = "," if delimiter != "," and _decimal_commas(rows) else "."
    return Layout(
        delimiter=delimiter, decimal=decimal, preamble=start if at is None else at,
        header=0 if at is None else start - at, names=names, units=units, by_name=by_name, rows=rows,
        lines=tuple(number + 1 for number, _ in kept), suffixes=suffixes, unit_columns=beside, strange=strange,
        short=short, named=0 if at is None or delimiter == " " else _beyond(lines[at], delimiter, width),
    )  # fmt: skip


def _counts_columns(cells: Sequence[str], typed: Sequence[int]) -> bool:
    """Whether a line is a heading that counts: words above columns of numbers, and 0, 1, 2 … above all others."""
    kinds = {index: cell_kind(cells[index]) for index in typed if index < len(cells)}
    counted = [cells[index].strip() for index, kind in kinds.items() if kind == "number"]
    if "text" not in kinds.values() or len(counted) < _COUNTED or not all(map(str.isdigit, counted)):
        return False
    return [int(cell) for cell in counted] == list(range(int(counted[0]), int(counted[0]) + len(counted)))


def _names_follow(rows: Sequence[tuple[int, list[str]]], fits: Sequence[bool], interest: Callable[[str], int]) -> bool:
    """Whether a line of names comes behind a line of numbers, which then numbers the columns."""
    return any(
        not fit and sum(interest(cell) > 0 for cell in cells) > 1
        and sum(cell_kind(cell) in ("number", "stamp") for cell in cells) == 0
        for (_, cells), fit in zip(rows, fits, strict=True)
    )  # fmt: skip


def _short(lines: Sequence[str], at: int | None, delimiter: str, width: int) -> int:
    """How many columns a heading names that has fewer cells than the rows; 0 where it has as many."""
    if at is None or delimiter == " ":
        return 0
    found = len(cut(lines[at].lstrip("\ufeff"), delimiter))
    return found if 1 < found < width - 1 else 0  # one less is a heading of R, which leaves out that of the row names


def _beyond(heading: str, delimiter: str, width: int) -> int:
    """How many columns a heading names that are more than the cells of a row; 0 where there are none."""
    names = cut(heading, delimiter)
    return next((at for at in range(len(names), width, -1) if names[at - 1]), 0)


def _leaves_out_the_last(names: Sequence[str], rows: Sequence[Sequence[str]]) -> bool:
    """Whether a heading with one name less than the rows have cells does not name the last column, as R the first.

    Its first name is that of a time, which stands in the first column of the rows and not in the second.
    """
    if len(names) < 2 or names[0] or not names_time(names[1]):
        return False
    first, second = (sum(cell_kind(row[index]) == "stamp" for row in rows) for index in (0, 1))
    return first > 0.5 * len(rows) > second


def _shifted(
    table: Sequence[tuple[int, list[str]]],
    names: Sequence[str],
    rows: Sequence[tuple[int, list[str]]],
    short: int,
    interest: Callable[[str], int],
) -> bool:
    """Whether a heading that is shorter than the rows is of other rows: they are there, or its quantities are words.

    Args:
        short: the number of cells of the heading.
    """
    own = [cells for _, cells in table if len(cells) == short]
    if any(sum(cell_kind(cell) in ("number", "stamp") for cell in cells) > short / 2 for cells in own):
        return True
    return any(
        interest(name) and sum(cell_kind(cells[index]) == "text" for _, cells in rows) > 0.5 * len(rows)
        for index, name in enumerate(names)
    )


def cut(line: str, delimiter: str) -> list[str]:
    """Cells of one line, trimmed; quotes bind where they are closed."""
    if delimiter == " ":
        return blank_cells(line)
    if '"' in line and line.count('"') % 2 == 0:
        return [cell.strip() for cell in next(csv.reader([line.strip("\r\n")], delimiter=delimiter), [])]
    return [cell.strip() for cell in line.split(delimiter)]


def _suffix(cells: Sequence[str]) -> str:
    """The unit behind the numbers of a column; "" where nine of ten do not share one."""
    known = [cell.strip() for cell in cells if _kind(cell) != "missing"]
    if not known or not unit_behind(known[0]):
        return ""
    suffix, count = Counter(map(unit_behind, known)).most_common(1)[0]
    return suffix if count >= 0.9 * len(known) else ""


def _unit_column(rows: Sequence[Sequence[str]], index: int) -> int | None:
    """The column next to a column of numbers, where all its cells spell one unit of what a log measures.

    Units side by side are a list of those of the whole row, not the unit of the number before them.
    """
    if index + 1 >= len(rows[0]):
        return None
    name, beyond = _unit_of_all(rows, index + 1), _unit_of_all(rows, index + 2)
    if beyond is not None:
        return None
    return index + 1 if name is not None and UNITS[name].si in OF_LOGS and name != "1" else None


def _unit_of_all(rows: Sequence[Sequence[str]], index: int) -> str | None:
    """The unit that all cells of a column spell, in the table's name."""
    cells = {row[index].strip() for row in rows} - {""} if index < len(rows[0]) else set()
    return spelled(cells.pop()) if len(cells) == 1 else None


def _first(rows: Sequence[Sequence[str]], index: int) -> str:
    return next((row[index].strip() for row in rows if row[index].strip()), "")


def _delimiter(lines: Sequence[str]) -> str | None:
    """The delimiter that cuts most lines into equally many cells of which most are numbers or stamps."""
    best: tuple[float, str] | None = None
    strong = [sign for sign in _STRONG if _divides(lines, sign)]
    for delimiter in _CANDIDATES:
        if strong and delimiter not in strong:
            continue  # a comma between decimals, or a blank within a cell
        table = [cut(line, delimiter) for line in lines]
        width = _width(table)
        rows = [_trimmed(cells, width) for cells in table]
        rows = [cells for cells in rows if len(cells) == width]
        if width < 2 or not rows:
            continue
        kinds = Counter(cell_kind(cell) for cells in rows for cell in cells)
        known = sum(kinds.values()) - kinds["missing"]
        clean = (kinds["number"] + kinds["stamp"]) / known if known else 0.0
        score = clean * len(rows) / len(lines)
        # Blanks also stand inside a stamp: a delimiter that does as well goes before them.
        if best is None or score > best[0] + (0.05 if delimiter == " " else 0.0):
            best = (score, delimiter)
    return best[1] if best is not None and best[0] > 0.1 else None


def _divides(lines: Sequence[str], sign: str) -> bool:
    """Whether a sign that seldom stands in a cell divides all lines but one of ten into equally many cells."""
    counts = Counter(len(cut(line, sign)) for line in lines)
    width, often = counts.most_common(1)[0] if counts else (0, 0)
    return width >= _CELLS and often >= 0.9 * len(lines)


def _width(table: Sequence[Sequence[str]], above: Sequence[Sequence[str]] = ()) -> int:
    """The usual number of cells of a table, less those at the end that are empty in all its rows and in those above.

    A sensor that fails, or a remark that nobody writes any more, leaves the last column empty from then on.
    """
    counts = Counter(len(cells) for cells in table)
    if not counts:
        return 0
    usual = max(counts.items(), key=lambda item: (item[1], item[0]))[0]
    rows = [cells for cells in table if len(cells) == usual]
    rows += [cells for cells in above if len(cells) == usual and _of_numbers(cells)]
    width = usual
    while width > 1 and all(not cells[width - 1].strip() for cells in rows):
        width -= 1
    return width


def _of_numbers(cells: Sequence[str]) -> bool:
    """Whether a line holds numbers and stamps in half of its filled cells or more, as rows do and headings do not."""
    kinds = Counter(_kind(cell) for cell in cells)
    return kinds["number"] + kinds["stamp"] >= max(1, kinds["text"])


def _trimmed(cells: Sequence[str], width: int) -> list[str]:
    """A row without empty cells beyond `width`."""
    kept = list(cells)
    while len(kept) > width and not kept[-1].strip():
        kept.pop()
    return kept


def _typed(rows: Sequence[Sequence[str]], width: int) -> list[int]:
    """Columns that hold numbers or stamps in nine rows of ten, missing cells apart."""
    found: list[int] = []
    for index in range(width):
        kinds = Counter(_kind(row[index]) for row in rows)
        if kinds["number"] + kinds["stamp"] and kinds["text"] <= 0.1 * (len(rows) - kinds["missing"]):
            found.append(index)
    return found


def _kind(cell: str) -> CellKind:
    """What a cell of a row seems to hold; a word for calm air is as good as a missing number or direction."""
    return "missing" if cell.strip().lower() in CALM else cell_kind(cell)


def _is_row(cells: Sequence[str], width: int, typed: Sequence[int]) -> bool:
    row = _trimmed(cells, width)
    if len(row) != width:
        return False
    kinds = Counter(_kind(row[index]) for index in typed)
    return kinds["number"] + kinds["stamp"] > 0 and kinds["text"] <= 0.2 * (len(typed) - kinds["missing"])


def _mostly(fits: Sequence[bool]) -> bool:
    return sum(fits) >= 0.8 * len(fits)


def _decimal_commas(rows: Sequence[Sequence[str]]) -> bool:
    cells = (cell.strip() for row in rows for cell in row)
    return any(re.match(r"[-+]?\d+,\d+(?![\d,])", cell) and cell_kind(cell) == "number" for cell in cells)


_SAYS_UNITS = re.compile(r"\W*(?:units?|einheiten|unidades|unit[eé]s)\s*[:=]", re.IGNORECASE)


def _heading(
    lines: Sequence[str], start: int, delimiter: str, widths: tuple[int, int], interest: Callable[[str], int]
) -> tuple[tuple[str, ...], tuple[str, ...], int | None, bool, tuple[str, ...]]:
    """Names and units of the columns, the index of the line of names, whether it can be read as a recipe reads it.

    Args:
        widths: cells of a row, without and with those at its end that are always empty.
    """
    width = widths[0]
    nothing = ("",) * width
    candidates: list[tuple[int, list[str], bool]] = []
    strange: list[str] = []
    for number in range(start - 1, max(-1, start - 1 - _HEADING_LINES), -1):
        line = lines[number].lstrip("\ufeff")
        bare = _MARK.sub("", line).strip()
        if not re.sub(r"[\s,;|]", "", line) or settings.sets_values(bare, cut(bare, delimiter)):
            continue
        cells, plain = _names(line, delimiter, *widths)
        if cells is None:
            remarked = line.lstrip().startswith("*")  # a comment, whose cells are words
            if not candidates and not remarked and any(map(interest, cut(_MARK.sub("", line), delimiter))):
                count = len(cut(_MARK.sub("", line), delimiter))
                strange.append(f"line {number + 1} seems to name columns, but {count} for {width} cells a row")
            if candidates:
                break
            continue
        candidates.append((number, cells, plain))
    if not candidates:
        return nothing, nothing, None, False, tuple(strange)
    scored = [(sum(map(interest, set(cells))), number, cells, plain) for number, cells, plain in candidates]
    worded = [item for item in scored if _worded(item[2]) and not all(map(is_unit, filter(None, item[2])))]
    if not worded and any(_are_units(cells) for _, cells, _ in candidates):
        at = next(number for number, cells, _ in candidates if _are_units(cells))
        units = next(tuple(cells) for number, cells, _ in candidates if number == at)
        return nothing, units, at, False, tuple(strange)
    if not worded:
        return nothing, nothing, None, False, tuple(strange)
    # A line that says what units there are ("Units: wind (m/s), dir (deg)") is none of names, however well it fits.
    named = [item for item in worded if not _SAYS_UNITS.match(lines[item[1]])] or worded
    said = [item for item in named if delimiter == " " and _NAMING.match(lines[item[1]])]
    _, at, names, plain = said[0] if said else max(named, key=lambda item: (item[0], item[3], -item[1]))
    below = [(number, cells) for number, cells, _ in candidates if number > at and _are_units(cells)]
    # Of several the one with the most units: TOA5 has a line of "Avg" and "Smp" below that of units.
    units_at, units = max(below, key=lambda own: sum(spelled(cell) is not None for cell in own[1]), default=(at, None))
    if units is not None and names[0] and len(cut(_MARK.sub("", lines[units_at].strip()), delimiter)) == width - 1:
        odd = f"line {units_at + 1} has {width - 1} units for {width} columns: taken as those of all but the first"
        return tuple(names), tuple(units), at, plain and len(lines[at]) > 0, (odd,)
    if units is None:
        commented = (own for number, own, _ in candidates if number == at - 1 and _MARK.match(lines[number]))
        units = next((own for own in commented if _are_units(own)), None)
    if units is None:
        units = next((own for number, cells, _ in candidates if number != at and (own := _in_brackets(cells))), nothing)
    # The heading of an index column is empty when a table was written by pandas: still a name, only not a useful one.
    by_name = plain and len(lines[at]) > 0
    return tuple(names), tuple(units), at, by_name, ()


def _names(line: str, delimiter: str, width: int, full: int) -> tuple[list[str] | None, bool]:
    """Cells of a line of names that fit `width`, and whether a recipe would cut it like this."""
    if delimiter == " " and _NAMING.match(line):
        return (cells if len(cells := cut(_NAMING.sub("", line), delimiter)) == width else None), False
    plain, marked = _trimmed(cut(line, delimiter), width), bool(_MARK.match(line))
    if len(plain) > width and len(plain) in (full, full - 1):  # the sign behind the last cell of a row makes one more
        first = settings.listed(_MARK.sub("", plain[0])) if marked else plain[0]
        return [first, *plain[1:width]], not marked
    if len(plain) == width and not marked:
        return plain, True
    bare = _MARK.sub("", line.strip())
    bare = settings.listed(bare) if marked else bare
    ways = [cut(bare, delimiter), re.split(r"\t+|\s{2,}", bare), *(cut(bare, other) for other in (",", ";", "\t", " "))]
    # A heading that is divided as the rows are is not divided by anything else, such as the blanks in its names.
    alike = delimiter != " " and len(cut(bare, delimiter)) > (2 if delimiter == "," else 1)
    for way in ways[:1] if alike else ways:
        cells = _trimmed(way, width)
        if len(cells) == width:
            return cells, False
        # R writes the heading of its row names not at all.
        if len(cells) == width - 1 and len(cells) > 1 and not any(cell_kind(c) == "missing" for c in cells):
            return ["", *cells], False
    # Names beyond the cells of a row, as LabVIEW's "Comment"; not with commas, which also stand inside of names.
    if delimiter in ("\t", ";") and width < len(plain) <= width + 2 and all(plain):
        return plain[:width], False
    # A title that a spreadsheet padded, or a heading that its writer did not pad.
    if delimiter != " " and 1 < len(plain) < width and sum(map(bool, plain)) > 0.6 * width:
        return [*plain, *[""] * (width - len(plain))], False
    return None, False


def _worded(cells: Sequence[str]) -> bool:
    """Whether a line can name columns: most cells are filled, with words, not numbers."""
    filled = [cell for cell in cells if cell]
    words = [cell for cell in filled if cell_kind(cell) in ("text", "missing")]
    return len(filled) >= 0.6 * len(cells) and len(words) >= 0.8 * len(filled)


def _in_brackets(cells: Sequence[str]) -> list[str]:
    """Units in brackets behind the cells of a second line of names, in another language; empty where there are none."""
    found = [match[1] if (match := _BRACKETS.search(cell)) and is_unit(match[1]) else "" for cell in cells]
    return found if sum(map(bool, found)) >= _LEAST_UNITS else []


def _are_units(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell]
    return bool(filled) and sum(map(is_unit, filled)) >= 0.5 * len(filled)
