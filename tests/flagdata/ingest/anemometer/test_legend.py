"""Headings that lines above explain, on made files of the layouts of archives."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.signals import WindLog

Write = Callable[[str], Path]

ARCHIVE = """ARCHIVE OF DAILY DATA, file created on 01-03-2021

FILE FORMAT (MISSING VALUE CODE IS -9999):

01-06 STAID: Station identifier
08-15 DATE : Date YYYYMMDD
17-21 FG   : Mean wind speed in 0.1 m/s
23-27 Q_FG : quality code for FG (0='valid'; 1='suspect'; 9='missing')

STAID,    DATE,   FG, Q_FG
"""
MAST = """% Mast at a test field
% YY   - year
% MM   - month
% DD   - day
% hh   - hour (UTC)
% mm   - minute
% U10  - wind speed at 10 m above ground (m/s)
% D10  - wind direction at 10 m (degrees)
% T    - air temperature (deg C)
% YY MM DD hh mm U10 D10 T
"""
STATION = """Station: 1234, somewhere
Parameters:
DIR = Wind direction (degrees true)
SPD = Wind speed (knots)
GST = Wind gust (knots)
BAR = Barometer (hPa)

Date,DIR,SPD,GST,BAR
"""


def only(path: Path, **options: str) -> WindLog:
    return read_log(path, WindOptions(**options))


def test_an_explanation_gives_quantity_and_unit(log_file: Write) -> None:
    rows = "".join(f"     1,197301{day:02d},{10 * day:5d},    0\n" for day in range(1, 9))
    log = only(log_file(ARCHIVE + rows.replace("   30,    0", "-9999,    9")), zone="UTC")
    expected = np.arange(1.0, 9.0)
    expected[2] = np.nan
    np.testing.assert_allclose(log.series.channels["wind_speed"], expected)
    assert "explained-headings" in {finding.kind for finding in log.findings}


def test_columns_divided_by_blanks_with_the_parts_of_their_date_explained(log_file: Write) -> None:
    rows = "".join(f"2019 01 01 00 {minute:02d} {4 + minute / 10} 210 3.4\n" for minute in range(0, 50, 10))
    log = only(log_file(MAST + rows))
    assert log.series.channels["wind_speed"].tolist() == [4.0, 5.0, 6.0, 7.0, 8.0]
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"]), 210)
    assert log.series.time[0] == 1_546_300_800 * 10**9
    assert np.all(np.diff(log.series.time) == 600 * 10**9)


def test_a_gust_that_is_explained_is_not_the_mean(log_file: Write) -> None:
    rows = "".join(f"2018-05-01 {hour:02d}:00,{100 + hour},{hour},{hour + 5},1013\n" for hour in range(6))
    path = log_file(STATION + rows)
    assert not anemometers(path, WindOptions(zone="UTC"))
    log = only(path, zone="UTC")
    np.testing.assert_allclose(log.series.channels["wind_speed"], np.arange(6) * 1852 / 3600)
    np.testing.assert_allclose(log.series.channels["air_pressure"], 101_300)


@pytest.mark.parametrize("unit", ["(en m/s)", "(in m/s)", "en m/s"])
def test_a_unit_behind_a_preposition(log_file: Write, unit: str) -> None:
    heading = f"ID : Numéro de la station\nAAAAMMJJ : jour de la mesure\nFF: VENT MOYEN 10 mn {unit}\nAAAAMMJJ;ID;FF\n"
    rows = "".join(f"202101{day:02d};7;{day},5\n" for day in range(1, 9))
    assert only(log_file(heading + rows), zone="UTC").series.channels["wind_speed"].tolist() == [
        d + 0.5 for d in range(1, 9)
    ]


def test_headings_that_say_enough_stay(log_file: Write) -> None:
    text = "Wind: of the roof\nTemp: below\nTime,Wind [m/s],Temp [C]\n"
    text += "".join(f"2020-01-01T00:{minute:02d}:00Z,{minute}.5,20\n" for minute in range(6))
    log = only(log_file(text))
    assert "explained-headings" not in {finding.kind for finding in log.findings}
    assert log.series.channels["wind_speed"].tolist() == [minute + 0.5 for minute in range(6)]


SPAN = """% Start_Time [UTC]: 20200101T000000Z
% End_Time [UTC]: 20200101T235959Z
%
% when: Acquisition time
% ws: Mean wind speed [Knt]
% wd: Wind direction [degrees N]

time,ws,wd
"""


def test_a_span_in_utc_is_the_zone_of_stamps_that_name_none(log_file: Write) -> None:
    rows = "".join(f"2020-01-01 00:{minute:02d}:00,{minute},20\n" for minute in range(6))
    log = only(log_file(SPAN + rows))
    assert log.series.time[0] == 1_577_836_800 * 10**9
    np.testing.assert_allclose(log.series.channels["wind_speed"], np.arange(6) * 1852 / 3600)


@pytest.mark.parametrize(("zone", "hours"), [("Z", 0), ("+02:00", 2)])
def test_a_span_in_utc_says_nothing_of_stamps_with_a_zone(log_file: Write, zone: str, hours: int) -> None:
    rows = "".join(f"2020-01-01T00:{minute:02d}:00{zone},{minute},20\n" for minute in range(6))
    log = only(log_file(SPAN + rows))
    assert log.series.time[0] == (1_577_836_800 - 3600 * hours) * 10**9
    assert not any("UTC" in finding.what for finding in log.findings)
