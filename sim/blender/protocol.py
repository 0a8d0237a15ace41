"""Messages between the renderer and the Blender worker: length-prefixed JSON heads with raw arrays
behind them.

    head length (4 B, big-endian) | head, JSON: {"version", "kind", "fields", "arrays": [{name,
    dtype, shape}]} | arrays

The arrays follow one another in C order, little-endian, without padding. Nothing here imports torch
or bpy.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from flagdata.core.arrays import AnyArray
from flagdata.errors import CorruptError

PROTOCOL_VERSION = 1
_LENGTH = struct.Struct(">I")
_HEAD_LIMIT = 1 << 20  # B
_ARRAY_LIMIT = 1 << 30  # B
_DTYPES = ("uint8", "int32", "int64", "float32", "float64")

Read = Callable[[int], bytes]
"""Exactly that many bytes; EOFError where the stream ends before."""


@dataclass(frozen=True, kw_only=True)
class Message:
    """One message.

    Attributes:
        kind: what it asks or answers.
        fields: JSON values.
        arrays: of the types uint8, int32, int64, float32 and float64.
    """

    kind: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    arrays: Mapping[str, AnyArray] = field(default_factory=dict)


def encode(message: Message) -> bytes:
    """Encodes a message."""
    arrays = {name: np.ascontiguousarray(values) for name, values in message.arrays.items()}
    head = json.dumps(
        {
            "version": PROTOCOL_VERSION,
            "kind": message.kind,
            "fields": dict(message.fields),
            "arrays": [
                {"name": n, "dtype": a.dtype.name, "shape": a.shape} for n, a in arrays.items()
            ],
        }
    ).encode()
    return b"".join(
        [_LENGTH.pack(len(head)), head, *(array.tobytes() for array in arrays.values())]
    )


def decode(read: Read) -> Message:
    """Reads the next message of a stream.

    Raises:
        EOFError: the stream ended.
        CorruptError: another version, or bytes that are no message.
    """
    (length,) = _LENGTH.unpack(read(_LENGTH.size))
    if length > _HEAD_LIMIT:
        raise _broken(f"a head of {length} bytes")
    try:
        head = json.loads(read(length))
        version, kind, fields, described = (
            head["version"],
            head["kind"],
            head["fields"],
            head["arrays"],
        )
    except (ValueError, KeyError, TypeError) as error:
        raise _broken(f"a head that is not one ({error})") from None
    if version != PROTOCOL_VERSION:
        raise _broken(f"protocol version {version}, not {PROTOCOL_VERSION}")
    arrays: dict[str, AnyArray] = {}
    for entry in described:
        if entry["dtype"] not in _DTYPES:
            raise _broken(f"an array of type {entry['dtype']!r}")
        dtype, shape = np.dtype(entry["dtype"]), tuple(int(size) for size in entry["shape"])
        size = dtype.itemsize
        for extent in shape:
            size *= extent
        if min(shape, default=0) < 0 or size > _ARRAY_LIMIT:
            raise _broken(f"an array of shape {shape}")
        arrays[entry["name"]] = np.frombuffer(read(size), dtype=dtype).reshape(shape)
    return Message(kind=kind, fields=fields, arrays=arrays)


def _broken(content: str) -> CorruptError:
    return CorruptError(
        f"the render worker's stream holds {content}",
        where="render worker",
        fix="use one installation of flagdata for both sides",
    )
