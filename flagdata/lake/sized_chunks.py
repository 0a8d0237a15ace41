"""Blosc chunks of Zarr stores, refused where their head states another length than they have.

numcodecs hands Blosc a chunk without its length, and Blosc reads as much memory as the head states:
of a chunk that was cut, or whose head is damaged, memory beyond it, which ends the process by a
segmentation fault where none is mapped.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import zarr
from numcodecs.blosc import Blosc
from zarr.codecs import BloscCodec
from zarr.registry import register_codec

_HEAD = 16  # B, of which the last four are the length of the chunk


@dataclass(frozen=True)
class _SizedBlosc:
    """Blosc of numcodecs that decodes chunks of the length that they state."""

    blosc: Blosc

    def encode(self, values: Any) -> Any:
        """Compresses values."""
        return self.blosc.encode(values)

    def decode(self, chunk: Any, out: Any = None) -> Any:
        """Unpacks a chunk.

        Raises:
            ValueError: it has another length than its head states.
        """
        data = memoryview(chunk).cast("B")
        length = int.from_bytes(data[_HEAD - 4 : _HEAD], "little")
        if len(data) < _HEAD or length != len(data):
            raise ValueError(f"a chunk has {len(data)} bytes and states {length}")
        return self.blosc.decode(chunk, out)


class SizedBloscCodec(BloscCodec):
    """Zarr's codec "blosc" with chunks whose length is checked."""

    @cached_property
    def _blosc_codec(self) -> Any:
        return _SizedBlosc(super()._blosc_codec)


register_codec("blosc", SizedBloscCodec)
zarr.config.set({"codecs.blosc": f"{SizedBloscCodec.__module__}.{SizedBloscCodec.__qualname__}"})


def open_group(path: Path) -> zarr.Group:
    """Opens a Zarr group to be read."""
    return zarr.open_group(path, mode="r", zarr_format=3)
