"""Checksums of frames, channels and metadata: every reader holds what it gives out against them."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from flagdata.core.schema import TOPIC_IMAGE, TOPIC_TRUTH, TOPIC_WIND, TOPIC_WIND_1HZ
from flagdata.errors import CorruptError
from flagdata.record import (
    CHECKSUMS,
    Coding,
    Record,
    open_bytes,
    read_messages,
    read_summary,
    salvage,
)

OLD = Path(__file__).parents[2] / "compat" / "record-v1.mcap"
READERS: dict[str, Callable[[Record], object]] = {
    TOPIC_WIND: Record.wind,
    TOPIC_WIND_1HZ: Record.wind_1hz,
    TOPIC_TRUTH: lambda record: record.truth,
}


def flip(path: Path, place: int, target: Path) -> Path:
    data = bytearray(path.read_bytes())
    data[place] ^= 4
    target.write_bytes(data)
    return target


def messages(path: Path, topic: str):
    file = open_bytes(path)
    return read_messages(file, read_summary(file, where=""), topic, where="")


def test_the_checksums_are_those_of_the_messages_that_the_mcap_package_reads(sample: Path) -> None:
    with sample.open("rb") as stream:
        reader = make_reader(stream)
        (stored,) = [m.metadata for m in reader.iter_metadata() if m.name == CHECKSUMS]
        found = {
            topic: [message.data for *_, message in reader.iter_messages([topic])]
            for topic in READERS
        }
        frames = [message.data for *_, message in reader.iter_messages([TOPIC_IMAGE])]
    document = json.loads(stored["content"])
    assert int(stored["crc32"], 16) == zlib.crc32(stored["content"].encode())
    for topic, payloads in found.items():
        assert document["channels"][topic]["data"] == zlib.crc32(b"".join(payloads))
        assert document["channels"][topic]["count"] == len(payloads)
    assert document["channels"][TOPIC_IMAGE]["messages"] == "".join(
        f"{zlib.crc32(frame):08x}" for frame in frames
    )
    assert set(document["metadata"]) == {"camera", "provenance", "sensor"}


def test_checksums_are_no_metadata_to_a_reader(sample: Path) -> None:
    assert CHECKSUMS not in Record.open(sample).metadata


@pytest.mark.parametrize("coding", Coding)
def test_a_changed_frame_is_refused_and_the_others_are_read(
    tmp_path: Path, write: Callable[..., Path], coding: Coding
) -> None:
    path = write(tmp_path / "sound.mcap", coding=coding)
    table = messages(path, TOPIC_IMAGE)
    place = int(table.offset[30] + table.length[30] // 2)
    record = Record.open(flip(path, place, tmp_path / "damaged.mcap"))
    np.testing.assert_array_equal(record.frames(0, 30), Record.open(path).frames(0, 30))
    for read in (record.frames, record.jpegs, record.timestamps):
        with pytest.raises(CorruptError, match="message 30") as refused:
            read(30, 1)
        assert refused.value.where == f"{tmp_path / 'damaged.mcap'}, byte {table.offset[30]}"


@pytest.mark.parametrize("topic", READERS)
def test_a_changed_message_of_any_other_channel_is_refused(
    tmp_path: Path, sample: Path, topic: str
) -> None:
    table = messages(sample, topic)
    place = int(table.offset[-1] + table.length[-1] - 1)
    record = Record.open(flip(sample, place, tmp_path / "damaged.mcap"))
    with pytest.raises(CorruptError, match=f"{topic} has changed"):
        READERS[topic](record)


def test_a_changed_device_time_of_a_frame_is_refused(tmp_path: Path, sample: Path) -> None:
    place = (
        int(messages(sample, TOPIC_IMAGE).offset[5]) - 3
    )  # in the publish time, the head's last eight bytes
    with pytest.raises(CorruptError, match="times of /camera/image"):
        _ = Record.open(flip(sample, place, tmp_path / "damaged.mcap")).frame_times


def test_changed_metadata_is_refused_by_its_name(tmp_path: Path, sample: Path) -> None:
    place = sample.read_bytes().index(b"height") + len(b"height") + 4
    with pytest.raises(CorruptError, match="metadata 'sensor'"):
        _ = Record.open(flip(sample, place, tmp_path / "damaged.mcap")).metadata


def test_changed_checksums_are_refused_themselves(tmp_path: Path, sample: Path) -> None:
    place = sample.read_bytes().index(b'"messages": "') + 20
    with pytest.raises(CorruptError, match="checksums cannot be read"):
        Record.open(flip(sample, place, tmp_path / "damaged.mcap"))


def test_a_record_of_before_is_checked_by_the_checksums_of_its_chunks(tmp_path: Path) -> None:
    assert not Record.open(OLD).has_checksums
    for topic, read in {**READERS, TOPIC_IMAGE: lambda record: record.frames(0, 3)}.items():
        place = int(messages(OLD, topic).offset[0]) + 9
        with pytest.raises(CorruptError, match="chunk has changed"):
            read(Record.open(flip(OLD, place, tmp_path / "damaged.mcap")))


def test_what_is_salvaged_has_checksums_of_its_own(tmp_path: Path, sample: Path) -> None:
    whole = sample.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    for source in (sample, OLD, tmp_path / "cut.mcap"):
        target = tmp_path / f"salvaged-{source.name}"
        salvage(source, target)
        record = Record.open(target)
        assert record.has_checksums
        assert record.frames(0, record.frame_count).shape[0] == record.frame_count
        record.wind()
        _ = record.metadata
