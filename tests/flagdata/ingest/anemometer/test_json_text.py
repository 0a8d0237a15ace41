"""JSON with one object a reading is read as the table it is."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError, InputError, LimitError, TimeError
from flagdata.ingest.anemometer import WindOptions, read_log, sniff
from flagdata.signals import WindLog

Read = Callable[..., WindLog]

SPEEDS = [4.2, 5.1, 3.9]
START = 1_777_636_800  # 2026-05-01T12:00:00Z


def lines(objects: list[dict[str, object]], before: str = "") -> str:
    return "".join(f"{before}{json.dumps(item)}\n" for item in objects)


def plain() -> list[dict[str, object]]:
    return [{"time": START + at, "wind_avg_km_h": 3.6 * speed} for at, speed in enumerate(SPEEDS)]


@pytest.mark.parametrize("text", [lines(plain()), lines(plain(), "weather/station "), json.dumps(plain())])
def test_members_are_columns_by_their_keys(read: Read, text: str) -> None:
    log = read(text)
    assert log.series.channels["wind_speed"].tolist() == pytest.approx(SPEEDS)
    assert log.series.time[0] == START * 10**9


def test_members_within_members_are_named_by_their_path_and_need_a_unit(read: Read) -> None:
    text = lines([{"t": START + at, "data": {"wind": {"speed": speed}}} for at, speed in enumerate(SPEEDS)])
    with pytest.raises(InputError, match=r"unit of column 'data.wind.speed' is not stated"):
        read(text)
    assert read(text, unit="m/s").series.channels["wind_speed"].tolist() == SPEEDS


def test_seconds_of_a_radio_recording_count_from_its_start(read: Read) -> None:
    text = lines([{"time": f"@{at:.6f}s", "wind_avg_km_h": 3.6 * speed} for at, speed in enumerate(SPEEDS)])
    with pytest.raises(TimeError, match="count from a start"):
        read(text)
    series = read(text, start=START * 10**9).series
    assert series.time.tolist() == [(START + at) * 10**9 for at in range(len(SPEEDS))]
    assert series.channels["wind_speed"].tolist() == pytest.approx(SPEEDS)


def test_readings_of_several_sensors_are_rows_beside_their_sensor(read: Read) -> None:
    wind = [{"ts": START + at, "wind_speed_avg": speed, "wind_speed_hi": 9.0} for at, speed in enumerate(SPEEDS)]
    indoors = [{"ts": START + at, "temp_in": 70} for at in range(3)]
    sensors = [{"lsid": 2, "sensor_type": 243, "data": indoors}, {"lsid": 1, "sensor_type": 43, "data": wind}]
    series = read(json.dumps({"sensors": sensors, "station_id": 1}), unit="m/s").series
    assert series.channels["wind_speed"].tolist() == SPEEDS
    assert series.time.tolist() == [(START + at) * 10**9 for at in range(3)]


def test_tempest_observations_are_arrays_in_the_order_of_its_reference(read: Read) -> None:
    text = lines([{"type": "obs_st", "obs": [[START + 60 * at, 1.0, speed, 9.0, 210, 6, 1013.2, 12.0, 60.0]]}
                  for at, speed in enumerate(SPEEDS)])  # fmt: skip
    series = read(text).series
    assert series.channels["wind_speed"].tolist() == SPEEDS
    assert series.channels["air_pressure"][0] == pytest.approx(101_320)


def test_rows_of_one_tempest_answer_are_readings_each(read: Read) -> None:
    rows = [[START + 60 * at, 1.0, speed, 9.0, 210, 6, 1013.2, 12.0, 60.0] for at, speed in enumerate(SPEEDS)]
    text = json.dumps({"status": {"status_code": 0}, "device_id": 1, "type": "obs_st", "obs": rows})
    series = read(text).series
    assert series.channels["wind_speed"].tolist() == SPEEDS
    assert series.time.tolist() == [(START + 60 * at) * 10**9 for at in range(3)]


def test_readings_below_a_list_of_one_object_are_rows(read: Read) -> None:
    intervals = [{"startTime": f"2026-05-01T{12 + at}:00:00Z", "values": {"windSpeed": speed}}
                 for at, speed in enumerate(SPEEDS)]  # fmt: skip
    line = {"timestep": "1h", "endTime": "2026-05-02T12:00:00Z", "intervals": intervals}
    series = read(json.dumps({"data": {"timelines": [line]}}), unit="m/s").series
    assert series.channels["wind_speed"].tolist() == SPEEDS
    assert series.time.tolist() == [(START + 3600 * at) * 10**9 for at in range(3)]


def test_signal_k_wind_is_apparent_and_in_si(read: Read) -> None:
    text = lines([
        {"updates": [{"timestamp": f"2026-05-01T12:00:0{at}Z",
                      "values": [{"path": "environment.wind.speedApparent", "value": speed},
                                 {"path": "environment.wind.angleApparent", "value": 1.5}]}]}
        for at, speed in enumerate(SPEEDS)
    ])  # fmt: skip
    channels = read(text).series.channels
    assert channels["apparent_wind_speed"].tolist() == SPEEDS
    assert "wind_speed" not in channels
    assert channels["apparent_wind_direction"].tolist() == pytest.approx([1.5] * 3)


def test_lines_that_are_no_objects_are_left_out_and_told(read: Read) -> None:
    log = read(lines(plain()) + "connection lost\n")
    assert len(log.series) == 3
    assert {"json-table", "malformed-lines"} <= {finding.kind for finding in log.findings}


def test_canboats_messages_stay_with_their_own_reader(log_file: Callable[[str], Path]) -> None:
    fields = {"Wind Speed": 4.2, "Wind Angle": 210.0, "Reference": "Apparent"}
    text = lines([{"timestamp": f"2026-05-01T12:00:0{n}Z", "prio": 2, "src": 36, "dst": 255, "pgn": 130306,
                   "description": "Wind Data", "fields": fields} for n in range(3)])  # fmt: skip
    assert sniff(log_file(text))[0].format == "canboat"


def test_an_object_of_any_number_of_members_is_refused_by_a_limit(log_file: Callable[[str], Path]) -> None:
    path = log_file(lines([{f"k{index}": 1 for index in range(3000)}] * 2))
    with pytest.raises(LimitError, match="more than 2000 kinds of members"):
        read_log(path, WindOptions())


@pytest.mark.parametrize("indent", [None, 2])
def test_lists_of_one_length_are_columns_with_their_units_and_zone_told(
    log_file: Callable[[str], Path], indent: int | None
) -> None:
    """As the forecast services of Open-Meteo's interface answer."""
    times = [f"2026-05-01T{hour:02d}:00" for hour in range(14, 17)]
    answer = {
        "utc_offset_seconds": 7200, "hourly_units": {"time": "iso8601", "wind_speed_10m": "km/h"},
        "hourly": {"time": times, "wind_speed_10m": [3.6 * speed for speed in SPEEDS]},
    }  # fmt: skip
    path = log_file(json.dumps(answer, indent=indent))
    with pytest.raises(FlagdataError, match=r"utc_offset_seconds,7200.*--zone \+02:00"):
        read_log(path, WindOptions())
    series = read_log(path, WindOptions(zone="+02:00")).series
    assert series.channels["wind_speed"].tolist() == pytest.approx(SPEEDS)
    assert series.time[0] == START * 10**9


def test_units_of_each_name_beside_a_list_of_readings_are_theirs(read: Read) -> None:
    rows = [{"timestamp": 1613977312 + 600 * at, "wind_speed": 2.7 + at, "temperature": 281.0} for at in range(12)]
    units = {"wind_speed": "km/h", "temperature": "K", "wind_direction": "none"}
    found = read(json.dumps({"data_count": 12, "units": units, "values": rows}))
    assert found.series.channels["wind_speed"] == pytest.approx((2.7 + np.arange(12)) / 3.6)
    assert found.series.channels["air_temperature"] == pytest.approx(281.0)
