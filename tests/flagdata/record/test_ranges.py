"""A record in a bucket: the frames that are asked for, whatever else it holds, and no byte
unchecked."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.files import object_cache as cache
from flagdata.core.files import object_ranges as ranges
from flagdata.core.schema import Kind
from flagdata.errors import CorruptError, NotFoundError
from flagdata.lake import Artifact, Lake, objects
from flagdata.record import ChecksummedFile, Chunking, Coding, Record
from flagdata.storage import RemotePath
from tests.flagdata.record.conftest import PERIOD, START

Write = Callable[..., Path]


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A record of 150 KB has as many blocks as one of 20 MB."""
    monkeypatch.setattr(ranges, "BLOCK", 2048)
    monkeypatch.setattr("flagdata.record.mcap_container._LAST", 4096)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The bytes that each request for ranges gave."""
    found: list[int] = []
    read = RemotePath.read_ranges

    def counted(place: RemotePath, offsets: list[int], lengths: list[int]) -> list[bytes]:
        found.extend(lengths)
        return read(place, offsets, lengths)

    monkeypatch.setattr(RemotePath, "read_ranges", counted)
    return found


def put(folder: str, path: Path) -> RemotePath:
    data = path.read_bytes()
    place = RemotePath.parse(folder) / "mcap" / f"{hashlib.sha256(data).hexdigest()}.mcap"
    place.write_bytes(data)
    return place


@pytest.mark.parametrize("chunking", Chunking)
@pytest.mark.parametrize("coding", Coding)
def test_all_that_a_record_holds_is_read_as_from_a_file(
    bucket_folder: str, tmp_path: Path, write: Write, coding: Coding, chunking: Chunking
) -> None:
    path = write(tmp_path / "sample.mcap", coding=coding, chunking=chunking)
    local, remote = Record.open(path), Record.open(put(bucket_folder, path))
    assert remote.frame_count == 60
    for first, count in ((0, 1), (17, 5), (59, 1), (0, 60)):
        np.testing.assert_array_equal(remote.frames(first, count), local.frames(first, count))
        np.testing.assert_array_equal(
            remote.times(first, count), START + np.arange(first, first + count) * PERIOD
        )
        np.testing.assert_array_equal(
            remote.timestamps(first, count), local.timestamps(first, count)
        )
    np.testing.assert_array_equal(remote.frame_times, local.frame_times)
    np.testing.assert_array_equal(remote.device_frame_times, local.device_frame_times)
    assert remote.metadata == local.metadata
    assert remote.truth == local.truth
    assert remote.attachment("log.csv") == b"time,speed\n" * 20_000
    there, here = remote.wind(), local.wind()
    assert there is not None
    assert here is not None
    np.testing.assert_array_equal(there.channels["wind_speed"], here.channels["wind_speed"])
    with pytest.raises(NotFoundError, match="frames 59 to 60 of 60"):
        remote.frames(59, 2)


def test_one_clip_costs_its_own_part_of_the_record_and_is_kept(
    bucket_folder: str, sample: Path, asked: list[int]
) -> None:
    place = put(bucket_folder, sample)
    frames = Record.open(sample).frames(30, 3)
    np.testing.assert_array_equal(Record.open(place).frames(30, 3), frames)
    size = sample.stat().st_size
    assert len(asked) <= 5
    assert sum(asked) < size / 3
    asked.clear()
    other = pickle.loads(pickle.dumps(Record.open(place)))
    np.testing.assert_array_equal(other.frames(30, 3), frames)
    assert asked == []


def test_a_record_that_is_read_to_its_end_is_fetched_in_large_pieces(
    bucket_folder: str, sample: Path, asked: list[int]
) -> None:
    times = Record.open(put(bucket_folder, sample)).device_frame_times
    assert len(times) == 60
    assert len(asked) < 10
    assert sum(asked) <= sample.stat().st_size + 4 * ranges.BLOCK


def test_a_changed_frame_is_refused_and_read_rightly_once_the_object_is_healed(
    bucket_folder: str, sample: Path
) -> None:
    place, sound = put(bucket_folder, sample), sample.read_bytes()
    at = int(Record.open(sample)._frames.offset[7]) + 40
    place.write_bytes(sound[:at] + bytes([sound[at] ^ 4]) + sound[at + 1 :])
    record = Record.open(place)
    np.testing.assert_array_equal(record.frames(8, 4), Record.open(sample).frames(8, 4))
    with pytest.raises(CorruptError, match="message 7 of /camera/image has changed") as refused:
        record.frames(5, 4)
    assert str(refused.value.where).startswith(f"{place}, byte ")
    place.write_bytes(sound)
    np.testing.assert_array_equal(Record.open(place).frames(5, 4), Record.open(sample).frames(5, 4))


@pytest.fixture
def unordered(sample: Path, tmp_path: Path) -> Path:
    """The frames of a record as a salvage may find them: those of the second half of the time
    first."""
    from mcap.reader import make_reader

    path = tmp_path / "unordered.mcap"
    with sample.open("rb") as stream, path.open("wb") as sink:
        found = list(make_reader(stream).iter_messages(["/camera/image"]))
        writer = ChecksummedFile(sink, chunk_size=20_000, profile="", library="")
        schema = found[0][0]
        assert schema is not None
        number = writer.register_schema(
            name=schema.name, encoding=schema.encoding, data=schema.data
        )
        encoding = found[0][1].message_encoding
        channel = writer.register_channel(
            topic="/camera/image", message_encoding=encoding, schema_id=number
        )
        for _, _, message in found[30:] + found[:30]:
            times = {"log_time": message.log_time, "publish_time": message.publish_time}
            writer.add_message(channel_id=channel, sequence=0, data=message.data, **times)
        writer.finish()
    return path


def test_frames_that_do_not_lie_in_order_of_time_are_given_in_it(
    bucket_folder: str, unordered: Path, sample: Path
) -> None:
    record = Record.open(put(bucket_folder, unordered))
    np.testing.assert_array_equal(record.frames(28, 4), Record.open(sample).frames(28, 4))


def test_a_block_that_was_cut_short_on_this_machine_is_fetched_again(
    bucket_folder: str, sample: Path, tmp_path: Path
) -> None:
    place = put(bucket_folder, sample)
    frames = Record.open(place).frames(30, 3)
    blocks = sorted((tmp_path / "cache" / "objects").glob("*.blocks/*"))
    assert len(blocks) > 3
    for block in blocks:
        block.write_bytes(block.read_bytes()[:-9])
    np.testing.assert_array_equal(Record.open(place).frames(30, 3), frames)


def test_blocks_keep_to_the_limit_and_go_with_their_object(
    bucket_folder: str, sample: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = put(bucket_folder, sample)
    objects = tmp_path / "cache" / "objects"
    monkeypatch.setenv("FLAGDATA_CACHE_LIMIT", "40000")
    record = Record.open(place)
    for first in range(0, 60, 3):
        record.frames(first, 3)
        assert sum(path.stat().st_size for path in objects.glob("*.blocks/*")) <= 40_000
    cache.forget(f"mcap/{place.stem}", ".mcap")
    assert list(objects.glob("mcap-*")) == []


def test_a_lake_reads_small_records_whole_and_the_parts_of_large_ones(
    remote_lake: Lake, write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with remote_lake.transaction("ingest") as tx:
        name = tx.put(write(tx.staging(".mcap")))
        tx.add(Artifact(kind=Kind.CAMERA, name="film", object=name))
    assert isinstance(remote_lake.record_place(name), Path)  # what was put is there
    cache.forget(name, ".mcap")
    monkeypatch.setattr(objects, "WHOLE", 1000)
    place = remote_lake.record_place(name)
    assert place == remote_lake.objects.path(name)
    assert Record.open(place).frames(3, 2).shape == (2, 48, 64)
    monkeypatch.setattr(objects, "WHOLE", 10**6)
    assert isinstance(remote_lake.record_place(name), Path)
