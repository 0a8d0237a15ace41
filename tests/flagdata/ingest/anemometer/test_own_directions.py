"""Directions stay with their own instruments, components are no speeds, stations are apart, and steps lead on."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log

Write = Callable[[str], Path]
_START = 1_777_636_800 * 10**9


def _rows(row: str, count: int = 12) -> str:
    return "".join(row.format(at=at, speed=3 + at % 3, turned=200 + at) + "\n" for at in range(count))


def _refused(path: Path, **options: object) -> FlagdataError:
    with pytest.raises(FlagdataError) as caught:
        read_log(path, WindOptions(**options))  # type: ignore[arg-type]
    return caught.value


def test_blocks_of_the_same_headings_keep_their_own_directions(log_file: Write) -> None:
    path = log_file(
        f"time,wind_speed,wind_dir,wind_speed,wind_dir\n{_rows('2026-05-01T12:00:{at:02d}Z,1.5,10,2.5,{turned}')}"
    )
    second = anemometers(path, WindOptions(unit="m/s"))[1]
    channels = read_log(path, WindOptions(unit="m/s", wind=second)).series.channels
    assert channels["wind_speed"][0] == 2.5
    assert np.rad2deg(channels["wind_direction"][0]) == pytest.approx(200)


def test_a_direction_with_the_name_of_one_speed_is_not_given_to_the_others(log_file: Write) -> None:
    path = log_file(f"time,domeSpeed,extSpeed,extDir\n{_rows('2026-05-01T12:00:{at:02d}Z,0.5,{speed}.5,{turned}')}")
    assert "wind_direction" not in read_log(path, WindOptions(unit="m/s", wind="domeSpeed")).series.channels
    assert "wind_direction" in read_log(path, WindOptions(unit="m/s", wind="extSpeed")).series.channels


def test_numbers_beyond_every_wind_below_wv_are_a_vanes(log_file: Write) -> None:
    path = log_file(f"time,Speed (m/s),WV\n{_rows('2026-05-01T12:00:{at:02d}Z,{speed}.5,{turned}')}")
    assert anemometers(path) == ()
    assert np.rad2deg(read_log(path).series.channels["wind_direction"][0]) == pytest.approx(200)


def test_a_speed_that_goes_far_below_zero_is_asked_about_as_a_component(log_file: Write) -> None:
    path = log_file("time,wind speed (m/s)\n" + "".join(f"2026-05-01T12:00:{at:02d}Z,{at - 6}\n" for at in range(12)))
    assert "component" in _refused(path).what
    assert len(read_log(path, WindOptions(columns="time,wind_x[m/s]")).series.time) == 12


def test_stations_of_one_row_each_are_artifacts_of_their_own(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,K{'ABCDEFGHIJKL'[at]}X,3.{at % 10}\n" for at in range(12))
    assert len(anemometers(log_file(f'time,station,wind_speed[unit="m/s"]\n{rows}'))) == 12


def test_the_time_of_an_extreme_is_not_the_time_of_the_row(log_file: Write) -> None:
    rows = "".join(f"2026-05-{1 + at:02d},14:{at:02d},05:{at:02d},3.{at % 10}\n" for at in range(12))
    log = read_log(log_file(f"fecha,horatmax,horaracha,velocidad del viento (m/s)\n{rows}"), WindOptions(zone="UTC"))
    assert log.series.time.astype("datetime64[ns]")[0] == np.datetime64("2026-05-01T00:00")


def test_whole_numbers_to_36_are_offered_as_a_direction_of_an_open_unit(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{at * 3},{at}.5\n" for at in range(12))
    assert "wind_direction[?]" in (_refused(log_file(f"time,dir,value\n{rows}")).fix or "")


def test_a_direction_that_is_nearly_always_missing_is_still_one(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,3.5,{60 if at == 4 else 999}\n" for at in range(12))
    direction = read_log(log_file(f"time,WSPD (m/s),WDIR\n{rows}")).series.channels["wind_direction"]
    assert np.flatnonzero(np.isfinite(direction)).tolist() == [4]


def test_a_year_beside_a_clock_is_no_date_and_the_day_can_be_said(log_file: Write) -> None:
    path = log_file("year,time,spd (m/s)\n" + "".join(f"2026,{100 * at},3.5\n" for at in range(1, 12)))
    assert "no whole date" not in _refused(path).what
    options = WindOptions(columns=",time[%H%M],wind_speed[m/s]", date=dt.date(2026, 5, 1), zone="UTC")
    assert read_log(path, options).series.time.astype("datetime64[ns]")[0] == np.datetime64("2026-05-01T01:00")


def test_a_stream_with_one_time_is_counted_from_the_start_at_the_rate(log_file: Write) -> None:
    def sentence(text: str) -> str:
        return f"${text}*{reduce(xor, text.encode(), 0):02X}\n"

    text = "".join(sentence(f"WIMWV,{80 + at}.0,R,1{at}.0,N,A") for at in range(5)) + sentence(
        "GPZDA,073429,19,06,2019,00,00"
    )
    assert "--rate" in (_refused(log_file(text)).fix or "")
    log = read_log(log_file(text), WindOptions(start=_START, rate=1.0))
    assert ((log.series.time - _START) / 1e9).tolist() == [0, 1, 2, 3, 4]


def test_a_heading_whose_quotes_hold_a_line_break_is_one_line(log_file: Write) -> None:
    path = log_file(f'Date,"Wind speed\nof the roof (m/s)"\n{_rows("2026-05-01T12:00:{at:02d}Z,{speed}.5")}')
    assert read_log(path).series.channels["wind_speed"][0] == 3.5


def test_directions_beside_one_that_is_relative_are_told(log_file: Write) -> None:
    path = log_file(
        f"time,Rel_WS,Rel_WindDir,WindDir_True\n{_rows('2026-05-01T12:00:{at:02d}Z,{speed}.5,54,{turned}')}"
    )
    log = read_log(path, WindOptions(unit="m/s"))
    assert any("'WindDir_True'" in finding.what for finding in log.findings if finding.kind == "columns-not-read")


@pytest.mark.parametrize("heading", ["Hour:Minute", "Hour:Min", "time (h:min)", "hora:minuto"])
def test_a_clock_of_hours_and_minutes_is_the_time_of_the_row(log_file: Write, heading: str) -> None:
    rows = "".join(f"2026-05-01,14:{at:02d},3.{at % 10}\n" for at in range(12))
    log = read_log(log_file(f"date,{heading},wind speed (m/s)\n{rows}"), WindOptions(zone="UTC"))
    assert log.series.time.astype("datetime64[ns]")[1] == np.datetime64("2026-05-01T14:01")


@pytest.mark.parametrize("ahead", [True, False])
def test_the_one_time_of_a_stream_moves_no_reading(log_file: Write, ahead: bool) -> None:
    def sentence(text: str) -> str:
        return f"${text}*{reduce(xor, text.encode(), 0):02X}\n"

    time = sentence("GPRMC,120000,A,5200.0,N,00500.0,E,5.0,90.0,010526,,,A")
    wind = [sentence(f"WIMWV,{80 + at}.0,R,1{at}.0,M,A") for at in range(5)]
    log = read_log(log_file("".join([time, *wind] if ahead else [*wind, time])), WindOptions(start=_START, rate=1.0))
    assert log.series.channels["apparent_wind_speed"].tolist() == [10, 11, 12, 13, 14]


def test_sentences_after_stamps_of_any_writing_are_read(log_file: Write) -> None:
    def sentence(text: str) -> str:
        return f"${text}*{reduce(xor, text.encode(), 0):02X}\n"

    text = "".join(f"14/05/2026 12:00:0{at}, " + sentence(f"WIMWV,{80 + at}.0,R,1{at}.0,M,A") for at in range(5))
    log = read_log(log_file(text), WindOptions(zone="UTC"))
    assert log.series.channels["apparent_wind_speed"].tolist() == [10, 11, 12, 13, 14]
    assert log.series.time.astype("datetime64[ns]")[0] == np.datetime64("2026-05-14T12:00:00")
