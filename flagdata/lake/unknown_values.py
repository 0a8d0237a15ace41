"""Why a filter finds nothing: a value that no row has, with the nearest one that some have."""

from __future__ import annotations

import re

import pyarrow as pa

from flagdata.core.schema import CATALOG, catalog_schema
from flagdata.errors import suggest
from flagdata.lake.rowfiles import Scan

_COMPARED = re.compile(r"\b([A-Za-z_]\w*)\s*=\s*'((?:[^']|'')*)'")
_LISTED = 6  # values that a message names
_FEW = 1000  # values among which the nearest is sought


def unknown_value(where: str | None, catalog: pa.Table | Scan) -> str | None:
    """Finds the first text that a filter compares a column with and that no row has there.

    Returns:
        a sentence that names it and the nearest ones, "no row has side 'trian'; did you mean
        'train'?"; None where there is no such text.
    """
    for name, quoted in _COMPARED.findall(where or ""):
        if name not in CATALOG or not pa.types.is_string(catalog_schema().field(name).type):
            continue
        value = quoted.replace("''", "'")
        rows = catalog.table([name]) if isinstance(catalog, Scan) else catalog
        present = sorted(rows[name].drop_null().unique().to_pylist())
        if value in present:
            continue
        more = ", …" if len(present) > _LISTED else ""
        known = (
            suggest(value, present[:_FEW])
            or f"there {'are' if present else 'is'} {', '.join(present[:_LISTED]) or 'none'}{more}"
        )
        return f"no row has {name} {value!r}; {known}"
    return None
