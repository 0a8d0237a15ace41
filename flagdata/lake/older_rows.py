"""What rows of older formats record about their data set in another place than its columns, read into the columns.

Until format 3 a film's data set and side were in its name alone: `flagdata build` called it DATASET-SIDE-NUMBER and
kept what it was filmed by in the recipe, under the key "film". Neither side nor number has a hyphen, so that the name
states both exactly, whatever hyphens the data set's own name has. Clips belong to where their recording does.
"""

from __future__ import annotations

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.documents import column_json
from flagdata.schema import CATALOG, Kind

SINCE = max(CATALOG["dataset"].since, CATALOG["side"].since)
"""Rows of this format version and later need nothing filled."""
_SIDES = ("train", "validation", "test")
_DIGITS = 5  # of a film's number, at least


def with_data_sets(rows: pa.Table) -> pa.Table:
    """The rows with `dataset` and `side` filled where films and clips were built before these columns existed.

    Args:
        rows: with the catalog's columns.
    """
    films = rows.filter(
        (pc.field("format_version") < SINCE)
        & (pc.field("kind") == Kind.RECORDING.value)
        & pc.field("seed").is_valid()
        & pc.field("dataset").is_null()
    )
    stated = {
        artifact: of
        for artifact, name, recipe in zip(*(films[c].to_pylist() for c in ("artifact", "name", "recipe")), strict=True)
        if (of := _stated(name)) is not None and "film" in column_json(recipe or "{}", "recipe", artifact=artifact)
    }
    if not stated:
        return rows
    made_of = [
        recording if kind == Kind.CLIP else artifact
        for artifact, kind, recording in zip(
            *(rows[column].to_pylist() for column in ("artifact", "kind", "recording")), strict=True
        )
    ]
    for place, column in enumerate(("dataset", "side")):
        filled = [
            known if known is not None or film not in stated else stated[film][place]
            for known, film in zip(rows[column].to_pylist(), made_of, strict=True)
        ]
        number = rows.schema.get_field_index(column)
        rows = rows.set_column(number, rows.schema.field(number), pa.array(filled, CATALOG[column].type))
    return rows


def _stated(name: str) -> tuple[str, str] | None:
    """The data set and the side that a film is called after."""
    rest, _, number = name.rpartition("-")
    dataset, _, side = rest.rpartition("-")
    if not dataset or side not in _SIDES or len(number) < _DIGITS or not (number.isascii() and number.isdigit()):
        return None
    return dataset, side
