"""Tables in Parquet and Arrow (Feather) files, as programs of data analysis save them, made ones of text.

Stamps are written as ISO 8601, in UTC where their type has a zone, so that nothing of the file's own types is lost to
the reader of text; columns of lists and structures are left out, with a word.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from flagdata.errors import InputError, LimitError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.options import Limits
from flagdata.ingest.anemometer.text.source import TableText

PARQUET, ARROW = b"PAR1", b"ARROW1"
_WIDEST = 2000


def is_columnar(head: bytes) -> bool:
    """Whether a file is Parquet or Arrow's file format by its first bytes."""
    return head.startswith((PARQUET, ARROW))


def open_columnar(path: Path, head: bytes, *, limits: Limits) -> TableText:
    """The table of a file.

    Raises:
        InputError: it is damaged.
        LimitError: it is larger than `limits` allow.
    """
    import pyarrow as pa
    from pyarrow import csv, feather, parquet

    where = str(path)
    try:
        if head.startswith(PARQUET):
            file = parquet.ParquetFile(path)
            _within(file.metadata.num_rows, file.metadata.num_columns, limits, where)
            table: Any = file.read()
        else:
            table = feather.read_table(path, memory_map=False)
            _within(table.num_rows, table.num_columns, limits, where)
        nested = [field.name for field in table.schema if pa.types.is_nested(field.type) or _is_bytes(pa, field.type)]
        table = table.select([at for at, field in enumerate(table.schema) if field.name not in nested])
        out = io.BytesIO()
        csv.write_csv(table.cast(pa.schema([pa.field(f.name, _plain(pa, f.type)) for f in table.schema])), out)
    except (pa.ArrowException, OSError, ValueError) as error:
        told = str(error).splitlines()[0]
        raise InputError(f"the file cannot be read: {told}", where=where, fix="copy it again") from None
    lines = out.getvalue().decode().splitlines()
    kind = "Parquet" if head.startswith(PARQUET) else "Arrow"
    what = f"{kind}, read as a table of {table.num_columns} columns; lines are counted with its heading as the first"
    found = [Finding(kind="columnar-table", severity=Severity.NOTE, what=what)]
    if nested:
        what = f"columns {', '.join(map(repr, nested))} hold lists, structures or bytes: left out"
        found.append(Finding(kind="columns-not-read", severity=Severity.NOTE, count=len(nested), what=what))
    return TableText(path=path, encoding="utf-8", lines=len(lines), findings=tuple(found), text=tuple(lines))


def _within(rows: int, columns: int, limits: Limits, where: str) -> None:
    if rows > limits.rows:
        raise LimitError(f"more than {limits.rows} rows", where=where, fix="split the table")
    if columns > _WIDEST:
        raise LimitError(f"more than {_WIDEST} columns", where=where, fix="keep the columns needed")


def _is_bytes(pa: Any, kind: Any) -> bool:
    return bool(pa.types.is_binary(kind) or pa.types.is_large_binary(kind) or pa.types.is_fixed_size_binary(kind))


def _plain(pa: Any, kind: Any) -> Any:
    """The type as which a column is written: dictionaries as their values."""
    return kind.value_type if pa.types.is_dictionary(kind) else kind
