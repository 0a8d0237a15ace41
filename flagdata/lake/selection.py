"""Rows of the catalog by filter or SQL, at any ref. DuckDB over the Arrow catalog, in a process of
its own.

`flagdata.lake.catalog_sql` describes what SQL sees and may do. Its process is ended when the time
limit is over and may take 2 GB; where the rows are to be held at once, these are limited too. The
process stays for the next question.
"""

from __future__ import annotations

import math
import time
import weakref
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any, Protocol

import pyarrow as pa

from flagdata.core.files.bounded import End, EndedError
from flagdata.core.schema import CATALOG, Field, catalog_schema
from flagdata.errors import FlagdataError, LimitError, UnknownNameError, UsageError
from flagdata.lake.catalog_sql import COLUMNS, Question
from flagdata.lake.label_columns import PREFIX, columns
from flagdata.lake.matching import Where, condition, matching
from flagdata.lake.refs import View
from flagdata.lake.rowfiles import Scan
from flagdata.lake.sql_process import MEMORY, sql_process
from flagdata.recipes.retired_names import present_query

DEFAULT_ORDER = "kind, start NULLS LAST, artifact"
TIME_LIMIT = 60.0
"""What a query may take, if nothing else is asked for [s]; a catalog of a million rows takes
one."""
CELL_LIMIT, BYTE_LIMIT = 5_000_000, 256 << 20
"""Most that SQL may give to be held at once, or else twice what the catalog itself has."""


class Catalogued(Protocol):
    """What a query needs of a lake: what a ref shows, and the rows of that."""

    def view(self, at: str | None) -> View: ...

    def scan(self, view: View) -> pa.Table | Scan: ...


@dataclass(frozen=True, kw_only=True)
class Request:
    """What to select.

    Attributes:
        where: an SQL boolean expression over the columns of `COLUMNS`, or the values that columns
            of the catalog must have; `None` is every row.
        columns: names in the order wanted; `None` is every stored column.
        order: SQL order terms ("wind DESC, start"); `None` is by kind, start and identity.
        sql: one SELECT over `catalog` instead of all of the above.
        limit: rows at most.
        time_limit: what DuckDB may take for it in all [s].

    Raises:
        UsageError: `sql` together with `where`, `columns` or `order`; a negative limit; a time
            limit that is none.
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
            raise UsageError(f"the limit is {self.limit} rows", fix="give 0 or more")
        if not (math.isfinite(self.time_limit) and self.time_limit > 0):
            raise UsageError(
                f"the time limit is {self.time_limit} s", fix="give seconds, more than 0"
            )
        if self.columns is not None and not self.columns:
            raise UsageError("no columns are named", fix=f"name some of: {', '.join(COLUMNS)}")
        for name in self.columns or ():
            if name not in COLUMNS and not name.startswith(PREFIX):
                raise UnknownNameError.of("column", name, COLUMNS)


class Selection:
    """The answer to a request over one catalog, computed when it is read.

    Args:
        catalog: rows with the columns of `schema.CATALOG`; of a scan only those columns are decoded
            that are asked for.
        request: what is wanted of them.

    Raises:
        UsageError: SQL that is not a single SELECT, does not parse, names what is not there, or
            needs too much memory.
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
        self._left = request.time_limit
        self._check = catalog.check if isinstance(catalog, Scan) else None
        labels: dict[str, pa.Array] = {}
        stored: Any
        if isinstance(catalog, Scan):
            stored, cells, size = (
                (catalog.contents, catalog.condition),
                catalog.count * len(CATALOG),
                catalog.size,
            )
        else:
            labels, stored = columns(catalog), catalog
            for name, values in labels.items():
                stored = stored.append_column(name, values)
            cells, size = stored.num_rows * stored.num_columns, stored.nbytes
        self._labels = {
            name: Field(type=values.type, about="a label of the user's")
            for name, values in labels.items()
        }
        for name in request.columns or ():
            if name not in COLUMNS and name not in labels:
                raise UnknownNameError.of("column", name, [*COLUMNS, *labels])
        self._held = max(CELL_LIMIT, 2 * cells), max(BYTE_LIMIT, 2 * size)
        self._process = sql_process()
        self._number = next(_numbers)
        closed, self._process.closed = self._process.closed, []
        self._ask(
            "open",
            Question(
                rows=stored,
                labels=tuple(labels),
                sql=present_query(request.sql),
                where=present_query(request.where) if isinstance(request.where, str) else None,
                order=request.order or DEFAULT_ORDER,
                columns=request.columns or tuple(CATALOG),
                limit=request.limit,
                memory=MEMORY,
                shown=_sql_of(request),
            ),
            closed,
        )
        weakref.finalize(self, self._process.closed.append, self._number)

    def total(self) -> int:
        """Counts the rows without the limit."""
        return int(self._ask("total"))

    def batches(self, size: int = 65_536) -> pa.RecordBatchReader:
        """Streams the rows as record batches of at most `size` rows."""
        schema = self._schema(self._ask("stream", size))

        def stream() -> Iterator[pa.RecordBatch]:
            while (part := self._ask("part")) is not None:
                batch = pa.ipc.open_stream(part).read_next_batch()
                yield pa.RecordBatch.from_arrays(
                    [
                        array.cast(field.type)
                        for array, field in zip(batch.columns, schema, strict=True)
                    ],
                    schema=schema,
                )

        return pa.RecordBatchReader.from_batches(schema, stream())

    def table(self) -> pa.Table:
        """Returns the rows, whole. Columns of the catalog carry their unit and description; those
        of free SQL do not.

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
                    f"the SQL gives more than {self._held[0]:,} values or {self._held[1] >> 20} "
                    "MiB",
                    where=self.request.sql,
                    fix="aggregate in SQL, or give a limit; --csv and --arrow write any number",
                )
        return pa.Table.from_batches(batches, schema=stream.schema)

    def _schema(self, raw: pa.Schema) -> pa.Schema:
        """Returns the catalog's own schema, for rows of the catalog; what free SQL makes has no
        description."""
        if self.request.sql is not None:
            return raw
        if self.request.columns is None:
            return catalog_schema()
        descriptions = COLUMNS | self._labels
        return pa.schema([_field(name, descriptions[name]) for name in self.request.columns])

    def _ask(self, verb: str, *rest: object) -> Any:
        """Asks the process, and returns its answer within the time that is left.

        Raises:
            LimitError: there is none left, or there was not enough.
            UsageError: the SQL cannot be run, or needs too much memory.
            FlagdataError: its process was killed, crashed or ended.
            CorruptError: a file of the catalog cannot be read.
        """
        try:
            if self._left <= 0:
                raise EndedError(End.LATE)
            self._process.wait_for_start()
            begun = time.monotonic()
            answer = self._process.ask((verb, self._number, *rest), seconds=self._left)
        except EndedError as ended:
            if ended.late:
                self._left = 0.0
                raise LimitError(
                    f"the query was stopped, since it took longer than {self.request.time_limit:g} "
                    "s",
                    where=_sql_of(self.request),
                    fix="narrow it down; `flagdata query --time-limit SECONDS` allows more",
                ) from None
            self._check_rows()
            raise self._broken(ended) from None
        except RuntimeError as error:
            self._check_rows()
            raise FlagdataError(
                f"the SQL could not be run: {error}",
                where=_sql_of(self.request),
                fix="write it in another way",
            ) from None
        self._left -= time.monotonic() - begun
        if isinstance(answer, UsageError):
            self._check_rows()
            raise answer
        return answer

    def _broken(self, ended: EndedError) -> FlagdataError:
        """Returns the error for a process that ended before its time was up."""
        where = _sql_of(self.request)
        if ended.end is End.MEMORY:
            fix = f"narrow it down, or aggregate in SQL: it may take {MEMORY / 1e9:g} GB"
            return UsageError("it needs more memory than there is", where=where, fix=fix)
        if ended.end is End.SIGNAL and ended.detail == "SIGKILL":
            message = (
                "the process that runs SQL was killed (SIGKILL), by another program or for want of "
                "the machine's memory"
            )
            return FlagdataError(
                message, where=where, fix="end other programs, or narrow it down, and do it again"
            )
        if ended.end is End.SIGNAL:
            message = f"the process that runs SQL crashed ({ended.detail}): DuckDB cannot run this"
            return FlagdataError(
                message, where=where, fix="write it in another way, or narrow it down"
            )
        return FlagdataError(
            f"the process that runs SQL has ended: {ended.detail or ended.end}",
            where=where,
            fix="do it again",
        )

    def _check_rows(self) -> None:
        """Raise CorruptError where a file of the catalog is to blame."""
        if self._check is not None:
            self._check()


_numbers = count()


def _sql_of(request: Request) -> str | None:
    """Returns the user's own SQL, for a message."""
    texts = (request.sql, request.where, request.order)
    return "; ".join(text for text in texts if isinstance(text, str) and text) or None


def _field(name: str, field: Field) -> pa.Field:
    about = {"unit": field.unit, "about": field.about}
    return pa.field(name, field.type, nullable=field.nullable, metadata=about)


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
        UsageError: SQL that cannot be run; the message carries DuckDB's reason and, for a misspelt
            column, its name.
        LimitError: it takes longer, or gives more, than it may.
        NotFoundError: no such ref.
    """
    request = Request(
        where=where,
        columns=None if columns is None else tuple(columns),
        order=order,
        sql=sql,
        limit=limit,
        time_limit=time_limit,
    )
    return Selection(lake.scan(lake.view(at)), request).table()
