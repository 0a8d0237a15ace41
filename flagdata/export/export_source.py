"""What an exporter is given: catalog rows at one version, and the frames and wind behind them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa

from flagdata.core.arrays import UInt8Array
from flagdata.core.schema import CATALOG, TRUTH_WINDOW, Kind
from flagdata.errors import CorruptError
from flagdata.lake import Lake
from flagdata.lake.artifact import ARTIFACT_ID
from flagdata.recipes.documents import column_json
from flagdata.record import Coding, Record
from flagdata.record.signals import Instants
from flagdata.record.writer import encode_jpeg
from flagdata.timebase import NANOSECONDS, iso

FILMED = frozenset({Kind.CLIP, Kind.RECORDING, Kind.CAMERA})
"""Kinds of rows that have frames."""
# Columns that say what a sample is and where it comes from; written beside the data by every
# format.
IDENTITY = (
    "artifact",
    "kind",
    "name",
    "object",
    "parents",
    "recipe_hash",
    "code_version",
    "seed",
    "recording",
    "session",
    "dataset",
    "side",
    "day",
    "frame_first",
    "frame_count",
    "rate",
)
TRUTH = (
    "wind",
    "wind_sigma",
    "wind_coverage",
    "wind_staleness",
    "clock_method",
    "clock_offset",
    "clock_drift",
    "clock_sigma",
    "quality",
)


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One catalog row and the part of its record that it describes.

    Attributes:
        row: the catalog row, column → value.
        record: the record.
        first: index of the first frame in the record.
        count: number of frames; 0 for a record without any.
        labels: of the user's, by name.
    """

    row: Mapping[str, Any]
    record: Record
    first: int
    count: int
    labels: Mapping[str, Any] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """The identity: file names and sample keys are made of it."""
        return self.row["artifact"]

    @property
    def is_slice(self) -> bool:
        """Whether the row names frames of its object, as clips do, instead of all of it."""
        return self.row["frame_first"] is not None

    @property
    def frame_times(self) -> Instants:
        """(count,) instants of the frames on the common clock, UTC ns."""
        return self.record.frame_times[self.first : self.first + self.count]

    @property
    def device_frame_times(self) -> Instants:
        """(count,) instants of the frames on the camera's own clock, UTC ns."""
        return self.record.device_frame_times[self.first : self.first + self.count]

    @property
    def wind_span(self) -> tuple[int, int]:
        """First and last instant [UTC ns] of the wind that belongs to it: from a truth window
        before the first frame to the last frame; everything where there are no frames."""
        if not self.count:
            return -(2**63), 2**63 - 1
        times = self.frame_times
        recipe = self._from_column("recipe") if self.row.get("recipe") else {}
        window = recipe.get("window", recipe.get("truth", {}).get("window", TRUTH_WINDOW))
        return int(times[0]) - round(window * NANOSECONDS), int(times[-1])

    def images(self, size: int = 64) -> Iterator[UInt8Array]:
        """Yields the frames decoded, in order, as arrays (at most `size`, height, width) gray."""
        for begin in range(0, self.count, size):
            yield self.record.frames(self.first + begin, min(size, self.count - begin))

    def jpegs(self) -> Iterator[bytes]:
        """Yields the frames as JPEG, in order: the stored bytes, or decoded and encoded anew where
        the record is H.264."""
        if self.count and self.record.coding is Coding.H264:
            for images in self.images():
                yield from map(encode_jpeg, images)
        else:
            yield from map(self.record.jpeg, range(self.first, self.first + self.count))

    @property
    def parameters(self) -> Any:
        """What it was made with, as strict JSON; unknown numbers are null."""
        return _strict(self._from_column("parameters")) if self.row["parameters"] else None

    def _from_column(self, column: str) -> Any:
        return column_json(self.row[column], column, artifact=self.row["artifact"])

    def label(self) -> dict[str, Any]:
        """Returns identity, ground truth with σ, times and parameters as strict JSON; unknown
        numbers are null."""
        row = self.row
        times = self.frame_times
        return {
            "schema": "flagdata.sample/1",
            **{name: _strict(row[name]) for name in (*IDENTITY, *TRUTH)},
            "start": row["start"],
            "end": row["end"],
            "start_time": None if row["start"] is None else iso(row["start"]),
            "end_time": None if row["end"] is None else iso(row["end"]),
            "frame_times": times.tolist(),
            "parameters": self.parameters,
            **({"labels": dict(self.labels)} if self.labels else {}),
        }


def label_units() -> dict[str, str]:
    """Units of the numbers in `Entry.label`, for the manifest."""
    units = {
        name: CATALOG[name].unit
        for name in (*IDENTITY, *TRUTH, "start", "end")
        if CATALOG[name].unit
    }
    return {**units, "frame_times": "ns"}


def _strict(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _strict(part) for name, part in value.items()}
    if isinstance(value, list):
        return [_strict(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


@dataclass(frozen=True, kw_only=True)
class ExportRows:
    """The rows of one export, in their order. Their identities name files: each is one that an
    artifact can have, and is there once.

    Attributes:
        lake: that they are in.
        rows: with all columns of `schema.CATALOG`.
        labels: artifact → the user's own values.
        side: that all rows are on, since it was asked for or all state it; `None` of a mixture.
        split_by: the rule by which sides were decided, and their sizes, as JSON; `None` where no
            side was asked for and no row states one.
    """

    lake: Lake
    rows: pa.Table
    labels: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    side: str | None = None
    split_by: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        """Checks the identities.

        Raises:
            CorruptError: one could name a file elsewhere, as a path does; or is there twice, so
                that a sample would be written twice, or one in place of the other.
        """
        where, fix = str(self.lake.path), "run flagdata doctor"
        identities = self.rows["artifact"].to_pylist()
        for identity in identities:
            if identity is None or not ARTIFACT_ID.fullmatch(identity):
                raise CorruptError(
                    f"{identity!r} is not the id of an artifact", where=where, fix=fix
                )
        if twice := [identity for identity, count in Counter(identities).items() if count > 1]:
            more = f", and {len(twice) - 1} more," if len(twice) > 1 else ""
            raise CorruptError(
                f"two rows have the identity {twice[0]}{more} in the catalog", where=where, fix=fix
            )

    def __len__(self) -> int:
        return self.rows.num_rows

    def side_of(self, row: Mapping[str, Any]) -> str | None:
        """Returns the side that a row is on: the one that was asked for, or that it states."""
        return row["side"] if self.side is None else self.side

    def by_side(self) -> np.ndarray:
        """Orders the rows (n,) so that those of a side follow one another, in their order; those of
        none come last."""
        sides = self.rows["side"].to_pylist()
        order = [] if self.split_by is None else list(self.split_by["sides"])
        places = [order.index(side) if side in order else len(order) for side in sides]
        return np.argsort(np.array(places), kind="stable")

    def entries(self, order: np.ndarray | None = None) -> Iterator[Entry]:
        """Yields the rows with their records, in order or in the order of the indices given. One
        record is open at a time.

        Each object is hashed before the first of its frames leaves the lake: what is exported is
        what was committed.

        Raises:
            CorruptError: an object that has changed, a row without one, or a row that reaches
                beyond its record.
        """
        table = self.rows if order is None else self.rows.take(pa.array(order))
        opened: tuple[str, Record] | None = None
        checked: set[str] = set()
        for batch in table.to_batches(max_chunksize=1024):
            for row in batch.to_pylist():
                name = row["object"]
                if name is None:
                    raise CorruptError(
                        "a row has no object", where=row["artifact"], fix="run flagdata doctor"
                    )
                if name not in checked:
                    self.lake.whole_object(name)
                    checked.add(name)
                if opened is None or opened[0] != name:
                    opened = (name, Record.open(self.lake.object_path(name)))
                yield entry_of(row, opened[1], labels=self.labels.get(row["artifact"], {}))


def entry_of(
    row: Mapping[str, Any], record: Record, *, labels: Mapping[str, Any] | None = None
) -> Entry:
    """Joins a row of the catalog with the part of its record that it describes.

    Raises:
        CorruptError: it reaches beyond its record.
    """
    present = record.frame_count
    is_whole = row["frame_first"] is None
    first = 0 if is_whole else row["frame_first"]
    count = present if is_whole or row["frame_count"] is None else row["frame_count"]
    if first + count > present:
        raise CorruptError(
            f"frames {first} to {first + count - 1} of a record that has {present}",
            where=row["artifact"],
            fix="run flagdata doctor: it names the rows that are damaged",
        )
    return Entry(row=row, record=record, first=first, count=count, labels=labels or {})
