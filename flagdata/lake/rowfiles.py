"""The catalog's Parquet files: read whole as one table in order, or column by column while a query
runs.

A million rows have some 400 MB as a table and 20 MB as files, of which a query uses a few columns
and a commit the identities alone. A table is sorted, and so copied, only where its files are not in
order already.

Each file is compared with the SHA-256 that its commit noted when it is read (2 ms/MB): Parquet
would give other values for most flipped bits.

What rows of older formats record about their data set in another place than its columns, read into
the columns.

Until format 3 a film's data set and side were in its name alone: `flagdata build` called it
DATASET-SIDE-NUMBER and kept what it was filmed by in the recipe, under the key "film". Neither side
nor number has a hyphen, so that the name states both exactly, whatever hyphens the data set's own
name has. Clips belong to where their recording does.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from flagdata.core.files.bounded_parquet import check_stated
from flagdata.core.files.buffers import own_copy
from flagdata.core.files.durable import HEAL
from flagdata.core.files.regular_files import open_regular
from flagdata.core.schema import CATALOG, Kind, catalog_schema
from flagdata.errors import CorruptError
from flagdata.lake.catalog_sql import dataset_of
from flagdata.recipes.documents import column_json
from flagdata.storage import Place

SINCE = max(CATALOG["dataset"].since, CATALOG["side"].since)
"""Rows of this format version and later need nothing filled."""
_SIDES = ("train", "validation", "test")
_DIGITS = 5  # of a film's number, at least


def with_data_sets(rows: pa.Table) -> pa.Table:
    """Fills `dataset` and `side` of rows where films and clips were built before these columns
    existed.

    Args:
        rows: with the catalog's columns.
    """
    films = rows.filter(
        (pc.field("format_version") < SINCE)
        & (pc.field("kind") == Kind.RECORDING.value)
        & pc.field("seed").is_valid()
        & pc.field("dataset").is_null()
    )
    sets_of_films = {
        artifact: of
        for artifact, name, recipe in zip(
            *(films[c].to_pylist() for c in ("artifact", "name", "recipe")), strict=True
        )
        if (of := _data_set_of(name)) is not None
        and "film" in column_json(recipe or "{}", "recipe", artifact=artifact)
    }
    if not sets_of_films:
        return rows
    made_of = [
        recording if kind == Kind.CLIP else artifact
        for artifact, kind, recording in zip(
            *(rows[column].to_pylist() for column in ("artifact", "kind", "recording")), strict=True
        )
    ]
    for position, column in enumerate(("dataset", "side")):
        filled = [
            value
            if value is not None or film not in sets_of_films
            else sets_of_films[film][position]
            for value, film in zip(rows[column].to_pylist(), made_of, strict=True)
        ]
        number = rows.schema.get_field_index(column)
        rows = rows.set_column(
            number, rows.schema.field(number), pa.array(filled, CATALOG[column].type)
        )
    return rows


def _data_set_of(name: str) -> tuple[str, str] | None:
    """Reads the data set and the side that a film is called after."""
    rest, _, number = name.rpartition("-")
    dataset, _, side = rest.rpartition("-")
    if (
        not dataset
        or side not in _SIDES
        or len(number) < _DIGITS
        or not (number.isascii() and number.isdigit())
    ):
        return None
    return dataset, side


ROW_ORDER = ("created", "start", "frame_first", "artifact")
_NUMBERS = ROW_ORDER[:-1]
_LAST = np.iinfo(np.int64).max


class RowFiles:
    """The files of rows in a folder; what was read of one version is kept for the next.

    Args:
        noted: gives the SHA-256 that a file of that name may have; any, where it gives none.
    """

    def __init__(self, folder: Place, noted: Callable[[str], Collection[str]]) -> None:
        self._folder = folder
        self._noted = noted
        self._contents: dict[str, pa.Buffer] = {}
        self._tables: dict[str, pa.Table] = {}

    def table(self, names: Sequence[str]) -> pa.Table:
        """Reads all rows of these files in the catalog's schema and `ROW_ORDER`. Columns that old
        rows lack are null, but for those that `flagdata.lake.rowfiles` fills.

        Raises:
            CorruptError: a file cannot be read.
        """
        self._tables = {name: self.read(name) for name in names}
        parts = sorted(
            (part for part in self._tables.values() if part.num_rows), key=_first_created
        )
        rows = with_data_sets(pa.concat_tables(parts) if parts else catalog_schema().empty_table())
        return in_order(rows)

    def scan(self, names: Sequence[str]) -> Scan | None:
        """Opens the same rows, by commit, of which only the columns and rows that are asked for are
        decoded; `None` where rows of an older format have columns to be filled, or a file lacks
        columns.

        Raises:
            CorruptError: a file cannot be read.
        """
        self._contents = {name: self._content(name) for name in names}
        timed_contents: list[tuple[int, pa.Buffer]] = []
        count = size = 0
        for name, content in self._contents.items():
            with self._reading(name):
                file = pq.read_metadata(pa.BufferReader(content))
                if not file.num_rows:
                    continue
                oldest, created = _statistics(file)
                if oldest < SINCE:
                    return None
                timed_contents.append((created, content))
            count += file.num_rows
            size += sum(
                file.row_group(number).total_byte_size for number in range(file.num_row_groups)
            )
        contents = tuple(content for _, content in sorted(timed_contents, key=lambda pair: pair[0]))
        return Scan(contents=contents, count=count, size=size, check=lambda: self.table(names))

    def holding(self, names: Sequence[str], condition: pc.Expression) -> list[str]:
        """Selects those of the files of which some rows meet a condition.

        Raises:
            CorruptError: a file cannot be read.
        """
        import pyarrow.dataset as ds

        self._contents = {name: self._content(name) for name in names}
        form, names_with_rows = ds.ParquetFileFormat(), []
        for name, content in self._contents.items():
            with self._reading(name):
                rows = ds.FileSystemDataset([form.make_fragment(content)], catalog_schema(), form)
                if rows.count_rows(filter=condition):
                    names_with_rows.append(name)
        return names_with_rows

    def read(self, name: str) -> pa.Table:
        """Reads the rows of one file, as they are in it.

        Raises:
            CorruptError: it cannot be read.
        """
        if name in self._tables:
            return self._tables[name]
        with self._reading(name):
            table = _conform(pq.read_table(pa.BufferReader(self._content(name))))
            table.validate(full=True)  # text that is not UTF-8, for one
        return table

    def objects(self, names: Iterable[str]) -> Iterator[str]:
        """Names of the objects that rows of these files point to."""
        for name in names:
            yield from self.read(name)["object"].drop_null().to_pylist()

    def _content(self, name: str) -> pa.Buffer:
        if name in self._contents:
            return self._contents[name]
        with self._reading(name), open_regular(self._folder / name) as stream:
            content = own_copy(stream.read())
            where = str(self._folder / name)
            noted = self._noted(name)
            if noted and hashlib.sha256(content).hexdigest() not in noted:
                raise changed_file(self._folder / name)
            footer = pq.read_metadata(pa.BufferReader(content))
            check_stated(footer, content.size, where=where, fix=HEAL)
        return content

    @contextmanager
    def _reading(self, name: str) -> Iterator[None]:
        try:
            yield
        except (OSError, pa.ArrowException) as error:
            raise CorruptError(
                f"a file of the catalog cannot be read: {error}",
                where=str(self._folder / name),
                fix=HEAL,
            ) from None


def encode_rows(rows: pa.Table) -> bytes:
    """Returns the bytes of a file of rows."""
    sink = pa.BufferOutputStream()
    # The Arrow schema is schema.py's, and most values occur once: without both, a row's file has 6
    # kB, not 15.
    pq.write_table(rows, sink, compression="zstd", store_schema=False, use_dictionary=False)
    return sink.getvalue().to_pybytes()


def changed_file(path: Place) -> CorruptError:
    """Returns the error for a file that is not what its commit noted."""
    return CorruptError(
        "a file of the catalog has changed since it was written", where=str(path), fix=HEAL
    )


@dataclass(frozen=True, kw_only=True)
class Scan:
    """Rows that are decoded as a query asks for them.

    Attributes:
        contents: of Parquet files with rows of the catalog's columns.
        condition: that those of them meet which count.
        count: how many they are, at most.
        size: of all columns, decoded [B], about.
        check: reads all of it at once; raises CorruptError where a file is damaged.
    """

    contents: tuple[pa.Buffer, ...]
    count: int
    size: int
    check: Callable[[], object]
    condition: pc.Expression | None = None

    def matching(self, condition: pc.Expression) -> Scan:
        """Selects those of the rows that meet a condition."""
        conditions = condition if self.condition is None else self.condition & condition
        return replace(self, condition=conditions)

    def table(self, columns: Iterable[str]) -> pa.Table:
        """Reads some columns of the rows.

        Raises:
            CorruptError: a file cannot be read.
        """
        try:
            return dataset_of(self.contents, self.condition).to_table(columns=list(columns))
        except (OSError, pa.ArrowException):
            self.check()
            raise


def _conform(table: pa.Table) -> pa.Table:
    schema = catalog_schema()
    columns = [
        table[f.name].cast(f.type)
        if f.name in table.column_names
        else pa.nulls(table.num_rows, f.type)
        for f in schema
    ]
    return pa.Table.from_arrays(columns, schema=schema)


def _statistics(file: pq.FileMetaData) -> tuple[int, int]:
    """Reads the lowest format version of a file's rows and when the first was committed [us]; 0
    where it does not state them."""
    lowest: dict[str, list[int]] = {"format_version": [], "created": []}
    for number in range(file.num_row_groups):
        group = file.row_group(number)
        for column in map(group.column, range(group.num_columns)):
            if column.path_in_schema in lowest:
                statistics = column.statistics
                if statistics is None or not statistics.has_min_max:
                    return 0, 0
                lowest[column.path_in_schema].append(statistics.min_raw)
    return min(lowest["format_version"], default=0), min(lowest["created"], default=0)


def _first_created(part: pa.Table) -> int:
    return int(part["created"].cast(pa.int64()).to_numpy().min())


def in_order(rows: pa.Table) -> pa.Table:
    """Sorts the rows in `ROW_ORDER`; they are copied only where they are not in it."""
    return rows if _is_ordered(rows) else rows.sort_by([(name, "ascending") for name in ROW_ORDER])


def _is_ordered(rows: pa.Table) -> bool:
    """Checks whether rows are in `ROW_ORDER`, in which what is unknown comes last."""
    if rows.num_rows < 2:
        return True
    equal = np.ones(rows.num_rows - 1, dtype=np.bool_)
    for name in _NUMBERS:
        values = rows[name].cast(pa.int64()).fill_null(_LAST).to_numpy()
        if (equal & (values[:-1] > values[1:])).any():
            return False
        equal &= values[:-1] == values[1:]
    (ties,) = np.nonzero(equal)
    first, second = (
        rows["artifact"].take(pa.array(index)).to_pylist() for index in (ties, ties + 1)
    )
    return all(
        first_value <= second_value for first_value, second_value in zip(first, second, strict=True)
    )
