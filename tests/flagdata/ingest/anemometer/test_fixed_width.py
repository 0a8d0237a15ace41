"""Tables of fixed width with empty cells and names of several words: every row is read, by its columns."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log

Write = Callable[..., Path]
HEAD = "FECHA     HORA  TEMP   HUM   PNM    DD    FF     NOMBRE\n          [HOA]  [C]    [%]  [hPa]  [gr] [km/hr]\n"
PLACES = {"BASE NORTE": True, "RIO": False, "SAN JUAN (EX PUERTO)": True}
"""Names of stations, and whether they measure the pressure."""


def row(place: str, hour: int, *, day: str = "25082026") -> str:
    pressure = f"{1020 + hour / 10:7.1f}" if PLACES[place] else " " * 7
    weather = f"{10 + hour / 10:5.1f} {70 + hour:4d} {pressure}"
    return f" {day} {hour:5d} {weather} {10 * hour + 10:4d} {5 + hour:4d}     {place:<30}\n"


def rows(day: str = "25082026") -> str:
    return "".join(row(place, hour, day=day) for place in PLACES for hour in range(24))


def test_every_row_is_read_by_its_columns(log_file: Write) -> None:
    path = log_file(HEAD + rows())
    options = WindOptions(zone="-03:00")
    assert anemometers(path, options) == tuple(PLACES)
    for place in PLACES:
        series = read_log(path, WindOptions(zone="-03:00", wind=place)).series
        start = np.datetime64("2026-08-25T03:00", "ns")
        np.testing.assert_array_equal(series.time, (start + np.arange(24) * np.timedelta64(1, "h")).astype(np.int64))
        np.testing.assert_allclose(series.channels["wind_speed"], (5 + np.arange(24)) / 3.6)
        np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), 10.0 * np.arange(24) + 10)


def test_a_table_without_empty_cells_is_read_as_before(log_file: Write) -> None:
    text = HEAD + "".join(row("RIO", hour).replace(" " * 8, "  1013.2", 1) for hour in range(24))
    log = read_log(log_file(text), WindOptions(zone="-03:00", unit="km/h"))
    assert "fixed-width" not in {finding.kind for finding in log.findings}
    assert len(log.series) == 24


def test_days_of_eight_digits_whose_order_nothing_tells_are_asked_for(log_file: Write) -> None:
    path = log_file(HEAD + rows(day="05082026"))
    with pytest.raises(FlagdataError, match="day/month or month/day"):
        read_log(path, WindOptions(zone="UTC"))
    first = read_log(path, WindOptions(zone="UTC", date_order="mdy", wind="RIO")).series.time[0]
    assert first == np.datetime64("2026-05-08T00:00", "ns").astype(np.int64)


def test_rows_of_another_form_above_those_that_are_read_are_told(log_file: Write) -> None:
    long = "".join(f"25082026 {hour} 9.7 74 1023.7 60 26 A B\n" for hour in range(20))
    short = "".join(f"{25 + hour // 24}082026 {hour % 24} 4.4 86 990 7 C\n" for hour in range(30))
    columns = "date[%d%m%Y],hour,,,wind_direction[deg],wind_speed[km/h],site"
    log = read_log(log_file(long + short), WindOptions(columns=columns, zone="UTC"))
    assert any("20 of lines 1 to 20" in finding.what for finding in log.findings)
