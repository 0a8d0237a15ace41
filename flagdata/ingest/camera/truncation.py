"""Whether a video file ends before its own header says."""

from __future__ import annotations

from fractions import Fraction
from os import SEEK_CUR
from pathlib import Path

from av.container import InputContainer
from av.video.stream import VideoStream

from flagdata.findings import Finding, Severity
from flagdata.ingest.camera.boxes import is_cut
from flagdata.ingest.camera.stamps import Timing

_EBML, _SEGMENT = b"\x1a\x45\xdf\xa3", b"\x18\x53\x80\x67"


def truncation(
    path: Path, container: InputContainer, stream: VideoStream, timing: Timing, *, read: int
) -> list[Finding]:
    """What betrays a file that is cut off: a box or transport packet that is not whole, missing frames, missing time.

    A transport stream cut between packets, and a fragmented MP4 cut between fragments, betray nothing.

    Args:
        read: packets that could be read, those an edit list hides among them.
    """
    name = container.format.name
    if name.startswith("mov"):
        return _of_mp4(path, stream, read)
    if name.startswith("matroska"):
        return _of_matroska(path, container, timing, read)
    if name == "mpegts":
        return _of_transport_stream(path)
    if stream.frames > read:
        return [
            cut_off(
                f"the file states {stream.frames} frames and holds {read}: it is cut off or damaged",
                read,
                stream.frames - read,
            )
        ]
    if 0 < stream.frames < read:
        return [
            Finding(
                kind="index-damaged",
                severity=Severity.WARNING,
                what=f"the file states {stream.frames} frames and holds {read}: its index is damaged",
                count=read - stream.frames,
            )
        ]
    return []


def cut_off(what: str, read: int, lost: int) -> Finding:
    """The finding that `lost` frames, at least one, are not there after `read` of them."""
    return Finding(
        kind="truncated",
        severity=Severity.ERROR,
        what=what,
        where=f"frame {read}",
        count=lost,
        fix="copy it from the camera again; what was read is kept",
    )


def _of_mp4(path: Path, stream: VideoStream, read: int) -> list[Finding]:
    missing = stream.frames - read
    if is_cut(path):
        said = f"; {read} of {stream.frames} frames are there" if missing > 0 else ""
        return [cut_off(f"the file ends inside one of its boxes: it is cut off{said}", read, max(1, missing))]
    if missing > 0:
        return [
            Finding(
                kind="frames-not-shown",
                severity=Severity.WARNING,
                what=f"the file states {stream.frames} frames; its edit list, or damage of its index, leaves {read}",
                count=missing,
            )
        ]
    return []


def _of_matroska(path: Path, container: InputContainer, timing: Timing, read: int) -> list[Finding]:
    """By the stated duration, which is the longest stream's, where the video is alone; else by the stated length."""
    if container.duration is not None and len(container.streams) == 1:
        stated = Fraction(container.duration, 1_000_000)
        held = (timing.span + timing.period) * timing.tick
        # The last frame's own length is not known where the rate varies.
        step = timing.longest if timing.variable else timing.period
        if stated - held > Fraction(3, 4) * step * timing.tick:
            lost = max(1, round((stated - held) / (timing.period * timing.tick)))
            return [cut_off(f"the file states {float(stated):.2f} s and holds {float(held):.2f} s", read, lost)]
    stated_end, end = _segment_end(path), path.stat().st_size
    if stated_end is None or stated_end <= end:
        return []
    return [cut_off(f"the file states a length of {stated_end} B and has {end} B: it is cut off", read, 1)]


def _segment_end(path: Path) -> int | None:
    """Where a Matroska file ends by its own statement; None where it makes none, as of a live recording.

    Elements are an identifier and a length, each as long as the zeros before its first one bit say (RFC 8794, 4).
    """
    with path.open("rb") as stream:
        for identifier in (_EBML, _SEGMENT):
            if stream.read(4) != identifier:
                return None
            first = stream.read(1)
            if first in (b"", b"\0"):
                return None
            width = 9 - first[0].bit_length()
            size = int.from_bytes(first + stream.read(width - 1), "big") - (1 << 7 * width)
            if size == (1 << 7 * width) - 1:
                return None
            if identifier == _EBML:
                stream.seek(size, SEEK_CUR)
        return stream.tell() + size


def _of_transport_stream(path: Path) -> list[Finding]:
    """Packets are 188 bytes, or 192 with the time code of a camcorder's M2TS before the sync byte."""
    with path.open("rb") as stream:
        length = 192 if stream.read(5)[4:5] == b"\x47" else 188
    if path.stat().st_size % length == 0:
        return []
    return [
        Finding(
            kind="truncated",
            severity=Severity.WARNING,
            what=f"the file is not a whole number of transport packets of {length} B: it is cut off or damaged",
        )
    ]
