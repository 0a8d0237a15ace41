"""Numbers of a topic are read as an anemometer's table: its fields are columns, its messages
rows."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest import WindIngest, WindOptions, classify, ingest_wind, read_log
from flagdata.lake import Lake
from flagdata.record import RecordWriter
from flagdata.record.signals import Sensor, WindSeries
from tests.confirming import CONFIRMED
from tests.flagdata.ingest.mcap.conftest import NOON

SPEED = [round(20 + 5 * float(np.sin(k / 3)), 2) for k in range(60)]
COLUMNS = "time=time,air.speed=wind_speed[km/h],air.from.0=wind_direction[deg]"


def wind(count: int = 60) -> list[dict[str, Any]]:
    """Nested numbers: a speed about 20 km/h, a direction, a text, and a stamp of its own each
    second."""
    return [
        {
            "timestamp": {"sec": NOON // 10**9 + k, "nsec": 250_000_000},
            "air": {"speed": SPEED[k], "from": [90 + k % 7, 0.5]},
            "state": "ok",
            "count": k,
        }
        for k in range(count)
    ]


def test_columns_are_given_by_the_path_of_a_field(write_json: Callable[..., Path]) -> None:
    path = write_json({"/mast": wind(), "/battery": [{"volts": 12.5}]})
    series = read_log(path, WindOptions(topic="/mast", columns=COLUMNS)).series
    np.testing.assert_array_equal(series.time, NOON + 250_000_000 + 10**9 * np.arange(60))
    np.testing.assert_allclose(series.channels["wind_speed"], np.array(SPEED) / 3.6)
    np.testing.assert_allclose(
        series.channels["wind_direction"], np.radians(90 + np.arange(60) % 7)
    )


def test_several_topics_of_numbers_are_listed(write_json: Callable[..., Path]) -> None:
    path = write_json(
        {"/mast": wind(), "/battery": [{"volts": 12.5}], "/text": [{"text": "no number"}]}
    )
    with pytest.raises(InputError, match=r"2 topics hold numbers: /battery .*, /mast") as raised:
        read_log(path, WindOptions(columns=COLUMNS))
    assert "--topic" in raised.value.fix
    assert classify(path, topic="/mast").kind == "anemometer"


def test_a_topic_of_numbers_becomes_a_log_of_the_lake(
    write_json: Callable[..., Path], lake: Lake
) -> None:
    path = write_json({"/mast": wind()})
    made = ingest_wind(lake, path, WindIngest(wind=WindOptions(columns=COLUMNS)), confirm=CONFIRMED)
    assert made.created
    assert made.report["samples"] == 60
    assert {"log-not-attached", "topic-read"} <= {
        finding["kind"] for finding in made.report["findings"]
    }


def test_flagdatas_own_samples_in_another_programs_file_need_no_units(tmp_path: Path) -> None:
    """As `mcap filter` leaves a record: the same messages, no profile and no metadata."""
    from mcap.reader import make_reader
    from mcap.writer import Writer

    time = NOON + 10**9 * np.arange(30)
    series = WindSeries(
        time=time,
        channels={"wind_speed": np.array(SPEED[:30]), "wind_direction": np.arange(30) % 7 / 10},
        flags=np.zeros(30, np.uint16),
        sensor=Sensor(name="cup"),
    )
    ours, filtered = tmp_path / "ours.mcap", tmp_path / "filtered.mcap"
    with RecordWriter(ours, metadata={}) as record:
        record.wind(series)
    with ours.open("rb") as source, filtered.open("wb") as target:
        writer = Writer(target)
        writer.start()
        numbers: dict[str, int] = {}
        for schema, channel, message in make_reader(source).iter_messages(topics=["/wind/samples"]):
            assert schema is not None
            if channel.topic not in numbers:
                known = writer.register_schema(schema.name, schema.encoding, schema.data)
                numbers[channel.topic] = writer.register_channel(
                    channel.topic, channel.message_encoding, known
                )
            writer.add_message(
                numbers[channel.topic], message.log_time, message.data, message.publish_time
            )
        writer.finish()
    assert classify(filtered).kind == "anemometer"
    found = read_log(filtered).series
    np.testing.assert_array_equal(found.time, time)
    for name, values in series.channels.items():
        np.testing.assert_allclose(found.channels[name], values)
