"""CSV files of an export: how their cells are written."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a new file of a heading and rows.

    Raises:
        FileExistsError: it is there.
    """
    with path.open("x", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)


def cell(value: Any) -> Any:
    """Writes a cell: floats so that they read back exactly, unknown ones empty, lists by
    semicolons."""
    if isinstance(value, float):
        return repr(value) if np.isfinite(value) else ""
    return ";".join(map(str, value)) if isinstance(value, list) else value
