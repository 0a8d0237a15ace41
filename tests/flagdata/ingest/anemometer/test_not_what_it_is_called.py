"""Columns that are called after a wind, or offered as one, and are none: cubes, lengths, blades, heights, soundings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.ingest.anemometer.words.headings import understand
from flagdata.rng import stream
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]
ROWS = 30


def rows(row: Callable[[int], str]) -> str:
    return "".join(f"2026-05-01T12:{at:02d}:00Z,{row(at)}\n" for at in range(ROWS))


def test_a_mean_cube_is_told_by_its_name_where_its_numbers_do_not(log_file: Write) -> None:
    path = log_file(
        f"time,WS_ms_Avg(5m),WS3_Avg(5m)\n{rows(lambda at: f'{0.1 + at % 5 / 20:.2f},{0.05 + at % 3 / 40:.4f}')}"
    )
    log = read_log(path)
    assert anemometers(path) == ()
    np.testing.assert_allclose(log.series.channels["wind_speed"][:3], [0.1, 0.15, 0.2])
    assert any("'WS3_Avg(5m)' is a mean cube" in finding.what for finding in log.findings)


def test_the_third_of_three_is_an_anemometer(log_file: Write) -> None:
    path = log_file(f"time,WS1,WS2,WS3\n{rows(lambda at: f'{3 + at % 5}.5,{4 + at % 3}.5,{2 + at % 4}.5')}")
    assert anemometers(path, WindOptions(unit="m/s")) == ("WS1", "WS2", "WS3")


@pytest.mark.parametrize("heading", ["WS_ms_Avg(5m)", "WS_ms_Max(5m)", "WS_ms_Std(5m)"])
def test_minutes_behind_a_statistic_are_no_height(heading: str) -> None:
    assert understand(heading).height is None


def test_the_length_of_two_components_is_no_wind_upwards(read: Read) -> None:
    generator = stream(0, "length")
    u, v = generator.normal(0, 3, (2, ROWS))
    log = read(f"time,u,v,w\n{rows(lambda at: f'{u[at]:.4f},{v[at]:.4f},{np.hypot(u[at], v[at]):.4f}')}", unit="m/s")
    assert "wind_z" not in log.series.channels
    w = generator.normal(0, 0.3, ROWS)
    log = read(f"time,u,v,w\n{rows(lambda at: f'{u[at]:.4f},{v[at]:.4f},{w[at]:.4f}')}", unit="m/s")
    assert "wind_z" in log.series.channels


def test_the_angle_of_a_blade_is_offered_as_no_direction(read: Read) -> None:
    heading = "time,wind speed (m/s),blade angle A"
    log = read(f"{heading}\n{rows(lambda at: f'{3 + at % 4}.5,{90 + at / 10:.1f}')}")
    assert not any("3=wind_direction" in finding.what for finding in log.findings)


def test_a_change_is_no_anemometer_of_its_own(log_file: Write) -> None:
    path = log_file(f"time,wind_speed_kt,wind_speed_kt_delta\n{rows(lambda at: f'{3 + at % 4}.5,{at % 3}.0')}")
    assert anemometers(path) == ()


def test_when_it_was_observed_goes_before_when_it_was_stored(read: Read) -> None:
    stored = rows(lambda at: f"2026-05-01 11:{at // 4:02d}:00,3.5").replace("Z,", ",")
    log = read(f"timestamp,observation_time,wind speed (m/s)\n{stored}", zone="UTC")
    assert str(np.datetime64(int(log.series.time[0]), "ns"))[:16] == "2026-05-01T11:00"


def test_a_sounding_is_said_to_be_none_in_time(read: Read) -> None:
    levels = "".join(f"{1000 - 20 * at}.0 {115 + 170 * at} {14 - at}.2 {200 + at} {6 + at}\n" for at in range(ROWS))
    with pytest.raises(FlagdataError, match="a profile over height"):
        read(f" PRES HGHT TEMP DRCT SKNT\n{levels}")


def test_a_table_of_names_in_another_script_with_units_that_differ_is_read_by_its_names(read: Read) -> None:
    kinds = {
        "رطوبت": "30.2,%",
        "فشار هوا": "91.5,kPa",
        "سرعت باد": "16.6,km/h",
        "باران": "378.4,mm",
        "جهت باد": "88.3,degree",
    }
    table = "".join(
        f"2026-05-11 16:{at:02d}:03,{kind},{value}\n" for at in range(12) for kind, value in kinds.items()
    )  # fmt: skip
    channels = read(f"تاریخ و زمان,نوع سنسور,مقدار,واحد\n{table}", zone="UTC").series.channels
    np.testing.assert_allclose(channels["wind_speed"], 16.6 / 3.6)
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), 88.3)


def test_values_of_many_units_are_not_one_wind(read: Read) -> None:
    kinds = {"alfa": "30.2,%", "beta": "91.5,kPa", "gamma": "16.6,km/h", "delta": "163,W/m2"}
    table = "".join(f"2026-05-11 16:{at:02d}:03,{kind},{value}\n" for at in range(12) for kind, value in kinds.items())
    with pytest.raises(FlagdataError, match="different units"):
        read(f"time,kind,number,of\n{table}", zone="UTC", wind="number", unit="km/h")


@pytest.mark.parametrize("columns", ["DD,FH", "FH,T"])
def test_knmis_hours_are_read_with_the_speed_alone(read: Read, columns: str) -> None:
    table = "".join(f"  370,20190101,{hour:5d},{40 + hour:5d},{50 + hour:5d}\n" for hour in range(1, 25))
    hour = "HH" if "DD" in columns else "H"
    log = read(f"# STN,YYYYMMDD,{hour:>5},{','.join(f'{name:>5}' for name in columns.split(','))}\n{table}")
    np.testing.assert_array_equal(np.diff(log.series.time), 3600 * 10**9)
    first = 50 if columns.startswith("DD") else 40
    np.testing.assert_allclose(log.series.channels["wind_speed"], (first + np.arange(1, 25)) / 10)


def test_times_that_were_converted_are_of_the_second_zone(read: Read) -> None:
    table = rows(lambda at: "3.5").replace("Z,", ",")
    text = f"# The times have been converted from CST to UTC\ntime,wind speed (m/s)\n{table}"
    with pytest.raises(FlagdataError) as caught:
        read(text)
    assert "--zone UTC" in (caught.value.fix or "")
    assert "China" not in (caught.value.fix or "")


def test_the_direction_of_a_gust_in_tens_of_degrees_is_offered_in_them(read: Read) -> None:
    table = rows(lambda at: f"{3 + at % 4}.5,{200 + at},{6 + at % 4}.5,{10 + at % 20}")
    log = read(f"time,wind speed (m/s),wind dir (deg),gust (m/s),gust direction (10s deg)\n{table}")
    told = "; ".join(finding.what for finding in log.findings)
    assert "5=wind_direction[10 deg]" in told
