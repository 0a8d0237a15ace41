"""Whether a video file ends before its own header says."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

from av.container import InputContainer
from av.video.stream import VideoStream

from flagdata.findings import Finding, Severity
from flagdata.ingest.camera.stamps import Timing


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
        return _of_matroska(container, timing, read)
    if name == "mpegts":
        return _of_transport_stream(path)
    if stream.frames > read:
        return [
            cut_off(
                f"the file states {stream.frames} frames and holds {read}: it is cut off or damaged",
                read, stream.frames - read,
            )
        ]  # fmt: skip
    if 0 < stream.frames < read:
        return [
            Finding(
                kind="index-damaged", severity=Severity.WARNING,
                what=f"the file states {stream.frames} frames and holds {read}: its index is damaged",
                count=read - stream.frames,
            )
        ]  # fmt: skip
    return []


def cut_off(what: str, read: int, lost: int) -> Finding:
    """The finding that `lost` frames, at least one, are not there after `read` of them."""
    return Finding(
        kind="truncated", severity=Severity.ERROR, what=what, where=f"frame {read}", count=lost,
        fix="copy it from the camera again; what was read is kept",
    )  # fmt: skip


def _of_mp4(path: Path, stream: VideoStream, read: int) -> list[Finding]:
    missing = stream.frames - read
    if _box_is_cut(path):
        said = f"; {read} of {stream.frames} frames are there" if missing > 0 else ""
        return [cut_off(f"the file ends inside one of its boxes: it is cut off{said}", read, max(1, missing))]
    if missing > 0:
        return [
            Finding(
                kind="frames-not-shown", severity=Severity.WARNING,
                what=f"the file states {stream.frames} frames; its edit list, or damage of its index, leaves {read}",
                count=missing,
            )
        ]  # fmt: skip
    return []


def _box_is_cut(path: Path) -> bool:
    """Whether the last box of an MP4 or MOV reaches beyond the file's end (ISO/IEC 14496-12, 4.2)."""
    end = path.stat().st_size
    at = 0
    with path.open("rb") as stream:
        while at + 8 <= end:
            stream.seek(at)
            head = stream.read(16)
            size = int.from_bytes(head[:4], "big")
            if size == 1:
                size = int.from_bytes(head[8:16], "big")
            if size == 0:
                return False
            if size < 8:
                return True
            at += size
    return at != end


def _of_matroska(container: InputContainer, timing: Timing, read: int) -> list[Finding]:
    """By the stated duration, which is the longest stream's: only where the video is alone."""
    if container.duration is None or len(container.streams) != 1:
        return []
    stated = Fraction(container.duration, 1_000_000)
    held = (timing.span + timing.period) * timing.tick
    # The last frame's own length is not known where the rate varies.
    step = timing.longest if timing.variable else timing.period
    if stated - held <= Fraction(3, 4) * step * timing.tick:
        return []
    lost = max(1, round((stated - held) / (timing.period * timing.tick)))
    return [cut_off(f"the file states {float(stated):.2f} s and holds {float(held):.2f} s", read, lost)]


def _of_transport_stream(path: Path) -> list[Finding]:
    """Packets are 188 bytes, or 192 with the time code of a camcorder's M2TS before the sync byte."""
    with path.open("rb") as stream:
        length = 192 if stream.read(5)[4:5] == b"\x47" else 188
    if path.stat().st_size % length == 0:
        return []
    return [
        Finding(
            kind="truncated", severity=Severity.WARNING,
            what=f"the file is not a whole number of transport packets of {length} B: it is cut off or damaged",
        )
    ]  # fmt: skip
