"""The process that runs SQL over the catalog, see `flagdata.core.files.bounded`: DuckDB, sealed off
from everything else.

SQL sees one table, `catalog`: the columns of `schema.CATALOG`, the derived ones of `DERIVED`, and
`label_<name>` for each label of the user's. It cannot read or write files (nor spill to them), load
extensions, change settings or run more than one statement. What it gives is handed on in parts of
at most `PART` bytes.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.abc import MetaPathFinder
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from flagdata.core.schema import CATALOG, Field, Kind, catalog_schema
from flagdata.core.workload import cores
from flagdata.errors import LimitError, UnknownNameError, UsageError
from flagdata.recipes.retired_names import present_sql

if TYPE_CHECKING:
    import pyarrow.compute as pc

# name → (what it is, SQL over the stored columns). `start` and `end` stay exact to the nanosecond
# beside them.
DERIVED: dict[str, tuple[Field, str]] = {
    "start_time": (
        Field(type=pa.timestamp("us", tz="UTC"), about="start as a time, cut to microseconds"),
        "to_timestamp(0) + to_microseconds(start // 1000)",
    ),
    "end_time": (
        Field(type=pa.timestamp("us", tz="UTC"), about="end as a time, cut to microseconds"),
        'to_timestamp(0) + to_microseconds("end" // 1000)',
    ),
    "duration": (Field(type=pa.float64(), unit="s", about="end - start"), '("end" - start) / 1e9'),
}
COLUMNS: dict[str, Field] = {**CATALOG, **{name: field for name, (field, _) in DERIVED.items()}}
ROW_LIMIT = 5_000_000
"""Most values that a single row of a result may hold, in lists and structures."""
PART = 32 << 20
"""Bytes of rows that are handed on at once, if there is more than one."""
ROW_BYTES = 256 << 20
"""Most bytes that a single row of a result may have."""
_BLOCK = 2048
"""Rows that DuckDB works on at once."""
_FIRST = 64 << 20
"""Memory that the first query may take, after which all that DuckDB loads is loaded [B]."""
_SEALED: dict[str, str | bool | int | float | list[str]] = {
    "enable_external_access": "false",
    "autoinstall_known_extensions": "false",
    "autoload_known_extensions": "false",
    "python_enable_replacements": "false",
    "temp_directory": "",
    "threads": min(8, cores()),  # each has a stack of some MB, which counts
}
_MISSING_COLUMN = re.compile(
    r'Referenced column "([^"]+)" (?:was )?not found|does not have a column named "([^"]+)"'
)
_MISSING_TABLE = re.compile(r"Table with name (\S+) does not exist")
_TEXT_AS_INSTANT = re.compile(r"Could not convert string '\d{4}-\d\d.*' to INT64")
_RESERVED_END = re.compile(r'syntax error at or near "(?:end|END)"')


@dataclass(frozen=True, kw_only=True)
class Question:
    """What is wanted of the rows of a catalog.

    Attributes:
        rows: a table; or files of rows in Parquet, and what those of them meet that count.
        labels: names of the columns of labels.
        sql: a whole SELECT; `None` where the rest says what is wanted.
        where: an SQL condition.
        order: SQL terms.
        columns: names.
        limit: rows at most.
        memory: that DuckDB may take [B].
        shown: the user's own SQL, for a message.
    """

    rows: pa.Table | tuple[tuple[pa.Buffer, ...], pc.Expression | None]
    labels: tuple[str, ...]
    sql: str | None
    where: str | None
    order: str
    columns: tuple[str, ...]
    limit: int | None
    memory: int
    shown: str | None


class Answers:
    """Answers to questions, by the number of each; see `flagdata.lake.selection` for what is
    asked."""

    def __init__(self) -> None:
        sys.meta_path.insert(0, _WithoutPandas())
        import duckdb
        import pyarrow.dataset  # noqa: F401  loaded before the memory is limited

        self._duckdb: Any = duckdb
        self._open: dict[int, _Answer] = {}
        _Answer(
            duckdb,
            Question(
                rows=catalog_schema().empty_table(),
                labels=(),
                sql="select 1 a",
                where=None,
                order="",
                columns=(),
                limit=None,
                memory=_FIRST,
                shown=None,
            ),
        ).total()

    def __call__(self, message: tuple[Any, ...]) -> Any:
        """Answers (verb, number of the question, what else it takes).

        Returns:
            also a UsageError, where the SQL could not be run on these rows: they may be to blame.

        Raises:
            UsageError, LimitError: as `flagdata.lake.selection.Selection`.
            MemoryError: DuckDB was refused memory.
        """
        verb, number, *rest = message
        where = None
        try:
            if verb == "open":
                (question, closed) = rest
                for identity in closed:
                    self._open.pop(identity, None)
                where = question.shown
                self._open[number] = _Answer(self._duckdb, question)
                return None
            answer = self._open[number]
            where = answer.question.shown
            return getattr(answer, verb)(*rest)
        except self._duckdb.OutOfMemoryException:
            raise MemoryError from None
        except (
            self._duckdb.Error,
            pa.ArrowException,
            OSError,
        ) as error:  # the last two of a stream
            if isinstance(error, pa.ArrowMemoryError) or "Out of Memory Error" in str(error):
                raise MemoryError from None
            return explain(error, where=where)


class _WithoutPandas(MetaPathFinder):
    """Keeps pyarrow from loading pandas where that is installed: nothing here uses it, and it takes
    a second."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        if name == "pandas":
            raise ModuleNotFoundError("pandas is of no use here")


class _Answer:
    def __init__(self, duckdb: Any, question: Question) -> None:
        self.question = question
        self._duckdb = duckdb
        self._connection = duckdb.connect(
            ":memory:", config={**_SEALED, "memory_limit": f"{question.memory}B"}
        )
        self._connection.register("stored", _answer_of(question))
        self._connection.execute(
            f"CREATE VIEW catalog AS SELECT {_view_columns(question.labels)} FROM stored"
        )
        self._connection.execute("SET TimeZone = 'UTC'")
        self._connection.execute("SET lock_configuration = true")
        self._relation = self._filtered_rows() if question.sql is None else self._sql(question.sql)
        self._parts: Iterator[pa.RecordBatch] = iter(())

    def _sql(self, sql: str) -> Any:
        statements = self._connection.extract_statements(sql)
        if len(statements) != 1 or statements[0].type != self._duckdb.StatementType.SELECT:
            raise UsageError(
                "the SQL is not one SELECT statement",
                where=sql,
                fix="the catalog is read-only: give a single SELECT",
            )
        relation = self._connection.sql(sql)
        if relation is None:
            raise UsageError(
                "the SQL returns no rows to show", where=sql, fix="give a SELECT from catalog"
            )
        return relation

    def _filtered_rows(self) -> Any:
        relation = self._connection.view("catalog")
        if self.question.where is not None:
            relation = relation.filter(self.question.where)
        relation = relation.order(self.question.order)
        return relation.project(", ".join(f'"{name}"' for name in self.question.columns))

    def total(self) -> int:
        """Counts the rows without the limit."""
        ((count,),) = self._relation.aggregate("count(*)").fetchall()
        return int(count)

    def stream(self, size: int) -> pa.Schema:
        """Begin with the rows, at most `size` at a time; their schema."""
        limit = self.question.limit
        raw = (self._relation if limit is None else self._relation.limit(limit)).to_arrow_reader(
            _BLOCK
        )
        self._parts = self._cut(raw, size)
        return raw.schema

    def part(self) -> pa.Buffer | None:
        """Returns the next rows as an Arrow stream; `None` after the last."""
        batch = next(self._parts, None)
        if batch is None:
            return None
        sink = pa.BufferOutputStream()
        with pa.ipc.new_stream(sink, batch.schema) as writer:
            writer.write_batch(batch)
        return sink.getvalue()

    def _cut(self, raw: pa.RecordBatchReader, size: int) -> Iterator[pa.RecordBatch]:
        """Rows by the number and bytes that are handed on at once."""
        blocks: list[pa.RecordBatch] = []
        rows = held_bytes = 0
        for block in raw:
            block.validate(full=True)  # a scan may give text that is not UTF-8
            if blocks and (rows + block.num_rows > size or held_bytes + block.nbytes > PART):
                yield _join_batches(blocks)
                blocks, rows, held_bytes = [], 0, 0
            if block.num_rows > size or block.nbytes > PART:
                yield from self._halve_block(block, size)
                continue
            blocks.append(block)
            rows, held_bytes = rows + block.num_rows, held_bytes + block.nbytes
        if blocks:
            yield _join_batches(blocks)

    def _halve_block(self, block: pa.RecordBatch, size: int) -> Iterator[pa.RecordBatch]:
        if block.num_rows > 1 and (block.num_rows > size or block.nbytes > PART):
            half = block.num_rows // 2
            yield from self._halve_block(block.slice(0, half), size)
            yield from self._halve_block(block.slice(half), size)
            return
        if block.num_rows == 1 and (
            block.nbytes > ROW_BYTES or sum(map(_leaves, block.columns)) > ROW_LIMIT
        ):
            raise LimitError(
                f"one row of the result has more than {ROW_LIMIT:,} values or {ROW_BYTES >> 20} "
                "MiB",
                where=self.question.shown,
                fix="aggregate in SQL, or unnest its lists: unnest(...)",
            )
        yield block


def _answer_of(question: Question) -> Any:
    if isinstance(question.rows, pa.Table):
        return question.rows
    contents, condition = question.rows
    return dataset_of(contents, condition)


def dataset_of(contents: Sequence[pa.Buffer], condition: pc.Expression | None) -> Any:
    """Rows of the catalog that lie in Parquet files of these contents, to be decoded as they are
    asked for."""
    import pyarrow.dataset as ds  # loads pandas where that is installed

    form = ds.ParquetFileFormat()
    rows = ds.FileSystemDataset(
        [form.make_fragment(content) for content in contents], catalog_schema(), form
    )
    return rows if condition is None else rows.filter(condition)


def _join_batches(batches: Sequence[pa.RecordBatch]) -> pa.RecordBatch:
    return batches[0] if len(batches) == 1 else pa.concat_batches(batches)


def _leaves(values: pa.Array) -> int:
    """Counts the values of an array, those within lists and structures singly."""
    kind = values.type
    if pa.types.is_struct(kind):
        return sum(_leaves(values.field(number)) for number in range(kind.num_fields))
    if pa.types.is_map(kind):
        return 2 * (values.offsets[-1].as_py() - values.offsets[0].as_py())
    if pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind):
        return _leaves(values.flatten())
    return len(values)


def _view_columns(labels: Sequence[str]) -> str:
    """Writes the catalog as SQL sees it. A NaN is an unknown value, but DuckDB sorts NaN above
    every number, so that "wind > 3" would hold for it: it becomes NULL."""
    stored = [
        f'CASE WHEN isnan("{name}") THEN NULL ELSE "{name}" END AS "{name}"'
        if pa.types.is_floating(field.type)
        else present_sql(name)
        if name == "parameters"
        else f'"{name}"'
        for name, field in CATALOG.items()
    ]
    label_columns = [f'"{name}"' for name in labels]
    return ", ".join(
        [*stored, *label_columns, *(f'{sql} AS "{name}"' for name, (_, sql) in DERIVED.items())]
    )


def explain(error: Exception, *, where: str | None) -> UsageError:
    """Turns what DuckDB says about a user's SQL into a usage error.

    Args:
        error: DuckDB's.
        where: the SQL or expression it is about.
    """
    import duckdb

    text = str(error)
    column = _MISSING_COLUMN.search(text)
    if column:
        name = column[1] or column[2]
        if name in set(Kind):
            return UsageError(
                f"{name} without quotes is a column to SQL",
                where=where,
                fix=f"write '{name}' in single quotes",
            )
        return UnknownNameError.of("column", name, COLUMNS, where=where)
    table = _MISSING_TABLE.search(text)
    if table:
        return UsageError(
            f"there is no table {table[1]!r}", where=where, fix="the one table is called catalog"
        )
    if isinstance(error, duckdb.PermissionException) or "Permission Error" in text:
        return UsageError(
            "SQL on a lake reads its catalog and nothing else",
            where=where,
            fix="select from catalog; leave out files",
        )
    if isinstance(error, duckdb.OutOfMemoryException) or "Out of Memory Error" in text:
        return UsageError(
            "it needs more memory than there is",
            where=where,
            fix="narrow it down, or aggregate in SQL",
        )
    if _RESERVED_END.search(text):
        return UsageError(
            "END is a word of SQL",
            where=where,
            fix='write the column in double quotes, "end", or use end_time',
        )
    if _TEXT_AS_INSTANT.search(text):
        return UsageError(
            'start and "end" are nanoseconds since 1970, not text',
            where=where,
            fix="compare start_time or end_time with a time in single quotes",
        )
    return UsageError(
        f"DuckDB cannot run it: {_first_line(text)}",
        where=where,
        fix="correct the SQL; the columns are listed by `flagdata query --describe`",
    )


def _first_line(text: str) -> str:
    return text.strip().splitlines()[0].rstrip(".") if text.strip() else "no reason given"
