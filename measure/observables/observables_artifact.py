"""Observables of a film in the lake: a measurement whose object is the table as a Zarr folder."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical
from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake, results
from flagdata.lake.results import Placed
from flagdata.timebase import NANOSECONDS
from measure.film.film_source import Subject
from measure.observables.observables_table import ObservableTable
from models.conditioning.conditioning import VERSION as CONDITIONED

VERSION = 5
"""Raised whenever the same film gives other readings."""


def artifact(table: ObservableTable, subject: Subject, options: Mapping[str, Any]) -> Artifact:
    """Builds the row of a table, without its object.

    Args:
        options: all that shapes the readings beside the film: JSON values.
    """
    origin, half = subject.film.start, table.seconds / 2
    start, end = (
        None if origin is None else origin + round(at * NANOSECONDS)
        for at in (float(table.time[0]) - half, float(table.time[-1]) + half)
    )
    return Artifact(
        kind=Kind.MEASUREMENT,
        name=f"{table.film} observables",
        parents=[] if subject.artifact is None else [subject.artifact.id],
        source_hash=subject.content_hash(),
        source_name=None if subject.path is None else subject.path.name,
        start=start,
        end=end,
        recipe={"observe": VERSION, "conditioned": CONDITIONED, **table.head(), **options},
        report=canonical(json_values(table)),
    )


def keep(
    lake: Lake, table: ObservableTable, subject: Subject, options: Mapping[str, Any], *, branch: str
) -> Placed:
    """Commit a table where it is new, see `flagdata.lake.results`.

    Raises:
        FlagdataError: as `Lake.transaction`.
    """
    row = artifact(table, subject, options)
    return results.keep(lake, row, table.write_zarr, f"observe {table.film}", branch=branch)
