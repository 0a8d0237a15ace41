"""Marker tables, CSV or Parquet: one row a marker and frame.

Columns: `marker` (its name), `u`, `v` (where it is on the flat cloth), `x`, `y`, `z` (where it is
in space), `frame` (a whole number) or `time` [s] or both, and `recording` where a table holds
several. A row that is missing, or whose position is empty, says that the marker was not tracked.
Other columns are refused: a misspelt one would be missed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from flagdata.core.arrays import AnyArray, FloatArray, IntArray
from flagdata.core.files.plain_text import encoding_of
from flagdata.core.files.regular_files import check_input
from flagdata.core.units import unit
from flagdata.errors import InputError, LimitError, UsageError
from flagdata.ingest.named_columns import check_columns, small_table_head
from flagdata.lake.marker_sequences import MarkerSequence
from flagdata.timebase import NANOSECONDS

COLUMNS = ("marker", "u", "v", "x", "y", "z")
"""Columns that every marker table has, beside `frame` or `time`."""
_OPTIONAL = ("frame", "time", "recording")
SIZE_LIMIT = 1 << 31
"""Largest table that is read [B]."""
POSITIONS_LIMIT = 50_000_000
"""Most positions of a recording: frames times markers."""
_SAME = 1e-6  # of a marker's own u and v: differences that are no difference
_MAGIC = b"PAR1"
_FOOTER_LIMIT = 1 << 24  # B, and entries, of a Parquet footer's parts


@dataclass(frozen=True, kw_only=True)
class MarkerOptions:
    """What a marker table does not say.

    Attributes:
        rate: frames a second [Hz], of a table with frame numbers and no times.
        unit: of x, y and z.
        rest_unit: of u and v; None for that of x, y and z.

    Raises:
        UsageError: an impossible rate, or a unit that is no length.
    """

    rate: float | None = None
    unit: str = "m"
    rest_unit: str | None = None

    def __post_init__(self) -> None:
        if self.rate is not None and not (math.isfinite(self.rate) and 0 < self.rate <= 1e6):
            raise UsageError(
                f"the frame rate {self.rate!r} Hz is out of range",
                where="--rate",
                fix="give frames a second",
            )
        for name in (self.unit, self.rest_unit or self.unit):
            if unit(name).si != "m":
                raise UsageError(
                    f"{name!r} is no unit of length", where="--unit", fix="give mm, cm, m or ft"
                )

    def recipe(self) -> dict[str, Any]:
        """As JSON."""
        return {"rate": self.rate, "unit": self.unit, "rest_unit": self.rest_unit}


def is_marker_table(path: Path) -> bool:
    """Checks whether a file's header is that of a marker table."""
    try:
        columns = set(_columns(path))
    except (InputError, OSError, pa.ArrowException):
        return False
    return columns >= set(COLUMNS)


def read_table(path: Path, options: MarkerOptions | None = None) -> Mapping[str, MarkerSequence]:
    """Reads the recordings of a table by name; one without a column `recording` is called "".

    Args:
        path: CSV (comma, semicolon or tab; decimal points) or Parquet.

    Raises:
        NotFoundError: no such file.
        LimitError: a table too large to be read.
        InputError: columns or values that are missing or malformed, markers that occur twice in a
            frame or lie in two places of the cloth.
        UnknownNameError: a column that is none of these.
        UsageError: a rate that the table needs, or has no use for.
    """
    options = options or MarkerOptions()
    check_input(path, noun="table", limit=SIZE_LIMIT)
    names = _columns(path)
    _check_columns(names, options, str(path))
    table = _rows(path, names)
    if not table.num_rows:
        raise InputError(
            "there are no rows", where=str(path), fix="export the table with its tracks"
        )
    if "recording" not in names:
        return {"": _sequence(table, options, str(path))}
    column = table["recording"]
    if column.null_count:
        raise InputError(
            "a row names no recording", where=str(path), fix="fill the column, or leave it out"
        )
    sequences: dict[str, MarkerSequence] = {}
    of = column.to_numpy()
    for name in column.unique().to_pylist():
        sequences[name] = _sequence(
            table.filter(pa.array(of == name)), options, f"{path}, recording {name!r}"
        )
    return sequences


def _is_parquet(path: Path) -> bool:
    with path.open("rb") as stream:
        return stream.read(len(_MAGIC)) == _MAGIC


def _columns(path: Path) -> list[str]:
    if _is_parquet(path):
        with _table_errors(path):
            return list(_parquet(path).schema_arrow.names)
    return list(small_table_head(path).names)


def _check_columns(names: list[str], options: MarkerOptions, where: str) -> None:
    fix = f"give {', '.join(COLUMNS)}, and frame or time"
    check_columns(names, needed=COLUMNS, optional=_OPTIONAL, where=where, fix=fix)
    if "time" not in names and "frame" not in names:
        raise InputError(
            "the table has neither a frame nor a time column",
            where=where,
            fix="add the number of the frame, or its time in s",
        )
    if "time" not in names and options.rate is None:
        raise UsageError(
            "the table has frame numbers only",
            where=where,
            fix="give the frames per second by --rate",
        )
    if "time" in names and options.rate is not None:
        raise UsageError(
            "the table has times of its own",
            where=where,
            fix="leave the rate out, or the column time",
        )


def _rows(path: Path, names: list[str]) -> pa.Table:
    """Reads the table with its numbers as float64 and its names as text."""
    texts = ("marker", "recording")
    wanted = pa.schema([(name, pa.string() if name in texts else pa.float64()) for name in names])
    try:
        if _is_parquet(path):
            with _table_errors(path):
                file = _parquet(path)
                table = pa.concat_tables(
                    file.read_row_group(i, columns=names) for i in range(file.num_row_groups)
                )
                table.validate(full=True)  # text that is not UTF-8, for one
                return table.select(names).cast(wanted)
        head = small_table_head(path)
        with path.open("rb") as stream:
            encoding = encoding_of(stream.read(4))
        return pyarrow.csv.read_csv(
            path,
            read_options=pyarrow.csv.ReadOptions(
                column_names=names, skip_rows=head.line, encoding=encoding
            ),
            parse_options=pyarrow.csv.ParseOptions(delimiter=head.delimiter),
            convert_options=pyarrow.csv.ConvertOptions(
                column_types=wanted,
                strings_can_be_null=True,
                null_values=["", "NaN", "nan", "NA"],
                decimal_point="," if head.decimal_commas else ".",
            ),
        )
    except (pa.ArrowException, UnicodeError) as error:  # the second of a file in UTF-16
        raise InputError(
            f"this is not a table of numbers: {str(error).splitlines()[0]}",
            where=str(path),
            fix="write numbers with a decimal point, and leave cells empty that have none",
        ) from None


def _parquet(path: Path) -> pyarrow.parquet.ParquetFile:
    """Opens a Parquet file whose pages' checksums are compared, where it has any.

    Raises:
        LimitError: it says that it unpacks to more than `SIZE_LIMIT`, or has more rows than
            `POSITIONS_LIMIT`.
    """
    file = pyarrow.parquet.ParquetFile(
        path,
        page_checksum_verification=True,
        thrift_string_size_limit=_FOOTER_LIMIT,
        thrift_container_size_limit=_FOOTER_LIMIT,
    )
    groups = [file.metadata.row_group(index) for index in range(file.num_row_groups)]
    rows, size = (
        sum(group.num_rows for group in groups),
        sum(group.total_byte_size for group in groups),
    )
    if rows > POSITIONS_LIMIT or size > SIZE_LIMIT:
        raise LimitError(
            f"the table has {rows} rows and {size} bytes unpacked",
            where=str(path),
            fix=f"at most {POSITIONS_LIMIT} rows and {SIZE_LIMIT} bytes are read",
        )
    return file


@contextmanager
def _table_errors(path: Path) -> Iterator[None]:
    """Turns whatever a damaged Parquet file makes its reader raise into one error."""
    try:
        yield
    except (pa.ArrowException, OSError, ValueError, OverflowError, MemoryError, KeyError) as error:
        first_line = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(
            f"the Parquet file cannot be read: {first_line}",
            where=str(path),
            fix="export the table again",
        ) from None


def _sequence(table: pa.Table, options: MarkerOptions, where: str) -> MarkerSequence:
    if table["marker"].null_count:
        raise InputError("a row names no marker", where=where, fix="name every marker")
    names, marker = np.unique(table["marker"].to_numpy(), return_inverse=True)
    instants, frame = _frames(table, options, where)
    if len(instants) * len(names) > POSITIONS_LIMIT:
        raise LimitError(
            f"{len(instants)} frames of {len(names)} markers",
            where=where,
            fix=f"give recordings of at most {POSITIONS_LIMIT} positions",
        )
    seat = frame * len(names) + marker
    order = np.argsort(seat, kind="stable")
    twice = np.flatnonzero(np.diff(seat[order]) == 0)
    if len(twice):
        row = int(order[twice[0] + 1])
        raise InputError(
            f"marker {names[marker[row]]!r} is there twice in a frame",
            where=f"{where}, row {row + 1}",
            fix="keep one of them; is a column recording missing?",
        )
    length, rest_length = (
        unit(options.unit, where=where),
        unit(options.rest_unit or options.unit, where=where),
    )
    positions = np.full((len(instants) * len(names), 3), np.nan)
    positions[seat] = np.stack([length.to_si(_numbers(table, axis)) for axis in "xyz"], axis=1)
    rest = np.stack(
        [rest_length.to_si(_seats(table, axis, marker, names, where)) for axis in "uv"], axis=1
    )
    if np.isinf(positions).any():
        raise InputError(
            "a coordinate is infinite",
            where=where,
            fix="leave positions empty that were not tracked",
        )
    positions[~np.isfinite(positions).all(axis=1)] = np.nan
    return MarkerSequence(
        time=instants,
        positions=positions.reshape(len(instants), len(names), 3),
        rest=rest,
        names=tuple(str(name) for name in names),
        attributes={"source": "marker table"},
    )


def _frames(table: pa.Table, options: MarkerOptions, where: str) -> tuple[IntArray, IntArray]:
    """Computes (n,) instants of the frames from 0 [ns], and (row,) the frame each row is of."""
    column = "time" if "time" in table.column_names else "frame"
    values = _numbers(table, column)
    if not np.isfinite(values).all():
        row = int(np.flatnonzero(~np.isfinite(values))[0])
        raise InputError(
            f"a row has no {column}", where=f"{where}, row {row + 1}", fix="fill the column"
        )
    if column == "frame" and (values != np.rint(values)).any():
        raise InputError(
            "a frame number with decimals",
            where=where,
            fix="name the column time, if it is in seconds",
        )
    seconds = values if options.rate is None else values / options.rate
    instants, frame = np.unique(
        np.rint((seconds - seconds.min()) * NANOSECONDS).astype(np.int64), return_inverse=True
    )
    return instants, frame.astype(np.int64)


def _seats(table: pa.Table, axis: str, marker: IntArray, names: AnyArray, where: str) -> FloatArray:
    """Finds (marker,) the one value of u or v that each marker's rows give."""
    values = _numbers(table, axis)
    is_given = np.isfinite(values)
    low, high = np.full(len(names), np.inf), np.full(len(names), -np.inf)
    np.minimum.at(low, marker[is_given], values[is_given])
    np.maximum.at(high, marker[is_given], values[is_given])
    if (low > high).any():
        lost = names[int(np.flatnonzero(low > high)[0])]
        raise InputError(
            f"marker {lost!r} has no {axis}",
            where=where,
            fix="say where each marker is on the flat cloth",
        )
    moved = high - low > _SAME * max(float(np.ptp(values[is_given])), 1e-30)
    if moved.any():
        strange = int(np.flatnonzero(moved)[0])
        raise InputError(
            f"marker {names[strange]!r} has {axis} from {low[strange]:.6g} to {high[strange]:.6g}",
            where=where,
            fix="u and v, its place on the flat cloth, are the same in all frames; several "
            "recordings need a column "
            "recording",
        )
    return low


def _numbers(table: pa.Table, column: str) -> FloatArray:
    return table[column].to_numpy(zero_copy_only=False).astype(np.float64)
