"""Tables of weather services and networks: hours across for many quantities, gusts beside Ff, short rows of one."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.ingest.anemometer.sniff import sniff
from flagdata.ingest.anemometer.words.headings import understand

Write = Callable[..., Path]
Read = Callable[..., Any]


def test_quantities_in_rows_with_their_hours_across_become_columns(log_file: Write) -> None:
    """As the air quality network of Taiwan publishes a station's year."""
    values = {
        "AMB_TEMP": 12.0,
        "CH4": 2.0,
        "PM10": 76.0,
        "WIND_DIREC": 300.0,
        "WIND_SPEED": 1.5,
        "WS_HR": 1.2,
        "WD_HR": 250.0,
    }
    rows = [
        ",".join([f"2008/1/{day}", "Renwu", item, *(f"{value + 0.1 * hour:.1f}" for hour in range(1, 25))])
        for day in (1, 2) for item, value in values.items()
    ]  # fmt: skip
    heading = ",".join(["date", "station", "item", *(f"{hour:02d}" for hour in range(1, 25))])
    path = log_file("\n".join([heading, *rows]) + "\n")
    assert anemometers(path) == ("WIND_SPEED", "WS_HR")
    series = read_log(path, WindOptions(wind="WIND_SPEED", unit="m/s", zone="UTC")).series
    assert len(series.time) == 48
    np.testing.assert_allclose(series.channels["wind_speed"][:24], 1.5 + 0.1 * np.arange(1, 25))
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"][:24]), 300 + 0.1 * np.arange(1, 25))
    assert series.time[0] == np.datetime64("2008-01-01T01:00:00", "ns").astype(np.int64)


def test_ff3_beside_ff_is_a_gust(log_file: Write) -> None:
    rows = [f"2021-04-01T{3 * at:02d}:00:00Z;{2 + at};{10 + at};{45 * at}" for at in range(8)]
    path = log_file("\n".join(["time;Ff;ff3;DD", *rows]) + "\n")
    assert anemometers(path) == ()  # one
    assert read_log(path, WindOptions(unit="m/s")).series.channels["wind_speed"].tolist() == [
        2.0 + at for at in range(8)
    ]


def test_ff10_alone_is_the_wind(read: Read) -> None:
    rows = [f"2021-04-01T{3 * at:02d}:00:00Z;{2 + at};{45 * at}" for at in range(8)]
    series = read("\n".join(["time;ff10;dd", *rows]) + "\n", unit="m/s").series
    assert series.channels["wind_speed"].tolist() == [2.0 + at for at in range(8)]


@pytest.mark.parametrize(("heading", "unit"), [("Pa", None), ("PA", None), ("P (Pa)", "Pa"), ("pressure_pa", "Pa")])
def test_pa_alone_is_the_name_of_a_pressure_and_not_its_unit(heading: str, unit: str | None) -> None:
    assert understand(heading).unit == unit


def test_the_last_unit_of_a_heading_is_its_own() -> None:
    assert understand("stations.37100MS.rows.12.avgKmh").unit == "km/h"


@pytest.mark.parametrize("unit", ["gr", "º", "deg"])
def test_vdir_is_the_direction_of_the_wind_and_vvel_its_speed(read: Read, unit: str) -> None:
    """Of Spanish viento, beside components of nothing."""
    rows = [f"2018-02-01 {at:02d}:00:00,22.2,{180 + at}.0,{9 + at}.0" for at in range(12)]
    log = read("\n".join([f"Horario,Temp[ºC],VDir[{unit}],VVel[km/h]", *rows]) + "\n", zone="UTC", wind="VVel[km/h]")
    np.testing.assert_allclose(log.series.channels["wind_speed"], (9 + np.arange(12)) / 3.6)
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"]), 180 + np.arange(12))


def test_u_and_v_stay_components(read: Read) -> None:
    rows = [f"2018-02-01T{at:02d}:00:00Z,{1 + at},{2 - at},{10 * at}" for at in range(12)]
    series = read("\n".join(["time,u_vel,v_vel,sun_dir", *rows]) + "\n", unit="m/s").series
    np.testing.assert_allclose(series.channels["wind_speed"], np.hypot(1 + np.arange(12), 2 - np.arange(12)))


def test_a_pressure_that_may_be_in_hpa_or_mmhg_is_left_out(read: Read) -> None:
    rows = [f"2018-02-01T{at:02d}:00:00Z,{1 + at},{763 + 0.1 * at}" for at in range(12)]
    log = read("\n".join(["time,ws [m/s],PRESSURE", *rows]) + "\n")
    assert "air_pressure" not in log.series.channels


def test_a_station_of_short_rows_alone_is_an_anemometer(log_file: Write) -> None:
    rows = [
        f"{('07558', '07027')[at % 2]};2010-01-05T{at:02d}:00:00+01:00;1002;{10 * at};{2 + at};80;1.0;;"
        for at in range(12)
    ]
    rows.append("7434;2010-01-07T07:00:00+01:00;1005;220;4.1;100;9")
    path = log_file("\n".join(rows) + "\n")
    options = WindOptions(columns="1=site,2=time,5=wind_speed[m/s],4=wind_direction[deg]")
    assert anemometers(path, options) == ("07027", "07558", "7434")


def test_hours_without_a_date_are_offered_with_a_date_and_no_start(log_file: Write) -> None:
    """The first of 1 to 24 is an hour after the midnight that --start would be taken for."""
    rows = [f"{at},1014.4,{3 + 0.1 * at:.1f}" for at in range(1, 25)]
    path = log_file("\n".join([",pressure (hPa),speed of wind (m/s)", *rows]) + "\n")
    with pytest.raises(InputError) as raised:
        read_log(path, WindOptions(zone="UTC"))
    fix = raised.value.fix or ""
    assert "1=hour" in fix or '"hour,' in fix
    assert "elapsed" not in fix
    assert "--date DATE" in fix


def test_a_deep_table_of_stations_takes_seconds(log_file: Write) -> None:
    """Each station's rows lie within an object: they once became a column each, and minutes of work."""
    row = {"avgKmh": 9.7, "gustKmh": 15.8, "dirDeg": 262.8, "tempC": 16.6}
    rows = [{"instantUTC": f"2026-09-12T{18 + at // 60:02d}:{at % 60:02d}:00.000Z", **row} for at in range(100)]
    path = log_file(json.dumps({"stations": {"37100MS": {"rows": rows}, "20500MS": {"rows": rows}}}, indent=1))
    assert sniff(path)[0].winds == ("20500MS", "37100MS")
    series = read_log(path, WindOptions(wind="37100MS")).series
    np.testing.assert_allclose(series.channels["wind_speed"], 9.7 / 3.6)
    assert len(series.time) == 100


@pytest.mark.parametrize(("unit", "scale"), [("deg", 10), ("10 deg", 1)])
def test_0_beside_360_is_calm_air_and_360_is_north(read: Read, unit: str, scale: int) -> None:
    """Steps of ten degrees, as weather services report the wind; 0 in steps of one degree is north."""
    away = [36, 0, 18, 9, 36, 27, 1, 0, 35, 12, 20, 30, 36]
    rows = [f"2021-05-01T{at:02d}:00:00Z,{3 + at % 4},{value * scale}" for at, value in enumerate(away)]
    log = read("\n".join([f"time,wind speed [m/s],wind dir [{unit}]", *rows]) + "\n")
    found = np.rad2deg(log.series.channels["wind_direction"])
    wanted = [np.nan if value == 0 else 10 * value for value in away]
    np.testing.assert_allclose(np.cos(np.deg2rad(found)), np.cos(np.deg2rad(wanted)), atol=1e-9)
    assert [f.kind for f in log.findings if f.kind == "code-for-missing"] == ["code-for-missing"]


def test_0_beside_360_in_steps_of_a_degree_is_north(read: Read) -> None:
    away = [360, 0, 181, 93, 359, 271, 1, 0, 350, 12, 20, 30, 360]
    rows = [f"2021-05-01T{at:02d}:00:00Z,{3 + at % 4},{value}" for at, value in enumerate(away)]
    series = read("\n".join(["time,wind speed [m/s],wind dir [deg]", *rows]) + "\n").series
    assert bool(np.isfinite(series.channels["wind_direction"]).all())


def test_a_heading_that_counts_the_hours_is_no_first_reading(log_file: Write) -> None:
    rows = [
        f"{35 + at}.1,{-97 - at}.2,STN{at},{','.join(f'{3 + at}.{hour % 10}' for hour in range(23))}" for at in range(5)
    ]
    path = log_file("\n".join(["lat,lon,station," + ",".join(map(str, range(23))), *rows]) + "\n")
    options = WindOptions(columns="4=wind_speed[m/s]", start=np.datetime64("2020-01-01", "ns").astype(int), rate=1.0)
    series = read_log(path, options).series
    assert series.channels["wind_speed"].tolist() == [3.0, 4.0, 5.0, 6.0, 7.0]
