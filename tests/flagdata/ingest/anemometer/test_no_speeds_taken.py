"""What is no speed, or no height: cubes, components, minutes of a mean; and hours that are no seconds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.errors import InputError, UnknownNameError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.ingest.anemometer.sniff import sniff
from flagdata.ingest.anemometer.words.headings import understand

Write = Callable[..., Path]
Read = Callable[..., Any]


def _table(heading: str, rows: list[str]) -> str:
    return "\n".join([heading, *rows]) + "\n"


def test_the_mean_cube_of_a_speed_is_no_wind(log_file: Write) -> None:
    speed = [2.0 + 0.4 * (at % 6) for at in range(24)]
    rows = [f"2026-05-01 {at:02d}:00:00,{v:.2f},{1.1 * v**3:.2f},{(20 * at) % 360}" for at, v in enumerate(speed)]
    path = log_file(_table("TIMESTAMP,WS_ms_Avg(5m),WS3_Avg(5m),WindDir_Avg(5m)", rows))
    assert anemometers(path) == ()  # one
    log = read_log(path, WindOptions(zone="UTC"))
    np.testing.assert_allclose(log.series.channels["wind_speed"], speed)
    assert log.series.sensor.height is None  # five minutes of a mean, not five metres
    assert any("WS3_Avg(5m)' is the cube of 'WS_ms_Avg(5m)'" in finding.what for finding in log.findings)


def test_two_speeds_that_are_no_powers_are_both_winds(log_file: Write) -> None:
    rows = [f"2026-05-01 {at:02d}:00:00,{2 + 0.4 * (at % 6):.2f},{3 + 0.5 * (at % 6):.2f}" for at in range(24)]
    assert len(anemometers(log_file(_table("time,ws_10m [m/s],ws_40m [m/s]", rows)))) == 2


@pytest.mark.parametrize(
    ("heading", "height"),
    [("WS_Avg(5m)", None), ("WS Mean (10 m)", None), ("WS_Avg 10m", 10.0), ("WS (10m)", 10.0), ("WS_10m_Avg", 10.0)],
)
def test_minutes_behind_a_mean_are_no_height(heading: str, height: float | None) -> None:
    assert understand(heading).height == height


@pytest.mark.parametrize(
    ("east", "north"),
    [
        ("wind_zonal", "wind_merid"), ("uwnd", "vwnd"), ("UGRD", "VGRD"), ("wind_ew", "wind_ns"),
        ("East wind", "North wind"),
    ],
)  # fmt: skip
def test_components_towards_east_and_north_by_their_names(read: Read, east: str, north: str) -> None:
    """A wind from 225° at √2 · 3 m/s blows towards north-east: both components are 3 m/s."""
    rows = [f"2026-05-01T{at:02d}:00:00Z,{3.0 + at},{3.0 + at}" for at in range(4)]
    series = read(_table(f"time,{east},{north}", rows), unit="m/s").series
    np.testing.assert_allclose(series.channels["wind_speed"], np.sqrt(2) * (3.0 + np.arange(4)))
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), 225.0)


def test_a_component_that_is_named_a_speed_is_refused(log_file: Write) -> None:
    rows = [f"2026/05/01 {at:02d}:00:00 {-2.0 + 0.4 * at:.2f} {1.5 - 0.2 * at:.2f}" for at in range(24)]
    path = log_file(_table("", rows).lstrip())
    with pytest.raises(InputError, match="below zero in 21 % of its rows, down to -2 m/s, as a component") as raised:
        read_log(path, WindOptions(wind="3", unit="m/s", zone="UTC"))
    assert "wind_x[m/s] and wind_y[m/s]" in (raised.value.fix or "")


def test_calm_air_that_reads_a_little_below_zero_is_a_speed(log_file: Write) -> None:
    rows = [f"2026-05-01T{at:02d}:00:00Z,{(-0.1, -0.2, -0.15, 2.0, 3.0)[at % 5]}" for at in range(20)]
    log = read_log(log_file(_table("time,wind_speed [m/s]", rows)), WindOptions())
    assert [finding.count for finding in log.findings if finding.kind == "negative-speed"] == [12]


@pytest.mark.parametrize("name", ["wind_u", "wind_v", "wind_zonal", "u10", "eastward_wind"])
def test_a_component_of_another_name_is_told_its_axis(log_file: Write, name: str) -> None:
    path = log_file("2026-05-01T12:00:00Z 1.0 2.0\n2026-05-01T12:00:01Z 1.1 2.1\n")
    with pytest.raises(UnknownNameError) as raised:
        read_log(path, WindOptions(columns=f"time,{name}[m/s]"))
    fix = raised.value.fix or ""
    assert "wind_x and the one towards north wind_y, and add --azimuth 270" in fix
    assert "did you mean" not in fix


def test_a_misspelt_name_is_answered_with_the_nearest_and_all_names(log_file: Write) -> None:
    path = log_file("2026-05-01T12:00:00Z 1.0 2.0\n2026-05-01T12:00:01Z 1.1 2.1\n")
    with pytest.raises(UnknownNameError) as raised:
        read_log(path, WindOptions(columns="time,wind_sped[m/s]"))
    assert "did you mean 'wind_speed'? known: date, time, year" in (raised.value.fix or "")


@pytest.mark.parametrize("heading", ["ObsTime", "obs_time", "Observation hour", "Time of observation"])
def test_hours_of_an_observation_beside_a_date(read: Read, heading: str) -> None:
    """24 is the midnight that ends the day."""
    rows = [f"2026-05-01,1010.1,{2 + 0.1 * at:.1f},{15 * at % 360},{at}" for at in range(1, 25)]
    series = read(_table(f"Date,StnPres,WS,WD,{heading}", rows), unit="m/s", zone="UTC").series
    assert np.unique(np.diff(series.time)).tolist() == [3_600_000_000_000]
    assert series.time[-1] == np.datetime64("2026-05-02T00:00:00", "ns").astype(np.int64)


def test_a_number_beside_dates_is_offered_as_no_seconds(log_file: Write) -> None:
    rows = [f"2026-05-01,1010.1,{2 + 0.1 * at:.1f},{15 * at % 360},{at}" for at in range(1, 25)]
    path = log_file(_table("Date,StnPres,WS,WD,slot time", rows))
    with pytest.raises(InputError) as raised:
        read_log(path, WindOptions(unit="m/s", zone="UTC"))
    told = f"{raised.value.what} {raised.value.fix}"
    assert "elapsed" not in told
    line = "1=date,3=wind_speed[m/s],4=wind_direction[deg],5=hour"
    assert f"if column 'slot time' is the hour of the day: --columns \"{line}\"" in told
    series = read_log(path, WindOptions(columns=line, zone="UTC")).series
    assert np.unique(np.diff(series.time)).tolist() == [3_600_000_000_000]


def test_dates_beside_a_running_number_are_the_time(read: Read) -> None:
    rows = [f"{at},2026-05-{at + 1:02d},{2 + 0.1 * at:.1f}" for at in range(24)]
    series = read(_table("datetime,date,wind_speed", rows), unit="m/s", zone="UTC").series
    assert np.unique(np.diff(series.time)).tolist() == [86_400_000_000_000]


def test_places_of_another_kind_are_winds_of_their_own(log_file: Write) -> None:
    rows = [
        f"{lake},2026-05-{day:02d} {at:02d}:00:00,{day + 0.1 * at:.1f}"
        for day, lake in enumerate(["Mendota", "Erken", "Zurich"], 1) for at in range(12)
    ]  # fmt: skip
    assert anemometers(log_file(_table("lake,time,wind_speed_ms", rows))) == ("Erken", "Mendota", "Zurich")


def test_the_difference_of_two_sonics_is_no_third(log_file: Write) -> None:
    """Blocks with the same headings side by side: two instruments, then one less the other."""
    one = [1.0 + 0.3 * (at % 5) for at in range(12)]
    two = [1.2 + 0.2 * (at % 4) for at in range(12)]
    rows = [
        f"2026-05-01T{at:02d}:00:00Z,{a:.2f},{10 * at},{b:.2f},{350 - 30 * at},{a - b:.2f},{40 * at - 350}"
        for at, (a, b) in enumerate(zip(one, two, strict=True))
    ]
    path = log_file(_table("time,wind_speed,wind_dir,wind_speed,wind_dir,wind_speed,wind_dir", rows))
    assert anemometers(path) == ("wind_speed#2", "wind_speed#4")
    series = read_log(path, WindOptions(wind="wind_speed#4", unit="m/s")).series
    np.testing.assert_allclose(series.channels["wind_speed"], two)


def test_angles_over_more_than_a_turn_are_no_direction(read: Read) -> None:
    rows = [f"2026-05-01T{at:02d}:00:00Z,{2 + at},{-178 + 36 * at}" for at in range(13)]
    log = read(_table("when,wind_speed [m/s],wind_dir", rows))
    assert "wind_direction" not in log.series.channels
    assert any("over more than a turn, -178 to 254" in finding.what for finding in log.findings)


def test_a_letter_that_marks_every_row_is_offered_as_no_direction(log_file: Write) -> None:
    """D is east in Turkish, and here the kind of the record."""
    rows = [f'D,"2024/12/23","10:{at:02d}",{15 * at},{0.1 * at:.1f},2,!050' for at in range(12)]
    path = log_file("\n".join(rows) + "\n")
    with pytest.raises(InputError) as raised:
        read_log(path, WindOptions(zone="UTC"))
    assert '--columns ",date,time,' in (raised.value.fix or "")
    log = read_log(path, WindOptions(wind="5", unit="m/s", zone="UTC"))
    assert not any("points" in finding.what for finding in log.findings)


def test_components_that_were_turned_into_the_mean_wind_are_no_wind_of_their_own(log_file: Write) -> None:
    rows = [f"2026-05-01T{at:02d}:00:00Z,{2 + at},{-1.0 - at},0.3,{2 + at},0.0,{10 * at}" for at in range(12)]
    path = log_file(_table("time,wind_speed [m/s],u_unrot [m/s],v_unrot [m/s],u_rot [m/s],v_rot [m/s],wind_dir", rows))
    assert anemometers(path) == ()  # one
    assert set(read_log(path, WindOptions()).series.channels) == {"wind_speed", "wind_direction"}


def test_a_wind_that_is_offered_has_the_direction_of_its_height(log_file: Write) -> None:
    heading = "time,40m speed [m/s],40m speed max [m/s],40m Wind Direction,60m speed [m/s],60m Wind Direction"
    rows = [f"2026-05-01T{at:02d}:00:00Z,{2 + at},{3 + at},{10 * at},{4 + at},{15 * at}" for at in range(12)]
    path = log_file(_table(heading, rows))
    assert len(anemometers(path)) == 2
    for wind in anemometers(path):
        told = " ".join(finding.what for finding in read_log(path, WindOptions(wind=wind)).findings)
        assert '--columns "1=time,3=wind_speed[m/s],4=wind_direction[deg]"' in told or "3=wind_speed" not in told
        assert "3=wind_speed[m/s],6=wind_direction" not in told
    first = read_log(path, WindOptions(wind=anemometers(path)[0]))
    assert any('"1=time,3=wind_speed[m/s],4=wind_direction[deg]"' in finding.what for finding in first.findings)


def test_a_number_names_a_column_where_sites_are_called_by_words(log_file: Write) -> None:
    rows = [f"2026-05-01T{at // 2:02d}:00:00Z,{('hill', 'lake')[at % 2]},20.1,{2 + at},{15 * at}" for at in range(24)]
    path = log_file("\n".join(rows) + "\n")
    series = read_log(path, WindOptions(wind="lake:4", unit="m/s")).series
    assert series.channels["wind_speed"].tolist() == [3.0 + 2 * at for at in range(12)]


def test_rich_text_is_named(log_file: Write) -> None:
    path = log_file("{\\rtf1\\ansi\\ansicpg1252\n61  1  1 15.04 14.96\\\n61  1  2 14.71   NaN\\\n}")
    with pytest.raises(InputError, match="rich text") as raised:
        read_log(path, WindOptions())
    assert "plain text" in (raised.value.fix or "")


def test_a_sniff_says_what_a_file_was_rewritten_from(log_file: Write) -> None:
    rows = [f'{{"time": "2026-05-01T{at:02d}:00:00Z", "wind_speed_ms": {2 + at}}}' for at in range(12)]
    notes = sniff(log_file("\n".join(rows) + "\n"))[0].notes
    assert notes[0].startswith("JSON, read as a table of 2 columns")


def test_the_direction_beside_a_difference_goes_with_it(log_file: Write) -> None:
    """Blocks with the same headings, whose differences of directions look like directions but for their sign."""
    rows = [
        f"2026-05-01T{at:02d}:00:00Z,{1 + 0.3 * (at % 5):.2f},{10 + at},{1.2 + 0.2 * (at % 4):.2f},{330 + at},"
        f"{0.3 * (at % 5) - 0.2 - 0.2 * (at % 4):.2f},{40 - 3 * at}"
        for at in range(12)
    ]
    path = log_file(_table("time,wind_speed,wind_dir,wind_speed,wind_dir,wind_speed,wind_dir", rows))
    series = read_log(path, WindOptions(wind="wind_speed#4", unit="m/s")).series
    np.testing.assert_allclose(np.degrees(series.channels["wind_direction"]), 330 + np.arange(12))


def test_marks_of_quality_are_no_second_wind(log_file: Write) -> None:
    rows = [f"2026-05-01T{at:02d}:00:00Z,{3 + 0.1 * at:.1f},{at % 2}" for at in range(12)]
    path = log_file(_table("time,TOW.FF_10M_10 [m/s],TOW.Q_FF_10M_10", rows))
    assert anemometers(path) == ()  # one
    notes = " ".join(finding.what for finding in read_log(path, WindOptions()).findings)
    assert "'TOW.Q_FF_10M_10' holds marks of another column" in notes


def test_ticks_beside_a_direction_are_counts_and_no_speed(log_file: Write) -> None:
    rows = [f"2026-05-01T{at:02d}:00:00Z,{at}.5,{600 + at},{200 + at}" for at in range(12)]
    path = log_file(_table("time,R_u [deg],NumTicks [Cnt],Wind direction [degrees]", rows))
    for options in (WindOptions(), WindOptions(columns="1=time,3=wind_speed,4=wind_direction[deg]")):
        with pytest.raises(InputError, match=r"'NumTicks .Cnt.' is what an anemometer counts") as raised:
            read_log(path, options)
        assert "3=wind_speed[? m/s],4=wind_direction[deg]" in (raised.value.fix or "")


def test_a_speed_is_no_difference_with_a_column_that_was_never_filled(log_file: Write) -> None:
    rows = [f"2026-05-01T{at:02d}:00:00Z,{3 - at}.5,0.0,{3 - at}.5" for at in range(12)]
    path = log_file(_table("time,craft wind speed [m/s],wind speed [m/s],radial wind speed [m/s]", rows))
    notes = " ".join(finding.what for finding in read_log(path, WindOptions(wind="wind speed [m/s]")).findings)
    assert " less " not in notes


def test_the_three_results_of_a_wind_vector_are_a_speed_a_direction_and_its_spread(log_file: Write) -> None:
    """Campbell's WindVector writes them under one name, and the unit of the speed below all three."""
    head = (
        '"TOA5","x"\n"TIMESTAMP","WS_CUP_1_WVc(1)","WS_CUP_1_WVc(2)","WS_CUP_1_WVc(3)"\n"TS","m s-1","m s-1","m s-1"\n'
    )
    rows = "".join(f'"2026-05-01 12:{at:02d}:00",{3 + at % 4}.5,{200 + at}.1,{6 + at % 3}.35\n' for at in range(12))
    path = log_file(f'{head}"","WVc","WVc","WVc"\n{rows}')
    assert anemometers(path, WindOptions(format="delimited")) == ()  # one
    channels = read_log(path, WindOptions(format="delimited", zone="UTC")).series.channels
    np.testing.assert_allclose(channels["wind_speed"], 3.5 + np.arange(12) % 4)
    np.testing.assert_allclose(np.degrees(channels["wind_direction"]), 200.1 + np.arange(12))


def test_codes_of_no_value_do_not_tell_a_unit(log_file: Write) -> None:
    rows = [f"2026-05-01T{at:02d}:00:00Z,{'999999' if at % 2 else f'{8 + at % 7}.5'}" for at in range(24)]
    with pytest.raises(InputError) as raised:
        read_log(log_file(_table("time,wind speed", rows)), WindOptions())
    assert "extreme wind" not in raised.value.what


def test_a_days_mean_and_maximum_beside_readings_are_no_winds(log_file: Callable[[str], Path]) -> None:
    heading = "DATE,AWND,DailyAverageWindSpeed,DailySustainedWindSpeed,DailySustainedWindDirection,HourlyWindSpeed,"
    heading += "HourlyWindDirection"
    rows = [f"2026-05-{1 + at // 24:02d}T{at % 24:02d}:52:00Z,,,,,{3 + at % 5},{200 + at % 50}" for at in range(48)]
    rows[23] = "2026-05-01T23:59:00Z,,5.7,23,300,,"
    rows[47] = "2026-05-02T23:59:00Z,8.7,5.9,21,310,,"
    path = log_file("\n".join([heading, *rows]) + "\n")
    assert anemometers(path, WindOptions(unit="mph")) in (("HourlyWindSpeed",), ())
    log = read_log(path, WindOptions(unit="mph"))
    assert log.series.channels["wind_speed"][:2].tolist() == pytest.approx([3 * 0.44704, 4 * 0.44704])
    told = " ".join(found.what for found in log.findings)
    assert "'DailySustainedWindSpeed' is of a whole day" in told
    assert "'AWND' is of a whole day" in told


def test_days_means_alone_are_read(log_file: Callable[[str], Path]) -> None:
    rows = [f"2026-05-{1 + at:02d},{3 + at % 5}.5" for at in range(20)]
    path = log_file("\n".join(["date,Daily mean wind speed (m/s)", *rows]) + "\n")
    assert len(read_log(path, WindOptions(zone="UTC")).series.time) == 20
