"""Topics of ROS 2, encoded by another program (`make_ros2`): pictures and numbers are those that it
was given."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import CorruptError, InputError
from flagdata.ingest import CameraOptions, WindOptions, messages, open_camera, read_log, topics
from flagdata.ingest.mcap import cdr

FILE = Path(__file__).with_name("ros2.mcap")
NOON, STEP = 1_777_636_800_000_000_000, 100_000_000


@pytest.mark.parametrize(
    ("topic", "grays"),
    [("/compressed", 50 + 5 * np.arange(12)), ("/image", 200 - 5 * np.arange(12))],
)
def test_pictures_are_read_by_the_stamp_of_their_header(topic: str, grays: np.ndarray) -> None:
    with open_camera(FILE, CameraOptions(topic=topic, rate="native", size=64)) as stream:
        frames = list(stream)
    assert [frame.time for frame in frames] == [NOON + k * STEP for k in range(12)]
    assert [int(frame.image[32].mean()) for frame in frames] == grays.tolist()


def test_numbers_within_lists_of_messages_are_read_by_their_path() -> None:
    columns = (
        "time=time,readings.1.speed=wind_speed[m/s],readings.1.from_degrees=wind_direction[deg]"
    )
    series = read_log(FILE, WindOptions(topic="/mast", columns=columns)).series
    np.testing.assert_array_equal(series.time, NOON + STEP * np.arange(12))
    np.testing.assert_allclose(
        series.channels["wind_speed"], [6 + (k * 5 % 7) / 4 for k in range(12)]
    )
    np.testing.assert_allclose(np.degrees(series.channels["wind_direction"]), 90.0 + np.arange(12))


def test_every_field_has_the_value_that_was_encoded() -> None:
    assert [(topic.name, topic.count) for topic in topics(FILE)] == [
        ("/compressed", 12),
        ("/image", 12),
        ("/mast", 12),
        ("/pressure", 12),
    ]
    third = list(messages(FILE, "/mast"))[3].values
    assert third == {
        "header": {"stamp": {"sec": NOON // 10**9, "nanosec": 300_000_000}, "frame_id": "odd"},
        "sound": True,
        "kind": 1,
        "volts": [1.5, 2.5, 3.5],
        "empty": [],
        "last": 2**40 + 3,
        "readings": [
            {"unit": "m/s", "speed": 6.0, "from_degrees": 93.0},
            {"unit": "m/s", "speed": 6.25, "from_degrees": 93.0},
        ],
    }


def test_a_big_endian_message_is_read_by_its_header() -> None:
    # Plain CDR by hand: header 00 00 (big-endian), uint8 7, padding to 4, uint32 258, padding to 8,
    # float64 1.0.
    data = bytes.fromhex("00000000 07000000 00000102 3ff0000000000000")
    assert cdr.decoder("a/msg/B", "uint8 x\nuint32 y\nfloat64 z")(data) == {
        "x": 7,
        "y": 258,
        "z": 1.0,
    }


def test_messages_that_end_too_soon_and_types_that_are_not_defined_are_refused() -> None:
    decode = cdr.decoder("a/msg/B", "string name\nfloat64[] values")
    whole = bytes.fromhex(
        "00010000 02000000 6100 0000 01000000 00000000 000000000000f03f".replace(" ", "")
    )
    assert decode(whole)["name"] == "a"
    for end in (3, 8, 20):
        with pytest.raises(CorruptError):
            decode(whole[:end])
    with pytest.raises(CorruptError):  # a count beyond the message
        decode(bytes.fromhex("00010000 02000000 61000000 ffffff7f"))
    with pytest.raises(InputError, match="a/C"):
        cdr.decoder("a/msg/B", "C c")
    with pytest.raises(InputError, match="deeper"):
        cdr.decoder("a/msg/B", "B b")(bytes.fromhex("00010000"))


def test_lists_of_no_length_are_refused_since_messages_of_no_bytes_would_be_without_end() -> None:
    levels = [f"p/A{k}[99] a\n====\nMSG: p/A{k}" for k in range(9)]
    with pytest.raises(InputError, match="cannot be read"):
        cdr.decoder("p/msg/B", "\n".join([*levels, "uint8[00] nothing"]))
