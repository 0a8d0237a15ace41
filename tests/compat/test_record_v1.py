"""A record of format version 1, kept as it was written in November 2026: every later version must
read it.

The file holds three frames of one gray level each, five wind samples on a clock 2 s behind,
parameters, and two attachments, one of them packed. It is never rewritten; a new format version
adds a file of its own.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flagdata.core.clock_model import ClockModel
from flagdata.record import Coding, Record, salvage
from flagdata.record.signals import Sensor

RECORD = Path(__file__).with_name("record-v1.mcap")
START = 1_767_225_600_000_000_000  # 2026-01-01T00:00:00Z


@pytest.fixture(params=["as written", "salvaged"])
def record(request: pytest.FixtureRequest, tmp_path: Path) -> Record:
    if request.param == "as written":
        return Record.open(RECORD)
    salvage(RECORD, tmp_path / "copy.mcap")
    return Record.open(tmp_path / "copy.mcap")


def test_frames_and_their_three_times(record: Record) -> None:
    assert record.coding is Coding.JPEG
    np.testing.assert_array_equal(record.frame_times, START + 40_000_000 * np.arange(3))
    np.testing.assert_array_equal(record.device_frame_times, record.frame_times - 1_500_000_000)
    np.testing.assert_array_equal(record.timestamps(0, 3), record.frame_times + 5_000_000)
    frames = record.frames(0, 3)
    assert frames.shape == (3, 16, 24)
    for frame, level in zip(frames, (10, 120, 240), strict=True):
        # A constant block has a DC coefficient alone, quantised at quality 90 in steps of 3/8 gray
        # level.
        assert np.abs(frame.astype(int) - level).max() <= 1


def test_wind_on_the_common_clock(record: Record) -> None:
    series = record.wind()
    assert series is not None
    device = START + 500_000_000 * np.arange(5)
    np.testing.assert_array_equal(series.time, device + 2_000_000_000)
    np.testing.assert_array_equal(record.device_wind_times, device)
    assert series.host_time is not None
    np.testing.assert_array_equal(series.host_time, device + 80_000_000)
    assert set(series.channels) == {"wind_speed", "wind_direction", "air_temperature"}
    np.testing.assert_array_equal(series.channels["wind_speed"], [4.0, 5.0, np.nan, 7.0, 0.0])
    np.testing.assert_array_equal(series.channels["wind_direction"], [0.5, 1.0, 1.5, 2.0, 2.5])
    np.testing.assert_array_equal(series.channels["air_temperature"], [288.15] * 5)
    assert series.flags.tolist() == [0, 0, 8, 0, 2]
    assert series.sensor == Sensor(name="cup", height=2.0, accuracy=0.1)


def test_means_of_a_second(record: Record) -> None:
    means = record.wind_1hz()
    assert means is not None
    assert means.period == 1.0
    # Samples at 2.0 s | 2.5 s, (3.0 s: missing) | 3.5 s, 4.0 s: bins end with the second, (end - 1
    # s, end].
    np.testing.assert_array_equal(means.time, START + 10**9 * np.array([2, 3, 4]))
    np.testing.assert_array_equal(means.count, [1, 1, 2])
    np.testing.assert_allclose(means.speed, [4.0, 5.0, 3.5])


def test_parameters_metadata_and_attachments(record: Record) -> None:
    assert record.truth == {"bending": 1.315e-4, "wind": 6.0}
    assert record.metadata["camera"] == {"codec": "drawn"}
    assert record.metadata["provenance"] == {"source_name": "golden.mp4"}
    clock = ClockModel.from_json(record.metadata["clock/cup"]["model"])
    assert clock.segments[0].offset == 2.0
    assert record.attachment("golden.csv") == b"time,speed\n" + b"2026-01-01T00:00:00Z,4.0\n" * 4000
    assert record.attachment("note.txt") == b"kept"
