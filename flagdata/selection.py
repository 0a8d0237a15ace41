"""Rows of the catalog by filter or SQL, at any ref. DuckDB over the Arrow catalog, sealed off from everything else.

SQL sees one table, `catalog`: the columns of `schema.CATALOG`, the derived ones of `DERIVED`, and `label_<name>` for
each label of the user's. It cannot read or write files (nor spill to them), load extensions, change settings or run
more than one statement. It is stopped after a time limit, and where it needs more than 2 GB or gives more rows than can
be held; DuckDB looks at both between blocks of 2,048 rows.
"""

from __future__ import annotations

import math
import re
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

import duckdb
import pyarrow as pa

from flagdata.errors import LimitError, UnknownNameError, UsageError
from flagdata.lake.labels import PREFIX, columns
from flagdata.lake.matching import Where, condition, matching
from flagdata.lake.refs import View
from flagdata.lake.rowfiles import Scan
from flagdata.schema import CATALOG, Field, Kind, catalog_schema

# name → (what it is, SQL over the stored columns). `start` and `end` stay exact to the nanosecond beside them.
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
DEFAULT_ORDER = "kind, start NULLS LAST, artifact"
TIME_LIMIT = 60.0
"""What a query may take, if nothing else is asked for [s]; a catalog of a million rows takes one."""
CELL_LIMIT, BYTE_LIMIT = 5_000_000, 256 << 20
"""Most that SQL may give to be held at once, or else twice what the catalog itself has."""

_SEALED: dict[str, str | bool | int | float | list[str]] = {
    "enable_external_access": "false",
    "autoinstall_known_extensions": "false",
    "autoload_known_extensions": "false",
    "python_enable_replacements": "false",
    "temp_directory": "",
    "memory_limit": "2GB",  # a catalog of a million rows takes a tenth of it
}
_AGAIN = 0.1  # s between interrupts
_MISSING_COLUMN = re.compile(r'Referenced column "([^"]+)" (?:was )?not found|does not have a column named "([^"]+)"')
_MISSING_TABLE = re.compile(r"Table with name (\S+) does not exist")
_TEXT_AS_INSTANT = re.compile(r"Could not convert string '\d{4}-\d\d.*' to INT64")
_RESERVED_END = re.compile(r'syntax error at or near "(?:end|END)"')


class Catalogued(Protocol):
    """What a query needs of a lake: what a ref shows, and the rows of that."""

    def view(self, at: str | None) -> View: ...

    def scan(self, view: View) -> pa.Table | Scan: ...


@dataclass(frozen=True, kw_only=True)
class Request:
    """What to select.

    Attributes:
        where: an SQL boolean expression over the columns of `COLUMNS`, or the values that columns of the catalog must
            have; `None` is every row.
        columns: names in the order wanted; `None` is every stored column.
        order: SQL order terms ("wind DESC, start"); `None` is by kind, start and identity.
        sql: one SELECT over `catalog` instead of all of the above.
        limit: rows at most.
        time_limit: what DuckDB may take for it in all [s].

    Raises:
        UsageError: `sql` together with `where`, `columns` or `order`; a negative limit; a time limit that is none.
        UnknownNameError: a column that is not in the catalog.
    """

    where: Where | None = None
    columns: tuple[str, ...] | None = None
    order: str | None = None
    sql: str | None = None
    limit: int | None = None
    time_limit: float = TIME_LIMIT

    def __post_init__(self) -> None:
        if self.sql is not None and (self.where, self.columns, self.order) != (None, None, None):
            raise UsageError(
                "a whole SQL statement leaves no room for a filter, columns or an order beside it",
                fix="put WHERE, the columns and ORDER BY into the SQL",
            )
        if self.limit is not None and self.limit < 0:
            raise UsageError(f"a limit of {self.limit} rows", fix="give 0 or more")
        if not (math.isfinite(self.time_limit) and self.time_limit > 0):
            raise UsageError(f"a time limit of {self.time_limit} s", fix="give seconds, more than 0")
        if self.columns is not None and not self.columns:
            raise UsageError("no columns", fix=f"name some of: {', '.join(COLUMNS)}")
        for name in self.columns or ():
            if name not in COLUMNS and not name.startswith(PREFIX):
                raise UnknownNameError.of("column", name, COLUMNS)


class Selection:
    """The answer to a request over one catalog, computed when it is read.

    Args:
        catalog: rows with the columns of `schema.CATALOG`; of a scan only those columns are decoded that are asked for.
        request: what is wanted of them.

    Raises:
        UsageError: SQL that is not a single SELECT, does not parse, names what is not there, or needs too much memory.
        LimitError: it takes longer than it may. These are raised by the methods, too.
    """

    def __init__(self, catalog: pa.Table | Scan, request: Request) -> None:
        self.request = request
        if request.where and not isinstance(request.where, str):
            catalog = (
                catalog.matching(condition(request.where))
                if isinstance(catalog, Scan)
                else matching(catalog, request.where)
            )
        self._connection = duckdb.connect(":memory:", config=_SEALED)
        self._left = request.time_limit
        self._check = catalog.check if isinstance(catalog, Scan) else None
        labels: dict[str, pa.Array] = {}
        if isinstance(catalog, Scan):
            stored, cells, size = catalog.dataset, catalog.count * len(CATALOG), catalog.size
        else:
            labels, stored = columns(catalog), catalog
            for name, values in labels.items():
                stored = stored.append_column(name, values)
            cells, size = stored.num_rows * stored.num_columns, stored.nbytes
        self._labels = {name: Field(type=values.type, about="a label of the user's") for name, values in labels.items()}
        for name in request.columns or ():
            if name not in COLUMNS and name not in labels:
                raise UnknownNameError.of("column", name, [*COLUMNS, *labels])
        self._held = max(CELL_LIMIT, 2 * cells), max(BYTE_LIMIT, 2 * size)
        with self._running():
            self._connection.register("stored", stored)
            self._connection.execute(f"CREATE VIEW catalog AS SELECT {_view_columns(tuple(labels))} FROM stored")
            self._connection.execute("SET TimeZone = 'UTC'")
            self._connection.execute("SET lock_configuration = true")
            self._relation = self._sql(request.sql) if request.sql is not None else self._filtered(request)

    def _sql(self, sql: str) -> duckdb.DuckDBPyRelation:
        statements = self._connection.extract_statements(sql)
        if len(statements) != 1 or statements[0].type != duckdb.StatementType.SELECT:
            raise UsageError(
                "the SQL is not one SELECT statement", where=sql, fix="the catalog is read-only: give a single SELECT"
            )
        relation = self._connection.sql(sql)
        if relation is None:
            raise UsageError("the SQL returns no rows to show", where=sql, fix="give a SELECT from catalog")
        return relation

    def _filtered(self, request: Request) -> duckdb.DuckDBPyRelation:
        relation = self._connection.view("catalog")
        if isinstance(request.where, str):
            relation = relation.filter(request.where)
        relation = relation.order(request.order or DEFAULT_ORDER)
        return relation.project(", ".join(f'"{name}"' for name in request.columns or CATALOG))

    def total(self) -> int:
        """How many rows there are without the limit."""
        with self._running():
            ((count,),) = self._relation.aggregate("count(*)").fetchall()
        return int(count)

    def batches(self, size: int = 65_536) -> pa.RecordBatchReader:
        """The rows as a stream of record batches of at most `size` rows."""
        relation = self._relation if self.request.limit is None else self._relation.limit(self.request.limit)
        with self._running():
            raw = relation.to_arrow_reader(size)
        schema = self._schema(raw.schema)

        def stream() -> Iterator[pa.RecordBatch]:
            while True:
                with self._running():
                    try:
                        batch = raw.read_next_batch()
                    except StopIteration:
                        return
                    batch.validate(full=True)  # a scan may give text that is not UTF-8
                yield pa.RecordBatch.from_arrays(
                    [array.cast(field.type) for array, field in zip(batch.columns, schema, strict=True)], schema=schema
                )

        return pa.RecordBatchReader.from_batches(schema, stream())

    def table(self) -> pa.Table:
        """The rows, whole. Columns of the catalog carry their unit and description; those of free SQL do not.

        Raises:
            LimitError: SQL gives more than can be held.
        """
        stream = self.batches()
        batches: list[pa.RecordBatch] = []
        cells = size = 0
        for batch in stream:
            batches.append(batch)
            cells, size = cells + batch.num_rows * batch.num_columns, size + batch.nbytes
            if self.request.sql is not None and (cells > self._held[0] or size > self._held[1]):
                raise LimitError(
                    f"the SQL gives more than {self._held[0]:,} values or {self._held[1] >> 20} MiB",
                    where=self.request.sql, fix="aggregate in SQL, or give a limit; --csv and --arrow write any number",
                )  # fmt: skip
        return pa.Table.from_batches(batches, schema=stream.schema)

    def _schema(self, raw: pa.Schema) -> pa.Schema:
        """The catalog's own schema, for rows of the catalog; what free SQL makes has no description."""
        if self.request.sql is not None:
            return raw
        if self.request.columns is None:
            return catalog_schema()
        known = COLUMNS | self._labels
        return pa.schema([_field(name, known[name]) for name in self.request.columns])

    @contextmanager
    def _running(self) -> Iterator[None]:
        """What DuckDB does within is interrupted when the time is up; its errors are explained."""
        begun, done = time.monotonic(), threading.Event()
        watch = threading.Thread(target=self._interrupt, args=(done, self._left), daemon=True)
        watch.start()
        try:
            yield
        except (duckdb.Error, pa.ArrowException, OSError) as error:  # the last two of a stream
            self._refuse_late(begun)
            if self._check is not None:
                self._check()  # raises, where a file of the catalog is to blame
            raise explain(error, where=_shown(self.request)) from None
        finally:
            done.set()
            watch.join()
        self._refuse_late(begun)
        self._left -= time.monotonic() - begun

    def _interrupt(self, done: threading.Event, seconds: float) -> None:
        """Interrupt DuckDB after so long, and again until it is done: an interrupt between two blocks is forgotten."""
        while not done.wait(min(seconds, threading.TIMEOUT_MAX)):
            self._connection.interrupt()
            seconds = _AGAIN

    def _refuse_late(self, begun: float) -> None:
        if time.monotonic() - begun >= self._left:
            raise LimitError(
                f"the query took longer than {self.request.time_limit:g} s", where=_shown(self.request),
                fix="narrow it down; `flagdata query --time-limit SECONDS` allows more",
            )  # fmt: skip


def _shown(request: Request) -> str | None:
    """The user's own SQL, for a message."""
    given = (request.sql, request.where, request.order)
    return "; ".join(text for text in given if isinstance(text, str) and text) or None


def _field(name: str, field: Field) -> pa.Field:
    about = {"unit": field.unit, "about": field.about}
    return pa.field(name, field.type, nullable=field.nullable, metadata=about)


def _view_columns(labels: Sequence[str]) -> str:
    """The catalog as SQL sees it. A NaN is an unknown value, but DuckDB sorts NaN above every number, so that
    "wind > 3" would hold for it: it becomes NULL."""
    stored = [
        f'CASE WHEN isnan("{name}") THEN NULL ELSE "{name}" END AS "{name}"'
        if pa.types.is_floating(field.type)
        else f'"{name}"'
        for name, field in CATALOG.items()
    ]
    own = [f'"{name}"' for name in labels]
    return ", ".join([*stored, *own, *(f'{sql} AS "{name}"' for name, (_, sql) in DERIVED.items())])


def select(
    lake: Catalogued,
    where: Where | None = None,
    *,
    at: str | None = None,
    columns: Sequence[str] | None = None,
    order: str | None = None,
    sql: str | None = None,
    limit: int | None = None,
    time_limit: float = TIME_LIMIT,
) -> pa.Table:
    """Rows of a lake's catalog at a ref; arguments as in `Request`.

    Raises:
        UsageError: SQL that cannot be run; the message carries DuckDB's reason and, for a misspelt column, its name.
        LimitError: it takes longer, or gives more, than it may.
        NotFoundError: no such ref.
    """
    request = Request(
        where=where, columns=None if columns is None else tuple(columns), order=order, sql=sql, limit=limit,
        time_limit=time_limit,
    )  # fmt: skip
    return Selection(lake.scan(lake.view(at)), request).table()


def explain(error: Exception, *, where: str | None) -> UsageError:
    """The usage error for what DuckDB says about a user's SQL.

    Args:
        error: DuckDB's.
        where: the SQL or expression it is about.
    """
    text = str(error)
    column = _MISSING_COLUMN.search(text)
    if column:
        name = column[1] or column[2]
        if name in set(Kind):
            return UsageError(
                f"{name} without quotes is a column to SQL", where=where, fix=f"write '{name}' in single quotes"
            )
        return UnknownNameError.of("column", name, COLUMNS, where=where)
    table = _MISSING_TABLE.search(text)
    if table:
        return UsageError(f"no table {table[1]!r}", where=where, fix="the one table is called catalog")
    if isinstance(error, duckdb.PermissionException) or "Permission Error" in text:
        return UsageError(
            "SQL on a lake reads its catalog and nothing else", where=where, fix="select from catalog; leave out files"
        )
    if isinstance(error, duckdb.OutOfMemoryException) or "Out of Memory Error" in text:
        return UsageError("it needs more memory than there is", where=where, fix="narrow it down, or aggregate in SQL")
    if _RESERVED_END.search(text):
        return UsageError(
            "END is a word of SQL", where=where, fix='write the column in double quotes, "end", or use end_time'
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
