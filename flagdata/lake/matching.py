"""Rows that have given values. A program selects by values this way: no value is ever pasted into
SQL."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import reduce
from operator import and_
from typing import Any, TypeAlias

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.core.schema import CATALOG
from flagdata.errors import UnknownNameError, UsageError

Values: TypeAlias = Mapping[str, Any]
"""Column → the value wanted, `None` where the column must be empty, or several values (list, tuple,
set), one of which a row must have."""
Where: TypeAlias = str | Values
"""A filter over the catalog: the user's SQL expression as in `flagdata.lake.selection`, or values
that columns have."""


def matching(rows: pa.Table, values: Values) -> pa.Table:
    """Selects the rows with these values in these columns, in their order; all rows where no column
    is named.

    Raises:
        UnknownNameError: no such column.
        UsageError: a value that the column cannot hold.
    """
    return rows.filter(condition(values)) if values else rows


def condition(values: Values) -> pc.Expression:
    """Builds the condition that rows with these values, at least one, meet.

    Raises:
        UnknownNameError, UsageError: as `matching`.
    """
    return reduce(and_, (_condition(column, value) for column, value in values.items()))


def made_from(rows: pa.Table, artifacts: Collection[str]) -> pa.Table:
    """Selects the rows of which some of `artifacts` are parents, in their order."""
    parents = rows["parents"].combine_chunks()
    names = pa.array(sorted(artifacts), pa.string())
    flat = pc.list_flatten(parents)  # type: ignore[attr-defined]
    is_made = pc.is_in(flat, value_set=names)  # type: ignore[attr-defined]
    of_row = pc.list_parent_indices(parents)  # type: ignore[attr-defined]
    return rows.take(of_row.filter(is_made).unique())


def _condition(column: str, value: object) -> pc.Expression:
    if column not in CATALOG:
        raise UnknownNameError.of("column", column, CATALOG)
    wanted = list(value) if isinstance(value, list | tuple | set | frozenset) else [value]
    try:
        values = pa.array([value for value in wanted if value is not None], CATALOG[column].type)
    except (
        pa.ArrowInvalid,
        pa.ArrowTypeError,
        pa.ArrowNotImplementedError,
        OverflowError,
    ) as error:
        raise UsageError(
            f"the column {column} cannot hold {value!r}: {error}",
            where=column,
            fix=f"give {CATALOG[column].type}",
        ) from None
    condition = pc.field(column).isin(values)
    return condition | pc.field(column).is_null() if None in wanted else condition
