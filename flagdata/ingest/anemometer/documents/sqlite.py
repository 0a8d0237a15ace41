"""Databases of SQLite, as weather programs keep them: the table that holds a wind, made one of text.

The database is opened for reading only. Of several tables with a wind the longest is read. What its columns mean, such
as the units of a WeeWX archive, is told as of any table.
"""

from __future__ import annotations

import csv
import io
import sqlite3
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

from flagdata.errors import InputError, LimitError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.documents import choice_of_table
from flagdata.ingest.anemometer.options import Limits
from flagdata.ingest.anemometer.text.source import TableText

MAGIC = b"SQLite format 3\x00"
_WIDEST = 2000


def open_database(path: Path, *, limits: Limits) -> TableText:
    """The table of a database that holds a time and a wind.

    Raises:
        InputError: the database is damaged or in use, or no table of it holds both.
        LimitError: the table is larger than `limits` allow.
    """
    where = str(path)
    try:
        with closing(sqlite3.connect(f"file:{quote(str(path.resolve()))}?mode=ro", uri=True)) as base:
            base.text_factory = lambda data: data.decode("utf-8", errors="replace")
            return _read(base, path, limits)
    except sqlite3.Error as error:
        fix = "copy it again while no program writes to it, or export the table as CSV: sqlite3 -header -csv FILE"
        raise InputError(f"the SQLite database cannot be read: {error}", where=where, fix=fix) from None


def _read(base: sqlite3.Connection, path: Path, limits: Limits) -> TableText:
    where = str(path)
    names = [row[0] for row in base.execute("SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name")]
    rows = {name: _count(base, name) for name in names if _holds_wind(base, name)}
    filled = {name: count for name, count in rows.items() if count}
    if not filled:
        shown = ", ".join(repr(name) for name in names) or "none"
        what = f"a database of SQLite, no table of which holds rows with a time and a wind; its tables are {shown}"
        raise InputError(what, where=where, fix='export the table as CSV: sqlite3 -header -csv FILE "SELECT …"')
    chosen = max(filled, key=lambda name: filled[name])
    if filled[chosen] > limits.rows:
        fix = "export a part of it as CSV"
        raise LimitError(f"more than {limits.rows} rows in table {chosen!r}", where=where, fix=fix)
    cursor = base.execute(f"SELECT * FROM {_quoted(chosen)}")
    columns = [column[0] for column in cursor.description]
    if len(columns) > _WIDEST:
        raise LimitError(f"more than {_WIDEST} columns", where=where, fix="export the columns needed as CSV")
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_text(cell) for cell in row] for row in cursor)
    lines = out.getvalue().splitlines()
    what = f"a database of SQLite, table {chosen!r}; lines are counted with the names of its columns as the first"
    found = [Finding(kind="database-table", severity=Severity.NOTE, what=what)]
    fix = 'export another one as CSV to read it: sqlite3 -header -csv FILE "SELECT …"'
    found += choice_of_table.others_left_out(chosen, list(filled), fix=fix)
    return TableText(path=path, encoding="utf-8", lines=len(lines), findings=tuple(found), text=tuple(lines))


def _holds_wind(base: sqlite3.Connection, name: str) -> bool:
    columns = [row[1] for row in base.execute(f"PRAGMA table_info({_quoted(name)})")]
    first: Sequence[object] = base.execute(f"SELECT * FROM {_quoted(name)} LIMIT 1").fetchone() or ()
    return choice_of_table.holds_wind(name, columns, first)


def _count(base: sqlite3.Connection, name: str) -> int:
    return int(base.execute(f"SELECT count(*) FROM {_quoted(name)}").fetchone()[0])


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _text(value: object) -> str:
    """A cell on one line; bytes are none."""
    if value is None or isinstance(value, bytes):
        return ""
    return repr(value) if isinstance(value, float) else " ".join(str(value).split())
