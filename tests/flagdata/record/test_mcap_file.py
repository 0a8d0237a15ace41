"""Records written in bulk have the bytes that the mcap library and protobuf write one message at a
time."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np
import pytest
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import CompressionType, Writer

from flagdata.errors import ConflictError
from flagdata.record import Record, RecordWriter, message_payloads, messages
from flagdata.record.mcap_file import McapFile, MessageBlock
from flagdata.record.signals import Sensor, WindAverage, WindSeries
from flagdata.record.writer import compress_pieces, pieces_of

START = 1_620_950_400_000_000_000
CHUNK = 3000


def wind(n: int) -> WindSeries:
    """Samples with every length a stamp, a flag and a value may take in bytes."""
    rng = np.random.default_rng(5)
    steps = rng.choice([1, 127, 128, 50_000_000, 268_435_456, 1_000_000_000], n)
    time = START + np.cumsum(steps)
    time[0] = 0  # the instant whose timestamp holds nothing
    speed = rng.normal(5, 1, n)
    speed[::7] = np.nan
    speed[3] = -0.0
    return WindSeries(
        time=time,
        channels={
            "wind_speed": speed,
            "sonic_temperature": rng.normal(290, 1, n),
            "wind_x": np.zeros(n),
        },
        flags=rng.choice([0, 1, 127, 128, 0xFFFF], n).astype(np.uint16),
        sensor=Sensor(name="a made one"),
        host_time=time + 700_000_001,
    )


def one_by_one(series: WindSeries) -> list[bytes]:
    """Each sample through protobuf's own serialiser."""
    out = []
    for i, time in enumerate(series.time.tolist()):
        values = {
            messages.WIND_FIELDS[name][0]: float(series.channels[name][i])
            for name in series.channels
        }
        sample = messages.WindSample(flags=int(series.flags[i]), **values)
        messages.set_timestamp(sample.timestamp, time)
        assert series.host_time is not None
        messages.set_timestamp(sample.host_time, int(series.host_time[i]))
        out.append(sample.SerializeToString(deterministic=True))
    return out


def rows_of(payloads: message_payloads.Payloads) -> list[bytes]:
    return [data[used].tobytes() for data, used in zip(payloads.data, payloads.used, strict=True)]


def test_samples_in_bulk_are_protobufs_bytes() -> None:
    series = wind(400)
    assert rows_of(message_payloads.samples(series, series.time, slice(0, 400))) == one_by_one(
        series
    )
    assert (
        rows_of(message_payloads.samples(series, series.time, slice(17, 40)))
        == one_by_one(series)[17:40]
    )


def test_a_host_clock_before_1970_is_protobufs_bytes() -> None:
    series = wind(40)
    assert series.host_time is not None
    early = WindSeries(
        time=series.time,
        channels=series.channels,
        flags=series.flags,
        sensor=series.sensor,
        host_time=series.host_time - 2 * START,
    )
    assert rows_of(message_payloads.samples(early, early.time, slice(0, 40))) == one_by_one(early)


def test_means_in_bulk_are_protobufs_bytes() -> None:
    means = WindAverage(
        time=START + np.arange(5) * 1_000_000_000,
        speed=np.array([0.0, -0.0, 3.5, math.nan, 1e-300]),
        sigma=np.array([0.1, 0.0, 2.0, math.inf, 0.3]),
        direction=np.full(5, math.nan),
        count=np.array([1, 0, 127, 128, 40_000], dtype=np.int32),
        period=1.0,
    )
    expected = []
    for i in range(5):
        mean = messages.WindMean(
            speed=means.speed[i],
            sigma=means.sigma[i],
            direction=means.direction[i],
            count=int(means.count[i]),
            period=1.0,
        )
        messages.set_timestamp(mean.timestamp, int(means.time[i]))
        expected.append(mean.SerializeToString(deterministic=True))
    assert rows_of(message_payloads.means(means)) == expected


def test_a_file_in_bulk_is_the_mcap_librarys() -> None:
    series = wind(400)
    payloads = message_payloads.samples(series, series.time, slice(0, 400))
    schema = messages.descriptor_set(messages.WindSample)
    theirs, ours = io.BytesIO(), io.BytesIO()
    library = Writer(
        theirs, chunk_size=CHUNK, compression=CompressionType.NONE, enable_data_crcs=True
    )
    library.start(profile="p", library="l")
    file = McapFile(ours, chunk_size=CHUNK, profile="p", library="l")
    library.add_metadata("m", {"a": "ä", "b": "2"})
    file.add_metadata("m", {"a": "ä", "b": "2"})
    for topic in ("/one", "/two"):
        number = library.register_schema(
            name="flagdata.WindSample", encoding=SchemaEncoding.Protobuf, data=schema
        )
        known = {
            "topic": topic,
            "message_encoding": MessageEncoding.Protobuf,
            "metadata": {"of": topic, "ä": "1"},
        }
        library.register_channel(schema_id=number, **known)
        number = file.register_schema(
            name="flagdata.WindSample", encoding=SchemaEncoding.Protobuf, data=schema
        )
        file.register_channel(schema_id=number, **known)
    library.add_message(
        channel_id=2, log_time=START, publish_time=START + 1, sequence=0, data=b"before"
    )
    file.add_message(
        channel_id=2, log_time=START, publish_time=START + 1, sequence=0, data=b"before"
    )
    for i, data in enumerate(one_by_one(series)):
        time = int(series.time[i])
        library.add_message(
            channel_id=1, log_time=time, publish_time=time + 5, sequence=i, data=data
        )
    for rows in (slice(0, 150), slice(150, 151), slice(151, 400)):
        block = MessageBlock(
            log_time=series.time[rows],
            publish_time=series.time[rows] + 5,
            payload=payloads.data[rows],
            used=payloads.used[rows],
        )
        file.add_messages(block, channel_id=1, sequence=rows.start)
    about = {"create_time": 7, "log_time": START, "name": "log", "media_type": "text/plain"}
    library.add_attachment(data=b"abcdef", **about)
    file.add_attachment(data=[b"abc", b"def"], size=6, **about)
    library.add_message(channel_id=2, log_time=START, publish_time=START, sequence=1, data=b"after")
    file.add_message(channel_id=2, log_time=START, publish_time=START, sequence=1, data=b"after")
    library.finish()
    file.finish()
    assert len(theirs.getvalue()) > 5 * CHUNK
    assert ours.getvalue() == theirs.getvalue()


def test_a_file_without_messages_is_the_mcap_librarys() -> None:
    theirs, ours = io.BytesIO(), io.BytesIO()
    library = Writer(
        theirs, chunk_size=CHUNK, compression=CompressionType.NONE, enable_data_crcs=True
    )
    library.start(profile="p", library="l")
    library.finish()
    McapFile(ours, chunk_size=CHUNK, profile="p", library="l").finish()
    assert ours.getvalue() == theirs.getvalue()


@pytest.mark.parametrize(
    "size", [100, 70_000, 9_000_000], ids=["as-it-is", "packed", "packed-quickly"]
)
def test_an_attached_file_comes_back_whole(tmp_path: Path, size: int) -> None:
    source = tmp_path / "log.csv"
    source.write_bytes((b"2021-05-14 00:00:00,1.25\n" * (size // 25 + 1))[:size])
    path = tmp_path / "r.mcap"
    with RecordWriter(path, metadata={}) as record:
        record.wind(wind(40))
        record.attach_file("log.csv", source, media_type="text/plain", log_time=START)
    assert Record.open(path).attachment("log.csv") == source.read_bytes()


def test_an_attached_file_that_does_not_shrink_comes_back_whole(tmp_path: Path) -> None:
    source = tmp_path / "noise"
    source.write_bytes(np.random.default_rng(1).bytes(100_000))
    path = tmp_path / "r.mcap"
    with RecordWriter(path, metadata={}) as record:
        record.wind(wind(40))
        record.attach_file("noise", source, media_type="application/octet-stream", log_time=START)
    assert Record.open(path).attachment("noise") == source.read_bytes()


def test_a_file_that_grows_while_it_is_attached_is_refused(tmp_path: Path) -> None:
    source = tmp_path / "log.csv"
    source.write_bytes(b"x" * 100)
    with pytest.raises(ConflictError, match="the file had 99 bytes and then 100"):
        list(pieces_of(source, 99))
    assert compress_pieces([b"x" * 100], 100) is not None
