"""Records as other programs see them: the plain mcap package and its protobuf decoder."""

from __future__ import annotations

import struct
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import simplejpeg
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import ChunkIndex
from mcap_protobuf.decoder import DecoderFactory

from flagdata.core.clock_model import ClockModel, Segment
from flagdata.errors import ConflictError, InputError, LimitError, TimeError, UsageError
from flagdata.record import Chunking, Coding, Record, RecordWriter, writer
from flagdata.record.signals import WindSeries

from .conftest import DEVICE_LAG, EXPOSURE, PERIOD, START


def _stamp(message: object) -> int:
    stamp = message.timestamp  # type: ignore[attr-defined]
    return stamp.seconds * 10**9 + stamp.nanos


def _decoded(path: Path, topic: str) -> list[tuple]:
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return list(reader.iter_decoded_messages(topics=[topic]))


def _chunks(path: Path) -> list[ChunkIndex]:
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return summary.chunk_indexes


def test_frames_are_foxglove_images_to_the_mcap_package(sample: Path, pictures: np.ndarray) -> None:
    found = _decoded(sample, "/camera/image")
    assert len(found) == len(pictures)
    for k, (schema, channel, message, image) in enumerate(found):
        assert (schema.name, schema.encoding, channel.message_encoding) == (
            "foxglove.CompressedImage",
            "protobuf",
            "protobuf",
        )
        assert image.format == "jpeg"
        assert message.log_time == START + k * PERIOD
        assert message.publish_time == message.log_time - DEVICE_LAG
        assert _stamp(image) == message.log_time + EXPOSURE
        decoded = simplejpeg.decode_jpeg(image.data, colorspace="GRAY")[..., 0]
        # JPEG at quality 90 keeps smooth pictures to within a few grey levels.
        assert np.abs(decoded.astype(int) - pictures[k]).max() <= 16


def test_wind_samples_keep_every_value_and_absence_differs_from_zero(
    sample: Path, series: WindSeries
) -> None:
    found = _decoded(sample, "/wind/samples")
    assert found[0][0].name == "flagdata.WindSample"
    assert [message.log_time for _, _, message, _ in found] == series.time.tolist()
    samples = [decoded for *_, decoded in found]
    np.testing.assert_array_equal([s.speed for s in samples], series.channels["wind_speed"])
    np.testing.assert_array_equal([s.direction for s in samples], series.channels["wind_direction"])
    assert [s.flags for s in samples] == series.flags.tolist()
    assert not any(s.HasField("air_temperature") for s in samples)
    assert [s.host_time.nanos + s.host_time.seconds * 10**9 for s in samples] == (
        series.time + 80_000_000
    ).tolist()


def test_units_travel_in_the_schema_of_the_file(sample: Path) -> None:
    schema = _decoded(sample, "/wind/samples")[0][0]
    files = FileDescriptorSet.FromString(schema.data)
    comments = [c.leading_comments for f in files.file for c in f.source_code_info.location]
    assert any("m/s" in c and "speed of the air over ground" in c for c in comments)
    assert any("clockwise from true north" in c for c in comments)


def test_same_input_gives_same_bytes(
    tmp_path: Path, write: Callable[..., Path], sample: Path
) -> None:
    assert write(tmp_path / "again.mcap").read_bytes() == sample.read_bytes()


def test_video_gives_same_bytes_twice(tmp_path: Path, write: Callable[..., Path]) -> None:
    first, second = (write(tmp_path / f"{i}.mcap", coding=Coding.H264) for i in range(2))
    assert first.read_bytes() == second.read_bytes()


def test_a_clock_model_moves_log_time_and_leaves_publish_time(
    tmp_path: Path, series: WindSeries
) -> None:
    end = int(series.time[-1]) + 1
    clock = ClockModel(
        device="cup",
        reference="camera",
        method="given",
        confidence=1.0,
        segments=(Segment(start=START, end=end, origin=START, offset=-1.5, drift=1e-3),),
    )
    with RecordWriter(tmp_path / "a.mcap", metadata={}) as record:
        record.wind(series, clock=clock)
    found = _decoded(tmp_path / "a.mcap", "/wind/samples")
    # common = device - 1.5 s + 1e-3 (device - start): the last sample, 9.95 s in, lands 9.95 ms later.
    assert found[-1][2].log_time == int(series.time[-1]) - 1_500_000_000 + 9_950_000
    assert found[-1][2].publish_time == int(series.time[-1])
    assert (
        ClockModel.from_json(Record.open(tmp_path / "a.mcap").metadata["clock/cup"]["model"])
        == clock
    )


def test_chunks_are_plain_and_of_the_stated_size(
    tmp_path: Path, write: Callable[..., Path]
) -> None:
    noise = np.random.default_rng(5).integers(0, 256, (300, 300), dtype=np.uint8)
    with RecordWriter(tmp_path / "a.mcap", metadata={}) as record:
        for k in range(60):
            record.frame(log_time=k, publish_time=k, timestamp=k, image=np.roll(noise, k, axis=0))
    chunks = _chunks(tmp_path / "a.mcap")
    assert {chunk.compression for chunk in chunks} == {""}
    assert len(chunks) > 1
    # A chunk is closed by the message that takes it over 1 MiB; one noise frame has some 80 kB.
    assert all(2**20 < chunk.uncompressed_size < 2**20 + 200_000 for chunk in chunks[:-1])


def test_while_recording_no_more_than_a_second_is_at_risk(
    tmp_path: Path, pictures: np.ndarray
) -> None:
    path = tmp_path / "live.mcap"
    with RecordWriter(path, metadata={}, chunking=Chunking.LIVE) as live:
        for k in range(200):
            time = START + k * PERIOD
            live.frame(log_time=time, publish_time=time, timestamp=time, image=pictures[k % 60])
            if k >= 26:
                a_second_ago = struct.pack("<Q", START + (k - 26) * PERIOD)
                assert a_second_ago in path.read_bytes(), (
                    f"frame {k - 26} is not on disk after frame {k}"
                )


def test_an_exception_leaves_a_file_that_does_not_look_whole(
    tmp_path: Path, pictures: np.ndarray
) -> None:
    def interrupted() -> None:
        with RecordWriter(tmp_path / "a.mcap", metadata={}) as record:
            record.frame(log_time=1, publish_time=1, timestamp=1, image=pictures[0])
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    with pytest.raises((McapError, struct.error)), (tmp_path / "a.mcap").open("rb") as stream:
        make_reader(stream).get_summary()


def test_an_existing_file_is_not_overwritten(sample: Path) -> None:
    before = sample.read_bytes()
    with pytest.raises(ConflictError):
        RecordWriter(sample, metadata={})
    assert sample.read_bytes() == before


@pytest.mark.parametrize("times", [(5, 5), (5, 4)])
def test_frames_out_of_order_are_refused(
    tmp_path: Path, pictures: np.ndarray, times: tuple[int, int]
) -> None:
    with RecordWriter(tmp_path / "a.mcap", metadata={}) as record:
        record.frame(
            log_time=times[0], publish_time=times[0], timestamp=times[0], image=pictures[0]
        )
        with pytest.raises(InputError, match="order of time"):
            record.frame(
                log_time=times[1], publish_time=times[1], timestamp=times[1], image=pictures[0]
            )


def test_instants_before_1970_are_refused(tmp_path: Path, pictures: np.ndarray) -> None:
    with (
        RecordWriter(tmp_path / "a.mcap", metadata={}) as record,
        pytest.raises(TimeError, match="1970"),
    ):
        record.frame(log_time=-1, publish_time=1, timestamp=1, image=pictures[0])


def test_what_is_no_gray_frame_is_refused(tmp_path: Path) -> None:
    colour, numbers, nothing = (
        np.zeros((4, 4, 3), dtype=np.uint8),
        np.zeros((4, 4)),
        np.zeros((0, 4), dtype=np.uint8),
    )
    for coding, image in product(Coding, (colour, numbers, nothing, b"", b"\xff\xd8cut")):
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.mcap"
        with RecordWriter(path, metadata={}, coding=coding) as record, pytest.raises(InputError):
            record.frame(log_time=1, publish_time=1, timestamp=1, image=image)


def test_odd_sizes_and_mixed_sizes_are_refused_for_video(tmp_path: Path) -> None:
    with RecordWriter(tmp_path / "a.mcap", metadata={}, coding=Coding.H264) as record:
        with pytest.raises(InputError, match="even"):
            record.frame(
                log_time=1, publish_time=1, timestamp=1, image=np.zeros((15, 16), dtype=np.uint8)
            )
        record.frame(
            log_time=2, publish_time=2, timestamp=2, image=np.zeros((16, 16), dtype=np.uint8)
        )
        with pytest.raises(InputError, match="one size"):
            record.frame(
                log_time=3, publish_time=3, timestamp=3, image=np.zeros((16, 18), dtype=np.uint8)
            )


def test_wind_truth_names_and_quality_are_refused_the_second_time_or_out_of_range(
    tmp_path: Path, series: WindSeries, monkeypatch: pytest.MonkeyPatch
) -> None:
    with RecordWriter(tmp_path / "a.mcap", metadata={"m": {}}) as record:
        record.wind(series)
        with pytest.raises(ConflictError):
            record.wind(series)
        with pytest.raises(InputError, match="nan"):
            record.truth({"area_weight": float("nan")}, log_time=1)
        record.truth({"area_weight": 1.0}, log_time=1)
        with pytest.raises(ConflictError):
            record.truth({"area_weight": 1.0}, log_time=2)
        record.attach("a", b"1", media_type="text/plain", log_time=1)
        with pytest.raises(ConflictError):
            record.attach("a", b"2", media_type="text/plain", log_time=1)
        with pytest.raises(InputError, match="media type"):
            record.attach("b", b"2", media_type="text/csv+gzip", log_time=1)
        monkeypatch.setattr(writer, "ATTACHMENT_LIMIT", 10)
        with pytest.raises(LimitError):
            record.attach("c", b"12345678901", media_type="text/plain", log_time=1)
    with pytest.raises(UsageError):
        RecordWriter(tmp_path / "b.mcap", metadata={}, quality=0)
