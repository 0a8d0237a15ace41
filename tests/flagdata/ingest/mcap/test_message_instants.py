"""Messages are dated by their own stamps and read in the order of these; where that cannot be, it
is reported."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.errors import TimeError
from flagdata.ingest import CameraOptions, WindOptions, open_camera, read_log
from tests.flagdata.ingest.mcap.conftest import NOON, STEP
from tests.flagdata.ingest.mcap.ros import COMPRESSED, WIND, bag, channel, compressed, wind
from tests.flagdata.ingest.mcap.test_mcap_layout import COLUMNS

HOUR = 3600 * 10**9
Clock = Callable[[int], int]


def steady(k: int) -> int:
    return NOON + k * STEP


def filmed(path: Path, stamp: Clock, logged: Clock) -> Path:
    """Forty pictures, stamped and logged by two clocks."""
    with bag(path) as writer:
        camera = channel(writer, "/cam", "sensor_msgs/msg/CompressedImage", COMPRESSED)
        for k in range(40):
            writer.add_message(camera, logged(k), compressed(stamp(k), k), logged(k))
    return path


def read(path: Path, start: int | None = None) -> tuple[list[int], list[int], dict[str, str]]:
    """Numbers of the pictures, when they were taken in steps from the first one, and findings by
    their kind."""
    with open_camera(path, CameraOptions(rate="native", size=64, start=start)) as stream:
        frames = list(stream)
    numbers = [round((float(frame.image[32].mean()) - 40) / 3) for frame in frames]
    times = [round((frame.time - frames[0].time) / STEP) for frame in frames]
    return numbers, times, {finding.kind: str(finding.severity) for finding in stream.findings}


def test_a_log_whose_clock_was_set_back_leaves_pictures_in_the_order_of_their_stamps(
    tmp_path: Path,
) -> None:
    path = filmed(tmp_path / "a.mcap", steady, lambda k: steady(k) - (HOUR if k >= 20 else 0))
    numbers, times, kinds = read(path)
    assert numbers == times == list(range(40))
    assert "stamps-disordered" not in kinds
    assert "clocks-apart" in kinds


def test_readings_are_in_the_order_of_their_stamps_where_the_log_was_set_back(
    tmp_path: Path,
) -> None:
    path = tmp_path / "a.mcap"
    with bag(path) as writer:
        mast = channel(writer, "/mast", "my/msg/Wind", WIND)
        for k in range(40):
            at = NOON + k * 10**9
            writer.add_message(mast, at - (HOUR if k >= 20 else 0), wind(at, 3 + k % 7 / 10), at)
    series = read_log(path, WindOptions(columns=COLUMNS)).series
    np.testing.assert_array_equal(series.time, NOON + 10**9 * np.arange(40))
    np.testing.assert_allclose(series.channels["wind_speed"], [3 + k % 7 / 10 for k in range(40)])


def test_neighbours_that_were_logged_in_the_other_order_are_all_kept(tmp_path: Path) -> None:
    numbers, times, kinds = read(filmed(tmp_path / "a.mcap", lambda k: steady(k ^ 1), steady))
    assert numbers == [k ^ 1 for k in range(40)]
    assert times == list(range(40))
    assert "stamps-disordered" not in kinds


def test_a_file_whose_halves_are_in_the_other_order_is_read_in_order_and_reported(
    tmp_path: Path,
) -> None:
    numbers, times, kinds = read(
        filmed(
            tmp_path / "a.mcap", lambda k: steady((k + 20) % 40), lambda k: steady((k + 20) % 40)
        )
    )
    assert times == list(range(40))
    assert numbers == [(k + 20) % 40 for k in range(40)]
    assert kinds["log-disordered"] == "warning"


def test_a_camera_whose_clock_was_set_back_gives_what_was_before_and_reports_the_rest(
    tmp_path: Path,
) -> None:
    numbers, times, kinds = read(
        filmed(tmp_path / "a.mcap", lambda k: steady(k) - (HOUR if k >= 20 else 0), steady)
    )
    assert numbers == times == list(range(20))
    assert kinds["clock-reset"] == "error"


def test_pictures_with_a_stamp_of_zero_are_dated_by_the_log_and_reported(tmp_path: Path) -> None:
    numbers, times, kinds = read(filmed(tmp_path / "a.mcap", lambda _: 0, steady))
    assert numbers == times == list(range(40))
    assert kinds["dated-by-log"] == "warning"
    some = filmed(tmp_path / "b.mcap", lambda k: steady(k) if k % 5 else 0, steady)
    assert read(some)[2]["dated-by-log"] == "warning"
    assert "dated-by-log" not in read(filmed(tmp_path / "c.mcap", steady, steady))[2]


def test_pictures_from_before_the_clock_was_set_are_dated_by_the_log(tmp_path: Path) -> None:
    path = filmed(
        tmp_path / "a.mcap", lambda k: steady(k) if k >= 3 else 12 * 10**9 + k * STEP, steady
    )
    numbers, times, kinds = read(path)
    assert numbers == times == list(range(40))
    assert kinds["dated-by-log"] == "warning"


def test_copies_of_a_picture_are_left_out_and_counted(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with bag(path) as writer:
        one, other = (
            channel(writer, "/cam", "sensor_msgs/msg/CompressedImage", COMPRESSED) for _ in range(2)
        )
        for k in range(40):
            for camera in (one, other):
                writer.add_message(camera, steady(k), compressed(steady(k), k), steady(k))
    with open_camera(path, CameraOptions(rate="native", size=64)) as stream:
        assert len(list(stream)) == 40
    assert [one.count for one in stream.findings if one.kind == "stamps-duplicate"] == [40]


def test_simulated_time_is_refused_and_read_from_a_start_that_is_given(tmp_path: Path) -> None:
    path = filmed(tmp_path / "a.mcap", lambda k: 12 * 10**9 + k * STEP, steady)
    with pytest.raises(TimeError, match="1970") as raised:
        read(path)
    assert "--start" in raised.value.fix
    assert read(path, start=NOON)[:2] == (list(range(40)), list(range(40)))


@pytest.mark.parametrize(
    "stamp",
    [
        lambda ns: ns,
        lambda ns: ns // 1000,
        lambda ns: ns // 10**6,
        lambda ns: ns / 1e9,
        lambda ns: str(ns),
        lambda ns: f"2026-05-01T12:00:{ns // 10**9 % 60:02d}Z",
        lambda ns: {"sec": ns // 10**9},
        lambda ns: {"secs": ns // 10**9, "nsecs": ns % 10**9},
    ],
)
def test_an_instant_is_read_in_the_unit_that_it_has(
    write_json: Callable[..., Path], stamp: Callable[[int], Any]
) -> None:
    """Stamps a minute before the log, one a second where the log has ten: the log's clock cannot
    stand in for them."""
    said = [
        {"timestamp": stamp(NOON + k * 10**9), "speed": 3 + k % 7 / 10, "from": 200.0 + k % 5}
        for k in range(30)
    ]
    path = write_json({"/mast": said})
    series = read_log(
        path, WindOptions(columns="time=time,speed=wind_speed[m/s],from=wind_direction[deg]")
    ).series
    np.testing.assert_allclose(series.time - NOON, 10**9 * np.arange(30), atol=1000)


def test_a_stamp_that_is_no_date_is_reported_where_the_log_dates_the_message(
    write_json: Callable[..., Path],
) -> None:
    said = [
        {"timestamp": 12.5 + k, "speed": 3 + k % 7 / 10, "from": 200.0 + k % 5} for k in range(30)
    ]
    options = WindOptions(
        columns="time=time,speed=wind_speed[m/s],from=wind_direction[deg]", expect=("coarse",)
    )
    log = read_log(write_json({"/mast": said}), options)
    np.testing.assert_array_equal(log.series.time, NOON + 10**8 * np.arange(30))
    assert [one.severity.value for one in log.findings if one.kind == "dated-by-log"] == ["warning"]
