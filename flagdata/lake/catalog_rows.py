"""Rows of a catalog: what `flagdata.query` returns."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pyarrow as pa

from flagdata.core.html import grid
from flagdata.core.printable import SHORT

_SHOWN = 10


class Rows:
    """Rows that a query selected.

    Attributes:
        table: the rows, an Arrow table; the catalog's columns carry their unit in the metadata of
            their fields.
    """

    def __init__(self, table: pa.Table) -> None:
        self.table = table

    @property
    def columns(self) -> tuple[str, ...]:
        """Names, in order."""
        return tuple(self.table.column_names)

    def __len__(self) -> int:
        return self.table.num_rows

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.table.to_pylist())

    def __getitem__(self, column: str) -> np.ndarray:
        """Returns the (n,) array of a column; numbers with gaps are float64 with NaN, texts with
        gaps hold None.

        Raises:
            KeyError: no such column.
        """
        return self.table.column(column).to_numpy(zero_copy_only=False)

    def to_pandas(self) -> Any:
        """Returns the rows as a data frame, where pandas is installed."""
        return self.table.to_pandas()

    def __repr__(self) -> str:
        names, cells = self._excerpt()
        widths = [max(map(len, column)) for column in zip(names, *cells, strict=True)]
        lines = [
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in (names, *cells)
        ]
        return "\n".join([f"Rows({len(self)} of {len(self.columns)} columns)", *lines])

    def _repr_html_(self) -> str:
        names, cells = self._excerpt()
        return grid(f"{len(self)} rows", names, cells)

    def _excerpt(self) -> tuple[list[str], list[list[str]]]:
        """Columns that hold something, and their first cells as text."""
        head = self.table.slice(0, _SHOWN)
        names = [name for name in self.columns if head.column(name).null_count < head.num_rows]
        cells = [[_text(row[name]) for name in names] for row in head.to_pylist()]
        if len(self) > _SHOWN:
            cells.append(["…"] * len(names))
        return names, cells


def _text(value: Any) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else "" if value is None else str(value)
    return text if len(text) <= 2 * SHORT else f"{text[:SHORT]}…"
