"""Mutations of files: bits, lengths and numbers that no one wrote, parts missing, doubled or in
another order; also within what is packed or has checksums, which then fit again."""

from __future__ import annotations

import gzip
import io
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from typing import Any

from hypothesis import strategies as st

NUMBER = re.compile(rb"\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")
_MOST = 20_000  # numbers of a file among which one is drawn
_PNG = b"\x89PNG\r\n\x1a\n"

places = st.floats(0, 1, exclude_max=True)
lengths = st.sampled_from(
    [0, 1, 255, 65_535, 2**31 - 1, 2**31, 2**32 - 1, 2**33, 2**40, 2**62, 2**63, 2**64 - 1]
)
"""Put in place of a length, an offset or a count."""
numbers = st.sampled_from(
    [
        b"0",
        b"-1",
        b"1e308",
        b"-1e400",
        b"nan",
        b"1000000000",
        b"99999999999999999999",
        b"9" * 400,
        b"4294967296",
        b"0.000000001",
        b"1e-320",
        b"2147483648",
        b"20000000",
        b"1048576",
        b"65536",
    ]
)
"""Put in place of a number in text."""
mutations = st.lists(
    st.one_of(
        st.tuples(st.just("bit"), places, st.integers(0, 7)),
        st.tuples(st.just("cut"), places, st.none()),
        st.tuples(
            st.just("length"),
            places,
            st.tuples(lengths, st.sampled_from("HIQ"), st.sampled_from("<>")),
        ),
        st.tuples(
            st.just("head"),
            places,
            st.tuples(lengths, st.sampled_from("HIQ"), st.sampled_from("<>")),
        ),
        st.tuples(st.just("number"), places, numbers),
        st.tuples(st.just("number"), places, numbers),
        st.tuples(st.just("double"), places, st.tuples(places, st.integers(1, 200))),
        st.tuples(st.just("swap"), places, st.tuples(places, st.integers(1, 4096))),
        st.tuples(st.just("drop"), places, st.integers(1, 4096)),
    ),
    min_size=1,
    max_size=3,
)
"""What is done to a file, one after another: kind, place as a share of its length, and how."""


def mutated(data: bytes, changes: list[Any]) -> bytes:
    """The bytes after these mutations."""
    for kind, place, how in changes:
        if data:
            data = _KINDS[kind](data, place, how)
    return data


def inside(name: str) -> Callable[[bytes, list[Any]], bytes]:
    """What mutates a file of that name within: what is packed in it, or beside checksums, which are
    computed anew."""
    return _INSIDE.get(name.rpartition(".")[2], mutated)


def _bit(data: bytes, place: float, bit: int) -> bytes:
    at = int(place * len(data))
    return data[:at] + bytes([data[at] ^ 1 << bit]) + data[at + 1 :]


def _cut(data: bytes, place: float, _: object) -> bytes:
    return data[: int(place * len(data))]


def _length(data: bytes, place: float, how: tuple[int, str, str]) -> bytes:
    value, width, order = how
    size = struct.calcsize(width)
    at = int(place * len(data))
    return data[:at] + struct.pack(order + width, value & (1 << 8 * size) - 1) + data[at + size :]


def _head(data: bytes, place: float, how: tuple[int, str, str]) -> bytes:
    """A length near the start, where formats have them."""
    return _length(data, place * min(1.0, 512 / len(data)), how)


def _number(data: bytes, place: float, text: bytes) -> bytes:
    found = [match.span() for match, _ in zip(NUMBER.finditer(data), range(_MOST), strict=False)]
    if not found:
        return data
    start, end = found[int(place * len(found))]
    return data[:start] + text + data[end:]


def _double(data: bytes, place: float, how: tuple[float, int]) -> bytes:
    other, times = how
    start, end = sorted((int(place * len(data)), int(other * len(data))))
    end = min(end, start + 65_536)
    return data[:start] + data[start:end] * times + data[start:]


def _swap(data: bytes, place: float, how: tuple[float, int]) -> bytes:
    other, size = how
    one, two = sorted((int(place * len(data)), int(other * len(data))))
    size = min(size, two - one)
    return (
        data[:one]
        + data[two : two + size]
        + data[one + size : two]
        + data[one : one + size]
        + data[two + size :]
    )


def _drop(data: bytes, place: float, size: int) -> bytes:
    at = int(place * len(data))
    return data[:at] + data[at + size :]


_KINDS: dict[str, Callable[[bytes, float, Any], bytes]] = {
    "bit": _bit,
    "cut": _cut,
    "length": _length,
    "head": _head,
    "number": _number,
    "double": _double,
    "swap": _swap,
    "drop": _drop,
}


def _in_gzip(data: bytes, changes: list[Any]) -> bytes:
    return gzip.compress(mutated(gzip.decompress(data), changes))


def _in_zip(data: bytes, changes: list[Any]) -> bytes:
    """In the member that the first place draws."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    names = sorted(members, key=lambda name: -len(members[name]))[:4]
    victim = names[int(changes[0][1] * len(names))]
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, mutated(content, changes) if name == victim else content)
    return out.getvalue()


def _in_png(data: bytes, changes: list[Any]) -> bytes:
    """In the head of a picture, or in the bytes of its rows, with the checksums of both."""
    parts: list[tuple[bytes, bytes]] = []
    at = len(_PNG)
    while at < len(data):
        (size,) = struct.unpack_from(">I", data, at)
        parts.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + size]))
        at += size + 12
    victim = b"IHDR" if changes[0][1] < 0.5 else b"IDAT"
    out = io.BytesIO(_PNG)
    out.seek(0, io.SEEK_END)
    for kind, content in parts:
        new = mutated(content, changes) if kind == victim else content
        out.write(
            struct.pack(">I", len(new)) + kind + new + struct.pack(">I", zlib.crc32(kind + new))
        )
    return out.getvalue()


_INSIDE = {"gz": _in_gzip, "xlsx": _in_zip, "ods": _in_zip, "zip": _in_zip, "png": _in_png}
