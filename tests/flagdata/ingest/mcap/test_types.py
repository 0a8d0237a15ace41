"""Each message is decoded by the definition of its own channel; messages of different types are no
one series."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest import WindOptions, guesses, read_log
from tests.flagdata.ingest.mcap.conftest import NOON, STEP, encoded
from tests.flagdata.ingest.mcap.ros import (
    COMPRESSED,
    PLAIN,
    WARM_WIND,
    WIND,
    Cdr,
    bag,
    channel,
    compressed,
    direction,
    gray,
    plain,
    wind,
)
from tests.flagdata.ingest.mcap.test_mcap_layout import COLUMNS, grays

SPEED = [3 + 7 * k % 11 / 10 for k in range(60)]


def mast(
    path: Path,
    second: tuple[str, str],
    *,
    later: Callable[[int, float], bytes],
    mixed: bool = False,
) -> Path:
    """Sixty readings of /mast, some of them on a second channel: the last thirty, or every other
    one."""
    with bag(path) as writer:
        one, other = (
            channel(writer, "/mast", "my/msg/Wind", WIND),
            channel(writer, "/mast", *second),
        )
        for k, speed in enumerate(SPEED):
            at = NOON + k * 10**9
            on_other = k % 2 if mixed else k >= 30
            writer.add_message(
                other if on_other else one,
                at,
                later(at, speed) if on_other else wind(at, speed),
                at,
            )
    return path


def test_a_definition_that_changed_within_a_topic_is_used_from_its_own_channel_on(
    tmp_path: Path,
) -> None:
    path = mast(
        tmp_path / "a.mcap",
        ("my/msg/Wind", WARM_WIND),
        later=lambda at, speed: wind(at, speed, temperature=21.5),
    )
    series = read_log(path, WindOptions(topic="/mast", columns=COLUMNS)).series
    np.testing.assert_allclose(series.channels["wind_speed"], SPEED)


def test_channels_of_one_topic_and_type_are_one_series(tmp_path: Path) -> None:
    path = mast(tmp_path / "a.mcap", ("my/msg/Wind", WIND), later=wind, mixed=True)
    series = read_log(path, WindOptions(topic="/mast", columns=COLUMNS)).series
    np.testing.assert_allclose(series.channels["wind_speed"], SPEED)


def test_readings_of_two_types_on_a_topic_are_chosen_by_their_type(tmp_path: Path) -> None:
    path = mast(
        tmp_path / "a.mcap", ("my/msg/WindKmh", WIND), later=lambda at, speed: wind(at, 3.6 * speed)
    )
    with pytest.raises(InputError, match="several types") as raised:
        read_log(path, WindOptions(topic="/mast", columns=COLUMNS))
    assert "--topic /mast:my/msg/Wind" in raised.value.fix
    series = read_log(
        path, WindOptions(topic="/mast:my/msg/WindKmh", columns=COLUMNS.replace("m/s", "km/h"))
    ).series
    np.testing.assert_allclose(series.channels["wind_speed"], SPEED[30:])


def test_pictures_of_two_types_on_a_topic_are_chosen_by_their_type(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with bag(path) as writer:
        one = channel(writer, "/cam", "sensor_msgs/msg/CompressedImage", COMPRESSED)
        other = channel(writer, "/cam", "sensor_msgs/msg/Image", PLAIN)
        for k in range(20):
            at = NOON + k * STEP
            if k < 12:
                writer.add_message(one, at, compressed(at, k), at)
            else:
                writer.add_message(other, at, plain(at, gray(k), "mono8"), at)
    assert [guess.kind for guess in guesses(path, topic="/cam")] == ["camera", "camera"]
    with pytest.raises(InputError, match="several types"):
        grays(path, "/cam")
    found, kinds = grays(path, "/cam:sensor_msgs/msg/Image")
    assert found == list(range(12, 20))
    assert "topics-not-read" in kinds


def test_a_type_in_two_encodings_is_decoded_by_that_of_each_channel(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with bag(path) as writer:
        one = channel(writer, "/mast", "my/msg/Wind", WIND)
        schema = writer.register_schema("my/msg/Wind", "jsonschema", b"{}")
        other = writer.register_channel("/mast", "json", schema)
        for k, speed in enumerate(SPEED):
            at = NOON + k * 10**9
            said = {
                "stamp": {"sec": at // 10**9, "nsec": 0},
                "speed": speed,
                "direction": direction(at),
            }
            writer.add_message(
                other if k % 2 else one,
                at,
                json.dumps(said).encode() if k % 2 else wind(at, speed),
                at,
            )
    series = read_log(path, WindOptions(topic="/mast", columns=COLUMNS)).series
    np.testing.assert_allclose(series.channels["wind_speed"], SPEED)


def test_messages_of_ros_1_are_read_since_mcap_convert_writes_them(tmp_path: Path) -> None:
    image = "Header header\nstring format\nuint8[] data\n" + "=" * 80
    image += "\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
    path = tmp_path / "a.mcap"
    with bag(path) as writer:
        schema = writer.register_schema("sensor_msgs/CompressedImage", "ros1msg", image.encode())
        camera = writer.register_channel("/cam", "ros1", schema)
        schema = writer.register_schema(
            "my/Wind", "ros1msg", b"time stamp\nfloat64 speed\nfloat64 direction\n"
        )
        mast = writer.register_channel("/mast", "ros1", schema)
        for k in range(30):
            at = NOON + k * STEP
            made = (
                Cdr(ros1=True)
                .put("I", k)
                .stamp(at)
                .text("odd")
                .text("png")
                .data(encoded(gray(k), "PNG"))
            )
            writer.add_message(camera, at + 5, made.done(), at + 5)
            at = NOON + k * 10**9
            made = Cdr(ros1=True).stamp(at).put("d", SPEED[k]).put("d", direction(at))
            writer.add_message(mast, at + 5, made.done(), at + 5)
    assert grays(path)[0] == list(range(30))
    series = read_log(path, WindOptions(topic="/mast", columns=COLUMNS)).series
    np.testing.assert_array_equal(series.time, NOON + 10**9 * np.arange(30))
    np.testing.assert_allclose(series.channels["wind_speed"], SPEED[:30])
