"""The boxes of an MP4 or MOV file (ISO/IEC 14496-12, 4.2): where it is cut off, and what its edit
lists show."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from io import BufferedIOBase
from itertools import islice
from pathlib import Path

_FIRST = frozenset({b"ftyp", b"mdat", b"wide", b"free", b"skip", b"moov", b"styp", b"pnot"})
_MOST = 1_000_000  # boxes of one level that are looked at
_EDITS = 100_000  # entries of one edit list
_NORMAL = 1 << 16  # the rate 1 in 16.16


@dataclass(frozen=True, kw_only=True)
class Box:
    """One box.

    Attributes:
        at, body, end: bytes of the file at which it begins, at which its content begins, and behind
            its last.
    """

    kind: bytes
    at: int
    body: int
    end: int


@dataclass(frozen=True, kw_only=True)
class Edit:
    """One entry of an edit list (8.6.6).

    Attributes:
        duration: for which it is shown [s].
        begins: instant of the medium from which on [its ticks]; -1 for a pause.
        rate: at which the medium runs.
    """

    duration: float
    begins: int
    rate: float


def is_mp4(path: Path) -> bool:
    """Checks whether a file begins as an MP4 or MOV does."""
    with path.open("rb") as stream:
        return stream.read(8)[4:8] in _FIRST


def boxes(stream: BufferedIOBase, at: int, end: int) -> Iterator[Box]:
    """Boxes of the bytes from `at` to `end`; the last may reach beyond, and what is no box ends
    them."""
    while at + 8 <= end:
        stream.seek(at)
        head = stream.read(16)
        size, kind, body = int.from_bytes(head[:4], "big"), head[4:8], at + 8
        if size == 1:
            size, body = int.from_bytes(head[8:16], "big"), at + 16
        if size == 0:
            size = end - at
        if size < body - at:
            return
        yield Box(kind=kind, at=at, body=body, end=at + size)
        at += size


def top(path: Path) -> tuple[list[Box], int]:
    """Lists the file's own boxes, but for its metadata's and fragments' content, and returns its
    length."""
    length = path.stat().st_size
    with path.open("rb") as stream:
        return list(islice(boxes(stream, 0, length), _MOST)), length


def is_cut(path: Path) -> bool:
    """Checks whether a file ends within one of its boxes, or behind a fragment's head without its
    frames."""
    found_boxes, length = top(path)
    return not found_boxes or found_boxes[-1].end != length or found_boxes[-1].kind == b"moof"


def whole_part(path: Path) -> int | None:
    """Finds where the whole boxes of a file end that is cut off within a further one other than its
    frames; else None.

    A reader that looks at the heads of all fragments first would give up the file for the last one.
    Of frames that are cut off, those before the cut can be read.
    """
    if not is_mp4(path):
        return None
    found_boxes, length = top(path)
    complete = [box for box in found_boxes if box.end <= length]
    if not any(box.kind == b"moov" for box in complete):
        return None
    cut_frames = found_boxes[-1].kind == b"mdat" and found_boxes[-1].end > length
    return None if complete[-1].end == length or cut_frames else complete[-1].end


def edits(path: Path, track: int) -> list[Edit]:
    """Reads the edit list of a track by its number; empty where it has none, or the file is not an
    MP4 or MOV."""
    if not is_mp4(path):
        return []
    found_boxes, length = top(path)
    with path.open("rb") as stream:
        for movie in (box for box in found_boxes if box.kind == b"moov" and box.end <= length):
            scale = 0
            for box in islice(boxes(stream, movie.body, movie.end), _MOST):
                if box.kind == b"mvhd":
                    scale = _number(stream, box, 12, 20)
                elif box.kind == b"trak":
                    inside = {
                        part.kind: part for part in islice(boxes(stream, box.body, box.end), _MOST)
                    }
                    header, listed = inside.get(b"tkhd"), inside.get(b"edts")
                    if (
                        header is not None
                        and listed is not None
                        and _number(stream, header, 12, 20) == track
                    ):
                        return _entries(stream, listed, scale)
    return []


def _number(stream: BufferedIOBase, box: Box, plain: int, wide: int) -> int:
    """Reads a number of four bytes of a full box, which lies at `plain` in version 0 and at `wide`
    in version 1."""
    stream.seek(box.body)
    content = stream.read(wide + 4)
    at = wide if content[:1] == b"\1" else plain
    return int.from_bytes(content[at : at + 4], "big")


def _entries(stream: BufferedIOBase, listed: Box, scale: int) -> list[Edit]:
    box = next(
        (
            box
            for box in islice(boxes(stream, listed.body, listed.end), _MOST)
            if box.kind == b"elst"
        ),
        None,
    )
    if box is None:
        return []
    stream.seek(box.body)
    content = stream.read(min(box.end - box.body, 8 + 20 * _EDITS))
    layout = struct.Struct(">Qqi" if content[:1] == b"\1" else ">Iii")
    stated_count = int.from_bytes(content[4:8], "big")
    count = min(stated_count, (len(content) - 8) // layout.size) if len(content) >= 8 else 0
    entries = (layout.unpack_from(content, 8 + layout.size * k) for k in range(count))
    return [
        Edit(duration=duration / max(1, scale), begins=begins, rate=rate / _NORMAL)
        for duration, begins, rate in entries
    ]


def edit_list_remark(edit_list: Sequence[Edit]) -> str | None:
    """Describes how an edit list shows a medium otherwise than from one place on at its own pace;
    None where it does not."""
    parts = [edit for edit in edit_list if edit.begins >= 0]
    speeds = sorted({edit.rate for edit in parts} - {1.0})
    if speeds:
        return "parts of it at another speed ({}): slow motion, as a phone shows it".format(
            ", ".join(f"{Fraction(speed).limit_denominator(1000)}" for speed in speeds)
        )
    if len(parts) > 1:
        return f"{len(parts)} parts of it, one after another"
    return None
