"""Columns that look like a wind and are none, or are one though no heading says so."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.ingest.anemometer.winds import cumulated
from flagdata.ingest.anemometer.words.headings import understand
from flagdata.rng import stream
from flagdata.signals import WindLog
from flagdata.timebase import NANOSECONDS

Read = Callable[..., WindLog]
Write = Callable[[str], Path]
MIDNIGHT = 1_777_593_600  # s, 2026-05-01T00:00:00Z


def stamp(minutes: float) -> str:
    instant = np.datetime64(MIDNIGHT, "s") + np.timedelta64(round(60 * minutes), "s")
    return f"{instant}Z"


def run_of_the_wind(days: int = 3) -> list[float]:
    """The distance [km] since midnight, every ten minutes, in a wind of 2 to 4 m/s."""
    speed = 3 + np.sin(np.arange(144 * days) / 20)
    return np.round(np.cumsum((speed * 0.6).reshape(days, 144), axis=1), 1).ravel().tolist()


def rows(values: list[float], heading: str) -> str:
    body = "".join(f"{stamp(10 * at)},{value:.1f}\n" for at, value in enumerate(values))
    return f"time,{heading}\n{body}"


def test_the_run_of_the_wind_below_a_bare_wind_is_doubted_before_a_unit_is_asked_for(log_file: Write) -> None:
    with pytest.raises(FlagdataError) as refused:
        read_log(log_file(rows(run_of_the_wind(), "wind")), WindOptions())
    assert "only grow" in refused.value.what


def test_with_a_unit_it_is_read_with_the_doubt(read: Read) -> None:
    log = read(rows(run_of_the_wind(), "wind [km/h]"))
    assert [finding.where for finding in log.findings if finding.kind == "speed-only-grows"] == ["line 2"]


def test_a_wind_does_not_only_grow() -> None:
    draws = stream(1, "wandering winds")
    for trial in range(50):
        speeds = np.abs(3 + np.cumsum(draws.normal(0, 0.3, 400)))  # a wind that wanders as slowly as any
        assert not cumulated.grows(np.round(speeds, 1)), trial


def test_a_tunnel_that_is_turned_up_step_by_step_does_not_only_grow() -> None:
    levels = np.repeat(np.arange(0, 21, 1.0), 30)  # 0 to 20 m/s in steps of 1 m/s
    assert not cumulated.grows(levels)


def test_a_sum_that_begins_anew_with_each_direction_is_told(read: Read) -> None:
    sums = [2.5, 4.0, 8.5, 11.0, 15.5, 17.0, 21.5, 24.0, 1.5, 3.0, 1.5, 4.0, 2.5, 5.0, 9.5, 11.0, 13.5, 1.5, 4.0, 5.5]
    log = read(rows([*sums, *sums], "Xws"), wind="Xws", unit="m/s")
    assert [finding.where for finding in log.findings if finding.kind == "speed-may-be-sum"] == ["line 2"]


def test_a_wind_is_no_sum() -> None:
    draws = stream(1, "winds of every memory")
    for trial, memory in enumerate(np.repeat([0.0, 0.5, 0.9, 0.99], 100)):
        wandering = np.zeros(25 + trial % 300)
        for at in range(1, len(wandering)):
            wandering[at] = memory * wandering[at - 1] + np.sqrt(1 - memory**2) * draws.normal()
        for mean in (0.5, 2.0, 6.0):
            assert not cumulated.sums(np.round(np.abs(mean * (1 + wandering)), 1)), (trial, mean)


def test_a_breeze_of_every_day_is_no_sum() -> None:
    hours = np.arange(24 * 5)
    assert not cumulated.sums(np.round(3 + 2.9 * np.sin(hours * np.pi / 12), 1))


@pytest.mark.parametrize(
    ("name", "channel", "height"),
    [("Cup116m_Mean", "wind_speed", 116), ("Cup_40m", "wind_speed", 40), ("Vane113m_Mean", "wind_direction", 113)],
)
def test_a_cup_and_its_height_name_a_speed(name: str, channel: str, height: float) -> None:
    heading = understand(name)
    assert (heading.channel, heading.sure, heading.height) == (channel, True, height)


@pytest.mark.parametrize("name", ["Cup116m_StdDev", "Cup116m_Max", "Cup_temperature", "cup_count", "paper cup id"])
def test_what_else_a_cup_has_is_no_speed(name: str) -> None:
    assert understand(name).channel != "wind_speed"


def test_a_mast_whose_headings_state_no_unit_asks_for_it_and_is_read_with_it(log_file: Write) -> None:
    body = "".join(f"{stamp(10 * k)},{7 + k % 5 / 10:.2f},0.81,{k * 3 % 360}\n" for k in range(60))
    path = log_file(f"Timestamp,Cup116m_Mean,Cup116m_StdDev,Vane113m_Mean\n{body}")
    with pytest.raises(FlagdataError) as refused:
        read_log(path, WindOptions())
    assert "--unit" in str(refused.value.fix)
    channels = read_log(path, WindOptions(unit="m/s")).series.channels
    np.testing.assert_allclose(channels["wind_speed"], [7 + k % 5 / 10 for k in range(60)])
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), [k * 3 % 360 for k in range(60)])


def flight(moves: bool) -> str:
    body = "".join(
        f"{stamp(k / 60)},{45.1 + k * 1e-4 * moves:.5f},7.2,{4 * np.sin(k / 9):.2f},{3 * np.cos(k / 9):.2f},0.1,"
        f"{3 + k % 3 / 10:.2f},{1 + k % 4 / 10:.2f},0.05\n"
        for k in range(60)
    )
    return f"time,Lat,Lon,Vx,Vy,Vz,Um,Vm,Wm\n{body}"


def test_velocities_beside_a_position_that_changes_may_be_the_platforms(log_file: Write) -> None:
    with pytest.raises(FlagdataError) as refused:
        read_log(log_file(flight(moves=True)), WindOptions(unit="m/s"))
    assert "'Lat' changes" in refused.value.what
    assert "'Um', 'Vm', 'Wm'" in refused.value.what
    columns = "time,,,,,,wind_x[m/s],wind_y[m/s],wind_z[m/s]"
    channels = read_log(log_file(flight(moves=True)), WindOptions(columns=columns)).series.channels
    np.testing.assert_allclose(channels["wind_x"], [3 + k % 3 / 10 for k in range(60)])


def test_beside_a_mast_that_stands_still_nothing_is_said_of_a_platform(log_file: Write) -> None:
    with pytest.raises(FlagdataError) as refused:
        read_log(log_file(flight(moves=False)), WindOptions(unit="m/s"))
    assert "changes" not in refused.value.what


def raw_of_pywws(count: int, **cells: str) -> str:
    lines = []
    for k in range(count):
        mean = 1 + k % 5 / 10
        row = {"outdoor": f"{60 + k % 9},{9.9 + k % 7 / 10:.1f}", "wind": f"{mean:.2f},{1.7 * mean:.2f},{k % 16}"}
        row |= cells if k == 3 else {}
        lines.append(f"{stamp(5 * k)[:-1].replace('T', ' ')},5,47,20.8,{row['outdoor']},1012.9,{row['wind']},114.3,0")
    return "\n".join([*lines, ""])


def test_raw_data_of_pywws_are_told_by_their_columns(read: Read) -> None:
    log = read(raw_of_pywws(60))
    channels = log.series.channels
    np.testing.assert_array_equal(log.series.time, (MIDNIGHT + 300 * np.arange(60)) * NANOSECONDS)  # UTC
    np.testing.assert_allclose(channels["wind_speed"], [1 + k % 5 / 10 for k in range(60)])
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), [k % 16 * 22.5 for k in range(60)], atol=1e-9)
    np.testing.assert_allclose(channels["air_temperature"], [273.15 + 9.9 + k % 7 / 10 for k in range(60)])
    np.testing.assert_allclose(channels["relative_humidity"], [(60 + k % 9) / 100 for k in range(60)])
    np.testing.assert_allclose(channels["air_pressure"], 101_290)
    assert "pywws" in {finding.kind for finding in log.findings}


@pytest.mark.parametrize("solar", ["", ",512.3,2", ",,"])
@pytest.mark.parametrize("relative", ["", "1015.2,"])
def test_data_of_solar_stations_and_calibrated_data_of_pywws_are_read_alike(
    read: Read, solar: str, relative: str
) -> None:
    text = raw_of_pywws(60).replace("1012.9,", f"1012.9,{relative}").replace("114.3,0\n", f"114.3,0{solar}\n")
    channels = read(text).series.channels
    np.testing.assert_allclose(channels["wind_speed"], [1 + k % 5 / 10 for k in range(60)])
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), [k % 16 * 22.5 for k in range(60)], atol=1e-9)
    np.testing.assert_allclose(channels["air_pressure"], 101_290)


def test_a_row_in_which_the_outdoor_sensor_was_not_heard_has_no_values(read: Read) -> None:
    log = read(raw_of_pywws(60, outdoor=",", wind=",,"))
    assert np.flatnonzero(np.isnan(log.series.channels["wind_speed"])).tolist() == [3]


def test_twelve_columns_of_other_numbers_are_no_raw_data_of_pywws(log_file: Write) -> None:
    path = log_file(raw_of_pywws(60).replace(",1012.9,", ",12.9,"))
    with pytest.raises(FlagdataError) as refused:
        read_log(path, WindOptions(zone="UTC"))
    assert "--columns" in str(refused.value.fix)


@pytest.mark.parametrize(("heading", "name"), [("timestamp,value\n", "value"), ("", "2")])
def test_the_only_column_of_numbers_is_offered_by_its_name(
    log_file: Callable[[str], Path], heading: str, name: str
) -> None:
    path = log_file(heading + "".join(f"2026-05-01T12:00:{at:02d}Z,{3 + at % 5}.5\n" for at in range(20)))
    with pytest.raises(FlagdataError) as caught:
        read_log(path, WindOptions())
    assert f"--wind {name} --unit m/s" in (caught.value.fix or "")
    series = read_log(path, WindOptions(wind=name, unit="m/s")).series
    assert series.channels["wind_speed"].tolist() == [3.5 + at % 5 for at in range(20)]


@pytest.mark.parametrize(("cell", "offered"), [("", False), ("-0.4", True)])
def test_an_offset_is_offered_only_where_speeds_are_below_zero(log_file: Write, cell: str, offered: bool) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{cell}\n" for at in range(20))
    with pytest.raises(FlagdataError) as caught:
        read_log(log_file(f"time,wind_speed (m/s)\n{rows}"), WindOptions(recipe=None, columns="time,wind_speed[m/s]"))
    assert ("--zero-offset" in (caught.value.fix or "")) is offered
