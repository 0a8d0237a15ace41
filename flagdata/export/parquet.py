"""Parquet: the catalog rows with ground truth, units in the field metadata, and the frames as JPEG
where wanted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import pyarrow as pa
import pyarrow.parquet as pq

from flagdata.core.schema import CATALOG, Kind, catalog_schema
from flagdata.errors import UsageError
from flagdata.export.export_source import FILMED, ExportRows

FRAME_COLUMNS = (
    pa.field(
        "frames",
        pa.list_(pa.binary()),
        metadata={"unit": "", "about": "frames as stored: gray JPEG, in order of time"},
    ),
    pa.field(
        "frame_times",
        pa.list_(pa.int64()),
        metadata={"unit": "ns", "about": "instant of each frame, common clock, UTC"},
    ),
)
ROWS = "rows"
_ROW_GROUP_BYTES = 64 << 20
_ROW_GROUP_ROWS = 65_536


@dataclass(frozen=True, kw_only=True)
class Parquet:
    """Files rows/part-00000.parquet, …: a folder of their own, since readers of a folder take every
    file for a part.

    Attributes:
        frames: "none" for the catalog alone, "jpg" for a list column of the stored JPEGs beside it.
        shard_bytes: a part is closed when its frames reach this size [B]; the catalog alone is one
            part.
    """

    frames: Literal["none", "jpg"] = "none"
    shard_bytes: int = 512 << 20

    def __post_init__(self) -> None:
        if self.frames not in ("none", "jpg"):
            raise UsageError(
                f"frames {self.frames!r} in Parquet", where="--frames", fix="choose none or jpg"
            )
        if self.shard_bytes < 1:
            raise UsageError(
                f"shards of {self.shard_bytes} bytes", where="--shard-bytes", fix="give at least 1"
            )

    @property
    def kinds(self) -> frozenset[Kind]:
        return frozenset(Kind) if self.frames == "none" else FILMED

    def write(
        self, source: ExportRows, folder: Path, advance: Callable[[int], None]
    ) -> Mapping[str, Any]:
        (folder / ROWS).mkdir()
        units = {name: f.unit for name, f in CATALOG.items() if f.unit}
        if self.frames == "none":
            with pq.ParquetWriter(
                folder / part_name(0), source.rows.schema, compression="zstd"
            ) as writer:
                writer.write_table(source.rows, row_group_size=_ROW_GROUP_ROWS)
            advance(len(source))
            return {"rows": len(source), "units": units}
        total = parts = 0
        with ExitStack() as stack:
            writer: pq.ParquetWriter | None = None
            written = 0
            for rows, size, frames in self._groups(source):
                if writer is None or written + size > self.shard_bytes:
                    stack.close()
                    writer = stack.enter_context(
                        _part(folder / part_name(parts), source.rows.schema)
                    )
                    parts, written = parts + 1, 0
                writer.write_table(pa.Table.from_pylist(rows, schema=writer.schema))
                written, total = written + size, total + frames
                advance(len(rows))
        return {"rows": len(source), "frames": total, "units": {**units, "frame_times": "ns"}}

    def _groups(self, source: ExportRows) -> Iterator[tuple[list[dict[str, Any]], int, int]]:
        """Rows by the row group, with the bytes and the number of their frames."""
        limit = min(_ROW_GROUP_BYTES, self.shard_bytes)
        rows: list[dict[str, Any]] = []
        size = frames = 0
        for entry in source.entries():
            pictures = list(entry.jpegs())
            added = sum(map(len, pictures))
            if rows and size + added > limit:
                yield rows, size, frames
                rows, size, frames = [], 0, 0
            rows.append(
                {**entry.row, "frames": pictures, "frame_times": entry.frame_times.tolist()}
            )
            size, frames = size + added, frames + len(pictures)
        if rows:
            yield rows, size, frames


def _part(path: Path, rows: pa.Schema) -> pq.ParquetWriter:
    schema = pa.schema([*rows, *FRAME_COLUMNS], metadata=catalog_schema().metadata)
    compression = dict.fromkeys(rows.names, "zstd") | {"frames.list.element": "none"}
    # Pictures do not compress further, and a dictionary of them would only cost memory.
    dictionary = [name for name in rows.names if name not in ("parents", "quality")]
    return pq.ParquetWriter(
        path,
        schema,
        compression=compression,  # pyright: ignore[reportArgumentType]
        use_dictionary=dictionary,  # pyright: ignore[reportArgumentType]
    )


def part_name(number: int) -> str:
    return f"{ROWS}/part-{number:05d}.parquet"
