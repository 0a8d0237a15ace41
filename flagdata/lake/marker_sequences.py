"""Sequences of markers in Zarr v3, beside those of meshes.

Tracked points of a cloth are stored as `positions (time, marker, xyz)`, NaN where a point
was not tracked, `rest (marker, uv)` and `time`, with, in the attributes, the markers' names and how
many positions were tracked: a lost chunk cannot pass for lost markers.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.files.durable import HEAL, disk_errors
from flagdata.core.provenance import canonical
from flagdata.errors import ConflictError, CorruptError, InputError

if TYPE_CHECKING:
    pass
from flagdata.lake.mesh_sequences import check_format, read_part, store_errors, write_array

MARKERS_FORMAT = 1
_MARKERS_HEAD = "flagdata_markers"


@dataclass(frozen=True, kw_only=True, eq=False)
class MarkerSequence:
    """Tracked points.

    Attributes:
        time: (n,) int64 nanoseconds since the first frame; strictly increasing, from 0.
        positions: (n, marker, 3) float64 [m], right-handed; NaN where a point was not tracked.
        rest: (marker, 2) float64 [m] where the points are on the flat cloth.
        names: of the markers, each once.
        attributes: what else is known, JSON values.

    Raises:
        InputError: shapes that disagree, values that are infinite, rest coordinates that are not
            finite, time that does not increase, two markers of one name.
    """

    time: IntArray
    positions: FloatArray
    rest: FloatArray
    names: tuple[str, ...]
    attributes: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        frames, markers = len(self.time), len(self.names)
        if self.positions.shape != (frames, markers, 3) or self.rest.shape != (markers, 2):
            raise self._wrong(
                f"{frames} times and {markers} names with positions of shape "
                f"{self.positions.shape} and rest of shape "
                f"{self.rest.shape}",
                "give (time, marker, 3) and (marker, 2)",
            )
        if np.isinf(self.positions).any() or not np.isfinite(self.rest).all():
            raise self._wrong(
                "a coordinate is not finite", "mark points that were lost by NaN; give all u and v"
            )
        if not frames or self.time[0] != 0 or (np.diff(self.time) <= 0).any():
            raise self._wrong("time does not increase from 0", "sort the frames, each once")
        if len(set(self.names)) < markers:
            raise self._wrong("two markers of one name", "give each its own")

    def _wrong(self, problem: str, fix: str) -> InputError:
        return InputError(problem, where="markers", fix=fix)

    @property
    def tracked(self) -> int:
        """Positions that are there."""
        return int(np.isfinite(self.positions).all(axis=2).sum())


def write_markers(path: Path, sequence: MarkerSequence) -> None:
    """Write a sequence as a new Zarr folder; to be put into a lake by `Transaction.put`.

    Raises:
        ConflictError: something is at `path` already.
        FlagdataError: no space, no permission.
    """
    import zarr

    if path.exists():
        raise ConflictError(
            "a file or folder is there already",
            where=str(path),
            fix="give a path at which nothing is yet",
        )
    with disk_errors("writing markers", path):
        group = zarr.open_group(path, mode="w-", zarr_format=3)
        attributes = {
            "Conventions": "CF-1.11",
            _MARKERS_HEAD: {"format": MARKERS_FORMAT, "tracked": sequence.tracked},
            "names": list(sequence.names),
            "attributes": dict(sequence.attributes),
        }
        group.update_attributes(json.loads(canonical(attributes)))
        write_array(group, "time", sequence.time, ("time",))
        write_array(group, "positions", sequence.positions, ("time", "marker", "xyz"))
        write_array(group, "rest", sequence.rest, ("marker", "uv"))


def read_markers(path: Path) -> MarkerSequence:
    """Reads a stored sequence.

    Raises:
        CorruptError: not such a store, damaged, or of a newer format.
        LimitError: arrays or chunks larger than the limits of `flagdata.lake.mesh_sequences`.
    """
    from flagdata.lake.sized_chunks import open_group

    restore = f"run flagdata verify; ingest the table again, or {HEAL}"
    with store_errors(path, "the marker store is damaged"):
        group = open_group(path)
        head = check_format(group.attrs.get(_MARKERS_HEAD), MARKERS_FORMAT, path, noun="markers")
        attributes: Any = group.attrs["attributes"]
        names: Any = group.attrs["names"]
        time, positions, rest = (
            read_part(group, name, None, None, where=str(path))
            for name in ("time", "positions", "rest")
        )
        sequence = MarkerSequence(
            time=time,
            positions=positions,
            rest=rest,
            names=tuple(names),
            attributes=dict(attributes),
        )
    if sequence.tracked != head.get("tracked"):
        raise CorruptError(
            f"{sequence.tracked} positions, where {head.get('tracked')} were tracked",
            where=str(path),
            fix=restore,
        )
    return sequence
