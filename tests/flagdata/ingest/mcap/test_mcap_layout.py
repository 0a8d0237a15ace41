"""All messages of a file are read, wherever they lie in it, and what is not there is reported."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import IndexType, Writer

from flagdata.errors import CorruptError
from flagdata.ingest import CameraOptions, WindOptions, examine, open_camera, read_log, topics
from tests.flagdata.ingest.mcap.conftest import NOON, STEP
from tests.flagdata.ingest.mcap.ros import COMPRESSED, WIND, bag, channel, compressed, film, wind

COLUMNS = "time=time,speed=wind_speed[m/s],direction=wind_direction[deg]"


def grays(path: Path, topic: str | None = None) -> tuple[list[int], list[str]]:
    """The numbers of the pictures that are read, by their grays, and the kinds of findings."""
    with open_camera(path, CameraOptions(rate="native", size=64, topic=topic)) as stream:
        found = [round((float(frame.image[32].mean()) - 40) / 3) for frame in stream]
    return found, [finding.kind for finding in stream.findings]


def leave_chunks(writer: Writer) -> None:
    """What follows is written outside chunks, as programs do that append to a file."""
    inner: Any = writer
    inner._Writer__finalize_chunk()
    inner._Writer__chunk_builder = None


def half_outside(path: Path, *, pictures: bool) -> Path:
    """Forty messages, the last ten of them behind the last chunk."""
    with bag(path) as writer:
        kind = (
            ("sensor_msgs/msg/CompressedImage", COMPRESSED) if pictures else ("my/msg/Wind", WIND)
        )
        one = channel(writer, "/one", *kind)
        for k in range(40):
            if k == 30:
                leave_chunks(writer)
            at = NOON + k * (STEP if pictures else 10**9)
            writer.add_message(
                one, at, compressed(at, k) if pictures else wind(at, 3 + k % 7 / 10), at
            )
    return path


def test_pictures_behind_the_last_chunk_are_read(tmp_path: Path) -> None:
    found, _ = grays(half_outside(tmp_path / "a.mcap", pictures=True))
    assert found == list(range(40))


def test_readings_behind_the_last_chunk_are_read(tmp_path: Path) -> None:
    path = half_outside(tmp_path / "a.mcap", pictures=False)
    series = read_log(path, WindOptions(columns=COLUMNS)).series
    np.testing.assert_allclose(series.channels["wind_speed"], [3 + k % 7 / 10 for k in range(40)])
    assert [stream.count for stream in examine(path).streams] == [40]


@pytest.mark.parametrize(
    "how",
    [
        {"use_chunking": False},
        {
            "use_statistics": False,
            "use_summary_offsets": False,
            "repeat_channels": False,
            "repeat_schemas": False,
        },
        {"index_types": IndexType.NONE},
        {
            "index_types": IndexType.NONE,
            "use_statistics": False,
            "repeat_channels": False,
            "repeat_schemas": False,
        },
        {"chunk_size": 1},
    ],
)
def test_a_file_is_read_whether_it_has_chunks_a_summary_and_an_index_or_none(
    tmp_path: Path, how: dict[str, Any]
) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, **how)
        writer.start()
        one = channel(writer, "/cam", "sensor_msgs/msg/CompressedImage", COMPRESSED)
        for k in range(12):
            writer.add_message(
                one, NOON + k * STEP, compressed(NOON + k * STEP, k), NOON + k * STEP
            )
        writer.finish()
    assert grays(path)[0] == list(range(12))


def test_messages_that_the_summary_counts_and_the_file_does_not_have_are_reported(
    tmp_path: Path,
) -> None:
    path = tmp_path / "a.mcap"
    with bag(path) as writer:
        one = channel(writer, "/cam", "sensor_msgs/msg/CompressedImage", COMPRESSED)
        for k in range(12):
            writer.add_message(
                one, NOON + k * STEP, compressed(NOON + k * STEP, k), NOON + k * STEP
            )
        inner: Any = writer
        inner._Writer__statistics.channel_message_counts[one] += 5
    found, kinds = grays(path)
    assert found == list(range(12))
    assert "messages-missing" in kinds
    assert [one.kind for one in examine(path).findings if one.kind.startswith("messages")] == [
        "messages-missing"
    ]


def test_files_written_one_behind_another_are_refused_with_the_commands_that_cut_them(
    tmp_path: Path,
) -> None:
    first, second = film(tmp_path / "a.mcap", range(3)), film(tmp_path / "b.mcap", range(3, 6))
    both = tmp_path / "both.mcap"
    both.write_bytes(first.read_bytes() + second.read_bytes())
    with pytest.raises(CorruptError, match="second MCAP file") as raised:
        topics(both)
    end = first.stat().st_size
    assert f"head -c {end} {both}" in raised.value.fix
    assert f"tail -c {second.stat().st_size} {both}" in raised.value.fix


def test_a_channel_that_is_defined_twice_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, use_chunking=False)
        writer.start()
        one = writer.register_channel("/a", "json", 0)
        writer.add_message(one, NOON, json.dumps({"x": 1}).encode(), NOON)
        inner: Any = writer
        inner._Writer__channels.clear()
        writer.register_channel("/b", "json", 0)
        writer.finish()
    with pytest.raises(CorruptError, match="channel 1 is defined twice"):
        topics(path)
