"""Rows in brackets, lists in JSON, and messages of several kinds: the rows and the directions are all there."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[[str], Path]
_SPEEDS = [3.0 + 0.25 * (at % 5) for at in range(20)]
_DIRECTIONS = [200.0 + at for at in range(20)]


def _check(path: Path, **options: object) -> None:
    channels = read_log(path, WindOptions(**options)).series.channels  # type: ignore[arg-type]
    np.testing.assert_allclose(channels["wind_speed"], _SPEEDS)
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), _DIRECTIONS)


@pytest.mark.parametrize(
    "row",
    [
        "('{stamp}', {speed}, {direction})",
        "['{stamp}', {speed}, {direction}],",
        "INSERT INTO wind VALUES ('{stamp}', {speed}, {direction});",
        "INSERT INTO `wind` (t, s, d) VALUES ('{stamp}', {speed}, {direction});",
    ],
)
def test_rows_in_brackets_are_rows(log_file: Write, row: str) -> None:
    rows = [
        row.format(stamp=f"2026-05-01 12:00:{at:02d}", speed=speed, direction=direction)
        for at, (speed, direction) in enumerate(zip(_SPEEDS, _DIRECTIONS, strict=True))
    ]
    _check(log_file("\n".join(rows)), columns="time,wind_speed[m/s],wind_direction[deg]", zone="UTC")


def test_the_one_list_of_an_object_holds_its_rows(log_file: Write) -> None:
    rows = ",".join(
        f'{{"at":"2026-05-01T12:00:{at:02d}Z","winddirAvg":{direction},"metric":{{"windspeedAvg":{speed}}}}}'
        for at, (speed, direction) in enumerate(zip(_SPEEDS, _DIRECTIONS, strict=True))
    )
    _check(log_file(f'{{"station":"roof","observations":[{rows}]}}'), unit="m/s")


def test_directions_in_messages_of_their_own_are_read_beside_the_speeds(log_file: Write) -> None:
    text = ""
    for at, (speed, direction) in enumerate(zip(_SPEEDS, _DIRECTIONS, strict=True)):
        text += f"[12:00:{at:02d}][D][sensor:094]: 'Wind Speed': Sending state {speed} m/s with 1 decimals\n"
        text += f"[12:00:{at:02d}][D][sensor:094]: 'Wind Direction': Sending state {direction} ° with 0 decimals\n"
    _check(log_file(text), zone="UTC", date=dt.date(2026, 5, 1))


def test_a_word_may_stand_before_the_stamp_of_lines_that_name_their_numbers(log_file: Write) -> None:
    text = "".join(
        f"LOOP:   2026-05-01 12:00:{at:02d} UTC (17776368{at:02d}) outTemp: 70.1, windDir: {direction}, "
        f"windSpeed: {speed}\n"
        for at, (speed, direction) in enumerate(zip(_SPEEDS, _DIRECTIONS, strict=True))
    )
    _check(log_file(text), zone="UTC", unit="m/s")


def test_the_users_unit_is_of_the_speeds_without_one(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,10.0,10.0,30,40\n" for at in range(12))
    log = read_log(log_file(f"time,AWS (kts),TWS,AWA,TWA\n{rows}"), WindOptions(unit="m/s"))
    assert log.series.channels["apparent_wind_speed"][0] == pytest.approx(10 * 1852 / 3600)
    assert log.series.channels["theoretical_wind_speed"][0] == 10.0


@pytest.mark.parametrize(("heading", "channel"), [("(T)", "wind_direction"), ("(M)", "wind_direction_magnetic")])
def test_a_letter_behind_a_direction_is_its_north(log_file: Write, heading: str, channel: str) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,3.5,{200 + at}\n" for at in range(12))
    log = read_log(log_file(f"time,Wind speed (kts),Wind Dir {heading}\n{rows}"))
    assert np.rad2deg(log.series.channels[channel][0]) == pytest.approx(200)


def test_a_heading_spells_the_order_of_a_date_in_digits(log_file: Write) -> None:
    rows = "".join(f"260501,1200{at:02d},3.5\n" for at in range(12))
    log = read_log(log_file(f"YYMMDD,HHMMSS,Wind speed (m/s)\n{rows}"), WindOptions(zone="UTC"))
    assert log.series.time.astype("datetime64[ns]")[0] == np.datetime64("2026-05-01T12:00:00")


def test_the_line_for_a_direction_from_either_north_reads_the_rest_too(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,10.0,30,{200 + at}\n" for at in range(12))
    path = log_file(f"time,AWS (kts),AWA,TWD\n{rows}")
    remark = next(finding.what for finding in read_log(path).findings if finding.kind == "columns-not-read")
    channels = read_log(path, WindOptions(columns=remark.split('"')[1])).series.channels
    assert {"apparent_wind_speed", "apparent_wind_direction", "wind_direction"} <= set(channels)


def test_line_breaks_of_html_at_the_ends_of_lines_are_nothing(log_file: Write) -> None:
    rows = "".join(
        f"2026-05-01 12:00:{at:02d},{speed},{direction},x,\n<br>\n"
        for at, (speed, direction) in enumerate(zip(_SPEEDS, _DIRECTIONS, strict=True))
    )
    _check(log_file(f"Time,WindSpeedMPH,WindDirectionDegrees,Note<br>\n{rows}"), zone="UTC", unit="m/s")


def test_stamps_of_a_flux_tower_without_seconds_are_read_to_the_minute(log_file: Write) -> None:
    rows = "".join(f"2026050112{at:02d},3.5,{200 + at}\n" for at in range(12))
    log = read_log(log_file(f"TIMESTAMP,WS_1_1_1,WD_1_1_1\n{rows}"), WindOptions(zone="UTC"))
    assert log.format == "fluxnet"
    assert np.all(np.diff(log.series.time) == 60_000_000_000)


def test_decimal_commas_in_quotes_are_decimal_points(log_file: Write) -> None:
    rows = "".join(
        f'"01.05.2026 12:00:{at:02d}","{speed:.2f}","{direction:.1f}"\n'.replace(".", ",").replace(
            ",05,2026", ".05.2026"
        )
        for at, (speed, direction) in enumerate(zip(_SPEEDS, _DIRECTIONS, strict=True))
    )
    _check(log_file(f'"Zeit","Wind (m/s)","Richtung (°)"\n{rows}'), zone="UTC")


def test_commas_before_three_digits_may_divide_thousands_and_stay(log_file: Write) -> None:
    rows = "".join(f'2026-05-01T12:00:{at:02d}Z,3.5,"1,013"\n' for at in range(12))
    log = read_log(log_file(f'time,Wind (m/s),"Pressure"\n{rows}'))
    assert "air_pressure" not in log.series.channels


def test_three_velocities_along_axes_are_offered_as_components(log_file: Write) -> None:
    rows = "".join(f"{at / 10},3.5,0.1,0.2\n" for at in range(12))
    path = log_file(f"t[s],Vx[m/s],Vy[m/s],Vz[m/s]\n{rows}")
    with pytest.raises(FlagdataError) as caught:
        read_log(path)
    assert "wind_x[m/s],wind_y[m/s],wind_z[m/s]" in (caught.value.fix or "")


def test_radians_are_offered_where_angles_are_a_turn_at_most(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,3.5,4.{at:02d}\n" for at in range(12))
    log = read_log(log_file(f"time,wind speed (m/s),angle\n{rows}"))
    assert any("wind_direction[rad]" in finding.what for finding in log.findings)
