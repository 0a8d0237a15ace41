"""Dumps of databases (mysqldump, pg_dump, sqlite3 .dump, scripts of SQL Server): the table that holds a wind.

    INSERT INTO `weather` (`ts`, `wind_speed_ms`) VALUES ('2026-05-01 12:00:00',4.2),('2026-05-01 12:01:00',4.4);
    COPY public.weather (ts, wind_speed_ms) FROM stdin;

Columns are named by the statement, or else by the table's CREATE TABLE above it. A cell that a function wraps, as in
CAST(N'2026-05-01T12:00:00' AS DateTime), is the text within. NULL is a missing value.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence

from flagdata.errors import LimitError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.documents import choice_of_table
from flagdata.ingest.anemometer.restating.restate import table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

LARGEST = 512 * 1024**2
"""Characters of the largest dump that is read."""
_NAME = r"(?:[\w$]+|`[^`]+`|\"[^\"]+\"|\[[^\]]+\])"
_TABLE = rf"(?P<table>{_NAME}(?:\.{_NAME}){{0,2}})"
_COLUMNS = r"(?:\s*\((?P<columns>[^()]*)\))?"
_INSERT = rf"(?:INSERT|REPLACE)\s+(?:IGNORE\s+)?(?:INTO\s+)?{_TABLE}{_COLUMNS}\s*VALUES\s*"
_COPY = rf"COPY\s+{_TABLE}{_COLUMNS}\s+FROM\s+stdin[^;\n]*;"
_CREATE = rf"CREATE\s+TABLE\s+(?:IF\s+NOT\s+EXISTS\s+)?{_TABLE}\s*\("
_STATEMENTS = tuple(re.compile(rf"[^\S\n]*{text}", re.IGNORECASE) for text in (_INSERT, _COPY, _CREATE))
_BEGINS = re.compile(r"^[^\S\n]*(?:INSERT|REPLACE|COPY|CREATE\s+TABLE)\b", re.IGNORECASE | re.MULTILINE)
_TOKEN = re.compile(r"'(?:[^'\\]|\\.|'')*'|[(),;]|[^\s'(),;]+", re.DOTALL)
_ESCAPED = re.compile(r"\\(.)|''", re.DOTALL)
_CUT_OFF = Finding(
    kind="cut-off", severity=Severity.WARNING, count=1,
    what="the dump ends within a row, as when it was interrupted; left out", fix="make the dump again",
)  # fmt: skip
_NO_COLUMN = frozenset({"PRIMARY", "KEY", "UNIQUE", "CONSTRAINT", "INDEX", "FOREIGN", "CHECK", "FULLTEXT", "SPATIAL"})


def matches(lines: Sequence[str]) -> bool:
    """Whether one of the first lines begins a statement that makes or fills a table."""
    return any(pattern.match(line) for line in lines for pattern in _STATEMENTS)


def as_table(source: TextFile) -> TableText | None:
    """The rows of the table with a time and a wind, of several such the longest; of others the longest.

    Raises:
        LimitError: the dump is larger than `LARGEST`.
    """
    text = "\n".join(source.each_line())
    if len(text) > LARGEST:
        fix = "export the table as CSV"
        raise LimitError(f"a dump of more than {LARGEST} characters", where=str(source.path), fix=fix)
    names: dict[str, list[str]] = {}
    rows: dict[str, list[list[str]]] = {}
    cut_off: list[str] = []
    for called, columns, cells in _filled(text, names, cut_off):
        names[called] = columns or names.get(called, [])
        rows.setdefault(called, []).extend(cells)
    filled = [name for name in rows if rows[name]]
    winds = [name for name in filled if choice_of_table.holds_wind(name, names[name], rows[name][0])]
    if not filled:
        return None
    chosen = max(winds or filled, key=lambda name: len(rows[name]))
    if not names[chosen]:
        return _without_names(source, rows[chosen])
    kept = [row for row in rows[chosen] if len(row) == len(names[chosen])]
    what = f"a dump of a database, table {chosen!r}"
    found = table(source, names[chosen], kept, kind="sql-table", what=what, left_out=len(rows[chosen]) - len(kept))
    if found is not None and chosen in cut_off:
        found = TableText.of(found, found.text, [_CUT_OFF])
    if found is None:
        return None
    told = choice_of_table.others_left_out(chosen, winds, fix="save another table as a file of its own to read it")
    return TableText.of(found, found.text, told)


def _without_names(source: TextFile, rows: Sequence[Sequence[str]]) -> TableText:
    """Rows whose columns no statement names."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return TableText.of(source, out.getvalue().splitlines())


def _filled(
    text: str, names: dict[str, list[str]], cut_off: list[str]
) -> Iterator[tuple[str, list[str], list[list[str]]]]:
    """Each statement that fills a table: the table, the columns it names, and its rows.

    Args:
        names: columns of each table by its CREATE TABLE; filled.
        cut_off: tables whose last row is incomplete; filled.
    """
    at = 0
    while (begins := _BEGINS.search(text, at)) is not None:
        insert, copy, create = (pattern.match(text, begins.start()) for pattern in _STATEMENTS)
        at = begins.end()
        if create is not None:
            names[_bare(create["table"])], at = _created(text, create.end())
        elif copy is not None:
            end = text.find("\n\\.", copy.end() - 1)
            end = len(text) if end < 0 else end
            cells = [line.split("\t") for line in text[copy.end() : end].splitlines() if line]
            yield _bare(copy["table"]), _listed(copy["columns"]), [[_copied(cell) for cell in row] for row in cells]
            at = end
        elif insert is not None:
            cells, at = _tuples(text, insert.end())
            if at > len(text):
                cut_off.append(_bare(insert["table"]))
            yield _bare(insert["table"]), _listed(insert["columns"]), cells


def _created(text: str, at: int) -> tuple[list[str], int]:
    """The columns of a table that is made, and where its list of them ends."""
    found: list[str] = []
    depth, first = 1, True
    words = re.compile(r"'(?:[^'\\]|\\.|'')*'|`[^`]*`|\"[^\"]*\"|\[[^\]]*\]|[(),]|[^\s(),'`\"\[]+")
    for token in words.finditer(text, at):
        word = token[0]
        if word == "(":
            depth += 1
        elif word == ")":
            depth -= 1
            if not depth:
                return found, token.end()
        elif word == "," and depth == 1:
            first = True
        elif first and depth == 1:
            if word.upper() not in _NO_COLUMN:
                found.append(word.strip('`"[]'))
            first = False
    return found, len(text)


def _tuples(text: str, at: int) -> tuple[list[list[str]], int]:
    """The rows of a statement from its first bracket on, and where it ends: beyond the text where a row is cut off."""
    rows: list[list[str]] = []
    row: list[str] = []
    cell: list[str] = []
    depth = 0
    for token in _TOKEN.finditer(text, at):
        word = token[0]
        if word == "(":
            depth += 1
            row, cell = (row, cell) if depth > 1 else ([], [])
        elif word == ")":
            depth -= 1
            if not depth:
                rows.append([*row, _value(cell)])
        elif word == "," and depth == 1:
            row.append(_value(cell))
            cell = []
        elif not depth and word != ",":
            return rows, token.start()  # the semicolon, or what stands behind the rows
        elif depth and word != ",":
            cell.append(word)
    return rows, len(text) + (depth > 0)


def _value(tokens: Sequence[str]) -> str:
    """A cell: its text where it has one, else its words; NULL is empty."""
    quoted = next((token for token in tokens if token.startswith("'")), None)
    if quoted is not None:
        return " ".join(_ESCAPED.sub(lambda match: match[1] or "'", quoted[1:-1]).split())
    text = tokens[1] if len(tokens) > 1 and tokens[0].upper() == "CAST" else " ".join(tokens)
    return "" if text.upper() in ("NULL", "DEFAULT") else text


def _copied(cell: str) -> str:
    return "" if cell == "\\N" else " ".join(cell.replace("\\t", " ").replace("\\n", " ").split())


def _listed(columns: str | None) -> list[str]:
    return [] if columns is None else [name.strip().strip('`"[]') for name in columns.split(",")]


def _bare(name: str) -> str:
    return name.rpartition(".")[2].strip('`"[]')
