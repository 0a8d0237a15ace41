"""Parquet files of other users, read no further than what they hold can be held in memory.

A few bytes of Parquet may state any number of rows, and a dictionary of one long text any number of
times: what its footer states is checked first, and the rows are counted in bytes as they are read.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from flagdata.errors import LimitError

HELD = 256 << 20
"""Most bytes that a table may take which is read whole."""
EXPANSION = 100
"""Most times its own size that a larger file may take: rows of a catalog take 20 to 30 times
theirs."""
_CELL = 8
_BATCH = 512
"""Rows that are read at once: as many long texts may be held."""


def check_stated(file: pq.FileMetaData, size: int, *, where: str, fix: str) -> None:
    """Refuse a file by what its footer states.

    Args:
        size: of the file [B].
        fix: what to do where it states too much.

    Raises:
        LimitError: its cells, or what they unpack to, take more than `HELD` and `EXPANSION` allow.
    """
    unpacked = sum(file.row_group(number).total_byte_size for number in range(file.num_row_groups))
    stated_size = max(unpacked, file.num_rows * file.num_columns * _CELL)
    most = max(HELD, EXPANSION * size)
    if stated_size > most:
        raise LimitError(
            f"a Parquet file of {size} bytes states {file.num_rows} rows, which take {stated_size} "
            "bytes",
            where=where,
            fix=f"at most {most} are read: {fix}",
        )


def read_parquet(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """Reads columns of a table; all if `None`.

    Raises:
        LimitError: it takes more than `HELD` and `EXPANSION` allow.
        pyarrow.ArrowException, OSError: it cannot be read, or lacks a column.
    """
    where = str(path)
    with pq.ParquetFile(path) as file:
        size = path.stat().st_size
        check_stated(file.metadata, size, where=where, fix="split it")
        most = max(HELD, EXPANSION * size)
        names = file.schema_arrow.names if columns is None else list(columns)
        if lacking := [name for name in names if name not in file.schema_arrow.names]:
            raise pa.ArrowInvalid(f"no column {', '.join(lacking)}")
        batches: list[pa.RecordBatch] = []
        size_read = 0
        for batch in file.iter_batches(_BATCH, columns=names):
            size_read += batch.nbytes
            if size_read > most:
                raise LimitError(
                    f"its rows take more than {most} bytes", where=where, fix="split it"
                )
            batches.append(batch)
        return (
            pa.Table.from_batches(batches)
            if batches
            else file.schema_arrow.empty_table().select(names)
        )
