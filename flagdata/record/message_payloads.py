"""Wind samples and their means as protobuf messages in bulk: arrays in, rows of bytes out.

The bytes are those of `messages.WindSample` and `messages.WindMean` serialised one by one in order
of field numbers, which is tested. Source: Protocol Buffers, Encoding: tag = number << 3 | wire
type, base-128 varints, doubles as 8 bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from flagdata.core.arrays import BoolArray, IntArray, UInt8Array
from flagdata.record import messages
from flagdata.record.signals import WindSeries
from flagdata.timebase import NANOSECONDS

if TYPE_CHECKING:
    pass
from collections.abc import Sequence
from dataclasses import dataclass

from flagdata.record.signals import Series, WindAverage

_VARINT, _DOUBLE, _LENGTH = 0, 1, 2  # wire types


@dataclass(frozen=True, kw_only=True)
class Payloads:
    """Messages as rows.

    Attributes:
        data: (n, w) uint8.
        used: (n, w) bool, which bytes of a row are its message.
    """

    data: UInt8Array
    used: BoolArray


def samples(series: WindSeries, log_time: IntArray, rows: slice) -> Payloads:
    """Encodes `WindSample` of some rows of a series, whose instants on the common clock are
    `log_time` (n,) [UTC ns]."""
    numbers = {messages.WIND_FIELDS[name]: values for name, values in series.channels.items()}
    parts = [_timestamp("timestamp", messages.WindSample, log_time[rows])]
    for (name, _), values in sorted(numbers.items(), key=lambda item: item[0][1]):
        parts.append(
            _double(
                name, messages.WindSample, np.asarray(values, dtype=np.float64)[rows], presence=True
            )
        )
    parts.append(_integer("flags", messages.WindSample, series.flags[rows].astype(np.int64)))
    if series.host_time is not None:
        parts.append(_timestamp("host_time", messages.WindSample, series.host_time[rows]))
    return _join_parts(parts)


def means(average: WindAverage) -> Payloads:
    """Encodes `WindMean` of each bin."""
    kind = messages.WindMean
    period = np.full(len(average.time), average.period)
    return _join_parts(
        [
            _timestamp("timestamp", kind, average.time),
            *(
                _double(name, kind, getattr(average, name), presence=False)
                for name in ("speed", "sigma", "direction")
            ),
            _integer("count", kind, average.count.astype(np.int64)),
            _double("period", kind, period, presence=False),
        ]
    )


def _join_parts(parts: Sequence[Payloads]) -> Payloads:
    return Payloads(
        data=np.hstack([p.data for p in parts]), used=np.hstack([p.used for p in parts])
    )


def _tag(number: int, wire: int) -> list[int]:
    value, out = number << 3 | wire, []
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return [*out, value]


def _number(name: str, kind: object) -> int:
    fields: Mapping[str, object] = kind.DESCRIPTOR.fields_by_name  # type: ignore[attr-defined]
    return fields[name].number  # pyright: ignore[reportAttributeAccessIssue]


def _tag_values(tag: list[int], values: Payloads, present: BoolArray) -> Payloads:
    """Values (n, w) behind their tag; rows that are not `present` are empty."""
    n = len(present)
    front = np.broadcast_to(np.array(tag, dtype=np.uint8), (n, len(tag)))
    return Payloads(
        data=np.hstack([front, values.data]),
        used=np.hstack([np.ones((n, len(tag)), dtype=bool), values.used]) & present[:, None],
    )


def _double(name: str, kind: object, values: Series, *, presence: bool) -> Payloads:
    """Encodes a double; a field without presence leaves out +0."""
    raw = np.ascontiguousarray(values, dtype="<f8")
    bits = raw.view("<u8")
    written = np.ones(len(raw), dtype=bool) if presence else bits != 0
    data = raw.view(np.uint8).reshape(-1, 8)
    return _tag_values(
        _tag(_number(name, kind), _DOUBLE),
        Payloads(data=data, used=np.ones(data.shape, bool)),
        written,
    )


def _integer(name: str, kind: object, values: IntArray) -> Payloads:
    """Encodes a whole number; 0 is left out."""
    return _tag_values(_tag(_number(name, kind), _VARINT), _varint(values), values != 0)


def _timestamp(name: str, kind: object, time: IntArray) -> Payloads:
    """Encodes a google.protobuf.Timestamp."""
    seconds, nanos = np.divmod(time, NANOSECONDS)
    inner = _join_parts(
        [
            _tag_values(_tag(1, _VARINT), _varint(seconds), seconds != 0),
            _tag_values(_tag(2, _VARINT), _varint(nanos), nanos != 0),
        ]
    )
    length = inner.used.sum(axis=1, dtype=np.int64)[:, None].astype(np.uint8)
    body = _join_parts([Payloads(data=length, used=np.ones(length.shape, bool)), inner])
    return _tag_values(_tag(_number(name, kind), _LENGTH), body, np.ones(len(time), dtype=bool))


def _varint(values: IntArray) -> Payloads:
    """Encodes base-128 varints, least significant group first; of a negative number those of its
    two's complement."""
    unsigned = np.ascontiguousarray(values, dtype=np.int64).view(np.uint64)
    width = max(1, -(-int(unsigned.max(initial=0)).bit_length() // 7))
    groups = unsigned[:, None] >> (7 * np.arange(width, dtype=np.uint64))
    continues = (groups >> 7) > 0
    used = np.hstack([np.ones((len(values), 1), dtype=bool), continues[:, :-1]])
    return Payloads(
        data=((groups & 0x7F) | (continues.astype(np.uint64) << np.uint64(7))).astype(np.uint8),
        used=used,
    )
