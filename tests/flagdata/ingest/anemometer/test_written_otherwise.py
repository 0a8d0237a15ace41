"""Stamps, headings and rows that are written otherwise than most: a point before a fraction, colons, a sign behind."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.cli import main
from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.lake import Lake

Write = Callable[..., Path]
Read = Callable[..., Any]
MINUTE = 60_000_000_000
START = np.datetime64("2014-10-07T01:00:00", "ns").astype(np.int64)


def _degrees(series: Any) -> list[float]:
    return np.rad2deg(series.channels["wind_direction"]).round(6).tolist()


@pytest.mark.parametrize("seconds", ["%S.%f", "%S%f", "%S.000"])
def test_the_point_before_a_fraction_may_be_written_or_not(log_file: Write, seconds: str) -> None:
    rows = [f"2014-10-07;01:{at:02d}:00.000;{2 + 0.1 * at:.1f}" for at in range(5)]
    path = log_file("\n".join(["date;time;wind", *rows]) + "\n")
    columns = f"date[%Y-%m-%d],time[%H:%M:{seconds}],wind_speed[m/s]"
    series = read_log(path, WindOptions(columns=columns, zone="UTC")).series
    assert (series.time - START).tolist() == [MINUTE * at for at in range(5)]


@pytest.mark.parametrize("sign", [" ", ",", ";"])
def test_dates_with_colons(read: Read, sign: str) -> None:
    """As EXIF has them; the date and the time of day in one column, or in two where blanks divide them."""
    heading = "date time wind" if sign == " " else f"time{sign}wind"
    rows = [f"2014:10:07 01:{at:02d}:00.000{sign}{2 + 0.1 * at:.1f}" for at in range(5)]
    series = read("\n".join([heading, *rows]) + "\n", unit="m/s", zone="UTC").series
    assert (series.time - START).tolist() == [MINUTE * at for at in range(5)]


@pytest.mark.parametrize("columns", [None, "time[%d/%m/%Y %H:%M],wind_speed[m/s]"])
def test_dates_before_1970_are_refused_for_what_they_are(log_file: Write, columns: str | None) -> None:
    rows = [f"{at + 1:02d}/03/1965 12:00;{2 + 0.1 * at:.1f}" for at in range(20)]
    path = log_file("\n".join(["date;ws [m/s]", *rows]) + "\n")
    with pytest.raises(InputError, match="dates before 1970"):
        read_log(path, WindOptions(columns=columns, zone="UTC"))


def test_a_sign_behind_the_last_cell_leaves_the_heading_its_names(read: Read) -> None:
    """Rows end in the delimiter, the heading does not, and cells at the end are always empty (rp5)."""
    names = ["Local time in Test", "T", "U", "DD", "Ff", "ff10", "N", "WW", "Tn", "Tx"]
    points = ["north-east", "south", "west-southwest", "southeast"]
    rows = [
        [f"01.04.2021 {3 * at:02d}:00", "5.1", "80", f"Wind blowing from the {point}", f"{2 + at}", *[""] * 5]
        for at, point in enumerate(points)
    ]
    lines = ["# Weather station Test", ";".join(f'"{name}"' for name in names)]
    lines += [";".join(f'"{cell}"' for cell in row) + ";" for row in rows]
    series = read("\n".join(lines) + "\n", unit="m/s", zone="UTC").series
    assert series.channels["wind_speed"].tolist() == [2, 3, 4, 5]
    assert _degrees(series) == [45.0, 180.0, 247.5, 135.0]


def test_the_velocity_beside_a_direction_is_the_speed(read: Read) -> None:
    rows = [f"2021-05-01T{at:02d}:00:00Z,{15 * at},{2 + 0.1 * at:.1f}" for at in range(24)]
    series = read("\n".join(["time,W_dir,W_vel", *rows]) + "\n", unit="m/s").series
    np.testing.assert_allclose(series.channels["wind_speed"], 2 + 0.1 * np.arange(24))
    assert _degrees(series)[:3] == [0.0, 15.0, 30.0]


def test_w_behind_u_and_v_is_the_vertical_component(read: Read) -> None:
    rows = [f"2021-05-01T{at:02d}:00:00Z,{1 + 0.1 * at:.1f},{2 - 0.1 * at:.1f},0.1,{15 * at}" for at in range(9)]
    series = read("\n".join(["time,U_vel,V_vel,W_vel,W_dir", *rows]) + "\n", unit="m/s").series
    assert series.channels["wind_z"].tolist() == [0.1] * 9


def test_a_gust_that_is_named_as_the_wind_is_warned_of(read: Read) -> None:
    rows = [f"2021-05-01T{at:02d}:00:00Z,{5 + 0.1 * at:.1f},{15 * at}" for at in range(9)]
    log = read("\n".join(["time,WMAX,dir", *rows]) + "\n", unit="m/s", wind="WMAX")
    assert "the heading of 'WMAX' is of a gust, an extreme or a spread: taken as you said" in [
        f.what for f in log.findings
    ]


def test_a_comma_behind_pm_is_no_clock_of_24_hours(log_file: Write) -> None:
    rows = [f'"{11 - (at > 5)}:{10 * (at % 6):02d} PM, Tue Jul 14 2020",{5 + at}' for at in range(6)]
    path = log_file("\n".join(["stamp,mph", *rows]) + "\n")
    options = WindOptions(columns="time[%I:%M %p, %a %b %d %Y],wind_speed[mph]", zone="UTC")
    log = read_log(path, options)
    assert "mixed-clocks" not in {finding.kind for finding in log.findings}
    assert log.series.time[0] == np.datetime64("2020-07-14T23:00:00", "ns").astype(np.int64)


@pytest.mark.parametrize("offset", ["-05:00", "-0500", "+05:00", "Z"])
@pytest.mark.parametrize("unit", ["", " [m/s]"])
def test_an_offset_behind_a_stamp_is_its_zone_whatever_its_sign(read: Read, offset: str, unit: str) -> None:
    rows = [f"2025-11-23T09:34:{at:02d}.500{offset},{3 + 0.1 * at:.1f},{220 + at}" for at in range(12)]
    series = read("\n".join([f"stamp,wind_speed{unit},wind_dir", *rows]) + "\n", unit="m/s").series
    hours = {"-05:00": 5, "-0500": 5, "+05:00": -5, "Z": 0}[offset]
    first = np.datetime64("2025-11-23T09:34:00.500", "ns").astype(np.int64) + hours * 60 * MINUTE
    assert series.time[0] == first
    np.testing.assert_allclose(series.channels["wind_speed"], 3 + 0.1 * np.arange(12))
    assert _degrees(series)[:2] == [220.0, 221.0]


def test_an_index_of_stamps_without_a_heading_shifts_no_column(read: Read) -> None:
    """As pandas writes a frame: the first heading is blank, and the parts of the stamp stand in columns again."""
    rows = [
        f"2019-01-01 00:{5 * at:02d}:00-07:00,2019,1,1,0,{5 * at},775,{19 + at},{5 + 0.5 * at:.1f}" for at in range(12)
    ]
    heading = ",Year,Month,Day,Hour,Minute,Pressure,Wind Direction,Wind Speed"
    series = read("\n".join([heading, *rows]) + "\n", unit="m/s").series
    assert series.time[0] == np.datetime64("2019-01-01T07:00:00", "ns").astype(np.int64)
    np.testing.assert_allclose(series.channels["wind_speed"], 5 + 0.5 * np.arange(12))


def test_hours_and_minutes_in_one_number_are_no_milliseconds(log_file: Write) -> None:
    rows = [f"2014,{100 * (at % 24 + 1)},61.8,{3 + at % 7}.25,{170 + at % 9}" for at in range(60)]
    path = log_file("\n".join(["year,time,Temp,spd,dir", *rows]) + "\n")
    with pytest.raises(InputError) as raised:
        read_log(path, WindOptions(zone="UTC"))
    assert "elapsed" not in str(raised.value.fix)
    series = read_log(path, WindOptions(unit="m/s", zone="UTC", date=dt.date(2014, 5, 1))).series
    assert np.unique(np.diff(series.time)).tolist() == [60 * MINUTE]


def test_rows_above_the_first_that_is_read_are_told(log_file: Write) -> None:
    """Days with storms have lines of breakpoints below them; where these are many, the table begins after them."""
    rows = []
    for day in range(1, 29):
        rows.append(f"{day}\t1\t2007\t0\t1.7\t-4.4\t233\t{4 + 0.1 * day:.1f}\t0\t-5.0")
        rows += [f"{at}.5\t0.2" for at in range(3)] if day < 12 else []
    path = log_file("\n".join(rows) + "\n")
    log = read_log(path, WindOptions(columns="day,month,year,,,,,wind_speed[m/s],,", zone="UTC"))
    told = [f.what for f in log.findings if "hold numbers as the rows do" in f.what]
    assert len(log.series.time) == 28 or told


def test_notes_below_a_short_table_do_not_hide_it(read: Read) -> None:
    rows = [f"20160101:{at:02d}10,0.0,3.44,{1.4 + 0.1 * at:.1f},0.0" for at in range(8)]
    notes = [
        "",
        "Gb(i): beam irradiance (W/m2)",
        "T2m: air temperature (degree Celsius)",
        "WS10m: wind speed (m/s)",
        "",
        "",
        "(c) 2021",
    ]
    text = "\n".join(["Latitude:\t45.0", "", "time,Gb(i),T2m,WS10m,Int", *rows, *notes]) + "\n"
    series = read(text, unit="m/s", zone="UTC").series
    np.testing.assert_allclose(series.channels["wind_speed"], 1.4 + 0.1 * np.arange(8))


def test_a_lost_sign_for_degrees_and_samples_of_a_speed(read: Read) -> None:
    rows = [f"2021-05-01T{at:02d}:00:00Z,{340 + at},{5 + at},{20 + at}" for at in range(12)]
    series = read("\n".join(['time,"Wind Direction, *","Ch1 wind Samples m/s","Temperature, *C"', *rows]) + "\n").series
    assert _degrees(series)[:2] == [340.0, 341.0]
    assert series.channels["wind_speed"].tolist() == [5.0 + at for at in range(12)]


def test_a_pressure_called_sp_is_no_speed_beside_a_wind(log_file: Write) -> None:
    rows = [f"2021-05-01T{at:02d}:00:00Z,{3 + at},{10 * at},{99870 + at}" for at in range(12)]
    assert anemometers(log_file("\n".join(["time,WS10m,WD10m,SP", *rows]) + "\n"), WindOptions(unit="m/s")) == ()


@pytest.mark.usefixtures("confirmed_drafts")
def test_several_anemometers_of_a_log_come_in_whole_or_not_at_all(log_file: Write, tmp_path: Path) -> None:
    """The rows of the second station are out of order, which its user must explain: nothing of the first is kept."""
    seconds = (100, 140, 180, 330, 370, 540, 550, 570, 220, 260, 410, 450, 490, 530, 590, 780, 30, 830, 70, 110)
    rows = [f"A,2021-05-01T{at:02d}:00:00Z,{3 + at}" for at in range(12)]
    rows += [f"B,2021-05-01T11:{s // 60:02d}:{s % 60:02d}Z,{3 + at % 5}.5" for at, s in enumerate(seconds)]
    path = log_file("\n".join(["station,time,wind_speed_ms", *rows]) + "\n", "log.csv")
    lake = Lake.create(tmp_path / "lake")
    with pytest.raises(SystemExit) as stopped:
        main(["ingest", str(path), "--lake", str(tmp_path / "lake")])
    assert stopped.value.code != 0
    assert lake.rows().num_rows == 0
    path = log_file("\n".join(["station,time,wind_speed_ms", *rows[:20]]) + "\n", "first.csv")
    with pytest.raises(SystemExit):
        main(["ingest", str(path), "--lake", str(tmp_path / "lake")])
    assert lake.rows().num_rows == 2
    assert lake.view(None)[0].version == 1  # one commit
