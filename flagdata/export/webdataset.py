"""WebDataset: tar shards of samples, read in sequence by `webdataset` and anything that reads tar.

A sample is one artifact. Its key is the artifact's identity; its members are `<key>.json`
(identity, ground truth with σ, frame times) and either `<key>.<frame>.jpg`, the frames as stored,
or `<key>.npy`, uint8 (time, height, width).
Source: the WebDataset format, https://github.com/webdataset/webdataset ("the WebDataset format").
"""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

import numpy as np

from flagdata.core.rng import stream
from flagdata.core.schema import Kind
from flagdata.errors import LimitError, UsageError
from flagdata.export.export_source import FILMED, Entry, ExportRows, label_units

_BLOCK = 512  # a tar member's header, and what its data is padded to [B]
_RECORD = 20 * _BLOCK  # a tar file is padded to this [B]


@dataclass(frozen=True, kw_only=True)
class WebDataset:
    """Files clip-000000.tar, …; the same bytes for the same rows and options.

    Attributes:
        frames: "jpg" for the stored JPEGs, one member a frame; "npy" for one decoded array.
        shard_bytes: a shard is no larger than this [B].
        shuffle: seed of the order of the samples; `None` keeps the order of the rows. Sequential
            readers shuffle in a buffer only, so neighbours in a recording stay neighbours in
            training unless they are shuffled here.
    """

    kinds: ClassVar[frozenset[Kind]] = FILMED

    frames: Literal["jpg", "npy"] = "jpg"
    shard_bytes: int = 512 << 20
    shuffle: int | None = None

    def __post_init__(self) -> None:
        if self.frames not in ("jpg", "npy"):
            raise UsageError(
                f"frames {self.frames!r} in WebDataset", where="--frames", fix="choose jpg or npy"
            )
        if self.shard_bytes < _RECORD:
            raise UsageError(
                f"shards of {self.shard_bytes} bytes",
                where="--shard-bytes",
                fix=f"give at least {_RECORD}",
            )

    def write(
        self, source: ExportRows, folder: Path, advance: Callable[[int], None]
    ) -> Mapping[str, Any]:
        order = None
        if self.shuffle is not None:
            order = stream(self.shuffle, "export", "webdataset").permutation(len(source))
        frames = 0
        with _Shards(folder, self.shard_bytes) as shards:
            for entry in source.entries(order):
                shards.add(entry.key, list(self._members(entry)))
                frames += entry.count
                advance(1)
        return {
            "samples": len(source),
            "frames": frames,
            "shards": shards.written,
            "units": label_units(),
        }

    def _members(self, entry: Entry) -> Iterator[tuple[str, bytes]]:
        text = json.dumps(entry.label(), sort_keys=True, allow_nan=False, ensure_ascii=False)
        yield f"{entry.key}.json", text.encode()
        if self.frames == "jpg":
            digits = max(3, len(str(entry.count - 1)))
            for index, picture in enumerate(entry.jpegs()):
                yield f"{entry.key}.{index:0{digits}d}.jpg", picture
        else:
            buffer = io.BytesIO()
            np.save(buffer, entry.record.frames(entry.first, entry.count), allow_pickle=False)
            yield f"{entry.key}.npy", buffer.getvalue()


class _Shards:
    """Writes samples into one tar file after another; a context manager."""

    def __init__(self, folder: Path, limit: int) -> None:
        self._folder = folder
        self._limit = limit
        self._open = ExitStack()
        self._tar: tarfile.TarFile | None = None
        self._size = 0
        self.written: list[dict[str, Any]] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._open.close()

    def add(self, key: str, members: list[tuple[str, bytes]]) -> None:
        """Appends one sample, in a new shard if this one would grow beyond the limit.

        Raises:
            LimitError: the sample alone is larger.
        """
        added = sum(_BLOCK + _padded_size(len(data)) for _, data in members)
        if _file_size(added) > self._limit:
            raise LimitError(
                f"a sample of {added:,} bytes is larger than a shard of {self._limit:,}",
                where=key,
                fix="raise --shard-bytes, or export clips instead of whole recordings",
            )
        if self._tar is None or _file_size(self._size + added) > self._limit:
            self._tar = self._next()
        for name, data in members:
            self._tar.addfile(_member(name, len(data)), io.BytesIO(data))
        self._size += added
        self.written[-1]["samples"] += 1

    def _next(self) -> tarfile.TarFile:
        self._open.close()
        name = shard_name(len(self.written))
        self.written.append({"path": name, "samples": 0})
        self._size = 0
        return self._open.enter_context(
            tarfile.open(self._folder / name, "x", format=tarfile.USTAR_FORMAT)
        )


def shard_name(number: int) -> str:
    return f"clip-{number:06d}.tar"


def _member(name: str, size: int) -> tarfile.TarInfo:
    """Builds a tar header that depends on name and size alone."""
    info = tarfile.TarInfo(name)
    info.size, info.mode, info.mtime = size, 0o644, 0
    return info


def _padded_size(size: int) -> int:
    return -(-size // _BLOCK) * _BLOCK


def _file_size(members: int) -> int:
    """Computes the size of a tar file of `members` bytes: two zero blocks at the end, padded to a
    whole record."""
    return -(-(members + 2 * _BLOCK) // _RECORD) * _RECORD
