"""Observables of a film in the lake: a measurement whose object is the table as a Zarr folder."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flagdata.lake import Artifact, Lake
from flagdata.provenance import canonical
from flagdata.schema import Kind
from flagdata.timebase import NANOSECONDS
from measure.estimate.source import Subject
from measure.observables.table import Table
from models.conditioning.conditioning import VERSION as CONDITIONED

VERSION = 5
"""Raised whenever the same film gives other readings."""


def artifact(table: Table, subject: Subject, options: Mapping[str, Any], *, stored: str | None = None) -> Artifact:
    """The row of a table.

    Args:
        options: all that shapes the readings beside the film: JSON values.
    """
    origin, half = subject.film.start, table.seconds / 2
    start, end = (
        None if origin is None else origin + round(at * NANOSECONDS)
        for at in (float(table.time[0]) - half, float(table.time[-1]) + half)
    )
    return Artifact(
        kind=Kind.MEASUREMENT, name=f"{table.film} observables", object=stored,
        parents=[] if subject.artifact is None else [subject.artifact.id], source_hash=subject.content_hash(),
        source_name=None if subject.path is None else subject.path.name, start=start, end=end,
        recipe={"observe": VERSION, "conditioned": CONDITIONED, **table.head(), **options},
        report=canonical(table.as_dict()),
    )  # fmt: skip


def keep(lake: Lake, table: Table, subject: Subject, options: Mapping[str, Any], *, branch: str) -> tuple[str, bool]:
    """Commit a table: the artifact's id, and whether it is new; the same one again adds nothing.

    Raises:
        FlagdataError: as `Lake.transaction`.
    """
    wanted = artifact(table, subject, options)
    with lake.transaction(f"observe {table.film}", branch=branch) as transaction:
        if transaction.find(wanted.id) is not None:
            return wanted.id, False
        staged = transaction.staging(".zarr")
        table.write_zarr(staged)
        transaction.add(artifact(table, subject, options, stored=transaction.put(staged)))
    return wanted.id, wanted.id in transaction.result.added
