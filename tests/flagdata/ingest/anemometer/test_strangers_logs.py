"""Tables as public services and makers write them: none is wrong in silence, most are right with what they leave out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]


def first_instant(log: WindLog) -> str:
    return str(np.datetime64(int(log.series.time[0]), "ns"))[:19]


def refusal(path: Path, options: WindOptions | None = None) -> FlagdataError:
    with pytest.raises(FlagdataError) as caught:
        read_log(path, options or WindOptions())
    return caught.value


def test_ten_digits_that_are_a_date_and_an_hour_are_no_unix_time(read: Read) -> None:
    rows = "".join(f"2667;20230701{hour:02d};1;{4 + hour / 10:.1f};{130 + hour};eor\n" for hour in range(12))
    log = read(f"STATIONS_ID;MESS_DATUM;QN_3;FF;DD;eor\n{rows}", unit="m/s", zone="UTC")
    assert first_instant(log) == "2023-07-01T00:00:00"
    assert np.diff(log.series.time).tolist() == [3600 * 10**9] * 11


def test_ten_digits_that_are_no_date_are_unix_time(read: Read) -> None:
    rows = "".join(f"{1688169600 + at},{4 + at / 10:.1f}\n" for at in range(12))
    assert first_instant(read(f"time,wind speed (m/s)\n{rows}")) == "2023-07-01T00:00:00"


def test_seconds_of_another_year_than_the_dates_beside_them_are_not_unix_time(read: Read) -> None:
    heading = "Time and Date,Timestamp (seconds),Horizontal Wind Speed (m/s) at 38m,Wind Direction (deg) at 38m"
    rows = "".join(f"2023-07-13 00:00:{at:02d},{771_000_000 + at},{4 + at / 10:.1f},{130 + at}\n" for at in range(12))
    assert first_instant(read(f"{heading}\n{rows}", zone="UTC")) == "2023-07-13T00:00:00"


def test_unix_time_that_agrees_with_the_dates_beside_it_is_taken_since_it_needs_no_zone(read: Read) -> None:
    rows = "".join(f"2023-07-01 02:00:{at:02d},{1688169600 + at},{4 + at / 10:.1f}\n" for at in range(12))
    assert first_instant(read(f"local time,timestamp,wind speed (m/s)\n{rows}")) == "2023-07-01T00:00:00"


def test_directions_in_tens_of_degrees_are_scaled(read: Read) -> None:
    rows = "".join(f'"2023-07-01 {hour:02d}:00","{20 + hour}","13"\n' for hour in range(12))
    log = read(f'"Date/Time (LST)","Wind Dir (10s deg)","Wind Spd (km/h)"\n{rows}', zone="-05:00")
    assert np.degrees(log.series.channels["wind_direction"][:2]).tolist() == pytest.approx([200.0, 210.0])


def test_whole_directions_up_to_36_without_a_unit_are_left_out(read: Read) -> None:
    rows = "".join(f"2023-07-01T{hour:02d}:00:00Z,{18 + hour},4.{hour}\n" for hour in range(12))
    log = read(f"time,wind dir,wind speed (m/s)\n{rows}")
    assert "wind_direction" not in log.series.channels
    assert "tens of degrees" in " ".join(finding.what for finding in log.findings)


@pytest.mark.parametrize("order", ["MM/DD/YYYY", "DD/MM/YYYY"])
def test_the_order_of_dates_that_the_heading_spells_is_heeded(read: Read, order: str) -> None:
    rows = "".join(f"07/01/2023,12:00:{at:02d},{4 + at / 10:.1f}\n" for at in range(12))
    log = read(f"DATE ({order}),UTC,Avg Wind Speed @ 2m [m/s]\n{rows}")
    assert first_instant(log) == ("2023-07-01T12:00:00" if order.startswith("MM") else "2023-01-07T12:00:00")


@pytest.mark.parametrize("other", ["Dispersion", "Shear", "Ratio", "Setpoint"])
def test_statistics_of_a_wind_are_no_anemometer_of_their_own(log_file: Write, other: str) -> None:
    rows = "".join(f"2023-07-01T00:00:{at:02d}Z,4.{at},0.{at}\n" for at in range(9))
    path = log_file(f"time,40m Wind Speed (m/s),40m Wind Speed {other} (m/s)\n{rows}")
    assert anemometers(path) == ()
    assert read_log(path).series.channels["wind_speed"][1] == pytest.approx(4.1)


def test_a_component_along_an_axis_of_the_earth_is_no_speed(log_file: Write) -> None:
    rows = "".join(f"2023-07-01T00:00:{at:02d}Z,-4.{at},0.{at}\n" for at in range(9))
    path = log_file(f"time,windspeed_north (m/s),windspeed_east (m/s)\n{rows}")
    assert "no column is surely a wind" in refusal(path).what


def test_a_fast_count_may_be_of_microseconds(log_file: Write) -> None:
    rows = "".join(f"{12_000_000 + 100_000 * at},{4 + at / 10:.1f}\n" for at in range(12))
    error = refusal(log_file(f"timestamp,wind speed (m/s)\n{rows}"))
    assert "ms of a slow logger, or us of a fast one" in error.what
    assert "elapsed-us" in error.fix
