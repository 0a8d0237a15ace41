"""Readings of several lines, each a name and its value, as programs print them one below the other.

    Time: 2026-05-01 12:00:01
    Wind Speed: 3.2 m/s
    Wind Direction: 231
    ----------------------

A reading begins with the name that follows blank lines, rules and titles, or with the first one of the file; where a
name comes again; and at a line that is a stamp and nothing else, unless such lines end the readings. What the names
mean, and what is missing, is told as of any table; lines may stand after a computer's stamp, of which that of a
reading's first line counts.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from flagdata.ingest.anemometer.restating.restate import LOOKED_AT, table
from flagdata.ingest.anemometer.sniffing import HEAD_LINES
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.words.headings import understand

_LINE = re.compile(
    r"\s*(?:(?P<stamp>(?:\d{4}[-/.]\d{1,2}[-/.]\d{1,2}[T ]+)?\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?Z?)"
    r"\s*(?:->|[>\])|,;-])?\s*)?"
    r"(?P<name>[^\W\d_](?:[^:=\t\d]|(?<=[^\W_])\d){0,40}?)\s*[:=\t]\s*(?P<value>[^:=\s](?:[^=]{0,60}\S)?)\s*"
)
_SHARE = 0.6
"""Share of the lines with a letter or digit that must be readings; the others are titles."""
_LEAST = 3
"""Readings by which the kind is told."""
_MOST = 60
"""Names of the largest reading."""


def matches(lines: Sequence[str]) -> bool:
    """Most lines are a name and its value, the names come again, and one of them is a speed of the wind."""
    filled = [line for line in lines if re.search(r"[^\W_]", line)]
    found = [match for line in filled if (match := _readings(line)) is not None]
    whole = 2 <= len(found) == len(filled) and len(lines) < LOOKED_AT  # a short file of nothing else
    if not whole and (len(found) < 2 * _LEAST or len(found) < _SHARE * len(filled)):
        return False
    rows = list(_rows(lines, _first(lines)))
    names = {name for row in rows for name in row}
    if len(rows) < (1 if whole else _LEAST) or not 2 <= len(names - {""}) <= _MOST:
        return False
    winds = {name for name in names if (said := understand(name)).sure and said.channel.endswith("wind_speed")}
    if len(rows) < _LEAST and len(winds) != 1:  # settings, rather
        return False
    return any(sum(cell_kind(row.get(name, "")) == "number" for row in rows) > len(rows) / 2 for name in winds)


def as_table(source: TextFile) -> TableText | None:
    """The values below their names, one reading a row."""
    lines = list(source.each_line())
    rows = list(_rows(lines, _first(lines[:HEAD_LINES])))
    names = list(dict.fromkeys(name for row in rows for name in row if name))
    stamped = any("" in row for row in rows)
    cells = [[*([row.get("", "")] if stamped else []), *(row.get(name, "") for name in names)] for row in rows]
    return table(
        source, [*(["logged time"] if stamped else []), *names], cells, kind="blocks",
        what="readings of several lines, a name and its value in each", left_out=_words(lines),
    )  # fmt: skip


def _words(lines: Iterable[str]) -> int:
    """Lines with words that are neither a name and its value nor a rule: what they say is not read."""
    return sum(
        bool(re.search(r"[^\W_]", line)) and _LINE.fullmatch(line) is None and not _stamp_alone(line) for line in lines
    )


def _stamp_alone(line: str) -> str:
    """The stamp that a line is, out of brackets and rules; "" where it is none."""
    text = line.strip(" \t[]()<>*=#-_|")
    return text if ":" in text and len(text) < 40 and cell_kind(text) == "stamp" else ""


def _readings(line: str) -> re.Match[str] | None:
    """A name and its value; a stamp is none, though it has a colon in it."""
    return None if _stamp_alone(line) else _LINE.fullmatch(line)


def _first(lines: Sequence[str]) -> str:
    """The name that a reading begins with."""
    after: Counter[str] = Counter()
    names: Counter[str] = Counter()
    apart = False
    for line in lines:
        match = _readings(line)
        if match is not None:
            name = _name(match)
            names[name] += 1
            after[name] += apart
        apart = match is None
    name, count = after.most_common(1)[0] if after else ("", 0)
    return name if 2 * count >= names[name] > 0 else next(iter(names), "")


def _name(match: re.Match[str]) -> str:
    return " ".join(match["name"].split())


def _rows(lines: Iterable[str], first: str) -> Iterator[dict[str, str]]:
    """The values of each reading by their names; "" is the stamp of its first line.

    Args:
        first: the name that a reading begins with.
    """
    row: dict[str, str] = {}
    ahead: bool | None = None  # whether the lines that are stamps stand before their readings
    for line in lines:
        alone = _stamp_alone(line)
        if alone:
            ahead = not row if ahead is None else ahead
            if ahead and len(row) > 1:
                yield row
                row = {}
            row[""] = alone
            if not ahead:
                yield row
                row = {}
            continue
        match = _LINE.fullmatch(line)
        if match is None:
            continue
        name = _name(match)
        if name in row or (name == first and row.keys() - {""}):
            yield row
            row = {}
        if not row and match["stamp"]:
            row[""] = match["stamp"].replace(",", ".")
        row[name] = match["value"]
    if row.keys() - {""}:
        yield row
