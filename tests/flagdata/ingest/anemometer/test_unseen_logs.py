"""Logs as private loggers, boats and home servers write them: read right, or refused with what helps."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log, sniff
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]
_SECOND = 1_000_000_000


def instants(log: WindLog) -> list[str]:
    return [str(np.datetime64(int(ns), "ns"))[:19] for ns in log.series.time]


def degrees(log: WindLog) -> list[float]:
    return np.degrees(log.series.channels["wind_direction"]).tolist()


def refusal(path: Path, options: WindOptions | None = None) -> FlagdataError:
    with pytest.raises(FlagdataError) as caught:
        read_log(path, options or WindOptions())
    return caught.value


def test_fractions_of_a_second_before_am_and_pm_are_read(read: Read) -> None:
    rows = "".join(f"09/21/2015 01:13:{at:02d}.80 pm,{4 + at / 10:.1f}\n" for at in range(20, 32))
    log = read(f"DATE/TIME(UTC),wind speed [m/s]\n{rows}")
    assert instants(log)[0] == "2015-09-21T13:13:20"
    assert np.diff(log.series.time).tolist() == [_SECOND] * 11


def test_seconds_of_a_day_are_no_serial_days(log_file: Write) -> None:
    rows = "".join(f"{40401.8 + at:.1f},{4 + at / 10:.1f}\n" for at in range(12))
    error = refusal(log_file(f"Time,wind speed [m/s]\n{rows}"), WindOptions(zone="UTC"))
    assert "2010" not in error.what
    assert "counts in steps of 1" in error.what
    assert "elapsed-s" in error.fix


def test_serial_days_of_a_slow_log_are_still_dates(read: Read) -> None:
    rows = "".join(f"{40401.5 + at / 24:.6f},{4 + at / 10:.1f}\n" for at in range(12))
    assert instants(read(f"Time,wind speed [m/s]\n{rows}", zone="UTC"))[:2] == ["2010-08-11T12:00:00",
                                                                               "2010-08-11T13:00:00"]  # fmt: skip


def test_dates_in_parts_that_nothing_names_are_told_by_their_numbers_with_a_warning(read: Read) -> None:
    rows = "".join(f"2009 01 01 00 {at:02d} {at % 9 + 1} {270 + at} -4.8\n" for at in range(1, 13))
    log = read(rows, wind="6", unit="kn", zone="Pacific/Honolulu")
    assert instants(log)[0] == "2009-01-01T10:01:00"
    assert np.diff(log.series.time).tolist() == [60 * _SECOND] * 11
    assert log.series.channels["wind_speed"][0] == pytest.approx(2 * 1852 / 3600)
    assert [f.kind for f in log.findings if "numbers 1 to 5" in f.what] == ["heading-doubtful"]


def test_seconds_that_nothing_names_are_told_from_a_speed_by_how_they_are_written(read: Read) -> None:
    rows = "".join(f"77{at:02d} 2017 05 17 12 {18 + at // 6:02d} {at % 6 * 10:02d} {at % 7}\n" for at in range(12))
    log = read(rows, wind="8", unit="m/s", zone="UTC")
    assert instants(log)[:2] == ["2017-05-17T12:18:00", "2017-05-17T12:18:10"]


def test_units_side_by_side_are_those_of_the_whole_row(log_file: Write) -> None:
    """As in Cumulus's realtime.txt: a Beaufort number, then the units of wind, temperature, pressure and rain."""
    rows = "".join(
        f"10.08.18 10:{at:02d}:00 32.4 45 18.9 4.7 {6 + at / 10:.1f} 360 0.0 1024.7 2 kts C mb mm 7.0\n"
        for at in range(12)
    )
    proposal = sniff(log_file(rows))[0]
    assert not any("'#" in doubt for doubt in proposal.doubts)


def test_a_unit_alone_beside_its_number_still_counts(read: Read) -> None:
    rows = "".join(f"2026-05-01 10:{at:02d}:00,{4 + at / 10:.1f},km/h,ok\n" for at in range(12))
    log = read(f"time,wind speed,unit,state\n{rows}", zone="UTC")
    assert log.series.channels["wind_speed"][0] == pytest.approx(4 / 3.6)


@pytest.mark.parametrize("calm", ["still", "Calm", "штиль", "VRB"])
def test_points_of_the_compass_are_read_among_words_for_calm(read: Read, calm: str) -> None:
    cells = ["ESE", "S", calm, "NNE", calm, "N"]
    rows = "".join(f"2019-08-11 {at:02d}:00:00,{cell},{0 if cell == calm else 2}\n" for at, cell in enumerate(cells))
    found = degrees(read(f"time,direction,wind speed [m/s]\n{rows}", zone="UTC"))
    assert found == pytest.approx([112.5, 180.0, np.nan, 22.5, np.nan, 0.0], nan_ok=True)


def test_points_of_the_compass_may_be_spelled(read: Read) -> None:
    cells = ["Southwest", "North-Northeast", "SOUTH EAST", "West", "east-south-east"]
    rows = "".join(f"2019-08-11 {at:02d}:00:00,{cell},2\n" for at, cell in enumerate(cells))
    found = degrees(read(f"time,wind direction,wind speed [m/s]\n{rows}", zone="UTC"))
    assert found == pytest.approx([225.0, 22.5, 135.0, 270.0, 112.5])


def test_a_code_for_no_direction_leaves_the_others(read: Read) -> None:
    cells = [210, 220, 999, 230, 215, 205, 999, 225]
    rows = "".join(f"2019-08-11 {at:02d}:00:00,{cell},{2 + at / 10}\n" for at, cell in enumerate(cells))
    log = read(f"time,wind direction [deg],wind speed [m/s]\n{rows}", zone="UTC")
    wanted = [np.nan if cell == 999 else float(cell) for cell in cells]
    assert degrees(log) == pytest.approx(wanted, nan_ok=True)


def test_a_code_for_no_direction_takes_no_pressure_with_it(read: Read) -> None:
    cells = [210, 220, 999, 230, 215, 205, 999, 225]
    rows = "".join(f"2019-08-11 {at:02d}:00:00,{cell},{2 + at / 10},999\n" for at, cell in enumerate(cells))
    log = read(f"time,wind direction [deg],wind speed [m/s],pressure [hPa]\n{rows}", zone="UTC")
    assert log.series.channels["air_pressure"].tolist() == pytest.approx([99_900.0] * 8)


@pytest.mark.parametrize(
    ("day", "first"),
    [("2017-02-{:02d}", "2017-02-01"), ("201702{:02d}", "2017-02-01"), ("{:02d}-Feb-2017", "2017-02-01"),
     ("{:02d}.02.2017", "2017-02-01")],
)  # fmt: skip
def test_days_are_read_as_days_with_a_warning(read: Read, day: str, first: str) -> None:
    rows = "".join(f"{day.format(at + 1)},{4 + at / 10:.1f}\n" for at in range(20))
    log = read(f"date,wind_km/h\n{rows}", zone="UTC")
    assert instants(log)[0] == f"{first}T00:00:00"
    assert np.diff(log.series.time).tolist() == [86_400 * _SECOND] * 19
    assert [(f.severity.name, f.count) for f in log.findings if f.kind == "dates-alone"] == [("WARNING", 20)]


def test_the_order_of_days_is_asked_for(log_file: Write) -> None:
    rows = "".join(f"{at + 1:02d}/03/2017,{4 + at / 10:.1f}\n" for at in range(0, 12, 4))
    assert "--date-order" in refusal(log_file(f"date,wind_km/h\n{rows}"), WindOptions(zone="UTC")).fix


def test_a_count_that_starts_again_is_refused_where_it_does(log_file: Write) -> None:
    rows = "".join(f"{at % 12 * 5},{4 + at / 10:.1f}\n" for at in range(30))
    error = refusal(log_file(f"minutes,wind_km/h\n{rows}"), WindOptions(start=1_600_000_000 * _SECOND))
    assert "2 times, first at line 14" in error.what
    assert "--start" in error.fix


def test_the_direction_comes_with_the_speed_that_is_named(read: Read) -> None:
    rows = "".join(f"2026-05-01 10:{at:02d}:00,{4 + at / 10:.1f},{100 + at}\n" for at in range(12))
    log = read(f"time,10 min avg,wind dir [deg]\n{rows}", zone="UTC", wind="10 min avg", unit="m/s")
    assert degrees(log) == pytest.approx([100.0 + at for at in range(12)])


def test_a_direction_from_an_unknown_north_is_left_out_in_words(read: Read) -> None:
    rows = "".join(f"2026-05-01 10:{at:02d}:00,{4 + at / 10:.1f},{100 + at}\n" for at in range(12))
    log = read(f"time,TWS [kn],TWD\n{rows}", zone="UTC")
    assert "wind_direction" not in log.series.channels
    assert any("'TWD' may be from true or magnetic north" in finding.what for finding in log.findings)


def test_a_direction_without_a_speed_is_named_as_such(log_file: Write) -> None:
    rows = "".join(f"2019-08-11 {at:02d}:00:00,{100 + at}\n" for at in range(12))
    error = refusal(log_file(f"Tijdstip,Windrichting\n{rows}"), WindOptions(zone="UTC"))
    assert "'Windrichting' is a direction of the wind, but no column is its speed" in error.what


def test_speeds_in_km_per_hour_with_a_power_in_the_heading_are_scaled(read: Read) -> None:
    rows = "".join(f"2026-01-18 04:30:{at:02d}+00:00,{36 + at}\n" for at in range(12))
    log = read(f"DATETIME,wind_speed_km_h_1\n{rows}")
    assert log.series.channels["wind_speed"][0] == pytest.approx(10.0)


def test_sites_with_dates_in_parts_under_short_names_are_told_apart(log_file: Write) -> None:
    rows = "".join(
        f"{site},2019,9,9,14,{5 * at},{10 + at}\n" for at in range(6) for site in ("ACME", "ADAX", "ALTU")
    )  # fmt: skip
    path = log_file(f"STID,YR,MO,DA,HR,MI,WSPD\n{rows}")
    options = WindOptions(unit="mph", zone="America/Chicago")
    assert anemometers(path, options) == ("ACME", "ADAX", "ALTU")
    log = read_log(path, WindOptions(unit="mph", zone="America/Chicago", wind="ADAX"))
    assert instants(log)[:2] == ["2019-09-09T19:00:00", "2019-09-09T19:05:00"]
    assert log.series.channels["wind_speed"][0] == pytest.approx(10 * 0.44704)


def test_messages_of_another_kind_are_no_missing_readings(read: Read) -> None:
    rows = "".join(
        f'{{"time" : "2020-02-11 09:26:{at:02d}", "model" : "raw", "rows" : {at}}}\n'
        f'{{"time" : "2020-02-11 09:26:{at:02d}", "wind_avg_m_s" : {2 + at / 10:.1f}, "wind_dir_deg" : 270}}\n'
        for at in range(0, 60, 12)
    )
    log = read(rows, zone="UTC")
    assert np.diff(log.series.time).tolist() == [12 * _SECOND] * 4
    assert np.isfinite(log.series.channels["wind_speed"]).all()
    assert [f.count for f in log.findings if f.kind == "other-messages"] == [5]


def test_sentences_among_the_words_of_a_programs_log_are_read(read: Read) -> None:
    rows = "".join(
        f"2024-05-01 12:00:{at:02d}.100 INFO  [nmea] rx $WIMWV,212.6,R,5.8,N,A*29 ok\n"
        for at in range(12)
    )  # fmt: skip
    log = read(rows, zone="UTC", platform="fixed", azimuth=0.0)
    assert instants(log)[:2] == ["2024-05-01T12:00:00", "2024-05-01T12:00:01"]
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([5.8 * 1852 / 3600] * 12)
    assert not any(finding.kind == "malformed-lines" for finding in log.findings)


def test_a_heading_of_other_rows_than_those_that_follow_names_no_column(log_file: Write) -> None:
    """A logger's program was changed, and writes two more cells in front since."""
    old = "2025-10-13T15:31:04+08:00,model,29.9,0.3,74.0,8.7,142.0\n"
    new = "".join(f"2025-10-13T16:{at:02d}:04+08:00,,town,model,29.6,0.3,74.0,8.{at % 10},125.0\n" for at in range(12))
    path = log_file(f"ts_iso,provider,temp_c,rain_mm,humidity_pct,wind_speed_mps,wind_dir_deg\n{old}{new}")
    refusal(path)
    notes = " ".join(sniff(path)[0].notes)
    assert "names 7 columns, but rows have 9, and do not fit it" in notes


def test_a_heading_that_stops_early_is_taken_for_the_first_columns_with_a_warning(read: Read) -> None:
    rows = "".join(f"2025-10-13 16:{at:02d}:04,{3 + at / 10:.1f},{100 + at},13.1,5,6\n" for at in range(12))
    log = read(f"time,wind speed [m/s],wind direction [deg],battery [V]\n{rows}", zone="UTC")
    assert log.series.channels["wind_speed"][0] == pytest.approx(3.0)
    told = [finding.what for finding in log.findings if finding.kind == "heading-doubtful"]
    assert told == ["line 1 names 4 of 6 columns: taken as the first 4"]


def test_a_unit_that_the_lines_above_the_heading_state_is_proposed(log_file: Write) -> None:
    rows = "".join(f"99-08-27,{at:02d}:10,{11.8 + at / 10:.1f},254.5\n" for at in range(24))
    above = (
        "Site: an island\nSensor 1: Maximum anemometer, 25 m above ground level, Units: mph\nSensor 2: Units: Volts\n"
    )
    error = refusal(log_file(f"{above}Year-Month-Day,Hour:Minute,#1 wind speed mean,#1 wind direction mean\n{rows}"))
    assert "line 2 says 'Units: mph'" in error.what
    assert "--unit mph" in error.fix


def test_units_of_speed_that_differ_above_the_heading_propose_none(log_file: Write) -> None:
    rows = "".join(f"2019-08-27 {at:02d}:10,{1.8 + at / 10:.1f}\n" for at in range(24))
    error = refusal(log_file(f"a: Units: mph\nb: Units: km/h\ntime,wind speed\n{rows}"), WindOptions(zone="UTC"))
    assert "says" not in error.what


def test_a_line_of_units_alone_is_no_line_of_names(log_file: Write) -> None:
    rows = "".join(f"{at / 10:.1f} {-5.8 + at / 10:.2f} 0.10 -0.24\n" for at in range(12))
    guess = sniff(log_file(f"Elapsed Time Point01u Point01v Point01w\n(s) (m/s) (m/s) (m/s)\n{rows}"))[0]
    assert not any("(m/s)#" in doubt for doubt in guess.doubts)


@pytest.mark.parametrize(("short", "year"), [("26", 2026), ("00", 2000), ("99", 1999), ("70", 1970)])
def test_years_of_two_digits_are_of_the_last_century_from_70(read: Read, short: str, year: int) -> None:
    rows = [f"{short}-08-27 10:{k}0,{3.1 + k / 10:.1f}" for k in range(6)]
    log = read("\n".join(["time,wind speed (m/s)", *rows]) + "\n", zone="UTC", date_order="ymd")

    assert instants(log)[:2] == [f"{year}-08-27T10:00:00", f"{year}-08-27T10:10:00"]


@pytest.mark.parametrize(("short", "year"), [("26", 2026), ("99", 1999)])
def test_dates_of_sentences_are_of_the_same_centuries(log_file: Write, short: str, year: int) -> None:
    rows = [
        line
        for k in range(6)
        for line in (f"$GPRMC,10000{k},A,5950.0,N,01730.0,E,0.0,0.0,2708{short},,", f"$WIMWV,214.8,T,4.{k},M,A")
    ]

    log = read_log(log_file("\n".join(rows) + "\n"), WindOptions())

    assert instants(log)[0].startswith(f"{year}-08-27T10:00:0")


def _radio(time: str, speed: float, **more: object) -> str:
    return json.dumps({"time": f"2026-05-01 12:{time}", "model": "A5", **more, "wind_avg_km_h": speed})


def test_repeats_of_a_radio_message_are_no_further_readings(read: Read) -> None:
    times = ["13:22", "13:40", "13:58", "14:17", "14:35"]
    rows = [_radio(t, 2.6 + k, sequence_num=n, rssi=-n / 10) for k, t in enumerate(times) for n in range(3)]

    log = read("\n".join(rows) + "\n", zone="UTC")

    assert instants(log) == [f"2026-05-01T12:{t}" for t in times]
    assert [f.count for f in log.findings if f.kind == "repeated-messages"] == [10]
    assert not [f for f in log.findings if f.kind == "held-stamps"]


def test_equal_readings_that_are_not_numbered_as_repeats_are_kept(read: Read) -> None:
    rows = [_radio(f"13:{20 + k // 3}", 2.6) for k in range(30)]

    log = read("\n".join(rows) + "\n", zone="UTC")

    assert len(log.series.time) == 30


def test_messages_numbered_alike_are_not_repeats_unless_they_say_the_same(read: Read) -> None:
    rows = [_radio(f"13:{20 + k // 3}", 2.6 + k, sequence_num=k % 3) for k in range(30)]

    log = read("\n".join(rows) + "\n", zone="UTC")

    assert len(log.series.time) == 30


@pytest.mark.parametrize(
    ("heading", "points"),
    [
        ("年,月,日,時,風速(m/s),風向", ("南南東", "南東", "東", "北東", "静穏", "西北西")),
        ("年,月,日,时,风速(m/s),风向", ("南东南", "东南", "东", "东北", "静风", "西西北")),
    ],
)
def test_tables_of_the_far_east_in_parts_and_points(read: Read, heading: str, points: tuple[str, ...]) -> None:
    rows = "".join(f"2026,5,1,{12 + at},{3 + at / 10:.1f},{point}\n" for at, point in enumerate(points))
    log = read(f"{heading}\n{rows}", zone="UTC")
    assert ((log.series.time - log.series.time[0]) // (3600 * 10**9)).tolist() == [0, 1, 2, 3, 4, 5]
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([3 + at / 10 for at in range(6)])
    degrees = np.degrees(log.series.channels["wind_direction"])
    assert np.isnan(degrees[4])
    assert degrees[[0, 1, 2, 3, 5]].tolist() == pytest.approx([157.5, 135.0, 90.0, 45.0, 292.5])
