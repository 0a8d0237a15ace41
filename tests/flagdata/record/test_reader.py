"""Reading by offset against the mcap package's own reading, and what happens to damaged files."""

from __future__ import annotations

import multiprocessing
import pickle
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import simplejpeg
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_protobuf.decoder import DecoderFactory

from flagdata.core.schema import CHANNELS
from flagdata.errors import CorruptError, FlagdataError, InputError, NotFoundError, UsageError
from flagdata.record import Chunking, Coding, Record, RecordWriter, messages, reader
from flagdata.record.signals import WindSeries
from tests.refusals import unrefused

from .conftest import DEVICE_LAG, EXPOSURE, PERIOD, START


def _stored(path: Path) -> list[bytes]:
    with path.open("rb") as stream:
        found = make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages(
            ["/camera/image"]
        )
        return [bytes(image.data) for *_, image in found]


def test_frames_equal_what_the_mcap_package_reads(sample: Path) -> None:
    stored = _stored(sample)
    record = Record.open(sample)
    assert record.frame_count == len(stored)
    assert [record.jpeg(k) for k in range(record.frame_count)] == stored
    assert record.jpegs(5, 20) == stored[5:25]
    expected = np.stack(
        [simplejpeg.decode_jpeg(data, colorspace="GRAY")[..., 0] for data in stored]
    )
    for first, count in [(0, 60), (0, 1), (59, 1), (13, 30)]:
        np.testing.assert_array_equal(record.frames(first, count), expected[first : first + count])


def test_the_three_times_of_a_frame_are_kept_apart(sample: Path) -> None:
    record = Record.open(sample)
    common = START + PERIOD * np.arange(60)
    np.testing.assert_array_equal(record.frame_times, common)
    np.testing.assert_array_equal(record.device_frame_times, common - DEVICE_LAG)
    np.testing.assert_array_equal(record.timestamps(10, 5), common[10:15] + EXPOSURE)


def test_wind_reads_back_exactly(sample: Path, series: WindSeries) -> None:
    found = Record.open(sample).wind()
    assert found is not None
    np.testing.assert_array_equal(found.time, series.time)
    assert found.channels.keys() == series.channels.keys()
    for name, values in series.channels.items():
        np.testing.assert_array_equal(found.channels[name], values)
    np.testing.assert_array_equal(found.flags, series.flags)
    assert found.host_time is not None
    assert series.host_time is not None
    np.testing.assert_array_equal(found.host_time, series.host_time)
    assert found.sensor == series.sensor


def test_means_over_a_second_are_those_of_the_usable_samples(
    sample: Path, series: WindSeries
) -> None:
    means = Record.open(sample).wind_1hz()
    assert means is not None
    assert means.period == 1.0
    assert means.count.sum() == 198  # one of the 200 is missing, one flagged stale
    speed = series.channels["wind_speed"]
    third = np.flatnonzero(means.time == START + 3_000_000_000)[0]
    inside = (series.time > START + 2_000_000_000) & (series.time <= START + 3_000_000_000)
    also = (series.time >= START + 2_000_000_000) & (series.time < START + 3_000_000_000)
    assert means.speed[third] in (
        pytest.approx(speed[inside].mean()),
        pytest.approx(speed[also].mean()),
    )


def test_truth_metadata_and_attachments_read_back(sample: Path) -> None:
    record = Record.open(sample)
    assert record.truth == {"bending": 1e-6, "area_weight": 0.284}
    assert record.metadata["camera"] == {"codec": "test"}
    assert record.metadata["provenance"] == {"a": "ü"}
    assert set(record.attachments) == {"log.csv", "note.txt"}
    assert record.attachment("log.csv") == b"time,speed\n" * 20_000
    assert record.attachment("note.txt") == b"by hand"
    with pytest.raises(NotFoundError, match=r"log\.csv"):
        record.attachment("nothing")


def test_a_record_without_a_topic_says_none(tmp_path: Path, pictures: np.ndarray) -> None:
    with RecordWriter(tmp_path / "a.mcap", metadata={}) as writer:
        writer.frame(log_time=1, publish_time=1, timestamp=1, image=pictures[0])
    record = Record.open(tmp_path / "a.mcap")
    assert record.wind() is None
    assert record.wind_1hz() is None
    assert record.truth is None
    assert record.attachments == ()
    assert record.topics == ("/camera/image",)


def test_every_channel_of_one_dimension_has_a_field() -> None:
    assert set(messages.WIND_FIELDS) == {
        name for name, channel in CHANNELS.items() if channel.dims == ("time",)
    }
    numbers = [number for _, number in messages.WIND_FIELDS.values()]
    assert len(set(numbers)) == len(numbers)


def test_field_numbers_of_released_files_have_not_changed() -> None:
    """Format version 1. A change here makes files written before unreadable."""
    assert [(f.name, f.number) for f in messages.WindSample.DESCRIPTOR.fields] == [
        ("timestamp", 1),
        ("speed", 2),
        ("direction", 3),
        ("direction_magnetic", 4),
        ("apparent_speed", 5),
        ("apparent_direction", 6),
        ("wind_x", 7),
        ("wind_y", 8),
        ("wind_z", 9),
        ("air_temperature", 10),
        ("air_pressure", 11),
        ("relative_humidity", 12),
        ("platform_speed", 13),
        ("platform_heading", 14),
        ("theoretical_speed", 15),
        ("theoretical_direction", 16),
        ("speed_estimate", 17),
        ("tracked_rms", 18),
        ("tracked_points", 19),
        ("tracking_quality", 20),
        ("flutter_frequency", 21),
        ("deflection_angle", 22),
        ("sonic_temperature", 23),
        ("flags", 100),
        ("host_time", 101),
    ]
    assert [(f.name, f.number) for f in messages.WindMean.DESCRIPTOR.fields] == [
        ("timestamp", 1),
        ("speed", 2),
        ("sigma", 3),
        ("direction", 4),
        ("count", 5),
        ("period", 6),
    ]
    assert [(f.name, f.number) for f in messages.TruthParameters.DESCRIPTOR.fields] == [
        ("timestamp", 1),
        ("parameters", 2),
    ]


def _fork_reads(record: Record, first: int, out: multiprocessing.Queue) -> None:
    out.put((first, int(record.frames(first, 5).astype(np.int64).sum())))


@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
def test_forks_and_threads_of_one_open_record_read_the_same(sample: Path) -> None:
    record = Record.open(sample)
    expected = {
        first: int(record.frames(first, 5).astype(np.int64).sum()) for first in range(0, 50, 5)
    }
    with ThreadPoolExecutor(4) as pool:
        sums = list(
            pool.map(lambda first: int(record.frames(first, 5).astype(np.int64).sum()), expected)
        )
    assert sums == list(expected.values())
    context = multiprocessing.get_context("fork")
    out = context.Queue()
    children = [
        context.Process(target=_fork_reads, args=(record, first, out)) for first in expected
    ]
    for child in children:
        child.start()
    assert dict(out.get(timeout=500) for _ in children) == expected
    for child in children:
        child.join()


def test_a_pickle_carries_the_path_and_no_data(sample: Path) -> None:
    record = Record.open(sample)
    before = record.frames(7, 3)
    data = pickle.dumps(record)
    assert len(data) < 1_000
    np.testing.assert_array_equal(pickle.loads(data).frames(7, 3), before)


def test_frames_beyond_the_end_are_not_found(sample: Path) -> None:
    cases = [(0, 61), (60, 1), (59, 2)]
    assert not unrefused(
        lambda first, count: Record.open(sample).frames(first, count), cases, NotFoundError
    )


def test_frames_that_cannot_be_asked_for_are_refused(sample: Path) -> None:
    cases = [(0, 0), (-1, 1), (3, -2)]
    assert not unrefused(
        lambda first, count: Record.open(sample).frames(first, count), cases, UsageError
    )


def test_video_frames_are_the_same_from_any_start(
    tmp_path: Path, write: Callable[..., Path], pictures
) -> None:
    record = Record.open(write(tmp_path / "v.mcap", coding=Coding.H264))
    assert record.coding is Coding.H264
    whole = record.frames(0, 60)
    # x264 at rate factor 18 keeps these smooth pictures to a few grey levels on average.
    assert np.abs(whole.astype(int) - pictures).mean() < 3
    for first in (0, 1, 24, 25, 26, 49, 50, 59):
        np.testing.assert_array_equal(record.frames(first, 1)[0], whole[first])
    np.testing.assert_array_equal(record.frames(20, 30), whole[20:50])
    height, width, *_ = simplejpeg.decode_jpeg_header(record.jpeg(3))
    assert (height, width) == (48, 64)
    assert record.jpegs(20, 30) == [record.jpeg(k) for k in range(20, 50)]


def test_video_is_annex_b_with_parameter_sets_on_each_key_frame_and_no_b_frames(
    tmp_path: Path, write: Callable[..., Path]
) -> None:
    path = write(tmp_path / "v.mcap", coding=Coding.H264)
    with path.open("rb") as stream:
        found = list(
            make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages(
                ["/camera/image"]
            )
        )
    assert {(schema.name, image.format) for schema, _, _, image in found} == {
        ("foxglove.CompressedVideo", "h264")
    }
    for k, (*_, image) in enumerate(found):
        units = [
            unit[0] & 31 for unit in image.data.replace(b"\0\0\0\1", b"\0\0\1").split(b"\0\0\1")[1:]
        ]
        assert image.data.startswith((b"\0\0\0\1", b"\0\0\1"))
        if k % 25 == 0:
            assert {7, 8, 5} <= set(units)  # SPS, PPS, IDR (ITU-T H.264, table 7-1)
        else:
            assert set(units) == {1}


def test_a_flipped_byte_is_an_error_or_leaves_the_rest_right(
    tmp_path: Path, sample: Path, pictures
) -> None:
    """No damage ends in anything but a flagdata error, and none in frames of another shape or
    time."""
    whole = sample.read_bytes()
    times = Record.open(sample).frame_times
    rng = np.random.default_rng(11)
    summary = int.from_bytes(whole[-28:-20], "little")
    places = [*rng.integers(0, len(whole), 150), *rng.integers(summary, len(whole), 150)]
    refused = 0
    for place in places:
        damaged = bytearray(whole)
        damaged[place] ^= int(rng.integers(1, 256))
        path = tmp_path / "damaged.mcap"
        path.write_bytes(damaged)
        try:
            record = Record.open(path)
            np.testing.assert_array_equal(record.frame_times, times)
            assert record.frames(0, 60).shape == pictures.shape
            record.wind()
            _ = record.metadata, record.truth
        except FlagdataError:
            refused += 1
            continue
        assert place < summary, "damage in the summary went unseen"
    assert refused >= 150


@pytest.mark.parametrize("keep", [0, 7, 8, 40, 1000, -1, -8, -30])
def test_a_cut_off_record_says_how_to_recover_it(tmp_path: Path, sample: Path, keep: int) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(sample.read_bytes()[:keep])
    with pytest.raises(CorruptError) as error:
        Record.open(path)
    assert error.value.where == str(path)


def test_a_missing_record_is_not_found(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError):
        Record.open(tmp_path / "nothing.mcap")


def test_an_attachment_that_unpacks_beyond_the_limit_is_refused(sample: Path, monkeypatch) -> None:
    monkeypatch.setattr(reader, "ATTACHMENT_LIMIT", 1000)
    with pytest.raises(CorruptError, match="beyond 1000"):
        Record.open(sample).attachment("log.csv")


def test_compressed_chunks_are_refused_with_the_way_out(
    tmp_path: Path, pictures: np.ndarray
) -> None:
    path = tmp_path / "packed.mcap"
    with path.open("wb") as stream:
        packed = Writer(stream, compression=CompressionType.ZSTD)
        packed.start()
        schema = packed.register_schema(
            "foxglove.CompressedImage",
            "protobuf",
            messages.descriptor_set(messages.CompressedImage),
        )
        channel = packed.register_channel("/camera/image", "protobuf", schema)
        packed.add_message(channel, 1, b"", 1)
        packed.finish()
    with pytest.raises(InputError, match="recover"):
        Record.open(path).frames(0, 1)


def test_frames_across_chunks_and_with_wind_between_read_the_same(
    tmp_path: Path, write: Callable[..., Path], sample: Path
) -> None:
    live = Record.open(write(tmp_path / "live.mcap", chunking=Chunking.LIVE))
    np.testing.assert_array_equal(live.frames(0, 60), Record.open(sample).frames(0, 60))
