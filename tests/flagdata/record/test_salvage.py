"""Cut and damaged records give back what is whole in them, and nothing else."""

from __future__ import annotations

import struct
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from flagdata.core.findings import Severity
from flagdata.core.schema import TOPIC_IMAGE
from flagdata.errors import ConflictError, CorruptError, FlagdataError, NotFoundError
from flagdata.record import Chunking, Coding, Record, messages, salvage
from tests.flagdata.conftest import small_files


def _messages(path: Path) -> list[tuple[str, int, int, int, bytes]]:
    with path.open("rb") as stream:
        found = make_reader(stream, validate_crcs=True).iter_messages(log_time_order=False)
        return [(c.topic, m.sequence, m.log_time, m.publish_time, m.data) for _, c, m in found]


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory, write: Callable[..., Path]) -> Path:
    return write(tmp_path_factory.mktemp("live") / "live.mcap", chunking=Chunking.LIVE)


def _boundaries(data: bytes) -> list[tuple[int, int, int]]:
    """(start, opcode, end) of each top-level record, from the specification."""
    found, at = [], 8
    while at + 9 <= len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, at)
        found.append((at, opcode, at + 9 + length))
        at += 9 + length
    return found


def test_cut_anywhere_every_whole_chunk_and_every_whole_message_before_the_cut_come_back(
    tmp_path: Path, live: Path
) -> None:
    data = live.read_bytes()
    whole = _messages(live)
    places = [(data.find(m[4]), data.find(m[4]) + len(m[4])) for m in whole]
    records = _boundaries(data)
    chunks = [(start, end) for start, opcode, end in records if opcode == 6]
    assert len(chunks) >= 3
    cuts = set(np.random.default_rng(3).integers(8, len(data), 60).tolist())
    for start, _, end in records:  # inside each head, just before and after each end
        cuts |= {start + 1, start + 8, start + 9, end - 1, end}
    for start, _ in chunks:  # inside a chunk's head
        cuts |= {start + k for k in (10, 20, 33, 40, 48, 49, 50)}
    cuts |= {len(data) - k for k in (1, 4, 8, 9, 28, 29, 37)}
    for cut in sorted(c for c in cuts if c <= len(data)):
        source, target = tmp_path / "cut.mcap", tmp_path / "out.mcap"
        source.write_bytes(data[:cut])
        target.unlink(missing_ok=True)
        before = [m for m, (_, end) in zip(whole, places, strict=True) if end <= cut]
        if not before:
            with pytest.raises(CorruptError):
                salvage(source, target)
            assert not target.exists()
            continue
        findings = salvage(source, target)
        found = _messages(target)
        assert found == whole[: len(found)], f"cut at {cut}"
        assert len(found) >= len(before) - 1, f"cut at {cut}"
        assert len(found) >= sum(
            any(s < start < e <= cut for s, e in chunks) for start, _ in places
        )
        kinds = {f.kind: f for f in findings}
        assert kinds["recovered"].count == len(found)
        if cut < len(data):
            assert "cut-off" in kinds
        Record.open(target)


def test_a_whole_record_comes_back_with_the_same_content(tmp_path: Path, sample: Path) -> None:
    findings = salvage(sample, tmp_path / "out.mcap")
    assert [f.kind for f in findings] == ["recovered"]
    assert _messages(tmp_path / "out.mcap") == _messages(sample)
    before, after = Record.open(sample), Record.open(tmp_path / "out.mcap")
    assert after.metadata == before.metadata
    assert [after.attachment(n) for n in after.attachments] == [
        before.attachment(n) for n in before.attachments
    ]


def test_a_damaged_chunk_is_left_out_and_named(tmp_path: Path, live: Path) -> None:
    data = bytearray(live.read_bytes())
    chunks = [(s, e) for s, opcode, e in _boundaries(bytes(data)) if opcode == 6]
    start, end = chunks[1]
    data[(start + end) // 2] ^= 0x55
    head = (
        data.find(b"flagdata.checksums") + 30
    )  # a record without checksums of its messages, as older ones are
    data[head] ^= 0x55
    (tmp_path / "bad.mcap").write_bytes(data)
    findings = salvage(tmp_path / "bad.mcap", tmp_path / "out.mcap")
    found = _messages(tmp_path / "out.mcap")
    whole = _messages(live)
    assert [m for m in whole if m in found] == found
    lost = [m for m in whole if m not in found]
    assert lost == [m for m in whole if start < live.read_bytes().find(m[4]) < end]
    damaged = [f for f in findings if f.kind == "damaged-chunk"]
    assert [(f.severity, f.where) for f in damaged] == [(Severity.ERROR, f"byte {start}")]
    metadata = Record.open(tmp_path / "out.mcap").metadata
    assert "checksum" in metadata["salvage/1"]["0"]


def test_a_damaged_byte_in_a_frame_costs_that_frame(tmp_path: Path, live: Path) -> None:
    data, whole = live.read_bytes(), _messages(live)
    frames = [m for m in whole if m[0] == TOPIC_IMAGE]
    for frame in (frames[0], frames[len(frames) // 2], frames[-1]):
        damaged = bytearray(data)
        damaged[data.find(frame[4]) + len(frame[4]) // 2] ^= 0x55
        source, target = tmp_path / "bad.mcap", tmp_path / f"{frame[1]}.mcap"
        source.write_bytes(damaged)
        findings = [f for f in salvage(source, target) if f.severity is not Severity.NOTE]
        assert _messages(target) == [m for m in whole if m != frame]
        assert [(f.kind, f.count) for f in findings] == [("damaged-chunk", 1)]
        assert "1 of its" in findings[0].what


def _touched(
    data: bytes, chunks: list[tuple[int, int]], first: int, last: int, whole: list
) -> list:
    """Messages of the chunks that share a byte with first…last."""
    hit = [(s, e) for s, e in chunks if s <= last and e > first]
    return [m for m in whole if any(s < data.find(m[4]) < e for s, e in hit)]


def test_a_bad_sector_costs_the_chunks_it_touches_and_no_more(tmp_path: Path, live: Path) -> None:
    data = live.read_bytes()
    whole = _messages(live)
    chunks = [(s, e) for s, opcode, e in _boundaries(data) if opcode == 6]
    rng = np.random.default_rng(8)
    for number, first in enumerate(rng.integers(chunks[0][1], chunks[-1][0], 40).tolist()):
        last = first + 511
        damaged = bytearray(data)
        damaged[first : last + 1] = b"\0" * 512 if number % 2 else rng.bytes(512)
        source, target = tmp_path / f"{number}.mcap", tmp_path / f"{number}-out.mcap"
        source.write_bytes(damaged)
        findings = salvage(source, target)
        found = _messages(target)
        assert found == [m for m in whole if m in found], f"at {first}: order or content"
        lost = [m for m in whole if m not in found]
        assert all(m in _touched(data, chunks, first, last, whole) for m in lost), f"at {first}"
        errors = [f for f in findings if f.severity is Severity.ERROR]
        touched = sum(s <= last and e > first for s, e in chunks)
        assert bool(lost) <= len(errors) <= touched, f"at {first}: one message for one chunk"
        assert sum(f.count for f in errors) == len(lost), f"at {first}"


def test_a_chunk_with_a_damaged_head_does_not_take_the_next_ones_along(
    tmp_path: Path, live: Path
) -> None:
    data = live.read_bytes()
    whole = _messages(live)
    chunks = [(s, e) for s, opcode, e in _boundaries(data) if opcode == 6]
    start, end = chunks[1]
    for place, value in [
        (0, 0x00),
        (0, 0x0F),
        (0, 0x07),
        (0, 0xFF),
        (1, 0x01),
        (4, 0x01),
        (7, 0xFF),
        (8, 0x80),
        (37, 9),
    ]:
        damaged = bytearray(data)
        damaged[start + place] = value
        source, target = tmp_path / "bad.mcap", tmp_path / "out.mcap"
        source.write_bytes(damaged)
        target.unlink(missing_ok=True)
        findings = salvage(source, target)
        found = _messages(target)
        others = [m for m in whole if not start < data.find(m[4]) < end]
        assert [m for m in found if m in others] == others, f"byte {place} = {value}"
        assert all(m in whole for m in found)
        if len(found) < len(whole):
            assert "lost-messages" in {f.kind for f in findings}, f"byte {place} = {value}"


@pytest.mark.parametrize("length", [1, 4096, 300_000])
def test_zeros_that_a_crash_left_behind_become_no_messages(
    tmp_path: Path, live: Path, length: int
) -> None:
    """Delayed allocation: the file has its length, the last pages were never written."""
    data = live.read_bytes()
    chunks = [(s, e) for s, opcode, e in _boundaries(data) if opcode == 6]
    inside = (chunks[1][0] + chunks[1][1]) // 2
    (tmp_path / "zeros.mcap").write_bytes(data[:inside] + b"\0" * length)
    findings = salvage(tmp_path / "zeros.mcap", tmp_path / "out.mcap")
    found = _messages(tmp_path / "out.mcap")
    assert found == _messages(live)[: len(found)]
    assert {"cut-off", "unreadable", "damaged-chunk"} & {f.kind for f in findings}


def test_packed_records_of_other_writers_are_rewritten_plain(tmp_path: Path, sample: Path) -> None:
    for packing in (CompressionType.ZSTD, CompressionType.LZ4):
        source, target = tmp_path / f"{packing.name}.mcap", tmp_path / f"{packing.name}-out.mcap"
        with source.open("wb") as stream:
            packed = Writer(stream, compression=packing)
            packed.start()
            schema = packed.register_schema(
                "foxglove.CompressedImage",
                "protobuf",
                messages.descriptor_set(messages.CompressedImage),
            )
            channel = packed.register_channel("/camera/image", "protobuf", schema)
            for topic, sequence, log_time, publish_time, data in _messages(sample):
                if topic == "/camera/image":
                    packed.add_message(channel, log_time, data, publish_time, sequence)
            packed.finish()
        salvage(source, target)
        np.testing.assert_array_equal(
            Record.open(target).frames(0, 60), Record.open(sample).frames(0, 60)
        )


def test_salvage_of_a_salvaged_record_keeps_the_history(tmp_path: Path, live: Path) -> None:
    data = live.read_bytes()
    (tmp_path / "a.mcap").write_bytes(data[: len(data) // 2])
    salvage(tmp_path / "a.mcap", tmp_path / "b.mcap")
    data = (tmp_path / "b.mcap").read_bytes()
    data_end = int.from_bytes(data[-28:-20], "little")
    (tmp_path / "c.mcap").write_bytes(data[: data_end - 13])
    salvage(tmp_path / "c.mcap", tmp_path / "d.mcap")
    assert {"salvage/1", "salvage/2"} <= set(Record.open(tmp_path / "d.mcap").metadata)
    assert _messages(tmp_path / "d.mcap") == _messages(tmp_path / "b.mcap")


def test_video_cut_off_still_decodes(tmp_path: Path, write: Callable[..., Path]) -> None:
    path = write(tmp_path / "v.mcap", coding=Coding.H264, chunking=Chunking.LIVE)
    whole = Record.open(path).frames(0, 60)
    (tmp_path / "cut.mcap").write_bytes(path.read_bytes()[:12_000])
    salvage(tmp_path / "cut.mcap", tmp_path / "out.mcap")
    record = Record.open(tmp_path / "out.mcap")
    np.testing.assert_array_equal(record.frames(0, record.frame_count), whole[: record.frame_count])


def test_a_disk_that_refuses_the_target_is_one_clear_error_and_leaves_none(
    tmp_path: Path, sample: Path
) -> None:
    target = tmp_path / "out.mcap"
    with (
        small_files(),
        pytest.raises(FlagdataError, match="writing a record failed: File too large"),
    ):
        salvage(sample, target)
    assert not target.exists()


def test_what_cannot_be_salvaged_leaves_no_target(tmp_path: Path, sample: Path) -> None:
    target = tmp_path / "out.mcap"
    with pytest.raises(NotFoundError):
        salvage(tmp_path / "nothing.mcap", target)
    (tmp_path / "text.mcap").write_text("not MCAP at all")
    with pytest.raises(CorruptError, match="no MCAP record"):
        salvage(tmp_path / "text.mcap", target)
    assert not target.exists()
    target.write_bytes(b"precious")
    with pytest.raises(ConflictError):
        salvage(sample, target)
    assert target.read_bytes() == b"precious"


@pytest.mark.parametrize("cut", [0.3, 0.6, 1.0])
def test_a_small_record_takes_little_memory_to_be_salvaged(
    tmp_path: Path, live: Path, cut: float
) -> None:
    data = live.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: int(cut * len(data))])
    tracemalloc.start()
    salvage(tmp_path / "cut.mcap", tmp_path / "out.mcap")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 64 << 20  # a chunk may hold 1 GiB, the file has less than a megabyte
